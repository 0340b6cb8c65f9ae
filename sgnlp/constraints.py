"""The constraints: named rows of a grasp with bounds, written once for CasADi and NumPy like the energy terms."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, inf, radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.energies.spring import margins
from sgnlp.equilibrium import GRAVITY
from sgnlp.grasp import Grasp
from sgnlp.ops import Ops
from sgnlp.settings import Settings

Array = NDArray[np.float64]

LENGTH = 0.01
"""Scale of rows that are lengths [m]: a row of 1 is 1 cm."""
STIFFNESS = 0.01
"""Scale of the row of ρ [N m]."""


@dataclass(frozen=True)
class Constraint:
    """Rows lower ≤ value(g)/scale ≤ upper; `everywhere` ones also bound the penalty formulation."""

    name: str
    value: Callable[[Grasp, Ops], Any]
    bounds: Callable[[Settings], tuple[float, float]]
    scale: float = 1.0
    everywhere: bool = False


def _displacements(g: Grasp, op: Ops) -> Any:
    return op.norm(g.contacts_eq - g.contacts)


def _trace(g: Grasp, op: Ops) -> Any:
    return g.rotation[0, 0] + g.rotation[1, 1] + g.rotation[2, 2]


def _sag(s: Settings) -> float:
    """Least Σk [N/m] for which the object's weight moves the equilibrium by no more than `limits.shift`."""
    return s.contact.mass * GRAVITY / s.limits.shift


CONSTRAINTS: tuple[Constraint, ...] = (
    Constraint("stiffness", lambda g, op: g.stiffness, lambda s: (s.limits.stiffness, inf), STIFFNESS, True),
    Constraint("rotation", _trace, lambda s: (1 + 2 * cos(radians(s.limits.rotation_deg)), inf), everywhere=True),
    Constraint("workspace", lambda g, op: g.ball_clearances, lambda s: (0.0, inf), LENGTH, True),
    Constraint("contact", lambda g, op: g.gaps, lambda s: (0.0, 0.0), LENGTH),
    Constraint(
        "margin_initial",
        lambda g, op: margins(g.forces, g.normals, g.friction, op),
        lambda s: (s.limits.margin_initial, inf),
    ),
    Constraint(
        "margin_equilibrium",
        lambda g, op: margins(g.forces_eq, g.normals_eq, g.friction, op),
        lambda s: (s.limits.margin_equilibrium, inf),
    ),
    Constraint("force", lambda g, op: op.norm(g.forces_eq), lambda s: (s.limits.force_min, s.limits.force_max)),
    Constraint("shift", _displacements, lambda s: (-inf, s.limits.shift), LENGTH),
    Constraint("object", lambda g, op: g.object_clearances, lambda s: (s.limits.object_margin, inf), LENGTH),
    Constraint("table", lambda g, op: g.table_clearances, lambda s: (s.limits.table_margin, inf), LENGTH),
    Constraint("pads_table", lambda g, op: g.pad_heights, lambda s: (s.limits.pad_margin, inf), LENGTH),
    Constraint("self", lambda g, op: g.pair_clearances, lambda s: (0.0, inf), LENGTH),
    Constraint("contact_table", lambda g, op: g.contact_heights, lambda s: (0.0, inf), LENGTH),
    Constraint("equilibrium_table", lambda g, op: g.contact_heights_eq, lambda s: (0.0, inf), LENGTH),
    Constraint("sag", lambda g, op: op.sum(g.gains), lambda s: (_sag(s), inf), 100.0),
)
"""All constraints, in the order of the rows of g."""


def active(formulation: str) -> tuple[Constraint, ...]:
    """The constraints of the formulation `penalty` or `constrained`."""
    return tuple(c for c in CONSTRAINTS if formulation == "constrained" or c.everywhere)
