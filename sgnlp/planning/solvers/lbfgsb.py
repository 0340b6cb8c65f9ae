"""SciPy's L-BFGS-B (Byrd, Lu, Nocedal & Zhu 1995) in the method of multipliers, for it knows bounds but no rows.

    min_x f + 1/(2ρ) Σ dist(λ + ρ g, ρ [g_low, g_high])²,   then λ ← λ + ρ g - ρ clip(g + λ/ρ, g_low, g_high)

(Nocedal & Wright 2006, ch. 17.4, with the slacks eliminated). Where no row is active this is L-BFGS-B itself.
"""

import numpy as np
from scipy.optimize import Bounds

from sgnlp.planning.solvers.anatomy import Answer, Method, Solve, Task
from sgnlp.planning.solvers.scipy_oracle import Array, Numpy, minimise

FIRST_WEIGHT, GROWTH, LARGEST_WEIGHT = 10.0, 10.0, 1e8
"""ρ at first, its factor where the violation does not fall by enough, and its end."""
ENOUGH = 0.25
"""Share of the violation that an outer step may leave without ρ growing (Algencan has a half, LANCELOT a tenth)."""
OUTER = 50
"""Outer steps at most."""
MEMORY = 20
"""Pairs of the limited memory; SciPy's 10 take more steps."""
TIGHTEN = 0.1
"""Factor of the inner tolerance from one outer step to the next, from the root of the last one on."""


def prepare(task: Task) -> Solve:
    """Outer steps over λ and ρ, each a run of L-BFGS-B."""
    problem, (low, high), box = Numpy(task), task.g_bounds, Bounds(*task.x_bounds)

    def merit(x: Array, lam: Array, rho: float) -> tuple[float, Array]:
        shifted = problem.rows(x) + lam / rho
        force = rho * (shifted - np.clip(shifted, low, high))
        gradient = problem.gradient(x)
        if force.any():
            gradient = gradient + problem.jacobian(x).T @ force
        return problem.objective(x) + float(force @ force) / (2 * rho), gradient

    def solve(x0: Array) -> Answer:
        x, lam, rho, before, left = x0, np.zeros(len(low)), FIRST_WEIGHT, np.inf, task.iterations
        tolerance = np.sqrt(task.tolerance)
        for _ in range(OUTER):
            options = {"maxiter": left, "maxfun": 10 * left, "gtol": tolerance, "ftol": 0.0, "maxcor": MEMORY}
            run = {"method": "L-BFGS-B", "jac": True, "bounds": box, "options": options}
            result = minimise(merit, x, (lam, rho), **run)
            x, left = np.asarray(result.x), left - int(result.nit)
            g = problem.rows(x)
            new = rho * (g + lam / rho - np.clip(g + lam / rho, low, high))
            violation = float(np.abs(new - lam).max(initial=0.0)) / rho
            lam = new
            if left <= 0 or (violation <= task.tolerance and tolerance <= task.tolerance):
                break
            rho = rho if violation <= max(ENOUGH * before, task.tolerance) else min(GROWTH * rho, LARGEST_WEIGHT)
            before, tolerance = violation, max(TIGHTEN * tolerance, task.tolerance)
        return Answer(x, str(result.message), task.iterations - left)

    return solve


METHODS = (
    Method(
        name="lbfgsb",
        kind="augmented Lagrangian",
        derivatives=1,
        summary="SciPy's L-BFGS-B, rows by the method of multipliers",
        prepare=prepare,
    ),
)
