"""An `Nlp` joined with a fitted surface: functions of (x, p) alone, as a solver calls them.

The surface is evaluated once for each new x, however many of f, ∇f, g, J and H are asked for there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp import native
from sgnlp.gpis import MEAN_JET, MIN_SLOPE, VARIANCE_JET, Gpis
from sgnlp.jets import Layout
from sgnlp.nlp import Nlp

Array = NDArray[np.float64]


class SurfaceJets(ca.Callback):
    """Given query points (Q - m, 3) and pad radii (m) [m] → the jets of `Layout.symbols()`.

    The feet follow from the normals at the contacts; `metric` is the `jets` of the `Nlp`. The answer at the last points
    is remembered.
    """

    def __init__(self, gpis: Gpis, layout: Layout, metric: ca.Function, compiled: bool = True):
        ca.Callback.__init__(self)
        self._layout, library = layout, native.library() if compiled else None
        self._raw_jets = gpis.jets if library is None else native.NativeJets(library, gpis)
        self._metric = metric
        self._buffer, self._evaluate = self._metric.buffer()
        self._raw = np.zeros((layout.points, MEAN_JET)), np.zeros((layout.uncertain, VARIANCE_JET))
        shapes = [self._metric.size_out(i) for i in range(self._metric.n_out())]
        self._jets = [np.zeros(shape, order="F") for shape in shapes]
        for i, raw in enumerate(self._raw):  # C order (Q, 20) is CasADi's column-major (20, Q)
            self._buffer.set_arg(i, raw.data)
        for i, jets in enumerate(self._jets):
            self._buffer.set_res(i, jets.T.data)
        self._last = np.full((layout.points - layout.m, 3), np.nan), np.full(layout.m, np.nan)
        self.evaluations = 0
        self.construct("surface_jets", {})

    def get_n_in(self) -> int:
        """Points and radii."""
        return 2

    def get_n_out(self) -> int:
        """Four blocks of jets."""
        return len(self._jets)

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """(Q - m, 3) and (m,)."""
        m = self._layout.m
        return ca.Sparsity.dense(*[(self._layout.points - m, 3), (m, 1)][i])

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        """As `Layout.symbols()`."""
        return ca.Sparsity.dense(*self._metric.size_out(i))

    def has_eval_buffer(self) -> bool:
        """Evaluated on raw memory: no conversion of 70 kB to and from CasADi matrices at every call."""
        return True

    def eval_buffer(self, arguments: Sequence[Any], results: Sequence[Any]) -> int:
        """Evaluate, or repeat the last answer when the points have not changed."""
        Z = np.frombuffer(arguments[0], dtype=float).reshape(3, -1).T
        radii = np.frombuffer(arguments[1], dtype=float)
        if not (np.array_equal(Z, self._last[0]) and np.array_equal(radii, self._last[1])):
            self._last = Z.copy(), radii.copy()
            self._fill(*self._last)
            self._evaluate()
            self.evaluations += 1
        for result, jets in zip(results, self._jets, strict=True):
            if result is not None:
                np.frombuffer(result, dtype=float)[:] = jets.ravel(order="F")
        return 0

    def _fill(self, Z: Array, radii: Array) -> None:
        """Raw jets at the given points and, between them, at the feet."""
        m, before = self._layout.m, self._layout.before_feet
        mean, variance = self._raw
        given, variance[:] = self._raw_jets(Z, self._layout.uncertain)
        gradient = given[:m, 1:4]
        normals = gradient / np.sqrt((gradient**2).sum(axis=1, keepdims=True) + MIN_SLOPE**2)
        mean[:before], mean[before + m :] = given[:before], given[before:]
        mean[before : before + m] = self._raw_jets(Z[:m] - radii[:, None] * normals, 0)[0]


@dataclass(frozen=True)
class Oracle:
    """f, ∇f, g, J and H of a nonlinear program over a surface, functions of (x, p) and, for H, (λ_f, λ_g).

    `gradient` returns (f, ∇f), `jacobian` (g, J), `hessian` the upper triangle.
    """

    nlp: Nlp
    surface: SurfaceJets
    objective: ca.Function
    gradient: ca.Function
    rows: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    terms: ca.Function


def join(nlp: Nlp, gpis: Gpis, compiled: bool = True) -> Oracle:
    """The oracle of an `Nlp` over a fitted surface, its jets in C if `compiled` and there is a compiler."""
    surface = SurfaceJets(gpis, nlp.layout, nlp.jets, compiled)
    x, p = ca.MX.sym("x", len(nlp.units)), ca.MX.sym("p", sum(nlp.parameters.sizes.values()))
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", sum(nlp.row_sizes))
    jets = surface(*nlp.points(x, p))

    def compose(function: ca.Function, more: list[ca.MX], names: list[str], outputs: list[str]) -> ca.Function:
        results = function(x, p, *jets, *more)
        results = list(results) if isinstance(results, tuple | list) else [results]
        return ca.Function(function.name(), [x, p, *more], results, names, outputs)

    xp = ["x", "p"]
    return Oracle(
        nlp=nlp,
        surface=surface,
        objective=compose(nlp.objective, [], xp, ["f"]),
        gradient=compose(nlp.gradient, [], xp, ["f", "grad_f_x"]),
        rows=compose(nlp.rows, [], xp, ["g"]),
        jacobian=compose(nlp.jacobian, [], xp, ["g", "jac_g_x"]),
        hessian=compose(nlp.hessian, [lam_f, lam_g], [*xp, "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]),
        terms=compose(nlp.terms, [], xp, ["terms"]),
    )
