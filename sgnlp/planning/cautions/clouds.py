"""Cautions about a cloud: each function gives a sentence, or "" if there is no reason for one.

A cloud of one body on a table gives none.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.spatial import QhullError, cKDTree

from sgnlp.perception.cleaning import coordinate_steps
from sgnlp.perception.free_space import doubt, in_front
from sgnlp.perception.observation import Observation
from sgnlp.planning.cautions.measures import Plane, body_shares, bulge, largest_plane, outside, sample, seen_sides
from sgnlp.planning.cautions.planned import Planned
from sgnlp.surface.hull import cameras_of

GAP, BODY_SHARE = 0.02, 0.03
"""Groups of points farther apart than this [m], with at least this share of the points, are separate bodies. Occlusion
splits the cloud of one body by smaller gaps, on the problem set and on real clouds."""
PLANE_THICKNESS, PLANE_MARGIN = 0.004, 0.01
"""Points within the first distance of a plane lie on it (twice a depth camera's noise); feet are at least the second
distance inside its edge [m]."""
PLANE_INSIDE, PLANE_RATIO = 0.95, 1.5
"""A table or wall has at least this share of the other points inside its outline, which is this many times as wide. The
closest good cloud is that of the toy plane's wings, with a share of 0.92."""
TABLE_NEAR = 0.02
"""A level plane within this of the table's height is the table [m]."""
TABLE_FLAT, TABLE_BESIDE, TABLE_SHARE = 0.004, 0.01, 0.002
"""Points within the first distance of the table's height, and this far outside the outline of all that is higher [m],
are the table's. 98 simulated and 5 real clouds without a table have a share of at most 0.0003."""
CAMERA_ANGLE, CAMERA_BULGE, CAMERA_DISTANCE = 35.0, 0.5, 0.15
"""A cloud in a camera's own frame lies within half a field of view [deg] of ±z, no nearer than cameras measure [m], and
bulges towards the origin with this correlation."""
TOP_SEEN, UNDERSIDE_SEEN = 0.6, 0.9
"""Cameras above a table see more than the first share of the top, or less than the second of the underside. The closest
good cloud, a toy plane, has 0.47 and 0.82."""
TABLE_GAP = 0.03
"""A cloud that begins higher than this above its table [m] leaves a gap as large as a fingertip."""
STEP = 0.002
"""Coordinates rounded to steps above this [m] are as inexact as the tolerance of a contact."""
UNSEEN_ERROR_MM = 4.5
"""Mean error of the surface on the side that one camera does not see (`results/calibration`)."""
APART, APART_SHARE = 0.012, 0.05
"""Views do not fit each other if more than this share of one's points lie this far [m] before the surface that another
one measured. On the problem set at most 0.025 do; with a view shifted by 2 cm more than this share on 77 of 98."""
WALL_NOISES = 2.0
"""Walls thinner than this many deviations of a measured point cannot be distinguished from a single surface."""
WALL_SHARE = 0.1
"""Share of the points that must lie on such walls: edges and corners of solid bodies have up to 3 %, a cup 35 %."""
WALL_POINTS, WALL_NEIGHBOURS = 500, 60
"""Number of points that are examined, and of neighbours that give a point's normal."""
OPPOSITE = -0.8
"""Largest cosine between the normals of the two sides of a wall."""


def bodies(cloud: Observation, result: Planned) -> str:
    """Several groups of points."""
    shares = body_shares(sample(cloud.points), GAP)
    shares = shares[shares >= BODY_SHARE]
    told = " and ".join(f"{share:.0%}" for share in shares)
    far = f"more than {1e3 * GAP:.0f} mm apart ({told} of the points)"
    return f"The cloud has {len(shares)} clusters {far}: {_part(cloud)}." if len(shares) > 1 else ""


@lru_cache(maxsize=1)
def plane_of(cloud: Observation) -> Plane:
    """The plane of most points, which several cautions ask for."""
    return largest_plane(sample(cloud.points), PLANE_THICKNESS, PLANE_MARGIN)


def plane(cloud: Observation, result: Planned) -> str:
    """A table or a wall in the cloud."""
    found = plane_of(cloud)
    if found.inside < PLANE_INSIDE or found.ratio < PLANE_RATIO:
        return ""
    level = abs(found.normal[2]) > np.cos(np.radians(10)) and found.height < cloud.table_height + TABLE_NEAR
    what = "A plane at the table's height" if level else "A plane, such as a wall or a table,"
    wider = f"and is {found.ratio:.1f} times as wide as what stands on it"
    return f"{what} holds {found.share:.0%} of the points, {wider}: {_part(cloud)}."


def table_around(cloud: Observation, result: Planned) -> str:
    """A ring or a patch of the table around the object."""
    height = cloud.points[:, 2] - cloud.table_height
    low = height <= TABLE_FLAT
    try:
        away = outside(cloud.points[~low, :2], cloud.points[low, :2]) if low.any() else np.zeros(0)
    except (QhullError, ValueError):  # nothing is higher
        return ""
    count = int((away > TABLE_BESIDE).sum())
    if count <= TABLE_SHARE * len(cloud.points) or plane(cloud, result):
        return ""
    where = f"lie at the table's height, more than {1e3 * TABLE_BESIDE:.0f} mm beside all that is higher"
    return f"{count} of {len(cloud.points)} points {where}: if they are the table, cut them off."


def _part(cloud: Observation) -> str:
    """How to take one object out of a cloud."""
    return f"take one object out of it by `sgnlp cloud {cloud.source or 'FILE'}`"


def camera_frame(cloud: Observation, result: Planned) -> str:
    """Coordinates in a camera's own frame."""
    points = sample(cloud.points)
    middle = points.mean(axis=0)
    distance, width = float(np.linalg.norm(middle)), float(np.ptp(points, axis=0).max())
    if cloud.camera_positions is not None or distance < max(CAMERA_DISTANCE, width):
        return ""
    angle = np.degrees(np.arccos(abs(middle[2]) / distance))
    if angle > CAMERA_ANGLE or bulge(points) < CAMERA_BULGE:
        return ""
    axis = "z" if middle[2] > 0 else "-z"
    seen = f"the cloud lies {100 * distance:.0f} cm along {axis} and bulges towards the origin"
    return f"The coordinates may be those of a camera's frame: {seen}. If they are, give the camera's --pose."


def underside(cloud: Observation, result: Planned) -> str:
    """Another axis up, or a camera's frame."""
    if cloud.camera_positions is not None or camera_frame(cloud, result) or plane(cloud, result):
        return ""
    top, bottom = seen_sides(sample(cloud.points))
    if top > TOP_SEEN or bottom < UNDERSIDE_SEEN:
        return ""
    seen = f"The cameras saw {bottom:.0%} of the underside and {top:.0%} of the top"
    return f"{seen}: unless the object is a bowl, another axis may be up (--up), or the frame a camera's (--pose)."


def in_the_air(cloud: Observation, result: Planned) -> str:
    """Nothing near the table."""
    gap = float(cloud.points[:, 2].min()) - cloud.table_height
    begins = f"The cloud begins {1e3 * gap:.0f} mm above the table, more than {1e3 * TABLE_GAP:.0f} mm"
    return f"{begins}: the plan takes what is between for solid." if gap > TABLE_GAP else ""


def thin(cloud: Observation, result: Planned) -> str:
    """A body that ends below the pads' radius."""
    radius = min(finger.radius for finger in result.hand.fingers)
    height = float(cloud.points[:, 2].max()) - cloud.table_height
    low = f"The object ends {1e3 * height:.0f} mm above the table, below the pads' radius of {1e3 * radius:.0f} mm"
    return f"{low}: fingertips cannot oppose each other on it." if height < radius else ""


def rounded(cloud: Observation, result: Planned) -> str:
    """Coordinates on a lattice."""
    steps = zip("xyz", coordinate_steps(cloud.points), strict=True)
    told = ", ".join(f"{letter} {1e3 * step:.1f} mm" for letter, step in steps if step > STEP)
    return f"The coordinates step by more than {1e3 * STEP:.0f} mm ({told}): the shape is no finer." if told else ""


def few_points(cloud: Observation, result: Planned) -> str:
    """Fewer points than the surface is fitted to."""
    count, wanted = len(cloud.points), int(_fitted(result)["surface_points"])
    few = f"The cloud has {count} points, fewer than the {wanted} that a surface is fitted to."
    return few if count < wanted else ""


def one_view(cloud: Observation, result: Planned) -> str:
    """Everything was seen from one side."""
    far = f"on average {UNSEEN_ERROR_MM:g} mm off where the camera's place is known (results/calibration)"
    one = f"One view has all the points: the far side of the object is guessed, {far}."
    return one if len(cloud.view_names) == 1 else ""


def table_assumed(cloud: Observation, result: Planned) -> str:
    """The table's height was not given."""
    assumed = any(note.startswith("Assumed the table") for note in cloud.notes)
    lowest = f"The table's height, {cloud.table_height:.4f} m, is that of the lowest points"
    return f"{lowest}: it is too high if the cloud was cropped above the table." if assumed else ""


def cameras(cloud: Observation, result: Planned) -> str:
    """Cameras that cannot have stood at their given positions; with free space the fit has checked them already."""
    why = "" if result.grasps.meta.get("free_space") else doubt(cameras_of(cloud))
    return f"The camera positions are wrong: {why}. What the cameras saw through is not used." if why else ""


def views_apart(cloud: Observation, result: Planned) -> str:
    """A view that is shifted against another one, by a wrong pose."""
    if cloud.camera_positions is None or doubt(cameras_of(cloud)):
        return ""
    share = in_front(cloud.points, cloud.view, cloud.camera_positions, APART)
    before = f"{share:.0%} of one view's points lie more than {1e3 * APART:.0f} mm before what another view measured"
    return f"{before}: the surface is doubled; look at the cameras' poses." if share > APART_SHARE else ""


def thin_walls(cloud: Observation, result: Planned) -> str:
    """The two sides of a wall are closer together than the noise allows to distinguish."""
    thickness = WALL_NOISES * float(_fitted(result)["surface_noise"])
    share = wall_share(cloud, thickness)
    thin = f"{share:.0%} of the points lie on walls thinner than {1e3 * thickness:.0f} mm, twice the noise of a point"
    return f"{thin}: the fitted surface cannot part their two sides." if share >= WALL_SHARE else ""


def _fitted(result: Planned) -> dict[str, Any]:
    """The settings of the training set of the surface."""
    meta = result.grasps.meta
    found: dict[str, Any] = meta["settings"]["free_space" if meta.get("free_space") else "gpis"]
    return found


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
