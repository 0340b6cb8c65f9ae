"""What to be wary of in a cloud: a sentence, or "" where there is no reason for one. One body on a table gives none."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sgnlp.perception.cleaning import coordinate_steps
from sgnlp.perception.observation import Observation
from sgnlp.planning.cautions.measures import body_shares, bulge, largest_plane, sample, seen_sides
from sgnlp.planning.cautions.planned import Planned

Array = NDArray[np.float64]

GAP, BODY_SHARE = 0.02, 0.03
"""Groups of points that are farther apart than this [m] and hold this share are bodies: occlusion parts the cloud of
one body by less, on the problem set and on real clouds."""
PLANE_THICKNESS, PLANE_MARGIN = 0.004, 0.01
"""Points within this of a plane are on it, twice the noise of a depth camera; feet are this far inside its edge [m]."""
PLANE_INSIDE, PLANE_RATIO = 0.95, 1.5
"""A table or wall has nearly all of the rest inside its outline, which is so many times wider: on the wings of a toy
plane, the nearest to it of good clouds, it is 0.92."""
TABLE_NEAR = 0.02
"""A level plane within this of the table's height is the table [m]."""
CAMERA_ANGLE, CAMERA_BULGE, CAMERA_DISTANCE = 35.0, 0.5, 0.15
"""In a camera's own frame the cloud is within half a field of view [deg] of ±z, no nearer than cameras see [m], and
bulges towards the origin."""
TOP_SEEN, UNDERSIDE_SEEN = 0.6, 0.9
"""From above a table more than this of the top is seen or less than that of the underside: the nearest of good clouds,
a toy plane, has 0.47 and 0.82."""
TABLE_GAP = 0.03
"""A cloud that begins higher than this above its table [m] hides as much as a fingertip needs."""
STEP = 0.002
"""Coordinates rounded to more than this [m] are as far off as a contact may be that counts as one."""
UNSEEN_ERROR_MM = 14
"""By how much the surface is too near where one camera does not see it (`results/calibration`)."""
WALL_NOISES = 2.0
"""Walls thinner than this many deviations of a measured point cannot be told from one surface."""
WALL_SHARE = 0.1
"""Share of the points that must lie on such walls: edges and corners of solid bodies have up to 3 %, a cup 35 %."""
WALL_POINTS, WALL_NEIGHBOURS = 500, 60
"""Points that are looked at, and neighbours that give the normal of one."""
OPPOSITE = -0.8
"""Cosine between the normals of the two sides of a wall, at most."""


def bodies(result: Planned) -> str:
    """Several groups of points."""
    if result.cloud is None:
        return ""
    shares = body_shares(sample(result.cloud.points), GAP)
    count = int((shares >= BODY_SHARE).sum())
    told = " and ".join(f"{share:.0%}" for share in shares[:count])
    far = f"more than {1e3 * GAP:.0f} mm apart"
    return f"The cloud has {count} clusters {far} ({told} of the points): crop it to one object." if count > 1 else ""


def plane(result: Planned) -> str:
    """A table or a wall in the cloud."""
    if result.cloud is None:
        return ""
    found = largest_plane(sample(result.cloud.points), PLANE_THICKNESS, PLANE_MARGIN)
    if found.inside < PLANE_INSIDE or found.ratio < PLANE_RATIO:
        return ""
    level = abs(found.normal[2]) > np.cos(np.radians(10)) and found.height < result.cloud.table_height + TABLE_NEAR
    what = "A plane at the table's height" if level else "A plane, like a wall's or a table's,"
    wider = f"{found.ratio:.1f} times as wide as what stands on it"
    return f"{what} holds {found.share:.0%} of the points, {wider}: crop the cloud to the object."


def camera_frame(result: Planned) -> str:
    """Coordinates in a camera's own frame."""
    if result.cloud is None or result.cloud.camera_positions is not None:
        return ""
    points = sample(result.cloud.points)
    middle = points.mean(axis=0)
    distance, width = float(np.linalg.norm(middle)), float(np.ptp(points, axis=0).max())
    if distance < max(CAMERA_DISTANCE, width):
        return ""
    angle = np.degrees(np.arccos(abs(middle[2]) / distance))
    if angle > CAMERA_ANGLE or bulge(points) < CAMERA_BULGE:
        return ""
    axis = "z" if middle[2] > 0 else "-z"
    seen = f"the cloud lies along {axis} and bulges towards the origin, {100 * distance:.0f} cm away"
    return f"The coordinates may be a camera's own: {seen}. If so, give the camera's --pose."


def underside(result: Planned) -> str:
    """Another axis up, or a camera's frame."""
    if result.cloud is None or result.cloud.camera_positions is not None or camera_frame(result) or plane(result):
        return ""
    top, bottom = seen_sides(sample(result.cloud.points))
    if top > TOP_SEEN or bottom < UNDERSIDE_SEEN:
        return ""
    seen = f"Of the cloud's underside {bottom:.0%} were seen, of its top {top:.0%}"
    return f"{seen}: unless it is a bowl, another axis may be up (--up), or the frame a camera's (--pose)."


def in_the_air(result: Planned) -> str:
    """Nothing near the table."""
    if result.cloud is None:
        return ""
    heights, table = result.cloud.points[:, 2], result.cloud.table_height
    gap = float(heights.min()) - table
    span = f"heights run from {heights.min():.3f} to {heights.max():.3f} m"
    filled = "what is between is planned as solid"
    said = f"Nothing was seen within {1e3 * TABLE_GAP:.0f} mm of the table at {table:.3f} m, {span}: {filled}."
    return said if gap > TABLE_GAP else ""


def thin(result: Planned) -> str:
    """A body that ends below the pads' radius."""
    if result.cloud is None:
        return ""
    radius = min(finger.radius for finger in result.hand.fingers)
    height = float(result.cloud.points[:, 2].max()) - result.cloud.table_height
    low = f"The body ends {1e3 * height:.0f} mm above the table, below the pads' radius of {1e3 * radius:.0f} mm"
    return f"{low}: fingertips cannot oppose each other on it." if height < radius else ""


def rounded(result: Planned) -> str:
    """Coordinates on a lattice."""
    if result.cloud is None:
        return ""
    steps = coordinate_steps(result.cloud.points)
    told = ", ".join(f"{letter} {1e3 * step:.1f} mm" for letter, step in zip("xyz", steps, strict=True) if step > STEP)
    return f"Coordinates step by more than {1e3 * STEP:.0f} mm ({told}): the shape is known no better." if told else ""


def missing(result: Planned) -> str:
    """The cloud is not there any more."""
    return result.missing and f"Without cloud and surface, and cautions that need them: {result.missing}."


def few_points(result: Planned) -> str:
    """Fewer points than the surface is fitted to."""
    wanted = int(result.grasps.meta["settings"]["gpis"]["surface_points"])
    if result.cloud is None or len(result.cloud.points) >= wanted:
        return ""
    return f"The cloud has {len(result.cloud.points)} points, fewer than the {wanted} that a surface is fitted to."


def one_view(result: Planned) -> str:
    """Everything was seen from one side."""
    if result.cloud is None or len(result.cloud.view_names) > 1:
        return ""
    far = f"its far side is guessed, on average {UNSEEN_ERROR_MM} mm too near in the calibration study"
    return f"All points are of one view: if that was one camera, the object may be shallower than planned; {far}."


def table_assumed(result: Planned) -> str:
    """The table's height was not given."""
    if result.cloud is None or not any(note.startswith("Assumed the table") for note in result.cloud.notes):
        return ""
    height = f"{result.cloud.table_height:.4f} m"
    return (
        f"The table's height, {height}, is that of the lowest points; a cloud cropped above the table has it too high."
    )


def thin_walls(result: Planned) -> str:
    """Two sides of a wall are nearer than their noise lets them be told apart."""
    noise = float(result.grasps.meta["settings"]["gpis"]["surface_noise"])
    share = 0.0 if result.cloud is None else wall_share(result.cloud, WALL_NOISES * noise)
    if share < WALL_SHARE:
        return ""
    thick = f"{1e3 * WALL_NOISES * noise:.0f} mm, twice the deviation of a measured point"
    return f"{share:.0%} of the cloud lie on walls thinner than {thick}: the surface fills them, and what they hold."


def wall_share(cloud: Observation, thickness: float) -> float:
    """Share of a cloud's points that have another one on the far side of a wall thinner than `thickness` [m].

    Normals are those of the planes through the neighbours, turned to the camera that saw the point; 0 without cameras.
    """
    if cloud.camera_positions is None:
        return 0.0
    chosen = np.linspace(0, len(cloud.points) - 1, min(WALL_POINTS, len(cloud.points))).astype(int)
    P = cloud.points[chosen]  # (n, 3)
    _, near = cKDTree(cloud.points).query(P, k=min(WALL_NEIGHBOURS, len(cloud.points)))
    Q = cloud.points[near] - cloud.points[near].mean(axis=1, keepdims=True)  # (n, k, 3)
    normal = np.linalg.eigh(np.einsum("nki,nkj->nij", Q, Q))[1][:, :, 0]
    towards = cloud.camera_positions[cloud.view[chosen]] - P
    normal *= np.sign((towards * normal).sum(axis=1, keepdims=True))
    offset = P[None] - P[:, None]  # (n, n, 3), from each to every other
    distance = np.linalg.norm(offset, axis=2)
    behind = -(offset * normal[:, None]).sum(axis=2) > distance / 2
    wall = (normal @ normal.T < OPPOSITE) & (distance < thickness) & behind & behind.T
    return float(wall.any(axis=1).mean())
