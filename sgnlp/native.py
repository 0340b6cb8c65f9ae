"""The raw jets of the surface in C: `gpis_jets.c`, compiled once by the system's compiler and kept in the user's cache.

It does what `Gpis.mean_jet` and `Gpis.variance_jet` do in NumPy, six times as fast, and stands in for them where a C
compiler is found.
"""

import ctypes
import subprocess
from functools import lru_cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from sgnlp import toolchain
from sgnlp.gpis import MEAN_JET, VARIANCE_JET, Gpis

Array = NDArray[np.float64]

SOURCE = "gpis_jets.c"
FLAGS = ("-O2", "-march=native", "-fno-math-errno", "-fno-trapping-math")
"""-O3 gains nothing. No -ffast-math: the same input is to give the same bits."""
ROWS, COLUMNS, LANES = 6, 12, 8
"""Rows of a panel of the whitener and of its transpose, points in a vector: as in the C source."""
ALIGNMENT = 64
"""Of the arrays [bytes]: a cache line, and the widest vector."""
CODES = {"thin_plate": 0, "matern32": 1, "matern52": 2, "squared_exponential": 3}
"""Numbers of the kernels in the C source."""


class _Surface(ctypes.Structure):
    """`surface` of the C source."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("kernel", "n")),
        *((name, ctypes.c_double) for name in ("prior", "reach", "amplitude", "prior_variance")),
        *((name, ctypes.c_void_p) for name in ("X", "alpha", "forward", "backward", "work")),
    )


class NativeJets:
    """The jets of one fitted surface by the compiled library. Not to be shared by threads: it has one work space."""

    def __init__(self, library: ctypes.CDLL, gpis: Gpis):
        N = len(gpis.X)
        n = -(-N // COLUMNS) * COLUMNS  # padded with copies of the first point that have no weight
        X, alpha, whitener = np.tile(gpis.X[0], (n, 1)), np.zeros(n), np.zeros((n, n))
        X[:N], alpha[:N], whitener[:N, :N] = gpis.X, gpis.alpha, np.tril(gpis.whitener)
        forward = np.concatenate([whitener[i : i + ROWS, : i + ROWS].T.ravel() for i in range(0, n, ROWS)])
        backward = np.concatenate([whitener[i:, i : i + COLUMNS].ravel() for i in range(0, n, COLUMNS)])
        work = np.zeros(7 * n * LANES)
        self._arrays = [_aligned(a.ravel()) for a in (X, alpha, forward, backward, work)]
        numbers = (gpis.prior, gpis.reach, gpis.amplitude, gpis.prior_variance)
        self._surface = _Surface(CODES[gpis.kernel], n, *numbers, *(a.ctypes.data for a in self._arrays))
        self._function = library.gpis_jets

    def __call__(self, Z: Array, uncertain: int) -> tuple[Array, Array]:
        """Jets of the mean (Q, 20) at Z (Q, 3) [m] and of the variance (uncertain, 10) at the first of them."""
        Z = np.asfortranarray(Z, dtype=float)
        mean, variance = np.empty((len(Z), MEAN_JET)), np.empty((uncertain, VARIANCE_JET))
        arrays = (ctypes.c_void_p(a.ctypes.data) for a in (Z, mean, variance))
        sizes = ctypes.c_int64(len(Z)), ctypes.c_int64(uncertain)
        self._function(ctypes.byref(self._surface), *sizes, *arrays)
        return mean, variance


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL | None:
    """The compiled library, built if it is not in the cache; None where it cannot be built or loaded."""
    source = files("sgnlp").joinpath(SOURCE).read_text()
    try:
        built = toolchain.cache_folder() / f"gpis_jets-{toolchain.fingerprint(source, *FLAGS)}.so"
        if not built.is_file():
            toolchain.build(built, {SOURCE: source}, FLAGS)
        loaded = ctypes.CDLL(str(built))
    except (OSError, subprocess.SubprocessError):
        return None
    loaded.gpis_jets.restype = None
    return loaded


def _aligned(values: Array) -> Array:
    """A copy of values (n,) that begins at a multiple of `ALIGNMENT`."""
    room = np.zeros(values.size + ALIGNMENT // values.itemsize)
    shift = (-room.ctypes.data % ALIGNMENT) // values.itemsize
    copy = room[shift : shift + values.size]
    copy[:] = values
    return copy
