"""Readings of a running simulation, sample by sample."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.simulation.contacts import Touch, knocks, touches
from sgnlp.simulation.outcome import Knock, Trace
from sgnlp.simulation.slip import Frame, Mark, mark
from sgnlp.simulation.world import World

TRACE_EVERY = 4
"""The trace keeps every so many samples: 25 a second."""


@dataclass(frozen=True, eq=False)
class Reading:
    """The state at a sample; m fingers. MuJoCo's positions and forces belong to the beginning of its last step."""

    time: float  # [s]
    phase: str
    tips: Array  # (m, 3) [m] centres of the pads
    centre: Array  # (3,) [m] centre of mass of the object
    rotation: Array  # (3, 3) motion of the object from its given pose
    translation: Array  # (3,) [m]
    lowest: float  # [m] height of the object's lowest point
    forces: Array  # (m, 3) [N] of the pads on the object
    touching: BoolArray  # (m,) pads
    links: dict[str, float]  # normal force [N] on the object of each link that touches it without its pad
    torques: Array  # (n,) |torque| of the motors over the hand's effort
    slide: Array  # (m,) [m] of each pad over the surface since the reading before
    wrist: Array  # (7,) pose of the hand's root link, x y z [m] qx qy qz qw
    knocks: tuple[Knock, ...] = ()
    strain: float = 0.0  # largest torque of a joint of the arm over its effort
    off: float = 0.0  # [m] distance of the root link from its commanded place

    @property
    def finite(self) -> bool:
        """Whether the simulation has not diverged."""
        return bool(np.isfinite(self.centre).all() and np.isfinite(self.tips).all())


class Recorder:
    """Takes readings, and keeps a trace of them. Vibration faster than the readings does not count as sliding."""

    def __init__(self, world: World, hull: Array) -> None:
        self.world = world
        self.hull = hull  # (h, 3) [m] vertices of the object's hull, in its frame
        self._finger = {int(link): i for i, link in enumerate(world.pad_links)}
        self._marks: dict[int, Mark] = {}  # by finger, from the reading before
        self._rows: list[tuple[Any, ...]] = []
        self._count = 0

    def read(self, data: Any, phase: str) -> Reading:
        """Read the present state."""
        thing, pads = _frame(data, self.world.object_body), [_frame(data, link) for link in self.world.pad_links]
        slide = np.zeros(len(pads))
        for i, before in self._marks.items():
            slide[i] = before.slid(pads[i], thing)
        firmest, forces, links = self._touches(data)
        effort = self.world.effort
        self._marks = {i: mark(pads[i], thing, touch.point, touch.normal) for i, touch in firmest.items()}
        reading = Reading(
            time=float(data.time),
            phase=phase,
            tips=np.array(data.site_xpos[self.world.tips]),
            centre=np.array(data.xipos[self.world.object_body]),
            rotation=thing.rotation,
            translation=thing.origin,
            lowest=float((self.hull @ thing.rotation[2]).min() + thing.origin[2]),
            forces=forces,
            touching=np.isin(np.arange(len(pads)), list(firmest)),
            links=links,
            torques=np.abs(data.qfrc_actuator[self.world.hand_speeds[: len(effort)]]) / effort,
            slide=slide,
            wrist=self.world.wrist(data),
            knocks=knocks(self.world, data, phase),
            strain=self._strain(data),
        )
        self._keep(data, reading)
        return reading

    def forget(self) -> None:
        """Forget earlier contacts, because the state was reset."""
        self._marks = {}

    def trace(self) -> Trace:
        """The readings kept, as arrays."""
        time, phase, *rest = zip(*self._rows, strict=True)
        return Trace(np.array(time), np.array(phase), *(np.array(column) for column in rest))

    def _touches(self, data: Any) -> tuple[dict[int, Touch], Array, dict[str, float]]:
        """Each finger's firmest contact, the forces (m, 3) of all pads, the normal forces of other links."""
        firmest: dict[int, Touch] = {}
        forces = np.zeros((len(self.world.tips), 3))
        links: dict[str, float] = {}
        for touch in touches(self.world, data):
            i = self._finger.get(int(self.world.model.geom_bodyid[touch.geom]))
            if i is not None:
                forces[i] += touch.force
                if i not in firmest or touch.force @ touch.force > firmest[i].force @ firmest[i].force:
                    firmest[i] = touch
            elif touch.geom in self.world.hand_geoms:
                name = self.world.link(touch.geom)
                links[name] = links.get(name, 0.0) + abs(float(touch.force @ touch.normal))
        return firmest, forces, links

    def _strain(self, data: Any) -> float:
        arm = self.world.arm
        return 0.0 if arm is None else float((np.abs(data.qfrc_actuator[self.world.carrier_speeds]) / arm.effort).max())

    def _keep(self, data: Any, reading: Reading) -> None:
        """Every few readings, what a picture needs."""
        if self._count % TRACE_EVERY == 0:
            self._rows.append(
                (reading.time, reading.phase, data.qpos.copy(), reading.tips, reading.forces, reading.wrist)
            )
        self._count += 1


def _frame(data: Any, body: int) -> Frame:
    return Frame(np.array(data.xmat[body]).reshape(3, 3), np.array(data.xpos[body]))
