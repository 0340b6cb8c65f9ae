"""The built-in constraints: what each requires, its tolerance, and its bounds from the settings."""

from dataclasses import replace
from math import cos, inf, radians
from typing import Any

from sgnlp.base.settings import Settings
from sgnlp.program.around import ALONE, Around
from sgnlp.program.around_constraints import AROUND, around_bounds
from sgnlp.program.constraint import (
    EFFORT,
    FORCE,
    GAIN,
    LENGTH,
    NUMBER,
    STIFFNESS,
    TORQUE,
    TRACE,
    Constraint,
    Rows,
    Unit,
)
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.terms.spring import margins
from sgnlp.program.tolerances import (
    BALANCE,
    CLEARANCE,
    CONTACT,
    DICTATED,
    PRESS,
    REACHED,
    ROUNDING,
    STABLE,
    STIFF,
    TURNED,
)


def _displacements(g: Grasp, op: Ops) -> Any:
    return op.norm(g.contacts_eq - g.contacts_desired)


def _trace(g: Grasp, op: Ops) -> Any:
    """tr(R_desᵀ R), 1 + 2 cos of the angle between the two."""
    return op.sum(g.rotation_desired * g.rotation)


def _margins_initial(g: Grasp, op: Ops) -> Any:
    return margins(g.forces, g.normals, g.friction, op)


def _margins_equilibrium(g: Grasp, op: Ops) -> Any:
    return margins(g.forces_eq, g.normals_eq, g.friction, op)


def _efforts_initial(g: Grasp, op: Ops) -> Any:
    return g.torques / g.effort


def _efforts_equilibrium(g: Grasp, op: Ops) -> Any:
    return g.torques_eq / g.effort


def _pressures(g: Grasp, op: Ops) -> Any:
    return -op.dot(g.forces, g.normals)


def _dictated(g: Grasp, op: Ops) -> Any:
    return g.gains * g.contact_deviations


def _each(over: str, unit: Unit, tolerance: float) -> dict[str, Any]:
    """The fields that constraints of one kind share."""
    return {"over": over, "unit": unit, "tolerance": tolerance}


CLEAR = _each("finger", LENGTH, CLEARANCE)
IN_CONE = _each("finger", NUMBER, ROUNDING)
FORCES = _each("finger", FORCE, PRESS)
EFFORTS = _each("joint", EFFORT, ROUNDING)
EVERYWHERE = {"always": True, "domain": True}

CONSTRAINTS: tuple[Constraint, ...] = (
    Constraint(
        "stiffness",
        Rows("stiffness"),
        **_each("", STIFFNESS, STABLE) | EVERYWHERE,
        about="rotational stiffness ρ of the equilibrium",
    ),
    Constraint(
        "rotation",
        _trace,
        **_each("", TRACE, TURNED) | EVERYWHERE,
        about="rotation of the object at equilibrium, off the desired one",
    ),
    Constraint(
        "workspace",
        Rows("ball_clearances"),
        **_each("finger", LENGTH, ROUNDING) | EVERYWHERE,
        about="tips inside the ball in which the surface model is valid",
    ),
    Constraint(
        "contact",
        Rows("gaps"),
        **_each("finger", LENGTH, CONTACT),
        about="distance of the pads to the surface at first contact",
    ),
    Constraint(
        "reach",
        Rows("reach_errors"),
        **_each("tip", LENGTH, REACHED),
        about="tips off the contacts that the fingers are to reach",
    ),
    Constraint(
        "object_contact",
        Rows("object_clearances_contact"),
        **CLEAR | {"over": "link"},
        about="links clear of the object at first contact",
    ),
    Constraint(
        "table_contact",
        Rows("table_clearances_contact"),
        **CLEAR | {"over": "link"},
        about="links clear of the table at first contact",
    ),
    Constraint(
        "self_contact",
        Rows("pair_clearances_contact"),
        **CLEAR | {"over": "pair"},
        about="links clear of each other at first contact",
    ),
    Constraint("margin_initial", _margins_initial, **IN_CONE, about="margin inside the friction cone at first contact"),
    Constraint("margin_equilibrium", _margins_equilibrium, **IN_CONE, about="margin inside the cone at equilibrium"),
    Constraint("force", Rows("forces_eq", "norm"), **FORCES, about="force of a finger at equilibrium"),
    Constraint("shift", _displacements, **CLEAR, about="way of a contact to the equilibrium"),
    Constraint(
        "object",
        Rows("object_clearances"),
        **CLEAR | {"over": "link"},
        about="links clear of the object at the pregrasp",
    ),
    Constraint("pads_object", Rows("pad_clearances"), **CLEAR, about="pads clear of the object at the pregrasp"),
    Constraint(
        "table",
        Rows("table_clearances"),
        **CLEAR | {"over": "link"},
        about="links clear of the table at the pregrasp",
    ),
    Constraint("pads_table", Rows("pad_heights"), **CLEAR, about="pads clear of the table at the pregrasp"),
    Constraint(
        "self",
        Rows("pair_clearances"),
        **CLEAR | {"over": "pair"},
        about="links clear of each other at the pregrasp",
    ),
    *AROUND,
    Constraint("contact_table", Rows("contact_heights"), **CLEAR, about="pads above the table at first contact"),
    Constraint(
        "equilibrium_table",
        Rows("contact_heights_eq"),
        **CLEAR,
        about="pads above the table at equilibrium",
    ),
    Constraint(
        "sag",
        Rows("gains", "sum"),
        **_each("", GAIN, STIFF),
        about="sum of the gains, so that the object's weight moves it by no more than the largest shift",
    ),
    Constraint(
        "torque_initial",
        _efforts_initial,
        **EFFORTS,
        about="joint torque over the hand's effort at first contact",
    ),
    Constraint(
        "torque_equilibrium",
        _efforts_equilibrium,
        **EFFORTS,
        about="joint torque over the hand's effort at equilibrium",
    ),
    Constraint("cone", _margins_initial, **IN_CONE, always=True, about="margin inside the friction cone"),
    Constraint("press", _pressures, **FORCES, always=True, about="normal force at contact"),
    Constraint("force_initial", Rows("forces", "norm"), **FORCES, about="force of a finger at first contact"),
    Constraint("net_force", Rows("wrench", row=0), **_each("axis", FORCE, BALANCE), about="net force on the object"),
    Constraint(
        "net_torque",
        Rows("wrench", row=1),
        **_each("axis", TORQUE, BALANCE),
        about="net torque on the object about its centre of mass",
    ),
    Constraint(
        "gains",
        _dictated,
        **_each("finger", FORCE, DICTATED),
        always=True,
        about="gain times deviation of the surface, α",
    ),
)
"""All built-in constraints without their bounds, in the order of the rows of g."""


def preset_constraints(settings: Settings, around: Around = ALONE) -> tuple[Constraint, ...]:
    """The built-in constraints of these settings and surroundings, with their bounds."""
    bounds = _bounds(settings) | around_bounds(settings, around)
    return tuple(replace(c, lower=bounds[c.name][0], upper=bounds[c.name][1]) for c in CONSTRAINTS if c.name in bounds)


def _bounds(s: Settings) -> dict[str, tuple[float, float]]:
    """The bounds of each constraint of the settings, in SI units."""
    limits, effort, gap = s.limits, s.limits.effort, s.limits.object_margin + s.limits.place_error
    bounds = {
        "workspace": (0.0, inf),
        "contact": (0.0, 0.0),
        "object": (gap, inf),
        # without a pregrasp, c = 1, the pads touch, and the rows of contact say how
        "pads_object": (gap if s.contact.c < 1 else -inf, inf),
        "table": (limits.table_margin, inf),
        "pads_table": (limits.pad_margin, inf),
        "self": (0.0, inf),
        "contact_table": (0.0, inf),
    }
    if s.closing.planned:
        clear = (s.closing.margin, inf)
        bounds |= {"reach": (0.0, 0.0), "object_contact": clear, "table_contact": clear, "self_contact": (0.0, inf)}
    if effort > 0:
        bounds["torque_initial"] = (-effort, effort)
    if s.contact.heuristic > 0:
        bounds["gains"] = (s.contact.heuristic, s.contact.heuristic)
    return bounds | (_compliance(s) if s.contact.metric == "spring" else _closure(s))


def _compliance(s: Settings) -> dict[str, tuple[float, float]]:
    """The bounds of a stable equilibrium with enough contact force."""
    limits, effort, weight = s.limits, s.limits.effort, s.contact.mass * GRAVITY
    shift = max(limits.shift, limits.give * weight)
    return {
        "stiffness": (limits.stiffness, inf),
        "rotation": (1 + 2 * cos(radians(limits.rotation_deg)), inf),
        "margin_initial": (limits.margin_initial, inf),
        "margin_equilibrium": (limits.margin_equilibrium, inf),
        "force": (limits.force_min, limits.force_max),
        "shift": (-inf, shift),
        "equilibrium_table": (0.0, inf),
        # so that the weight moves the equilibrium by no more than the largest shift
        "sag": (weight / shift, inf),
    } | ({"torque_equilibrium": (-effort, effort)} if effort > 0 else {})


def _closure(s: Settings) -> dict[str, tuple[float, float]]:
    """The bounds of force closure at first contact; there is no equilibrium."""
    return {
        "cone": (s.limits.margin_initial, inf),
        "press": (s.limits.force_min, inf),
        "force_initial": (-inf, s.limits.force_max),
        "net_force": (0.0, 0.0),
        "net_torque": (0.0, 0.0),
    }
