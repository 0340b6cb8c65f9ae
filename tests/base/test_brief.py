"""Objects that hold arrays print themselves in a few words, so that a notebook stays readable."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from plans import small_plan

import sgnlp
from sgnlp.base.brief import brief
from sgnlp.control import Controller, command

LONGEST = 2000
"""So many characters fill a third of a notebook's page."""


@dataclass(frozen=True)
class Thing:
    """A value of every kind."""

    name: Any = "can"
    values: Any = field(default_factory=lambda: np.zeros((5, 3)))
    one: Any = field(default_factory=lambda: np.float64(0.123456789))
    none: Any = None
    few: Any = ("a", "b")
    many: Any = tuple(range(9))
    inner: Any = field(default_factory=object)
    path: Any = Path("urdf/hand")

    __repr__ = brief

    @property
    def rows(self) -> int:
        """How many rows the values have."""
        return len(self.values)


def test_arrays_print_their_shape_and_other_parts_a_value_a_number_or_a_class():
    shown = "name='can', values=array of (5, 3), one=0.123457, none=None, few=('a', 'b'), many=tuple of 9, "
    assert repr(Thing()) == f"Thing({shown}inner=object, path='urdf/hand')"


def test_long_texts_are_cut_and_properties_come_after_the_first_field():
    text = brief(Thing(name="x" * 1000), "rows")
    assert len(text) < 300
    assert text.index("name=") < text.index("rows=5") < text.index("values=")


def printed() -> dict[str, object]:
    """What a user of the Python interface gets or makes, by name."""
    plan = small_plan()
    first, grasps = plan.solutions[0], plan.arrays()
    images = sgnlp.DepthImage(np.zeros((480, 640)), None, np.eye(3))
    hand = plan.problem.hand
    carried = sgnlp.load_hand("allegro_left", arm="panda")
    return {
        **{type(part).__name__: part for part in (plan, first, first.grasp, grasps, hand, plan.observation, images)},
        **{type(part).__name__: part for part in (plan.problem, plan.problem.gpis, carried.arm, sgnlp.Answer(first.c))},
        "Command": Controller(hand, command(grasps)).command,
    }


def test_everything_that_holds_arrays_prints_itself_on_a_part_of_a_page():
    texts = {name: repr(part) for name, part in printed().items()}
    assert {name for name, text in texts.items() if not text.startswith(f"{name}(")} == set()
    assert {name: len(text) for name, text in texts.items() if len(text) > LONGEST or "\n" in text} == {}


def test_a_solution_says_first_whether_it_is_feasible():
    first = small_plan().solutions[0]
    assert repr(first).startswith(f"Solution(start={first.start}, feasible={first.feasible}, worst_margin=")
