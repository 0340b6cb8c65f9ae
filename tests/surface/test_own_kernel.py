"""Kernels from outside the package: derived and given functions agree, one plans with them, wrong ones are refused."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scenes import SMALL, observation, sphere_points, surface
from wendland import EXTENSION, Wendland, WendlandInFull

import sgnlp
from sgnlp.base.surface_settings import GpisSettings
from sgnlp.planning import reopen
from sgnlp.surface.elementwise import OPERATIONS, Elementwise
from sgnlp.surface.gpis import Gpis, fit
from sgnlp.surface.kernels import Matern52
from sgnlp.surface.training import training_set

R, AMPLITUDE = 0.35, 0.12  # [m]
RADII = R * np.array([[0.02, 0.3, 0.7], [0.99, 1.0, 1.5]])


def fitted(kind: type[sgnlp.Kernel]) -> Gpis:
    return fit(training_set(observation(), GpisSettings(surface_points=30, interior_points=8), 0, kind))


def test_value_alone_and_four_functions_give_the_same_surface():
    derived, given = surface(Wendland), surface(WendlandInFull)
    Z = derived.centre + 0.08 * sphere_points(40, 3)
    for one, other in (
        (derived.mean_jet(Z), given.mean_jet(Z)),
        (derived.variance_jet(Z), given.variance_jet(Z)),
        (derived.alpha, given.alpha),
    ):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-7 * np.abs(other).max())


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_the_derived_functions_are_the_same_in_numpy_and_in_casadi(kind):
    r = kind.sym("r", *RADII.shape)
    kernel = Wendland(R, AMPLITUDE)
    found = ca.Function("k", [r], list(kernel.radial(r)))(RADII)
    for one, other, given in zip(found, kernel.radial(RADII), WendlandInFull(R, AMPLITUDE).radial(RADII), strict=True):
        np.testing.assert_allclose(np.array(one), other, rtol=1e-12)
        np.testing.assert_allclose(other, given, rtol=1e-9, atol=1e-12)
    assert [float(k) for k in kernel.radial(0.1)] == [float(k) for k in kernel.radial(np.array(0.1))]


def test_every_operation_of_casadi_is_the_one_of_numpy():
    """Those of two arguments with x and a constant, those of one with x inside their domain."""
    x = ca.SX.sym("x")
    one = ("sqrt", "exp", "expm1", "log", "log1p", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
    two = ("fmin", "fmax", "atan2", "hypot", "power")
    results = [getattr(ca, name)(x) for name in (*one, "erf", "fabs", "sign", "floor", "ceil")]
    results += [getattr(ca, name)(x, 0.4) for name in two]
    results += [x + 1, x - 1, 3 * x, x / 3, -x, 1 / x, 2 * x, x**2, x**0.3, 0.3**x]
    results += [x < 0.4, x <= 0.4, x == 0.25, x != 0.25, ca.logic_not(x), ca.logic_and(x, x < 0.4)]
    results += [ca.logic_or(x < 0.1, x > 0.6), ca.if_else(x < 0.4, x, 7)]
    f = ca.Function("f", [x], results)
    points = np.array([0.0625, 0.25, 0.375, 0.7, 0.9375])
    found = Elementwise(f, "f")(points)
    for row, point in zip(np.array(found).T, points, strict=True):
        np.testing.assert_allclose(row, np.array(ca.vertcat(*f(point))).ravel(), rtol=1e-12)
    used = {f.instruction_id(i) for i in range(f.n_instructions())}
    assert {*OPERATIONS} - used <= {ca.OP_ASSIGN}


def test_many_points_are_taken_block_by_block():
    x = ca.SX.sym("x")
    many = np.random.default_rng(0).random((3, 5000))
    for row in Elementwise(ca.Function("f", [x], [2 * x, x**2, ca.SX(3)]), "f")(many):
        assert row.shape == many.shape
    np.testing.assert_array_equal(Elementwise(ca.Function("f", [x], [x**2]), "f")(many)[0], many**2)


ONE = replace(SMALL, solver=replace(SMALL.solver, formulation="constrained"))
"""Of one program."""


@pytest.mark.parametrize("kind", [Wendland, WendlandInFull])
def test_one_plans_with_it(kind):
    plan = sgnlp.solve(observation(), settings=ONE, kernel=kind, count=2, jobs=1)
    assert plan.solutions
    assert isinstance(plan.problem.gpis.kernel, kind)
    assert plan.arrays().meta["kernel"] == kind.name
    assert plan.best


def test_a_plan_with_a_kernel_from_a_file_is_posed_again_and_one_from_no_file_is_not():
    cloud, options = observation(), {"settings": SMALL, "count": 1, "jobs": 1}
    plan = sgnlp.solve(cloud, extension=EXTENSION, **options)
    again = reopen.problem(plan.arrays(), cloud, plan.problem.hand)
    assert type(again.gpis.kernel).name == plan.arrays().meta["kernel"] == "wendland"
    np.testing.assert_array_equal(again.gpis.alpha, plan.problem.gpis.alpha)
    plan = sgnlp.solve(cloud, kernel=WendlandInFull, **options)
    with pytest.raises(sgnlp.InputError, match="a kernel that came from no file"):
        reopen.problem(plan.arrays(), cloud, plan.problem.hand)


def test_a_file_whose_kernel_is_none_is_refused(tmp_path):
    (tmp_path / "wrong.py").write_text("KERNEL = 3\n", encoding="utf-8")
    with pytest.raises(sgnlp.InputError, match=r"wrong\.py': kernel must be a subclass of `sgnlp.Kernel`, not 3"):
        sgnlp.extension(tmp_path / "wrong.py")


def test_its_own_fields_count_and_the_prior_mean_is_that_of_its_kind():
    @dataclass(frozen=True)
    class Rational(sgnlp.Kernel):
        shape: float = 1.0

        def value(self, r: Any) -> Any:
            return self.amplitude**2 * (1 + 8 * r**2 / (self.shape * self.support_radius**2)) ** -self.shape

    class Slow(Rational):
        prior_mean_from_settings = True

    one, two = (Rational(R, AMPLITUDE, shape).radial(RADII)[0] for shape in (1.0, 2.0))
    np.testing.assert_allclose(two, AMPLITUDE**2 * (1 + 4 * RADII**2 / R**2) ** -2, rtol=1e-12)
    assert (one != two).all()
    settings = replace(SMALL.gpis, prior_mean=0.7)
    assert training_set(observation(), settings, 0, Slow).prior == 0.7
    usual = training_set(observation(), settings, 0, Rational)
    assert usual.prior == usual.kernel.amplitude


class Empty(sgnlp.Kernel):
    pass


class Indefinite(sgnlp.Kernel):
    def value(self, r: Any) -> Any:
        return r - self.support_radius


class WrongSign(WendlandInFull):
    def radial(self, r: Any) -> Any:
        k, k1, k2, k3 = super().radial(r)
        return k, k1, -k2, k3


class Three(WendlandInFull):
    def radial(self, r: Any) -> Any:
        return super().radial(r)[:3]


class Scalar(WendlandInFull):
    def radial(self, r: Any) -> Any:
        return (*super().radial(r)[:3], 0.0)


class Undefined(sgnlp.Kernel):
    def value(self, r: Any) -> Any:
        return ca.sqrt(self.support_radius - r)


class Unknown(sgnlp.Kernel):
    def value(self, r: Any) -> Any:
        return ca.asinh(r)


class Raises(WendlandInFull):
    def radial(self, r: Any) -> Any:
        raise ValueError("first line\nlast line")


class Nothing(WendlandInFull):
    def radial(self, r: Any) -> Any:
        return None


class Texts(WendlandInFull):
    def radial(self, r: Any) -> Any:
        return ("k",) * 4


class Flat(WendlandInFull):
    def radial(self, r: Any) -> Any:
        return [k.ravel() for k in super().radial(r)]


class Plain(sgnlp.Kernel):
    def value(self, r: Any) -> Any:
        return math.exp(-r)


class Numeric(sgnlp.Kernel):
    def value(self, r: Any) -> Any:
        return self.amplitude**2 * np.exp(-r / self.support_radius)


class Silent(sgnlp.Kernel):
    def value(self, r: Any) -> Any:
        return None


class Pair(sgnlp.Kernel):
    def value(self, r: Any) -> Any:
        return ca.vertcat(r, r)


class Foreign(sgnlp.Kernel):
    def value(self, r: Any) -> Any:
        return r * ca.SX.sym("other")


@dataclass(frozen=True)
class Demanding(Wendland):
    shape: float = field(kw_only=True)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (Empty, "kernel 'empty' has neither a method `value` nor a method `radial`"),
        (Indefinite, "kernel 'indefinite': its covariance is not positive definite"),
        (
            WrongSign,
            r"kernel 'wrongsign': D²k is not \(1/r\) d/dr of Dk: at r = .* m `radial` gives -.*, diff",
        ),
        (Three, "kernel 'three': `radial` must give four arrays of the shape of its radii"),
        (Scalar, "kernel 'scalar': `radial` must give four arrays"),
        (Raises, "kernel 'raises': `radial` must give four .* fails with ValueError: last line"),
        (Nothing, "kernel 'nothing': `radial` must give four arrays"),
        (Texts, "kernel 'texts': `radial` must give four arrays"),
        (Flat, r"kernel 'flat': `radial` must give four arrays .*, not of the shapes \[\(10,\)"),
        (Plain, "kernel 'plain': `value` must give a CasADi scalar .*, not nan"),
        (Numeric, "kernel 'numeric': `value` must give .*CasADi's functions; a function of NumPy was called on"),
        (Silent, "kernel 'silent': `value` must give a CasADi scalar"),
        (Pair, r"kernel 'pair': `value` must give a CasADi scalar .*, not .*\[@1, @1\]"),
        (Foreign, "kernel 'foreign': `value` must give a CasADi scalar"),
        (Demanding, "kernel 'demanding': its fields beside .* must have defaults; it fails with TypeError"),
        (Undefined, "kernel 'undefined' is not finite at every distance from 1e-07 m to 2 R"),
        (Unknown, "'unknown' has an operation of CasADi that is not known here, number "),
    ],
)
def test_one_that_is_no_kernel_is_refused_in_one_line(kind, message):
    with pytest.raises(sgnlp.InputError, match=message) as error:
        fitted(kind)
    assert "\n" not in str(error.value)


def test_an_object_or_a_name_that_is_taken_is_refused():
    with pytest.raises(sgnlp.InputError, match=r"kernel must be a subclass of `sgnlp.Kernel`, not Matern52\("):
        sgnlp.solve(observation(), kernel=Matern52(R, AMPLITUDE))
    other = type("Matern52", (Wendland,), {})
    with pytest.raises(sgnlp.InputError, match="a built-in kernel is called 'matern52' too; give yours another name"):
        sgnlp.solve(observation(), kernel=other)
    assert sgnlp.solve(observation(), settings=SMALL, kernel=Matern52, count=1).problem.gpis.kernel.name == "matern52"
