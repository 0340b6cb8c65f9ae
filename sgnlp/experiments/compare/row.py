"""What one run of a solver says."""

from dataclasses import dataclass
from math import inf, nan

from sgnlp.planning.solvers.meter import CALLS

Instance = tuple[str, str, int]


@dataclass(frozen=True)
class Row:
    """One run, the energies weighted and smoothed as the solver saw them, the residuals recomputed.

    `repeat` 0 is the first solve of its process, cold. `reached` is whether every residual of the problem as posed is
    within `tolerance`, whatever the `status`, which is the solver's word. `estimated` tells that the multipliers are
    ours. `lowest` is the lowest energy on the way, rows met or not, of methods that have one. `build`, `setup` and
    `seconds` are of loading or building the functions, of making the solver, and of solving; `cpu` is `seconds` in
    processor time. `trace` has `seconds:energy:residual` on the way, in processor time. `failure` is why there is no
    answer.
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

    @property
    def instance(self) -> Instance:
        """What all solvers are given alike: an object, a formulation and a start."""
        return (self.object, self.formulation, self.start)

    @property
    def time(self) -> float:
        """Processor time to a point within the tolerance [s], infinite if there is none."""
        return self.cpu if self.reached else inf

    @property
    def residual(self) -> float:
        """The worst of the three."""
        return max(self.dual, self.primal, self.complementarity)

    @property
    def calls(self) -> int:
        """Calls of the functions, of whichever."""
        return sum(getattr(self, call) for call in CALLS.values())

    @property
    def course(self) -> list[tuple[float, float, float]]:
        """The trace: seconds, energies, residuals."""
        return [tuple(map(float, point.split(":"))) for point in self.trace.split()]  # type: ignore[misc]
