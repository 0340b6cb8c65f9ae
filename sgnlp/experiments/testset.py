"""Nonlinear programs of problems for users of CasADi alone: functions, bounds, a start, the best known point."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from pinocchio.liegroups import SE3

from sgnlp.base.arrays import Array
from sgnlp.experiments import load_nlp
from sgnlp.hand.kinematics import integrate
from sgnlp.planning import results
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import Problem
from sgnlp.planning.solvers.solver import NlpInstance
from sgnlp.planning.starts import Start
from sgnlp.program.compiled import program
from sgnlp.program.standalone import functions
from sgnlp.program.variables import variable_units

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

        Raises `InputError` if the folder cannot be written.
        """
        results.write_arrays(folder / "nlp.npz", self.arrays)
        for name, function in self.functions.items():
            results.write_text(folder / f"{name}.casadi", function.serialize())
        results.write_text(folder / "about.json", results.json_text(asdict(self.entry)))
        results.write_text(folder / "load.py", Path(load_nlp.__file__).read_text(encoding="utf-8"))


def export(name: str, planner: Planner, starts: list[Start], index: int, seed: int) -> Exported:
    """The last program of a planner for `starts[index]`, with the best end of all starts.

    The variables are relative to that start's pose; ends of other starts count if they are within its bounds.
    """
    start, problem, last = starts[index], planner.problem, planner.stages[-1]
    nlp = program(problem.hand, last.nlp.structure, compiled=False)  # compiled functions cannot be written
    instance, x0 = planner.begin(last, start)
    answers = [planner.run(s) for s in starts]
    for first in answers[index][:-1]:  # the end of the program before it
        x0 = last.admitted(first.x, instance)
    points = [_seen_from(problem, start, s, found[-1].x) for s, found in zip(starts, answers, strict=True)]
    known = [(_residual(instance, x), x, s, found) for x, s, found in zip(points, starts, answers, strict=True)]
    residual, x, best, found = min(known, key=lambda k: _rank(k[0], instance.objective(k[1])))
    written = functions(nlp, problem.gpis, instance.p)
    entry = Entry(
        name=name,
        formulation=nlp.structure.formulation.name,
        start=start.index,
        variables=len(x),
        rows=sum(nlp.row_sizes),
        jacobian_nonzeros=written["jacobian"].nnz_out("jac_g_x"),
        hessian_nonzeros=written["hessian"].nnz_out(0),
        surface_points=len(problem.gpis.X),
        initial=instance.objective(x0),
        best=instance.objective(x),
        residual=residual,
        solver=f"{planner.solver.name} {found[-1].status}",
        best_start=best.index,
        seed=seed,
        iterations=sum(answer.iterations for answer in found),
    )
    names = {"variable_names": np.array(nlp.variable_names), "row_names": np.array(nlp.row_names)}
    bounds = dict(zip(("lbx", "ubx", "lbg", "ubg"), (*instance.x_bounds, *instance.g_bounds), strict=True))
    return Exported(entry, written, {"x0": x0, "x_best": x, **bounds, "units": nlp.units, **names})


def _seen_from(problem: Problem, start: Start, other: Start, x: Array) -> Array:
    """The variables of a point found from another start, relative to the pose of this one."""
    if other is start:
        return x
    units, n = variable_units(problem.hand), 6 + len(problem.hand.joint_names)
    wrist, joints = integrate(problem.hand, other.wrist, other.joints, (x[: len(units)] * units)[:n])
    v = np.concatenate([SE3().difference(start.wrist, wrist), joints - start.joints])
    return np.concatenate([v / units[:n], x[n:]])


def _residual(instance: NlpInstance, x: Array) -> float:
    g = instance.rows(x)
    return float(
        max(np.abs(x - np.clip(x, *instance.x_bounds)).max(), np.abs(g - np.clip(g, *instance.g_bounds)).max())
    )


def _rank(residual: float, objective: float) -> tuple[bool, float]:
    """Feasible points by their objective, then the others by how far they are from it."""
    feasible = residual <= FEASIBLE
    return not feasible, objective if feasible else residual
