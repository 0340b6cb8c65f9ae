"""A whole scene, split into a table and clusters on it; each cluster can become an observation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sgnlp.base.arrays import Array, BoolArray, IntArray, floats
from sgnlp.base.brief import brief
from sgnlp.base.errors import InputError
from sgnlp.perception import free_space
from sgnlp.perception.cleaning import ObservationSettings
from sgnlp.perception.clusters import cells
from sgnlp.perception.observation import DEFAULTS, Observation, observe
from sgnlp.perception.sampling import grid_sample
from sgnlp.perception.scene_planes import ScenePlane
from sgnlp.perception.scene_views import SceneView
from sgnlp.perception.table_beside import heights_around, median_height, rounded

NO_CLUSTER = 0
"""The number of pixels and obstacles that belong to no cluster."""
OBSTACLE_REACH = 0.3
"""[m] Points within this distance of the object may be in the hand's way: a hand is 0.2 m long."""
OBSTACLE_CELL, OBSTACLE_POINTS = 0.005, 2000
"""Cell [m] and number: obstacles are thinned to one point in each cell, and each to at most this many points."""
TABLE_NEAR = 0.01
"""[m] Points this near to the fitted plane are the table's."""
NEAR = 0.2
"""A cluster is near a place within this [m]: objects on a table stand closer than that."""


@dataclass(frozen=True, eq=False)
class Cluster:
    """A connected cluster of points on the table.

    `number` counts from 1; `points` (n, 3) [m] are in the world; `fault` is "" if it may be an object.
    """

    number: int  # from 1
    points: Array  # (n, 3) [m] in the world
    view: IntArray  # (n,) index of the view of each
    distance: float | None  # [m] distance of its middle from the nearest camera, if one is known
    fault: str  # why it is no object to grasp: "" if it may be one

    @property
    def centre(self) -> Array:
        """The middle (3,) [m] of its box."""
        return np.asarray((self.points.min(axis=0) + self.points.max(axis=0)) / 2)

    @property
    def size(self) -> Array:
        """The sides (3,) [m] of its box."""
        return np.asarray(np.ptp(self.points, axis=0))


@dataclass(frozen=True, eq=False)
class Scene:
    """A table and the clusters on it, in a world frame with z up.

    Clusters are numbered from 1: first those that may be objects, then those with a fault, both by decreasing number of
    points.
    """

    __repr__ = brief

    views: tuple[SceneView, ...]  # the measurements of each camera, in the world
    labels: tuple[IntArray, ...]  # (H, W) each, the number of the cluster at every pixel, or NO_CLUSTER
    above: tuple[BoolArray, ...]  # (H, W) each, the pixels above the table
    table: ScenePlane
    transform: Array  # (4, 4) from the given frame to the world
    clusters: tuple[Cluster, ...]
    notes: tuple[str, ...]  # a sentence for each thing dropped or assumed

    @property
    def choices(self) -> tuple[Cluster, ...]:
        """The clusters that may be objects."""
        return tuple(cluster for cluster in self.clusters if not cluster.fault)

    def cluster(self, number: int) -> Cluster:
        """The cluster with this number. Raises `InputError` if there is none."""
        if not isinstance(number, Integral) or not 1 <= number <= len(self.clusters):
            raise InputError(f"the number of a cluster must be 1 to {len(self.clusters)}; found {number!r}")
        return self.clusters[number - 1]

    def pixels(self, number: int) -> tuple[BoolArray, ...]:
        """The pixels (H, W) of a cluster in each view."""
        return tuple(np.asarray(labels == self.cluster(number).number) for labels in self.labels)

    def nearest(self, place: ArrayLike) -> Cluster:
        """The possible object with the point nearest to a place (3,) [m] in the world. Raises `InputError` if none
        is, or none within `NEAR`."""
        p = floats(place, "place", (3,))
        if not self.choices:
            raise InputError("no cluster may be an object")
        distances = [float(np.linalg.norm(cluster.points - p, axis=1).min()) for cluster in self.choices]
        least = int(np.argmin(distances))
        if not distances[least] <= NEAR:
            rule = f"at most {NEAR:g} m are near; the place must be in metres, in the world frame of the clusters"
            raise InputError(f"the nearest cluster is {distances[least]:.2f} m from the place; {rule}")
        return self.choices[least]

    def at_pixel(self, u: int, v: int) -> Cluster:
        """The cluster at column u and row v of the first view. Raises `InputError` if there is none."""
        labels = self.labels[0]
        if not self.views[0].organised:
            raise InputError("a pixel needs a depth image, or a cloud of shape (height, width, 3)")
        if not (0 <= u < labels.shape[1] and 0 <= v < labels.shape[0]):
            raise InputError(f"the pixel ({u}, {v}) is outside of the {labels.shape[1]} x {labels.shape[0]} pixels")
        if labels[v, u] == NO_CLUSTER:
            found = "the table" if self.views[0].measured[v, u] and not self.above[0][v, u] else "no object"
            found = found if self.views[0].measured[v, u] else "nothing that was measured"
            raise InputError(f"at the pixel ({u}, {v}) is {found}")
        return self.cluster(int(labels[v, u]))

    def arrays(self, *numbers: int) -> dict[str, Any]:
        """The arrays of a cluster's problem file, as `sgnlp.load` reads them; several clusters are parts of one
        object."""
        if not numbers:
            raise InputError(f"no cluster is chosen; give numbers from 1 to {len(self.clusters)}")
        parts = [self.cluster(number) for number in dict.fromkeys(numbers)]
        points, view = (np.concatenate([getattr(part, name) for part in parts]) for name in ("points", "view"))
        cluster = replace(parts[0], points=points, view=view)
        height = self._table_height(cluster)
        obstacle_points, obstacle = self._obstacles(cluster, numbers)
        counts = np.bincount(cluster.view, minlength=len(self.views))
        kept = np.flatnonzero(counts)
        found: dict[str, Any] = {
            "points": cluster.points,
            "view": np.searchsorted(kept, cluster.view),
            "table_height": height,
            "notes": [*self.notes, self._chosen(parts)],
            "transform": self.transform,
        }
        cameras = [self.views[i].camera for i in kept]
        if all(camera is not None for camera in cameras):
            found["camera_positions"] = np.array(cameras)
            found |= self._background(cluster, [int(i) for i in kept], numbers)
        if len(obstacle_points):
            found |= {"obstacle_points": obstacle_points, "obstacle": obstacle}
        return found

    def observation(self, *numbers: int, name: str = "object", settings: ObservationSettings = DEFAULTS) -> Observation:
        """The observation of a cluster, or of several that are parts of one object; all else near it becomes obstacles.

        Raises:
            InputError: there is no such cluster, or it cannot be the cloud of one graspable object.
        """
        arrays = self.arrays(*numbers)
        del arrays["transform"]
        return observe(**arrays, name=name, settings=settings)

    def _chosen(self, parts: Sequence[Cluster]) -> str:
        others = len(self.clusters) - len(parts)
        numbers = " and ".join(str(part.number) for part in parts)
        faults = "".join(f" Cluster {part.number} {part.fault}." for part in parts if part.fault)
        return f"Took cluster {numbers} of the scene; {others} others are on or over the table.{faults}"

    def _table_height(self, cluster: Cluster) -> float:
        """The median height [m] of the table's points around a cluster, else the height of its plane there."""
        rest = [view.points[view.measured & ~above] for view, above in zip(self.views, self.above, strict=True)]
        table = np.concatenate([points[np.abs(self.table.heights(points)) < TABLE_NEAR] for points in rest])
        around = heights_around(cluster.points, table) if self.table.count else None
        if around is not None:
            return median_height(around)
        n, middle = self.table.normal, cluster.centre
        return rounded((self.table.offset - n[:2] @ middle[:2]) / n[2])

    def _background(self, cluster: Cluster, kept: Sequence[int], own: Sequence[int]) -> dict[str, Any]:
        """The points that cameras measured around and behind a cluster, and the index of each camera among the kept
        ones."""
        found = []
        for i in kept:
            view, mine = self.views[i], cluster.points[cluster.view == i]
            others = view.points[view.measured & ~np.isin(self.labels[i], own)]
            found.append(free_space.background(np.asarray(view.camera), mine, others))
        return {
            "background": np.concatenate(found),
            "background_view": np.repeat(np.arange(len(kept)), [len(points) for points in found]),
        }

    def _obstacles(self, cluster: Cluster, own: Sequence[int]) -> tuple[Array, IntArray]:
        """Points (M, 3) [m] above the table within `OBSTACLE_REACH` of a cluster's box, and their clusters (M,)."""
        low, high = cluster.points.min(axis=0) - OBSTACLE_REACH, cluster.points.max(axis=0) + OBSTACLE_REACH
        points, numbers = [], []
        for view, labels, above in zip(self.views, self.labels, self.above, strict=True):
            chosen = above & ~np.isin(labels, own)
            points.append(view.points[chosen])
            numbers.append(labels[chosen])
        P, n = np.concatenate(points), np.concatenate(numbers)
        within = ((low <= P) & (high >= P)).all(axis=1)
        P, n = P[within], n[within]
        kept = [_thinned(P[n == i]) for i in np.unique(n)]
        if not kept:
            return np.zeros((0, 3)), np.zeros(0, np.int64)
        return np.concatenate(kept), np.repeat(np.unique(n), [len(part) for part in kept]).astype(np.int64)


def _thinned(points: Array) -> Array:
    """The means of the points (n, 3) in cells, no more than `OBSTACLE_POINTS`."""
    means = cells(points, OBSTACLE_CELL)[0]
    return means[grid_sample(means, OBSTACLE_POINTS)]
