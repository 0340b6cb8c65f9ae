"""Jets: values and derivatives of surface quantities at query points, as numbers instead of the kernel sum.

The posterior gives raw jets of μ (order 3) and σ² (order 2). Products and powers of jets turn them into jets of
order 2 of the quantities that a grasp needs:

    d = μ/|∇μ|,   n = ∇μ/|∇μ|,   σ_d² = σ²/|∇μ|²,   μ

`expand` reads such a jet as the polynomial y + ∇yᵀδ + ½ δᵀ∇²y δ in the displacement δ from the query point. At
δ = 0 it has the value and both derivatives, so every expression in it has exact derivatives.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from math import factorial, prod

import casadi as ca

from sgnlp.surface.gpis import MEAN_JET, MIN_SLOPE, PAIRS, TRIPLES, VARIANCE_JET

SINGLES = ((0,), (1,), (2,))
JET = 1 + len(SINGLES) + len(PAIRS)
"""Numbers in a jet of order 2: value, 3 first and 6 second derivatives."""


def polynomial(J: Sequence[ca.SX], delta: Sequence[ca.SX], orders: Sequence[tuple[tuple[int, ...], ...]]) -> ca.SX:
    """Σ J_α δ^α/α! over the value and the multi-indices of the given orders, coefficients in their order.

    Each coefficient and each displacement may be a column, for several points at once.
    """
    value = J[0]
    for index, multi in enumerate(chain.from_iterable(orders), start=1):
        divisor = prod(factorial(count) for count in Counter(multi).values())
        value += J[index] * prod((delta[a] for a in multi), start=ca.SX(1)) / divisor
    return value


def expand(jets: ca.SX, delta: ca.SX) -> ca.SX:
    """Values (Q,) of the jets (Q, 10) at displacements δ (Q, 3)."""
    if not jets.shape[0]:
        return ca.SX(0, 1)
    return polynomial(ca.horzsplit(jets), ca.horzsplit(delta), (SINGLES, PAIRS))


def product(x: ca.SX, y: ca.SX) -> ca.SX:
    """The jet (10) of xy: Leibniz' rule on the jets of x and y."""
    first = [x[0] * y[1 + a] + y[0] * x[1 + a] for a in range(3)]
    second = [
        x[0] * y[4 + i] + y[0] * x[4 + i] + x[1 + a] * y[1 + b] + x[1 + b] * y[1 + a] for i, (a, b) in enumerate(PAIRS)
    ]
    return ca.vertcat(x[0] * y[0], *first, *second)


def power(x: ca.SX, exponent: float, value: ca.SX) -> ca.SX:
    """The jet (10) of x^exponent with the given value: the chain rule on the jet of x."""
    slope = exponent * value / x[0]
    bend = (exponent - 1) * slope / x[0]
    bent = [bend * x[1 + a] for a in range(3)]
    second = [slope * x[4 + i] + bent[a] * x[1 + b] for i, (a, b) in enumerate(PAIRS)]
    return ca.vertcat(value, slope * x[1:4], *second)


def _index(*axes: int) -> int:
    """Index of the derivative along the axes in a jet of order 3."""
    orders = [(()), *SINGLES, *PAIRS, *TRIPLES]
    return orders.index(tuple(sorted(axes)))


def metric() -> dict[str, ca.Function]:
    """Functions of the raw jets of μ (20) and σ² (10) at a point: jets (10) of d, σ_d² and of the three n (30)."""
    J, V = ca.SX.sym("J", MEAN_JET), ca.SX.sym("V", VARIANCE_JET)
    axes = [(), *SINGLES, *PAIRS]
    gradient = [ca.vertcat(*[J[_index(a, *rest)] for rest in axes]) for a in range(3)]
    square = sum((product(g, g) for g in gradient), start=ca.SX.zeros(JET))
    square[0] += MIN_SLOPE**2
    root = 1 / ca.sqrt(square[0])
    inverse, inverse_square = power(square, -0.5, root), power(square, -1, root * root)
    distance, variance = product(J[:JET], inverse), product(V, inverse_square)
    normal = ca.vertcat(*[product(g, inverse) for g in gradient])
    return {
        "distance": ca.Function("distance", [J], ca.cse([distance])),
        "distance_variance": ca.Function("distance_variance", [J, V], ca.cse([distance, variance])),
        "normal": ca.Function("normal", [J], ca.cse([normal])),
    }


@dataclass(frozen=True)
class Layout:
    """The query points of m fingers with K samples each and S spheres, and the jets that each kind needs.

    Order of the points: contacts p (m), path (m K, finger by finger), spheres (S), link spheres at first contact (L, if
    that is planned), feet p - r n(p) of the contacts on the surface (m), targets (m). The feet follow from the surface;
    all other points are given.
    """

    m: int
    K: int
    S: int
    L: int = 0

    @property
    def points(self) -> int:
        """Q, the number of query points."""
        return self.before_feet + 2 * self.m

    @property
    def before_feet(self) -> int:
        """The number of points before the feet."""
        return self.m + self.m * self.K + self.S + self.L

    @property
    def uncertain(self) -> int:
        """V, the number of leading points whose variance is needed: contacts and path."""
        return self.m * (1 + self.K)

    @property
    def distances(self) -> int:
        """The number of leading points whose metric distance is needed: all but the targets."""
        return self.points - self.m

    def symbols(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        """Jets of d (Q - m, 10), σ_d² (V, 10), n (m, 30), μ at the targets (m, 10)."""
        return (
            ca.SX.sym("distance_jets", self.distances, JET),
            ca.SX.sym("variance_jets", self.uncertain, JET),
            ca.SX.sym("normal_jets", self.m, 3 * JET),
            ca.SX.sym("mean_jets", self.m, JET),
        )

    def function(self) -> ca.Function:
        """(raw jets of μ (20, Q), of σ² (10, V)) → the four blocks of `symbols`."""
        J, V = ca.MX.sym("J", MEAN_JET, self.points), ca.MX.sym("V", VARIANCE_JET, self.uncertain)
        point = metric()
        m, V_, D = self.m, self.uncertain, self.distances
        both = point["distance_variance"].map(V_)(J[:, :V_], V)
        rest = point["distance"].map(D - V_)(J[:, V_:D])
        blocks = [ca.horzcat(both[0], rest).T, both[1].T, point["normal"].map(m)(J[:, :m]).T, J[:JET, D:].T]
        return ca.Function("jets", [J, V], blocks)
