"""The nonlinear program and its exact derivatives, built once for a hand and a formulation.

    min_x  E(x)   subject to   g_low ≤ g(x) ≤ g_high,  x_low ≤ x ≤ x_high

over the variables of `sgnlp.program.variables`.

The functions take jets of the surface at the query points z(x) as inputs (`sgnlp.surface.jets`), so one `Nlp` serves
every object. Object, weights, widths and seed pose are parameters. `oracle.py` joins an `Nlp` with a fitted surface.
"""

import textwrap
import traceback
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.hand.hand import Hand
from sgnlp.program.constraint import Constraint, is_own
from sgnlp.program.grasp import Grasp
from sgnlp.program.lifting import Lifting
from sgnlp.program.model import Model, layout
from sgnlp.program.names import row_names
from sgnlp.program.ops import Ops, Smooth
from sgnlp.program.parameters import ParameterVector
from sgnlp.program.structure import Structure
from sgnlp.program.terms.term import Term
from sgnlp.surface.jets import Layout
from sgnlp.surface.kernel import NUMPY, NUMPY_CALLED

ENERGY_UNIT = 100.0
"""The objective that the solver sees is E/ENERGY_UNIT."""


@dataclass(frozen=True)
class Nlp:
    """Functions of one structure.

    `points` (x, p) → the given query points (Q - m, 3) [m], the distances of the feet below the contacts (m) [m], and
    the points of `structure.around` (P, 3) [m];
    `objective`, `gradient`, `rows`, `jacobian` (x, p, jets…); `hessian` (x, p, jets…, λ_f, λ_g), the upper triangle;
    `terms` (x, p, jets…), the smooth terms unweighted; `jets`, the function `layout.function()`. The jets are the four
    blocks of `layout.symbols()` and the block of `sgnlp.program.around`.
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


KEPT = 32
"""Programs that a process keeps, of 9 to 18 MB each. A study or a batch of several presets, formulations and arms comes
back to more than 8, and building one again takes half a second."""

FOREIGN = ("truth value", "'SX' object")
"""Words in errors of functions that do not take CasADi's values."""
REMEDY = (
    "write it in the operations of `op`, such as op.sum, op.norm and op.dot, and in + - * / **: functions of NumPy and "
    "of math, `if` and loops over rows do not take CasADi's values (docs/pages/howto/term.md)"
)
ARGUMENTS = "a term has `value(self, g, op)`, and the function of a constraint takes `(g, op)`"
LONGEST = 200
"""So many characters of an error of a term or constraint are told."""
FUNCTIONS = ("points", "objective", "gradient", "rows", "jacobian", "hessian", "terms", "jets")
"""The names of the functions of an `Nlp`."""


def parameter_vector(hand: Hand, terms: int) -> ParameterVector:
    """The blocks of p for a hand and a number of terms."""
    n = len(hand.joint_names)
    sizes = {
        "wrist": 7,
        "joints": n,
        "weights": terms,
        "c": 1,
        "friction": 1,
        "pad": 1,
        "foot": 1,
        "force_min": 1,
    }
    sizes |= {
        "displacement": 3,
        "rotation_desired": 9,
        "mass": 1,
        "com": 3,
        "table": 1,
        "ball_centre": 3,
        "ball_radius": 1,
        "standoff": 1,
        "lift": 1,
    }
    sizes |= {"base": 7, "arm": len(hand.arm.joint_names)} if hand.arm else {}
    widths = {"distance": 1, "collision": 1, "log_width": 1, "force": 1, "deviation": 1, "exponent": 1}
    return ParameterVector(sizes | widths)


def frame(hand: Hand, structure: Structure, row_sizes: Sequence[int]) -> dict[str, Any]:
    """The fields of an `Nlp` other than its symbolic functions, for the number of rows of each constraint."""
    variables = structure.variables(hand)
    return {
        "structure": structure,
        "hand": hand,
        "parameters": parameter_vector(hand, len(structure.terms)),
        "layout": layout(hand, structure),
        "terms_used": structure.objective,
        "constraints": structure.rows,
        "row_sizes": tuple(row_sizes),
        "row_names": row_names(hand, structure.rows, row_sizes),
        "variable_names": variables.names,
        "units": variables.units,
    }


@lru_cache(maxsize=KEPT)
def build(hand: Hand, structure: Structure) -> Nlp:
    """Build the functions of a hand and structure; equal arguments give the same object."""
    hand, terms, constraints = structure.of(hand), structure.objective, structure.rows
    units = structure.variables(hand).units
    p, par = parameter_vector(hand, len(structure.terms)).symbols()
    lifting = Lifting(ca.SX.sym("x", len(units)))
    model = Model(hand, structure, lifting, par, units)
    widths = (par.distance, par.collision, par.log_width, par.force, par.deviation, par.exponent)
    op = Smooth(*widths, lifting.lift)
    unweighted = [_value(t, model.grasp, op, hand) for t in terms]
    weights = [par.weights[structure.terms.index(t)] / ENERGY_UNIT for t in terms]
    weighted = [w * e for w, e in zip(weights, unweighted, strict=True)]
    blocks = [_value(c, model.grasp, op, hand) / c.scale for c in constraints]
    rows, energy = ca.densify(ca.vertcat(*blocks)), sum(weighted, start=ca.SX(0))
    lam_f, lam_g = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", rows.numel())
    split = ca.vertsplit(lam_g, [0, *np.cumsum([b.numel() for b in blocks]).tolist()])
    parts = [lam_f * w for w in weighted] + [ca.dot(lam, b) for lam, b in zip(split, blocks, strict=True)]
    H = ca.triu(lifting.hessian(parts))
    written = [energy, lifting.gradient(energy), rows, lifting.jacobian(rows), H, ca.vertcat(*unweighted)]
    f, slope, g, J, H, each = lifting.values(written)
    arguments = [lifting.x, p, *model.jets, model.field_jets]
    return Nlp(
        **frame(hand, structure, [b.numel() for b in blocks]),
        points=ca.Function("points", [lifting.x, p], lifting.values([model.given, model.pads, model.around])),
        objective=ca.Function("objective", arguments, [f]),
        gradient=ca.Function("gradient", arguments, [f, slope]),
        rows=ca.Function("rows", arguments, [g]),
        jacobian=ca.Function("jacobian", arguments, [g, J]),
        hessian=ca.Function("hessian", [*arguments, lam_f, lam_g], [H]),
        terms=ca.Function("terms", arguments, [each]),
        jets=model.layout.function(),
    )


def _value(part: Term | Constraint, g: Grasp, op: Smooth, hand: Hand) -> ca.SX:
    """A term (1,) or the rows (k,) of a constraint as an expression; raises `InputError` if it is not one."""
    kind = "constraint" if isinstance(part, Constraint) else "term"
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("error", NUMPY, FutureWarning)
            given = part.value(g, op)
            if given is None:
                raise InputError(f"{kind} '{part.name}' gives no value; return one")
            if isinstance(given, list | tuple):
                raise InputError(f"{kind} '{part.name}' gives a {type(given).__name__}; put its parts into op.stack")
            value = ca.vec(ca.SX(given))
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        said, place = _cause(error, g), _line(part.value, error)
        foreign = isinstance(error, FutureWarning | TypeError) or any(word in said for word in FOREIGN)
        remedy = f"; {REMEDY if place else ARGUMENTS}" if foreign else ""
        raise InputError(f"{kind} '{part.name}' cannot be written in CasADi{place}: {said}{remedy}") from error
    if isinstance(part, Constraint) and is_own(part.value) and not value.numel():
        raise InputError(
            f"constraint '{part.name}' has no rows for the hand '{hand.name}', so it would bound nothing; leave it out "
            "for this hand, or let its value be of something that the hand has"
        )
    if isinstance(part, Term) and value.numel() != 1:
        raise InputError(f"term '{part.name}' has {value.numel()} values, not one; sum them with op.sum")
    return value


def _cause(error: BaseException, g: Grasp) -> str:
    """What was wrong, in one line: CasADi adds pages of advice to some messages."""
    if isinstance(error, FutureWarning):
        return NUMPY_CALLED
    if isinstance(error, AttributeError) and isinstance(error.obj, Grasp | Smooth):
        said, names = ("g", vars(error.obj)) if isinstance(error.obj, Grasp) else ("op", vars(Ops))
        return f"{said} has no '{error.name}'; valid: {', '.join(sorted(name for name in names if name[0] != '_'))}"
    if isinstance(error, KeyError):
        return f"KeyError: {error}; the names in g.links: {', '.join(sorted(g.links))}"
    said = textwrap.shorten(str(error).partition(" Did you ")[0], LONGEST, placeholder=" …").rstrip(".:")
    return f"{type(error).__name__}: {said}"


def _line(value: Any, error: BaseException) -> str:
    """The line of the user's function at which it failed, in words; "" if it is not known."""
    file = getattr(getattr(value, "__code__", None), "co_filename", None)
    lines = [each for each in traceback.extract_tb(error.__traceback__) if each.filename == file]
    if not lines:
        return ""
    text = textwrap.shorten(lines[-1].line or "", 80)  # none where the function was typed into a console
    return f" at line {lines[-1].lineno}" + (f", {text!r}" if text else "")
