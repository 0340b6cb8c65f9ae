"""The arm that carries the hand: its joints at the pregrasp, at the stand-off, and with the object lifted.

    FK(q) = (R, p),   FK(q_s) = (R, p - l R a),   FK(q_l) = (R, p + h e_z)

(R, p) is the wrist pose, that of the hand's root link, a the direction that the palm faces, l the stand-off, h the
lift. The arm's joints are variables besides the wrist's coordinates, and these equations are rows. So the arm makes no
expression of the grasp longer. The arm stands still while the fingers close: its posture at first contact is that of
the pregrasp.
"""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from sgnlp.hand.arm import Arm
from sgnlp.hand.arm_kinematics import ArmFrames, arm_forward, log_manipulability, manipulability
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import Frames, quaternion_matrix
from sgnlp.hand.model import coordinates
from sgnlp.program import equilibrium
from sgnlp.program.lifting import Lifting
from sgnlp.program.motion import Link, Motion

UNIT = 0.2
"""[rad] unit of the scaled variables: it moves the hand by about 10 cm."""
LEVER = 0.1
"""[m] A turn of the hand's root link by 1 rad counts as this distance, about that of a fingertip from it."""
POSTURES = 3
"""The arm's postures: at the pregrasp, at the stand-off, and with the object lifted."""
BETWEEN = 2
"""Fewest joints between a link and the flange with which the hand can come near the link."""


@dataclass(frozen=True)
class Carried:
    """An arm with a joints and A spheres that can reach the table, F of which the hand can touch."""

    joints: Any  # (a,) [rad] at the pregrasp and at first contact
    standoff: Any  # (a,) [rad]
    lift: Any  # (a,) [rad]
    home: Any  # (a,) [rad]
    clearances: Any  # (3 A,) [m] clearance from obstacles, table and object, posture by posture
    pair_clearances: Any  # (P,) [m] between the arm's own spheres
    hand_clearances: Any  # (H F,) [m] between the far spheres and each of the palm's spheres in turn
    # (6,) [m] error in position and rotation of the hand on the flange at the pregrasp, against the wrist
    wrist_error: Any
    standoff_error: Any  # (6,) [m] the same at the stand-off, against the straight way
    lift_error: Any  # (6,) [m]
    dexterity: Any  # () log of the manipulability over that at home


def far_spheres(arm: Arm) -> list[int]:
    """Indices of the F free spheres on links that the hand can touch."""
    most = len(arm.joint_names) - BETWEEN
    links = [arm.model.getFrameId(s.link, pin.FrameType.BODY) for s in arm.spheres]
    return [i for i in arm.free_spheres if len(coordinates(arm.model, links[i])) <= most]


def near_spheres(hand: Hand) -> list[int]:
    """Indices of the H spheres of the palm, which represent the hand in the check against its own arm."""
    return [i for i, s in enumerate(hand.spheres) if s.link == hand.root]


class ArmModel:
    """The symbolic arm of a hand, for variables x that begin with the arm's, in rad.

    `spheres` (3 A, 3) [m] are the free spheres, posture by posture.
    """

    def __init__(self, hand: Hand, lifting: Lifting, par: SimpleNamespace, frames: Frames, root: Link, x: ca.SX):
        assert hand.arm is not None
        self._arm, self._hand, self._lifting = hand.arm, hand, lifting
        # a parameter, so that no scene needs its own program
        self._base = quaternion_matrix(par.base[3:]), par.base[:3]
        self._joints = ca.vertsplit(x[: POSTURES * len(hand.arm.joint_names)], len(hand.arm.joint_names))
        self._wrist, self._root = frames, root
        self._centre = lifting.lift("wrist", frames.position, root.shift)
        self._places = [self._placed(q) for q in self._joints]
        self._count, near = len(hand.arm.spheres), near_spheres(hand)
        first = self._places[0]  # the palm is rigid with the flange
        palm = [(first.frames.position + first.frames.rotation @ ca.SX(hand.spheres[i].centre)).T for i in near]
        self._palm = first.motion.points("palm_spheres", ca.vertcat(ca.SX(0, 3), *palm), [hand.arm.flange] * len(near))
        self.spheres = ca.vertcat(*[place.spheres[hand.arm.free_spheres, :] for place in self._places])

    def state(self, par: SimpleNamespace, distances: ca.SX) -> Carried:
        """The arm, with the distances (3 A,) [m] of its spheres from the surroundings."""
        arm, s = self._arm, self._places[0].spheres
        radii = np.array([sphere.radius for sphere in arm.spheres])
        first, second = [i for i, _ in arm.pairs], [j for _, j in arm.pairs]
        far, near = far_spheres(arm), near_spheres(self._hand)
        ahead = self._root.direction("ahead", self._wrist.rotation @ ca.SX(self._hand.palm), self._lifting)
        up = ca.vertcat(0, 0, par.lift)
        goals = [self._centre + by for by in (ca.SX(3, 1), -par.standoff * ahead, up)]
        errors = [self._error(place, goal) for place, goal in zip(self._places, goals, strict=True)]
        palm = self._palm
        gaps = [
            _lengths(s[far, :] - ca.repmat(palm[k, :], len(far), 1)) - radii[far] - self._hand.spheres[i].radius
            for k, i in enumerate(near)
        ]
        return Carried(
            joints=self._joints[0],
            standoff=self._joints[1],
            lift=self._joints[2],
            home=arm.home,
            clearances=distances - np.tile(radii[arm.free_spheres], POSTURES),
            pair_clearances=_lengths(s[first, :] - s[second, :]) - radii[first] - radii[second],
            hand_clearances=ca.vertcat(*gaps),
            wrist_error=errors[0],
            standoff_error=errors[1],
            lift_error=errors[2],
            dexterity=self._dexterity(),
        )

    def _placed(self, q: ca.SX) -> "_Placed":
        """The arm at joints q (a,)."""
        arm, lifting = self._arm, self._lifting
        at = arm_forward(arm, q, self._base, self._hand.kinematics)
        motion = Motion(arm.model, at, Link(self._base[1]), lifting.displacement("arm_turns", q), lifting)
        spheres = motion.points("arm", at.spheres, [sphere.link for sphere in arm.spheres])
        return _Placed(at, motion, spheres, motion.points("flange", at.position.T, [arm.flange]).T)

    def _dexterity(self) -> ca.SX:
        home = float(np.log(manipulability(self._arm, self._arm.home)))
        return log_manipulability(self._arm, self._joints[0], self._hand.kinematics) - home

    def _error(self, place: "_Placed", goal: ca.SX) -> ca.SX:
        """Error (6,) [m] in position against a goal and in rotation against the wrist; a small turn θ counts LEVER
        θ."""
        off = place.frames.rotation @ self._wrist.rotation.T
        held = self._lifting.constant("off", off)
        turned = (held + place.motion.of(self._arm.flange).swing(held)).T
        turned = (turned + self._root.swing(turned)).T  # E(ω) Q E(-ω'): the wrist turns too
        turn = self._lifting.lift("turn_off", equilibrium.gibbs_vector(off), equilibrium.gibbs_vector(turned))
        return ca.vertcat(place.flange - goal, 2 * LEVER * turn)


@dataclass(frozen=True)
class _Placed:
    """An arm in a posture: its spheres (S, 3) and the position (3,) of the hand's root link, lifted quantities."""

    frames: ArmFrames
    motion: Motion
    spheres: ca.SX
    flange: ca.SX


def _lengths(rows: ca.SX) -> ca.SX:
    return ca.sqrt(ca.sum2(rows**2))
