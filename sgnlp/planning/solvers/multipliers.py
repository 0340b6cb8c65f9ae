"""Multipliers for solvers that have none, and residuals that do not depend on whether they have."""

import numpy as np
from scipy.optimize import nnls

from sgnlp.planning.kkt import Kkt, residuals
from sgnlp.planning.solvers.anatomy import Array, Multipliers, Task

NEAR = 0.1
"""Slack of a scaled variable or row above which its multiplier is estimated as 0."""


def best_residuals(task: Task, x: Array, multipliers: Multipliers | None) -> tuple[Kkt, bool]:
    """The residuals at x (nx) with a solver's multipliers, or with estimated ones where they are smaller.

    Returns them and whether they are those of the estimate. Any multipliers that meet the conditions prove them, so a
    solver does not lose a solution by bad ones or for want of any.
    """
    given = (task.x_bounds, task.g_bounds)
    told = residuals(task.functions, x, task.p, multipliers, *given) if multipliers else None
    estimate = estimated(task, x)
    ours = residuals(task.functions, x, task.p, estimate, *given)
    return (told, False) if told is not None and told.worst <= ours.worst else (ours, True)


def estimated(task: Task, x: Array) -> Multipliers:
    """min |∇f + Jᵀλ_g + λ_x|² + |λ slack|² over multipliers of the right sign: non-negative least squares.

    They are 0 where x is not finite, or the least squares do not end.
    """
    gradient = np.array(task.functions.gradient(x, task.p)[1]).ravel()
    g, J = (np.array(block) for block in task.functions.jacobian(x, task.p))
    values, lam = np.concatenate([x, g.ravel()]), np.zeros(len(x) + g.size)
    low, high = (np.concatenate(pair) for pair in zip(task.x_bounds, task.g_bounds, strict=True))
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
