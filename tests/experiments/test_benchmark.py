"""The benchmark's bookkeeping: rows, statistics, tables and files, and what a call does. Never a time."""

import csv
import json
import math
import os
import time
from collections.abc import Iterator
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
from here import Here
from plans import small_plan
from processes import ALIVE
from scenes import SMALL, ellipsoid, hand, oracle, posed

import sgnlp
from sgnlp.base.presets import ROBUST
from sgnlp.cli import run
from sgnlp.experiments import benchmarks
from sgnlp.experiments.benchmarks import (
    TARGETS,
    TARGETS_MET,
    cluster,
    earlier,
    growth,
    measure,
    processes,
    ratios,
    replanning,
    solving,
    startup,
)
from sgnlp.experiments.benchmarks.measure import Bench, Row, Time, clocked, cold_times, spread, timing, warm_times
from sgnlp.experiments.benchmarks.oracle import FUNCTIONS, call, rates, scene
from sgnlp.experiments.benchmarks.oracle import rows as oracle_rows
from sgnlp.experiments.cli.benchmark import Benchmark, Section
from sgnlp.planning import results
from sgnlp.planning.grasps import same
from sgnlp.planning.planner import Planner
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.starts import starts
from sgnlp.program.oracle import join

INTERPRETED = replace(SMALL, solver=replace(SMALL.solver, compiled=False))
QUICK = replace(
    INTERPRETED,
    spheres="paper",
    contact=replace(INTERPRETED.contact, samples=2),
    solver=replace(INTERPRETED.solver, formulation="penalty", max_iterations=3),
)
"""One formulation, built in half the time, that ends at once."""
SMALL_FLAGS = (
    "--gpis.surface-points",
    60,
    "--gpis.interior-points",
    15,
    "--contact.mass",
    0,
    "--gpis.exterior-noise",
    0.2,
)


@pytest.fixture
def cloud(tmp_path, monkeypatch) -> Path:
    """The file of the ellipsoid; the current folder is empty but for it."""
    monkeypatch.chdir(tmp_path)
    np.savez(tmp_path / "one.npz", points=ellipsoid(), table_height=0.0)
    return tmp_path / "one.npz"


@pytest.fixture
def bench(cloud) -> Bench:
    """Two starts of the small problem, measured once."""
    small = Bench((cloud,), "allegro_left", "robust", INTERPRETED, starts=2, seed=0, jobs=2, repeats=1)
    small.__dict__["hand"] = hand()  # loaded once for all tests, so that its functions are built once
    return small


def benchmark(*arguments: object) -> int:
    return run(["benchmark", *map(str, arguments), "--solver.no-compiled"])


def made_up(monkeypatch, solves: Iterator[tuple[int, float, float]]) -> None:
    """Iterations, time and time of the functions [s] of the solves to come; plans whose starts take a second each."""

    def timed(planner: object, start: object) -> solving.Solve:
        iterations, wall, inside = next(solves)
        return solving.Solve(SimpleNamespace(iterations=iterations), Time(wall, wall / 2), inside)

    monkeypatch.setattr(solving, "timed", timed)
    monkeypatch.setattr(solving, "planned", lambda bench, seen, count: SimpleNamespace(seconds={"solve": 1.0 * count}))


# --- rows ------------------------------------------------------------------------------------------------------------


def test_a_row_has_the_least_the_middle_and_the_largest_value():
    row = spread("iterations", "1", [5, 1, 9, 2], "note")
    assert (row.name, row.unit, row.min, row.median, row.max, row.repeats) == ("iterations", "1", 1, 3.5, 9, 4)
    assert math.isnan(row.cpu)


def test_a_time_is_told_in_its_unit_with_the_median_of_the_cpu_time():
    times = [Time(0.001, 0.003), Time(0.002, 0.001), Time(0.006, 0.002)]
    row = timing("call", "ms", times)
    assert [row.min, row.median, row.max, row.cpu, row.repeats] == pytest.approx([1, 2, 6, 2, 3])
    assert timing("call", "µs", times).median == pytest.approx(2000)


def test_a_warm_task_is_repeated_until_a_clock_can_tell_its_time(monkeypatch):
    calls, now = [], [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])

    def task() -> None:
        calls.append(1)
        now[0] += measure.LEAST / 7.5

    assert [t.wall for t in warm_times(task, 3)] == pytest.approx([measure.LEAST / 7.5] * 3)
    assert len(calls) == 2 + 3 * 8


def test_a_cold_task_is_called_once_a_value():
    calls: list[int] = []
    assert len(cold_times(partial(calls.append, 1), 3)) == 3
    assert len(calls) == 3


def test_the_result_of_a_task_comes_with_its_times(monkeypatch):
    wall, cpu = iter([10.0, 13.0]), iter([1.0, 1.5])
    monkeypatch.setattr(time, "perf_counter", lambda: next(wall))
    monkeypatch.setattr(measure, "cpu_seconds", lambda: next(cpu))
    result, spent = clocked(lambda: sum(range(10)))
    assert result == 45
    assert spent == Time(3.0, 0.5)


def test_rows_survive_the_file(tmp_path):
    rows = [replace(timing("call", "ms", [Time(1.0, 2.0)]), question="why?"), spread("memory", "MB", [1.5], "a, b")]
    results.write_rows(tmp_path / "rows.csv", rows)
    assert repr(results.read_rows(tmp_path / "rows.csv", Row)) == repr(rows)
    assert {field.type for field in fields(Row)} <= {str, int, float, bool}


def test_there_is_a_table_for_each_question():
    rows = [replace(spread(name, "s", [1.0]), question=q) for q, name in (("a?", "x"), ("b?", "y"), ("a?", "z"))]
    tables = benchmarks.tables(rows)
    assert {question: [line["what"] for line in lines] for question, lines in tables.items()} == {
        "a?": ["x", "z"],
        "b?": ["y"],
    }
    assert tables["a?"][0]["CPU"] == ""


def test_targets_are_judged_by_the_median_and_stand_first():
    rows = [
        replace(spread(name, unit, values), question="how long?")
        for name, unit, values in (("a start", "s", [0.1, 0.11, 9.0]), ("an iteration", "ms", [0.1, 1.1, 1.2]))
    ]
    tables = benchmarks.tables(rows)
    assert list(tables) == [TARGETS_MET, "how long?"]
    assert [(line["what"], line["target"], line["met"]) for line in tables[TARGETS_MET]] == [
        ("a start", "0.12", "yes"),
        ("an iteration", "0.9", "no"),
    ]


def test_every_target_is_of_something_that_is_measured(bench, monkeypatch):
    made_up(monkeypatch, solves=iter(7 * [(10, 1.0, 0.5)]))
    measured = {row.name for section in (solving.solves, oracle_rows) for row in section(replace(bench, starts=7))}
    elsewhere = ("sgnlp solve,", "sgnlp batch,", "compile the functions", replanning.STEP, cluster.LOST)
    assert {name for name in TARGETS if not name.startswith(elsewhere)} <= measured


@pytest.mark.parametrize(("value", "text"), [(0.012345, "0.0123"), (12.345, "12.3"), (123456.7, "123457"), (0, "0")])
def test_numbers_have_three_digits(value, text):
    assert benchmarks.number(value) == text


# --- what is measured ------------------------------------------------------------------------------------------------


def test_a_call_into_buffers_gives_what_the_function_gives():
    problem = posed(SMALL)
    joined, x, p = scene(problem, 0)
    ones = np.ones(sum(joined.nlp.row_sizes))
    arguments = {"H": (1.0, ones)}
    for name, attribute in FUNCTIONS.items():
        function = getattr(joined, attribute)
        once = call(function, x, p, moving=False)
        once()
        expected = function(x, p, *arguments.get(name, ()))
        expected = expected if isinstance(expected, tuple) else [expected]
        for found, block in zip(once.__defaults__[0][2], expected, strict=True):
            np.testing.assert_array_equal(found, block.nonzeros())


def test_only_at_a_new_x_is_the_surface_evaluated_and_once_for_all_functions():
    problem = posed(SMALL)
    _, x, p = scene(problem, 0)
    joined = join(oracle(SMALL, "constrained").nlp, problem.gpis)
    for moving, evaluations in ((False, 1), (True, 5)):
        calls = [call(getattr(joined, name), x, p, moving) for name in FUNCTIONS.values()]
        for _ in range(4):
            for once in calls:
                once()
        assert joined.surface.evaluations == evaluations


def test_a_rate_is_flops_over_time():
    assert rates(4e9, [Time(2.0, 1.0), Time(0.5, 1.0)]) == [2.0, 8.0]


@pytest.mark.parametrize("hessian", ["limited-memory", "exact"])
def test_the_limited_memory_planner_needs_no_hessian(hessian):
    problem = posed(replace(SMALL, solver=replace(SMALL.solver, max_iterations=3, penalty_iterations=2)))
    answers = Planner(problem, Ipopt(hessian=hessian)).run(*starts(problem, 1, 0))
    assert [answer.iterations for answer in answers] == [2, 3]
    assert [answer.calls["hess"] > 0 for answer in answers] == [hessian == "exact"] * 2


def test_solves_are_counted_by_start_and_by_object(bench, monkeypatch):
    made_up(monkeypatch, solves=iter([(10, 1.0, 0.4), (40, 2.0, 1.2)]))
    monkeypatch.setattr(solving, "clocked", lambda task: (task(), Time(5.0, 3.0)))
    rows = {row.name: (row.min, row.max, row.repeats) for row in solving.solves(bench)}
    assert rows == {
        "iterations of a start": (10, 40, 2),
        "an iteration": pytest.approx((50, 100, 2)),  # [ms]
        "an iteration: f, ∇f, g, J, H": pytest.approx((30, 40, 2)),
        "an iteration: the rest": pytest.approx((20, 60, 2)),
        "a start": (1, 2, 2),
        "an object, 1 starts, one core": (1, 1, 1),
        "an object, 2 starts, one core": (3, 3, 1),
        "sgnlp.solve, 1 starts, 2 jobs": (5, 5, 1),
        "sgnlp.solve, 1 starts, 2 jobs: solving": (1, 1, 1),
        "sgnlp.solve, 2 starts, 2 jobs": (5, 5, 1),
        "sgnlp.solve, 2 starts, 2 jobs: solving": (2, 2, 1),
    }


def test_a_solve_is_timed_with_what_casadi_counts_of_the_functions(monkeypatch):
    problem = posed(replace(SMALL, solver=replace(SMALL.solver, formulation="penalty", max_iterations=3)))
    planner, (start,) = Planner(problem), starts(problem, 1, 0)
    monkeypatch.setattr(solving, "clocked", lambda task: (task(), Time(5.0, 3.0)))
    solve = solving.timed(planner, start)
    assert (solve.iterate.iterations, solve.time) == (3, Time(5.0, 3.0))
    assert 0 < solve.oracle < 100


def test_growth_has_a_row_for_each_size(bench, monkeypatch):
    monkeypatch.setattr(growth, "SURFACE_POINTS", (20, 40))
    monkeypatch.setattr(growth, "STARTS", (1, 2))
    bench = replace(bench, settings=QUICK)
    assert [row.name.split(":")[0] for row in growth.points(bench)] == ["N = 49"] * 3 + ["N = 69"] * 3
    assert [row.name for row in growth.count_starts(bench)] == ["1 starts", "2 starts"]


def test_each_opponent_has_its_ratio(bench, monkeypatch):
    monkeypatch.setattr(ratios, "STEPS", 3)
    monkeypatch.setattr(ratios, "plain_hessian", lambda *_: oracle(SMALL, "constrained").hessian)
    quick = replace(INTERPRETED, solver=replace(INTERPRETED.solver, max_iterations=20))
    rows = list(ratios.rows(replace(bench, settings=quick, starts=1)))
    over = [row.name for row in rows if " over " in row.name]
    assert over == [
        "limited memory over exact Hessian",
        "MUMPS over exact Hessian",
        "3 steps of rmsprop over Ipopt",
        "3 steps of adamw over Ipopt",
        "plain Hessian over ours",
    ]
    assert [row.note for row in rows if row.name == "limited memory: iterations"] == ["0 of 1 starts solved"]
    (above,) = [row for row in rows if row.name == "3 steps of adamw: energy above Ipopt's"]
    assert above.min > 0  # three steps lead nowhere
    assert above.note.endswith("lower for 1 of 1 starts")


def test_objects_are_taken_one_two_four_and_so_on(bench, monkeypatch):
    seen = []
    monkeypatch.setattr(growth, "planned", lambda bench, observation, count: seen.append(count))
    bench.__dict__["observations"] = [None] * 5
    assert [row.name for row in growth.objects(bench)] == ["1 objects", "2 objects", "4 objects"]
    assert seen == [2] * 7


def test_a_batch_of_many_objects_is_timed_and_its_memory_looked_at(bench, monkeypatch):
    monkeypatch.setattr(growth, "LOOKING", 0.1)
    monkeypatch.setattr(growth, "clocked", lambda task: (task(), Time(90.0, 30.0)))
    bench = replace(bench, objects=3, settings=QUICK)
    rows = {row.name.removeprefix("sgnlp batch, 3 objects"): row for row in growth.many(bench)}
    assert list(rows) == ["", ": planning one", ": memory, early", ": memory, late"]
    assert "2 starts each, 2 jobs;" in rows[""].note
    assert rows[""].note.endswith("0 failed")
    assert rows[": planning one"].repeats == 3
    assert (rows[""].median, rows[""].cpu) == (90, 30)
    assert rows[": memory, late"].median > 50


def test_many_objects_are_the_given_ones_turned_and_scaled_on_their_table(bench, tmp_path):
    (seen,) = bench.observations
    files = growth.variations([seen], 5, 1, tmp_path)
    assert len(set(files)) == 5
    sizes = []
    for file in files:
        with np.load(file) as made:
            points = made["points"]
        scale = np.ptp(points[:, 2]) / np.ptp(seen.points[:, 2])
        np.testing.assert_allclose(points[:, 2] - seen.table_height, scale * (seen.points[:, 2] - seen.table_height))
        spread_before, spread_after = (np.linalg.eigvalsh(np.cov(p[:, :2].T)) for p in (seen.points, points))
        np.testing.assert_allclose(spread_after, scale**2 * spread_before)
        sizes.append(scale)
    assert len(set(sizes)) == 5
    assert growth.SIZES[0] < min(sizes) < max(sizes) < growth.SIZES[1]


def test_the_cameras_of_many_objects_turn_along_with_them(bench, tmp_path):
    seen = sgnlp.load(Path(__file__).parents[2] / "problems" / "mug_0.npz")
    (file,) = growth.variations([seen], 1, 1, tmp_path)
    with np.load(file) as made:
        far = np.linalg.norm(made["camera_positions"][made["view"]] - made["points"], axis=1)
        scale = np.ptp(made["points"][:, 2]) / np.ptp(seen.points[:, 2])
    np.testing.assert_allclose(far, scale * np.linalg.norm(seen.camera_positions[seen.view] - seen.points, axis=1))
    assert sgnlp.load(file).camera_positions.shape == seen.camera_positions.shape


def test_the_course_of_the_memory_is_told_early_without_the_start_and_late():
    assert growth.parts(list(range(10))) == {"early": [2, 3], "late": [8, 9]}
    assert growth.parts([7.0]) == {"early": [7.0], "late": [7.0]}


def test_what_the_phases_and_the_comparisons_need_is_compiled_first_and_only_if_wanted(bench, monkeypatch):
    compiled = []
    monkeypatch.setattr(
        "sgnlp.experiments.benchmarks.measure.compile_program", lambda *arguments: compiled.append(arguments[1])
    )
    monkeypatch.setattr("sgnlp.experiments.benchmarks.measure.can_compile", lambda: True)
    bench.ready()
    assert compiled == []
    for formulation, needed in {
        "two_phase": ["penalty", "constrained", "penalty"],  # the first is that of the hand alone, on any arm
        "constrained": ["constrained", "penalty"],
        "penalty": ["penalty"],
    }.items():
        compiled.clear()
        replace(bench, settings=replace(SMALL, solver=replace(SMALL.solver, formulation=formulation))).ready()
        assert [structure.formulation.name for structure in compiled] == needed


# --- processes -------------------------------------------------------------------------------------------------------


def test_a_fresh_process_has_the_cache_folder_that_it_is_given(tmp_path, monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    with processes.cache(tmp_path):
        assert processes.fresh(os.getenv, "XDG_CACHE_HOME") == str(tmp_path)
        assert processes.fresh(os.getpid) != os.getpid()
    assert "XDG_CACHE_HOME" not in os.environ
    monkeypatch.setenv("XDG_CACHE_HOME", "before")
    with processes.cache(tmp_path):
        pass
    assert os.environ["XDG_CACHE_HOME"] == "before"


def test_the_memory_of_a_process_is_that_of_all_its_descendants(tmp_path, monkeypatch):
    seen, memory = tmp_path / "seen", processes._memory
    grandchild = f"""
import os, time
x, end = b"1" * 200_000_000, time.monotonic() + {ALIVE}
while not os.path.exists({str(seen)!r}) and time.monotonic() < end: time.sleep(0.01)
"""
    code = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {grandchild!r}], check=True)"

    def noticed(pid: int) -> tuple[float, float]:  # the grandchild lives until its memory was looked at
        found = memory(pid)
        if found[0] > 200:
            seen.touch()
        return found

    monkeypatch.setattr(processes, "COMMAND", (processes.COMMAND[0], "-c", code))
    monkeypatch.setattr(processes, "_memory", noticed)
    assert 200 < processes.peak_memory([]) < 400


def test_before_the_first_solve_there_are_import_hand_cloud_surface_and_functions(bench, monkeypatch):
    monkeypatch.setattr(startup, "fresh", lambda task, *given: task(*given))
    names = [row.name for row in startup.rows(replace(bench, settings=QUICK))]
    assert names[:3] == [
        f"python -c '{code}'" for code in ("pass", "import sgnlp.planning.solve", "import sgnlp.cli.solve")
    ]
    assert names[3:6] == ["load the hand", "load and clean a cloud", "fit the surface"]
    assert names[6:] == ["build the symbolic functions", "ready the solvers, interpreted"]


def test_a_command_that_ends_in_an_error_is_no_measurement(cloud):
    with pytest.raises(RuntimeError, match="exit code 3: error: unknown hand"):
        processes.command(["solve", str(cloud), "--hand", "nope"])


def test_the_flags_of_the_command_give_the_settings_that_are_measured(bench, monkeypatch):
    from sgnlp.cli.solve import Solve

    contact = replace(ROBUST.contact, pad=False, friction=0.8, rotation=(0.1, -0.2, 0.0))
    settings = replace(ROBUST, gpis=SMALL.gpis, contact=contact, spheres="paper")
    caught = []
    monkeypatch.setattr(Solve, "run", lambda self, console: caught.append(self) or 0)
    for name, chosen in (("robust", settings), ("paper", settings), ("paper", sgnlp.preset("paper"))):
        assert run(["solve", "one.npz", *solving.flags(replace(bench, preset=name, settings=chosen))]) == 0
        assert caught[-1].settings == chosen
        assert (caught[-1].starts, caught[-1].jobs, caught[-1].seed, caught[-1].hand) == (2, 2, 0, "allegro_left")


# --- replanning, a cluster --------------------------------------------------------------------------------------------


def test_steps_of_replanning_are_timed_beside_a_fresh_plan_of_the_last_cloud(bench, monkeypatch):
    monkeypatch.setattr(replanning, "STEPS", 3)
    bench = replace(bench, starts=1, jobs=1)
    bench.__dict__["hand"] = hand()
    rows = {row.name: row for row in replanning.rows(bench)}
    step, fresh, over = rows.values()
    assert (step.name, step.unit, step.repeats) == (replanning.STEP, "ms", 3)
    assert step.note == "1 objects x 3 steps: 3 moved, 0 fitted, 0 planned afresh, 0 without a grasp"
    assert (fresh.repeats, over.repeats) == (1, 1)
    assert over.median == pytest.approx(fresh.median / step.median)


def test_the_clouds_of_a_stream_move_on_by_the_same_step_each_with_its_own_noise(bench):
    seen = bench.observations[0]
    clouds = [seen, *replanning.stream(seen, 0)]
    assert len(clouds) == replanning.STEPS + 1
    middles = np.array([cloud.points.mean(axis=0) for cloud in clouds])
    steps = np.linalg.norm(np.diff(middles, axis=0), axis=1)
    np.testing.assert_allclose(steps, replanning.LENGTH, atol=3e-4)
    assert len({cloud.digest for cloud in clouds}) == len(clouds)


def test_the_earlier_version_is_measured_in_pairs_with_a_cache_of_its_own(bench, tmp_path, monkeypatch):
    (tmp_path / "old").mkdir()
    called = []

    def commanded(arguments, version=None):
        called.append((arguments[0], version, Path(os.environ["XDG_CACHE_HOME"]).name))

    walls = iter([3.0, 1.0, 6.0, 3.0] * 2)
    monkeypatch.setattr(earlier, "command", commanded)
    monkeypatch.setattr(earlier, "clock", lambda task: task() or Time(next(walls), 0.0))
    bench = replace(bench, earlier=tmp_path / "old", repeats=2, settings=ROBUST)
    rows = {row.name: row for row in earlier.rows(bench)}
    assert [row.median for row in rows.values()] == [3.0, 1.0, pytest.approx(1 / 3), 6.0, 3.0, 0.5]
    old = tmp_path / "old"
    pair = [("solve", old, "then"), ("solve", None, "now")]
    assert called[:2] == [("cache", old, "then"), ("cache", None, "now")]
    assert called[2:6] == [*pair, ("solve", old, "empty then 0"), ("solve", None, "empty now 0")]
    assert not list(earlier.rows(replace(bench, earlier=None)))


def test_a_command_of_another_version_runs_in_its_checkout(tmp_path):
    (tmp_path / "sgnlp").mkdir()
    (tmp_path / "sgnlp" / "cli.py").write_text("def main(): open('was_here', 'w').close()", encoding="utf-8")
    processes.command([], tmp_path)
    assert (tmp_path / "was_here").exists()


def spans(*of: tuple[int, float, float]) -> list[cluster.Span]:
    """Spans of two seconds of CPU time each: process, begin and end."""
    return [cluster.Span(process, begin, end, 2.0) for process, begin, end in of]


def test_a_worker_is_idle_between_its_own_tasks_alone():
    run = cluster.Run(spans((1, 0.0, 2.0), (2, 1.0, 9.0), (1, 2.5, 5.0), (1, 6.5, 9.0)), {}, 9.0, 0.1)
    assert run.gaps == [0.5, 1.5]
    assert run.busy == pytest.approx(2.0 / (2.0 + 1.0))
    assert cluster.Run(spans((1, 0.0, 2.0)), {}, 2.0, 0.0).busy == 1.0


def test_the_gain_of_workers_is_counted_from_their_gaps_and_their_bits_are_compared(bench, monkeypatch):
    pytest.importorskip("distributed")
    grasps = small_plan().arrays()
    other = replace(grasps, energy=grasps.energy + 1e-9)
    gaps = {1: 0.0, 4: 0.5}

    def run(files: list[Path], gap: float, last: object) -> cluster.Run:
        found = dict.fromkeys(files, grasps) | {files[-1]: last}
        return cluster.Run(spans((1, 0.0, 2.0), (1, 2.0 + gap, 4.0 + gap)), found, 60.0, 0.01)

    def on_cluster(count: int, task: object, files: list[Path], folder: Path) -> cluster.Run:
        return run(files, gaps[count], grasps if count == 1 else other)

    monkeypatch.setattr(cluster, "measured", lambda task, files, workers, folder: run(files, 0.0, grasps))
    monkeypatch.setattr(cluster, "on_cluster", on_cluster)
    rows = {row.name: row for row in cluster.rows(bench)}
    assert rows[cluster.GAIN].median == pytest.approx(4 * 2.0 / 2.5)
    assert rows[cluster.LOST].median == pytest.approx(20.0)
    assert [rows[f"dask, {n} workers: the same bits"].median for n in (1, 4)] == [12, 11]
    assert rows["dask, 4 workers: a gap"].median == pytest.approx(500.0)
    assert rows["without dask: the main process"].median == pytest.approx(10.0)


def test_every_object_is_planned_saved_and_timed_by_the_process_that_plans_it(bench, tmp_path, monkeypatch):
    made = small_plan()
    planned = made.arrays(), made.summary(), made.histories(), made.motion_files()
    monkeypatch.setattr(cluster, "plan", lambda task, file: planned)
    workers, files = Here(), [tmp_path / "one.npz", tmp_path / "two.npz"]
    run = cluster.measured(None, files, workers, tmp_path / "out")
    assert workers.closed
    assert [span.process for span in run.spans] == 2 * [os.getpid()]
    assert all(same(run.grasps[file], sgnlp.load_grasps(tmp_path / "out" / file.stem)) for file in files)


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture
def quick(monkeypatch) -> list[str]:
    """Sections that give one made-up row each; their names as they are asked for."""
    asked: list[str] = []

    def section(name: str, bench: Bench):
        asked.append(name)
        yield spread(name, "s", [1.0] * bench.repeats)

    made = {name: (f"{name}?", partial(section, name)) for name in benchmarks.SECTIONS}
    monkeypatch.setattr(benchmarks, "SECTIONS", made)
    return asked


def test_the_flag_names_every_section():
    assert get_args(Section) == tuple(benchmarks.SECTIONS)
    assert Benchmark().sections == tuple(benchmarks.SECTIONS)


def test_every_section_is_measured_unless_some_are_named(cloud, quick, capfd):
    assert benchmark(cloud) == 0
    assert quick == list(benchmarks.SECTIONS)
    quick.clear()
    assert benchmark(cloud, "--sections", "points", "oracle", "--repeats", 3) == 0
    assert quick == ["points", "oracle"]
    rows = results.read_rows(Path("results/benchmark/rows.csv"), Row)
    assert [(row.question, row.name, row.repeats) for row in rows] == [
        ("points?", "points", 3),
        ("oracle?", "oracle", 3),
    ]
    assert "written: results/benchmark" in capfd.readouterr().out


def test_the_problems_are_measured_where_no_cloud_is_named(cloud, quick):
    Path("problems").mkdir()
    for name in ("b_0", "a_1", "a_0"):
        (Path("problems") / f"{name}.npz").write_bytes(cloud.read_bytes())
    assert benchmark("--sections", "oracle") == 0
    made = json.loads(Path("results/benchmark/made.json").read_text(encoding="utf-8"))
    assert list(made["inputs"]) == ["a_0", "b_0"]


def test_beside_the_rows_stand_command_settings_versions_and_machine(cloud, quick):
    assert benchmark(cloud, "--sections", "oracle", "--seed", 3, "--out", "out", *SMALL_FLAGS) == 0
    assert sorted(path.name for path in Path("out").iterdir()) == ["made.json", "rows.csv", "table.md"]
    made = json.loads(Path("out/made.json").read_text(encoding="utf-8"))
    assert made["command"].startswith("sgnlp")
    assert (made["study"]["seed"], made["study"]["sections"]) == (3, ["oracle"])
    assert made["study"]["settings"]["gpis"]["surface_points"] == 60
    assert {"versions", "machine", "inputs"} <= set(made)
    assert made["machine"]["processors"] >= 1
    assert Path("out/table.md").read_text(encoding="utf-8").startswith("## oracle?\n\n| what | unit | median |")


def test_what_was_measured_before_an_interrupt_is_kept(cloud, quick, monkeypatch, capfd):
    def interrupted(bench: Bench):
        raise KeyboardInterrupt
        yield

    monkeypatch.setitem(benchmarks.SECTIONS, "surface", ("surface?", interrupted))
    assert benchmark(cloud, "--sections", "oracle", "surface", "--out", "out") == 130
    with open("out/rows.csv", encoding="utf-8", newline="") as file:
        assert [line["name"] for line in csv.DictReader(file)] == ["oracle"]
    assert capfd.readouterr().err == "interrupted\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("none.npz",), "there is no such file"),
        ((), "no cloud is named"),
        (("one.npz", "--repeats", 0), "--repeats must be positive"),
        (("one.npz", "--hand", "nope"), "unknown hand"),
        (("one.npz", "--earlier", "nowhere"), "there is no checkout of sgnlp in 'nowhere'"),
    ],
)
def test_bad_input_is_told_before_any_measurement(arguments, message, cloud, quick, capfd):
    assert benchmark(*arguments) == 3
    out, err = capfd.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err
    assert not quick
    assert not Path("results").exists()


def test_a_section_runs_from_the_command_to_its_table(cloud, capfd):
    quick = ["--contact.samples", 2, "--spheres", "paper", "--solver.formulation", "penalty"]
    assert benchmark(cloud, "--sections", "surface", "--repeats", 2, *SMALL_FLAGS, *quick) == 0
    rows = results.read_rows(Path("results/benchmark/rows.csv"), Row)
    assert {row.name for row in rows} >= {"peak", "jets in NumPy"}
    assert {row.repeats for row in rows} == {2}
    assert any("N = 89, V = 12" in row.note for row in rows)
    assert "jets in NumPy" in " ".join(capfd.readouterr().out.split())
