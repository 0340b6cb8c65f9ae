"""How far pads slide over a surface, rolling excluded."""

from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array


@dataclass(frozen=True, eq=False)
class Frame:
    """A body's pose in the world."""

    rotation: Array  # (3, 3)
    origin: Array  # (3,) [m]

    def local(self, point: Array) -> Array:
        """A world point in the frame."""
        return np.asarray((point - self.origin) @ self.rotation)

    def world(self, point: Array) -> Array:
        """A point of the frame in the world."""
        return np.asarray(self.rotation @ point + self.origin)


@dataclass(frozen=True, eq=False)
class Mark:
    """Points of pad and object that touched each other. Later their distance is the slip; it stays 0 without sliding.

    Rolling moves the contact over both bodies alike, but moves these two points apart only to second order in time, and
    along the normal.
    """

    on_pad: Array  # (3,) [m] in the pad's frame
    on_object: Array  # (3,) [m] in the object's frame
    normal: Array  # (3,)

    def slid(self, pad: Frame, thing: Frame) -> float:
        """Distance of the two points along the surface [m]."""
        parted = pad.world(self.on_pad) - thing.world(self.on_object)
        return float(np.linalg.norm(parted - self.normal * (self.normal @ parted)))


def mark(pad: Frame, thing: Frame, point: Array, normal: Array) -> Mark:
    """The mark of a contact at a world point with its normal."""
    return Mark(pad.local(point), thing.local(point), normal)
