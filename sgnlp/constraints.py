"""The constraints: named rows of a grasp with bounds, written once for CasADi and NumPy like the energy terms."""

from collections.abc import Callable, Collection
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
TORQUE = 0.1
"""Scale of the rows of the net torque [N m]: forces of some newtons at some centimetres."""


@dataclass(frozen=True)
class Constraint:
    """Rows lower ≤ value(g)/scale ≤ upper; `everywhere` ones also bound the penalty formulation.

    One that `needs` a trait is left out of programs without it (see `nlp.Structure.traits`).
    """

    name: str
    value: Callable[[Grasp, Ops], Any]
    bounds: Callable[[Settings], tuple[float, float]]
    scale: float = 1.0
    everywhere: bool = False
    needs: str = ""


def _displacements(g: Grasp, op: Ops) -> Any:
    return op.norm(g.contacts_eq - g.contacts_desired)


def _trace(g: Grasp, op: Ops) -> Any:
    """tr(R_desᵀ R), 1 + 2 cos of the angle between the two."""
    return op.sum(g.rotation_desired * g.rotation)


def _margins_initial(g: Grasp, op: Ops) -> Any:
    return margins(g.forces, g.normals, g.friction, op)


def _forces(s: Settings) -> tuple[float, float]:
    return s.limits.force_min, s.limits.force_max


def _pad_clearance(s: Settings) -> tuple[float, float]:
    """None without a pregrasp, c = 1: the pads touch, and the rows of contact say how."""
    return (s.limits.object_margin if s.contact.c < 1 else -inf), inf


def _sag(s: Settings) -> float:
    """Least Σk [N/m] for which the object's weight moves the equilibrium by no more than `limits.shift`."""
    return s.contact.mass * GRAVITY / s.limits.shift


CONSTRAINTS: tuple[Constraint, ...] = (
    Constraint("stiffness", lambda g, op: g.stiffness, lambda s: (s.limits.stiffness, inf), STIFFNESS, True, "spring"),
    Constraint("rotation", _trace, lambda s: (1 + 2 * cos(radians(s.limits.rotation_deg)), inf), 1.0, True, "spring"),
    Constraint("workspace", lambda g, op: g.ball_clearances, lambda s: (0.0, inf), LENGTH, True),
    Constraint("contact", lambda g, op: g.gaps, lambda s: (0.0, 0.0), LENGTH),
    Constraint("margin_initial", _margins_initial, lambda s: (s.limits.margin_initial, inf), needs="spring"),
    Constraint(
        "margin_equilibrium",
        lambda g, op: margins(g.forces_eq, g.normals_eq, g.friction, op),
        lambda s: (s.limits.margin_equilibrium, inf),
        needs="spring",
    ),
    Constraint("force", lambda g, op: op.norm(g.forces_eq), _forces, needs="spring"),
    Constraint("shift", _displacements, lambda s: (-inf, s.limits.shift), LENGTH, needs="spring"),
    Constraint("object", lambda g, op: g.object_clearances, lambda s: (s.limits.object_margin, inf), LENGTH),
    Constraint("pads_object", lambda g, op: g.pad_clearances, _pad_clearance, LENGTH),
    Constraint("table", lambda g, op: g.table_clearances, lambda s: (s.limits.table_margin, inf), LENGTH),
    Constraint("pads_table", lambda g, op: g.pad_heights, lambda s: (s.limits.pad_margin, inf), LENGTH),
    Constraint("self", lambda g, op: g.pair_clearances, lambda s: (0.0, inf), LENGTH),
    Constraint("contact_table", lambda g, op: g.contact_heights, lambda s: (0.0, inf), LENGTH),
    Constraint("equilibrium_table", lambda g, op: g.contact_heights_eq, lambda s: (0.0, inf), LENGTH, needs="spring"),
    Constraint("sag", lambda g, op: op.sum(g.gains), lambda s: (_sag(s), inf), 100.0, needs="spring"),
    Constraint("cone", _margins_initial, lambda s: (s.limits.margin_initial, inf), 1.0, True, "closure"),
    Constraint(
        "press", lambda g, op: -op.dot(g.forces, g.normals), lambda s: (s.limits.force_min, inf), 1.0, True, "closure"
    ),
    Constraint("force_initial", lambda g, op: op.norm(g.forces), lambda s: (-inf, s.limits.force_max), needs="closure"),
    Constraint("net_force", lambda g, op: g.wrench[0, :], lambda s: (0.0, 0.0), needs="closure"),
    Constraint("net_torque", lambda g, op: g.wrench[1, :], lambda s: (0.0, 0.0), TORQUE, needs="closure"),
    Constraint(
        "gains",
        lambda g, op: g.gains * g.contact_deviations,
        lambda s: (s.contact.heuristic, s.contact.heuristic),
        everywhere=True,
        needs="heuristic",
    ),
)
"""All constraints, in the order of the rows of g."""


def active(traits: Collection[str]) -> tuple[Constraint, ...]:
    """The constraints of a program with these traits: a formulation, a metric, and others that constraints need."""
    there = [c for c in CONSTRAINTS if not c.needs or c.needs in traits]
    return tuple(c for c in there if "constrained" in traits or c.everywhere)
