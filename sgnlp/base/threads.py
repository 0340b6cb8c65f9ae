"""The number of threads of the linear algebra libraries."""

from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[Any]:
    """Use one BLAS thread inside: the bits of a factorisation depend on the number, and small products gain nothing.

    A second thread would wait by spinning, on a core that others could use.
    """
    return _libraries().limit(limits=1)


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    """The BLAS libraries of NumPy and SciPy, found once, because that takes a millisecond."""
    import scipy.linalg  # noqa: F401  (it has a BLAS of its own)

    return ThreadpoolController()
