"""What the tests of compiled jets share."""

import ctypes

import pytest

from sgnlp.surface import native


@pytest.fixture
def library() -> ctypes.CDLL:
    """The compiled library; without a compiler the test is left out."""
    found = native.LIBRARY.load()
    if found is None:
        pytest.skip("no C compiler")
    return found
