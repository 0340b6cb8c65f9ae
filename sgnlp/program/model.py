"""The grasp as CasADi expressions over a chain of lifted quantities, which `sgnlp.program.nlp` differentiates."""

from dataclasses import dataclass
from types import SimpleNamespace

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import Frames, forward, link_names
from sgnlp.program import equilibrium
from sgnlp.program.assembly import Parts, Symbolic, assemble
from sgnlp.program.carried import ArmModel
from sgnlp.program.formulation import Formulation
from sgnlp.program.lifting import Lifting
from sgnlp.program.motion import Motion, free
from sgnlp.program.structure import Structure
from sgnlp.program.torques import TipTorques
from sgnlp.surface.jets import JET, Layout, expand

MIN_DEVIATION = 1e-6
"""Rounding of √σ_d² at 0 [m]."""


class Model:
    """The symbolic grasp: the lifted quantities, and all that follows from them.

    `par` are the symbols of the parameters, `units` (nx,) those of the scaled variables `lifting.x`. `given` are the
    query points that follow from the variables alone, `pads` (m,) [m] the distances of the feet below the contacts,
    `around` (P, 3) [m] the points of `sgnlp.program.around`, `field_jets` the jets there and at the feet.
    """

    def __init__(self, hand: Hand, structure: Structure, lifting: Lifting, par: SimpleNamespace, units: Array):
        m, n, K = len(hand.fingers), len(hand.joint_names), structure.samples
        x = lifting.x * units
        self._v, targets = x[: 6 + n], ca.reshape(x[6 + n : 6 + n + 3 * m], 3, m).T
        self._k = x[6 + n + 3 * m : 6 + n + 4 * m]
        own = len(structure.formulation.variables(hand).units)
        self._added = x[x.numel() - own :]  # the formulation's own variables
        frames = forward(hand, par.wrist, par.joints, self._v)
        self._root = free(frames.position, frames.rotation, lifting)
        turns = lifting.displacement("turns", self._v[6:])
        here = self._place(hand, frames, turns, lifting, structure.formulation)
        self._a, self._s, self._reached = here.tips, here.spheres, here.reached
        at, first = structure.at_contact, 6 + n + 4 * m
        ends = first + m * at.c + n * at.joints  # indices of the variables at contact
        self._arm = ArmModel(hand, lifting, par, frames, self._root, x[ends:]) if hand.arm else None
        c = ca.repmat(x[first : first + m], 1, 3) if at.c else par.c
        self._o = targets
        self._p = lifting.lift("contacts", targets + c * (self._a - targets), late=True)
        along = np.linspace(0.0, 1.0, K)  # from the pregrasp tip to the target
        path = ca.vertcat(*[t * targets[i, :] + (1 - t) * self._a[i, :] for i in range(m) for t in along])
        self._contact, self._planned, at_contact, angles = here, at.joints, frames, par.joints + self._v[6:]
        if at.joints:
            angles = lifting.x[first + m * at.c : first + m * at.c + n]
            at_contact = forward(hand, par.wrist, par.joints, ca.vertcat(self._v[:6], angles - par.joints))
            turns = lifting.displacement("turns_contact", angles)
            self._contact = self._place(hand, at_contact, turns, lifting)
        self._angles, self._torques = angles, TipTorques(hand, at_contact, turns, lifting)
        self.layout = layout(hand, structure)
        self.jets = self.layout.symbols()
        self.pads = par.foot * par.pad * hand.tip_radii
        self._delta = self._ask(hand, lifting, path)
        self._surround(hand, structure, lifting, par, frames)
        parts = self._parts(hand, structure, lifting, par, frames)
        given = SimpleNamespace(**vars(par) | {"rotation_desired": ca.reshape(par.rotation_desired, 3, 3)})
        self.grasp = assemble(parts, hand, given, K, structure.density, Symbolic(lifting.lift))

    def _ask(self, hand: Hand, lifting: Lifting, path: ca.SX) -> ca.SX:
        """Set the query points and the normals; returns the displacements (Q, 3) [m] of all points, feet too."""
        m, before = len(hand.fingers), self.layout.before_feet
        links = self._contact.spheres[_links(hand), :] if self._planned else ca.SX(0, 3)
        self.given = ca.vertcat(self._p, path, self._s, links, self._o)
        delta = lifting.displacement("moved", self.given)
        self._n = lifting.lift("normals", *self._normals(delta[:m, :]))
        feet = lifting.displacement("feet", self._p - ca.repmat(self.pads, 1, 3) * self._n)
        return ca.vertcat(delta[:before, :], feet, delta[before:, :])

    def _place(
        self, hand: Hand, frames: Frames, turns: ca.SX, lifting: Lifting, formulation: Formulation | None = None
    ) -> "_Placed":
        """The tips and spheres of the hand at a configuration; its pads are spheres about the tips.

        The tips are folded late, so that the many numbers that follow from them do not depend on the links before.
        """
        motion, links = Motion(hand.model, frames, self._root, turns, lifting), _links(hand)
        fixed = motion.points("tips", frames.tips, [finger.frame for finger in hand.fingers], late=True)
        tips = formulation.tips(self._added, fixed) if formulation else fixed
        lifted = motion.points("spheres", frames.spheres[links, :], [hand.spheres[i].link for i in links])
        rows = {i: lifted[j, :] for j, i in enumerate(links)} | {i: tips[j, :] for j, i in enumerate(hand.tip_spheres)}
        spheres = ca.vertcat(*[rows[i] for i in range(len(hand.spheres))])
        return _Placed(fixed, tips, spheres)

    def _surround(
        self, hand: Hand, structure: Structure, lifting: Lifting, par: SimpleNamespace, frames: Frames
    ) -> None:
        """The points at which distances to the surroundings are needed, and their displacements."""
        around, S, m = structure.around, len(hand.spheres), len(hand.fingers)
        self.around = ca.SX(0, 3)
        if around.obstacles:
            ahead = self._root.direction("ahead", frames.rotation @ ca.SX(hand.palm), lifting)
            back = [-par.standoff * (j + 1) / around.approach * ahead.T for j in range(around.approach)]
            approach = [self._s + ca.repmat(step, S, 1) for step in back]
            lifted = self._contact.spheres + ca.repmat(ca.horzcat(0, 0, par.lift), S, 1)
            self.around = ca.vertcat(self._s, self._contact.spheres, *approach, lifted)
        arm = self._arm.spheres if self._arm else ca.SX(0, 3)
        self.around = ca.vertcat(self.around, arm)
        self.field_jets = ca.SX.sym("field_jets", self.around.shape[0] + around.regions(m), JET)
        feet = self._delta[self.layout.before_feet : self.layout.before_feet + m, :]
        moved = [lifting.displacement("around_moved", self.around)] if self.around.shape[0] else []
        delta = ca.vertcat(*moved, *[feet] * (around.avoid + around.touch))
        distances = _read(lifting, "around", self.field_jets, delta)
        counts = [0, around.points(S), arm.shape[0], m * around.avoid, m * around.touch]
        parts = ca.vertsplit(distances, np.cumsum(counts).tolist())
        self._obstacles, self._arm_distances, self._avoid, self._touch = parts

    def _normals(self, delta: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Normals (m, 3) at the contacts, and how they change with displacements (m, 3) [m] of these."""
        jets = [self.jets[2][:, JET * a : JET * (a + 1)] for a in range(3)]
        return ca.horzcat(*[J[:, 0] for J in jets]), ca.horzcat(*[expand(J, delta) for J in jets])

    def _motion(self, structure: Structure, lifting: Lifting, par: SimpleNamespace) -> tuple[ca.SX, ca.SX, ca.SX]:
        """R (3, 3), ρ and t (3) of the object's motion to the equilibrium, as the formulation defines them."""
        p, o, k, formulation = self._p, self._o, self._k, structure.formulation
        mean_p = lifting.lift("mean_contact", equilibrium.weighted_mean(k, p))
        mean_o = lifting.lift("mean_target", equilibrium.weighted_mean(k, o))
        if structure.equilibrium == "printed":
            B = lifting.lift("profile", equilibrium.printed_profile(p, o, k))
        else:
            value = equilibrium.profile(p, o, k, par.mass, par.com)
            pulls = lifting.lift("pulls", equilibrium.pulls(o, mean_o, k))
            B = lifting.lift("profile", value, pulls.T @ p + equilibrium.load(par.mass) @ mean_p)  # Σ pulls is 0
        R, rho = formulation.rotation(self._added, B, lifting)
        t = formulation.translation(self._added, R, par, mean_p, mean_o, k)
        return R, rho, lifting.lift("translation", t, late=True)

    def _parts(self, hand: Hand, structure: Structure, lifting: Lifting, par: SimpleNamespace, frames: Frames) -> Parts:
        """The parts of the grasp; those of the surface are expressions in its jets."""
        m, delta, V, D = len(hand.fingers), self._delta, self.layout.uncertain, self.layout.distances
        S, at, planned = len(hand.spheres), self._contact, self._planned
        R, rho, t = self._motion(structure, lifting, par)
        p_eq = lifting.lift("contacts_eq", self._p @ R.T + ca.repmat(t.T, m, 1))
        distance = _read(lifting, "distance", self.jets[0], delta[:D, :])
        variance = _read(lifting, "variance", self.jets[1], delta[:V, :])
        deviation = ca.sqrt(ca.fmax(variance, 0) + MIN_DEVIATION**2)
        return Parts(
            wrist_position=frames.position,
            wrist_rotation=frames.rotation,
            links={name: frames.origins[i, :].T for i, name in enumerate(link_names(hand))},
            joints=par.joints + self._v[6:],
            arm=self._arm and self._arm.state(par, self._arm_distances),
            tips=self._a,
            tip_errors=self._a - self._reached,
            joints_contact=self._angles,
            reach_errors=at.tips - self._p if planned else ca.SX(m, 3),
            spheres=self._s,
            spheres_contact=at.spheres,
            torques=lambda forces: self._torques(lifting.lift("felt", forces, self._root.felt(forces.T).T)),
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
            target_means=_read(lifting, "means", self.jets[3], delta[D:, :]),
            sphere_distances=distance[V : V + S],
            link_distances_contact=distance[V + S : D - m] if planned else distance[V : V + S][_links(hand)],
            obstacle_distances=self._obstacles,
            avoid_distances=self._avoid,
            touch_distances=self._touch,
        )


@dataclass(frozen=True)
class _Placed:
    """A hand in a posture: tips by forward kinematics, tips in the program (m, 3), spheres (S, 3)."""

    reached: ca.SX
    tips: ca.SX
    spheres: ca.SX


def layout(hand: Hand, structure: Structure) -> Layout:
    """The query points of a hand in a structure."""
    links = len(_links(hand)) if structure.at_contact.joints else 0
    return Layout(len(hand.fingers), structure.samples, len(hand.spheres), links)


def _links(hand: Hand) -> list[int]:
    """Indices of the spheres that are not pads."""
    return [i for i in range(len(hand.spheres)) if i not in hand.tip_spheres]


def _read(lifting: Lifting, name: str, jets: ca.SX, delta: ca.SX) -> ca.SX:
    """The values (Q,) of jets (Q, 10), and their change with displacements (Q, 3) [m]."""
    return lifting.lift(name, jets[:, 0], expand(jets, delta))
