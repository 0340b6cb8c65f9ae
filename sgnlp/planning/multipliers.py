"""Multipliers for solvers that give none, so that residuals can be compared between all solvers."""

from collections.abc import Sequence

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.kkt import Kkt, residuals
from sgnlp.planning.solvers.solver import Multipliers, NlpInstance

NEAR = 0.1
"""Slack of a scaled variable or row above which its estimated multiplier is 0."""


def recomputed(
    nlp: NlpInstance, x: Array, multipliers: Multipliers | None, names: Sequence[str] = ()
) -> tuple[Kkt, bool]:
    """The residuals at x (nx) with a solver's multipliers, or with estimated ones if it has none.

    Also returns whether the multipliers were estimated. `names` are those of the variables, then of the rows.
    """
    given = (nlp.x_bounds, nlp.g_bounds, names)
    if multipliers is not None:
        return residuals(nlp.functions, x, nlp.p, multipliers, *given), False
    return residuals(nlp.functions, x, nlp.p, estimated(nlp, x), *given), True


def smallest_residuals(nlp: NlpInstance, x: Array, multipliers: Multipliers | None) -> tuple[Kkt, bool]:
    """The same, or with estimated multipliers if these give smaller residuals, so that bad ones do no harm.

    Any multipliers that satisfy the optimality conditions prove them.
    """
    told, ours = recomputed(nlp, x, multipliers), recomputed(nlp, x, None)
    return told if told[0].worst <= ours[0].worst else ours


def estimated(nlp: NlpInstance, x: Array) -> Multipliers:
    """min |∇f + Jᵀλ_g + λ_x|² + |λ slack|² over multipliers of the right sign: non-negative least squares.

    They are 0 where x is not finite, or the least squares do not end.
    """
    from scipy.optimize import nnls  # imported here: it takes a tenth of a second, and Ipopt has multipliers

    gradient = np.array(nlp.functions.gradient(x, nlp.p)[1]).ravel()
    g, J = (np.array(block) for block in nlp.functions.jacobian(x, nlp.p))
    values, lam = np.concatenate([x, g.ravel()]), np.zeros(len(x) + g.size)
    low, high = (np.concatenate(pair) for pair in zip(nlp.x_bounds, nlp.g_bounds, strict=True))
    columns, index, signs, slacks = np.hstack([np.eye(len(x)), J.T]), [], [], []
    for sign, slack in ((1.0, high - values), (-1.0, values - low)):
        near = np.flatnonzero(slack <= NEAR)
        index.append(near)
        signs.append(np.full(len(near), sign))
        slacks.append(np.maximum(slack[near], 0.0))
    at, side = np.concatenate(index), np.concatenate(signs)
    A = np.vstack([columns[:, at] * side, np.diag(np.concatenate(slacks))])
    b = np.concatenate([-gradient, np.zeros(len(at))])
    if len(at) and np.isfinite(A).all() and np.isfinite(b).all():
        try:
            np.add.at(lam, at, side * nnls(A, b)[0])
        except RuntimeError:  # too many iterations
            lam[:] = 0.0
    return lam[: len(x)], lam[len(x) :]
