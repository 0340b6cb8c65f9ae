"""Nonlinear programs of problems for whoever has only CasADi: functions, bounds, a start, the best known point."""

from copy import copy
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from pinocchio.liegroups import SE3

from sgnlp.experiments import load_nlp
from sgnlp.hand.kinematics import integrate
from sgnlp.planning import results
from sgnlp.planning.ipopt import Planner
from sgnlp.planning.problem import Problem
from sgnlp.planning.starts import Start, initial
from sgnlp.planning.warm_start import handed_over
from sgnlp.program.compiled import program
from sgnlp.program.nlp import variable_units
from sgnlp.program.standalone import functions

Array = NDArray[np.float64]

FEASIBLE = 1e-6  # largest violation of a bound, in the scaled variables and rows, of a point that counts as known


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

        Raises `InputError`: the folder cannot be written.
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
    x0 = np.clip(handed_over(oracle, _before_last(planner, start), p, g_bounds), *x_bounds)
    ends = []
    for other in starts:
        iterate = planner.solve(other)
        x = _seen_from(problem, start, other, iterate.x)
        residual = max(_off(x, x_bounds), _off(oracle.values(x, p), g_bounds))
        objective = float(oracle.objective(x, p))
        ends.append(((residual > FEASIBLE, objective if residual <= FEASIBLE else residual), x, other, iterate))
    _, x, best, iterate = min(ends, key=lambda end: end[0])
    written = functions(nlp, problem.gpis, p)
    entry = Entry(
        name=name,
        formulation=nlp.structure.formulation,
        start=start.index,
        variables=len(x),
        rows=sum(nlp.row_sizes),
        jacobian_nonzeros=written["jacobian"].nnz_out("jac_g_x"),
        hessian_nonzeros=written["hessian"].nnz_out(0),
        surface_points=len(problem.gpis.X),
        initial=float(oracle.objective(x0, p)),
        best=float(oracle.objective(x, p)),
        residual=max(_off(x, x_bounds), _off(oracle.values(x, p), g_bounds)),
        solver=f"ipopt {iterate.status}",
        best_start=best.index,
        seed=seed,
        iterations=iterate.iterations,
    )
    names = {"variable_names": np.array(nlp.variable_names), "row_names": np.array(nlp.row_names)}
    bounds = dict(zip(("lbx", "ubx", "lbg", "ubg"), (*x_bounds, *g_bounds), strict=True))
    return Exported(entry, written, {"x0": x0, "x_best": x, **bounds, "units": nlp.units, **names})


def _before_last(planner: Planner, start: Start) -> Array:
    """Where the last phase begins: at the start, or where the phase before it ends."""
    before = copy(planner)
    before.phases = planner.phases[:-1]
    return before.solve(start).x if before.phases else initial(planner.phases[-1].oracle.nlp, start)


def _off(values: Array, bounds: tuple[Array, Array]) -> float:
    """The largest violation of a bound."""
    return float(np.abs(values - np.clip(values, *bounds)).max())


def _seen_from(problem: Problem, start: Start, other: Start, x: Array) -> Array:
    """The variables of a point that was found from another start, about the pose of this one."""
    if other is start:
        return x
    units, n = variable_units(problem.hand), 6 + len(problem.hand.joint_names)
    wrist, joints = integrate(problem.hand, other.wrist, other.joints, (x[: len(units)] * units)[:n])
    v = np.concatenate([SE3().difference(start.wrist, wrist), joints - start.joints])
    return np.concatenate([v / units[:n], x[n:]])
