"""An observed object: the cleaned partial point cloud, the table under it, and what was dropped or assumed.

The order of cleaning: pick views, scale to metres, drop what is not finite, find the table and drop what is
below it, thin very large clouds, drop outliers, refuse what has no volume or no graspable size.
"""

import hashlib
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from sgnlp import clouds
from sgnlp.checked import POSITIVE, Checked, Interval
from sgnlp.errors import InputError
from sgnlp.sampling import MAX_POINTS, grid_sample

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Scalar = TypeVar("Scalar", bound=np.generic)

SIMPLEX_POINTS = 4  # fewer points enclose no volume
SHARE: Interval = (0.0, 1.0)


@dataclass(frozen=True)
class ObservationSettings(Checked):
    """How a cloud is cleaned and what is refused."""

    section = "cleaning"
    valid: ClassVar[dict[str, Interval]] = {
        "outlier_neighbours": POSITIVE,
        "outlier_deviations": POSITIVE,
        "max_invalid_share": SHARE,
        "max_coordinate": POSITIVE,
        "min_points": (SIMPLEX_POINTS, math.inf),
        "min_width": POSITIVE,
        "max_width": POSITIVE,
        "min_flatness": POSITIVE,
        "max_share_below_table": SHARE,
        "table_quantile": SHARE,
        "max_table_gap": POSITIVE,
        "max_points": POSITIVE,
    }

    outlier_neighbours: int = 20
    """Neighbours whose mean distance tells an outlier; the paper's release takes 20."""
    outlier_deviations: float = 2.0
    """Standard deviations above the mean that make an outlier; the release takes 1, which drops 12-42 %."""
    max_invalid_share: float = 0.2
    """Largest share of points that may be NaN, infinite or beyond `max_coordinate`."""
    max_coordinate: float = 1e6
    """[m] A larger coordinate is some sensor's mark for "no return", never a measurement."""
    min_points: int = 30
    """Fewest points, before and after cleaning."""
    min_width: float = 0.01
    """[m] Smallest longest side of the cloud's box."""
    max_width: float = 0.5
    """[m] Largest longest side of the cloud's box."""
    min_flatness: float = 1e-3
    """Smallest ratio of the second (else a line) and third (else a plane) singular value to the first."""
    max_share_below_table: float = 0.2
    """Largest share of points that may lie below the table."""
    table_quantile: float = 0.005
    """Quantile of the heights that stands for the table where none is given."""
    max_table_gap: float = 0.03
    """[m] A cloud that begins higher than this above its table is remarked upon."""
    max_points: int = MAX_POINTS
    """Larger clouds are thinned on a grid to at most this many points."""


DEFAULTS = ObservationSettings()


@dataclass(frozen=True, eq=False)
class Observation:
    """A cleaned cloud in the world frame: z up, metres. Arrays are read-only."""

    points: FloatArray  # (N, 3) [m]
    view: IntArray  # (N,) index into view_names
    view_names: tuple[str, ...]  # (V,)
    table_height: float  # [m] z of the table's plane
    name: str
    digest: str  # SHA-256 of everything that was given to `observe`, name and truth apart
    camera_positions: FloatArray | None = None  # (V, 3) [m]
    mesh_vertices: FloatArray | None = None  # (U, 3) [m] the true surface, where it is known
    mesh_faces: IntArray | None = None  # (F, 3)
    mass: float | None = None  # [kg] of the true body
    friction: float | None = None  # true coefficient between a fingertip and the body
    notes: tuple[str, ...] = ()  # a sentence for each thing dropped or assumed
    source: str | None = None  # the file it was read from
    half: str = ""  # of a problem set: tuning, held_out, or none
    reading: dict[str, Any] | None = None  # the options that `load` was given, in plain values


def load(
    path: str | Path,
    *,
    views: Sequence[str | int] | None = None,
    scale: float = 1.0,
    table_height: float | None = None,
    settings: ObservationSettings = DEFAULTS,
) -> Observation:
    """The observation in a file: npz, or .ply .pcd .xyz through Open3D; options as in `observe`.

    The file's own table height, camera positions and mesh are in its unit and follow `scale`; the argument
    `table_height` [m] takes precedence. Raises `InputError`, one line that begins with the path.
    """
    names = None if views is None else list(views)
    reading = {"views": names, "scale": scale, "table_height": table_height, "settings": asdict(settings)}
    try:
        raw = clouds.read(path)
        if table_height is None and raw.table_height is not None:
            table_height = raw.table_height * scale
        observation = observe(
            raw.points,  # type: ignore[arg-type]
            view=raw.view,  # type: ignore[arg-type]
            view_names=raw.view_names,
            views=views,
            table_height=table_height,
            scale=scale,
            name=raw.name,
            camera_positions=raw.camera_positions,  # type: ignore[arg-type]
            mesh_vertices=raw.mesh_vertices,  # type: ignore[arg-type]
            mesh_faces=raw.mesh_faces,  # type: ignore[arg-type]
            mass=raw.mass,
            friction=raw.friction,
            notes=[
                *raw.notes,
                *([f"Ignored the unknown keys {', '.join(raw.ignored_keys)}."] if raw.ignored_keys else []),
            ],
            settings=settings,
        )
        return replace(observation, source=str(path), half=raw.half, reading=reading)
    except InputError as error:
        line = "".join(letter if letter.isprintable() else "?" for letter in f"{path}: {error}")
        raise InputError(line) from error


def observe(
    points: ArrayLike,
    *,
    view: ArrayLike | None = None,
    view_names: Sequence[str] | None = None,
    views: Sequence[str | int] | None = None,
    table_height: float | None = None,
    scale: float = 1.0,
    name: str = "object",
    camera_positions: ArrayLike | None = None,
    mesh_vertices: ArrayLike | None = None,
    mesh_faces: ArrayLike | None = None,
    mass: float | None = None,
    friction: float | None = None,
    notes: Sequence[str] = (),
    settings: ObservationSettings = DEFAULTS,
) -> Observation:
    """Clean a cloud of points (N, 3) into an `Observation`.

    `view` (N,) numbers the camera of each point, `view_names` names the cameras (default: their numbers), and
    `views` keeps some of them by name, or by place in the order of the names where no name matches. `scale`
    turns `points`, `camera_positions` (V, 3) and the mesh (U, 3), (F, 3) into metres; `table_height` is in
    metres already and is estimated from the lowest points where it is missing. `mass` [kg] and `friction` are,
    like the mesh, the truth that a simulation needs. Raises `InputError` for everything that cannot be the cloud
    of one graspable object on a table.
    """
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(f"the scale must be a positive number; found {scale}")
    clouds.check_name(name)
    clouds.check_truth(mass=mass, friction=friction)
    cloud = clouds.floats(points, "points", (None, 3))
    cameras = clouds.Cameras.of(len(cloud), view, view_names, camera_positions)
    options = (cameras.names, table_height, scale, views, settings)
    kept = cameras.pick(views)
    clean = _Cleaning(cloud, settings, notes)
    if camera_positions is not None and cameras.positions is None:
        clean.notes.append("Ignored the camera positions: no view says which of them saw a point.")
    clean.keep(np.isin(cameras.view, kept), "belong to views that were not chosen")
    clean.scale(scale)
    table = clean.find_table(table_height)
    clean.thin()
    clean.drop_outliers()
    _check_shape(clean.points, settings)
    mesh = clouds.mesh(mesh_vertices, mesh_faces)
    return Observation(
        points=_frozen(clean.points),
        view=_frozen(np.searchsorted(kept, cameras.view[clean.index])),
        view_names=tuple(cameras.names[i] for i in kept),
        table_height=table,
        name=name,
        digest=_digest(cloud, cameras.view, cameras.positions, options),
        camera_positions=None if cameras.positions is None else _frozen(cameras.positions[kept] * scale),
        mesh_vertices=None if mesh is None else _frozen(mesh[0] * scale),
        mesh_faces=None if mesh is None else _frozen(mesh[1]),
        mass=mass,
        friction=friction,
        notes=tuple(clean.notes),
    )


class _Cleaning:
    """The points that are left, their places in the input, and the notes on those that are not."""

    def __init__(self, points: FloatArray, settings: ObservationSettings, notes: Sequence[str]) -> None:
        self.points = points  # (n, 3)
        self.index = np.arange(len(points))  # (n,)
        self.settings = settings
        self.notes = list(notes)

    def keep(self, mask: NDArray[np.bool_], reason: str) -> None:
        """Keep the points of a mask, note how many were dropped and why, refuse too few."""
        if not mask.all():
            self.notes.append(f"Dropped {np.sum(~mask)} of {len(mask)} points that {reason}.")
        self.points, self.index = self.points[mask], self.index[mask]
        if len(self.points) < self.settings.min_points:
            dropped = f" ({' '.join(self.notes)})" if self.notes else ""
            needed = f"at least {self.settings.min_points} are needed"
            raise InputError(f"has {len(self.points)} points, {needed}{dropped}")

    def scale(self, factor: float) -> None:
        """To metres; drops what is not a finite measurement."""
        with np.errstate(over="ignore", invalid="ignore"):
            self.points = self.points * factor
        if factor != 1.0:
            self.notes.append(f"Multiplied all coordinates by {factor:g}.")
        valid = np.all(np.abs(self.points) < self.settings.max_coordinate, axis=1)
        share = 1.0 - valid.mean()
        if share > self.settings.max_invalid_share:
            allowed = f"at most {self.settings.max_invalid_share:.0%} may be"
            raise InputError(f"{share:.0%} of the points are NaN, infinite or beyond measure; {allowed}")
        self.keep(valid, "are NaN, infinite or beyond measure")

    def find_table(self, given: float | None) -> float:
        """The height of the table, given or estimated; drops what is below it."""
        heights = self.points[:, 2]
        span = f"the cloud's heights run from {heights.min():.4f} to {heights.max():.4f} m"
        if given is None:
            table = float(np.quantile(heights, self.settings.table_quantile))
            share = f"{100 * self.settings.table_quantile:g} %"
            self.notes.append(f"Assumed the table at {table:.4f} m, the {share} quantile of the heights.")
        else:
            table = float(given)
            if not np.isfinite(table):
                raise InputError(f"the table height must be a number; found {given}")
        above = heights >= table
        share_below = 1.0 - above.mean()
        if share_below > self.settings.max_share_below_table:
            raise InputError(f"the table at {table:.4f} m is above {share_below:.0%} of the cloud; {span}")
        if heights.min() - table > self.settings.max_table_gap:
            self.notes.append(f"Nothing was seen just above the table at {table:.4f} m: {span}.")
        self.keep(above, f"lie below the table at {table:.4f} m")
        return table

    def thin(self) -> None:
        """One point a grid cell, for clouds above `max_points`."""
        mask = np.zeros(len(self.points), bool)
        mask[grid_sample(self.points, self.settings.max_points)] = True
        self.keep(mask, "share a cell of the thinning grid with another")

    def drop_outliers(self) -> None:
        """Statistical removal: distance to the neighbours, on average, above its mean + ratio · deviation."""
        neighbours = min(self.settings.outlier_neighbours, len(self.points) - 1)
        distances, _ = cKDTree(self.points).query(self.points, k=neighbours + 1)
        average = np.asarray(distances)[:, 1:].mean(axis=1)  # (n,) [m] without the point itself
        limit = average.mean() + self.settings.outlier_deviations * average.std()
        criterion = f"mean distance to {neighbours} neighbours above {1e3 * limit:.1f} mm"
        self.keep(average <= limit, f"are outliers ({criterion})")


def _check_shape(points: FloatArray, settings: ObservationSettings) -> None:
    """Refuse a cloud without volume, or too wide or small for a hand."""
    width = float(np.ptp(points, axis=0).max())
    if width == 0:
        raise InputError("all points are equal")
    if width > settings.max_width:
        hint = "is it in mm (--scale 0.001), or not cropped to the object?"
        raise InputError(f"the cloud is {width:.4g} m wide, more than {settings.max_width:g} m; {hint}")
    if width < settings.min_width:
        hint = "is its unit the metre? (--scale multiplies all coordinates; 0.001 is for mm)"
        raise InputError(f"the cloud is {width:.4g} m wide, less than {settings.min_width:g} m; {hint}")
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)  # (3,) descending
    if spread[2] < settings.min_flatness * spread[0]:
        figure = "line" if spread[1] < settings.min_flatness * spread[0] else "plane"
        raise InputError(f"all points lie on one {figure}; a solid object needs points in three dimensions")


def _digest(cloud: FloatArray, view: IntArray, positions: FloatArray | None, options: object) -> str:
    digest = hashlib.sha256(repr(options).encode())
    for array in (cloud, view, positions):
        digest.update(b"" if array is None else np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _frozen(array: NDArray[Scalar]) -> NDArray[Scalar]:
    array.setflags(write=False)
    return array
