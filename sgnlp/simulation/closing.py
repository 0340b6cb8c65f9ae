"""Evaluates the readings of the closing: which part touched when and how hard, and how far off the plan."""

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.control.command import Command
from sgnlp.planning.recompute import rotation_angle
from sgnlp.simulation.outcome import Closing
from sgnlp.simulation.protocol import Experiment, calm
from sgnlp.simulation.recorder import Reading

LOADED = 0.05
"""Least force of a pad that carries load [N]: a twentieth of the weight of the lightest object tried."""
AT_LIMIT = 0.999
"""Share of its effort at which a joint counts as being at its limit."""


def closed(experiment: Experiment, readings: list[Reading], command: Command) -> Closing:
    """The result of the closing; the last of its `readings` is the equilibrium."""
    begin, end = experiment.begin, readings[-1]
    all_ = [begin, *readings]
    times, last = _touches(all_)
    until = all_[last]
    shift_error, turn_error = _motion_errors(end, experiment.given, command)
    torques = np.array([reading.torques for reading in readings])
    limited = torques >= AT_LIMIT
    return Closing(
        seconds=end.time,
        rested=calm(readings),
        contact_times=times,
        contact_spread=float(times.max() - times.min()),
        links=_names(all_),
        premature=_names(all_[:last]),
        shift_before_contact=float(np.linalg.norm(until.centre - begin.centre)),
        turn_before_contact=rotation_angle(until.rotation @ begin.rotation.T),
        rotation=end.rotation,
        translation=end.translation,
        shift_error=shift_error,
        turn_error=turn_error,
        forces=end.forces,
        force_errors=_lengths(end.forces, command.forces_eq),
        tip_errors=_lengths(end.tips, command.contacts_eq),
        pads_loaded=int((np.linalg.norm(end.forces, axis=1) >= LOADED).sum()),
        links_equilibrium=_names([end]),
        links_force=sum(end.links.values()),
        slip=np.sum([reading.slide for reading in readings], axis=0),
        torque_share=float(torques[-1].max()),
        torque_share_closing=float(torques.max()),
        joints_limited=float(limited[-1].mean()),
        joints_limited_closing=float(limited.any(axis=0).mean()),
    )


def _touches(readings: list[Reading]) -> tuple[Array, int]:
    """The time (m,) of each pad's first touch, NaN if it never touches, and the index of the last pad's.

    If a pad never touches, that index is the last reading.
    """
    touching = np.array([reading.touching for reading in readings])
    times = np.array([reading.time for reading in readings])
    touched, first = touching.any(axis=0), np.argmax(touching, axis=0)
    return np.where(touched, times[first], np.nan), int(first.max()) if touched.all() else len(readings) - 1


def _names(readings: list[Reading]) -> tuple[str, ...]:
    """Links other than pads that touch the object in some of the readings."""
    return tuple(sorted({name for reading in readings for name in reading.links}))


def _motion_errors(end: Reading, given: Array, command: Command) -> tuple[float | None, float | None]:
    """How far the object's centre of mass [m] and rotation [rad] are off the plan; None without one."""
    if command.rotation_eq is None or command.translation_eq is None:
        return None, None
    planned = command.rotation_eq @ given + command.translation_eq
    return float(np.linalg.norm(end.centre - planned)), rotation_angle(end.rotation @ command.rotation_eq.T)


def _lengths(found: Array, planned: Array | None) -> Array | None:
    """The distances (m,) of vectors (m, 3) from the planned ones."""
    return None if planned is None else np.linalg.norm(found - planned, axis=1)
