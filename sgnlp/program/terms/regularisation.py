"""Terms that shape the plan: soft springs, relaxed fingers, little or desired motion of the object."""

from typing import Any

from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.terms.term import Term


class Gains(Term):
    """E_gain = Σ k_i. Printed Σ k_i²; with w = 0.5 that would drown every other term (22 400 at the start)."""

    name = setting = "gain"
    about = "soft springs"

    def value(self, g: Grasp, op: Ops) -> Any:
        """In N/m."""
        return op.sum(g.gains)


class Joints(Term):
    """First half of E_reg: |q_ref - q|² over the joints."""

    name = "reg_joints"
    about = "joints near the hand's reference pose"
    setting = "reg"

    def value(self, g: Grasp, op: Ops) -> Any:
        """In rad²."""
        return op.square(g.joints - g.reference)


class Closing(Term):
    """E_closing = |w - q|² over the joints: an impedance controller ends near where it begins."""

    name = setting = "closing"
    about = "joints at first contact near those of the pregrasp"

    def value(self, g: Grasp, op: Ops) -> Any:
        """In rad²."""
        return op.square(g.joints_contact - g.joints)


class Arm(Term):
    """E_arm = |q - q_home|² + |q_s - q|² + |q_l - q|²: prefers arm postures near home that move little."""

    name = setting = "arm"
    about = "arm near its home, and moving little"
    of_arm = True

    def value(self, g: Grasp, op: Ops) -> Any:
        """In rad²."""
        arm = g.arm
        return sum(op.square(d) for d in (arm.joints - arm.home, arm.standoff - arm.joints, arm.lift - arm.joints))


class Motion(Term):
    """Second half of E_reg: Σ |p_i - p_i(eq)|². Replaced by E_pose if that has a weight."""

    name = "reg_motion"
    about = "little motion of the contacts to the equilibrium"
    setting = "reg"

    def value(self, g: Grasp, op: Ops) -> Any:
        """In m²."""
        return op.square(g.contacts - g.contacts_eq)


class Pose(Term):
    """E_pose = Σ |p_i(des) - p_i(eq)|: the object should make the desired motion, such as a rise by 1 cm."""

    name = setting = "pose"
    about = "the object moved as desired"

    def value(self, g: Grasp, op: Ops) -> Any:
        """In metres."""
        return op.sum(op.abs(op.norm(g.contacts_desired - g.contacts_eq)))
