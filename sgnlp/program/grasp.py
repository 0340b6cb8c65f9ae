"""The quantities of a compliant grasp that energy terms and constraints share, computed once.

    p_i = o_i + c (a_i - o_i),   R, t = equilibrium(p, o, k),   p_i(eq) = R p_i + t
    f_i(t0) = k_i (o_i - p_i),   f_i(eq) = k_i (o_i - p_i(eq)),   n_i = ∇μ/|∇μ| at p_i,   n_i(eq) = R n_i

If the hand at first contact is planned (`closing.planned`), its joints w satisfy FK(w) = p_i with the same wrist, and
joint torques are τ = Jᵀf with the Jacobian there. Otherwise, as in the paper, everything "at contact" is taken at the
pregrasp, the Jacobian too: the error of the worst joint torque at equilibrium is 0.13 N m in the median of 95 grasps.

The same class holds CasADi expressions (`sgnlp.program.model`) or NumPy arrays (`sgnlp.planning.recompute`); both are
assembled by `sgnlp.program.assembly`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sgnlp.base.brief import brief


@dataclass(frozen=True)
class Grasp:
    """A hand of m fingers, n joints and S spheres at a pregrasp, its contacts and its equilibrium.

    p_i = o_i + c (a_i - o_i),   R, t = equilibrium(p, o, k),   p_i(eq) = R p_i + t
        f_i(t0) = k_i (o_i - p_i),   f_i(eq) = k_i (o_i - p_i(eq)),   n_i = ∇μ/|∇μ| at p_i,   n_i(eq) = R n_i

    All positions are in the world frame, z up. An array (k,) in NumPy is a column (k, 1) in CasADi.
    """

    __repr__ = brief

    wrist_position: Any  # (3,) [m], origin of the hand's root link at the pregrasp
    wrist_rotation: Any  # (3, 3), orientation of the root link: its axes are the columns
    links: Mapping[str, Any]  # name of each link → (3,) [m], origin of its frame at the pregrasp
    joints_contact: Any  # (n,) [rad], w, at first contact
    arm: Any  # `sgnlp.program.carried.Carried`, the arm that carries the hand; None without one
    reach_errors: Any  # (m, 3) [m], tips at the joints of first contact less the contacts: 0
    centre: Any  # (3,) [m], the object's centre of mass before it moves
    joints: Any  # (n,) [rad]
    reference: Any  # (n,) [rad]
    tips: Any  # (m, 3) [m], a_i
    targets: Any  # (m, 3) [m], o_i
    gains: Any  # (m,) [N/m], k_i
    contacts: Any  # (m, 3) [m], p_i, centres of the tips at first contact
    contacts_eq: Any  # (m, 3) [m]
    contacts_desired: Any  # (m, 3) [m], desired contacts at equilibrium: p_i itself if no motion is desired
    rotation: Any  # (3, 3)
    rotation_desired: Any  # (3, 3)
    stiffness: Any  # () [N m], ρ
    forces: Any  # (m, 3) [N] at first contact
    forces_eq: Any  # (m, 3) [N]
    torques: Any  # (n,) [N m], Jᵀf at first contact, J = ∂FK/∂joints there
    torques_eq: Any  # (n,) [N m], with the forces at equilibrium and the same J
    effort: Any  # (n,) [N m], the largest that the hand gives
    wrench: Any  # (2, 3) [N], [N m], net force on the object at first contact and its torque about the centre of mass
    wrench_eq: Any  # (2, 3) [N], [N m], the same at equilibrium, about the centre of mass there: 0
    tip_errors: Any  # (m, 3) [m], tips that are variables less those of the forward kinematics: 0
    normals: Any  # (m, 3)
    normals_eq: Any  # (m, 3)
    gaps: Any  # (m,) [m], metric distance to the surface of the pads (of the centres, without pads)
    contact_deviations: Any  # (m,) [m]
    path_gaps: Any  # (m K,) [m], the same along each finger's path, finger by finger
    path_deviations: Any  # (m K,) [m]
    target_means: Any  # (m,) [m], μ(o_i)
    spheres: Any  # (S, 3) [m]
    radii: Any  # (S,) [m]
    object_clearances: Any  # (S - m,) [m], of every sphere but the pads
    pad_clearances: Any  # (m,) [m], of the pads from the object at the pregrasp
    table_clearances: Any  # (S - m,) [m], of every sphere but the pads
    pad_heights: Any  # (m,) [m], of the pads over the table at the pregrasp
    pair_clearances: Any  # (P,) [m]
    spheres_contact: Any  # (S, 3) [m], centres at first contact
    object_clearances_contact: Any  # (S - m,) [m], of every sphere but the pads, at first contact
    table_clearances_contact: Any  # (S - m,) [m]
    pair_clearances_contact: Any  # (P,) [m]
    # (S,) [m], of every sphere from obstacles; this and the next three are empty without obstacles
    obstacle_clearances: Any
    obstacle_clearances_contact: Any  # (S,) [m], at first contact
    obstacle_clearances_approach: Any  # (A S,) [m], from obstacles and table, posture by posture back to the stand-off
    obstacle_clearances_lift: Any  # (S,) [m], the same with the hand at contact lifted
    avoid_distances: Any  # (m,) [m], of the contact points to the regions to avoid; empty without regions
    touch_distances: Any  # (m,) [m], to the regions to touch, negative inside
    ball_clearances: Any  # (m,) [m], of the pregrasp tips inside the ball of the surface model
    contact_heights: Any  # (m,) [m], of the pads over the table at first contact
    contact_heights_eq: Any  # (m,) [m]
    path_samples: int  # K
    density_share: bool  # whether E_uncer is a share of the density on the path
    friction: Any  # ()
    force_min: Any  # () [N]
