"""Residuals of the first-order optimality conditions, recomputed from the oracle instead of trusting the solver."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.program.oracle import Functions

SCALE_LIMIT = 100.0
"""If the mean magnitude of the multipliers is larger, residuals are scaled down (s_max of Wächter & Biegler 2006,
eq. 6)."""
SOLVED_FACTOR = 10.0
"""Factor on the tolerance: Ipopt's tolerance is on its internally scaled problem, ours on the problem as posed."""


@dataclass(frozen=True)
class Kkt:
    """Residuals of min f, g_low ≤ g ≤ g_high, x_low ≤ x ≤ x_high, in the scaled variables and rows.

    dual |∇f + Jᵀλ_g + λ_x|_∞ and complementarity max |λ slack| are over the scale of the multipliers; primal is the
    largest violation of a bound. `where` names the variable or row of the worst of the three.
    """

    dual: float
    primal: float
    complementarity: float
    where: str = ""

    @property
    def worst(self) -> float:
        """The largest of the three."""
        return max(self.dual, self.primal, self.complementarity)


def residuals(
    oracle: Functions,
    x: Array,
    p: Array,
    multipliers: tuple[Array, Array],
    x_bounds: tuple[Array, Array],
    g_bounds: tuple[Array, Array],
    names: Sequence[str] = (),
) -> Kkt:
    """The residuals at x (nx) with multipliers (λ_x (nx), λ_g (ng)); positive ones push down from upper bounds.

    `names` are those of the variables, then of the rows.
    """
    lam_x, lam_g = multipliers
    gradient = np.array(oracle.gradient(x, p)[1]).ravel()
    g, J = oracle.jacobian(x, p)
    stationarity = gradient + np.array(J.T @ lam_g).ravel() + lam_x
    values = np.concatenate([x, np.array(g).ravel()])
    low, high = (np.concatenate(pair) for pair in zip(x_bounds, g_bounds, strict=True))
    lam = np.concatenate([lam_x, lam_g])
    slack = np.where(lam > 0, high - values, values - low)
    complementarity = np.abs(lam * np.where(np.isfinite(slack), slack, 1.0))
    scale = max(SCALE_LIMIT, float(np.abs(lam).mean())) / SCALE_LIMIT
    dual, primal = np.abs(stationarity) / scale, np.maximum(np.maximum(low - values, values - high), 0.0)
    complementarity /= scale
    worst = max((dual, primal, complementarity), key=np.max)
    return Kkt(
        dual=float(dual.max()),
        primal=float(primal.max()),
        complementarity=float(complementarity.max()),
        where=names[int(worst.argmax())] if names else "",
    )
