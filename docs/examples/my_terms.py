"""Contacts at one height, and a palm that points down: for `sgnlp solve ... --with my_terms.py`."""

import numpy as np

import sgnlp


class Level(sgnlp.Term):
    """E = Σ (z_i - z̄)²: contacts at one height."""

    def value(self, g, op):
        """In m²."""
        z = g.contacts[:, 2]
        return op.sum((z - op.sum(z) / z.shape[0]) ** 2)


upright = sgnlp.Constraint(
    "upright",
    lambda g, op: g.wrist_rotation[2, 0],
    upper=-np.cos(np.radians(30)),
    about="cosine between the palm's x axis and the vertical",
)

TERMS = [Level(weight=1e6)]
CONSTRAINTS = [upright]
