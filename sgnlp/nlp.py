"""The nonlinear program and its exact derivatives, built once for a hand and a formulation.

    min_x  E(x)   subject to   g_low ≤ g(x) ≤ g_high,  x_low ≤ x ≤ x_high,      x = (v (6 + n), o (3 m), k (m))/units

The functions take jets of the surface at the query points z(x) as inputs (`sgnlp.jets`), so one `Nlp` serves every
object; object, weights, widths and seed pose are parameters. `sgnlp.oracle` joins an `Nlp` with a fitted surface.
"""

from dataclasses import dataclass
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp import equilibrium
from sgnlp.chain import Chain
from sgnlp.constraints import Constraint, active
from sgnlp.energies import TERMS, Term
from sgnlp.grasp import Grasp
from sgnlp.hand import Hand
from sgnlp.jets import JET, Layout, expand
from sgnlp.kinematics import forward
from sgnlp.ops import Smooth
from sgnlp.parameters import ParameterVector
from sgnlp.settings import Contact

Array = NDArray[np.float64]

UNITS = {"linear": 0.1, "angular": 1.0, "joint": 1.0, "target": 0.1, "gain": 100.0}
"""Units of the scaled variables [m, rad, rad, m, N/m], so that all are of order 1."""
ENERGY_UNIT = 100.0
"""The objective that the solver sees is E/ENERGY_UNIT."""
MIN_DEVIATION = 1e-6
"""Rounding of √σ_d² at 0 [m]."""


@dataclass(frozen=True)
class Structure:
    """All that the symbolic functions depend on, beside the hand."""

    formulation: str
    samples: int
    density: str
    equilibrium: str
    metric: str = "spring"
    heuristic: bool = False

    @property
    def traits(self) -> tuple[str, ...]:
        """What constraints may need: the formulation, the metric, and whether the gains follow from the surface."""
        return (self.formulation, self.metric, *(["heuristic"] if self.heuristic else []))


def structure(contact: Contact, formulation: str) -> Structure:
    """The structure of a formulation, `penalty` or `constrained`, with the settings of contact."""
    heuristic = contact.heuristic > 0
    return Structure(formulation, contact.samples, contact.density, contact.equilibrium, contact.metric, heuristic)


@dataclass(frozen=True)
class Nlp:
    """Functions of one structure.

    `points` (x, p) → the given query points (Q - m, 3) [m] and how far the feet lie below the contacts (m) [m];
    `objective`, `gradient`, `rows`, `jacobian` (x, p, jets…); `hessian` (x, p, jets…, λ_f, λ_g), the upper triangle;
    `terms` (x, p, jets…), the smooth terms unweighted; `jets`, that of `layout.function()`. The jets are the four
    blocks of `layout.symbols()`.
    """

    structure: Structure
    hand: Hand
    parameters: ParameterVector
    layout: Layout
    terms_used: tuple[Term, ...]
    constraints: tuple[Constraint, ...]
    row_sizes: tuple[int, ...]
    units: Array  # (nx,)
    points: ca.Function
    objective: ca.Function
    gradient: ca.Function
    rows: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    terms: ca.Function
    jets: ca.Function


FUNCTIONS = ("points", "objective", "gradient", "rows", "jacobian", "hessian", "terms", "jets")
"""The names of the functions of an `Nlp`."""


def parameter_vector(hand: Hand) -> ParameterVector:
    """The blocks of p for a hand."""
    n = len(hand.joint_names)
    sizes = {"wrist": 7, "joints": n, "weights": len(TERMS), "c": 1, "friction": 1, "pad": 1, "foot": 1, "force_min": 1}
    sizes |= {"displacement": 3, "turn": 9, "mass": 1, "com": 3, "table": 1, "ball_centre": 3, "ball_radius": 1}
    widths = {"distance": 1, "collision": 1, "log_width": 1, "force": 1, "deviation": 1, "exponent": 1}
    return ParameterVector(sizes | widths)


def variable_kinds(hand: Hand) -> list[str]:
    """The kind of each variable (nx,), a key of `UNITS`: the order of x."""
    n, m = len(hand.joint_names), len(hand.fingers)
    return ["linear"] * 3 + ["angular"] * 3 + ["joint"] * n + ["target"] * (3 * m) + ["gain"] * m


def variable_units(hand: Hand) -> Array:
    """The unit of each variable (nx,)."""
    return np.array([UNITS[kind] for kind in variable_kinds(hand)])


def frame(hand: Hand, structure: Structure) -> dict[str, Any]:
    """The fields of an `Nlp` that need no symbolic function."""
    penalty = structure.formulation == "penalty"
    terms = [t for t in TERMS if not t.metric or t.metric == structure.metric]
    return {
        "structure": structure,
        "hand": hand,
        "parameters": parameter_vector(hand),
        "layout": Layout(len(hand.fingers), structure.samples, len(hand.spheres)),
        "terms_used": tuple(t for t in terms if penalty or not t.constrained_elsewhere),
        "constraints": active(structure.traits),
        "units": variable_units(hand),
    }


@lru_cache(maxsize=8)
def build(hand: Hand, structure: Structure) -> Nlp:
    """Build the functions of a hand and structure; the same ones give the same object."""
    given = frame(hand, structure)
    p, par = given["parameters"].symbols()
    chain = Chain(ca.SX.sym("x", len(given["units"])))
    model = _Model(hand, structure, chain, par, given["units"])
    op = Smooth(par.distance, par.collision, par.log_width, par.force, par.deviation, par.exponent)
    unweighted = [t.value(model.grasp, op) for t in given["terms_used"]]
    weights = [par.weights[TERMS.index(t)] / ENERGY_UNIT for t in given["terms_used"]]
    weighted = [w * e for w, e in zip(weights, unweighted, strict=True)]
    blocks = [ca.vec(ca.SX(c.value(model.grasp, op))) / c.scale for c in given["constraints"]]
    rows, energy = ca.vertcat(*blocks), sum(weighted, start=ca.SX(0))
    lam_f, lam_g = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", rows.numel())
    split = ca.vertsplit(lam_g, [0, *np.cumsum([b.numel() for b in blocks]).tolist()])
    parts = [lam_f * w for w in weighted] + [ca.dot(lam, b) for lam, b in zip(split, blocks, strict=True)]

    def function(name: str, outputs: list[ca.SX], *more: ca.SX) -> ca.Function:
        arguments = [chain.x, p, *model.jets, *more]
        return ca.Function(name, arguments, chain.value(outputs))

    return Nlp(
        **given,
        row_sizes=tuple(b.numel() for b in blocks),
        points=ca.Function("points", [chain.x, p], chain.value([model.given, model.pads])),
        objective=function("objective", [energy]),
        gradient=function("gradient", [energy, chain.gradient(energy)]),
        rows=function("rows", [rows]),
        jacobian=function("jacobian", [rows, chain.jacobian(rows)]),
        hessian=function("hessian", [ca.triu(chain.hessian(parts))], lam_f, lam_g),
        terms=function("terms", [ca.vertcat(*unweighted)]),
        jets=given["layout"].function(),
    )


class _Model:
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
        self.k = x[6 + n + 3 * m :]
        frames = forward(hand, par.wrist, par.joints, v)
        a = chain.lift("tips", frames.tips)
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
        self.grasp = self._grasp(hand, structure, chain, par, (a, s, p, o, v, normals))

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

    def _grasp(
        self,
        hand: Hand,
        structure: Structure,
        chain: Chain,
        par: SimpleNamespace,
        places: tuple[ca.SX, ...],
    ) -> Grasp:
        a, s, p, o, v, normals = places
        m, K, k = len(hand.fingers), structure.samples, self.k
        if structure.equilibrium == "printed":
            B = equilibrium.printed_profile(p, o, k)
        else:
            B = equilibrium.profile(p, o, k, par.mass, par.com)
        B = chain.lift("profile", B)
        R, rho = equilibrium.rotation(B, chain.freeze("root", equilibrium.root_guess(B)))
        attitude = chain.lift("attitude", ca.vertcat(ca.vec(R), rho))
        R, rho = ca.reshape(attitude[:9], 3, 3), attitude[9]
        t = equilibrium.translation(R, p, o, k, par.mass)
        p_eq = chain.lift("contacts_eq", p @ R.T + ca.repmat(t.T, m, 1))
        gain = ca.repmat(k, 1, 3)
        centre, turn = ca.repmat(par.com.T, m, 1), ca.reshape(par.turn, 3, 3)
        arms, forces, load = p - centre, gain * (o - p), ca.vertcat(0, 0, -par.mass * equilibrium.GRAVITY)
        pad = par.pad * self.radii
        links = [i for i in range(len(hand.spheres)) if i not in hand.tip_spheres]
        radii = np.array([sphere.radius for sphere in hand.spheres])
        delta, V, D = self.displacements, self.layout.uncertain, self.layout.distances
        distance = chain.lift("distance", expand(self.jets[0], delta[:D, :]))
        variance = chain.lift("variance", expand(self.jets[1], delta[:V, :]))
        clearances = distance[V : D - m] - radii
        deviation = ca.sqrt(ca.fmax(variance, 0) + MIN_DEVIATION**2)
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
            forces_eq=gain * (o - p_eq),
            wrench=ca.vertcat(ca.sum1(forces) + load.T, ca.sum1(ca.cross(arms, forces, 2))),
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
