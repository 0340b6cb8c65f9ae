"""Readings made by hand, and an experiment that plays them: what a judge sees of a simulation, without one."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from sgnlp.simulation import SimulationSettings
from sgnlp.simulation.recorder import Reading
from sgnlp.simulation.settings import SAMPLE

TABLE = 0.3
"""Height of the table [m]."""
GIVEN = np.array([0.2, -0.1, TABLE + 0.04])
"""The centre of mass before the object settled [m]."""
BEGIN = np.add(GIVEN, [0.0, 0.0, -0.002])
"""... and at rest."""
SETTINGS = SimulationSettings()
REST = Reading(
    time=0.0,
    phase="close",
    tips=np.array([[0.3, 0.0, 0.4], [0.1, 0.0, 0.4]]),
    centre=BEGIN,
    rotation=np.eye(3),
    translation=BEGIN - GIVEN,
    lowest=TABLE,
    forces=np.zeros((2, 3)),
    touching=np.array([False, False]),
    links={},
    torques=np.zeros(3),
    slide=np.zeros(2),
    wrist=np.array([0.0, 0.0, 0.6, 0.0, 0.0, 0.0, 1.0]),
)
"""Two fingers of three joints open, the object at rest on the table."""
TOUCHED = replace(REST, touching=np.array([True, True]))
AIR = 0.05
"""The height of the lift [m]."""


def turn(*vector: float) -> np.ndarray:
    """The rotation (3, 3) of a rotation vector [rad]."""
    return Rotation.from_rotvec(vector).as_matrix()


def moved(reading: Reading, *shift: float) -> Reading:
    """The object shifted [m], its lowest point along."""
    return replace(reading, centre=reading.centre + shift, lowest=reading.lowest + shift[2])


LIFTED = moved(TOUCHED, 0.0, 0.0, AIR)


def timed(readings: Sequence[Reading], first: int = 1) -> list[Reading]:
    """The readings one sample after another."""
    return [replace(reading, time=(first + i) * SAMPLE) for i, reading in enumerate(readings)]


class Played:
    """An experiment whose phases are readings made by hand; by default the object is lifted and withstands pushes.

    Without an `approach` it has no motion, and begins at the pregrasp.
    """

    def __init__(self, close=(TOUCHED,) * 3, lift=(LIFTED,) * 3, hold=(LIFTED,) * 5, **changes):
        self.settings = changes.get("settings", SETTINGS)
        self.body = SimpleNamespace(table_height=TABLE)
        self.given, self.begin = GIVEN, changes.get("begin", REST)
        self.recorder = SimpleNamespace(trace=lambda: "the trace")
        self.taken: list[str] = []
        """The phases that were begun."""
        self._depth = {"object": 0.0, "table": 0.0, "self": 0.0, "obstacles": 0.0} | changes.get("depth", {})
        self._overlaps = changes.get("overlaps", ())
        self._phases = {"approach": changes.get("approach", ()), "close": close, "lift": lift, "hold": hold}
        self._pushes = changes.get("pushes", {})

    def penetrations(self):
        return self._depth

    def overlaps(self):
        return self._overlaps

    def approach(self):
        return self._play("approach") if self._phases["approach"] else iter(())

    def close(self):
        return self._play("close")

    def lift(self):
        return self._play("lift")

    def hold(self):
        return self._play("hold")

    def push(self, direction):
        self.taken.append(direction)
        yield from timed(self._pushes.get(direction, [LIFTED] * 3))

    def _play(self, phase):
        self.taken.append(phase)
        yield from timed(self._phases[phase])
