"""Arguments and fields of another kind than their type are refused by name, whatever they are."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike
from plans import small_plan
from scenes import SMALL, hand, observation

import sgnlp
from sgnlp.base.checked import Typed, require, typed
from sgnlp.base.errors import InputError, SgnlpError
from sgnlp.control import Controller, command
from sgnlp.perception.observation import Reading

RAGGED = [1, [2]]
ODD = (
    *(None, "text", "", 3, -1, 0, 2.5, np.nan, np.inf, 1j, True, b"x", object(), int, Path("nowhere"), {}, {"a"}, []),
    *([1, 2], (1, 2, 3), RAGGED, np.zeros(3), np.full((5, 3), np.nan), np.zeros((0, 3)), np.array(["a"])),
    *(np.float64(0.5), np.float32(np.nan), np.int64(2), np.array(None, object), np.array(0.5)),
)
"""Values that are wrong for most arguments."""
EYE = np.diag([1.0, -1.0, -1.0, 1.0])
IMAGE = {"depth": np.full((9, 9), 0.5), "mask": np.eye(9), "intrinsics": np.eye(3), "pose": EYE, "unit": 1.0}
IMAGE |= {"name": "a", "notes": ()}
SHAPE = {"name": "a", "centre": np.zeros(3), "rotation": np.eye(3), "half": np.ones(3), "radius": 0.0}
SHAPE |= {"circular": False}


@dataclass(frozen=True)
class Thing(Typed):
    """A field of every kind."""

    called = "a thing"
    number: float = 0.0
    words: Sequence[str] = ()
    way: str | Path = ""
    array: np.ndarray | None = None
    name: Literal["a", "b"] = "a"
    kind: type[Typed] | None = None
    anything: Any = None


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"number": "1"}, "the number of a thing must be a number, not '1'"),
        ({"number": True}, "the number of a thing must be a number, not True"),
        ({"words": "one"}, "the words of a thing must be a list, each part a text, not 'one'"),
        ({"words": ["one", 2]}, "the words of a thing must be a list, each part a text"),
        ({"way": b"x"}, "the way of a thing must be a text or a path, not b'x'"),
        ({"array": [1.0]}, r"the array of a thing must be an array or None, not \[1.0\]"),
        ({"name": np.zeros(2)}, "the name of a thing must be"),
        ({"kind": Typed()}, "the kind of a thing must be"),
    ],
)
def test_a_field_of_another_kind_is_refused_by_name(given, said):
    if isinstance(given.get("kind"), Typed):
        given = {"kind": Thing()}
    with pytest.raises(InputError, match=said):
        Thing(**given)


def test_what_is_of_the_kind_passes():
    Thing(np.float32(1), ["a", "b"], Path("x"), np.zeros(2), "b", Thing, 1j)
    Thing(np.array(1.0), ("a",))


@typed
def told(points: ArrayLike, count: int = 1, *rest: int, **more: int) -> str:
    """A function."""
    return f"{points} {count} {rest} {more}"


def test_the_arguments_of_a_function_are_those_of_its_types_and_what_it_does_stays():
    assert told([1], 2, "c", d="e") == "[1] 2 ('c',) {'d': 'e'}"
    with pytest.raises(InputError, match=r"count must be a whole number, not 2\.5"):
        told([1], 2.5)
    with pytest.raises(TypeError, match=r"told\(\) missing 1 required positional argument: 'points'"):
        told(count=1)


NAMES = ("preset", "load_hand", "load", "reading", "observe", "observation", "image", "from_depth", "segment", "shape")
NAMES += ("touch", "painted", "load_grasps", "load_trajectory", "load_shapes", "extension", "terms", "constraints")
NAMES += ("ipopt", "solver", "answer", "kernel", "grasps", "posture", "torques")


@lru_cache
def calls() -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Public names with arguments that they take."""
    one, file, seen = small_plan(), Path("nowhere"), observation()
    grasps, cloud = one.arrays(), {"points": seen.points, "views": None, "view_names": None, "table_height": 0.0}
    cloud |= {"scale": 1.0, "name": "a", "view": None, "mass": None, "friction": None, "notes": (), "pose": None}
    cloud |= {"camera_positions": None, "obstacle_points": None, "mesh_vertices": None, "background": None}
    run = Controller(hand(), command(grasps))
    now = {"time": 0.0, "wrist": grasps.wrist[0], "joints": grasps.joints[0], "speeds": grasps.joints[0]}
    arm = {"name_or_folder": "allegro_left", "spheres": "cover", "arm": "ur5", "arm_base": (), "kinematics": None}
    return {
        "preset": (sgnlp.preset, {"name": "robust"}),
        "load_hand": (sgnlp.load_hand, arm),
        "load": (sgnlp.load, {"path": file, "reading": Reading()}),
        "reading": (Reading, {"views": (), "scale": 1.0, "table_height": None, "key": None, "up": "z", "pose": None}),
        "observe": (sgnlp.observe, cloud),
        "observation": (sgnlp.Observation, {k: v for k, v in vars(seen).items() if k in seen.__dataclass_fields__}),
        "image": (sgnlp.DepthImage, IMAGE),
        "from_depth": (sgnlp.from_depth, {"images": sgnlp.DepthImage(**IMAGE), "name": "a", "table_height": 0.0}),
        "segment": (sgnlp.segment, {"views": seen.points, "pose": None, "table_height": 0.0, "notes": ()}),
        "shape": (sgnlp.Shape, SHAPE),
        "touch": (sgnlp.Touch, {"point": [0, 0, 0], "normal": [0, 0, 1]}),
        "painted": (sgnlp.painted, {"points": np.zeros((2, 3)), "radius": 0.1, "name": "a"}),
        "load_grasps": (sgnlp.load_grasps, {"path": file}),
        "load_trajectory": (sgnlp.load_trajectory, {"path": file}),
        "load_shapes": (sgnlp.load_shapes, {"file": file}),
        "extension": (sgnlp.extension, {"file": file}),
        "terms": (sgnlp.terms, {"settings": SMALL}),
        "constraints": (sgnlp.constraints, {"settings": SMALL}),
        "ipopt": (sgnlp.Ipopt, {"tolerance": None, "hessian": "exact", "mu_init": None, "warm_start": False}),
        "solver": (sgnlp.Solver, {"tolerance": None}),
        "answer": (sgnlp.Answer, {"x": np.zeros(2), "status": "", "iterations": 0, "calls": None, "way": {}}),
        "kernel": (sgnlp.Kernel, {"support_radius": 1.0, "amplitude": 0.1}),
        "grasps": (sgnlp.Grasps, {k: v for k, v in vars(grasps).items() if k in grasps.__dataclass_fields__}),
        "posture": (grasps.posture, {"rank": 0}),
        "torques": (run.torques, now),
    }


@pytest.mark.parametrize("name", NAMES)
def test_no_value_of_another_kind_leads_to_any_other_error(name):
    call, given = calls()[name]
    for argument in given:
        for value in ODD:
            try:
                call(**given | {argument: value})
            except SgnlpError:
                continue


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("centre", [0, 0], "the centre of 'a' must be three numbers"),
        ("half", [0, 0, np.nan], "the half of 'a' must be three numbers"),
        ("half", [1, -1, 1], "the half extents of 'a' must not be negative"),
        ("rotation", 2 * np.eye(3), "the rotation of 'a' must be a rotation matrix"),
        ("radius", np.nan, "the radius of 'a' must be a finite number"),
        ("circular", 1, "the circular of a shape must be True or False"),
        ("name", 3, "the name of a shape must be a text"),
    ],
)
def test_a_shape_without_its_constructors_is_checked_too(field, value, said):
    with pytest.raises(InputError, match=said):
        sgnlp.Shape(**SHAPE | {field: value})


def test_the_views_of_a_set_have_an_order_of_their_own():
    points = observation().points
    view = np.arange(len(points)) % 2
    names = {"b", "a", "1", "0"}
    assert Reading(views=names).views == ("0", "1", "a", "b")
    given = {"points": points, "view": view, "table_height": 0.0}
    digests = {sgnlp.observe(**given, views=views).digest for views in ({"1", "0"}, ["0", "1"], {0, 1})}
    assert len(digests) == 2  # numbers and names
    of_arrays = (np.array(["0", "1"]), frozenset("10"), ("0", "1"))
    assert len({sgnlp.observe(**given, views=views).digest for views in of_arrays}) == 1
    assert Reading(views=range(2)).views == ("0", "1")


def test_numbers_in_an_array_are_a_list_and_valid_words_are_listed():
    require("a base", np.zeros(3), Sequence[float])
    require("a flag", np.True_, bool)
    with pytest.raises(InputError, match="a base must be a list, each part a number, not array"):
        require("a base", np.array(["x"]), Sequence[float])
    with pytest.raises(InputError, match=r"kinematics must be one of 'pinocchio\.casadi', .* or None, not 'foo'"):
        sgnlp.load_hand("allegro_left", kinematics="foo")
    with pytest.raises(TypeError, match=r"observe\(\)"):
        sgnlp.observe(observation().points, tabel_height=0)
