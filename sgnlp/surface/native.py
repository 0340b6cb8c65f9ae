"""The raw jets of the surface in C, compiled once by the system's compiler and kept in the user's cache.

`gpis_jets.c` does what `Gpis.mean_jet` and `Gpis.variance_jet` do in NumPy, six times as fast and in two steps, and
stands in for them where a C compiler is found. The library has the jets of shapes too (`native_shapes.py`).
"""

import ctypes
import math
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from sgnlp.base import toolchain
from sgnlp.base.arrays import Array
from sgnlp.base.errors import MachineError, SolverError
from sgnlp.surface.gpis import Gpis
from sgnlp.surface.kernel import Kernel
from sgnlp.surface.kernels import Matern32, Matern52, SquaredExponential, ThinPlate

SOURCES = ("gpis_jets.c", "shape_jets.c")
FLAGS = ("-O2", "-march=native", "-fno-math-errno", "-fno-trapping-math")
"""-O3 gains nothing. No -ffast-math: the same input is to give the same bits."""
ROWS, COLUMNS, WORK, LANES = 8, 12, 5, 8
"""Of the C source: rows of a panel of L⁻¹ and of its transpose, vectors of work a training point, points in a
vector at most."""
ALIGNMENT = 64
"""Of the arrays [bytes]: a cache line, and the widest vector."""
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
    """The jets of one fitted surface by the compiled library, variances of `uncertain` points at most.

    Not to be shared by threads: it has one work space.
    """

    def __init__(self, library: ctypes.CDLL, gpis: Gpis, uncertain: int):
        N, multiple = len(gpis.X), math.lcm(ROWS, COLUMNS)
        n = -(-N // multiple) * multiple  # padded with copies of the first point that have no weight
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

        Z has its columns in one piece, the jets their rows.
        """
        self._call(self._library.gpis_values, Z, mean, variance)

    def derivatives(self, Z: Array, mean: Array, variance: Array) -> None:
        """The rest of the jets. The V points are those of the last call of `values` that had any."""
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
    """The same steps in NumPy, where there is no compiler: the first does it all."""

    def __init__(self, gpis: Gpis):
        self._gpis = gpis

    def values(self, Z: Array, mean: Array, variance: Array) -> None:
        """Jets of the mean (Q, 20) at Z (Q, 3) [m], and of the variance (V, 10) at the first V of them."""
        mean[:], variance[:] = self._gpis.mean_jet(Z), self._gpis.variance_jet(Z[: len(variance)])

    def derivatives(self, Z: Array, mean: Array, variance: Array) -> None:
        """They are there."""


def raw_jets(gpis: Gpis, uncertain: int, compiled: bool = True) -> NativeJets | NumpyJets:
    """The jets of a fitted surface, variances of `uncertain` points at most; in C if `compiled` and it can be had.

    A kernel that the C source does not know is evaluated in NumPy.
    """
    loaded = library() if compiled and type(gpis.kernel) in CODES else None
    return NumpyJets(gpis) if loaded is None else NativeJets(loaded, gpis, uncertain)


def library() -> ctypes.CDLL | None:
    """The compiled library, built if it is not in the cache or damaged; None where it cannot be built or loaded."""
    return attempt()[0]


@lru_cache(maxsize=1)
def attempt() -> tuple[ctypes.CDLL | None, str]:
    """The compiled library, and where there is none, why, with the remedy."""
    sources = {name: files("sgnlp.surface").joinpath(name).read_text(encoding="utf-8") for name in SOURCES}
    built = toolchain.cache_folder() / f"jets-{toolchain.fingerprint(*sources.values(), *FLAGS)}.so"
    try:
        if toolchain.note_of(built) is None:
            toolchain.build(built, sources, FLAGS)
        loaded = ctypes.CDLL(str(built))
        loaded.gpis_values.restype = loaded.gpis_derivatives.restype = loaded.shape_jets.restype = None
    except (SolverError, MachineError) as error:
        return None, str(error)
    except (OSError, AttributeError) as error:  # of another processor, or from where no program is run
        return None, f"'{built}' cannot be loaded: {error}; {toolchain.ELSEWHERE}, or name another compiler in CC"
    return loaded, ""


def _aligned(values: Array) -> Array:
    """A copy of values (n,) that begins at a multiple of `ALIGNMENT`."""
    room = np.zeros(values.size + ALIGNMENT // values.itemsize)
    shift = (-room.ctypes.data % ALIGNMENT) // values.itemsize
    copy = room[shift : shift + values.size]
    copy[:] = values
    return copy
