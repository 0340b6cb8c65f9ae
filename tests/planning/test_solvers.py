"""Solvers: all that run find a known solution, what they call is counted, their functions are exact."""

import os
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from plans import SMALL_FLAGS
from processes import PATIENT
from scenes import SMALL, hand, observation, oracle, posed, random_point

import sgnlp
from sgnlp.base.errors import InputError, SolverError
from sgnlp.cli import run
from sgnlp.cli.again import command
from sgnlp.experiments.compare.meter import Meter
from sgnlp.experiments.compare.probe import SOLUTION, START, instance, missing, problem
from sgnlp.planning.multipliers import smallest_residuals
from sgnlp.planning.plan import Plan
from sgnlp.planning.planner import Planner, _answer
from sgnlp.planning.results import HISTORY, load_grasps
from sgnlp.planning.solvers import SOLVERS, solver_named
from sgnlp.planning.solvers.bridge import differentiable
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.solvers.plugins import Plugin
from sgnlp.planning.solvers.process import apart, silence, spend
from sgnlp.planning.solvers.solver import Answer, Refusal, Solver
from sgnlp.planning.starts import starts
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.show import plots
from sgnlp.show.report.figures import convergence

SOLVE = ["ipopt", "ipopt-limited", "ipopt-spral", "fatrop", "uno-ipopt", "uno-filtersqp", "lbfgsb", "slsqp"]
SOLVE += ["trust-constr", "sqp-daqp", "sqp-qpoases", "sqp-limited"]
"""What must run wherever the wheels of CasADi and SciPy do, and solve a problem of four variables."""


def solved(name: str, tolerance: float = 1e-7) -> tuple[list, str]:
    """The answer of a solver to the small problem, from a process of its own, and why there is none."""

    def work(send):
        given = instance(tolerance)
        answer = solver_named(name).solve(given, START)
        kkt, _ = smallest_residuals(given, answer.x, answer.multipliers)
        send((answer.x, kkt))

    return apart(work, 20.0)


@pytest.mark.parametrize("name", SOLVE)
def test_a_problem_of_known_solution_is_solved_by_every_solver_that_should(name):
    ((x, kkt),), reason = solved(name)
    assert reason == ""
    np.testing.assert_allclose(x, SOLUTION, atol=1e-4)
    assert kkt.worst < 1e-4


@pytest.mark.parametrize("name", ["adamw-1000", "rmsprop-1000"])
def test_first_order_steps_descend_and_the_point_kept_is_one_where_the_rows_hold(name):
    ((x, kkt),), _ = solved(name)
    assert kkt.primal <= 1e-6
    assert -44.0 < float(problem().objective(x, 1.0)) < -25.0


def test_every_solver_has_a_name_of_its_own_and_says_what_it_is():
    assert {"ipopt", "fatrop", "sqp-daqp", "slsqp", "adamw-200"} <= set(SOLVERS)
    for name, entry in SOLVERS.items():
        assert entry.solver.name == name == entry.solver.told()["name"]
        assert entry.derivatives in (1, 2)
        assert entry.kind
        assert entry.summary
    with pytest.raises(InputError, match=r"unknown solver 'newton'; valid: .*ipopt"):
        solver_named("newton")


def test_the_list_of_solvers_imports_no_optimiser_of_scipy():
    code = "import sys; import sgnlp.planning.solvers; print('scipy.optimize' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_a_solver_that_is_not_there_says_so():
    assert "has no plugin 'worhp'" in missing(Plugin(name="worhp", plugin="worhp"))
    assert missing(Ipopt()) == ""


def test_the_command_lists_the_solvers_and_why_one_does_not_run(monkeypatch, capfd):
    absent = replace(SOLVERS["fatrop"], solver=Plugin(name="snopt", plugin="snopt"))
    monkeypatch.setattr("sgnlp.experiments.cli.solvers.SOLVERS", {"ipopt": SOLVERS["ipopt"], "snopt": absent})
    assert run(["solvers"]) == 0
    out = " ".join(capfd.readouterr().out.split())
    assert "interior point" in out
    assert "has no plugin" in out


def test_equality_rows_are_refused_by_first_order_methods():
    given = replace(instance(), g_bounds=(np.zeros(3), np.zeros(3)))
    with pytest.raises(Refusal, match="equality"):
        solver_named("adamw-200").solve(given, START)


@pytest.mark.parametrize("name", ["sqp-qpoases", "sqp-osqp", "uno-filtersqp"])
def test_a_start_is_solved_the_same_whatever_was_solved_before_it(name):
    given, solver = instance(), solver_named(name)
    solver.prepare(given)
    first = solver.solve(given, START).x
    solver.solve(given, START + 0.5)
    solver.prepare(given)
    np.testing.assert_array_equal(solver.solve(given, START).x, first)


def test_what_libraries_print_is_lost_and_what_comes_after_is_not(capfd):
    with silence():
        print("lost")
        os.write(1, b"lost")
        os.write(2, b"lost")
    solver_named("sqp-qpoases").solve(instance(), START)
    print("heard")
    assert capfd.readouterr() == ("heard\n", "")


# --- a plan ----------------------------------------------------------------------------------------------------------

PLAIN = replace(SMALL, solver=replace(SMALL.solver, formulation="penalty", compiled=False))


PAGE = (Path(__file__).parents[2] / "docs" / "pages" / "howto" / "solver.md").read_text(encoding="utf-8")


def of_the_page() -> type[Solver]:
    """The optimiser of ten lines that the documentation shows."""
    (code,) = re.findall(r"```python\n(import numpy[^`]*class Signs[^`]*)```", PAGE)
    assert len(code[code.index("class") :].splitlines()) <= 10
    names: dict = {}
    exec(code, names)
    return names["Signs"]


Signs = of_the_page()


@pytest.fixture(scope="module")
def lowered() -> Plan:
    """What the optimiser plans."""
    return sgnlp.solve(observation(), hand(), PLAIN, solver=Signs(), count=2, jobs=2, rounds=1)


def test_an_optimiser_of_ten_lines_plans_like_any_other(lowered):
    assert not lowered.failures
    assert lowered.meta()["solver"] == {"name": "signs", "tolerance": None}
    planner = Planner(replace(posed(PLAIN), formulation=Penalty()))
    for solution in lowered.solutions:
        nlp, x = planner.begin(planner.stages[0], starts(planner.problem, 2, 0)[solution.start])
        answer = Signs().solve(nlp, x)
        assert nlp.objective(answer.x) < nlp.objective(x) - 1.0
        ended = planner.ended(starts(planner.problem, 2, 0)[solution.start], [answer])
        assert solution.kkt == ended.kkt  # of multipliers that are estimated
        assert solution.violations == ended.violations


def test_a_plan_whose_solver_tells_no_way_is_saved_without_histories(lowered, tmp_path):
    assert lowered.histories() == {}
    lowered.save(tmp_path)
    assert not (tmp_path / HISTORY).exists()
    assert load_grasps(tmp_path).meta["solver"]["name"] == "signs"


def test_what_a_solver_does_not_tell_of_its_way_is_missing_from_the_figure_alone():
    class Told(Signs):
        def solve(self, nlp, x):
            answer = super().solve(nlp, x)
            return replace(answer, way={"obj": [nlp.objective(x), nlp.objective(answer.x)]})

    plan = sgnlp.solve(observation(), hand(), PLAIN, solver=Told(), count=1, jobs=1, rounds=1)
    histories = plan.histories()
    assert len(histories["energy"]) == 2
    assert np.isnan(histories["primal"]).all()
    panels = convergence(histories)
    assert [panel.title for panel in panels] == ["penalty: energy", "penalty: violation"]
    assert plots.draw(panels, "how it went")["svg"].startswith(b"<?xml")


def test_a_solver_that_refuses_or_fails_is_the_failure_of_a_start_in_one_line():
    class Stuck(Solver):
        def solve(self, nlp, x):
            return Answer(np.full_like(x, np.nan))

    two_phase = replace(PLAIN, solver=replace(PLAIN.solver, formulation="two_phase"))
    for settings, solver, reason in (
        (two_phase, "adamw-200", "adamw-200 cannot handle equality rows; the penalty formulation has none"),
        (PLAIN, Stuck(), "solver stuck returned an x that is not finite"),
        (PLAIN, Plugin(name="knitro", plugin="knitro"), f"casadi {ca.__version__} has no plugin 'knitro' here"),
    ):
        plan = sgnlp.solve(observation(), hand(), settings, solver=solver, count=1, jobs=1)
        assert [failure.reason for failure in plan.failures] == [reason]
        assert plan.summary()["starts_table"] == [{"start": 0, "failure": reason}]


@dataclass(frozen=True)
class Wrong(Solver):
    """A solver with any answer."""

    given: object = None

    def solve(self, nlp, x):
        return self.given


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (np.zeros(5), "ndarray, expected sgnlp.Answer"),
        (Answer(np.zeros((5, 1))), r"x of shape \(5, 1\), float64; expected \(5,\) of numbers"),
        (Answer(np.zeros(4)), r"x of shape \(4,\)"),
        (Answer(None), r"x of shape \(\), object"),
        (Answer(np.zeros(5, complex)), r"x of shape \(5,\), complex128"),
        (Answer(np.array(["0"] * 5)), r"x of shape \(5,\), <U1"),
        (Answer(np.zeros(5), multipliers=np.zeros(5)), r"multipliers that are no pair"),
        (Answer(np.zeros(5), multipliers=(np.zeros(5), np.zeros(2))), r"λ_g of shape \(2,\), .* expected \(3,\)"),
    ],
)
def test_an_answer_of_another_shape_or_kind_is_told_with_the_right_one(given, said):
    program = SimpleNamespace(g_bounds=(np.zeros(3), np.zeros(3)), x_bounds=(np.zeros(5), np.ones(5)))
    with pytest.raises(SolverError, match=f"solver wrong returned {said}"):
        _answer(Wrong(given=given), program, np.zeros(5))


def test_who_ends_beyond_a_bound_of_the_variables_is_moved_onto_it_and_told():
    class Unbounded(Solver):
        def solve(self, nlp, x):
            nlp.x_bounds[1][:] = 9.0  # its own affair
            return Answer(np.array([-0.5, 0.5, 1.25]), "ended")

    def bounds() -> SimpleNamespace:
        return SimpleNamespace(g_bounds=(np.zeros(0), np.zeros(0)), x_bounds=(np.zeros(3), np.ones(3)))

    moved = _answer(Unbounded(), bounds(), np.zeros(3))
    assert moved.x.tolist() == [0.0, 0.5, 1.0]
    assert moved.status == "ended; it ended 0.5 beyond a bound of the variables and was moved onto it"
    rounded = np.array([-1e-8, 0.5, 1.0])
    kept = _answer(Wrong(given=Answer(rounded, "ended")), bounds(), np.zeros(3))
    assert (kept.x.tolist(), kept.status) == (rounded.tolist(), "ended")


def test_no_solver_gives_a_grasp_gains_that_the_hand_does_not_have():
    @dataclass(frozen=True)
    class Stiff(Ipopt):
        def solve(self, nlp, x):
            end = np.array(super().solve(nlp, x).x)
            end[-4:] = 2 * nlp.x_bounds[1][-4:]
            return Answer(end)

    settings = replace(SMALL, solver=replace(SMALL.solver, formulation="penalty", max_iterations=5))
    plan = sgnlp.solve(observation(), hand(), settings, solver=Stiff(), count=1, jobs=1, rounds=1, widen=False)
    (ended,) = plan.solutions
    np.testing.assert_allclose(ended.grasp.gains, plan.problem.gain_bounds()[1], rtol=1e-12)


def test_the_command_plans_with_a_solver_of_the_table_beside_the_flags_of_settings(tmp_path, capfd):
    np.savez(tmp_path / "cloud.npz", points=observation().points, table_height=0.0)
    flags = [*SMALL_FLAGS, "--starts", "1", "--solver.formulation", "penalty", "--solver.no-compiled", "--quiet"]
    out = ["--out", str(tmp_path / "out")]
    assert run(["solve", str(tmp_path / "cloud.npz"), *flags, *out, "--solver", "adamw-200"]) in (0, 1)
    grasps = load_grasps(tmp_path / "out")
    assert grasps.meta["solver"] == {"name": "adamw-200", "tolerance": None, "optimiser": "adamw", "steps": 200}
    assert grasps.meta["settings"]["solver"]["formulation"] == "penalty"
    assert "--solver adamw-200 " in command(grasps.meta, tmp_path)
    assert run(["solve", str(tmp_path / "cloud.npz"), *flags, *out, "--solver", "newton"]) == 3
    assert "unknown solver 'newton'; valid: adamw-1000, " in capfd.readouterr().err


# --- functions -------------------------------------------------------------------------------------------------------


def test_derivatives_that_casadi_makes_of_the_bridge_are_those_of_the_functions():
    functions, rng = problem(), np.random.default_rng(0)
    given = differentiable(functions)
    x, lam, v, p = rng.normal(size=4), rng.normal(size=4), rng.normal(size=4), np.array([1.3])
    symbols, lam_, v_ = [given["x"], given["p"]], ca.MX.sym("lam", 4), ca.MX.sym("v", 4)
    lagrangian = ca.gradient(lam_[0] * given["f"] + ca.dot(lam_[1:], given["g"]), given["x"])
    f = ca.Function("f", symbols, [given["f"], ca.gradient(given["f"], given["x"])])
    g = ca.Function("g", symbols, [given["g"], ca.jacobian(given["g"], given["x"])])
    h = ca.Function("h", [*symbols, lam_], [ca.jacobian(lagrangian, given["x"])])
    product = ca.Function("product", [*symbols, lam_, v_], [ca.jtimes(lagrangian, given["x"], v_)])
    U = np.array(functions.hessian(x, p, lam[0], lam[1:]))
    H = U + np.triu(U, 1).T
    for found, expected in (
        *zip(f(x, p), functions.gradient(x, p), strict=True),
        *zip(g(x, p), functions.jacobian(x, p), strict=True),
        (h(x, p, lam), H),
        (product(x, p, lam, v), H @ v),
    ):
        np.testing.assert_allclose(np.array(found).squeeze(), np.array(expected).squeeze(), rtol=1e-12, atol=1e-12)


def test_the_bridge_has_the_hessian_of_the_real_program():
    functions, given = oracle(SMALL, "penalty"), differentiable(oracle(SMALL, "penalty"))
    start, x = random_point(posed(SMALL), functions.nlp, 1)
    p = posed(SMALL).parameters(functions.nlp, start.wrist, start.joints)
    lam = np.random.default_rng(1).normal(size=given["g"].numel())
    energy = given["f"] + ca.dot(lam, given["g"])
    H = ca.Function("H", [given["x"], given["p"]], [ca.hessian(energy, given["x"])[0]])
    U = np.array(functions.hessian(x, p, 1.0, lam))
    np.testing.assert_allclose(np.triu(np.array(H(x, p))), U, rtol=1e-9, atol=1e-9 * np.abs(U).max())


def test_calls_and_the_points_of_gradients_are_counted_at_the_functions():
    meter = Meter(problem())
    x, p = np.arange(4.0), np.ones(1)
    assert float(meter.functions.objective(x, p)) == float(problem().objective(x, p))
    for _ in range(2):
        meter.functions.gradient(x, p)
    meter.functions.hessian(x, p, 1.0, np.zeros(3))
    assert dict(meter.calls) == {"f": 1, "grad": 2, "hess": 1}
    assert [point.tolist() for _, point in meter.points] == [x.tolist()] * 2
    meter.clear()
    assert not meter.calls
    assert not meter.points


def test_a_metered_solver_takes_the_same_steps():
    given = instance()
    meter = Meter(given.functions)
    tasks = given, replace(given, functions=meter.functions)
    plain, metered = (Ipopt().solve(t, START) for t in tasks)
    np.testing.assert_array_equal(plain.x, metered.x)
    assert meter.calls["hess"] == metered.iterations == plain.iterations


# --- multipliers -----------------------------------------------------------------------------------------------------


def residuals_at(x, multipliers=None):
    given = instance()
    return smallest_residuals(given, np.asarray(x), multipliers)


def test_estimated_multipliers_prove_a_solution_for_which_a_solver_has_none_or_bad_ones():
    bad = np.full(4, 3.0), np.full(3, -5.0)
    for multipliers in (None, bad):
        kkt, estimated = residuals_at(SOLUTION, multipliers)
        assert estimated
        assert kkt.worst < 1e-8
    true = np.zeros(4), np.array([-1.0, 0.0, -2.0])
    assert residuals_at(SOLUTION, true)[0].worst < 1e-12


def test_no_estimate_proves_a_point_that_is_no_solution():
    assert residuals_at(SOLUTION - np.eye(4)[2] / 10)[0].dual > 0.1
    assert residuals_at(SOLUTION + np.eye(4)[2] / 10)[0].primal > 0.1


def test_a_point_that_is_not_finite_has_residuals_that_are_not():
    assert not residuals_at(np.full(4, np.nan))[0].worst < 1e300


# --- processes -------------------------------------------------------------------------------------------------------


def test_what_was_sent_before_a_crash_is_kept_with_the_reason():
    def crash(send):
        send(1)
        import os
        import signal

        os.kill(os.getpid(), signal.SIGSEGV)

    assert apart(crash, 5.0) == ([1], "killed by SIGSEGV")


def test_a_process_that_works_for_too_long_is_ended_by_its_processor_time(monkeypatch):
    monkeypatch.setattr("sgnlp.planning.solvers.process.WALL_FACTOR", PATIENT)

    def burn(send):
        spend(0.1)
        send("begun")
        while True:
            pass

    assert apart(burn, 0.1) == (["begun"], "over 0.1 s of processor time")


def test_a_process_that_sleeps_is_ended_by_the_clock(monkeypatch):
    monkeypatch.setattr(
        "sgnlp.planning.solvers.process.WALL_FACTOR", 30.0
    )  # the word before it sleeps has time to come

    def sleep(send):
        import time

        send("begun")
        time.sleep(100)

    assert apart(sleep, 0.1) == (["begun"], "no word for 3 s")


def test_an_error_in_a_process_is_its_reason():
    def fail(send):
        raise Refusal("not with me")

    assert apart(fail, 1.0) == ([], "not with me")
