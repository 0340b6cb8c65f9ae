"""The motion of the links of a hand or arm about their present poses, to second order: six numbers for each link.

A link's motion (v, ω) moves the point O + r to O + r + v + (E(ω) - I) r. O is a point that all links of a tree share,
W = [ω]×, and E(ω) = I + W + W²/2 is the exponential to second order. A joint that turns by δ about the axis a through
O + ρ gives, with the motion λ of the link before and m = a×ρ,

    v = v_λ - δ m - δ ω_λ×m - ½ δ² a×m,     ω = ω_λ + δ a + ½ δ ω_λ×a,

and a prismatic joint along a gives v = v_λ + δ a + δ ω_λ×a. Positions come from Pinocchio. The derivatives come from
these formulas, so no derivative of the forward kinematics is longer than they are.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import pinocchio as pin

from sgnlp.hand.arm_kinematics import ArmFrames
from sgnlp.hand.kinematics import Frames
from sgnlp.program.lifting import Lifting

STILL = ca.SX(3, 1)


@dataclass(frozen=True)
class Link:
    """A link's motion about the point O: displacements with value zero. Without them the link is fixed."""

    place: ca.SX  # (3,) [m]
    shift: ca.SX = STILL  # (3,) [m]
    turn: ca.SX = STILL  # (3,) [rad]

    def move(self, r: ca.SX) -> ca.SX:
        """The displacement (3,) of the point O + r."""
        return self.shift + self.swing(r)

    def swing(self, r: ca.SX) -> ca.SX:
        """The change (3,) of a direction r, or of several (3, k)."""
        return swing(self.turn, r)

    def felt(self, vector: ca.SX) -> ca.SX:
        """A vector (3,) f of the world, seen from a frame that turns with the link: E(-ω) f."""
        return vector + swing(-self.turn, vector)

    def direction(self, name: str, value: ca.SX, lifting: Lifting) -> ca.SX:
        """A direction (3,) fixed to the link, lifted."""
        return lifting.lift(name, value, self.swing(lifting.constant(name, value)))


def swing(turn: ca.SX, r: ca.SX) -> ca.SX:
    """(E(ω) - I) r for a turn ω (3,) and a direction r (3,), or several (3, k)."""
    W = ca.skew(turn)
    turned = W @ r
    return turned + W @ turned / 2


def free(position: ca.SX, rotation: ca.SX, lifting: Lifting) -> Link:
    """The motion of a link whose position (3,) [m] and rotation (3, 3) are expressions in x, about its own position.

    It is folded late: everything on the link depends on it by fewer numbers than on x.
    """
    turned = rotation @ lifting.constant("attitude", rotation).T  # sin |ω| times the axis is ω to second order
    return Link(
        place=lifting.constant("place", position),
        shift=lifting.displacement("shift", position, late=True),
        turn=lifting.displacement("turn", ca.inv_skew(turned - turned.T) / 2, late=True),
    )


class Motion:
    """The motions of all links of a model with given frames.

    `root` is the motion of the root link, `turns` (n,) [rad or m] are displacements of the joint coordinates.
    """

    def __init__(self, model: pin.Model, frames: Frames | ArmFrames, root: Link, turns: ca.SX, lifting: Lifting):
        self._model, self._lifting, self._links = model, lifting, [root]
        rho = frames.pivots - ca.repmat(root.place.T, frames.pivots.shape[0], 1)
        m = ca.cross(frames.about, rho, 2)
        held = [frames.about, frames.along - m, ca.cross(frames.about, m, 2)]
        about, along, bend = (lifting.constant("axes", rows) for rows in held)
        for j in range(model.njoints - 1):
            delta, before = turns[model.idx_qs[j + 1]], self._links[model.parents[j + 1]]
            a, b = along[j, :].T, about[j, :].T
            v = before.shift + delta * (a + ca.cross(before.turn, a)) - delta**2 * bend[j, :].T / 2
            w = before.turn + delta * (b + ca.cross(before.turn, b) / 2)
            motion = lifting.displacement("link", ca.vertcat(v, w))
            self._links.append(Link(root.place, motion[:3], motion[3:]))

    def of(self, link: str) -> Link:
        """The motion of a link."""
        frame = self._model.getFrameId(link, pin.FrameType.BODY)
        return self._links[self._model.frames[frame].parentJoint]

    def points(self, name: str, places: ca.SX, links: Sequence[str], late: bool = False) -> ca.SX:
        """Points (K, 3) [m] at these positions, each fixed to its link."""
        if not links:
            return ca.SX(0, 3)
        r = self._lifting.constant("arms", places - ca.repmat(self._links[0].place.T, len(links), 1))
        moves = [self.of(link).move(r[k, :].T).T for k, link in enumerate(links)]
        return self._lifting.lift(name, places, ca.vertcat(*moves), late)
