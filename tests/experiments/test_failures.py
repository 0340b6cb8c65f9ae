"""Failed trials looked at again: what went otherwise than planned, and the page with the pictures."""

import io
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from PIL import Image
from scenes import SMALL, impossible
from test_trials import HEAVY, row, setup

from sgnlp.base.presets import ROBUST
from sgnlp.experiments.cli import failures as page
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import comparison, failures
from sgnlp.experiments.studies.failures import Failed
from sgnlp.experiments.studies.study import Setup
from sgnlp.experiments.studies.trials import NO_PLAN, Condition

CAN = Path(__file__).parents[2] / "problems" / "can_1.npz"
FINGERS = ("index", "middle", "ring", "thumb")


def failed(errors: tuple[float, ...] = (0.0,) * 4, premature: tuple[str, ...] = (), **changes: object) -> Failed:
    """A made-up failure of a hand with four fingers."""
    hand = SimpleNamespace(fingers=[SimpleNamespace(name=name) for name in FINGERS])
    plan: Any = SimpleNamespace(problem=SimpleNamespace(hand=hand), observation=None, arrays=lambda: None)
    trace = SimpleNamespace(time=np.array([1.0, 2.0]), phase=np.array(["close", "lift"]))
    outcome: Any = SimpleNamespace(closing=SimpleNamespace(premature=premature), trace=trace, ending="not lifted")
    return Failed(row(ending="not lifted", score=0.0, **changes), plan, outcome, np.array(errors))


def test_what_went_otherwise_is_told_in_the_order_in_which_it_came():
    trial = failed((0.0, 0.0061, -0.0072, 0.0), ("link_2.0",), shift_error_mm=14.4, slip_mm=12.0)
    assert trial.reasons == [
        "middle: the true surface is 6 mm behind the estimated one",
        "ring: the true surface is 7 mm before the estimated one",
        "link_2.0 touch before the last pad",
        "the equilibrium is 14 mm off the planned one",
        "a pad slides 12 mm",
    ]


def test_where_all_went_as_planned_the_rise_is_told():
    assert failed(rise_mm=7.8).reasons == ["the object rises 8 mm only"]


def test_a_collision_and_a_plan_without_grasp_are_reasons():
    collided = replace(failed(), row=row(ending="in collision", penetration_mm=6.2))
    assert collided.reasons == ["the pregrasp is 6 mm inside"]
    assert replace(failed(), row=row(ending=NO_PLAN), outcome=None).reasons == [NO_PLAN]


def test_the_name_of_a_failure_is_fit_for_a_file():
    assert failed(load=HEAVY).name == "can_1-2-views-0.3-kg-mu-0.6"


def test_only_plain_conditions_of_the_held_out_half_are_looked_at():
    rows = [row(score=0.0), row(), row(score=0.5), row(score=0.0, half="tuning")]
    rows += [row(score=0.0, condition="bilevel low, 2 views")]
    assert list(comparison.failed(frame(rows)).index) == [0, 2]


def test_a_trial_carried_out_again_measures_the_surface_at_the_contacts():
    again = failures.again(setup(settings=ROBUST), {"can_1": CAN}, [Condition("2 views", 2)], row(ending="slid"))
    assert again.outcome is not None
    assert again.surface_errors.shape == (4,)
    assert 0 < np.abs(again.surface_errors).max() < 0.05
    none = failures.again(
        setup(settings=impossible(SMALL)), {"can_1": CAN}, [Condition("2 views", 2)], row(ending=NO_PLAN)
    )
    assert (none.outcome, none.reasons) == (None, [NO_PLAN])


def test_the_page_has_a_line_and_a_picture_for_each(tmp_path, monkeypatch):
    content = io.BytesIO()
    Image.new("RGB", (12, 4)).save(content, "PNG")
    monkeypatch.setattr(page, "scene", lambda *_: SimpleNamespace(views=[None, None]))
    monkeypatch.setattr(page, "picture", lambda shown, rank, stage: content.getvalue())
    for name in ("true_body", "command", "prepared"):
        monkeypatch.setattr(page, name, lambda *_: None)
    ended: list[object] = []
    bar: Any = SimpleNamespace(advance=ended.append)
    page.write(tmp_path, [failed(rise_mm=3.0)], bar)
    assert len(ended) == 1
    assert (tmp_path / "failures" / "can_1-2-views-0.1-kg-mu-1.jpg").read_bytes()[:2] == b"\xff\xd8"
    text = (tmp_path / "failures.md").read_text(encoding="utf-8")
    assert "| can_1 | 2 views | 0.1 kg, μ 1 | not lifted | the object rises 3 mm only | ![can_1-2-views-0.1-" in text


def test_no_failure_is_told_too(tmp_path):
    bar: Any = SimpleNamespace(advance=lambda trial: None)
    page.write(tmp_path, [], bar)
    assert (tmp_path / "failures.md").read_text(encoding="utf-8") == "Nothing failed.\n"


def test_the_rows_of_a_comparison_lead_to_its_trials(monkeypatch):
    seen: list[tuple[object, ...]] = []
    monkeypatch.setattr(comparison, "again", lambda *arguments: seen.append(arguments))
    lost = row(score=0.0)
    made: Setup = setup()
    assert list(comparison.looked_at(made, [lost, row()])) == [None]
    assert seen == [(made, {"can_1": CAN}, comparison.CONDITIONS, lost)]
