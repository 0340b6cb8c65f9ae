"""Solvers of nonlinear programs. Each solver's file has its rows of the table, which is assembled here.

The same objects serve `sgnlp.solve(solver=...)`, `sgnlp solve --solver NAME` and `sgnlp compare`. A solver of your own
needs no row: it is a subclass of `sgnlp.Solver` with a `solve`.
"""

from sgnlp.base import settings
from sgnlp.base.errors import unknown
from sgnlp.planning.solvers import first_order, ipopt, lbfgsb, plugins, slsqp, trust_constr
from sgnlp.planning.solvers.solver import Entry, Solver

SOLVERS: dict[str, Entry] = {
    entry.solver.name: entry
    for module in (ipopt, plugins, slsqp, trust_constr, lbfgsb, first_order)
    for entry in module.ENTRIES
}
"""The table of solvers, by name."""


def solver_named(name: str) -> Solver:
    """The solver of this name; raises `InputError` with the valid names."""
    if name not in SOLVERS:
        raise unknown("solver", name, SOLVERS)
    return SOLVERS[name].solver


def settled(solver: Solver | str | None, chosen: settings.Solver) -> Solver:
    """The given solver (an object, a name, or None for Ipopt); options that it leaves open come from the settings."""
    return (solver_named(solver) if isinstance(solver, str) else solver or ipopt.Ipopt()).settled(chosen)
