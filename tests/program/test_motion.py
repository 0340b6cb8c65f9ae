"""The motion of links and the torques at the tips: against the kinematics differentiated, and numeric Pinocchio."""

import casadi as ca
import numpy as np
import pytest
from arms import rail
from finite_differences import assert_jacobian
from hands import coupled

from sgnlp.hand.arm import load_arm
from sgnlp.hand.arm_kinematics import arm_forward
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.hand.kinematics import forward, integrate, joint_torques
from sgnlp.program.lifting import Lifting
from sgnlp.program.motion import Link, Motion, free
from sgnlp.program.torques import TipTorques

HANDS = ("allegro_right", "coupled")
"""A tree of revolute joints, and one with a joint that mimics another."""


@pytest.fixture(scope="module", params=HANDS)
def hand(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Hand:
    """Each of `HANDS`."""
    if request.param == "coupled":
        return load_hand(coupled(tmp_path_factory.mktemp("hands")))
    return load_hand(request.param)


def quantities(hand: Hand, v: ca.SX, seed: tuple[np.ndarray, np.ndarray], forces: np.ndarray, lifting: Lifting | None):
    """Spheres, a direction of the palm, forces as felt by it and joint torques at seed ⊕ v, lifted or composed."""
    frames = forward(hand, ca.SX(seed[0]), ca.SX(seed[1]), v)
    links = [sphere.link for sphere in hand.spheres]
    palm = frames.rotation @ ca.SX(hand.palm)
    if lifting is None:
        torques = ca.jtimes(frames.tips, v, ca.SX(forces), True)[6:]
        return [frames.spheres, palm, torques]
    root, turns = free(frames.position, frames.rotation, lifting), lifting.displacement("turns", v[6:])
    motion = Motion(hand.model, frames, root, turns, lifting)
    spheres = motion.points("spheres", frames.spheres, links)
    felt = lifting.lift("felt", ca.SX(forces), root.felt(ca.SX(forces).T).T)
    torques = TipTorques(hand, frames, turns, lifting)(felt)
    return [spheres, lifting.lift("palm", palm, root.swing(lifting.constant("held", palm))), torques]


@pytest.mark.parametrize("at", [0, 1], ids=["at the seed", "off it"])
def test_values_and_derivatives_are_those_of_the_kinematics(hand, at):
    rng = np.random.default_rng(2 + at)
    n, m = len(hand.joint_names), len(hand.fingers)
    wrist = rng.normal(size=7)
    wrist[3:] /= np.linalg.norm(wrist[3:])
    seed, forces = (wrist, rng.uniform(hand.lower, hand.upper)), rng.normal(size=(m, 3))
    where = 0.3 * at * rng.normal(size=6 + n)
    results = []
    for lifted in (True, False):
        v = ca.SX.sym("v", 6 + n)
        chain = Lifting(v)
        parts = quantities(hand, v, seed, forces, chain if lifted else None)
        weights = np.random.default_rng(5).normal(size=sum(part.numel() for part in parts))
        energy = ca.dot(ca.DM(weights), ca.vertcat(*map(ca.vec, parts)))
        rows = ca.vertcat(*map(ca.vec, parts))
        derived = [chain.jacobian(rows), chain.hessian([energy])]
        if not lifted:
            derived = [ca.jacobian(rows, v), ca.hessian(energy, v)[0]]
        results.append([np.array(found) for found in ca.Function("f", [v], chain.values([rows, *derived]))(where)])
    for found, expected in zip(*results, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-11)
    q = integrate(hand, *seed, where)
    np.testing.assert_allclose(results[0][0][-n:, 0], joint_torques(hand, *q, forces), atol=1e-11)


def test_an_arm_moves_about_a_base_that_stands_still(tmp_path):
    """One with a joint that slides: the Hessian of its spheres is that of its kinematics, and of differences."""
    arm = load_arm(rail(tmp_path))
    q = ca.SX.sym("q", len(arm.home))
    chain, at = Lifting(q), arm_forward(arm, q)
    motion = Motion(arm.model, at, Link(ca.SX(arm.base[:3])), chain.displacement("turns", q), chain)
    spheres = motion.points("spheres", at.spheres, [sphere.link for sphere in arm.spheres])
    weights = ca.DM(np.random.default_rng(1).normal(size=spheres.shape))
    energy, composed = ca.sum1(ca.vec(weights * spheres)), ca.sum1(ca.vec(weights * at.spheres))
    f = ca.Function(
        "f", [q], chain.values([chain.gradient(energy), chain.hessian([energy]), ca.hessian(composed, q)[0]])
    )
    where = arm.home + 0.1
    _, H, expected = (np.array(found) for found in f(where))
    np.testing.assert_allclose(H, expected, atol=1e-12)
    assert_jacobian(lambda x: np.array(f(x)[0])[:, 0], H, where)


def test_no_points_are_none():
    chain = Lifting(ca.SX.sym("x"))
    arm = load_arm("panda")
    q = ca.SX(arm.home)
    motion = Motion(arm.model, arm_forward(arm, q), Link(ca.SX(3, 1)), ca.SX(7, 1), chain)
    assert motion.points("none", ca.SX(0, 3), []).shape == (0, 3)
