"""How many threads the libraries of linear algebra work with."""

from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[Any]:
    """One thread of BLAS inside: the bits of a factorisation depend on their number, and small products gain nothing.

    A second thread waits for work by running, on a core that others could use.
    """
    return _libraries().limit(limits=1)


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    """Those of NumPy and SciPy, looked for once: that takes a millisecond."""
    import scipy.linalg  # noqa: F401  (it has a BLAS of its own)

    return ThreadpoolController()
