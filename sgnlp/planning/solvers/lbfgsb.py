"""SciPy's L-BFGS-B (Byrd, Lu, Nocedal & Zhu 1995), which handles only bounds, in the method of multipliers for rows.

    min_x f + 1/(2ρ) Σ dist(λ + ρ g, ρ [g_low, g_high])²,   then λ ← λ + ρ g - ρ clip(g + λ/ρ, g_low, g_high)

(Nocedal & Wright 2006, ch. 17.4, with the slacks eliminated). Where no row is active this is L-BFGS-B itself.
"""

from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.solvers.scipy_call import ScipySolver, minimise
from sgnlp.planning.solvers.solver import Answer, Entry, NlpInstance

FIRST_WEIGHT, GROWTH, LARGEST_WEIGHT = 10.0, 10.0, 1e8
"""First ρ, its factor if the violation does not fall enough, and its largest value."""
ENOUGH = 0.25
"""Share of the violation that an outer step may leave without ρ growing (Algencan has a half, LANCELOT a tenth)."""
OUTER = 50
"""Largest number of outer steps."""
MEMORY = 20
"""Number of pairs in the limited memory; SciPy's default of 10 needs more steps."""
TIGHTEN = 0.1
"""Factor of the inner tolerance from one outer step to the next; the first is the root of the last."""


@dataclass(frozen=True)
class Lbfgsb(ScipySolver):
    """Outer steps over λ and ρ, each a run of L-BFGS-B."""

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """Solve by the method of multipliers."""
        low, high = nlp.g_bounds
        lam, rho, before, left = np.zeros(len(low)), FIRST_WEIGHT, np.inf, nlp.iterations
        tolerance = np.sqrt(nlp.tolerance)
        for _ in range(OUTER):
            options = {"maxiter": left, "maxfun": 10 * left, "gtol": tolerance, "ftol": 0.0, "maxcor": MEMORY}
            result = minimise(nlp, "L-BFGS-B", merit, x, True, args=(nlp, lam, rho), options=options)
            x, left = np.asarray(result.x), left - int(result.nit)
            g = nlp.rows(x)
            new = rho * (g + lam / rho - np.clip(g + lam / rho, low, high))
            violation = float(np.abs(new - lam).max(initial=0.0)) / rho
            lam = new
            if left <= 0 or (violation <= nlp.tolerance and tolerance <= nlp.tolerance):
                break
            rho = rho if violation <= max(ENOUGH * before, nlp.tolerance) else min(GROWTH * rho, LARGEST_WEIGHT)
            before, tolerance = violation, max(TIGHTEN * tolerance, nlp.tolerance)
        return Answer(x, str(result.message), nlp.iterations - left)


def merit(x: Array, nlp: NlpInstance, lam: Array, rho: float) -> tuple[float, Array]:
    """The augmented Lagrangian and its gradient (nx,)."""
    shifted = nlp.rows(x) + lam / rho
    force = rho * (shifted - np.clip(shifted, *nlp.g_bounds))
    gradient = nlp.gradient(x)
    if force.any():
        gradient = gradient + nlp.jacobian(x).T @ force
    return nlp.objective(x) + float(force @ force) / (2 * rho), gradient


ENTRIES = (Entry(Lbfgsb(), "augmented Lagrangian", 1, "SciPy's L-BFGS-B, rows by the method of multipliers"),)
