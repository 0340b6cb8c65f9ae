"""The source of a result is found from any working folder, and after a move together with the result."""

from dataclasses import replace
from pathlib import Path

import pytest
from plans import small_plan

from sgnlp.base.errors import InputError
from sgnlp.planning import reopen
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
