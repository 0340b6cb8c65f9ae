"""A hand's tree of links and joints, and the skin of each link, before it has a file."""

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.geometry import surface_points
from sgnlp.hand.meshes import link_meshes, link_places
from sgnlp.perception.synthetic.meshes import Mesh

SPACING = 0.002
"""Spacing of the points of the skin [m]: less than what spheres may leave uncovered."""
MOST_POINTS = 20_000
"""Number of points on a mesh's faces; enough for 400 cm² of a palm."""
MOST_STEPS = 200
"""Number of points along an edge; enough for 40 cm."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The links and joints of a hand, with its root link at the origin."""

    urdf: Path
    description: str
    """The URDF as Pinocchio and MuJoCo read it."""
    model: pin.Model

    @property
    def root(self) -> str:
        """The name of the root link."""
        return str(self.model.frames[1].name)

    @property
    def ends(self) -> tuple[int, ...]:
        """The joints that carry no other joint."""
        return tuple(j for j in range(1, self.model.njoints) if not len(self.model.children[j]))

    def links(self, joint: int) -> tuple[str, ...]:
        """The links that move with a joint of the model; 0: those fixed to the root link."""
        return tuple(f.name for f in self.model.frames if f.parentJoint == joint and f.type == pin.FrameType.BODY)

    def above(self, joint: int) -> Iterator[int]:
        """The frames of the links above a joint of the model, the nearest first."""
        frame = self.model.getFrameId(self.model.names[joint], pin.FrameType.JOINT)
        while frame := self.model.frames[frame].parentFrame:
            if self.model.frames[frame].type == pin.FrameType.BODY:
                yield frame

    def line(self, joint: int) -> tuple[int, ...]:
        """The joints from the root to this one."""
        return tuple(self.model.supports[joint])[1:]

    def skin(self, joint: int) -> Array:
        """Points (K, 3) [m] on the meshes that move with a joint, in its frame; none if there are no meshes."""
        return self._skins[joint]

    @functools.cached_property
    def _skins(self) -> list[Array]:
        found: list[list[Array]] = [[] for _ in range(self.model.njoints)]
        for mesh, (joint, place) in zip(link_meshes(self)[0], link_places(self), strict=True):
            found[joint].append(skin_points(mesh) @ place[:3, :3].T + place[:3, 3])
        return [np.vstack(points) if points else np.zeros((0, 3)) for points in found]

    def range(self, joint: int) -> tuple[float, float]:
        """The lower and upper limit [rad or m] of a joint of the model; those of a mimic joint follow from its
        leader."""
        i, moved = self.model.idx_qs[joint], self.model.joints[joint]
        low, high = float(self.model.lowerPositionLimit[i]), float(self.model.upperPositionLimit[i])
        if moved.nq == 0:
            mimic = moved.extract()
            low, high = sorted((mimic.scaling * low + mimic.offset, mimic.scaling * high + mimic.offset))
        return low, high

    def axis(self, joint: int) -> Array:
        """The unit vector (3,) of a joint's axis in its own frame, of rotation or of translation."""
        model = self.model
        data = model.joints[joint].createData()
        model.joints[joint].calc(data, np.zeros(model.nq))
        motion = np.asarray(data.S).ravel()
        part = motion[3:] if self.turns(joint) else motion[:3]
        scale = model.joints[joint].extract().scaling if model.joints[joint].nq == 0 else 1.0
        return np.asarray(np.sign(scale) * part / np.linalg.norm(part))

    def turns(self, joint: int) -> bool:
        """Whether a joint is revolute."""
        model = self.model
        data = model.joints[joint].createData()
        model.joints[joint].calc(data, np.zeros(model.nq))
        return bool(np.asarray(data.S).ravel()[3:].any())


def skin_points(mesh: Mesh) -> Array:
    """Points (K, 3) [m] on a mesh: its vertices, points along long edges, and points drawn evenly from its faces."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
    drawn = surface_points(mesh, int(min(2 * area / SPACING**2, MOST_POINTS)))
    begin, edge = np.vstack([a, b, c]), np.vstack([b - a, c - b, a - c])
    steps = np.minimum(np.linalg.norm(edge, axis=1) // SPACING, MOST_STEPS)
    shares = [
        np.linspace(0, 1, int(count) + 1, endpoint=False)[1:, None, None] for count in range(int(steps.max()) + 1)
    ]
    along = [(begin[steps == i] + share * edge[steps == i]).reshape(-1, 3) for i, share in enumerate(shares)]
    return np.vstack([drawn, *along])
