"""The constraints: named rows of a grasp with bounds, written once for CasADi and NumPy like the energy terms."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from math import acos, cos, degrees, inf, radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.settings import Settings
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.terms.spring import margins

Array = NDArray[np.float64]


def _same(value: float) -> float:
    return value


@dataclass(frozen=True)
class Unit:
    """A row of 1 is `scale` in SI units; `reading` turns SI units into what `symbol` names."""

    symbol: str
    scale: float
    reading: Callable[[float], float] = _same


def _angle_deg(trace: float) -> float:
    """The angle [deg] of a rotation of that trace, 1 + 2 cos."""
    return degrees(acos(min(max((trace - 1) / 2, -1.0), 1.0)))


NUMBER = Unit("", 1.0)
LENGTH = Unit("m", 0.01)
FORCE = Unit("N", 1.0)
STIFFNESS = Unit("N m", 0.01)
"""Of ρ."""
TORQUE = Unit("N m", 0.1)
"""Of the net torque: forces of some newtons at some centimetres."""
EFFORT = Unit("of the effort", 1.0)
GAIN = Unit("N/m", 100.0)
TRACE = Unit("deg", 1.0, _angle_deg)


@dataclass(frozen=True)
class Constraint:
    """Rows lower ≤ value(g) ≤ upper, divided by the scale of their unit, one for each of `over` (`names.py`).

    `everywhere` ones also bound the penalty formulation. One that `needs` a trait is left out of programs without it
    (see `nlp.Structure.traits`). `domain` ones say where the functions are defined, and are never relaxed: outside the
    ball the surface's variance is negative, without stiffness the equilibrium is any rotation, and far from the desired
    rotation the least energy may be a half turn away.
    """

    name: str
    over: str
    unit: Unit
    value: Callable[[Grasp, Ops], Any]
    bounds: Callable[[Settings], tuple[float, float]]
    needs: str = ""
    everywhere: bool = False
    domain: bool = False

    @property
    def scale(self) -> float:
        """What a row of 1 is, in SI units."""
        return self.unit.scale


def _displacements(g: Grasp, op: Ops) -> Any:
    return op.norm(g.contacts_eq - g.contacts_desired)


def _trace(g: Grasp, op: Ops) -> Any:
    """tr(R_desᵀ R), 1 + 2 cos of the angle between the two."""
    return op.sum(g.rotation_desired * g.rotation)


def _margins_initial(g: Grasp, op: Ops) -> Any:
    return margins(g.forces, g.normals, g.friction, op)


def _margins_equilibrium(g: Grasp, op: Ops) -> Any:
    return margins(g.forces_eq, g.normals_eq, g.friction, op)


def _zero(s: Settings) -> tuple[float, float]:
    return 0.0, 0.0


def _clear(s: Settings) -> tuple[float, float]:
    return 0.0, inf


def _forces(s: Settings) -> tuple[float, float]:
    return s.limits.force_min, s.limits.force_max


def _pad_clearance(s: Settings) -> tuple[float, float]:
    """None without a pregrasp, c = 1: the pads touch, and the rows of contact say how."""
    return (s.limits.object_margin if s.contact.c < 1 else -inf), inf


def _effort(s: Settings) -> tuple[float, float]:
    return -s.limits.effort, s.limits.effort


def _stiffness(s: Settings) -> tuple[float, float]:
    return s.limits.stiffness, inf


def _trace_least(s: Settings) -> tuple[float, float]:
    return 1 + 2 * cos(radians(s.limits.rotation_deg)), inf


def _cone(s: Settings) -> tuple[float, float]:
    return s.limits.margin_initial, inf


def _sag(s: Settings) -> tuple[float, float]:
    """Least Σk [N/m] for which the object's weight moves the equilibrium by no more than `limits.shift`."""
    return s.contact.mass * GRAVITY / s.limits.shift, inf


CONSTRAINTS: tuple[Constraint, ...] = (
    Constraint("stiffness", "", STIFFNESS, lambda g, op: g.stiffness, _stiffness, "spring", True, True),
    Constraint("rotation", "", TRACE, _trace, _trace_least, "spring", True, True),
    Constraint("workspace", "finger", LENGTH, lambda g, op: g.ball_clearances, _clear, "", True, True),
    Constraint("contact", "finger", LENGTH, lambda g, op: g.gaps, _zero),
    Constraint("margin_initial", "finger", NUMBER, _margins_initial, _cone, "spring"),
    Constraint(
        "margin_equilibrium",
        "finger",
        NUMBER,
        _margins_equilibrium,
        lambda s: (s.limits.margin_equilibrium, inf),
        "spring",
    ),
    Constraint("force", "finger", FORCE, lambda g, op: op.norm(g.forces_eq), _forces, "spring"),
    Constraint("shift", "finger", LENGTH, _displacements, lambda s: (-inf, s.limits.shift), "spring"),
    Constraint("object", "link", LENGTH, lambda g, op: g.object_clearances, lambda s: (s.limits.object_margin, inf)),
    Constraint("pads_object", "finger", LENGTH, lambda g, op: g.pad_clearances, _pad_clearance),
    Constraint("table", "link", LENGTH, lambda g, op: g.table_clearances, lambda s: (s.limits.table_margin, inf)),
    Constraint("pads_table", "finger", LENGTH, lambda g, op: g.pad_heights, lambda s: (s.limits.pad_margin, inf)),
    Constraint("self", "pair", LENGTH, lambda g, op: g.pair_clearances, _clear),
    Constraint("contact_table", "finger", LENGTH, lambda g, op: g.contact_heights, _clear),
    Constraint("equilibrium_table", "finger", LENGTH, lambda g, op: g.contact_heights_eq, _clear, "spring"),
    Constraint("sag", "", GAIN, lambda g, op: op.sum(g.gains), _sag, "spring"),
    Constraint("torque_initial", "joint", EFFORT, lambda g, op: g.torques / g.effort, _effort, "torques"),
    Constraint("torque_equilibrium", "joint", EFFORT, lambda g, op: g.torques_eq / g.effort, _effort, "torques_eq"),
    Constraint("tip", "tip", LENGTH, lambda g, op: g.tip_errors, _zero, "lifted"),
    Constraint("balance_force", "axis", FORCE, lambda g, op: g.wrench_eq[0, :], _zero, "lifted"),
    Constraint("balance_torque", "axis", TORQUE, lambda g, op: g.wrench_eq[1, :], _zero, "lifted"),
    Constraint("cone", "finger", NUMBER, _margins_initial, _cone, "closure", True),
    Constraint(
        "press",
        "finger",
        FORCE,
        lambda g, op: -op.dot(g.forces, g.normals),
        lambda s: (s.limits.force_min, inf),
        "closure",
        True,
    ),
    Constraint(
        "force_initial",
        "finger",
        FORCE,
        lambda g, op: op.norm(g.forces),
        lambda s: (-inf, s.limits.force_max),
        "closure",
    ),
    Constraint("net_force", "axis", FORCE, lambda g, op: g.wrench[0, :], _zero, "closure"),
    Constraint("net_torque", "axis", TORQUE, lambda g, op: g.wrench[1, :], _zero, "closure"),
    Constraint(
        "gains",
        "finger",
        FORCE,
        lambda g, op: g.gains * g.contact_deviations,
        lambda s: (s.contact.heuristic, s.contact.heuristic),
        "heuristic",
        True,
    ),
)
"""All constraints, in the order of the rows of g."""


def active(traits: Collection[str]) -> tuple[Constraint, ...]:
    """The constraints of a program with these traits: a formulation, a metric, and others that constraints need."""
    there = [c for c in CONSTRAINTS if not c.needs or c.needs in traits]
    return tuple(c for c in there if "penalty" not in traits or c.everywhere)
