"""The grasp as CasADi expressions over a chain of lifted quantities: what `sgnlp.program.nlp` differentiates."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import forward
from sgnlp.program import equilibrium
from sgnlp.program.grasp import Grasp
from sgnlp.program.lifting import Chain
from sgnlp.program.structure import Structure
from sgnlp.surface.jets import JET, Layout, expand

Array = NDArray[np.float64]

MIN_DEVIATION = 1e-6
"""Rounding of √σ_d² at 0 [m]."""


class Model:
    """The symbolic grasp over a chain: what is lifted and how everything follows from it.

    The gap of a pad is d at its foot p - r n(p) where the parameter `foot` is 1, and d(p) - r where it is 0. The
    first is right to second order in r, the second reads 2 mm too little at r = 12 mm but is defined far off the
    surface too, where a tip begins: so it leads there in the penalty formulation, and the constrained one ends with the
    first.
    """

    def __init__(self, hand: Hand, structure: Structure, chain: Chain, par: SimpleNamespace, units: Array):
        m, n, K = len(hand.fingers), len(hand.joint_names), structure.samples
        x = chain.x * units
        v, self.o = x[: 6 + n], ca.reshape(x[6 + n : 6 + n + 3 * m], 3, m).T
        self.k = x[6 + n + 3 * m : 6 + n + 4 * m]
        self.lifted = x[6 + n + 4 * m :]  # of the lifted formulation: tips, Gibbs vector and shift
        frames = forward(hand, par.wrist, par.joints, v)
        a = chain.lift("tips", ca.reshape(self.lifted[: 3 * m], 3, m).T if structure.lifted else frames.tips)
        s = self._spheres(hand, chain, frames.spheres, a)
        p = chain.lift("contacts", self.o + par.c * (a - self.o))
        along = np.linspace(0.0, 1.0, K)  # from the pregrasp tip to the target
        path = [t * self.o[i, :] + (1 - t) * a[i, :] for i in range(m) for t in along]
        tau = chain.lift("path", ca.vertcat(*path))
        o = chain.lift("targets", self.o)
        self.layout = Layout(m, K, len(hand.spheres))
        self.jets = self.layout.symbols()
        self.radii = np.array([finger.radius for finger in hand.fingers])
        self.pads = par.foot * par.pad * self.radii
        self.given = ca.vertcat(p, tau, s, o)
        normals = chain.lift("normals", self._normals(p - chain.freeze("contact_origin", p)))
        feet = chain.lift("feet", p - ca.repmat(self.pads, 1, 3) * normals)
        z = ca.vertcat(p, tau, s, feet, o)
        self.displacements = z - chain.freeze("origin", z)  # 0 with derivative 1
        self.grasp = self._grasp(hand, structure, chain, par, (a, s, p, o, v, normals), frames.tips)

    def _spheres(self, hand: Hand, chain: Chain, spheres: ca.SX, tips: ca.SX) -> ca.SX:
        """Sphere centres (S, 3); those of the pads are the tips themselves, already lifted."""
        others = [i for i in range(len(hand.spheres)) if i not in hand.tip_spheres]
        lifted = chain.lift("spheres", spheres[others, :])
        rows = {i: lifted[j, :] for j, i in enumerate(others)}
        rows |= {i: tips[j, :] for j, i in enumerate(hand.tip_spheres)}
        return ca.vertcat(*[rows[i] for i in range(len(hand.spheres))])

    def _normals(self, delta: ca.SX) -> ca.SX:
        """Normals (m, 3) at the contacts displaced by delta (m, 3) [m]."""
        jets = [self.jets[2][:, JET * a : JET * (a + 1)] for a in range(3)]
        return ca.horzcat(*[expand(J, delta) for J in jets])

    def _equilibrium(
        self, structure: Structure, chain: Chain, par: SimpleNamespace, p: ca.SX, o: ca.SX
    ) -> tuple[ca.SX, ca.SX, ca.SX]:
        """R (3, 3), ρ and t (3) of the equilibrium, as variables or by their closed forms."""
        if structure.equilibrium == "printed":
            B = equilibrium.printed_profile(p, o, self.k)
        else:
            B = equilibrium.profile(p, o, self.k, par.mass, par.com)
        B = chain.lift("profile", B)
        if structure.lifted:
            turn, shift = ca.vertsplit(self.lifted[-6:], 3)
            R = equilibrium.turned(turn)
            rho = equilibrium.stiffness(R, B)
        else:
            R, rho = equilibrium.rotation(B, chain.freeze("root", equilibrium.root_guess(B)))
        attitude = chain.lift("attitude", ca.vertcat(ca.vec(R), rho))
        R, rho = ca.reshape(attitude[:9], 3, 3), attitude[9]
        if structure.lifted:
            return R, rho, par.com + shift - R @ par.com
        return R, rho, equilibrium.translation(R, p, o, self.k, par.mass)

    def _grasp(
        self,
        hand: Hand,
        structure: Structure,
        chain: Chain,
        par: SimpleNamespace,
        places: tuple[ca.SX, ...],
        tips: ca.SX,
    ) -> Grasp:
        a, s, p, o, v, normals = places
        m, K, k = len(hand.fingers), structure.samples, self.k
        R, rho, t = self._equilibrium(structure, chain, par, p, o)
        p_eq = chain.lift("contacts_eq", p @ R.T + ca.repmat(t.T, m, 1))
        gain = ca.repmat(k, 1, 3)
        centre, turn = ca.repmat(par.com.T, m, 1), ca.reshape(par.turn, 3, 3)
        arms, forces, forces_eq = p - centre, gain * (o - p), gain * (o - p_eq)
        arms_eq = p_eq - ca.repmat((R @ par.com + t).T, m, 1)
        pad = par.pad * self.radii
        links = [i for i in range(len(hand.spheres)) if i not in hand.tip_spheres]
        radii = np.array([sphere.radius for sphere in hand.spheres])
        delta, V, D = self.displacements, self.layout.uncertain, self.layout.distances
        distance = chain.lift("distance", expand(self.jets[0], delta[:D, :]))
        variance = chain.lift("variance", expand(self.jets[1], delta[:V, :]))
        clearances = distance[V : D - m] - radii
        deviation = ca.sqrt(ca.fmax(variance, 0) + MIN_DEVIATION**2)
        torques, torques_eq = (_torques(tips, chain.x, f)[6 : v.numel()] for f in (forces, forces_eq))
        pairs = [ca.norm_2(s[i, :] - s[j, :]) - radii[i] - radii[j] for i, j in hand.pairs]
        return Grasp(
            joints=par.joints + v[6:],
            reference=hand.reference,
            tips=a,
            targets=o,
            gains=k,
            contacts=p,
            contacts_eq=p_eq,
            contacts_desired=centre + arms @ turn.T + ca.repmat(par.displacement.T, m, 1),
            rotation=R,
            rotation_desired=turn,
            stiffness=rho,
            forces=forces,
            forces_eq=forces_eq,
            torques=torques,
            torques_eq=torques_eq,
            effort=hand.effort,
            wrench=_wrench(forces, arms, par.mass),
            wrench_eq=_wrench(forces_eq, arms_eq, par.mass),
            tip_errors=a - tips,
            normals=normals,
            normals_eq=normals @ R.T,
            gaps=distance[D - m :] - (1 - par.foot) * pad,
            contact_deviations=deviation[:m],
            path_gaps=distance[m:V] - ca.vec(ca.repmat(pad.T, K, 1)),
            path_deviations=deviation[m:],
            target_means=expand(self.jets[3], delta[D:, :]),
            spheres=s,
            radii=radii,
            object_clearances=clearances[links],
            pad_clearances=clearances[list(hand.tip_spheres)],
            table_clearances=(s[:, 2] - radii - par.table)[links],
            pad_heights=a[:, 2] - self.radii - par.table,
            pair_clearances=ca.vertcat(*pairs),
            ball_clearances=par.ball_radius - ca.sqrt(ca.sum2((a - ca.repmat(par.ball_centre.T, m, 1)) ** 2)),
            contact_heights=p[:, 2] - pad - par.table,
            contact_heights_eq=p_eq[:, 2] - pad - par.table,
            path_samples=K,
            density_share=structure.density == "share",
            friction=par.friction,
            force_min=par.force_min,
        )


def _wrench(forces: ca.SX, arms: ca.SX, mass: ca.SX) -> ca.SX:
    """Net force and torque (2, 3) on the object of forces (m, 3) at arms (m, 3) from its centre of mass."""
    load = ca.horzcat(0, 0, mass * equilibrium.GRAVITY)
    return ca.vertcat(ca.sum1(forces) - load, ca.sum1(ca.cross(arms, forces, 2)))


def _torques(tips: ca.SX, x: ca.SX, forces: ca.SX) -> ca.SX:
    """∇_x Σ f_iᵀ a_i(x) (nx,), the virtual work of forces (m, 3) at tips (m, 3): for joints, of unit 1, it is Jᵀf."""
    return ca.jtimes(tips, x, forces, True)
