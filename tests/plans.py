"""Small plans shared by the tests, and the flags that ask for such ones."""

from functools import lru_cache

from scenes import SMALL, hand, observation

from sgnlp.planning.plan import Plan
from sgnlp.planning.solve import solve

SMALL_FLAGS = ["--gpis.surface-points", "60", "--gpis.interior-points", "15", "--gpis.exterior-noise", "0.2"]
SMALL_FLAGS += ["--closing.no-planned", "--closing.c-freedom", "0", "--limits.place-error", "0", "--limits.effort", "0"]
SMALL_FLAGS += ["--contact.mass", "0", "--contact.samples", "4", "--closing.margin", "0.002"]
SMALL_FLAGS += ["--weights.uncer", "20", "--smoothing.deviation", "0.008"]
SMALL_FLAGS += ["--limits.rotation-deg", "10", "--limits.shift", "0.01", "--limits.give", "0"]


@lru_cache
def small_plan() -> Plan:
    """A plan of two starts for the ellipsoid, made once for all tests of what is done with plans."""
    return solve(observation(), hand(), SMALL, count=2, seed=0, jobs=2)
