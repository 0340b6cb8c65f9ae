"""Checks that the table around an object in a depth image is level and below the camera, and flat.

Intrinsics map the points of a camera's frame linearly, and a pose moves them rigidly. So wrong ones leave the table a
plane, but tilt it. Depths that were measured along the rays, and are taken for z, bend it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError

MAX_TILT_DEG = 3.0
"""A larger tilt is noted: it is 5 mm over the 0.1 m around the object, the noise that the plan assumes."""
REFUSED_TILT_DEG = 10.0
"""A larger tilt is refused: it is 17 mm over 0.1 m, more than the radius of a pad, 12 mm."""
PLANES = 3
"""Number of planes to find: the table, and two others such as a wall and a box."""
PLANE_SHARE = 0.2
"""Smallest share of the pixels around an object that counts as a plane."""
CERTAIN_SHARE = 0.5
"""Share of the pixels above which a plane is certainly the table, so that its tilt may be refused."""
PLANE_PIXELS = 100
"""Fewest pixels of a plane."""
MAX_BEHIND = 2.0
"""Pixels farther than the object by this factor are left out: they show the room, or a sensor's largest value."""
SAMPLE, TRIPLES, SEED = 3000, 200, 0
"""Pixels and triples of RANSAC: one in 125 triples hits a plane with a fifth of the pixels, one in 8 with a half."""
PLANE_ERROR = 0.01
"""Largest distance from a plane, as a share of that from the camera: 6 mm at 0.6 m, six deviations of a D415."""
FLATTER = 1.15
"""Depths are along the rays if, once converted, the largest plane has this many times the pixels. A level table from
true depths loses pixels then; where both planes have nearly all pixels, the error is below `PLANE_ERROR`."""
AXES: dict[str, Callable[[Array], Array]] = {
    "OpenGL axes, y up and z back (give pose @ diag(1, -1, -1, 1))": lambda R: R @ np.diag([1.0, -1, -1]),
    "an inverse, world to camera (give inv(pose))": lambda R: R.T,
    "an inverse with OpenGL axes (give inv(pose) @ diag(1, -1, -1, 1))": lambda R: R.T @ np.diag([1.0, -1, -1]),
    "the body's axes, x ahead and z up (give that of the optical frame)": lambda R: (
        R @ np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    ),
    "a world whose y is up (turn it by 90 deg about x)": lambda R: np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) @ R,
}
"""Mistaken conventions of a pose, each with the rotation that was meant."""


def around(marked: BoolArray) -> BoolArray:
    """The pixels in the mask's box, widened on each side by its longer side; independent of unit, K and pose."""
    v, u = np.nonzero(marked)
    reach = max(int(np.ptp(v)), int(np.ptp(u))) + 1
    box = np.zeros(marked.shape, bool)
    box[max(v.min() - reach, 0) : v.max() + reach + 1, max(u.min() - reach, 0) : u.max() + reach + 1] = True
    return box & ~marked


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane that many pixels around an object lie on."""

    normal: Array  # (3,) towards the camera
    share: float  # of the pixels

    @property
    def tilt(self) -> float:
        """[deg] Between the normal and the vertical; 180 if its underside is seen."""
        return float(np.rad2deg(np.arccos(np.clip(self.normal[2], -1, 1))))


def planes(points: Array, camera: Array) -> list[Plane]:
    """Up to `PLANES` planes of points (n, 3) seen from a camera (3,), largest first, by RANSAC on the remaining
    points."""
    rng = np.random.default_rng(SEED)
    rest = points[:: -(-len(points) // SAMPLE)] - camera
    found: list[Plane] = []
    count = len(rest)
    for _ in range(PLANES):
        if len(rest) < PLANE_SHARE * count:
            break
        normal, near = _largest(rest, rng)
        if near.sum() < PLANE_SHARE * count:
            break
        found.append(Plane(normal, near.sum() / count))
        rest = rest[~near]
    return found


def _largest(points: Array, rng: np.random.Generator) -> tuple[Array, BoolArray]:
    """Normal (3,) towards the origin and inliers (n,) of the plane with most points."""
    allowed = PLANE_ERROR * np.linalg.norm(points, axis=1)
    a, b, c = np.moveaxis(points[rng.integers(len(points), size=(TRIPLES, 3))], 1, 0)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(lengths > 0, lengths, 1.0)  # a zero normal has distance 0 everywhere: left out below
    near = (np.abs(points @ normals.T - np.sum(a * normals, axis=1)) < allowed[:, None]) & (lengths[:, 0] > 0)
    best = near[:, near.sum(axis=0).argmax()]
    for _ in range(2):  # least squares, twice
        centre = points[best].mean(axis=0)
        normal = np.linalg.svd(points[best] - centre, full_matrices=False)[2][2]
        best = np.abs((points - centre) @ normal) < allowed
    return -normal * np.sign(normal @ centre), best


def check(points: Array, pose: Array, which: str = "the pixels around the object") -> list[str]:
    """Notes on the world points (n, 3) around an object, measured by a camera with this pose (4, 4)."""
    found = planes(points, pose[:3, 3]) if len(points) >= PLANE_PIXELS else []
    if not found:
        return ["No plane was measured around the object, so neither pose nor intrinsics could be checked."]
    found, bent = along_rays(points, pose, found)
    if any(plane.tilt <= MAX_TILT_DEG for plane in found):
        return bent
    plane = found[0]
    meant = [
        name
        for name, turned in AXES.items()
        if _tilt(turned(pose[:3, :3]) @ pose[:3, :3].T @ plane.normal) <= MAX_TILT_DEG
    ]
    cause = f"the pose has {', or '.join(meant)}" if meant else "look at K, the pose and which stream they are of"
    fault = f"is tilted by {plane.tilt:.1f} deg, more than {MAX_TILT_DEG:g}, but the table is level"
    if plane.tilt > 180 - REFUSED_TILT_DEG:
        fault = "is above the camera, which sees its underside"
    text = f"{plane.share:.0%} of {which} lie on a plane that {fault}: {cause}"
    if plane.tilt > REFUSED_TILT_DEG and plane.share >= CERTAIN_SHARE:
        raise InputError(text)
    return [*bent, f"{text}."]


def along_rays(points: Array, pose: Array, found: list[Plane]) -> tuple[list[Plane], list[str]]:
    """The planes of points (n, 3), with a note if they are those of other depths, on which far more points lie.

    `found` are the planes of the points as they are. A depth along the ray is that to the camera's centre. Taken for z,
    it moves a point away by 1/cos of its angle off the optical axis.
    """
    camera, ahead = pose[:3, 3], pose[:3, 2]
    ray = points - camera
    cosine = np.abs(ray @ ahead) / np.linalg.norm(ray, axis=1)
    other = planes(camera + cosine[:, None] * ray, camera)
    share, more = (max((plane.share for plane in some), default=0.0) for some in (found, other))
    if more < max(FLATTER * share, PLANE_SHARE):
        return found, []
    note = (
        f"The table is bent: {share:.0%} of the pixels lie on a plane, and {more:.0%} if the depths were measured "
        "along the rays. Then divide each by the length of inv(K) @ (u, v, 1) to get z."
    )
    return other, [note]


def _tilt(normal: Array) -> float:
    return Plane(normal, 1.0).tilt
