"""Grasps in the plane: equilibrium against SVD and zero net force, torques against statics, the program by hand."""

from dataclasses import replace

import numpy as np
import pytest

from sgnlp.experiments.studies.planar import (
    Demands,
    Finger,
    PlanarGrasp,
    Stage,
    cross,
    equilibrium,
    holds,
    least_torque,
    turn,
)

FREE = Demands(friction=0.5, force=1.0, gains=(1.0, 1000.0), stiffness=0.01)
SIDES = np.array([[1.0, 0.0], [-1.0, 0.0]])
"""Two contacts on opposite sides of an object 2 m wide; their outward normals are the same vectors."""


def springs(seed: int, m: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(m, 2)), rng.normal(size=(m, 2)), rng.uniform(1, 10, m)


def energy(pose: np.ndarray, P: np.ndarray, O: np.ndarray, k: np.ndarray) -> float:
    return float(k @ ((P @ turn(pose[0]).T + pose[1:] - O) ** 2).sum(axis=1) / 2)


def pinch(points: np.ndarray = SIDES, normals: np.ndarray = SIDES, arms: float = 1.0) -> Stage:
    """Contacts whose finger i has the joint torques `arms` f_x and f_y."""
    return Stage(points, normals, np.array([np.diag([arms, 1.0])] * len(points)))


@pytest.mark.parametrize("seed", range(5))
def test_the_equilibrium_is_that_of_the_singular_value_decomposition(seed):
    P, O, k = springs(seed)
    p, o = np.average(P, axis=0, weights=k), np.average(O, axis=0, weights=k)
    U, s, Vt = np.linalg.svd((k[:, None] * (O - o)).T @ (P - p))
    sign = np.sign(np.linalg.det(U @ Vt))
    angle, t, stiffness = equilibrium(P, O, k)
    assert turn(angle) == pytest.approx(U @ np.diag([1, sign]) @ Vt)
    assert stiffness == pytest.approx(s[0] + sign * s[1])
    assert t == pytest.approx(o - turn(angle) @ p)


@pytest.mark.parametrize("seed", range(5))
def test_at_the_equilibrium_no_force_and_no_torque_is_left(seed):
    P, O, k = springs(seed)
    angle, t, _ = equilibrium(P, O, k)
    at = P @ turn(angle).T + t
    f = k[:, None] * (O - at)
    assert np.abs(f.sum(axis=0)).max() < 1e-12
    assert abs(cross(at, f).sum()) < 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_the_stiffness_is_the_curvature_of_the_energy_over_the_angle(seed):
    P, O, k = springs(seed)
    angle, t, stiffness = equilibrium(P, O, k)
    h, p = 1e-4, np.average(P, axis=0, weights=k)
    about = [np.r_[angle + d, t + turn(angle) @ p - turn(angle + d) @ p] for d in (-h, 0, h)]  # turned about p̄
    low, middle, high = (energy(pose, P, O, k) for pose in about)
    assert (low - 2 * middle + high) / h**2 == pytest.approx(stiffness, rel=1e-4)
    assert min(low, high) > middle


def test_the_torques_of_a_finger_are_those_of_virtual_work():
    finger, h = Finger((0.2, -0.3), (0.7, 0.5), -1), 1e-6

    def tip(q: np.ndarray) -> np.ndarray:
        links = np.array([[np.cos(q[0]), np.cos(q[0] + q[1])], [np.sin(q[0]), np.sin(q[0] + q[1])]])
        return finger.base + links @ finger.links

    q = np.array([0.8, -1.1])  # the elbow's sign is that of the second angle
    J = np.stack([(tip(q + h * e) - tip(q - h * e)) / (2 * h) for e in np.eye(2)], axis=1)
    assert finger.torques(tip(q)) == pytest.approx(J.T, abs=1e-8)
    assert replace(finger, elbow=1).torques(tip(q))[1] != pytest.approx(J.T[1], abs=1e-2)


def test_a_tip_out_of_reach_has_no_torques():
    finger = Finger((0, 0), (0.7, 0.5), 1)
    assert finger.torques(np.array([1.21, 0])) is None
    assert finger.torques(np.array([0.1, 0])) is None
    assert finger.torques(np.array([1.19, 0])) is not None


def test_two_fingers_pinch_with_the_least_force():
    grasp = least_torque([pinch()], FREE)
    assert grasp.torque == pytest.approx(1)
    assert grasp.forces == pytest.approx(np.array([[-1, 0], [1, 0]]), abs=1e-7)
    assert holds(grasp, [pinch()], FREE)
    assert [least_torque([pinch(arms=arms)], FREE).torque for arms in (3.0, -3.0)] == pytest.approx([3, 3])
    assert least_torque([pinch()], replace(FREE, force=5.0)).torque == pytest.approx(5)


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("tilted", [[1, 0], [0, 1], [1, 1], [1, -1]])
def test_force_closure_fails_where_the_line_between_two_contacts_leaves_a_cone(sign, tilted):
    def stage(angle: float) -> Stage:
        return pinch(normals=np.stack([turn(angle * t) @ n for t, n in zip(tilted, SIDES, strict=True)]))

    limit = sign * np.arctan(0.5)
    grasp = least_torque([stage(0.99 * limit)], FREE)
    assert holds(grasp, [stage(0.99 * limit)], FREE)
    assert least_torque([stage(1.01 * limit)], FREE) is None
    assert not holds(grasp, [stage(1.01 * limit)], replace(FREE, force=0.5))  # friction alone is what it lacks


@pytest.mark.parametrize("seed", range(10))
def test_three_fingers_hold_in_balance_with_the_torque_that_they_need(seed):
    rng = np.random.default_rng(seed)
    around = np.array([0, 2, 4]) * np.pi / 3 + rng.uniform(-0.3, 0.3, 3)
    normals = np.stack([np.cos(around), np.sin(around)], axis=1)
    points = normals * rng.uniform(0.8, 1.2, (3, 1)) + rng.normal(size=2)  # about any origin
    stage = Stage(points, normals, rng.normal(size=(3, 2, 2)))
    grasp = least_torque([stage], FREE)
    assert holds(grasp, [stage], FREE)
    assert np.abs(grasp.forces.sum(axis=0)).max() < 1e-8
    assert abs(cross(points, grasp.forces).sum()) < 1e-8
    assert grasp.torque == pytest.approx(np.abs(np.einsum("mij,mj->mi", stage.torques, grasp.forces)).max())


def test_two_contacts_on_one_side_are_no_grasp():
    points = np.array([[1.0, 0.5], [1.0, -0.5]])
    assert least_torque([pinch(points, np.array([[1.0, 0.0]] * 2))], FREE) is None


def test_springs_too_soft_for_the_force_are_no_equilibrium():
    """The pinch of width 2 r and force f is stable where 2 k r² > 2 f r."""
    strong = replace(FREE, force=5.0)
    assert least_torque([pinch()], replace(strong, gains=(1.0, 4.9))) is None
    grasp = least_torque([pinch()], replace(strong, gains=(1.0, 5.1)))
    assert grasp is not None
    assert holds(grasp, [pinch()], strong)
    assert not holds(replace(grasp, gains=grasp.gains * 0.95), [pinch()], strong)


@pytest.mark.parametrize("force", [5.0, 50.0])
def test_the_stiffness_of_unequal_gains_is_the_true_one(force):
    """About the middle k and 1 N/m of the pinch count k + 1, which is enough at once; truly they have 4 k/(k + 1)."""
    strong = replace(FREE, force=force, gains=(1.0, 1000.0))
    grasp = least_torque([pinch()], strong)
    targets = SIDES + grasp.forces / grasp.gains[:, None]
    assert equilibrium(SIDES, targets, grasp.gains)[2] >= strong.stiffness * (1 - 1e-6)
    assert 4 * np.prod(grasp.gains) / grasp.gains.sum() >= 2 * force


def test_a_motion_is_reached_by_its_own_springs_and_kept_in_the_cones_all_the_way():
    ways = [pinch(SIDES + np.array([shift, 0.0])) for shift in (-0.02, -0.01, 0.0)]
    soft = replace(FREE, force=5.0, gains=(10.0, 200.0))
    grasp = least_torque(ways, soft)
    assert holds(grasp, ways, soft)
    pulled = grasp.gains * 0.02  # at the start the left finger pulls that much more, the right one less
    assert grasp.torque == pytest.approx(np.abs(grasp.forces[:, 0] + pulled).max())
    assert not holds(grasp, ways[1:], replace(soft, force=5.1))
    wrong = [*ways[:-1], pinch(SIDES + np.array([0.01, 0.0]))]
    assert not holds(grasp, wrong, soft)


def test_a_finger_may_not_pull_at_the_start():
    far = [pinch(SIDES - [1.0, 0.0]), pinch()]
    assert (
        least_torque(far, replace(FREE, gains=(2.0, 1000.0))) is not None
    )  # presses 2 N more here: the other 2 N less
    grasp = least_torque(far, replace(FREE, gains=(2.0, 1000.0)))
    start = grasp.forces + grasp.gains[:, None] * (far[1].points - far[0].points)
    assert (-(start * far[0].normals).sum(axis=1)).min() >= -1e-9


@pytest.mark.parametrize("broken", ["forces", "torque"])
def test_a_grasp_that_is_tampered_with_does_not_hold(broken):
    grasp = least_torque([pinch()], FREE)
    change = {"forces": grasp.forces * [[1, 1], [1, -2]] + [0, 0.1], "torque": grasp.torque * 0.9}
    assert not holds(replace(grasp, **{broken: change[broken]}), [pinch()], FREE)
    assert isinstance(grasp, PlanarGrasp)
