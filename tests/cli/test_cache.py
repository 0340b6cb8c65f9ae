"""`sgnlp cache`: build, show, clear."""

import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hands import THREE
from rich.console import Console
from scenes import hand

from sgnlp.base import toolchain
from sgnlp.base.presets import PRESETS, ROBUST
from sgnlp.base.settings import Closing, Settings
from sgnlp.cli import background, compiling, run
from sgnlp.hand.hand import load_hand
from sgnlp.planning.additions import NOTHING
from sgnlp.program import compiled
from sgnlp.program.around import ALONE

SETTINGS = replace(
    ROBUST, contact=replace(ROBUST.contact, samples=2), solver=replace(ROBUST.solver, formulation="penalty")
)
SMALL = ("--hand", str(THREE), "--contact.samples", "2", "--solver.formulation", "penalty")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache folder of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    compiled.load.cache_clear()
    yield toolchain.cache_folder()
    compiled.load.cache_clear()


def asked(settings: Settings, hand: str = "allegro_left", build: bool = True) -> SimpleNamespace:
    """The flags of a command that plans."""
    return SimpleNamespace(hand=hand, arm=None, settings=settings, with_=None, additions=NOTHING, build=build)


def test_an_empty_cache_is_shown_and_not_made(folder, capfd):
    assert run(["cache"]) == 0
    assert capfd.readouterr().out.startswith(f"Nothing is compiled in {folder}: 'sgnlp cache --build' ")
    assert not folder.exists()


@pytest.fixture
def walking(monkeypatch):
    """No C++ compiler, for in the cache of all tests no hand is to get a better backend while they run."""
    monkeypatch.setenv("CXX", "no-such-compiler")


@pytest.mark.skipif(not compiled.can_compile(), reason="no C compiler")
def test_what_is_built_is_shown_used_and_cleared(tmp_path, capfd, monkeypatch, walking):
    assert run(["cache", "--build", "--jobs", "2", *SMALL]) == 0  # in the cache of all tests, unless it is there
    out, err = capfd.readouterr()
    assert err == ""
    assert "a walk over the model gives the same: no C++ compiler" in " ".join(out.split())
    (structure,) = NOTHING.structures(SETTINGS)
    compiled.load.cache_clear()
    assert compiled.load(load_hand(THREE), structure) is not None
    library = compiled.path(load_hand(THREE), structure)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = toolchain.cache_folder()
    folder.mkdir()
    shutil.copy(library, folder)
    assert run(["cache"]) == 0
    shown = capfd.readouterr().out.split("program-penalty-")[1].split()[1]
    assert np.isclose(library.stat().st_size / 1e6, float(shown), atol=0.01)
    assert run(["cache", "--clear"]) == 0
    assert not list(folder.iterdir())


def test_the_kinematics_of_a_hand_of_ones_own_are_built_before_its_programs(folder, capfd, monkeypatch):
    order = []

    def build(model):
        order.append("kinematics")
        monkeypatch.setattr("sgnlp.hand.hand.backend", lambda *models: "pinocchio (compiled)")

    monkeypatch.setattr(compiling.placement_functions, "build", build)
    monkeypatch.setattr(compiled, "compile_program", lambda hand, *rest: order.append(hand.kinematics))
    assert run(["cache", "--build", *SMALL]) == 0
    assert order == ["kinematics", "pinocchio (compiled)"]
    order.clear()
    assert run(["cache", "--build", *SMALL]) == 0  # they are there
    assert order == ["pinocchio (compiled)"]


def test_without_a_compiler_a_build_ends_with_one_line(folder, capfd, monkeypatch, walking):
    monkeypatch.setenv("CC", "no-such-compiler")
    assert run(["cache", "--build", *SMALL]) == 3
    err = capfd.readouterr().err
    assert err.startswith("error: cannot compile: no C compiler: $CC is 'no-such-compiler'")
    assert err.count("\n") == 1


def told(capfd, *given: object, **flags: object) -> str:
    """What a plan of a hand and settings says of its functions, with a work behind it that was broken off."""
    hand, settings = given
    with compiling.behind(hand, asked(settings, **flags), ALONE) as behind:
        behind.told(Console(width=200))
    return capfd.readouterr().out


@pytest.fixture
def unbuilt(monkeypatch):
    """No program is built, which would take seconds."""
    monkeypatch.setattr(compiled, "program", lambda hand, structure: None)


def test_a_plan_with_interpreted_functions_names_the_command_that_compiles_them(folder, capfd, monkeypatch, unbuilt):
    settings = replace(ROBUST, spheres="paper", contact=replace(ROBUST.contact, samples=4))
    said = told(capfd, hand("paper"), settings)
    assert "'sgnlp cache --build --contact.samples 4 --spheres paper' compiles them at once" in said
    said = told(capfd, hand("paper"), settings, hand="some/folder")
    assert "cache --build --hand some/folder --contact.samples 4 --spheres paper" in said
    assert "--closing.no-planned --closing.c-freedom 0.0" in told(
        capfd, hand("paper"), replace(settings, closing=Closing())
    )
    said = told(capfd, hand(), PRESETS["bilevel-heuristic"])
    assert "cache --build --contact.metric closure --contact.heuristic 1.6' compiles" in said
    assert told(capfd, hand("paper"), replace(settings, solver=replace(settings.solver, compiled=False))) == ""
    monkeypatch.setenv("CC", "no-such-compiler")
    assert "twice as long: no C compiler: $CC is" in told(capfd, hand("paper"), settings)


class Recorded:
    """Work that notes what becomes of it."""

    def __init__(self, do):
        self.fate = []
        MADE.append(self)

    def finish(self):
        self.fate.append("goes on")
        return True

    def end(self):
        self.fate.append("ended")


MADE: list[Recorded] = []


def test_what_compiles_behind_a_plan_ends_with_it_unless_there_is_a_result(folder, capfd, monkeypatch, unbuilt):
    MADE.clear()
    monkeypatch.setattr(background, "Work", Recorded)
    assert "are being compiled, once for all objects" in told(capfd, hand("paper"), replace(ROBUST, spheres="paper"))
    with (
        pytest.raises(KeyboardInterrupt),
        compiling.behind(hand("paper"), asked(replace(ROBUST, spheres="paper")), ALONE),
    ):
        raise KeyboardInterrupt
    assert [work.fate for work in MADE] == [["goes on"], ["ended"]]
    assert "of them are compiled" in told(capfd, hand("paper"), replace(ROBUST, spheres="paper"), build=False)
    assert len(MADE) == 2


def test_a_build_before_the_starts_is_worth_it_for_many_and_only_where_it_is_wanted_and_can_be_done(
    folder, monkeypatch
):
    settings = replace(ROBUST, spheres="paper")
    can = [True]
    monkeypatch.setattr(compiled, "can_compile", lambda: can[0])
    assert compiling.worthwhile(hand("paper"), asked(settings), compiling.WORTH)
    assert not compiling.worthwhile(hand("paper"), asked(settings), compiling.WORTH - 1)
    interpreted = replace(settings, solver=replace(settings.solver, compiled=False))
    assert not compiling.worthwhile(hand("paper"), asked(interpreted), compiling.WORTH)
    can[0] = False
    assert not compiling.worthwhile(hand("paper"), asked(settings), compiling.WORTH)
