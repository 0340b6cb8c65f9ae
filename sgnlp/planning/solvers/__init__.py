"""Solvers of nonlinear programs. Each file of one has its rows of the table, which is put together here.

The same objects serve `sgnlp.solve(solver=...)`, `sgnlp solve --solver NAME` and `sgnlp compare`. One of your own needs
no row: it is a `sgnlp.planning.solvers.solver.Solver` with a `solve`.
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
    """The solver of a name; raises `InputError` with the valid ones."""
    if name not in SOLVERS:
        raise unknown("solver", name, SOLVERS)
    return SOLVERS[name].solver


def settled(solver: Solver | str | None, chosen: settings.Solver) -> Solver:
    """A solver, or that of a name, or Ipopt, with options of the settings where it has none of its own."""
    return (solver_named(solver) if isinstance(solver, str) else solver or ipopt.Ipopt()).settled(chosen)
