"""A picture of a scene with its numbered clusters: from above, and as the camera saw it."""

import io
from typing import Any

import numpy as np

from sgnlp.base.palette import GREY, INK, PALE, Colour, finger
from sgnlp.perception.sampling import grid_sample
from sgnlp.perception.scene import NO_CLUSTER, Cluster, Scene
from sgnlp.show.png import drawable

PANEL, DPI = 4.5, 120
"""Side of a panel [inch], and dots an inch."""
DOT = 3
"""Area of a drawn point, seen from above [points²]."""
DRAWN = 20_000
"""Largest number of points of the table, and of each cluster, that are drawn from above."""
REACH = 0.25
"""[m] Margin of the picture from above around the clusters."""
NEAREST, FARTHEST = 0.02, 0.98
"""Quantiles of the depths that are drawn in the lightest and darkest grey."""
DARKEST = 0.45
"""Grey level of the farthest depth."""


def colour(cluster: Cluster) -> Colour:
    """The colour of a cluster; grey if it is no object."""
    return GREY if cluster.fault else finger(cluster.number - 1)


def picture(scene: Scene) -> bytes:
    """A PNG of all points from above, in the world frame, and of the first view if it is an image.

    Raises:
        InputError: Matplotlib is not installed.
    """
    drawable()
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    organised = scene.views[0].organised
    with rc_context({"font.size": 9}):
        figure = Figure(figsize=((1 + organised) * PANEL, PANEL), layout="constrained")
        axes = figure.subplots(1, 1 + organised, squeeze=False)[0]
        if organised:
            _camera(axes[0], scene)
        _above(axes[-1], scene)
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=DPI)
    return file.getvalue()


def _camera(ax: Any, scene: Scene) -> None:
    """The depths in grey, clusters in colours."""
    view, labels = scene.views[0], scene.labels[0]
    away = np.linalg.norm(view.points - (0.0 if view.camera is None else view.camera), axis=2)
    low, high = np.nanquantile(away, (NEAREST, FARTHEST))
    shade = 1 - (1 - DARKEST) * np.clip((away - low) / max(high - low, np.finfo(float).tiny), 0, 1)
    image = np.repeat(np.nan_to_num(shade, nan=0.0)[..., None], 3, axis=2)
    for cluster in scene.clusters:
        mask = labels == cluster.number
        if mask.any():
            image[mask] = (image[mask] + 2 * np.array(colour(cluster))) / 3
            v, u = np.argwhere(mask).mean(axis=0)
            _number(ax, u, v, cluster)
    ax.imshow(image, interpolation="nearest")
    ax.set(title="camera", xlabel="u [px]", ylabel="v [px]")


def _above(ax: Any, scene: Scene) -> None:
    """The table pale, clusters in colours, x to the right and y up."""
    points = np.concatenate([view.points[view.measured & (labels == NO_CLUSTER)] for view, labels in _pairs(scene)])
    _dots(ax, points, PALE)
    for cluster in scene.clusters:
        _dots(ax, cluster.points, colour(cluster))
        _number(ax, cluster.centre[0], cluster.centre[1], cluster)
    low = np.min([cluster.points.min(axis=0) for cluster in scene.clusters], axis=0)[:2] - REACH
    high = np.max([cluster.points.max(axis=0) for cluster in scene.clusters], axis=0)[:2] + REACH
    ax.set(title="from above", xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(low[0], high[0]))
    ax.set_ylim(low[1], high[1])
    ax.spines[["top", "right"]].set_visible(False)


def _pairs(scene: Scene) -> Any:
    return zip(scene.views, scene.labels, strict=True)


def _dots(ax: Any, points: Any, shade: Colour) -> None:
    chosen = points[grid_sample(points, DRAWN)]
    ax.scatter(chosen[:, 0], chosen[:, 1], s=DOT, color=[shade], linewidths=0)


def _number(ax: Any, x: float, y: float, cluster: Cluster) -> None:
    text = f"({cluster.number})" if cluster.fault else str(cluster.number)
    box = {"boxstyle": "circle,pad=0.2", "facecolor": "white", "edgecolor": INK, "linewidth": 0.6}
    ax.text(x, y, text, ha="center", va="center", color=INK, bbox=box)
