"""The interface of a kernel: four radial functions, given, or derived from the first by CasADi.

With D = (1/r) d/dr, a kernel gives k, Dk, D²k and D³k. These are enough for the derivatives of k(|x - x_n|) up to third
order: ∂_a k = d_a Dk, ∂_ab k = d_a d_b D²k + δ_ab Dk and so on, with d = x - x_n.
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from math import inf
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from sgnlp.base.checked import require
from sgnlp.base.errors import InputError, SgnlpError
from sgnlp.surface.elementwise import Elementwise

Radial = tuple[Any, Any, Any, Any]

FIELDS = "its fields beside `support_radius` and `amplitude` must have defaults"
VALUE = "`value` must give a CasADi scalar of the CasADi scalar r, by operators and CasADi's functions"
RADIAL = "`radial` must give four arrays of the shape of its radii"

NUMPY = r"\s*casadi: a numpy function was called on a casadi value"
"""How CasADi's warning begins: what it then returns depends on its version."""
NUMPY_CALLED = "a function of NumPy was called on a CasADi value"

MIN_RADIUS = 1e-7
"""Smaller distances are replaced by this [m]: D²k and D³k of rough kernels have a removable pole at r = 0."""
SAMPLES = np.array([0.031, 0.11, 0.23, 0.37, 0.53, 0.71, 0.89])
"""Radii over R at which given radial functions are compared with finite differences."""
STEP = 1e-5
"""Step of the differences over R: truncation leaves 1e-7 of a derivative, rounding 1e-11."""
AGREE = 1e-4
"""Relative difference above which a given radial function is wrong."""


@dataclass(frozen=True)
class Kernel:
    """A radial kernel k(r) [m²] of the distance r [m] between two points.

    Your own kernel is a subclass with one method: `value`, from which CasADi derives the rest, or `radial`, which gives
    k, Dk, D²k, D³k with D = (1/r) d/dr. Its name is that of the class in lower case, unless the class has a `name`.

    Attributes:
        support_radius: R [m], the largest distance in a plan.
        amplitude: prior deviation σ0 [m].
    """

    support_radius: float
    amplitude: float

    name: ClassVar[str] = ""
    prior_mean_from_settings: ClassVar[bool] = False
    """Whether the prior mean is `gpis.prior_mean` of the settings; else it is σ0, the value of the exterior points."""

    def __post_init__(self) -> None:
        """Also that both are positive."""
        for name in ("support_radius", "amplitude"):
            value = getattr(self, name)
            require(f"the {name} of kernel '{self.name}'", value, float)
            if not 0 < value < inf:
                raise InputError(f"the {name} of kernel '{self.name}' must be a positive number [m], not {value:g}")

    def __init_subclass__(cls) -> None:
        """Name the kernel after its class."""
        super().__init_subclass__()
        if "name" not in cls.__dict__:
            cls.name = cls.__name__.lower()

    def value(self, r: Any) -> Any:
        """k [m²] at a distance r > 0 [m], a CasADi scalar."""
        raise InputError(f"kernel '{self.name}' has neither a method `value` nor a method `radial`")

    def radial(self, r: Any) -> Radial:
        """(k, Dk, D²k, D³k) at distances r > 0 [m], a NumPy array or a dense CasADi matrix; derived from `value`."""
        derived = _derived(self)
        if isinstance(r, ca.SX | ca.MX | ca.DM):
            rows = derived.function.map(r.numel())(ca.reshape(r**2, 1, -1))
            k, k1, k2, k3 = (ca.reshape(row, *r.shape) for row in rows)
        else:
            k, k1, k2, k3 = derived(np.square(r))
        return k, k1, k2, k3


@contextmanager
def demanding(kernel: Kernel | type[Kernel], demand: str) -> Iterator[None]:
    """Raise `InputError` with what a kernel must meet, for any error of it."""
    try:
        yield
    except SgnlpError:
        raise
    except Exception as error:
        line = (str(error).strip().splitlines() or [""])[-1]  # CasADi's messages end with the cause
        said = NUMPY_CALLED if isinstance(error, FutureWarning) else f"it fails with {type(error).__name__}: {line}"
        raise InputError(f"kernel '{kernel.name}': {demand}; {said}") from error


@lru_cache(maxsize=16)
def _derived(kernel: Kernel) -> Elementwise:
    """r² → (k, Dk, D²k, D³k), since D = 2 d/d(r²)."""
    square = ca.SX.sym("square")
    with demanding(kernel, VALUE), warnings.catch_warnings():
        warnings.filterwarnings("error", NUMPY, FutureWarning)
        chain = [ca.SX(kernel.value(ca.sqrt(square)))]
        if not (chain[0].is_scalar() and ca.depends_on(chain[0], square)):  # math.exp(r) is a constant, NaN
            raise InputError(f"kernel '{kernel.name}': {VALUE}, not {chain[0]!s:.60}")
        for _ in range(3):
            chain.append(2 * ca.jacobian(chain[-1], square))
        return Elementwise(ca.Function("radial", [square], ca.cse([ca.densify(k) for k in chain])), kernel.name)


def check(kernel: Kernel) -> None:
    """Compare given radial functions with finite differences of each other.

    Raises:
        InputError: they disagree, fail, are not finite, or do not have the shape of the radii.
    """
    R = kernel.support_radius
    radii = R * np.concatenate([[MIN_RADIUS / R], SAMPLES, [1.0, 2.0]]).reshape(2, -1)
    with demanding(kernel, RADIAL):
        given = [np.array(k, float) for k in kernel.radial(radii)]
    if [k.shape for k in given] != 4 * [radii.shape]:
        raise InputError(f"kernel '{kernel.name}': {RADIAL}, not of the shapes {[k.shape for k in given]}")
    given = [k.ravel() for k in given]
    if not np.isfinite(given).all():
        raise InputError(f"kernel '{kernel.name}' is not finite at every distance from {MIN_RADIUS:g} m to 2 R")
    if type(kernel).radial is Kernel.radial:
        return
    r, h = R * SAMPLES, R * STEP
    quotients = (np.array(kernel.radial(r + h)) - np.array(kernel.radial(r - h))) / (2 * h * r)
    for order in range(3):
        found, expected = given[order + 1][1:-2], quotients[order]
        error = np.abs(found - expected) - AGREE * np.abs(expected) - AGREE**2 * np.abs(expected).max()
        if error.max() > 0:
            i, names = int(error.argmax()), ("k", "Dk", "D²k", "D³k")
            raise InputError(
                f"kernel '{kernel.name}': {names[order + 1]} is not (1/r) d/dr of {names[order]}: at r = {r[i]:.3g} m "
                f"`radial` gives {found[i]:.4g}, differences give {expected[i]:.4g}"
            )
