"""The nonlinear program and its exact derivatives, built once for a hand and a formulation.

    min_x  E(x)   subject to   g_low ≤ g(x) ≤ g_high,  x_low ≤ x ≤ x_high,      x = (v (6 + n), o (3 m), k (m))/units

and, in the lifted formulation, tips (3 m), Gibbs vector (3) and shift (3) of the equilibrium too (`lifted.py`).

The functions take jets of the surface at the query points z(x) as inputs (`sgnlp.surface.jets`), so one `Nlp` serves
every object; object, weights, widths and seed pose are parameters. `oracle.py` joins an `Nlp` with a fitted surface.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import integrate
from sgnlp.program.constraints import Constraint, active
from sgnlp.program.lifting import Chain
from sgnlp.program.model import Model
from sgnlp.program.names import lifted_names, row_names, variable_names
from sgnlp.program.ops import Smooth
from sgnlp.program.parameters import ParameterVector
from sgnlp.program.structure import Structure
from sgnlp.program.terms import TERMS, Term
from sgnlp.surface.jets import Layout

Array = NDArray[np.float64]

UNITS = {"linear": 0.1, "angular": 1.0, "joint": 1.0, "target": 0.1, "gain": 100.0}
"""Units of the scaled variables [m, rad, rad, m, N/m], so that all are of order 1."""
LIFTED_UNITS = {"tip": 0.1, "turn": 0.1, "shift": 0.01}
"""Units of the variables that the lifted formulation adds [m, -, m]."""
ENERGY_UNIT = 100.0
"""The objective that the solver sees is E/ENERGY_UNIT."""


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
    row_names: tuple[str, ...]  # (ng,)
    variable_names: tuple[str, ...]  # (nx,)
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
    """The unit of each variable (nx,) that every formulation has."""
    return np.array([UNITS[kind] for kind in variable_kinds(hand)])


def grasp_variables(hand: Hand, wrist: Array, joints: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    """wrist (7), joints (n), targets (m, 3), gains (m) of unscaled y about a seed pose; the rest is left out."""
    n, m = len(hand.joint_names), len(hand.fingers)
    tangent, targets, gains = np.split(y[: 6 + n + 4 * m], [6 + n, 6 + n + 3 * m])
    return *integrate(hand, wrist, joints, tangent), targets.reshape(m, 3), gains


def lifted_units(hand: Hand) -> Array:
    """The unit of each variable (3 m + 6) that the lifted formulation adds."""
    kinds = ["tip"] * (3 * len(hand.fingers)) + ["turn"] * 3 + ["shift"] * 3
    return np.array([LIFTED_UNITS[kind] for kind in kinds])


def frame(hand: Hand, structure: Structure) -> dict[str, Any]:
    """The fields of an `Nlp` that need no symbolic function."""
    penalty = structure.formulation == "penalty"
    terms = [t for t in TERMS if not t.metric or t.metric == structure.metric]
    constraints = active(structure.traits)
    lifted = structure.lifted
    return {
        "structure": structure,
        "hand": hand,
        "parameters": parameter_vector(hand),
        "layout": Layout(len(hand.fingers), structure.samples, len(hand.spheres)),
        "terms_used": tuple(t for t in terms if penalty or not t.constrained_elsewhere),
        "constraints": constraints,
        "row_names": row_names(hand, constraints),
        "variable_names": variable_names(hand) + (lifted_names(hand) if lifted else ()),
        "units": np.concatenate([variable_units(hand), *([lifted_units(hand)] if lifted else [])]),
    }


@lru_cache(maxsize=8)
def build(hand: Hand, structure: Structure) -> Nlp:
    """Build the functions of a hand and structure; the same ones give the same object."""
    given = frame(hand, structure)
    p, par = given["parameters"].symbols()
    chain = Chain(ca.SX.sym("x", len(given["units"])))
    model = Model(hand, structure, chain, par, given["units"])
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
