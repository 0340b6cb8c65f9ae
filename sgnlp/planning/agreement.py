"""Compares what the user's own terms and constraints are to the solver, in CasADi, with what they are in NumPy.

The same expression can mean two things: `A[0]` is an element of a matrix in CasADi and a row in NumPy. And functions
that were built before keep the numbers that a term then had. Either way the solver would see one thing, and the result
would say another.
"""

from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import Problem
from sgnlp.planning.recompute import recompute
from sgnlp.planning.starts import Start
from sgnlp.program.constraint import Constraint, is_own
from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import ROUND_NORM, Exact
from sgnlp.program.terms import Term
from sgnlp.program.variables import posture

NARROW = {"distance": 1e-9, "collision": 1e-9, "force": 1e-9, "deviation": 1e-9, "exponent": 1e12, "foot": 1.0}
"""Widths at which the smooth operations are nearly the exact ones, and the contact is measured where NumPy does."""
SHARE, LEAST = 0.01, 1e-9
"""Two values differ if they do by more than this share of the larger one, and by more than the least."""
PAGE = "docs/pages/howto/term.md"
ROW = "a row of a matrix is A[i, :]"
HINTS = {
    "term": f"{ROW}, numbers that change are fields of the class: {PAGE}",
    "constraint": f"{ROW}, numbers that change need a new function: {PAGE}",
}
MATH = f"float and functions of math, such as math.sqrt, give NaN for CasADi's values: write x ** 0.5 ({PAGE})"
WRITES = f"it writes into a part of g, which can be read only: write z = z - a, not z -= a ({PAGE})"
READ_ONLY = "read-only"
"""NumPy's word for it."""


class Narrow(Exact):
    """The exact operations, but those that smoothing changes at any width."""

    def __init__(self, log_width: float) -> None:
        self.log_width = log_width

    def norm(self, A: Any) -> Any:
        """√(|a|² + w²) row by row."""
        return np.sqrt(np.sum(A**2, axis=1) + ROUND_NORM**2)

    def log(self, u: Any) -> Any:
        """The smooth logarithm."""
        return np.log(self.log_width) + np.arcsinh(u / (2 * self.log_width))


def agree(problem: Problem, start: Start) -> None:
    """Raise `InputError` if a term or constraint of the user's own has other values in CasADi than in NumPy.

    They are compared at the start, in the last program that the problem's formulation solves.
    """
    terms = {term.name: term for term in problem.terms if is_own(type(term))}
    constraints = {one.name: one for one in problem.constraints if is_own(one.value)}
    if not (terms or constraints) or problem.settings.contact.equilibrium == "printed":
        return
    planner = Planner(problem)
    stage, contact = planner.stages[-1], problem.settings.contact
    instance, x = planner.begin(stage, start)
    nlp, seed = stage.nlp, (start.wrist, start.joints)
    p = nlp.parameters.pack(vars(nlp.parameters.unpack(instance.p)) | NARROW)
    g, _ = recompute(problem, posture(problem.hand, nlp.structure.at_contact, seed, x, contact.c))
    op = Narrow(problem.settings.smoothing.log)
    seen = np.array(stage.oracle.terms(x, p)).ravel()
    for term, value in zip(nlp.structure.objective, seen, strict=True):
        if term.name in terms:
            _compare(terms[term.name], np.array([value]), g, op)
    rows = stage.oracle.values(nlp.structure.formulation.strict(nlp, x), p)
    blocks = np.split(rows, np.cumsum(nlp.row_sizes)[:-1])
    for constraint, values in zip(nlp.constraints, blocks, strict=True):
        if constraint.name in constraints:
            _compare(constraints[constraint.name], constraint.scale * values, g, op)


def _compare(part: Term | Constraint, solver: Array, g: Grasp, op: Narrow) -> None:
    """Raise `InputError` if a part has other values than those (k,) that the solver sees."""
    kind = "constraint" if isinstance(part, Constraint) else "term"
    what, hint = f"{kind} '{part.name}'", HINTS[kind]
    try:
        ours = np.asarray(part.value(g, op), dtype=float).ravel(order="F")
    except Exception as error:
        said = next(iter(str(error).splitlines()), "")
        if isinstance(error, ValueError) and READ_ONLY in said:
            raise InputError(f"{what}: {WRITES}") from error
        raise InputError(f"{what} cannot be computed in NumPy: {type(error).__name__}: {said}; {hint}") from error
    if ours.shape != solver.shape:
        raise InputError(f"{what} has {solver.size} values in CasADi and {ours.size} in NumPy; {hint}")
    for name, values in {"CasADi": solver, "NumPy": ours}.items():
        if not np.isfinite(values).all():
            hint = MATH if values is solver and np.isfinite(ours).all() else hint
            raise InputError(f"{what} is not finite in {name} at the first start; {hint}")
    off = np.abs(solver - ours)
    if (off > np.maximum(SHARE * np.maximum(np.abs(solver), np.abs(ours)), LEAST)).any():
        i = int(off.argmax())
        raise InputError(f"{what} is {solver[i]:.3g} in CasADi and {ours[i]:.3g} in NumPy at the first start; {hint}")
