"""The functions of a task as SciPy calls them, in NumPy."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from sgnlp.planning.solvers.anatomy import Task

Array = NDArray[np.float64]

minimise: Any = minimize
"""SciPy's `minimize`; its overloads are many and none is for the options that are set here."""


class Numpy:
    """f, ∇f, g, J and H(λ) of a task; SciPy remembers a point's values by itself."""

    def __init__(self, task: Task):
        self._f, self._p = task.functions, task.p

    def objective(self, x: Array) -> float:
        """f."""
        return float(self._f.objective(x, self._p))

    def gradient(self, x: Array) -> Array:
        """∇f (nx,)."""
        return np.array(self._f.gradient(x, self._p)[1]).ravel()

    def rows(self, x: Array) -> Array:
        """g (ng,)."""
        return np.array(self._f.rows(x, self._p)).ravel()

    def jacobian(self, x: Array) -> Array:
        """J (ng, nx)."""
        return np.array(self._f.jacobian(x, self._p)[1])

    def hessian(self, x: Array, lam_f: float, lam_g: Array) -> Array:
        """λ_f ∇²f + Σ λ_g ∇²g (nx, nx)."""
        U = np.array(self._f.hessian(x, self._p, lam_f, lam_g))
        return U + np.triu(U, 1).T
