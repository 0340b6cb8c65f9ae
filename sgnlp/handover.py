"""What a formulation begins with where another one ended: the variables that all have, and those that it adds."""

import numpy as np
from numpy.typing import NDArray

from sgnlp.elastic import slacks
from sgnlp.lifted import lifted_values
from sgnlp.nlp import variable_units
from sgnlp.oracle import Oracle

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
