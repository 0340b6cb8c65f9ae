"""The grasp as CasADi expressions over a chain of lifted quantities: what `sgnlp.program.nlp` differentiates."""

from dataclasses import dataclass
from types import SimpleNamespace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import Frames, forward, link_names
from sgnlp.program import equilibrium
from sgnlp.program.assembly import Parts, Symbolic, assemble
from sgnlp.program.carried import ArmModel
from sgnlp.program.lifting import Lifting
from sgnlp.program.structure import Structure
from sgnlp.surface.jets import JET, Layout, expand

Array = NDArray[np.float64]

MIN_DEVIATION = 1e-6
"""Rounding of √σ_d² at 0 [m]."""


class Model:
    """The symbolic grasp: what is lifted and how everything follows from it.

    `par` are the symbols of the parameters, `units` (nx,) those of the scaled variables `lifting.x`. `given` are the
    query points that follow from the variables alone, `pads` (m,) [m] how far the feet lie below the contacts, `around`
    (P, 3) [m] the points of `sgnlp.program.around`, `field_jets` the jets there and at the feet.
    """

    def __init__(self, hand: Hand, structure: Structure, lifting: Lifting, par: SimpleNamespace, units: Array):
        m, n, K = len(hand.fingers), len(hand.joint_names), structure.samples
        x = lifting.x * units
        self._v, targets = x[: 6 + n], ca.reshape(x[6 + n : 6 + n + 3 * m], 3, m).T
        self._k = x[6 + n + 3 * m : 6 + n + 4 * m]
        own = len(structure.formulation.variables(hand).units)
        self._added = x[x.numel() - own :]  # variables of the formulation's own
        frames = forward(hand, par.wrist, par.joints, self._v)
        self._a = lifting.lift("tips", structure.formulation.tips(self._added, frames.tips))
        self._s = self._spheres(hand, lifting, "spheres", frames.spheres, self._a)
        at, first = structure.at_contact, 6 + n + 4 * m
        ends = first + m * at.c + n * at.joints  # of the variables at contact
        self._arm = ArmModel(hand, lifting, par, frames, x[ends:]) if hand.arm else None
        c = ca.repmat(x[first : first + m], 1, 3) if at.c else par.c
        self._p = lifting.lift("contacts", targets + c * (self._a - targets))
        along = np.linspace(0.0, 1.0, K)  # from the pregrasp tip to the target
        path = [t * targets[i, :] + (1 - t) * self._a[i, :] for i in range(m) for t in along]
        tau = lifting.lift("path", ca.vertcat(*path))
        self._o = lifting.lift("targets", targets)
        self._contact = _Contact(frames, par.joints + self._v[6:], slice(6, 6 + n), None, self._s)
        if at.joints:
            self._contact = self._at_contact(hand, lifting, par, slice(first + m * at.c, first + m * at.c + n))
        self.layout = layout(hand, structure)
        self.jets = self.layout.symbols()
        self.pads = par.foot * par.pad * hand.tip_radii
        links = self._contact.spheres[_links(hand), :] if at.joints else ca.SX(0, 3)
        self.given = ca.vertcat(self._p, tau, self._s, links, self._o)
        self._n = lifting.lift("normals", self._normals(self._p - lifting.freeze("contact_origin", self._p)))
        feet = lifting.lift("feet", self._p - ca.repmat(self.pads, 1, 3) * self._n)
        z = ca.vertcat(self._p, tau, self._s, links, feet, self._o)
        self._delta = z - lifting.freeze("origin", z)  # displacements: 0 with derivative 1
        self._surround(hand, structure, lifting, par, frames)
        parts = self._parts(hand, structure, lifting, par, frames)
        given = SimpleNamespace(**vars(par) | {"rotation_desired": ca.reshape(par.rotation_desired, 3, 3)})
        self.grasp = assemble(parts, hand, given, K, structure.density, Symbolic())

    def _spheres(self, hand: Hand, lifting: Lifting, name: str, spheres: ca.SX, tips: ca.SX) -> ca.SX:
        """Sphere centres (S, 3); those of the pads are the tips themselves, already lifted."""
        others = _links(hand)
        lifted = lifting.lift(name, spheres[others, :])
        rows = {i: lifted[j, :] for j, i in enumerate(others)}
        rows |= {i: tips[j, :] for j, i in enumerate(hand.tip_spheres)}
        return ca.vertcat(*[rows[i] for i in range(len(hand.spheres))])

    def _at_contact(self, hand: Hand, lifting: Lifting, par: SimpleNamespace, where: slice) -> "_Contact":
        """The hand at the joints of first contact, which are variables, with the wrist of the pregrasp."""
        angles = lifting.x[where]
        frames = forward(hand, par.wrist, par.joints, ca.vertcat(self._v[:6], angles - par.joints))
        tips = lifting.lift("tips_contact", frames.tips)
        return _Contact(
            frames, angles, where, tips, self._spheres(hand, lifting, "spheres_contact", frames.spheres, tips)
        )

    def _surround(
        self, hand: Hand, structure: Structure, lifting: Lifting, par: SimpleNamespace, frames: Frames
    ) -> None:
        """The points at which distances to the surroundings are asked for, and their displacements."""
        around, S, m = structure.around, len(hand.spheres), len(hand.fingers)
        self.around = ca.SX(0, 3)
        if around.obstacles:
            ahead = lifting.lift("palm", frames.rotation @ ca.SX(hand.palm))
            back = [-par.standoff * (j + 1) / around.approach * ahead.T for j in range(around.approach)]
            approach = [self._s + ca.repmat(step, S, 1) for step in back]
            lifted = self._contact.spheres + ca.repmat(ca.horzcat(0, 0, par.lift), S, 1)
            self.around = ca.vertcat(self._s, self._contact.spheres, *approach, lifted)
        arm = self._arm.spheres if self._arm else ca.SX(0, 3)
        self.around = ca.vertcat(self.around, arm)
        self.field_jets = ca.SX.sym("field_jets", self.around.shape[0] + around.regions(m), JET)
        feet = self._delta[self.layout.before_feet : self.layout.before_feet + m, :]
        delta = self.around - lifting.freeze("around_origin", self.around)
        delta = ca.vertcat(delta, *[feet] * (around.avoid + around.touch))
        distances = lifting.lift("around", expand(self.field_jets, delta)) if delta.shape[0] else ca.SX(0, 1)
        counts = [0, around.points(S), arm.shape[0], m * around.avoid, m * around.touch]
        parts = ca.vertsplit(distances, np.cumsum(counts).tolist())
        self._obstacles, self._arm_distances, self._avoid, self._touch = parts

    def _normals(self, delta: ca.SX) -> ca.SX:
        """Normals (m, 3) at the contacts displaced by delta (m, 3) [m]."""
        jets = [self.jets[2][:, JET * a : JET * (a + 1)] for a in range(3)]
        return ca.horzcat(*[expand(J, delta) for J in jets])

    def _motion(self, structure: Structure, lifting: Lifting, par: SimpleNamespace) -> tuple[ca.SX, ca.SX, ca.SX]:
        """R (3, 3), ρ and t (3) of the object's motion to the equilibrium, as the formulation has them."""
        p, o, k, formulation = self._p, self._o, self._k, structure.formulation
        if structure.equilibrium == "printed":
            B = equilibrium.printed_profile(p, o, k)
        else:
            B = equilibrium.profile(p, o, k, par.mass, par.com)
        R, rho = formulation.rotation(self._added, lifting.lift("profile", B), lifting)
        attitude = lifting.lift("attitude", ca.vertcat(ca.vec(R), rho))
        R, rho = ca.reshape(attitude[:9], 3, 3), attitude[9]
        return R, rho, formulation.translation(self._added, R, par, p, o, k)

    def _parts(self, hand: Hand, structure: Structure, lifting: Lifting, par: SimpleNamespace, frames: Frames) -> Parts:
        """The parts of the grasp; those of the surface are written on its jets."""
        m, delta, V, D = len(hand.fingers), self._delta, self.layout.uncertain, self.layout.distances
        S, at = len(hand.spheres), self._contact
        R, rho, t = self._motion(structure, lifting, par)
        p_eq = lifting.lift("contacts_eq", self._p @ R.T + ca.repmat(t.T, m, 1))
        distance = lifting.lift("distance", expand(self.jets[0], delta[:D, :]))
        variance = lifting.lift("variance", expand(self.jets[1], delta[:V, :]))
        deviation = ca.sqrt(ca.fmax(variance, 0) + MIN_DEVIATION**2)
        return Parts(
            wrist_position=frames.position,
            wrist_rotation=frames.rotation,
            links={name: frames.origins[i, :].T for i, name in enumerate(link_names(hand))},
            joints=par.joints + self._v[6:],
            arm=self._arm and self._arm.state(par, self._arm_distances),
            tips=self._a,
            tip_errors=self._a - frames.tips,
            joints_contact=at.joints,
            reach_errors=ca.SX(m, 3) if at.tips is None else at.tips - self._p,
            spheres=self._s,
            spheres_contact=at.spheres,
            torques=lambda forces: _virtual_work(at.frames.tips, lifting.x, forces)[at.where],
            targets=self._o,
            gains=self._k,
            contacts=self._p,
            contacts_eq=p_eq,
            rotation=R,
            translation=t,
            stiffness=rho,
            normals=self._n,
            gaps=distance[D - m :] - (1 - par.foot) * par.pad * hand.tip_radii,
            contact_deviations=deviation[:m],
            path_distances=distance[m:V],
            path_deviations=deviation[m:],
            target_means=expand(self.jets[3], delta[D:, :]),
            sphere_distances=distance[V : V + S],
            link_distances_contact=distance[V : V + S][_links(hand)] if at.tips is None else distance[V + S : D - m],
            obstacle_distances=self._obstacles,
            avoid_distances=self._avoid,
            touch_distances=self._touch,
        )


@dataclass(frozen=True)
class _Contact:
    """The hand at first contact: its frames, joints (n), where these stand in x, tips (m, 3) if planned, spheres."""

    frames: Frames
    joints: ca.SX
    where: slice
    tips: ca.SX | None
    spheres: ca.SX


def layout(hand: Hand, structure: Structure) -> Layout:
    """The query points of a hand in a structure."""
    links = len(_links(hand)) if structure.at_contact.joints else 0
    return Layout(len(hand.fingers), structure.samples, len(hand.spheres), links)


def _links(hand: Hand) -> list[int]:
    """Indices of the spheres that are not pads."""
    return [i for i in range(len(hand.spheres)) if i not in hand.tip_spheres]


def _virtual_work(tips: ca.SX, x: ca.SX, forces: ca.SX) -> ca.SX:
    """∇_x Σ f_iᵀ a_i(x) (nx,), the virtual work of forces (m, 3) at tips (m, 3): for joints, of unit 1, it is Jᵀf."""
    return ca.jtimes(tips, x, forces, True)
