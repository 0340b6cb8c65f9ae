"""First-order optimisers on the oracle of the penalty formulation: what the paper and its release run.

They see the same smoothed energy and the same bounds (by projection) as Ipopt. They know nothing of the rows that bound
the rotation, the stiffness and the workspace, so their lowest energy is told twice: anywhere, and where the rows hold.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sgnlp.hand.hand import Hand
from sgnlp.planning.problem import Problem
from sgnlp.planning.starts import Start, initial
from sgnlp.program.compiled import program
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.nlp import UNITS, variable_kinds
from sgnlp.program.oracle import Functions, join

Array = NDArray[np.float64]

RATES = {"linear": 1e-3, "angular": 1e-3, "joint": 2e-3, "target": 2e-3, "gain": 0.5}
"""Learning rates of the release [m, rad, rad, m, N/m]."""
DECAY = 0.01
"""Weight decay of AdamW (PyTorch's default, which the release leaves on)."""
ADAM_MEANS = (0.9, 0.999)
"""Decay rates of AdamW's moments (Loshchilov & Hutter 2019)."""
RMSPROP_MEAN = 0.99
"""Decay rate of RMSProp's second moment (PyTorch's default)."""
ROW_SLACK = 1e-6
"""Rounding allowed to a scaled row."""
EPSILON = 1e-8
"""Guard of the division by the root of the second moment."""

Bounds = tuple[Array, Array]
Step = Callable[[int, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class Descent:
    """Lowest smoothed energy on the way (in the solver's unit), where, and the energy at every step.

    `admissible` is the lowest among the points that meet the formulation's rows, at `x_admissible`; infinite if none
    does.
    """

    best: float
    admissible: float
    x: Array
    x_admissible: Array
    energies: Array  # (steps + 1,)


def adamw(rates: Array) -> Step:
    """x ← x - rate (m̂/(√v̂ + ε) + decay x), with bias-corrected moments."""
    m, v = np.zeros_like(rates), np.zeros_like(rates)

    def step(i: int, x: Array, gradient: Array) -> Array:
        m[:] = ADAM_MEANS[0] * m + (1 - ADAM_MEANS[0]) * gradient
        v[:] = ADAM_MEANS[1] * v + (1 - ADAM_MEANS[1]) * gradient**2
        m_hat, v_hat = m / (1 - ADAM_MEANS[0] ** i), v / (1 - ADAM_MEANS[1] ** i)
        return x - rates * (m_hat / (np.sqrt(v_hat) + EPSILON) + DECAY * x)

    return step


def rmsprop(rates: Array) -> Step:
    """x ← x - rate g/(√v + ε)."""
    v = np.zeros_like(rates)

    def step(i: int, x: Array, gradient: Array) -> Array:
        v[:] = RMSPROP_MEAN * v + (1 - RMSPROP_MEAN) * gradient**2
        return x - rates * gradient / (np.sqrt(v) + EPSILON)

    return step


OPTIMISERS: dict[str, Callable[[Array], Step]] = {"adamw": adamw, "rmsprop": rmsprop}


def learning_rates(hand: Hand) -> Array:
    """The release's rates in the units of the scaled variables (nx,)."""
    return np.array([RATES[kind] / UNITS[kind] for kind in variable_kinds(hand)])


def descend(problem: Problem, start: Start, optimiser: str, steps: int) -> Descent:
    """Run `steps` steps of an optimiser on the smoothed penalty energy from a start."""
    nlp = program(problem.hand, problem.structure(Penalty()), problem.settings.solver.compiled)
    oracle = join(nlp, problem.gpis, problem.settings.solver.compiled)
    p = problem.parameters(nlp, start.wrist, start.joints)
    x_bounds, g_bounds = problem.variable_bounds(nlp, start.joints), problem.row_bounds(nlp)
    step = OPTIMISERS[optimiser](learning_rates(problem.hand))
    return descent(oracle, step, steps, np.clip(initial(nlp, start), *x_bounds), p, x_bounds, g_bounds)


def descent(
    functions: Functions, step: Step, steps: int, x: Array, p: Array, x_bounds: Bounds, g_bounds: Bounds
) -> Descent:
    """Take steps from x (nx), each projected onto the bounds of x."""
    (low, high), (g_low, g_high) = x_bounds, g_bounds
    energies, best, admissible, best_x, admissible_x = np.empty(steps + 1), np.inf, np.inf, x, x
    for i in range(steps + 1):
        f, gradient = functions.gradient(x, p)
        energies[i] = float(f)
        if energies[i] < best:
            best, best_x = energies[i], x
        if energies[i] < admissible:
            g = np.array(functions.rows(x, p)).ravel()
            if (g >= g_low - ROW_SLACK).all() and (g <= g_high + ROW_SLACK).all():
                admissible, admissible_x = energies[i], x
        x = np.clip(step(i + 1, x, np.array(gradient).ravel()), low, high)
    return Descent(best, admissible, best_x, admissible_x, energies)
