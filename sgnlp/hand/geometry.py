"""Distances [m] that show whether a hand's description fits its meshes, itself and an object."""

import casadi as ca
import numpy as np
import pinocchio as pin
from scipy.spatial.distance import cdist

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.hand.hand_file import Finger
from sgnlp.hand.kinematics import forward, frames
from sgnlp.hand.meshes import link_meshes, link_poses, mesh_links
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.truth import surface_samples

ORIGIN = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
FACE_POINTS = 1000
"""Number of random points on the faces of a mesh, besides its vertices: long faces have no vertex in the middle."""


def protrusions(hand: Hand) -> dict[str, float]:
    """Largest distance [m] of each link's meshes outside all spheres at the reference pose; negative if inside."""
    centres, radii = frames(hand, ORIGIN, hand.reference)[1], np.array([sphere.radius for sphere in hand.spheres])
    found: dict[str, float] = {}
    for name, points in _skin(hand):
        outside = (cdist(points, centres) - radii).min(axis=1)
        found[name] = max(found.get(name, -np.inf), float(outside.max()))
    return found


def _skin(hand: Hand) -> list[tuple[str, Array]]:
    """For each mesh, its link and its `surface_points` (K, 3) [m] at the reference pose, in the root link's frame."""
    meshes = zip(mesh_links(hand), link_meshes(hand)[0], link_poses(hand, ORIGIN, hand.reference), strict=True)
    return [(link, surface_points(mesh, FACE_POINTS) @ T[:3, :3].T + T[:3, 3]) for link, mesh, T in meshes]


def surface_points(mesh: Mesh, count: int) -> Array:
    """The vertices of a mesh and `count` points drawn evenly from its area (U + count, 3) [m], always the same."""
    return np.vstack([mesh.vertices, surface_samples(mesh, count, np.random.default_rng(0))[0]])


def tips(hand: Hand) -> Array:
    """The tips (m, 3) [m] at the reference pose, in the root link's frame."""
    return frames(hand, ORIGIN, hand.reference)[0]


def finger_bases(hand: Hand) -> Array:
    """Position (m, 3) [m] of each finger's first joint that does not move all fingers, at the reference pose."""
    data = hand.model.createData()
    pin.forwardKinematics(hand.model, data, hand.reference)
    lines = [_own_joints(hand, finger) for finger in hand.fingers]
    return np.array([data.oMi[line[0]].translation for line in lines])


def _own_joints(hand: Hand, finger: Finger) -> list[int]:
    """The joints of the model that move a finger's tip and not all tips, root first; the last one if there is none."""
    model = hand.model
    line, *others = (
        list(model.supports[model.frames[model.getFrameId(one.frame, pin.FrameType.BODY)].parentJoint])
        for one in (finger, *hand.fingers)
    )
    own = [joint for joint in line if not all(joint in other for other in others)]
    return own or line[-1:]


def pad_gaps(hand: Hand) -> Array:
    """Distance (m,) [m] of each finger's pad from the finger's meshes at the reference pose; negative inside them.

    A finger without meshes is assumed to extend beyond its tip's link by the length of its longest bone.
    """
    skin, gaps = _skin(hand), []
    for finger, pad in zip(hand.fingers, tips(hand), strict=True):
        own = set(_own_joints(hand, finger))
        links = {frame.name for frame in hand.model.frames if frame.parentJoint in own}
        distances = [np.linalg.norm(points - pad, axis=1).min() for link, points in skin if link in links]
        bare = np.linalg.norm(finger.offset) - _longest_bone(hand, finger)
        gaps.append(float(min(distances, default=bare)) - finger.radius)
    return np.array(gaps)


def _longest_bone(hand: Hand, finger: Finger) -> float:
    """The largest distance [m] between a joint of a finger and the next, or the tip's link, at the reference pose."""
    data, frame = hand.model.createData(), hand.model.getFrameId(finger.frame, pin.FrameType.BODY)
    pin.framesForwardKinematics(hand.model, data, hand.reference)
    places = [*(data.oMi[j].translation for j in _own_joints(hand, finger)), data.oMf[frame].translation]
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).max())


def sphere_gaps(hand: Hand) -> dict[str, float]:
    """Distance [m] of each sphere from the meshes that move with its link, by its name; negative where it meets them.

    Spheres on links without such a mesh are left out.
    """
    model = hand.model
    joints = {frame.name: frame.parentJoint for frame in model.frames if frame.type == pin.FrameType.BODY}
    skin = [(joints[link], points) for link, points in _skin(hand)]
    centres, gaps = frames(hand, ORIGIN, hand.reference)[1], dict[str, float]()
    for sphere, centre in zip(hand.spheres, centres, strict=True):
        own = [np.linalg.norm(points - centre, axis=1).min() for joint, points in skin if joint == joints[sphere.link]]
        if own:
            gaps[sphere.name] = float(min(own)) - sphere.radius
    return gaps


def pair_gaps(hand: Hand) -> Array:
    """The distances (P,) between the spheres of each pair at the reference pose; negative where they overlap."""
    centres = frames(hand, ORIGIN, hand.reference)[1]
    gaps = [
        np.linalg.norm(centres[i] - centres[j]) - hand.spheres[i].radius - hand.spheres[j].radius for i, j in hand.pairs
    ]
    return np.array(gaps, float)


def start_offsets(hand: Hand, edge: float) -> Array:
    """For each wrist start, the distance (W,) [m] of the tips' middle from that of a cube with this edge [m]."""
    extents = np.full(3, edge)
    poses = [start.pose(np.zeros(3), extents) for start in hand.wrist_starts]
    return np.linalg.norm([frames(hand, pose, hand.reference)[0].mean(axis=0) for pose in poses], axis=1)


def kinematics_error(hand: Hand, samples: int, seed: int = 0) -> float:
    """The largest difference [m] between symbolic and numeric tips and spheres, at random poses."""
    n = len(hand.joint_names)
    symbols = ca.SX.sym("wrist", 7), ca.SX.sym("joints", n), ca.SX.sym("v", 6 + n)
    f = forward(hand, *symbols)
    points = ca.Function("points", list(symbols), [ca.vertcat(f.tips, f.spheres)])
    rng, worst = np.random.default_rng(seed), 0.0
    for _ in range(samples):
        wrist, joints = _random_pose(rng), rng.uniform(hand.lower, hand.upper)
        found = np.array(points(wrist, joints, np.zeros(6 + n)))
        worst = max(worst, float(np.abs(found - np.vstack(frames(hand, wrist, joints))).max()))
    return worst


def _random_pose(rng: np.random.Generator) -> Array:
    """A pose (7,) within 1 m of the origin, in any orientation."""
    quaternion = rng.normal(size=4)
    return np.concatenate([rng.uniform(-1, 1, 3), quaternion / np.linalg.norm(quaternion)])
