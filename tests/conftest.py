"""Shared fixtures: threads pinned before NumPy loads, and the optional real clouds."""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

from pathlib import Path  # noqa: E402

import pytest  # noqa: E402


@pytest.fixture
def real_clouds() -> list[Path]:
    """The npz files in the folder named by SGNLP_REAL_CLOUDS; skips the test when there are none."""
    folder = os.environ.get("SGNLP_REAL_CLOUDS", "")
    files = sorted(Path(folder).glob("*.npz")) if folder else []
    if not files:
        pytest.skip("SGNLP_REAL_CLOUDS names no folder of npz clouds")
    return files
