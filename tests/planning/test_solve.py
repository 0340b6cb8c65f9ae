"""From a cloud to ranked grasps: Ipopt, the worker processes, their limits, and reproducibility."""

import multiprocessing
import os
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from processes import hang
from scenes import SEMI_AXES, SMALL, hand, observation, posed

from sgnlp.base.presets import PAPER, PRESETS
from sgnlp.base.settings import Settings, Solver
from sgnlp.experiments.compare.probe import instance
from sgnlp.planning.plan import Plan
from sgnlp.planning.planner import Planner
from sgnlp.planning.pool import Failure, map_starts, solve_all
from sgnlp.planning.problem import Problem
from sgnlp.planning.results import load_grasps
from sgnlp.planning.solution import Solution, solution
from sgnlp.planning.solve import solve
from sgnlp.planning.solvers import settled
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.starts import Start, starts
from sgnlp.program.formulations import formulation

STARTS = 3


def children() -> set[int]:
    """Process ids of the living children of this process."""
    tasks = Path("/proc/self/task")
    found = set()
    for task in tasks.iterdir():
        with suppress(OSError):  # a thread that has ended meanwhile
            found |= {int(pid) for pid in (task / "children").read_text(encoding="utf-8").split()}
    return found


@pytest.fixture(autouse=True)
def _leaves_no_process_behind() -> Iterator[None]:
    before = children()
    yield
    assert children() <= before
    assert not multiprocessing.active_children()


@pytest.fixture(scope="module")
def plan() -> Plan:
    return solve(observation(), hand(), SMALL, count=STARTS, jobs=2)


def test_numbers_of_numpy_are_numbers_of_a_plan_that_is_saved(tmp_path):
    plan = solve(observation(), hand(), SMALL, count=np.int32(1), seed=np.int64(0), timeout=np.float32(60))
    plan.save(tmp_path)
    assert load_grasps(tmp_path).meta["seed"] == 0


def test_an_ellipsoid_is_grasped_from_every_start(plan):
    assert not plan.failures
    assert sorted(s.start for s in plan.solutions) == list(range(STARTS))
    assert all(s.feasible for s in plan.solutions)
    assert plan.best is plan.solutions[0]
    assert plan.best.worst_margin == max(s.worst_margin for s in plan.solutions) >= 0


def test_every_solution_meets_the_optimality_conditions_that_we_recompute(plan):
    for s in plan.solutions:
        assert s.status == "Solve_Succeeded"
        assert s.kkt.worst <= 10 * SMALL.solver.tolerance
        assert s.solved(SMALL.solver.tolerance)


def test_the_contacts_of_the_best_grasp_are_on_the_true_ellipsoid_and_press_inwards(plan):
    contacts = plan.best.contact_points - [0, 0, SEMI_AXES[2]]
    level = np.linalg.norm(contacts / SEMI_AXES, axis=1)
    np.testing.assert_allclose(level, 1.0, atol=0.06)  # 2 mm
    outward = contacts / SEMI_AXES**2
    assert ((plan.best.grasp.forces * outward).sum(axis=1) < 0).all()
    assert ((plan.best.grasp.normals * outward).sum(axis=1) > 0).all()


def test_the_bounds_of_the_settings_hold_at_every_solution(plan):
    limits, tolerance = SMALL.limits, 1e-5
    for s in plan.solutions:
        g, force = s.grasp, np.linalg.norm(s.grasp.forces_eq, axis=1)
        assert (g.gains >= limits.gain_min - tolerance).all()
        assert (g.gains <= limits.gain_max + tolerance).all()
        assert (force >= limits.force_min - tolerance).all()
        assert (force <= limits.force_max + tolerance).all()
        assert np.trace(g.rotation) >= 1 + 2 * np.cos(np.radians(limits.rotation_deg)) - tolerance
        assert np.linalg.norm(g.contacts_eq - g.contacts, axis=1).max() <= limits.shift + tolerance
        assert s.margins_equilibrium.min() >= limits.margin_equilibrium - tolerance
        assert g.table_clearances.min() >= limits.table_margin - tolerance


def numbers(s: Solution) -> list[np.ndarray]:
    """All that a solution is made of, except its wall time."""
    values = vars(s.grasp) | {"links": list(s.grasp.links.values())}
    grasp = [np.asarray(value) for value in values.values()]
    checks = [np.array([c.value for c in s.checks])]
    residuals = [np.array([s.kkt.dual, s.kkt.primal, s.kkt.complementarity])]
    return [s.wrist, s.joints, s.energy_terms, np.array([s.start, s.iterations, s.energy]), *grasp, *checks, *residuals]


@pytest.mark.parametrize("jobs", [1, 3])
def test_the_result_is_the_same_bit_for_bit_whatever_the_number_of_jobs(plan, jobs):
    again = solve(observation(), hand(), SMALL, count=STARTS, jobs=jobs)
    assert [s.start for s in again.solutions] == [s.start for s in plan.solutions]
    for a, b in zip(again.solutions, plan.solutions, strict=True):
        for x, y in zip(numbers(a), numbers(b), strict=True):
            np.testing.assert_array_equal(x, y)


def test_progress_hears_of_every_start_once():
    heard: list[Solution | Failure] = []
    plan = solve(observation(), hand(), SMALL, count=2, jobs=2, progress=heard.append)
    assert sorted(r.start for r in heard) == [0, 1]
    assert {id(r) for r in heard} == {id(s) for s in plan.solutions}


# --- limits and failures --------------------------------------------------------------------------------------------


def test_a_start_that_overruns_its_limit_is_stopped_and_named(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", hang)
    plan = solve(observation(), hand(), SMALL, count=STARTS, jobs=2, timeout=0.1)
    assert [f.start for f in plan.failures] == list(range(STARTS))
    assert {f.reason for f in plan.failures} == {"stopped after 0.1 s"}
    assert plan.solutions == ()
    assert plan.best is None


def sleep_or_answer(planner: Planner, start: Start) -> int:
    """A task that hangs where no iteration would notice: only start 1."""
    if start.index == 1:
        time.sleep(1000)
    return start.index


def die_or_answer(planner: Planner, start: Start) -> int:
    if start.index == 1:
        os._exit(7)
    return start.index


def raise_or_answer(planner: Planner, start: Start) -> int:
    if start.index == 1:
        raise RuntimeError("Error in Function::call\nlibhsl.so is not there")
    return start.index


def leave_or_answer(planner: Planner, start: Start) -> int:
    if start.index == 1:
        sys.exit(4)
    return start.index


@pytest.fixture
def problem() -> Problem:
    return posed(PENALTY)


PENALTY = replace(SMALL, solver=Solver(formulation="penalty"))


@pytest.mark.parametrize(
    ("task", "timeout", "reason"),
    [
        (sleep_or_answer, 2.0, "stopped after 2 s"),  # the others end at once, on a busy machine too
        (die_or_answer, None, "process ended with exit code 7"),
        (raise_or_answer, None, "RuntimeError: libhsl.so is not there"),
        (leave_or_answer, None, "a solver, term or constraint called sys.exit(4)"),
    ],
)
def test_a_start_that_hangs_dies_or_raises_fails_alone(problem, monkeypatch, task, timeout, reason):
    monkeypatch.setattr("sgnlp.planning.pool.Planner", lambda *given: None)
    results = list(map_starts(task, problem, starts(problem, STARTS, 0), 2, timeout))
    assert Failure(1, reason) in results
    assert {0, 2} <= {r for r in results if isinstance(r, int)}
    assert len(results) == STARTS


def test_leaving_early_ends_every_process(problem):
    before, results = children(), solve_all(problem, starts(problem, 6, 0), 2, None)
    next(results)
    assert children() > before
    results.close()
    assert children() <= before


def test_an_interrupt_while_waiting_ends_every_process():
    def interrupt(result: object) -> None:
        raise KeyboardInterrupt

    before = children()
    with pytest.raises(KeyboardInterrupt):
        solve(observation(), hand(), SMALL, count=STARTS, jobs=2, progress=interrupt)
    assert children() <= before


# --- Ipopt -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("settings", PRESETS.values(), ids=PRESETS)
def test_the_hessian_is_exact_in_every_preset(settings):
    chosen = settled("ipopt", settings.solver).options(replace(instance(settings.solver.tolerance), iterations=77))
    assert chosen.get("ipopt.hessian_approximation", "exact") == "exact"
    assert chosen["ipopt.max_iter"] == 77
    assert chosen["ipopt.tol"] == settings.solver.tolerance


def test_ipopt_has_the_options_of_the_settings_where_it_has_none_of_its_own():
    chosen = replace(SMALL.solver, mu_init=0.5, linear_solver="spral", tolerance=1e-4)
    assert settled("ipopt", chosen).told() == {
        "name": "ipopt-spral",
        "tolerance": 1e-4,
        "hessian": "exact",
        "linear_solver": "spral",
        "mu_strategy": "monotone",
        "mu_init": 0.5,
        "barrier_tolerance": 100.0,
        "expect_infeasible": True,
    }
    own = settled(Ipopt(mu_init=0.2, linear_solver="mumps"), chosen)
    options = own.options(instance())
    assert (own.tolerance, own.name) == (1e-4, "ipopt-mumps")
    assert (options["ipopt.mu_init"], options["ipopt.linear_solver"]) == (0.2, "mumps")


def test_two_phases_are_a_few_penalty_iterations_and_then_the_constraints():
    solver = Solver(penalty_iterations=11, max_iterations=99)
    phases = [(phase.formulation.name, phase.iterations) for phase in formulation("two_phase").phases(solver)]
    assert phases == [("penalty", 11), ("constrained", 99)]
    assert [phase.iterations for phase in formulation("penalty").phases(solver)] == [99]


@pytest.mark.parametrize("name", ["penalty", "constrained"])
def test_each_formulation_converges_by_itself(name):
    settings = replace(SMALL, solver=Solver(formulation=name))
    planner = Planner(posed(settings))
    start = starts(planner.problem, 1, 0)[0]
    iterate = planner.solve(start)
    assert iterate.formulation == name
    assert iterate.status == "Solve_Succeeded"
    assert iterate.kkt.worst < 1e-5
    assert iterate.iterations > 5
    found = solution(planner.problem, start, iterate, planner.stages[-1].nlp)
    assert found.feasible or name == "penalty"


def test_the_surface_is_evaluated_about_once_an_iteration():
    planner = Planner(posed(PENALTY))
    iterate = planner.solve(starts(planner.problem, 1, 0)[0])
    assert planner.stages[0].oracle.surface.evaluations <= 3 * iterate.iterations


def test_a_planner_gives_the_same_answer_again():
    planner = Planner(posed(PENALTY))
    first, second = starts(planner.problem, 2, 0)
    a = planner.solve(first)
    planner.solve(second)
    np.testing.assert_array_equal(planner.solve(first).x, a.x)


@pytest.mark.parametrize(
    "settings",
    [
        replace(SMALL, contact=replace(SMALL.contact, mass=0.2)),
        replace(SMALL, weights=replace(SMALL.weights, pose=100.0)),
        replace(PAPER, gpis=SMALL.gpis, contact=replace(PAPER.contact, samples=SMALL.contact.samples)),
    ],
    ids=["heavy", "lifting", "paper"],
)
def test_other_settings_are_solved_too(settings: Settings):
    plan = solve(observation(), hand(settings.spheres), settings, count=2, jobs=2)
    assert not plan.failures
    assert all(s.solved(settings.solver.tolerance) for s in plan.solutions)
    assert plan.best is not None
