"""Jets: values and derivatives of surface quantities at query points, numbers that stand in for the kernel sum.

The posterior gives raw jets of μ (order 3) and σ² (order 2). `metric` turns them, by CasADi's differentiation of
Taylor polynomials, into jets of order 2 of what the grasp needs:

    d = μ/|∇μ|,   n = ∇μ/|∇μ|,   σ_d² = σ²/|∇μ|²,   μ

`expand` reads such a jet as the polynomial y + ∇yᵀδ + ½ δᵀ∇²y δ in the displacement δ from the query point. At
δ = 0 it has the value and both derivatives, so whatever is written on it is differentiated exactly.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial, prod

import casadi as ca

from sgnlp.gpis import MEAN_JET, MIN_SLOPE, PAIRS, TRIPLES, VARIANCE_JET

SINGLES = ((0,), (1,), (2,))
JET = 1 + len(SINGLES) + len(PAIRS)
"""Numbers in a jet of order 2: value, 3 first and 6 second derivatives."""


def polynomial(J: ca.SX, delta: ca.SX, orders: Sequence[tuple[tuple[int, ...], ...]]) -> ca.SX:
    """Σ J_α δ^α/α! over the value and the multi-indices of the given orders, coefficients in their order."""
    value, index = J[0], 1
    for multi in (multi for indices in orders for multi in indices):
        divisor = prod(factorial(count) for count in Counter(multi).values())
        value += J[index] * prod((delta[a] for a in multi), start=ca.SX(1)) / divisor
        index += 1
    return value


def expand(jets: ca.SX, delta: ca.SX) -> ca.SX:
    """Values (Q,) of the jets (Q, 10) at displacements δ (Q, 3)."""
    return ca.vertcat(*[polynomial(jets[q, :], delta[q, :], (SINGLES, PAIRS)) for q in range(jets.shape[0])])


def _jet(y: ca.SX, delta: ca.SX) -> ca.SX:
    """The jet (1, 10) of y(δ) at δ = 0."""
    H, g = ca.hessian(y, delta)
    row = ca.horzcat(y, g.T, *[H[a, b] for a, b in PAIRS])
    return ca.substitute(row, delta, ca.SX.zeros(3))


def metric() -> ca.Function:
    """(raw jets of μ (20) and σ² (10)) → jets of μ (10), d (10), n (3 x 10 in a row), σ_d² (10) at one point."""
    J, V, delta = ca.SX.sym("J", MEAN_JET), ca.SX.sym("V", VARIANCE_JET), ca.SX.sym("delta", 3)
    mean = polynomial(J, delta, (SINGLES, PAIRS, TRIPLES))
    variance = polynomial(V, delta, (SINGLES, PAIRS))
    gradient = ca.gradient(mean, delta)
    slope = ca.sqrt(ca.sumsqr(gradient) + MIN_SLOPE**2)
    normal = ca.horzcat(*[_jet(gradient[a] / slope, delta) for a in range(3)])
    outputs = [J[:JET].T, _jet(mean / slope, delta), normal, _jet(variance / slope**2, delta)]
    names = ["mean", "distance", "normal", "variance"]
    return ca.Function("metric", [J, V], ca.cse(outputs), ["J", "V"], names)


@dataclass(frozen=True)
class Layout:
    """The query points of m fingers with K samples each and S spheres, and the jets that each kind needs.

    Order of the points: contacts p (m), path (m K, finger by finger), spheres (S), feet p - r n(p) of the contacts
    on the surface (m), targets (m). The feet follow from the surface; all others are given.
    """

    m: int
    K: int
    S: int

    @property
    def points(self) -> int:
        """Q, the number of query points."""
        return 3 * self.m + self.m * self.K + self.S

    @property
    def before_feet(self) -> int:
        """The number of points that stand before the feet."""
        return self.m + self.m * self.K + self.S

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
        m, V_, D, Q = self.m, self.uncertain, self.distances, self.points
        padded = ca.horzcat(V, ca.MX.zeros(VARIANCE_JET, Q - V_))
        mean, distance, normal, variance = [ca.reshape(o, -1, Q) for o in point.map(Q)(J, padded)]
        blocks = [distance[:, :D].T, variance[:, :V_].T, normal[:, :m].T, mean[:, D:].T]
        return ca.Function("jets", [J, V], blocks)
