"""RMSProp and AdamW, the optimisers of the paper and of its release, on the same smoothed energy and bounds.

The paper names RMSProp without rates; the release runs 200 steps of AdamW with `RATES`, which both use here. Bounds of
the variables are kept by projection. Multipliers and rows are not used. So the answer is the lowest point on the way
that satisfies the rows, or the lowest of all if none does. A program with equality rows is refused.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.planning.solvers.solver import Answer, Entry, NlpInstance, Refusal, Solver
from sgnlp.program.variables import UNITS, variable_kinds

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
STEPS = (200, 1000)
"""Number of steps: the release's, and five times as many."""

Step = Callable[[int, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class Descent:
    """Lowest smoothed energy on the way (in the solver's unit), its point, and the energy at every step.

    `admissible` is the lowest energy of the points that satisfy the rows, at `x_admissible`; infinite if none does.
    """

    best: float
    admissible: float
    x: Array
    x_admissible: Array
    energies: Array  # (steps + 1,)


@dataclass(frozen=True)
class FirstOrder(Solver):
    """An optimiser of `OPTIMISERS` for a number of steps."""

    optimiser: str = "adamw"
    steps: int = STEPS[0]

    @property
    def name(self) -> str:
        """With its steps."""
        return f"{self.optimiser}-{self.steps}"

    def solve(self, nlp: NlpInstance, x: Array) -> Answer:
        """Take the steps, at most the program's iteration limit."""
        low, high = nlp.g_bounds
        if (low == high).any():
            raise Refusal(f"{self.name} cannot handle equality rows; the penalty formulation has none")
        if not np.isfinite(nlp.rates).all():
            raise Refusal(f"{self.name} has no rates for some of the variables")
        count = min(self.steps, nlp.iterations)
        found = descent(nlp, x, self.optimiser, count)
        inside = bool(np.isfinite(found.admissible))
        x, status = (found.x_admissible, "rows met") if inside else (found.x, "rows never met")
        return Answer(x, status, count, lowest=found.best)


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


def descent(nlp: NlpInstance, x: Array, optimiser: str, steps: int) -> Descent:
    """Take steps from x (nx), each projected onto the bounds of x."""
    (low, high), (g_low, g_high), step = nlp.x_bounds, nlp.g_bounds, OPTIMISERS[optimiser](nlp.rates)
    energies, best, admissible, best_x, admissible_x = np.empty(steps + 1), np.inf, np.inf, x, x
    for i in range(steps + 1):
        f, gradient = nlp.functions.gradient(x, nlp.p)
        energies[i] = float(f)
        if energies[i] < best:
            best, best_x = energies[i], x
        if energies[i] < admissible:
            g = nlp.rows(x)
            if (g >= g_low - ROW_SLACK).all() and (g <= g_high + ROW_SLACK).all():
                admissible, admissible_x = energies[i], x
        x = np.clip(step(i + 1, x, np.array(gradient).ravel()), low, high)
    return Descent(best, admissible, best_x, admissible_x, energies)


ENTRIES = tuple(
    Entry(
        FirstOrder(optimiser=optimiser, steps=steps), "first order", 1, f"{name}, {steps} steps at the release's rates"
    )
    for optimiser, name in (("rmsprop", "RMSProp"), ("adamw", "AdamW"))
    for steps in STEPS
)
