"""Batches: the same result as one by one, every failure a row, nothing solved twice, nothing lost with a worker."""

import csv
import errno
import json
import math
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import fields, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from here import Here
from plans import SMALL_FLAGS, small_plan
from processes import ALIVE, TESTS, command_with, group, hang, interrupted, running, wait_for
from scenes import SMALL, ellipsoid, hand

from sgnlp import load_grasps
from sgnlp.base import exclusive
from sgnlp.base.errors import InputError, MachineError, SolverError
from sgnlp.cli import codes, run
from sgnlp.hand.placements import BACKENDS
from sgnlp.perception.observation import Reading, load
from sgnlp.planning import results
from sgnlp.planning.batch import Row, Task, batch, plan
from sgnlp.planning.ending import ENOUGH, Ending
from sgnlp.planning.grasps import same
from sgnlp.planning.pool import Failure
from sgnlp.planning.solvers import settled
from sgnlp.planning.workers import Workers

FEW = [*SMALL_FLAGS[:-2], "--spheres", "paper", "--contact.samples", "2"]
LEAN_FLAGS = [*FEW, "--solver.formulation", "constrained"]
"""Functions that a process builds in a quarter of the time."""
WALK = BACKENDS[-1]
UNHURRIED = ["--timeout", "3600"]
"""Where a start has to end, on a busy machine too."""
FLAT = "all points lie on one plane; a solid object needs points in three dimensions"
LEANEST_FLAGS = [*FEW, "--rounds", "1", "--solver.formulation", "penalty", "--solver.max-iterations", "3"]
"""A quarter of the time, where nothing needs to be feasible."""


@pytest.fixture(autouse=True)
def workplace(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def solved(monkeypatch) -> list[str]:
    """The names that are solved, by a solver that gives the plan of the shared scene or fails by the name."""
    names = []

    def fake(seen, hand, settings, *, count, seed, jobs, timeout, first, deadline, solver, extension, **around):
        names.append(seen.name)
        if "broken" in seen.name:
            raise RuntimeError("CasADi says [no]\nand more")
        given = {"seed": seed, "jobs": jobs, "timeout": timeout, "solver": settled(solver, settings.solver)}
        plan = replace(small_plan(), observation=seen, ending=Ending(first, deadline), **given)
        vars(plan)["motion"] = None  # half of the time, and no affair of a batch
        if "stopped" in seen.name:
            return replace(
                plan, solutions=(), failures=tuple(Failure(i, f"stopped after {timeout:g} s") for i in (0, 1))
            )
        if "loose" in seen.name:
            checks = tuple(replace(check, passed=False) for check in plan.solutions[0].checks)
            return replace(plan, solutions=tuple(replace(s, checks=checks) for s in plan.solutions))
        return plan

    monkeypatch.setattr("sgnlp.planning.batch.solve", fake)
    return names


def cloud(stem: str, seed: int = 0, folder: str = ".", **more: object) -> Path:
    """A file of the ellipsoid."""
    Path(folder).mkdir(exist_ok=True)
    file = Path(folder) / f"{stem}.npz"
    np.savez(file, points=ellipsoid(seed=seed), table_height=0.0, **more)  # type: ignore[arg-type]
    return file


def task(**changes: object) -> Task:
    """A task of two starts, as many as the plan of the shared scene has."""
    return replace(Task(settings=SMALL, count=2), **changes)  # type: ignore[arg-type]


def rows(files: list[Path], **changes: object) -> dict[str, Row]:
    """The rows by file of a batch into `results`, for a task with changes."""
    return {row.file: row for row in batch(files, task(**changes), Path("results"), Here())}


def command(*arguments: object) -> int:
    return run(["batch", *map(str, arguments)])


def read(file: str = "results/batch/rows.csv") -> list[Row]:
    return results.read_rows(Path(file), Row)


# One object after another ---------------------------------------------------------------------------------------------


def test_a_batch_is_bit_for_bit_what_solve_gives_for_each_file(capfd):
    one, two = cloud("one", 1), cloud("two", 2)
    flags = ["--starts", 2, "--seed", 3, *UNHURRIED, *LEAN_FLAGS]
    assert command(one, two, "none.npz", "--jobs", 1, *flags) == codes.NONE_FEASIBLE
    out, err = capfd.readouterr()
    assert err == ""
    assert "2 of 3 objects have a feasible grasp, in" in out
    assert out.splitlines()[-1] == "written: results/batch/rows.csv, results/batch/made.json"
    for file in (one, two):
        assert run(["solve", str(file), "--quiet", "--out", f"alone/{file.stem}", *map(str, flags)]) == codes.FEASIBLE
        a, b = load_grasps(f"results/{file.stem}"), load_grasps(f"alone/{file.stem}")
        assert same(a, b)
        summaries = [
            json.loads(Path(f"{f}/{file.stem}/summary.json").read_text(encoding="utf-8")) for f in ("results", "alone")
        ]
        assert summaries[0]["best"] == summaries[1]["best"]
        assert summaries[0].keys() == summaries[1].keys()
    assert not same(load_grasps("results/one"), load_grasps("results/two"))
    assert [(row.name, row.file, row.feasible) for row in read()] == [
        ("one", "one.npz", True),
        ("two", "two.npz", True),
        ("none", "none.npz", False),
    ]
    assert read()[2].failure == "there is no such file"
    first, grasps = read()[0], load_grasps("results/one")
    assert (first.starts, first.feasible_starts, first.energy) == (2, grasps.feasible.sum(), grasps.energy[0])
    assert first.margin == min(grasps.margins_initial[0].min(), grasps.margins_equilibrium[0].min())
    assert first.seconds > 0
    made = json.loads(Path("results/batch/made.json").read_text(encoding="utf-8"))
    assert made["batch"]["seed"] == 3
    assert made["batch"]["settings"]["gpis"]["surface_points"] == 60


def hanging(task: Task, file: Path) -> object:
    """`plan`, but the starts of a cloud that has `hangs` in its name do so."""
    with pytest.MonkeyPatch.context() as patch:
        if "hangs" in file.stem:
            patch.setattr("sgnlp.planning.pool.solve_start", hang)
        return plan(task, file)


def test_a_start_that_overruns_its_limit_is_stopped_and_its_worker_goes_on(capfd, monkeypatch):
    monkeypatch.setattr("sgnlp.planning.batch.plan", hanging)
    files = [cloud("hangs", 1), cloud("hangs too", 2)]
    assert command(*files, "--jobs", 1, "--timeout", 0.1, "--starts", 2, *LEANEST_FLAGS) == codes.NONE_FEASIBLE
    assert [(row.starts, row.feasible, row.failure) for row in read()] == 2 * [(2, False, "stopped after 0.1 s")]
    assert capfd.readouterr().out.count("stopped after 0.1 s") == 2


def test_every_field_of_a_row_is_of_a_type_that_the_file_can_hold():
    assert {field.type for field in fields(Row)} <= {str, int, float, bool}


# What goes wrong with an object ---------------------------------------------------------------------------------------


def test_whatever_goes_wrong_with_an_object_is_its_row_and_stops_no_other(solved):
    Path("text.npz").write_text("hello", encoding="utf-8")
    names = ("good", "broken", "stopped", "loose", "last")
    files = [Path("none.npz"), Path("text.npz"), *(cloud(name, i) for i, name in enumerate(names))]
    found = rows(files)
    assert solved == list(names)
    assert {row.name: row.failure for row in found.values()} | {"text": "", "loose": ""} == {
        "none": "there is no such file",
        "text": "",
        "good": "",
        "broken": "RuntimeError: CasADi says [no]",
        "stopped": "stopped after 60 s",
        "loose": "",
        "last": "",
    }
    assert found["text.npz"].failure.startswith("is not an npz")
    assert found["loose.npz"].failure.startswith("violated: ")
    assert [row.name for row in found.values() if row.feasible] == ["good", "last"]
    assert not Path("results/broken").exists()
    assert math.isnan(found["stopped.npz"].margin)


def test_a_cloud_is_cleaned_once_whether_it_is_solved_or_was_before(solved, monkeypatch):
    cleaned = []
    monkeypatch.setattr("sgnlp.planning.batch.load", lambda file, reading: cleaned.append(file) or load(file, reading))
    file = cloud("one", name="mug")
    rows([file])
    assert rows([file])[str(file)].reused
    assert solved == ["mug"]
    assert cleaned == 2 * [file.absolute()]


def test_a_cloud_that_cleaning_refuses_is_a_row_that_says_why(solved):
    np.savez("flat.npz", points=ellipsoid() * [1, 1, 0], table_height=0.0)
    for _ in range(2):
        (row,) = rows([Path("flat.npz")]).values()
        assert (row.name, row.failure) == ("flat", FLAT)
        Path("results/flat").mkdir(parents=True, exist_ok=True)
    assert not solved


def test_two_files_of_one_name_do_not_replace_each_other(solved):
    files = [cloud("first", 0, name="mug"), cloud("second", 1, name="mug"), cloud("first", 2, "more", name="can")]
    found = rows([*files, files[0]])
    assert [found[str(file)].failure for file in files] == ["", "has the same name as first.npz", ""]
    assert solved == ["mug", "can"]


def test_a_result_that_cannot_be_written_is_a_row(solved):
    Path("results").mkdir()
    Path("results/one").write_text("in the way", encoding="utf-8")
    found = rows([cloud("one"), cloud("two", 1)])
    assert "cannot be written" in found["one.npz"].failure
    assert found["two.npz"].feasible


def test_a_setting_that_fits_no_object_is_told_in_every_row_and_a_bad_hand_at_once(solved):
    with pytest.raises(InputError, match="unknown hand"):
        rows([cloud("one")], hand="nope")
    assert rows([cloud("one")], reading=Reading(("nope",)))["one.npz"].failure.startswith("unknown view 'nope'")


def test_the_workers_are_closed_however_the_batch_ends(solved):
    files = [cloud("one"), cloud("two", 1)]
    for leave in (True, False):
        workers = Here()
        ended = batch(files, task(), Path("elsewhere"), workers)
        next(ended)
        assert not workers.closed
        if leave:
            ended.close()
        else:
            list(ended)
        assert workers.closed


# Again ----------------------------------------------------------------------------------------------------------------


def test_what_is_solved_is_not_solved_again_and_what_failed_is(solved):
    files = [cloud("one"), cloud("broken", 1), cloud("stopped", 2), cloud("two", 3)]
    before = rows(files[:3])
    solved.clear()
    after = rows(files)
    assert solved == ["broken", "stopped", "two"]
    assert repr(after["one.npz"]) == repr(replace(before["one.npz"], reused=True))  # nan is not itself
    assert not after["two.npz"].reused


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 1},
        {"count": 3},
        {"settings": replace(SMALL, rank_by="energy")},
        {"hand": "allegro_right"},
        {"reading": Reading(table_height=-0.001)},
        {"solver": "fatrop"},
        pytest.param({"kinematics": WALK}, marks=pytest.mark.skipif(hand().kinematics == WALK, reason="the only one")),
    ],
    ids=lambda change: next(iter(change)),
)
def test_results_of_another_task_are_solved_again(solved, change):
    rows([cloud("one")])
    assert solved == ["one"]
    rows([Path("one.npz")], **change)
    assert solved == ["one", "one"]


def test_all_objects_of_a_batch_have_one_backend_of_the_kinematics_though_a_better_one_comes_meanwhile(monkeypatch):
    asked, best = [], [WALK]
    monkeypatch.setattr("sgnlp.hand.hand.backend", lambda *models: best[0])

    def planned(seen, hand, settings, **options):
        asked.append(hand.kinematics)
        best[0] = "pinocchio (compiled)"
        raise InputError("enough")

    monkeypatch.setattr("sgnlp.planning.batch.solve", planned)
    rows([cloud("one"), cloud("two", 1)])
    assert asked == [WALK, WALK]
    rows([cloud("three")])
    assert asked[2:] == ["pinocchio (compiled)"]


def test_a_changed_cloud_or_a_damaged_result_is_solved_again(solved):
    rows([cloud("one")])
    rows([cloud("one", seed=5)])
    assert len(solved) == 2
    Path("results/one/grasps.npz").write_bytes(b"PK")
    rows([Path("one.npz")])
    assert len(solved) == 3
    rows([Path("one.npz")])
    assert len(solved) == 3


def test_another_limit_matters_only_where_a_start_was_stopped(solved, monkeypatch):
    rows([cloud("one")])
    rows([Path("one.npz")], timeout=5.0)
    assert solved == ["one"]
    partial_plan = replace(small_plan(), solutions=small_plan().solutions[:1], failures=(Failure(1, "stopped"),))
    monkeypatch.setitem(globals(), "small_plan", lambda: partial_plan)
    rows([cloud("two", 1)])
    assert rows([Path("two.npz")])["two.npz"].reused
    assert not rows([Path("two.npz")], timeout=5.0)["two.npz"].reused


def test_a_plan_that_ended_early_is_not_taken_for_a_whole_one(solved):
    rows([cloud("one")], ending=Ending(first=1))
    assert rows([Path("one.npz")], ending=Ending(first=1))["one.npz"].reused
    assert rows([Path("one.npz")])["one.npz"].reused  # for all of its starts had ended
    early = replace(small_plan(), solutions=small_plan().solutions[:1], failures=(Failure(1, ENOUGH),))
    early = replace(early, observation=task().load(cloud("two", 1)), ending=Ending(first=1))
    results.save(early.arrays(), early.summary(), Path("results/two"))
    assert rows([Path("two.npz")], ending=Ending(first=1))["two.npz"].reused
    assert not rows([Path("two.npz")])["two.npz"].reused


def test_the_result_of_solve_is_taken_over(solved):
    plan = replace(small_plan(), observation=task().load(cloud("one")))
    results.save(plan.arrays(), plan.summary(), Path("results/one"))
    assert rows([Path("one.npz")])["one.npz"].reused is True
    assert not solved


# The command ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def here(monkeypatch, solved) -> list[str]:
    """The command over this process and the made-up solver."""
    monkeypatch.setattr("sgnlp.cli.batch.Workers", lambda jobs, scheduler: Here())
    small_plan()
    return solved


def test_the_exit_code_tells_whether_every_object_has_a_feasible_grasp(here, capfd):
    flags = ["--starts", 2, *SMALL_FLAGS]
    assert command(cloud("one"), cloud("two", 1), *flags) == codes.FEASIBLE
    assert "2 of 2 objects have a feasible grasp, in" in capfd.readouterr().out
    assert command("one.npz", cloud("loose", 2), *flags) == codes.NONE_FEASIBLE
    out = " ".join(capfd.readouterr().out.split())
    assert "1 of 2 objects have a feasible grasp, 1 solved before, in" in out
    assert "violated: " in out
    assert [row.name for row in read()] == ["one", "loose"]


def test_bad_input_of_a_batch_is_told_before_any_work(here, capfd):
    good = cloud("one")
    calls = {
        "there is nothing to solve: none*.npz is not there": ("none*.npz",),
        "unknown hand": (good, "--hand", "nope"),
        "'one.npz' cannot be written": (good, "--out", good),
        "go together": (good, "--backend", "dask"),
        " go together": (good, "--scheduler", "tcp://127.0.0.1:1"),
    }
    for message, arguments in calls.items():
        assert command(*arguments) == codes.BAD_INPUT
        out, err = capfd.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert message in err
    assert not here
    assert [path.name for path in Path().iterdir()] == ["one.npz"]


def test_rows_are_written_as_objects_end_and_kept_by_an_interrupt(here, monkeypatch, capfd):
    from sgnlp.planning import batch as module

    fake = module.solve

    def second_is_interrupted(seen, *rest, **options):
        if seen.name == "two":
            raise KeyboardInterrupt
        return fake(seen, *rest, **options)

    monkeypatch.setattr(module, "solve", second_is_interrupted)
    flags = [cloud("one"), cloud("two", 1), "--starts", 2, *SMALL_FLAGS]
    assert command(*flags) == codes.INTERRUPTED
    assert capfd.readouterr() == ("", "interrupted\n")
    assert [row.name for row in read()] == ["one"]
    assert {path.name for path in Path("results").rglob(".*")} == {exclusive.LOCK}
    monkeypatch.setattr(module, "solve", fake)
    assert command(*flags) == codes.FEASIBLE
    assert [(row.name, row.reused) for row in read()] == [("one", True), ("two", False)]


def test_a_folder_with_rows_of_another_task_is_refused_and_left_as_it_is(here, capfd):
    flags = [cloud("one"), "--starts", 2, *SMALL_FLAGS]
    assert command(*flags) == codes.FEASIBLE
    before = {path: path.read_bytes() for path in Path("results").rglob("*") if path.is_file()}
    changes = {
        "seed was 0, is 1": ("--seed", 1),
        "hand was allegro_left, is allegro_right": ("--hand", "allegro_right"),
        "settings.rank_by was": ("--rank-by", "energy"),
        "reading.scale was 1.0, is 2.0": ("--scale", 2),
        "with was None, is ": ("--with", "own.py"),
    }
    Path("own.py").write_text('WITHOUT_TERMS = ["tar"]\n', encoding="utf-8")
    capfd.readouterr()
    for message, more in changes.items():
        assert command(*flags, *more) == codes.BAD_INPUT
        err = capfd.readouterr().err
        assert message in err
        assert "choose another --out" in err
        assert {path: path.read_bytes() for path in Path("results").rglob("*") if path.is_file()} == before
    assert command(*flags, "--timeout", 5, "--jobs", 2) == codes.FEASIBLE
    assert command(*flags, "--seed", 1, "--out", "elsewhere") == codes.FEASIBLE
    assert here == ["one", "one"]


@pytest.mark.parametrize(("folder", "flag"), [("results", "--results"), ("results/batch", "--out")])
def test_a_second_batch_in_a_folder_is_refused_by_the_name_of_the_first(here, capfd, folder, flag):
    flags = [cloud("one"), "--starts", 2, *SMALL_FLAGS]
    code = (
        "from pathlib import Path; from sgnlp.base.exclusive import alone; import time\n"
        f"with alone(Path({folder!r}), ''):\n    Path('begun').touch(); time.sleep(1000)"
    )
    with running([sys.executable, "-c", code]) as first:
        assert wait_for(Path("begun").exists)
        assert command(*flags) == codes.BAD_INPUT
        err = capfd.readouterr().err
        assert f"'{folder}' is in use by another command (process {first.pid} on" in err
        assert f"choose another {flag}\n" in err
        assert not here
    assert command(*flags) == codes.FEASIBLE  # the first was killed


def test_a_folder_is_locked_though_there_is_no_room_to_say_by_whom(here, capfd, monkeypatch):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with exclusive.alone(Path("results"), "--results"):
        assert command(cloud("one"), "--starts", 2, *SMALL_FLAGS) == codes.BAD_INPUT
    assert "'results' is in use by another command (which begins)" in capfd.readouterr().err
    with exclusive.alone(Path("results"), "--results"):
        assert not here


def test_a_batch_may_write_its_table_among_the_results(here):
    assert command(cloud("one"), "--starts", 2, *SMALL_FLAGS, "--out", "results") == codes.FEASIBLE
    assert not list(Path("results").glob(exclusive.HOLDER))


def test_a_result_without_its_summary_is_solved_again(solved):
    rows([cloud("one")])
    Path("results/one/summary.json").unlink()
    assert not rows([Path("one.npz")])["one.npz"].reused


def test_a_full_disk_ends_a_batch_with_a_code_of_its_own(here, capfd, monkeypatch):
    def full(*_, **__):
        raise MachineError("no room")

    monkeypatch.setattr("sgnlp.planning.batch.results.save", full)
    assert command(cloud("one"), cloud("two", 1), "--starts", 2, *SMALL_FLAGS) == codes.MACHINE
    assert capfd.readouterr().err == "error: no room\n"
    assert here == ["one"]


def test_the_command_has_help(capfd):
    assert command("--help") == 0
    out, err = capfd.readouterr()
    assert out.startswith("usage: sgnlp batch")
    assert "--scheduler" in out
    assert err == ""


def test_the_rows_can_be_read_by_any_reader_of_csv(here):
    command(cloud("one"), "missing, with a comma.npz", "--starts", 2, *SMALL_FLAGS)
    with open("results/batch/rows.csv", encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["file"] for line in lines] == ["one.npz", "missing, with a comma.npz"]
    assert list(lines[0]) == [field.name for field in fields(Row)]


@pytest.mark.skipif(find_spec("pyarrow") is None, reason="needs the package pyarrow")
def test_the_rows_are_written_as_parquet_too_where_that_is_asked_for(here, capfd):
    from pyarrow import parquet

    command(cloud("one"), "missing.npz", "--starts", 2, "--parquet", *SMALL_FLAGS)
    assert "results/batch/rows.csv, results/batch/rows.parquet, results/batch/made.json" in capfd.readouterr().out
    table = parquet.read_table("results/batch/rows.parquet")
    assert repr([Row(**line) for line in table.to_pylist()]) == repr(read())
    assert str(table.schema.field("energy").type) == "double"


def test_parquet_without_pyarrow_is_told_before_any_work(here, capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert command(cloud("one"), "--parquet") == codes.BAD_INPUT
    assert capfd.readouterr() == ("", "error: Parquet needs the package pyarrow: pip install 'sgnlp[parquet]'\n")
    assert not Path("results").exists()
    assert not here


@pytest.fixture
def builds(monkeypatch, workplace) -> list[bool]:
    """An entry for each build; nothing is compiled yet, and four starts are worth it."""
    done: list[bool] = []
    monkeypatch.setenv("XDG_CACHE_HOME", str(workplace / "cache"))
    monkeypatch.setattr("sgnlp.program.compiled.can_compile", lambda: True)
    monkeypatch.setattr("sgnlp.cli.compiling.WORTH", 4)
    monkeypatch.setattr("sgnlp.cli.compiling.build", lambda *_: done.append(True))
    return done


def test_the_functions_are_compiled_first_where_the_starts_that_are_left_are_worth_it(here, builds, capfd):
    one, two, flags = cloud("one"), cloud("two", 1), ["--starts", 2, *SMALL_FLAGS]
    for arguments, count in (
        ((one, two, *flags, "--no-build", "--out", "a"), 0),
        ((one, two, *flags, "--solver.no-compiled", "--out", "b"), 0),
        ((one, *flags, "--out", "c"), 0),
        ((one, two, *flags, "--seed", 1), 1),
        ((one, two, *flags, "--seed", 1), 1),  # solved before
    ):
        assert command(*arguments) == codes.FEASIBLE
        assert len(builds) == count
        assert ("Compiling the functions first" in capfd.readouterr().out) == (count == 1 and bool(here))
        here.clear()


def test_a_build_that_fails_is_told_and_the_batch_goes_on_interpreted(here, builds, capfd, monkeypatch):
    def fails(*_: object) -> None:
        raise SolverError("cannot compile: no room")

    monkeypatch.setattr("sgnlp.cli.compiling.build", fails)
    assert command(cloud("one"), cloud("two", 1), "--starts", 2, *SMALL_FLAGS) == codes.FEASIBLE
    assert "The functions stay interpreted: cannot compile: no room" in capfd.readouterr().out
    assert here == ["one", "two"]


def test_ctrl_c_ends_every_process_and_keeps_what_is_done():
    files = [str(cloud(name, i)) for i, name in enumerate(("one", "hangs", "hangs too"))]
    here = f"sys.path.insert(0, {str(Path(__file__).parent)!r})"
    code = "import sgnlp.planning.batch, test_batch; sgnlp.planning.batch.plan = test_batch.hanging"
    patched = command_with(f"{here}; {code}")
    with running([*patched, "batch", *files, "--jobs", "2", "--starts", "3", *UNHURRIED, *LEANEST_FLAGS]) as process:
        assert wait_for(lambda: read() and Path("hanging").exists()), "no object has ended, or none hangs"
        assert interrupted(process) == (codes.INTERRUPTED, "", "interrupted\n")
    assert [row.name for row in read()] == ["one"]
    assert len(load_grasps("results/one")) == 3
    assert {path.name for path in Path("results").iterdir()} == {"one", "batch", exclusive.LOCK}


LOCKS = """
import os, signal, threading
from pathlib import Path
enter = threading.Condition.__enter__
def interrupted(self):
    found, sent = enter(self), Path("sent")
    blocked = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    ready = Path("results/batch/rows.csv").exists() and not sent.exists() and not blocked
    if ready and threading.current_thread() is threading.main_thread():
        sent.touch()
        os.kill(os.getpid(), signal.SIGINT)
    return found
threading.Condition.__enter__ = interrupted
"""
"""Sends Ctrl-C where the process that waits takes a lock, from when the first object has ended."""


def test_ctrl_c_while_a_lock_is_taken_ends_every_process_too():
    files = [str(cloud(name, i)) for i, name in enumerate(("one", "hangs", "two"))]
    here = f"sys.path.insert(0, {str(Path(__file__).parent)!r})"
    code = "import sgnlp.planning.batch, test_batch; sgnlp.planning.batch.plan = test_batch.hanging"
    patched = command_with(f"{here}; {code}; exec(test_batch.LOCKS)")
    with running([*patched, "batch", *files, "--jobs", "2", "--starts", "3", *UNHURRIED, *LEANEST_FLAGS]) as process:
        out, err = process.communicate(timeout=ALIVE)
        assert (process.returncode, out, err.splitlines()[0]) == (codes.INTERRUPTED, "", "interrupted")
        assert "Traceback" not in err
        assert wait_for(lambda: not group(process.pid)), "a process is left"
    assert Path("sent").exists()


# A dask cluster -------------------------------------------------------------------------------------------------------

needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="needs the package distributed")


CLUSTER = """
import os, signal, sys
from distributed import Client, LocalCluster
if __name__ == "__main__":
    workers, port = map(int, sys.argv[1:])
    options = {"processes": True, "dashboard_address": None, "silence_logs": 50, "threads_per_worker": 1}
    with LocalCluster(n_workers=workers, scheduler_port=port, **options) as cluster, Client(cluster) as client:
        print(cluster.scheduler_address, flush=True)
        for line in sys.stdin:
            pids = client.run(os.getpid)
            os.kill(sorted(pids.values())[0], signal.SIGKILL)
            print(len(pids), flush=True)
"""
"""Prints the address of its scheduler. For every line that it is given, it kills a worker and says how many it had."""


@contextmanager
def cluster(workers: int, port: int = 0) -> Iterator[tuple[str, Callable[[], int]]]:
    """The address of a scheduler with some workers, and what kills one of them; at the end all of them are killed."""
    Path("cluster.py").write_text(CLUSTER, encoding="utf-8")
    path = os.pathsep.join([str(TESTS), *sys.path])  # the workers are to find what is imported here
    options = {"stdin": subprocess.PIPE, "stderr": subprocess.DEVNULL, "env": os.environ | {"PYTHONPATH": path}}
    with running([sys.executable, "cluster.py", str(workers), str(port)], **options) as process:

        def kill() -> int:
            process.stdin.write("kill\n")
            process.stdin.flush()
            return int(process.stdout.readline())

        yield process.stdout.readline().strip(), kill


def waiting(task: Task, file: Path) -> object:
    """`plan`, but of all clouds but one only when something was killed, and never twice."""
    assert file.stem == "cloud0" or wait_for((task.root / "killed").exists)
    made = plan(task, file)
    with open(task.root / f"{file.stem} was planned", "x", encoding="utf-8"):
        return made


def on_a_cluster(address: str, files: list[Path], happens: Callable[[], None]) -> None:
    """A batch on a cluster to which something happens when one object is done: nothing is lost, the bits are right."""

    def after_the_first() -> None:
        if wait_for(read):
            happens()
        Path("killed").touch()

    thread = threading.Thread(target=after_the_first)
    thread.start()
    code = command(*files, "--backend", "dask", "--scheduler", address, "--starts", 1, *UNHURRIED, *LEANEST_FLAGS)
    thread.join()
    assert [(row.name, row.starts, row.failure.partition(":")[0]) for row in read()] == [
        (file.stem, 1, "violated") for file in files
    ]
    assert code == codes.NONE_FEASIBLE
    for file in files:
        run(["solve", str(file), "--quiet", "--starts", "1", "--out", "alone", *UNHURRIED, *LEANEST_FLAGS])
        assert same(load_grasps(f"results/{file.stem}"), load_grasps("alone"))


@needs_dask
@pytest.mark.filterwarnings("ignore")
def test_nothing_is_lost_when_one_of_two_workers_of_a_cluster_is_killed_half_way(monkeypatch):
    monkeypatch.setattr("sgnlp.planning.batch.plan", waiting)
    killed = []
    with cluster(2) as (address, kill):
        on_a_cluster(address, [cloud(f"cloud{i}", i) for i in range(3)], lambda: killed.append((kill(), len(read()))))
    assert killed == [(2, 1)]  # one of the workers, all of them at work, when one object was done


@needs_dask
@pytest.mark.filterwarnings("ignore")
def test_a_batch_goes_on_when_the_scheduler_of_a_cluster_is_killed_and_started_again(monkeypatch):
    monkeypatch.setattr("sgnlp.planning.batch.plan", waiting)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with ExitStack() as first, ExitStack() as second:
        address, _ = first.enter_context(cluster(1, port))

        def again() -> None:
            first.close()
            second.enter_context(cluster(1, port))

        on_a_cluster(address, [cloud(f"cloud{i}", i) for i in range(3)], again)


@needs_dask
@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_that_does_not_answer_is_told(capfd, monkeypatch):
    monkeypatch.setattr("sgnlp.planning.workers.CONNECTING", 0.5)
    assert command(cloud("one"), "--backend", "dask", "--scheduler", "tcp://127.0.0.1:1") == codes.BAD_INPUT
    assert "no dask scheduler answers at 'tcp://127.0.0.1:1'" in capfd.readouterr().err
    assert not Path("results").exists()


def lacking(workers: Workers) -> str:
    with closing(workers):
        return workers.lacking()


@needs_dask
@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_without_workers_is_told_and_how_to_start_one():
    for count, words in ((0, "all waits for one. Start it by: dask worker {} --nthreads 1"), (1, "")):
        with cluster(count) as (address, _):
            assert lacking(Workers(1, address)).partition("yet, and ")[2] == words.format(address)
    assert lacking(Workers(1)) == ""


def test_a_batch_says_that_there_are_no_workers(here, capfd, monkeypatch):
    monkeypatch.setattr(Here, "lacking", lambda self: "No worker has come")
    assert command(cloud("one"), "--starts", 2, *SMALL_FLAGS) == codes.FEASIBLE
    assert capfd.readouterr().out.startswith("No worker has come\n")


def test_a_batch_on_a_cluster_without_dask_says_what_to_install(capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert command(cloud("one"), "--backend", "dask", "--scheduler", "tcp://127.0.0.1:1") == codes.BAD_INPUT
    assert "pip install 'sgnlp[dask]'" in capfd.readouterr().err
