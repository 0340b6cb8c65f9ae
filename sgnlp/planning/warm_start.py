"""The variables that a formulation adds to those that all have: where they begin, and between which bounds."""

import numpy as np
from numpy.typing import NDArray

from sgnlp.program.elastic import slack_bounds, slacks
from sgnlp.program.lifted import lifted_values
from sgnlp.program.nlp import Nlp, lifted_units, variable_units
from sgnlp.program.oracle import Oracle

Array = NDArray[np.float64]


def handed_over(oracle: Oracle, x: Array, p: Array, g_bounds: tuple[Array, Array]) -> Array:
    """x of any formulation as a point (nx,) of the oracle's, at its parameters p and bounds (ng,) of the rows.

    A lifted program gets the tips and the equilibrium that x has, an elastic one the slacks that its rows need.
    """
    nlp = oracle.nlp
    x = x[: len(variable_units(nlp.hand))]
    if nlp.structure.lifted:
        return np.concatenate([x, lifted_values(nlp, x, p)])
    if nlp.structure.formulation == "elastic":
        none = np.zeros(len(nlp.units) - len(x))
        return np.concatenate([x, slacks(oracle.values(np.concatenate([x, none]), p), *g_bounds)])
    return x


def added_bounds(nlp: Nlp, g_bounds: tuple[Array, Array]) -> tuple[Array, Array]:
    """Bounds of the scaled variables that the formulation adds, if any, for those of the rows (ng,).

    Slacks are not negative; what is lifted is bound by its equations alone.
    """
    if nlp.structure.lifted:
        free = np.full(len(lifted_units(nlp.hand)), np.inf)
        return -free, free
    if nlp.structure.formulation == "elastic":
        high = slack_bounds(nlp, *g_bounds)
        return np.zeros_like(high), high
    return np.zeros(0), np.zeros(0)
