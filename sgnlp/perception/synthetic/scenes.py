"""Makes the arrays of a problem file from a mesh: a body on a table, seen by simulated depth cameras."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from sgnlp.base.arrays import Array, floats, integers
from sgnlp.base.checked import POSITIVE, Checked, NotNegative, Positive
from sgnlp.base.errors import InputError
from sgnlp.perception.cleaning import UNITS
from sgnlp.perception.observation import DEFAULTS
from sgnlp.perception.synthetic.cameras import DepthCamera, miscalibrated, view
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.repair import mended
from sgnlp.perception.synthetic.solids import united

VIEWS = 3
POINT_RESOLUTION = 1e-5
"""[m] Rounding of the stored points."""
MESH_RESOLUTION = 1e-6
"""[m] Rounding of the stored mesh: coarser than the last bits, in which machines differ."""
FAR = 1e4
"""Largest distance from the origin over the longest side: single precision keeps 1/800 of the side there."""


@dataclass(frozen=True)
class Ring(Checked):
    """Cameras, evenly spaced around the table, and the treatment of their clouds."""

    section: ClassVar[str] = "ring"
    distance_min: Positive = 0.5
    """[m] least distance from the middle of the body; each camera's distance is drawn at random from this"""
    distance_max: Positive = 0.6
    """[m] to here"""
    elevation_min_deg: Annotated[float, (1.0, 89.0)] = 40.0
    """least elevation above the horizon [deg], drawn likewise"""
    elevation_max_deg: Annotated[float, (1.0, 89.0)] = 50.0
    """its upper end"""
    azimuth_deg: float = -10.0
    """azimuth of the first camera from the x axis [deg]"""
    shift_min: NotNegative = 0.001
    """[m] least calibration error of each camera; between two cameras the errors add up"""
    shift_max: NotNegative = 0.002
    """[m] largest calibration error"""
    turn_deg: NotNegative = 0.2
    """and turned by this"""
    crop: NotNegative = 0.003
    """[m] measured points lower than this count as the table"""
    points: Annotated[int, (1, POSITIVE[1])] = 4000
    """most points of a view, drawn at random"""

    def __post_init__(self) -> None:
        """Also that no lower limit is above its upper one."""
        super().__post_init__()
        self._ordered("distance_min", "distance_max")
        self._ordered("elevation_min_deg", "elevation_max_deg")
        self._ordered("shift_min", "shift_max")

    def positions(self, count: int, target: Array, rng: np.random.Generator) -> Array:
        """Positions (count, 3) [m] around and above a target (3,)."""
        azimuth = np.deg2rad(self.azimuth_deg) + 2 * np.pi * np.arange(count) / count
        distance = rng.uniform(self.distance_min, self.distance_max, (count, 1))
        elevation = np.deg2rad(rng.uniform(self.elevation_min_deg, self.elevation_max_deg, count))
        flat = np.cos(elevation)
        return target + distance * np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=1)


RING, CAMERA = Ring(), DepthCamera()


def body(vertices: ArrayLike, faces: ArrayLike, scale: float = 1.0) -> tuple[Mesh, list[str]]:
    """The mesh of vertices (U, 3) times `scale` [m] and faces (F, 3) as a body, and notes on all that was assumed.

    Equal vertices are merged. An open mesh is closed as far as `repair` can; a closed one becomes one surface that
    faces outwards (`solids`). Raises `InputError` if it is not a triangle mesh with extent in all directions, or if it
    holds a sheet beside the body.
    """
    notes = [] if scale == 1.0 else [f"Multiplied all coordinates by {scale:g}."]
    mesh = _triangles(vertices, faces)
    mesh = Mesh(mesh.vertices * scale, mesh.faces).welded()
    if len(mesh.faces) == 0:
        raise InputError("has no triangle with three different corners")
    if mesh.flatness < DEFAULTS.min_flatness:
        raise InputError("is flat; a body has some extent in all directions")
    mesh, done = mended(mesh)
    notes += done
    if mesh.open_edges:
        _check_sheets(mesh)
        seen = "its faces are seen from both sides, and its volume is taken to be that of its convex hull"
        notes.append(f"The mesh is not watertight, {mesh.open_edges} of its edges do not join two faces: {seen}.")
        notes.append("A grasp of it can be planned, but not simulated.")
        return mesh, notes
    mesh, done = united(mesh)
    return mesh, notes + done


def _triangles(vertices: ArrayLike, faces: ArrayLike) -> Mesh:
    """The mesh, checked: its faces refer to existing, finite vertices that are not too far away for single
    precision."""
    corners = floats(vertices, "mesh_vertices", (None, 3))
    triangles = integers(faces, "mesh_faces", (None, 3))
    outside = (triangles < 0) | (triangles >= len(corners))
    if outside.any():
        where = f"'mesh_faces' must lie in 0..{len(corners) - 1}, the rows of 'mesh_vertices'"
        raise InputError(f"a face has the corner {triangles[outside][0]}: {where}; export the mesh again")
    if not len(triangles):
        raise InputError("has no triangle with three different corners")
    mesh = Mesh(corners, triangles).compact()
    wrong = int(np.sum(~np.isfinite(mesh.vertices).all(axis=1)))
    if wrong:
        raise InputError(f"{wrong} of its {len(mesh.vertices)} vertices are NaN or infinite; export the mesh again")
    far, side = np.abs(mesh.vertices).max(), np.ptp(mesh.vertices, axis=0).max()
    if len(mesh.vertices) > 1 and far > FAR * side:
        where = f"up to {far:.4g}, and is {side:.4g} wide"
        why = "single precision, which mesh files have, keeps no shape there"
        raise InputError(f"lies too far from the origin, {where}: {why}; subtract an offset where it was exported")
    return mesh


def _check_sheets(mesh: Mesh) -> None:
    """Refuse an open mesh with a flat part wider than all the rest: that is a floor or a table, not the body."""
    parts = mesh.parts()
    sheets = [part for part in parts if part.flatness < DEFAULTS.min_flatness]
    rest = [part.vertices for part in parts if not any(part is sheet for sheet in sheets)]
    if not sheets or not rest:
        return
    widest = max(float(np.ptp(sheet.vertices, axis=0).max()) for sheet in sheets)
    own = float(np.ptp(np.concatenate(rest), axis=0).max())
    if widest > own:
        found = f"a flat part {widest:.3g} m wide beside a body of {own:.3g} m"
        raise InputError(f"holds {found}, as of a floor or table; delete it where the mesh was made")


def scene(
    mesh: Mesh,
    name: str,
    rng: np.random.Generator,
    *,
    mass: float,
    friction: float,
    views: int = VIEWS,
    ring: Ring = RING,
    camera: DepthCamera = CAMERA,
) -> dict[str, Any]:
    """The arrays of the problem file of a body that stands on the table z = 0, as `sgnlp.load` reads them.

    Raises `InputError` if the body does not fit into the images, or a camera sees nothing of it.
    """
    mesh = Mesh(np.round(mesh.vertices / MESH_RESOLUTION) * MESH_RESOLUTION, mesh.faces)
    _check_size(mesh, ring, camera)
    target = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    positions = ring.positions(views, target, rng)
    seen = []
    for number, position in enumerate(positions):
        cloud = view(mesh, camera, position, target, rng)
        cloud = miscalibrated(cloud, (ring.shift_min, ring.shift_max), ring.turn_deg, target, rng)
        cloud = cloud[cloud[:, 2] > ring.crop]
        if len(cloud) == 0:
            raise InputError(f"camera {number} measures nothing of the body above the table")
        seen.append(cloud[np.sort(rng.permutation(len(cloud))[: ring.points])])
    _check_count(sum(map(len, seen)))
    points = np.round(np.concatenate(seen) / POINT_RESOLUTION) * POINT_RESOLUTION
    return {
        "points": points.astype(np.float32),
        "view": np.repeat(np.arange(views, dtype=np.min_scalar_type(-views)), [len(cloud) for cloud in seen]),
        "camera_positions": positions,
        "table_height": np.array(0.0),
        "name": np.array(name),
        "mass": np.array(mass),
        "friction": np.array(friction),
        "mesh_vertices": mesh.vertices.astype(np.float32),
        "mesh_faces": mesh.faces.astype(np.int32),
    }


def _check_count(count: int) -> None:
    """Refuse a cloud of too few points for a plan."""
    if count < DEFAULTS.min_points:
        few = f"the cameras measure {count} points of the body, and a plan needs {DEFAULTS.min_points}"
        raise InputError(f"{few}; give larger images (--camera.width, --camera.height) or more --views")


def _check_size(mesh: Mesh, ring: Ring, camera: DepthCamera) -> None:
    """Refuse a body that does not fit into the nearest camera's image, or is too small for a hand."""
    sides = np.ptp(mesh.vertices, axis=0)
    widest = 2 * ring.distance_min * float(np.sin(camera.half_angle))
    if np.linalg.norm(sides) > widest:
        found = f"{np.linalg.norm(sides):.4g} m from corner to corner, and the images hold {widest:.2g} m"
        fits = [f"{unit} (--scale {factor:g})" for unit, factor in UNITS.items() if _fits(sides * factor, widest)]
        hint = f"is it in {' or '.join(fits)}?" if fits else "--scale multiplies all coordinates"
        raise InputError(f"the body is {found}; {hint}")
    if sides.max() < DEFAULTS.min_width:
        hint = "is its unit the metre? (--scale multiplies all coordinates)"
        raise InputError(f"the body is {sides.max():.4g} m wide, less than {DEFAULTS.min_width:g} m; {hint}")


def _fits(sides: Array, widest: float) -> bool:
    return bool(sides.max() >= DEFAULTS.min_width and np.linalg.norm(sides) <= widest)
