"""Grasps made by hand of bodies made by hand: pads around a body at one height, the thumb against the fingers."""

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares
from scipy.spatial import ConvexHull

from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import frames
from sgnlp.simulation import Body, Command, body

OPEN = 0.015
"""Gap between a pad and the surface at the pregrasp [m]."""
PRESS = 3.0
"""Force of each finger that is not the thumb, where pads touch [N]."""
REACH = np.array([0.05, 0.05, 0.05, 0.5, 0.5, 0.5])
"""How far the wrist may be from where the search for it begins [m], [rad]."""
GAINS = np.array([200.0, 200.0, 200.0, 400.0])


def sphere(radius: float = 0.035, levels: int = 24) -> Body:
    circles = [(radius * np.sin(a), radius * (1 - np.cos(a))) for a in np.pi * (np.arange(levels) + 0.5) / levels]
    return convex(np.concatenate([circle(r, z) for r, z in circles]))


def cylinder(radius: float = 0.033, height: float = 0.08) -> Body:
    return convex(np.concatenate([circle(radius, 0.0), circle(radius, height)]))


def box(x: float = 0.06, y: float = 0.09, z: float = 0.08) -> Body:
    return convex(np.array([(i, j, k) for i in (-x / 2, x / 2) for j in (-y / 2, y / 2) for k in (0, z)]))


def circle(radius: float, height: float, sides: int = 64) -> np.ndarray:
    angle = 2 * np.pi * np.arange(sides) / sides
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(sides, height)])


def convex(points: np.ndarray) -> Body:
    """The hull of points (V, 3), all of them corners, its faces turned outwards."""
    hull = ConvexHull(points)
    a, b, c = np.moveaxis(points[hull.simplices], 1, 0)
    inwards = np.einsum("fi,fi->f", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    return body(points, np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices))


def ring(radius: float, height: float, spread: float = 0.7) -> tuple[np.ndarray, np.ndarray]:
    """Points (4, 3) [m] and outward normals of a round body: three fingers `spread` [rad] apart, the thumb across."""
    angles = np.array([-spread, 0.0, spread, np.pi])
    normals = np.stack([np.cos(angles), np.sin(angles), np.zeros(4)], axis=1)
    return radius * normals + [0, 0, height], normals


def faces(x: float, height: float, spread: float = 0.03) -> tuple[np.ndarray, np.ndarray]:
    """The same on two opposite faces of a box, x [m] apart."""
    normals = np.array([(1.0, 0, 0)] * 3 + [(-1.0, 0, 0)])
    return normals * x / 2 + [(0, y, height) for y in (-spread, 0, spread, 0)], normals


def grip(hand: Hand, points: np.ndarray, normals: np.ndarray, gains: np.ndarray = GAINS) -> Command:
    """The command whose pads stand `OPEN` before the points and would press there with balanced forces."""
    radius = hand.fingers[0].radius
    centres = points + radius * normals
    press = np.full(4, PRESS)
    press[3] = PRESS * -(normals[:3] @ normals[3]).sum()
    wrist, joints = _inverse(hand, centres + OPEN * normals)
    targets = centres - (press / gains)[:, None] * normals
    return Command(
        wrist=wrist,
        joints=joints,
        tips=frames(hand, wrist, joints)[0],
        targets=targets,
        gains=gains,
        contacts_eq=centres,
        forces_eq=-press[:, None] * normals,
        rotation_eq=np.eye(3),
        translation_eq=np.zeros(3),
    )


def _inverse(hand: Hand, tips: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A wrist above the tips, palm down, and joints near the reference that reach them."""
    begin = np.array([-0.06, 0.0, tips[:, 2].mean() + 0.1, 0, 0, 0])
    down = pin.utils.rotate("y", np.pi / 2)  # fingers along x, palm down

    def place(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turn = pin.Quaternion(pin.exp3(x[3:6]) @ down).coeffs()
        return np.concatenate([x[:3], turn]), x[6:]

    def residual(x: np.ndarray) -> np.ndarray:
        reached, _ = frames(hand, *place(x))
        rest = np.concatenate([0.01 * (x[:6] - begin), 2e-3 * (x[6:] - hand.reference)])
        return np.concatenate([(reached - tips).ravel(), rest])

    lower = np.concatenate([begin - REACH, hand.lower])
    upper = np.concatenate([begin + REACH, hand.upper])
    solution = least_squares(
        residual, np.concatenate([begin, hand.reference - 1e-3]), bounds=(lower, upper), x_scale=0.1
    )
    return place(solution.x)
