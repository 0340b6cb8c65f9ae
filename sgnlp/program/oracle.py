"""An `Nlp` joined with a fitted surface: functions of (x, p) alone, as a solver calls them.

The surface is evaluated once for each new x, for f, ∇f, g, J and H together, and only as far as needed: f and g, which
a trial point of a line search needs, take a quarter of the work.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.program.around import ALONE, Around, Fields
from sgnlp.program.around_jets import AroundJets
from sgnlp.program.nlp import Nlp
from sgnlp.surface import native
from sgnlp.surface.gpis import MEAN_JET, MIN_SLOPE, VARIANCE_JET, Gpis
from sgnlp.surface.jets import Layout

ORDERS = 1 + 3
"""Number of entries of the mean's raw jet from the first step: value and first derivatives."""


class Surface:
    """The jets of a fitted surface at the last points.

    The feet follow from the normals at the contacts; `metric` is the `jets` of the `Nlp`. `evaluations` counts the
    points with values, `completions` those with derivatives. The last block of `jets` is that of the surroundings,
    `fields`, for an `around`: an `Around` and its number of points.
    """

    def __init__(
        self,
        gpis: Gpis,
        layout: Layout,
        metric: ca.Function,
        compiled: bool = True,
        around: tuple[Around, int] = (ALONE, 0),
        fields: Fields | None = None,
    ):
        self.layout, self._metric, self._compiled, self._kinds = layout, metric, compiled, around[0]
        self._buffer, self._evaluate = metric.buffer()
        self._Z = np.zeros((layout.points, 3), order="F")
        self._mean, self._variance = np.zeros((layout.points, MEAN_JET)), np.zeros((layout.uncertain, VARIANCE_JET))
        self.jets = [np.zeros(metric.size_out(i), order="F") for i in range(metric.n_out())]
        for i, raw in enumerate((self._mean, self._variance)):  # C order (Q, 20) is CasADi's column-major (20, Q)
            self._buffer.set_arg(i, raw.data)
        for i, jets in enumerate(self.jets):
            self._buffer.set_res(i, jets.T.data)
        self.around_points = around[1]
        self.evaluations = self.completions = 0
        self.become(gpis, fields)

    def become(self, gpis: Gpis, fields: Fields | None = None) -> None:
        """Switch to another surface and other surroundings; from then on the jets are theirs."""
        layout = self.layout
        self._raw_jets = native.raw_jets(gpis, layout.uncertain, self._compiled)
        sizes = (layout.S, self.around_points, layout.m)
        self._around = AroundJets(fields or Fields(), self._kinds, sizes, self._compiled)
        self.jets[self._metric.n_out() :] = [self._around.jets]
        self._last: tuple[bytes, ...] = ()
        self._complete = False

    def update(self, Z: Array, radii: Array, around: Array, complete: bool) -> None:
        """Update `jets` of `Layout.symbols()` at Z (Q - m, 3) [m] and radii (m) [m], and those at points `around` (P,
        3).

        Derivatives are 0 unless `complete`, now or in an earlier call at the same points.
        """
        asked = (Z.tobytes("F"), radii.tobytes(), around.tobytes("F"))
        new = asked != self._last
        if new:
            self._last, self._complete = asked, False
            self._values(Z, radii)
            self._evaluate()
            self.evaluations += 1
        if complete and not self._complete:
            self._raw_jets.derivatives(self._Z, self._mean, self._variance)
            self._evaluate()
            self._complete = True
            self.completions += 1
            new = True
        if new:
            feet = self._Z[self.layout.before_feet : self.layout.before_feet + self.layout.m]
            self._around.update(around, feet, complete)

    def _values(self, Z: Array, radii: Array) -> None:
        """Raw jets of the first step at the given points and, between them, at the feet."""
        m, before, mean = self.layout.m, self.layout.before_feet, self._mean
        mean[:, ORDERS:], self._variance[:, 1:] = 0, 0
        self._Z[:before], self._Z[before + m :] = Z[:before], Z[before:]
        self._raw_jets.values(self._Z[:before], mean[:before], self._variance)
        gradient = mean[:m, 1:ORDERS]
        normals = gradient / np.sqrt((gradient**2).sum(axis=1, keepdims=True) + MIN_SLOPE**2)
        self._Z[before : before + m] = Z[:m] - radii[:, None] * normals
        self._raw_jets.values(self._Z[before:], mean[before:], self._variance[:0])


class SurfaceJets(ca.Callback):
    """Query points (Q - m, 3), pad radii (m), points around (P, 3) [m] → `jets`, complete or only values."""

    def __init__(self, surface: Surface, complete: bool):
        ca.Callback.__init__(self)
        self._surface, self._complete = surface, complete
        self.construct("surface_jets" if complete else "surface_values", {})

    def get_n_in(self) -> int:
        """Points, radii, points around."""
        return 3

    def get_n_out(self) -> int:
        """Five blocks of jets."""
        return len(self._surface.jets)

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """(Q - m, 3), (m,) and (P, 3)."""
        surface, layout = self._surface, self._surface.layout
        return ca.Sparsity.dense(*[(layout.points - layout.m, 3), (layout.m, 1), (surface.around_points, 3)][i])

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        """As `Layout.symbols()`, and the surroundings'."""
        return ca.Sparsity.dense(*self._surface.jets[i].shape)

    def has_eval_buffer(self) -> bool:
        """It works on raw memory, without conversion of 70 kB to and from CasADi matrices at every call."""
        return True

    def eval_buffer(self, arguments: Sequence[Any], results: Sequence[Any]) -> int:
        """Evaluate the jets that are not known at these points."""
        given, radii, around = (np.frombuffer(a or b"") for a in arguments)  # None if it is empty
        self._surface.update(given.reshape(3, -1).T, radii, around.reshape(3, -1).T, self._complete)
        for result, jets in zip(results, self._surface.jets, strict=True):
            if result is not None:
                np.frombuffer(result)[:] = jets.ravel(order="F")
        return 0


@dataclass(frozen=True, eq=False)
class Functions:
    """f, ∇f, g, J and H of a nonlinear program, functions of (x, p) and, for H, (λ_f, λ_g).

    `gradient` returns (f, ∇f), `jacobian` (g, J), `hessian` the upper triangle.
    """

    objective: ca.Function
    gradient: ca.Function
    rows: ca.Function
    jacobian: ca.Function
    hessian: ca.Function


@dataclass(frozen=True, eq=False)
class Oracle(Functions):
    """The functions of a nonlinear program over a surface."""

    nlp: Nlp
    surface: Surface
    terms: ca.Function
    callbacks: tuple[ca.Callback, ...]
    """Kept here, since CasADi holds no reference to them."""

    def values(self, x: Array, p: Array) -> Array:
        """g (ng,) at x (nx,) and p."""
        return np.array(self.rows(x, p)).ravel()


def join(nlp: Nlp, gpis: Gpis, compiled: bool = True, fields: Fields | None = None) -> Oracle:
    """The oracle of an `Nlp` with a fitted surface and its surroundings.

    The surface's jets are computed in C if `compiled` and there is a compiler.
    """
    around = nlp.structure.around, int(nlp.points.size1_out(2))
    surface = Surface(gpis, nlp.layout, nlp.jets, compiled, around, fields)
    values, jets = SurfaceJets(surface, complete=False), SurfaceJets(surface, complete=True)
    x, p = ca.MX.sym("x", len(nlp.units)), ca.MX.sym("p", sum(nlp.parameters.sizes.values()))
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", sum(nlp.row_sizes))

    def compose(function: ca.Function, step: SurfaceJets, more: list[ca.MX], outputs: list[str]) -> ca.Function:
        results = function(x, p, *step(*nlp.points(x, p)), *more)
        results = list(results) if isinstance(results, tuple | list) else [results]
        names = ["x", "p", *(symbol.name() for symbol in more)]
        return ca.Function(function.name(), [x, p, *more], results, names, outputs)

    return Oracle(
        nlp=nlp,
        surface=surface,
        objective=compose(nlp.objective, values, [], ["f"]),
        gradient=compose(nlp.gradient, jets, [], ["f", "grad_f_x"]),
        rows=compose(nlp.rows, values, [], ["g"]),
        jacobian=compose(nlp.jacobian, jets, [], ["g", "jac_g_x"]),
        hessian=compose(nlp.hessian, jets, [lam_f, lam_g], ["triu_hess_gamma_x_x"]),
        terms=compose(nlp.terms, values, [], ["terms"]),
        callbacks=(values, jets),
    )
