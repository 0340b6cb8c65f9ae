"""The constrained program with slacks: where its constraints cannot be met, it says by how much they are missed.

    min_{x, s⁺, s⁻}  f(x) + w Σ(s⁺ + s⁻)   subject to   g_low ≤ g(x) + s⁺ - s⁻ ≤ g_high,   s⁺, s⁻ ≥ 0

This is an exact penalty: a solution of the constrained program with multipliers smaller than w is also a solution of
this program, with zero slacks. Otherwise the solution has the smallest sum of violations, in the scales of the rows,
that the rest of the objective allows. Rows that keep the functions defined (`Constraint.domain`) have no slack: these
have to be met.

Only the slacks are new: the functions of the constrained program, compiled or not, are used unchanged.
"""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.settings import Solver
from sgnlp.program.formulation import Bounds, Formulation, Phase
from sgnlp.program.formulations.constrained import Constrained
from sgnlp.program.formulations.penalty import FreeWrist
from sgnlp.program.nlp import Nlp
from sgnlp.program.oracle import Oracle
from sgnlp.program.parameters import ParameterVector


@dataclass(frozen=True)
class Elastic(Constrained):
    """The penalty formulation for a few iterations, then the constrained one with slacks."""

    def phases(self, solver: Solver) -> tuple[Phase, ...]:
        """Penalty, then elastic."""
        return Phase(FreeWrist(), solver.penalty_iterations), Phase(self, solver.max_iterations)

    @property
    def inner(self) -> Formulation:
        """The constrained one."""
        return Constrained()

    def wrap(self, nlp: Nlp) -> Nlp:
        """The elastic program of a constrained one: variables (x, s⁺, s⁻) and, as the last parameter, w."""
        nx, ng = len(nlp.units), sum(nlp.row_sizes)
        parameters = ParameterVector(nlp.parameters.sizes | {"elastic": 1})
        z, q = ca.MX.sym("x", nx + 2 * ng), ca.MX.sym("p", sum(parameters.sizes.values()))
        x, s = z[:nx], z[nx:]
        p, w = q[:-1], q[-1]
        jets = [ca.MX.sym(name, *nlp.objective.size_in(name)) for name in nlp.objective.name_in()[2:]]
        lam = [ca.MX.sym(name, *nlp.hessian.size_in(name)) for name in nlp.hessian.name_in()[2 + len(jets) :]]
        stretch = ca.horzcat(ca.DM.eye(ng), -ca.DM.eye(ng))
        f, gradient = nlp.gradient(x, p, *jets)
        g, J = nlp.jacobian(x, p, *jets)

        def function(name: str, outputs: list[ca.MX], *more: ca.MX) -> ca.Function:
            return ca.Function(name, [z, q, *jets, *more], outputs)

        return replace(
            nlp,
            structure=replace(nlp.structure, formulation=self),
            parameters=parameters,
            variable_names=(*nlp.variable_names, *(f"{sign}{row}" for sign in "+-" for row in nlp.row_names)),
            units=np.concatenate([nlp.units, np.ones(2 * ng)]),
            points=ca.Function("points", [z, q], nlp.points(x, p)),
            objective=function("objective", [nlp.objective(x, p, *jets) + w * ca.sum1(s)]),
            gradient=function("gradient", [f + w * ca.sum1(s), ca.vertcat(gradient, ca.repmat(w, 2 * ng))]),
            rows=function("rows", [nlp.rows(x, p, *jets) + stretch @ s]),
            jacobian=function("jacobian", [g + stretch @ s, ca.horzcat(J, stretch)]),
            hessian=function("hessian", [ca.diagcat(nlp.hessian(x, p, *jets, *lam), ca.MX(2 * ng, 2 * ng))], *lam),
            terms=function("terms", [nlp.terms(x, p, *jets)]),
        )

    def variable_bounds(self, nlp: Nlp, g_bounds: Bounds) -> Bounds:
        """Slacks are non-negative; for a missing bound, or a row that must not be violated, they are 0."""
        low, high = g_bounds
        soft = np.repeat([not c.domain for c in nlp.constraints], nlp.row_sizes)
        upper = np.where(np.concatenate([soft & np.isfinite(low), soft & np.isfinite(high)]), np.inf, 0.0)
        return np.zeros_like(upper), upper

    def begin(self, oracle: Oracle, x: Array, p: Array, g_bounds: Bounds) -> Array:
        """The slacks s⁺, s⁻ that bring the rows within their bounds (ng,)."""
        low, high = g_bounds
        g = oracle.values(np.concatenate([x, np.zeros(2 * len(low))]), p)
        return np.concatenate([np.maximum(low - g, 0), np.maximum(g - high, 0)])

    def strict(self, nlp: Nlp, x: Array) -> Array:
        """x with slacks of 0."""
        slacks = 2 * sum(nlp.row_sizes)
        return np.concatenate([x[: len(x) - slacks], np.zeros(slacks)])
