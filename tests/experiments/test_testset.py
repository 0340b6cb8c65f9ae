"""Exported programs: the oracle's values in a process that has no sgnlp, solved there, with a best known point."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scenes import SMALL, ellipsoid, oracle, posed, random_point

from sgnlp.base.settings import Solver
from sgnlp.cli import codes, run
from sgnlp.experiments.testset import FEASIBLE, Entry, _seen_from, export
from sgnlp.planning import results
from sgnlp.planning.planner import Planner
from sgnlp.planning.starts import starts
from sgnlp.program.standalone import functions

QUICK = replace(SMALL, solver=Solver(compiled=False))
OUTSIDE = """
import sys
sys.modules["sgnlp"] = None
sys.path.insert(0, ".")
import casadi as ca
import numpy as np
from load import load

nlp, exact, arrays, about = load()
x = ca.DM(np.load("x.npy"))
gradient = ca.Function("gradient", [nlp["x"]], [ca.gradient(nlp["f"], nlp["x"])])
f, g = ca.Function("values", [nlp["x"]], [nlp["f"], nlp["g"]])(x)
quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.mu_init": 0.1}
solver = ca.nlpsol("solver", "ipopt", nlp, exact | quiet)
result = solver(**{name: arrays[name] for name in ("x0", "lbx", "ubx", "lbg", "ubg")})
values = {"f": f, "g": g, "gradient": gradient(x), "exact": exact["grad_f"](x, ca.DM())[1], "best": result["f"]}
values = {name: np.array(value) for name, value in values.items()}
np.savez("found.npz", status=solver.stats()["return_status"], **values)
"""


@pytest.fixture(scope="module")
def exported():
    problem = posed(QUICK)
    return export("ellipsoid", Planner(problem), starts(problem, 2, 0), 0, 0)


@pytest.fixture(scope="module")
def outside(exported, tmp_path_factory):
    """What a process without sgnlp finds at a random point, the folder, and the point."""
    folder = tmp_path_factory.mktemp("testset")
    exported.write(folder)
    _, x = random_point(posed(QUICK), oracle(SMALL, "constrained").nlp, 0)
    np.save(folder / "x.npy", x)
    subprocess.run([sys.executable, "-c", OUTSIDE], cwd=folder, check=True, timeout=300)
    with np.load(folder / "found.npz") as found:
        return dict(found), folder, x


def parameters() -> np.ndarray:
    problem = posed(QUICK)
    start = starts(problem, 1, 0)[0]
    return problem.parameters(oracle(SMALL, "constrained").nlp, start.wrist, start.joints)


def test_a_process_without_sgnlp_finds_the_values_and_gradients_of_the_oracle(outside):
    found, _, x = outside
    expected, p = oracle(SMALL, "constrained"), parameters()
    near = {"rtol": 1e-9, "atol": 1e-9}
    np.testing.assert_allclose(found["f"], expected.objective(x, p), **near)
    np.testing.assert_allclose(found["g"], expected.rows(x, p), **near)
    gradient = np.array(expected.gradient(x, p)[1])
    np.testing.assert_allclose(found["gradient"], gradient, rtol=1e-9, atol=1e-9 * np.abs(gradient).max())
    np.testing.assert_allclose(found["exact"], gradient, rtol=1e-9, atol=1e-9 * np.abs(gradient).max())


def test_ipopt_solves_it_there_and_finds_nothing_much_below_the_best_known_value(outside, exported):
    found, _, _ = outside
    assert str(found["status"]) == "Solve_Succeeded"
    assert found["best"].item() >= exported.entry.best - 1e-3


def test_the_second_derivatives_are_those_of_the_oracle():
    problem, expected, p = posed(QUICK), oracle(SMALL, "constrained"), parameters()
    _, x = random_point(problem, expected.nlp, 1)
    lam = np.random.default_rng(1).normal(size=sum(expected.nlp.row_sizes))
    written = functions(expected.nlp, problem.gpis, p)
    for found, wanted in (
        (written["jacobian"](x, [])[1], expected.jacobian(x, p)[1]),
        (written["hessian"](x, [], 0.7, lam), expected.hessian(x, p, 0.7, lam)),
    ):
        assert found.sparsity() == wanted.sparsity()
        np.testing.assert_allclose(
            np.array(found), np.array(wanted), rtol=1e-8, atol=1e-9 * np.abs(np.array(wanted)).max()
        )


def test_the_catalogue_has_sizes_and_a_best_known_point_that_is_feasible(exported):
    entry, arrays = exported.entry, exported.arrays
    nlp = oracle(SMALL, "constrained").nlp
    assert (entry.variables, entry.rows) == (len(nlp.units), sum(nlp.row_sizes))
    assert entry.jacobian_nonzeros == nlp.jacobian.nnz_out(1)
    assert entry.residual <= FEASIBLE
    assert entry.solver == "ipopt Solve_Succeeded"
    p, functions_ = parameters(), oracle(SMALL, "constrained")
    assert float(functions_.objective(arrays["x_best"], p)) == pytest.approx(entry.best, rel=1e-9)
    g = functions_.values(arrays["x_best"], p)
    assert (g >= arrays["lbg"] - FEASIBLE).all()
    assert (g <= arrays["ubg"] + FEASIBLE).all()
    assert (arrays["x0"] >= arrays["lbx"]).all()
    assert (arrays["x0"] <= arrays["ubx"]).all()
    assert tuple(arrays["row_names"]) == nlp.row_names


def test_a_point_found_from_another_start_is_the_same_grasp_seen_from_this_one():
    problem, nlp = posed(QUICK), oracle(SMALL, "constrained")
    first, second = starts(problem, 2, 0)
    x = np.random.default_rng(3).uniform(-0.1, 0.1, len(nlp.nlp.units))
    y = _seen_from(problem, first, second, x)
    here, there = (problem.parameters(nlp.nlp, s.wrist, s.joints) for s in (first, second))
    np.testing.assert_allclose(nlp.nlp.points(y, here)[0], nlp.nlp.points(x, there)[0], atol=1e-12)


def test_the_command_writes_programs_and_a_catalogue_or_the_catalogue_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.savez("cloud.npz", points=ellipsoid(), table_height=0.0)
    flags = ["--starts", "1", "--solver.max-iterations", "2", "--solver.no-compiled", "--gpis.surface-points", "30"]
    flags += ["--solver.formulation", "constrained", "--contact.samples", "4"]
    assert run(["export", "cloud.npz", *flags, "--catalogue"]) == codes.FEASIBLE
    written = tmp_path / "results" / "testset"
    assert {path.name for path in written.iterdir()} == {"rows.csv", "table.md", "made.json"}
    assert run(["export", "cloud.npz", *flags]) == codes.FEASIBLE
    names = {"nlp.casadi", "gradient.casadi", "jacobian.casadi", "hessian.casadi", "nlp.npz", "about.json", "load.py"}
    assert {path.name for path in (written / "cloud").iterdir()} == names
    (row,) = results.read_rows(written / "rows.csv", Entry)
    assert row.name == "cloud"
    assert row.solver == "ipopt Maximum_Iterations_Exceeded"
    assert run(["export", "cloud.npz", *flags, "--start", "1"]) == codes.BAD_INPUT
    assert run(["export", "cloud.npz", *flags, "--solver", "slsqp", "--catalogue"]) == codes.FEASIBLE
    (row,) = results.read_rows(written / "rows.csv", Entry)
    assert row.solver == "slsqp Iteration limit reached"
