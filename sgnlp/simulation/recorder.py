"""What is read from a running simulation, sample by sample."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.simulation.contacts import Touch, touches
from sgnlp.simulation.outcome import Trace
from sgnlp.simulation.world import World

Array = NDArray[np.float64]
Frame = tuple[Array, Array]  # rotation (3, 3), origin (3,) [m]

TRACE_EVERY = 4
"""Samples between those that the trace keeps: 25 a second."""


@dataclass(frozen=True, eq=False)
class Reading:
    """The state at a sample; m fingers. MuJoCo's positions and forces belong to the begin of its last step."""

    time: float  # [s]
    phase: str
    tips: Array  # (m, 3) [m] centres of the pads
    centre: Array  # (3,) [m] centre of mass of the object
    rotation: Array  # (3, 3) motion of the object from where its mesh was given
    translation: Array  # (3,) [m]
    lowest: float  # [m] height of the object's lowest point
    forces: Array  # (m, 3) [N] of the pads on the object
    touching: NDArray[np.bool_]  # (m,) pads
    links: dict[str, float]  # normal force [N] on the object of each link that touches it without its pad
    slide: Array  # (m,) [m] of each pad over the surface since the reading before

    @property
    def finite(self) -> bool:
        """Whether the simulation has not diverged."""
        return bool(np.isfinite(self.centre).all() and np.isfinite(self.tips).all())


class Recorder:
    """Readings, and a trace of them.

    A pad slides by how far the points of pad and object that touched at the last reading have parted since, along
    the surface. In rolling they do not part, and what trembles faster than a sample is not summed up.
    """

    def __init__(self, world: World, hull: Array) -> None:
        self.world = world
        self.hull = hull  # (h, 3) [m] vertices of the object's hull, in its frame
        self._finger = {int(link): i for i, link in enumerate(world.pad_links)}
        self._marks: dict[int, tuple[Array, Array, Array]] = {}  # finger: point in pad, in object, normal
        self._rows: list[tuple[Any, ...]] = []
        self._count = 0

    def read(self, data: Any, phase: str) -> Reading:
        """Read the state as it is now."""
        thing = self.world.object_body
        rotation, translation = _frame(data, thing)
        slide = self._slides(data)
        firmest, forces, links = self._touches(data)
        self._mark(data, firmest)
        tips = np.array(data.site_xpos[self.world.tips])
        if self._count % TRACE_EVERY == 0:
            w, x, y, z = data.xquat[thing]
            pose = np.array([*translation, x, y, z, w])
            self._rows.append((data.time, phase, data.qpos.copy(), tips, forces, pose))
        self._count += 1
        return Reading(
            time=float(data.time),
            phase=phase,
            tips=tips,
            centre=np.array(data.xipos[thing]),
            rotation=rotation,
            translation=translation,
            lowest=float((self.hull @ rotation[2]).min() + translation[2]),
            forces=forces,
            touching=np.isin(np.arange(len(tips)), list(firmest)),
            links=links,
            slide=slide,
        )

    def forget(self) -> None:
        """What touched before has nothing to do with what will: the state was set back."""
        self._marks = {}

    def trace(self) -> Trace:
        """The readings kept, as arrays."""
        time, phase, *rest = zip(*self._rows, strict=True)
        return Trace(np.array(time), np.array(phase), *(np.array(column) for column in rest))

    def _touches(self, data: Any) -> tuple[dict[int, Touch], Array, dict[str, float]]:
        """Each finger's firmest contact, the forces (m, 3) of all pads, the normal forces of other links."""
        firmest: dict[int, Touch] = {}
        forces = np.zeros((len(self.world.pads), 3))
        links: dict[str, float] = {}
        for touch in touches(self.world, data):
            i = self._finger.get(int(self.world.model.geom_bodyid[touch.geom]))
            if i is not None:
                forces[i] += touch.force
                if i not in firmest or touch.force @ touch.force > firmest[i].force @ firmest[i].force:
                    firmest[i] = touch
            elif touch.geom != self.world.table:
                name = self.world.link(touch.geom)
                links[name] = links.get(name, 0.0) + abs(float(touch.force @ touch.normal))
        return firmest, forces, links

    def _mark(self, data: Any, firmest: dict[int, Touch]) -> None:
        """Keep the points that touch now, fixed to pad and object."""
        thing = _frame(data, self.world.object_body)
        self._marks = {}
        for i, touch in firmest.items():
            pad = _frame(data, self.world.pad_links[i])
            self._marks[i] = (_local(pad, touch.point), _local(thing, touch.point), touch.normal)

    def _slides(self, data: Any) -> Array:
        """How far the points marked at the last reading have parted, along the surface (m,) [m]."""
        thing, slides = _frame(data, self.world.object_body), np.zeros(len(self.world.pads))
        for i, (on_pad, on_object, normal) in self._marks.items():
            parted = _global(_frame(data, self.world.pad_links[i]), on_pad) - _global(thing, on_object)
            slides[i] = np.linalg.norm(parted - normal * (normal @ parted))
        return slides


def _frame(data: Any, body: int) -> Frame:
    return np.array(data.xmat[body]).reshape(3, 3), np.array(data.xpos[body])


def _local(frame: Frame, point: Array) -> Array:
    return np.asarray(frame[0].T @ (point - frame[1]))


def _global(frame: Frame, point: Array) -> Array:
    return np.asarray(frame[0] @ point + frame[1])
