"""Simulated tables with several bodies on them, seen by a depth camera, and which pixel is of which body."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sgnlp.perception.depth import DepthImage
from sgnlp.perception.synthetic.cameras import DepthCamera, image, looking_at
from sgnlp.perception.synthetic.meshes import Mesh, box, cylinder, unit_sphere

Array = NDArray[np.float64]

CAMERA = DepthCamera()
SMALL = DepthCamera(width=320, height=240, dropout_block=4)
"""As many degrees in a quarter of the pixels, for tests that run often."""
TINY = DepthCamera(width=224, height=168, dropout_block=3)
"""The same in half of these."""
TABLE, GAP = 0, 0.03
"""The label of pixels of no body, and the least gap [m] between two bodies."""


@dataclass(frozen=True, eq=False)
class Tabletop:
    """What a camera sees: depths without and with its errors, and the number of the body at each pixel, from 1."""

    depth: Array  # (H, W) [m], NaN where nothing came back
    labels: NDArray[np.int64]  # (H, W)
    pose: Array  # (4, 4) of the camera in the world, whose table is at z = height
    height: float
    camera: DepthCamera
    bodies: list[Mesh] = field(default_factory=list)

    def image(self, posed: bool = True) -> DepthImage:
        return DepthImage(self.depth, None, self.camera.intrinsics, self.pose if posed else None)

    @property
    def own(self) -> Array:
        """The points (H, W, 3) in the camera's frame."""
        return self.image(posed=False).points()


def random_body(rng: np.random.Generator) -> Mesh:
    """A box, a can or an egg, upright, turned about the vertical."""
    kind = rng.integers(3)
    if kind == 0:
        mesh = box([*rng.uniform(0.04, 0.1, 2), rng.uniform(0.04, 0.16)])
    elif kind == 1:
        mesh = cylinder(rng.uniform(0.025, 0.045), rng.uniform(0.06, 0.16), 40)
    else:
        egg = unit_sphere(300)
        mesh = Mesh(egg.vertices * rng.uniform(0.03, 0.045, 3), egg.faces)
    return mesh.turned(Rotation.from_euler("z", rng.uniform(0, 360), degrees=True).as_quat())


def radius(mesh: Mesh) -> float:
    """Of the upright cylinder around a body."""
    return float(np.linalg.norm(mesh.vertices[:, :2] - mesh.vertices[:, :2].mean(axis=0), axis=1).max())


def random_bodies(count: int, rng: np.random.Generator, reach: float = 0.18) -> list[Mesh]:
    """Bodies on the table z = 0 around the origin, at least `GAP` apart."""
    placed: list[tuple[Array, float]] = []
    bodies = []
    while len(bodies) < count:
        mesh = random_body(rng)
        place, size = rng.uniform(-reach, reach, 2), radius(mesh)
        if all(np.linalg.norm(place - p) > size + r + GAP for p, r in placed):
            placed.append((place, size))
            bodies.append(mesh.standing(place))
    return bodies


def slab(size: tuple[float, float, float], middle: tuple[float, float, float]) -> Mesh:
    """A box with its middle at a place: a wall, a table's top."""
    mesh = box(size)
    return Mesh(mesh.vertices + middle, mesh.faces)


def seen(
    bodies: list[Mesh],
    rng: np.random.Generator,
    furniture: list[Mesh] | None = None,
    eye: tuple[float, float, float] = (-0.55, -0.1, 0.5),
    target: tuple[float, float, float] = (0.0, 0.0, 0.0),
    height: float = 0.0,
    camera: DepthCamera = CAMERA,
) -> Tabletop:
    """Bodies over the plane z = 0, with walls and tables that are no bodies, from an eye [m] above the table."""
    raised = np.array([0.0, 0.0, height])
    place, middle = raised + eye, raised + target
    axes = looking_at(place, middle)
    directions = camera.rays() @ axes.T
    depth, cosine, labels = (np.full(directions.shape[:2], value) for value in (np.inf, 1.0, 0))
    for number, mesh in enumerate([*(furniture or []), *bodies], 1 - len(furniture or [])):
        shot = image(mesh, place, directions)
        closer = shot.depth < depth
        depth, cosine = np.where(closer, shot.depth, depth), np.where(closer, shot.cosine, cosine)
        labels = np.where(closer, np.where(shot.body, max(number, TABLE), TABLE), labels)
    measured = camera.measured(camera.flying(depth, rng), cosine, rng)
    pose = np.block([[axes, place[:, None]], [np.zeros(3), 1.0]])
    return Tabletop(measured, labels, pose, height, camera, bodies)


def shares(found: NDArray[np.bool_], true: NDArray[np.bool_]) -> tuple[float, float]:
    """Share of the found pixels that are of the body, and of the body's that are found."""
    both = (found & true).sum()
    return float(both / max(found.sum(), 1)), float(both / max(true.sum(), 1))
