"""Nonlinear programs of problems for whoever has only CasADi: functions, bounds, a start, the best known point."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from pinocchio.liegroups import SE3

from sgnlp.experiments import load_nlp
from sgnlp.hand.kinematics import integrate
from sgnlp.planning import results
from sgnlp.planning.ipopt import Iterate, Planner, schedule
from sgnlp.planning.problem import Problem
from sgnlp.planning.starts import Start, initial
from sgnlp.planning.warm_start import handed_over
from sgnlp.program.compiled import program
from sgnlp.program.nlp import variable_units
from sgnlp.program.oracle import Oracle
from sgnlp.program.standalone import functions

Array = NDArray[np.float64]

FEASIBLE = 1e-6
"""Largest violation of a bound, in the scaled variables and rows, of a point that counts as known."""


@dataclass(frozen=True)
class Entry:
    """A line of the catalogue. `best` is the lowest objective known, `residual` its largest violation of a bound."""

    name: str
    formulation: str
    start: int
    variables: int
    rows: int
    jacobian_nonzeros: int
    hessian_nonzeros: int
    surface_points: int
    initial: float
    best: float
    residual: float
    solver: str
    best_start: int
    seed: int
    iterations: int


@dataclass(frozen=True, eq=False)
class Exported:
    """A program ready to be written: its line in the catalogue, its functions, and its arrays."""

    entry: Entry
    functions: dict[str, ca.Function]
    arrays: dict[str, Any]

    def write(self, folder: Path) -> None:
        """Write the functions, `nlp.npz`, `about.json` and the loader `load.py` into a folder.

        Raises:
            InputError: the folder cannot be written.
        """
        results.write_arrays(folder / "nlp.npz", self.arrays)
        for name, function in self.functions.items():
            results.write_text(folder / f"{name}.casadi", function.serialize())
        results.write_text(folder / "about.json", results.json_text(asdict(self.entry)))
        results.write_text(folder / "load.py", Path(load_nlp.__file__).read_text(encoding="utf-8"))


def export(name: str, problem: Problem, starts: list[Start], index: int, seed: int) -> Exported:
    """The last program of the settings' formulation as `starts[index]` meets it, with the best of what all end in.

    The variables are seen from that start's pose; what others end in counts where it is within its bounds.
    """
    start, planner = starts[index], Planner(problem)
    oracle = planner.phases[-1].oracle
    nlp = program(problem.hand, oracle.nlp.structure, compiled=False)  # compiled functions cannot be written
    p = problem.parameters(nlp, start.wrist, start.joints)
    x_bounds, g_bounds = problem.variable_bounds(nlp, start.joints), problem.row_bounds(nlp)
    x0 = np.clip(_first(problem, start, oracle, p, g_bounds), *x_bounds)
    found = [(s, planner.solve(s)) for s in starts]
    points = [(_seen_from(problem, start, s, iterate.x), s, iterate) for s, iterate in found]
    known = [(_residual(oracle, x, p, x_bounds, g_bounds), x, s, iterate) for x, s, iterate in points]
    residual, x, s, iterate = min(known, key=lambda k: _rank(k[0], float(oracle.objective(k[1], p))))
    written = functions(nlp, problem.gpis, p)
    names = {"variable_names": np.array(nlp.variable_names), "row_names": np.array(nlp.row_names)}
    bounds = dict(zip(("lbx", "ubx", "lbg", "ubg"), (*x_bounds, *g_bounds), strict=True))
    entry = _entry(name, written, problem, oracle, (start, s, iterate), (x0, x, p), residual, seed)
    return Exported(entry, written, {"x0": x0, "x_best": x, **bounds, "units": nlp.units, **names})


def _entry(
    name: str,
    written: dict[str, ca.Function],
    problem: Problem,
    oracle: Oracle,
    ends: tuple[Start, Start, Iterate],
    points: tuple[Array, Array, Array],
    residual: float,
    seed: int,
) -> Entry:
    start, best, iterate = ends
    x0, x, p = points
    return Entry(
        name=name,
        formulation=oracle.nlp.structure.formulation,
        start=start.index,
        variables=len(x),
        rows=sum(oracle.nlp.row_sizes),
        jacobian_nonzeros=written["jacobian"].nnz_out("jac_g_x"),
        hessian_nonzeros=written["hessian"].nnz_out(0),
        surface_points=len(problem.gpis.X),
        initial=float(oracle.objective(x0, p)),
        best=float(oracle.objective(x, p)),
        residual=residual,
        solver=f"ipopt {iterate.status}",
        best_start=best.index,
        seed=seed,
        iterations=iterate.iterations,
    )


def _first(problem: Problem, start: Start, oracle: Oracle, p: Array, g_bounds: tuple[Array, Array]) -> Array:
    """Where the last phase begins: at the start, or where the phase before it ends."""
    x = initial(oracle.nlp, start)
    solver = problem.settings.solver
    for _, iterations in schedule(solver)[:-1]:
        first = replace(solver, formulation="penalty", max_iterations=iterations)
        x = Planner(replace(problem, settings=replace(problem.settings, solver=first))).solve(start).x
    return handed_over(oracle, x, p, g_bounds)


def _seen_from(problem: Problem, start: Start, other: Start, x: Array) -> Array:
    """The variables of a point that was found from another start, about the pose of this one."""
    if other is start:
        return x
    units, n = variable_units(problem.hand), 6 + len(problem.hand.joint_names)
    wrist, joints = integrate(problem.hand, other.wrist, other.joints, (x[: len(units)] * units)[:n])
    v = np.concatenate([SE3().difference(start.wrist, wrist), joints - start.joints])
    return np.concatenate([v / units[:n], x[n:]])


def _residual(
    oracle: Oracle, x: Array, p: Array, x_bounds: tuple[Array, Array], g_bounds: tuple[Array, Array]
) -> float:
    g = oracle.values(x, p)
    return float(max(np.abs(x - np.clip(x, *x_bounds)).max(), np.abs(g - np.clip(g, *g_bounds)).max()))


def _rank(residual: float, objective: float) -> tuple[bool, float]:
    """Feasible points by their objective, then the others by how far they are from it."""
    feasible = residual <= FEASIBLE
    return not feasible, objective if feasible else residual
