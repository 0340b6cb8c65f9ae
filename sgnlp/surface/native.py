"""The raw jets of the surface in C, compiled once by the system's compiler and kept in the user's cache.

`gpis_jets.c` computes the same as `Gpis.mean_jet` and `Gpis.variance_jet` in NumPy, six times as fast and in two steps.
It is used if there is a C compiler. The library has the jets of shapes too (`native_shapes.py`).
"""

import ctypes
import math
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.c_library import CLibrary
from sgnlp.surface.gpis import Gpis
from sgnlp.surface.kernel import Kernel
from sgnlp.surface.kernels import Matern32, Matern52, SquaredExponential, ThinPlate

LIBRARY = CLibrary(
    "jets", "sgnlp.surface", ("gpis_jets.c", "shape_jets.c"), "-O2", ("gpis_values", "gpis_derivatives", "shape_jets")
)
"""-O3 gains nothing."""
ROWS, COLUMNS, WORK, LANES = 8, 12, 5, 8
"""Constants of the C source: rows of a panel of L⁻¹ and of its transpose, work vectors for each training point, and the
largest number of points in a vector."""
ALIGNMENT = 64
"""Alignment of the arrays [bytes]: a cache line, and the widest vector."""
CODES: dict[type[Kernel], int] = {ThinPlate: 0, Matern32: 1, Matern52: 2, SquaredExponential: 3}
"""Numbers of the kernels in the C source."""


class _Surface(ctypes.Structure):
    """`surface` of the C source."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("kernel", "n")),
        *((name, ctypes.c_double) for name in ("prior", "support_radius", "amplitude", "prior_variance")),
        *((name, ctypes.c_void_p) for name in ("X", "alpha", "forward", "backward", "work")),
    )


class NativeJets:
    """The jets of one fitted surface by the compiled library, with variances of at most `uncertain` points.

    It has one workspace, so threads must not share it.
    """

    def __init__(self, library: ctypes.CDLL, gpis: Gpis, uncertain: int):
        N, multiple = len(gpis.X), math.lcm(ROWS, COLUMNS)
        n = -(-N // multiple) * multiple  # padded with copies of the first point, with weight 0
        X, alpha, chol_inverse = np.tile(gpis.X[0], (n, 1)), np.zeros(n), np.zeros((n, n))
        X[:N], alpha[:N], chol_inverse[:N, :N] = gpis.X, gpis.alpha, np.tril(gpis.chol_inverse)
        forward = np.concatenate([chol_inverse[i : i + ROWS, : i + ROWS].T.ravel() for i in range(0, n, ROWS)])
        backward = np.concatenate([chol_inverse[i:, i : i + COLUMNS].ravel() for i in range(0, n, COLUMNS)])
        work = np.zeros((WORK * LANES + uncertain + LANES) * n)
        self._arrays = [_aligned(a.ravel()) for a in (X, alpha, forward, backward, work)]
        kernel = gpis.kernel
        numbers = (gpis.prior, kernel.support_radius, kernel.amplitude, gpis.prior_variance)
        self._surface = _Surface(CODES[type(kernel)], n, *numbers, *(a.ctypes.data for a in self._arrays))
        self._library = library

    def values(self, Z: Array, mean: Array, variance: Array) -> None:
        """μ and ∇μ at Z (Q, 3) [m] into mean[:, :4] (Q, 20), σ² at the first V points into variance[:, 0] (V, 10).

        The columns of Z and the rows of the jets must be contiguous.
        """
        self._call(self._library.gpis_values, Z, mean, variance)

    def derivatives(self, Z: Array, mean: Array, variance: Array) -> None:
        """The rest of the jets. The V points are those of the last call of `values` with V > 0."""
        self._call(self._library.gpis_derivatives, Z, mean, variance)

    def _call(self, function: Any, Z: Array, mean: Array, variance: Array) -> None:
        function(
            ctypes.byref(self._surface),
            ctypes.c_int64(len(mean)),
            ctypes.c_int64(len(variance)),
            ctypes.c_void_p(Z.ctypes.data),
            ctypes.c_int64(Z.strides[1] // Z.itemsize),
            ctypes.c_void_p(mean.ctypes.data),
            ctypes.c_void_p(variance.ctypes.data),
        )


class NumpyJets:
    """The same steps in NumPy, without a compiler: the first step computes everything."""

    def __init__(self, gpis: Gpis):
        self._gpis = gpis

    def values(self, Z: Array, mean: Array, variance: Array) -> None:
        """Jets of the mean (Q, 20) at Z (Q, 3) [m], and of the variance (V, 10) at the first V of them."""
        mean[:], variance[:] = self._gpis.mean_jet(Z), self._gpis.variance_jet(Z[: len(variance)])

    def derivatives(self, Z: Array, mean: Array, variance: Array) -> None:
        """They are there."""


def raw_jets(gpis: Gpis, uncertain: int, compiled: bool = True) -> NativeJets | NumpyJets:
    """The jets of a fitted surface, with variances of at most `uncertain` points; in C if `compiled` and possible.

    A kernel that is not in the C source is evaluated in NumPy.
    """
    loaded = LIBRARY.load() if compiled and type(gpis.kernel) in CODES else None
    return NumpyJets(gpis) if loaded is None else NativeJets(loaded, gpis, uncertain)


def _aligned(values: Array) -> Array:
    """A copy of values (n,) that begins at a multiple of `ALIGNMENT`."""
    room = np.zeros(values.size + ALIGNMENT // values.itemsize)
    shift = (-room.ctypes.data % ALIGNMENT) // values.itemsize
    copy = room[shift : shift + values.size]
    copy[:] = values
    return copy
