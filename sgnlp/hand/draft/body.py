"""The fitted body of a hand: its fingers with their pads, and the spheres of all its links."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array, IntArray
from sgnlp.hand.draft.chains import Chain
from sgnlp.hand.draft.closing import ends
from sgnlp.hand.draft.covers import Ball, Cover, cover
from sgnlp.hand.draft.pads import Pad, pad
from sgnlp.hand.draft.skeleton import Skeleton

PALM_BULGE, END_BULGE = 0.012, 0.004
"""Largest bulge of the spheres of the palm and of the fingers' ends [m]: at an end they would touch an object first."""


@dataclass(frozen=True, eq=False)
class Body:
    """A hand whose m fingers have pads and whose links have spheres; the pads are the first m of S spheres."""

    skeleton: Skeleton
    chains: tuple[Chain, ...]
    pads: tuple[Pad, ...]
    covers: dict[int, Cover]
    """Covers by joint of the model; 0 is the palm. At a finger's end the cover is in addition to the pad."""

    @property
    def balls(self) -> list[tuple[int, Ball]]:
        """The S spheres, each with the joint that moves it."""
        pads = [(chain.end, Ball(pad.centre, pad.radius)) for chain, pad in zip(self.chains, self.pads, strict=True)]
        return pads + [(joint, ball) for joint, cover in self.covers.items() for ball in cover.balls]

    @property
    def radii(self) -> Array:
        """Radii of the spheres (S,) [m]."""
        return np.array([ball.radius for _, ball in self.balls])

    @property
    def owners(self) -> IntArray:
        """The chain that moves each sphere (S,), the first if there are several; -1 for the palm."""
        lines = [set(chain.joints) for chain in self.chains]
        return np.array([next((i for i, line in enumerate(lines) if j in line), -1) for j, _ in self.balls])

    def is_end(self, joint: int) -> bool:
        """Whether a joint of the model carries a fingertip."""
        return any(chain.end == joint for chain in self.chains)

    def centres(self, joints: Array) -> Array:
        """Centres of the spheres (S, 3) [m] in the root's frame, by numeric Pinocchio."""
        data = self.skeleton.model.createData()
        pin.forwardKinematics(self.skeleton.model, data, joints)
        places = np.array([place.homogeneous for place in data.oMi])[self._joints]
        return np.asarray(np.einsum("sij,sj->si", places[:, :3, :3], self._points) + places[:, :3, 3])

    @functools.cached_property
    def _joints(self) -> IntArray:
        return np.array([joint for joint, _ in self.balls])

    @functools.cached_property
    def _points(self) -> Array:
        return np.array([ball.centre for _, ball in self.balls])


def body(skeleton: Skeleton, chains: Sequence[Chain], known: dict[bytes, Cover]) -> Body:
    """The pads of the fingers, and spheres for every link that has meshes; covers in `known` are used again.

    Raises:
        InputError: a mesh cannot be read, or cannot be covered.
    """
    found = ends(skeleton, chains)
    pads = tuple(pad(skeleton, chain, end) for chain, end in zip(chains, found, strict=True))
    at_end = {chain.end: one for chain, one in zip(chains, pads, strict=True)}
    covers: dict[int, Cover] = {}
    for joint in range(skeleton.model.njoints):
        if not len(skin := skeleton.skin(joint)):
            continue
        alike = skin.tobytes() + (at_end[joint].centre.tobytes() if joint in at_end else b"")
        if alike not in known:  # many hands have identical fingers
            known[alike] = _cover(skin, joint, at_end.get(joint))
        covers[joint] = known[alike]
    return Body(skeleton, tuple(chains), pads, covers)


def _cover(skin: Array, joint: int, at_end: Pad | None) -> Cover:
    if joint == 0:
        return cover(skin, PALM_BULGE, on_axes=False)  # the palm's own frame moves in all six directions
    return cover(skin, END_BULGE, at_end) if at_end else cover(skin)
