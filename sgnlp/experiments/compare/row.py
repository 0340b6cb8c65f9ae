"""The row of one run of a solver."""

from dataclasses import dataclass
from math import nan


@dataclass(frozen=True)
class Row:
    """One run. Energies are weighted and smoothed, as the solver saw them; residuals are recomputed.

    `repeat` 0 is the first solve of its process, cold. `reached` is whether every residual of the problem as posed is
    within `tolerance`; `status` is the solver's own. `estimated` says that the multipliers are estimated. `lowest` is
    the lowest energy on the way, whether or not rows are satisfied, for methods that report one. `build`, `setup` and
    `seconds` are the times of loading or building the functions, of making the solver, and of solving; `cpu` is
    `seconds` in processor time. `trace` has `seconds:energy:residual` on the way, in processor time. `failure` is the
    reason if there is no answer.
    """

    object: str
    formulation: str
    solver: str
    start: int
    tolerance: float
    repeat: int
    reached: bool = False
    energy: float = nan
    energy_start: float = nan
    lowest: float = nan
    dual: float = nan
    primal: float = nan
    complementarity: float = nan
    estimated: bool = False
    feasible: bool = False
    margin: float = nan
    iterations: int = 0
    f: int = 0
    grad: int = 0
    g: int = 0
    jac: int = 0
    hess: int = 0
    build: float = nan
    setup: float = nan
    seconds: float = nan
    cpu: float = nan
    status: str = ""
    trace: str = ""
    failure: str = ""


def course(trace: str) -> list[list[float]]:
    """Seconds, energies and residuals of a trace."""
    points = (point.split(":") for point in trace.split())
    return [list(map(float, column)) for column in zip(*points, strict=True)]
