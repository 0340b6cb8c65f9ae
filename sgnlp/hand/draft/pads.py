"""The pads: a sphere fitted to the skin of each finger's end, on the side that touches objects."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from sgnlp.base.arrays import Array
from sgnlp.hand.draft.chains import Chain
from sgnlp.hand.draft.closing import End
from sgnlp.hand.draft.skeleton import Skeleton
from sgnlp.hand.findings import MAX_PAD
from sgnlp.perception.synthetic.meshes import hull
from sgnlp.perception.synthetic.truth import surface_samples

TILT = np.pi / 4
"""Direction of a pad [rad]: half way between the directions in which the finger points and closes."""
SIDE = np.pi / 3
"""Skin belongs to the pad if its normal is within this angle of the pad's direction [rad]: it can touch objects."""
DISTAL = 0.6
"""Length of the pad on the finger's end, in widths of the end: a hemisphere, and a little more."""
MIN_PAD, BARE_PAD = 0.003, 0.008
"""Least radius of a pad, and that of a finger without meshes [m]: half of a human fingertip's width."""
POINTS = 2000
"""Points drawn from the skin that the sphere is fitted to."""


@dataclass(frozen=True, eq=False)
class Pad:
    """A sphere in the frame of a finger's last joint, and its distances from the skin."""

    centre: Array  # (3,) [m]
    radius: float  # [m]
    normal: Array  # (3,) where it looks
    rms: float | None  # [m]; None without meshes
    worst: float | None  # [m]


def pad(skeleton: Skeleton, chain: Chain, end: End) -> Pad:
    """The sphere |x - c| = r of least Σ (|x - c| - r)² over the skin of the pad."""
    looks = np.cos(TILT) * end.along + np.sin(TILT) * end.closing
    skin = skeleton.skin(chain.end)
    if not len(skin):
        place = skeleton.model.frames[skeleton.model.getFrameId(chain.tip, pin.FrameType.BODY)].placement
        return Pad(np.array(place.translation), BARE_PAD, looks, None, None)
    far = skin @ end.along
    width = _width(skin, end)
    distal = skin[far >= far.max() - DISTAL * width]
    middle = distal.mean(axis=0)
    points, normals = surface_samples(hull(distal - middle), POINTS, np.random.default_rng(0))
    points = points[normals @ looks >= np.cos(SIDE)] + middle
    largest = max(min(width / 2, MAX_PAD), 2 * MIN_PAD)

    def misses(x: Array) -> Array:
        return np.asarray(np.linalg.norm(points - x[:3], axis=1) - x[3])

    radius = 0.9 * largest
    begin = np.r_[points.mean(axis=0) - radius * looks, radius]
    bounds = [-np.inf] * 3 + [MIN_PAD], [np.inf] * 3 + [largest]
    fitted = least_squares(misses, begin, bounds=bounds, x_scale=MIN_PAD).x
    off = misses(fitted)
    return Pad(fitted[:3], float(fitted[3]), looks, float(np.sqrt(np.mean(off**2))), float(np.abs(off).max()))


def _width(skin: Array, end: End) -> float:
    """The larger width [m] of a finger's end, perpendicular to its direction."""
    axes = np.stack([end.closing, np.cross(end.along, end.closing)])
    far = skin @ end.along
    distal = skin[far >= (far.min() + far.max()) / 2]
    return float(np.ptp(distal @ axes.T, axis=0).max())
