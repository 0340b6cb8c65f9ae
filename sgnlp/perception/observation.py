"""An observed object: the cleaned partial point cloud, the table under it, and what was dropped or assumed.

The order of cleaning: choose views, scale to metres, drop points that are not finite or mark "no return", drop copies,
find the table and drop points below it, thin very large clouds, drop outliers, refuse a cloud without volume or of no
graspable size. `sgnlp.perception.cleaning` has the steps and their settings.
"""

import hashlib
from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass, replace
from numbers import Integral
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sgnlp.base.arrays import Array, IntArray, floats
from sgnlp.base.brief import brief
from sgnlp.base.checked import Checked, Positive, Typed, plain, typed
from sgnlp.base.errors import InputError, unknown
from sgnlp.perception import clouds, point_arrays, point_files
from sgnlp.perception.cleaning import Cleaning, ObservationSettings, check_shape, moved
from sgnlp.perception.plausible import check_cameras, check_obstacles
from sgnlp.perception.views import Cameras, in_order

Up = Literal["x", "y", "z", "minus-x", "minus-y", "minus-z"]
UPS = get_args(Up)
UNTURNED: Up = "z"

Scalar = TypeVar("Scalar", bound=np.generic)
Numbered = tuple[Array, IntArray] | None  # points (N, 3) and a number (N,) with each
DEFAULTS = ObservationSettings()


@dataclass(frozen=True, eq=False)
class Observation(Typed):
    """A cleaned cloud in the world frame: z up, metres. Arrays are read-only. `load` and `observe` make one."""

    called = "an observation"
    __repr__ = brief

    points: Array  # (N, 3) [m]
    view: IntArray  # (N,) index into view_names
    view_names: tuple[str, ...]  # (V,)
    table_height: float  # [m] z of the table's plane
    name: str
    digest: str  # SHA-256 of all arguments of `observe` except name and truth
    camera_positions: Array | None = None  # (V, 3) [m]
    background: Array | None = None  # (M, 3) [m] what the cameras measured around and behind the object
    background_view: IntArray | None = None  # (M,) index into view_names
    mesh_vertices: Array | None = None  # (U, 3) [m] the true surface, if it is known
    mesh_faces: IntArray | None = None  # (F, 3)
    mass: float | None = None  # [kg] of the true body
    friction: float | None = None  # true friction coefficient between fingertip and body
    obstacle_points: Array | None = None  # (M, 3) [m] points of obstacles near the object
    obstacle: IntArray | None = None  # (M,) obstacle of each point: the cluster of a scene, 0 for none
    notes: tuple[str, ...] = ()  # a sentence for each thing dropped or assumed
    source: str | None = None  # the file it was read from
    half: str = ""  # half of the problem set: tuning, held_out, or none
    reading: "Reading | None" = None  # how `load` read it

    def __post_init__(self) -> None:
        """Also that points and table are numbers, in shape and finite."""
        super().__post_init__()
        if self.points.ndim != 2 or self.points.shape[1] != 3 or not len(self.points):
            raise InputError(f"the points of an observation must be (N, 3) [m], not {self.points.shape}")
        if self.view.shape != (len(self.points),):
            raise InputError(f"the view of an observation must be ({len(self.points)},), not {self.view.shape}")
        if not (self.points.dtype.kind in "fiu" and np.isfinite(self.points).all() and np.isfinite(self.table_height)):
            raise InputError("the points and the table_height of an observation must be finite numbers [m]")
        for name in ("camera_positions", "background", "mesh_vertices", "obstacle_points"):
            if (value := getattr(self, name)) is not None:
                floats(value, name, (None, 3))
        clouds.check_positive(mass=self.mass, friction=self.friction)


@dataclass(frozen=True)
class Reading(Checked):
    """How a cloud is read from a file."""

    views: tuple[str, ...] = ()
    """cameras to use, by name or index; all if not given"""
    scale: Positive = 1.0
    """factor to metres: 0.001 for a cloud in millimetres"""
    table_height: float | None = None
    """height of the table [m]; if not given, that in the file, else estimated"""
    key: str | None = None
    """name of the array of points in an npz, if it is not `points`"""
    up: Up = "z"
    """axis of the cloud that points up; it is turned to z"""
    pose: tuple[float, ...] | None = None
    """pose of the cloud's frame in the world, such as its camera's: 16 numbers of a matrix in metres, row by row"""
    cleaning: ObservationSettings = DEFAULTS
    """how the cloud is cleaned"""

    def __post_init__(self) -> None:
        """Accept views given by number, too, and a pose given row by row."""
        views = plain(self.views)  # of an array, too
        several = isinstance(views, Iterable) and not isinstance(views, str | bytes)
        views = in_order(views) if several else [] if views is None else [views]
        object.__setattr__(self, "views", tuple(str(each) if isinstance(each, Integral) else each for each in views))
        if isinstance(self.pose, list | tuple | np.ndarray):
            object.__setattr__(self, "pose", tuple(np.ravel(np.asarray(self.pose, object)).tolist()))
        super().__post_init__()


PLAIN = Reading()
"""A cloud in metres, z up, all its views."""


@typed
def load(path: str | Path, reading: Reading = PLAIN, **options: Any) -> Observation:
    """The observation in a file: npz, npy, .ply, .pcd or text. Its world frame has z up, in metres.

    The file's own table height, camera positions and mesh are in its unit: they are scaled and turned with the points.
    The option `table_height` [m] takes precedence.

    Args:
        path: the file.
        reading: how it is read.
        options: fields of `Reading` that differ from `reading`, as in `load("cloud.npz", views=["0"], scale=0.001)`.

    Raises:
        InputError: the file has no cloud of one graspable object; the message is one line that begins with the path.
    """
    assumed: list[str] = []
    try:
        reading = replace(reading, **options)
        raw = clouds.read(path, reading.key)
        assumed += raw.get("notes", ()) if Path(path).suffix.lower() in point_files.SUFFIXES else ()
        half, notes, own = raw.pop("half", ""), [*raw.pop("notes", ())], raw.pop("table_height", None)
        height = reading.table_height
        if height is None and own is not None and reading.pose is None:
            height = own * reading.scale
        elif height is None and own is not None:
            notes.append("Ignored the table's height in the file: it is not in the world's frame.")
        observation = observe(
            **raw,
            views=list(reading.views) or None,
            table_height=height,
            scale=reading.scale,
            pose=world_pose(reading.up, reading.pose),
            notes=notes,
            settings=reading.cleaning,
        )
        return replace(observation, source=str(path), half=half, reading=reading)
    except InputError as error:
        untold = [note for note in assumed if note not in str(error)]
        raise _within(path, InputError(f"{error} ({' '.join(untold)})") if untold else error) from error


def name_in(path: str | Path, reading: Reading = PLAIN) -> str:
    """The name of the observation in a file, found without cleaning the cloud. Raises as `load` does."""
    try:
        name = clouds.read(path, reading.key)["name"]
        clouds.check_name(name)
        return clouds.safe_name(name)
    except InputError as error:
        raise _within(path, error) from error


def _within(path: str | Path, error: InputError) -> InputError:
    """The same error in one line that begins with the path."""
    return InputError("".join(letter if letter.isprintable() else "?" for letter in f"{path}: {error}"))


@typed
def observe(
    points: ArrayLike,
    *,
    view: ArrayLike | None = None,
    view_names: Sequence[str] | None = None,
    views: Sequence[str | int] | Set[str | int] | None = None,
    table_height: float | None = None,
    scale: float = 1.0,
    name: str = "object",
    camera_positions: ArrayLike | None = None,
    background: ArrayLike | None = None,
    background_view: ArrayLike | None = None,
    mesh_vertices: ArrayLike | None = None,
    mesh_faces: ArrayLike | None = None,
    mass: float | None = None,
    friction: float | None = None,
    obstacle_points: ArrayLike | None = None,
    obstacle: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    notes: Sequence[str] = (),
    settings: ObservationSettings = DEFAULTS,
) -> Observation:
    """Clean a cloud of points (N, 3), or (H, W, 3), into an `Observation`.

    `view` (N,) is the camera of each point. `view_names` names the cameras (default: their numbers). `views` keeps some
    of them, by name, or by index if no name matches. `scale` converts `points`, `camera_positions` (V, 3), `background`
    (B, 3), `obstacle_points` (M, 3) and the mesh (U, 3), (F, 3) to metres. `table_height` is in metres already, and in
    the world frame; if it is missing, it is estimated from the lowest points. `background` holds the points that the
    cameras `background_view` (B,) measured around and behind the object. Without it, a camera is assumed to have seen
    through wherever it measured nothing of the object. `pose` (4, 4) is the pose of the points' frame in the world [m],
    if that is another frame. `mass` [kg], `friction` and the mesh are the truth for a simulation. `obstacle` (M,) is
    the obstacle of each of the obstacle points.

    Raises:
        InputError: the points cannot be the cloud of one graspable object on a table.
    """
    clouds.check_name(name)
    clouds.check_positive(mass=mass, friction=friction, scale=scale)
    cloud, said = point_arrays.rows(points, "points")
    cameras = Cameras.of(len(cloud), view, view_names, camera_positions)
    chosen = None if views is None else in_order(views)
    options = (cameras.names, table_height, scale, chosen, settings)
    place = None if pose is None else clouds.checked_pose(pose)
    kept = cameras.pick(chosen)
    clean = Cleaning(cloud, settings, [*notes, *said, *cameras.notes])
    clean.keep(np.isin(cameras.view, kept), "belong to views that were not chosen")
    clean.measured(scale, place)
    clean.drop_marks(table_height)
    clean.drop_copies(cloud)
    table = clean.find_table(table_height)
    clean.thin()
    clean.drop_outliers()
    check_shape(clean.points, settings, table_height)
    positions = None if cameras.positions is None else moved(cameras.positions[kept] * scale, place)
    clean.notes += check_cameras(positions, clean.points, table, clean.notes)
    around = cameras.background(background, background_view)
    mesh = None if mesh_vertices is mesh_faces is None else clouds.mesh(mesh_vertices, mesh_faces)
    in_the_way = clouds.obstacles(obstacle_points, obstacle)
    obstacles = _placed(clouds.OBSTACLES, in_the_way, scale, place)
    check_obstacles(obstacles.get("obstacle_points"), clean.points)
    given = (cloud, cameras.view, cameras.positions, *(around or ()), *(in_the_way or ()))
    return Observation(
        points=_frozen(clean.points),
        view=_frozen(np.searchsorted(kept, cameras.view[clean.index])),
        view_names=tuple(cameras.names[i] for i in kept),
        table_height=table,
        name=clouds.safe_name(name),
        digest=_digest(given, options if pose is None else (*options, pose)),
        camera_positions=None if positions is None else _frozen(positions),
        mass=mass,
        friction=friction,
        notes=tuple(clean.notes),
        **_placed(("background", "background_view"), _chosen(around, kept), scale, place),
        **_placed(("mesh_vertices", "mesh_faces"), mesh, scale, place),
        **obstacles,
    )


def _chosen(around: Numbered, kept: IntArray) -> Numbered:
    """The points around the object that the chosen cameras measured, and which of these did."""
    if around is None:
        return None
    chosen = np.isin(around[1], kept)
    return around[0][chosen], np.searchsorted(kept, around[1][chosen])


def _placed(names: tuple[str, str], given: Numbered, scale: float, place: Array | None) -> dict[str, Any]:
    """Two fields of an `Observation` by name: points (N, 3), in metres and in the world, and the numbers with them."""
    if given is None:
        return {}
    return dict(zip(names, (_frozen(moved(given[0] * scale, place)), _frozen(given[1])), strict=True))


def world_pose(up: str, pose: Sequence[float] | None) -> Array | None:
    """The pose (4, 4) in the world of a frame whose axis `up` points up, or from 16 numbers; None if it is the world.

    Raises:
        InputError: both are given, or `up` is not an axis, or there are not 16 numbers.
    """
    if pose is not None:
        if up != UNTURNED:
            raise InputError("give --up or --pose, not both")
        if len(pose) != 16:
            raise InputError(f"--pose has the 16 numbers of a matrix, row by row; found {len(pose)}")
        return np.array(pose, dtype=np.float64).reshape(4, 4)
    if up not in UPS:
        raise unknown("axis", up, UPS)
    if up == UNTURNED:
        return None
    axis, sign = "xyz".index(up[-1]), -1.0 if "-" in up else 1.0
    turn = np.eye(4)
    if axis == 2:
        turn[1, 1] = turn[2, 2] = -1.0
        return turn
    side = 3 - axis - 2  # the other one of x and y
    turn[:3, :3] = 0.0
    turn[2, axis], turn[side, side], turn[axis, 2] = sign, 1.0, -sign
    return turn


def _digest(arrays: Iterable[Array | IntArray | None], options: object) -> str:
    digest = hashlib.sha256(repr(options).encode())
    for array in arrays:
        digest.update(b"" if array is None else np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _frozen(array: NDArray[Scalar]) -> NDArray[Scalar]:
    array.setflags(write=False)
    return array
