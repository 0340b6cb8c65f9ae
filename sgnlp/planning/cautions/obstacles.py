"""What stands around the object in the hand's way: the plan does not know of it, so a caution tells."""

import numpy as np
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array, BoolArray, IntArray
from sgnlp.hand.kinematics import frames
from sgnlp.planning.cautions.planned import Planned

CLEARANCE = 0.005
"""[m] Spheres of the hand nearer to a measured point of an obstacle: the noise of a point and the error of a camera's
pose are as large."""
STANDING = 0.03
"""[m] An obstacle that begins no higher above the table stands on it, and what is below its points is inside it."""


def in_the_way(result: Planned) -> str:
    """A sphere of the hand near, or below, the measured points of an obstacle."""
    cloud, g = result.cloud, result.grasps
    if cloud is None or cloud.obstacle_points is None or cloud.obstacle is None or len(cloud.obstacle_points) == 0:
        return ""
    radii = np.array([sphere.radius for sphere in result.hand.spheres])
    told = []
    for stage, joints in (("the pregrasp", g.joints[0]), ("first contact", g.joints_contact[0])):
        centres = np.asarray(frames(result.hand, g.wrist[0], joints)[1])
        away, nearest = map(np.asarray, cKDTree(cloud.obstacle_points).query(centres))
        gaps = away - radii
        inside, which = below(centres, radii, cloud.obstacle_points, cloud.obstacle, cloud.table_height)
        hit = inside | (gaps < CLEARANCE)
        if hit.any():
            i = int(np.where(hit, np.where(inside, -1.0, gaps), np.inf).argmin())
            number = which[i] if inside[i] else cloud.obstacle[nearest[i]]
            how = "is inside or below" if inside[i] else f"is {1e3 * max(float(gaps[i]), 0.0):.0f} mm from"
            what = f"obstacle {number}" if number else "what is around the object"
            told.append(f"at {stage} {result.hand.spheres[i].name} {how} {what} ({hit.sum()} of {len(hit)} spheres)")
    near = f"The hand is nearer than {1e3 * CLEARANCE:.0f} mm to obstacles, which the plan does not know of"
    return f"{near}: {'; '.join(told)}." if told else ""


def below(centres: Array, radii: Array, points: Array, obstacle: IntArray, table: float) -> tuple[BoolArray, IntArray]:
    """Which spheres (S,) have points of a standing obstacle straight above their centre, and its number (S,).

    Cameras see the tops of what stands: what is under them is inside it, or hidden.
    """
    inside, which = np.zeros(len(centres), bool), np.zeros(len(centres), np.int64)
    for number in np.unique(obstacle):
        P = points[obstacle == number]
        if P[:, 2].min() > table + STANDING:
            continue
        for i, near in enumerate(cKDTree(P[:, :2]).query_ball_point(centres[:, :2], radii)):
            if near and P[near, 2].max() > centres[i, 2]:
                inside[i], which[i] = True, number
    return inside, which
