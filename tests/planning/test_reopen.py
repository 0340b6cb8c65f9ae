"""The source of a result is found from any working folder, and after a move together with the result."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plans import small_plan

from sgnlp.base.errors import InputError
from sgnlp.cli import again
from sgnlp.hand import library
from sgnlp.hand.hand import load_hand
from sgnlp.planning import reopen, results
from sgnlp.planning.grasps import Grasps


def solved(source: str) -> Grasps:
    """A result that was planned here from a file of that name."""
    plan = small_plan()
    return replace(plan, observation=replace(plan.observation, source=source)).arrays()


@pytest.mark.parametrize("name", ["x.npz", "../x.npz", "clouds/x.npz"])
def test_a_relative_source_is_found_from_elsewhere_and_after_a_move(tmp_path, monkeypatch, name):
    work = tmp_path / "old" / "work"
    for folder in (work / "clouds", tmp_path / "elsewhere"):
        folder.mkdir(parents=True)
    monkeypatch.chdir(work)
    Path(name).touch()
    grasps = solved(name)
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert reopen.source(grasps, Path("../old/work/results/x")).resolve() == (work / name).resolve()
    (tmp_path / "old").rename(tmp_path / "new")
    found = reopen.source(grasps, Path("../new/work/results/x"))
    assert found.resolve() == (tmp_path / "new" / "work" / name).resolve()


def test_an_absolute_source_and_one_that_is_named_are_taken_as_they_are(tmp_path):
    (tmp_path / "x.npz").touch()
    assert reopen.source(solved(str(tmp_path / "x.npz")), tmp_path) == tmp_path / "x.npz"
    assert reopen.source(solved("gone.npz"), tmp_path, tmp_path / "x.npz") == tmp_path / "x.npz"


def test_a_source_that_is_nowhere_is_told(tmp_path):
    with pytest.raises(InputError, match=r"gone\.npz' is not there; name its file with --object"):
        reopen.source(solved("gone.npz"), tmp_path)
    with pytest.raises(InputError, match=r"the result names no file; name its file with --object"):
        reopen.source(solved(""), tmp_path)


def damaged(folder: Path, **changes: Any) -> Path:
    """A saved result with some fields changed by functions."""
    grasps = small_plan().arrays()
    made = {name: change(getattr(grasps, name)) for name, change in changes.items()}
    results.save(replace(grasps, **made), {}, folder)
    return folder


def feasible(flags: np.ndarray) -> np.ndarray:
    return np.ones_like(flags)


def test_a_whole_result_is_opened_from_its_folder_and_from_its_file(tmp_path):
    damaged(tmp_path)
    for place in (tmp_path, tmp_path / results.GRASPS):
        grasps, hand = reopen.opened(place)
        assert grasps.joint_names.tolist() == list(hand.joint_names)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"joint_names": lambda a: a[::-1]}, "joint_names must be those of the hand 'allegro_left', in its order"),
        ({"finger_names": lambda a: a[::-1]}, "finger_names must be those of the hand"),
        ({"meta": lambda a: a | {"hand_folder": "barrett"}}, "joint_names must be those of the hand 'barrett'"),
        ({"tips_pregrasp": lambda a: a + 0.02}, "tips are 35 mm off those of the hand 'allegro_left'"),
        ({"gains": lambda a: a[:, :3]}, r"gains must have the shape \(\d, 4\) for the hand 'allegro_left', not"),
        ({"wrist": lambda a: a[:, :6]}, r"wrist must have the shape \(\d, 7\)"),
        ({"targets": lambda a: a[:0]}, r"targets must have the shape \(\d, 4, 3\)"),
        ({"joints": lambda a: a * np.nan, "feasible": feasible}, "joints must be finite"),
        ({"contacts": lambda a: a * np.inf, "feasible": feasible}, "contacts must be finite"),
        ({"wrist": lambda a: a * [1, 1, 1, 0, 0, 0, 0]}, "the quaternions of wrist must have length 1"),
        ({"gains": lambda a: a.astype(str)}, "gains must be of type float64, not str"),
        ({"meta": lambda a: {k: v for k, v in a.items() if "hand" not in k}}, "it does not name its hand"),
        ({"meta": lambda a: a | {"hand_folder": 5}}, "it does not name its hand"),
    ],
)
def test_a_result_that_does_not_fit_its_hand_is_refused_in_one_line(tmp_path, changes, said):
    damaged(tmp_path, **changes)
    for read in (reopen.opened, reopen.reopen):
        with pytest.raises(InputError, match=f"'.*grasps.npz': {said}.*; solve it again") as error:
            read(tmp_path)
        assert "\n" not in str(error.value)


def test_what_may_be_unknown_of_a_grasp_is_not_refused(tmp_path):
    damaged(tmp_path, confidence=lambda a: a * np.nan, margins_equilibrium=lambda a: a * np.nan)
    reopen.opened(tmp_path)
    damaged(tmp_path, joints=lambda a: a * np.nan, feasible=lambda a: a & False)
    reopen.opened(tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        lambda meta: {},
        lambda meta: meta | {"settings": None},
        lambda meta: meta | {"settings": meta["settings"] | {"contact": 5}},
        lambda meta: meta | {"settings": meta["settings"] | {"contact": {"friction": "x"}}},
    ],
)
def test_settings_of_a_wrong_type_are_refused_in_one_line(tmp_path, change):
    damaged(tmp_path, meta=change)
    with pytest.raises(InputError, match=r"^settings of '.*grasps.npz' cannot be read; solve it again$"):
        reopen.reopen(tmp_path)
    with pytest.raises(InputError, match="settings of the result cannot be read; solve it again"):
        reopen.settings(results.load_grasps(tmp_path).meta)


def with_hand(folder: Path, name: str) -> Path:
    """A saved result of the left Allegro hand, from a folder in which it has another name or the same."""
    own = folder / "mine"
    own.mkdir()
    text = (load_hand("allegro_left").folder / "hand.yaml").read_text(encoding="utf-8")
    (own / "hand.yaml").write_text(text.replace("name: allegro_left", f"name: {name}", 1), encoding="utf-8")
    plan = small_plan()
    replace(plan, problem=replace(plan.problem, hand=load_hand(own))).save(folder / "made")
    return folder / "made"


@pytest.mark.parametrize("name", ["claw", "allegro_left"])
def test_the_hand_of_a_result_is_that_of_the_folder_it_was_solved_with_whatever_its_name(tmp_path, name):
    made = with_hand(tmp_path, name)
    grasps, hand = reopen.opened(made)
    assert (hand.name, hand.folder) == (name, tmp_path / "mine")
    assert f"--hand {tmp_path / 'mine'}" in again.command(grasps.meta, made)


def test_a_hand_that_has_moved_is_asked_for_by_flag(tmp_path):
    made = with_hand(tmp_path, "claw")
    shutil.move(tmp_path / "mine", tmp_path / "moved")
    with pytest.raises(InputError, match=r"the hand 'claw' is not in '.*mine' any more; name its folder with --hand$"):
        reopen.opened(made)
    assert reopen.opened(made, str(tmp_path / "moved"))[1].name == "claw"


def test_a_hand_of_the_package_is_found_on_another_machine_whatever_folder_it_was_named_by(tmp_path, monkeypatch):
    monkeypatch.chdir(load_hand("allegro_left").folder.parent)
    assert library.called(Path("allegro_left")) == "allegro_left"
    made = with_hand(tmp_path, "allegro_left")
    shutil.rmtree(tmp_path / "mine")
    assert reopen.opened(made)[1].folder == load_hand("allegro_left").folder


def test_a_hand_that_has_changed_since_is_told(tmp_path):
    made = with_hand(tmp_path, "claw")
    assert "has changed" not in reopen.reopen(made).missing
    file = tmp_path / "mine" / "hand.yaml"
    file.write_text(file.read_text("utf-8").replace("effort: 0.7", "effort: 0.6", 1), encoding="utf-8")
    said = "mine', or its arm, has changed since it was solved"
    assert said in reopen.reopen(made).missing
    assert said in reopen.changed(*reopen.opened(made))
