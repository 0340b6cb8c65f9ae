"""Solvers of SciPy, whose optimisers are imported only when needed: that takes a tenth of a second."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from sgnlp.base.arrays import Array
from sgnlp.planning.solvers.solver import NlpInstance, Solver


@dataclass(frozen=True)
class ScipySolver(Solver):
    """A method of SciPy's `minimize`."""

    def prepare(self, nlp: NlpInstance) -> None:
        """Import it."""
        import_module("scipy.optimize")


def minimise(nlp: NlpInstance, method: str, f: Callable[..., Any], x: Array, jac: Any, **given: Any) -> Any:
    """The result of a method within the bounds of the variables. SciPy caches a point's values itself."""
    optimize = import_module("scipy.optimize")
    return optimize.minimize(f, x, jac=jac, bounds=optimize.Bounds(*nlp.x_bounds), method=method, **given)
