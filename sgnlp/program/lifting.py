"""Exact first and second derivatives through named intermediate quantities.

A problem is written in w = (x, u_1, u_2, …), where each u_i is defined by the entries before it. Let L be linear in all
parts, ν = ∂L/∂u the adjoints, D_i = ∂u_i/∂(before). The Hessian of L with respect to x is

    Tᵀ M T,     M = ∇²L + Σ_i ∇²(ν_iᵀ u_i),     T = ∂w/∂x by D

M is sparse: it has the second derivatives of short expressions in few variables. Then one u after the other is folded
into what it depends on, in M, in rows of Jacobians, and in the D of those that are folded later:

    M  ←  M_bb + M_bi D_i + D_iᵀ M_ib + D_iᵀ M_ii D_i,     J  ←  J_b + J_i D_i

This is the chain rule, so the result equals the derivative of the substituted expression.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca


@dataclass(frozen=True, eq=False)
class Quantity:
    """A lifted quantity u, whose symbols are w[low:high]; `slope` has its derivatives."""

    low: int
    high: int
    slope: ca.SX
    late: bool


class Lifting:
    """Variables x and, in order, quantities lifted out of the expressions in them."""

    def __init__(self, x: ca.SX):
        self.x = x
        self._lifted = [x]  # all symbols of differentiation, x first
        self._size = x.numel()  # their number
        self._quantities: list[Quantity] = []
        self._known: list[tuple[ca.SX, ca.SX]] = []  # each symbol besides x, and its value
        self._zeros: list[ca.SX] = []  # symbols of displacements

    def lift(self, name: str, value: ca.SX, slope: ca.SX | None = None, late: bool = False) -> ca.SX:
        """A new symbol with the value's shape, which represents it from here on.

        Its derivatives are those of `slope`, an expression that agrees with the value in its first two derivatives and
        is easier to differentiate. A `late` quantity is folded after all others. That helps if many numbers depend on
        few, and these on many.
        """
        symbol, low = self.constant(name, value), self._size
        self._size += symbol.numel()
        slope = ca.vec(ca.SX(value if slope is None else slope))
        self._quantities.append(Quantity(low, self._size, slope, late))
        self._lifted.append(ca.vec(symbol))
        return symbol

    def constant(self, name: str, value: ca.SX) -> ca.SX:
        """A symbol that has the value but no derivative."""
        symbol = ca.SX.sym(name, *value.shape)
        self._known.append((ca.vec(symbol), ca.vec(value)))
        return symbol

    def displacement(self, name: str, of: ca.SX, late: bool = False) -> ca.SX:
        """A symbol with value zero and the derivatives of an expression: its displacement from the present value."""
        symbol = self.lift(name, ca.SX.zeros(*of.shape), of, late)
        self._zeros.append(ca.vec(symbol))
        return symbol

    def values(self, expressions: Sequence[ca.SX]) -> list[ca.SX]:
        """The expressions with every lifted symbol replaced by its value: functions of x alone."""
        symbols, within, values = self._values
        parameters = _free(ca.vertcat(*[ca.vec(e) for e in expressions]), within)
        result = ca.Function("values", [symbols, *parameters], list(expressions))(values, *parameters)
        return list(result) if isinstance(result, tuple | list) else [result]

    def gradient(self, scalar: ca.SX) -> ca.SX:
        """∂scalar/∂x (nx,), still written in w. It is dense, because solvers read its numbers one after the other."""
        return self._adjoints(self._slope(scalar).T)[: self.x.numel()]

    def jacobian(self, rows: ca.SX) -> ca.SX:
        """∂rows/∂x (n, nx), still written in w."""
        J = self._at_zero([self._slope(rows)])[0]
        for low, high, D in self._folds:
            if (through := J[:, low:high]).nnz():
                J = J + through @ D  # columns that are folded stay, and are not read again
        return J[:, : self.x.numel()]

    def hessian(self, parts: Sequence[ca.SX]) -> ca.SX:
        """∂²(Σ parts)/∂x² (nx, nx), still written in w. Each part is differentiated separately."""
        n = self._w.numel()
        nu = self._adjoints(self._slope(sum(parts, ca.SX(0))).T)
        weights = [ca.SX.sym("nu", u.high - u.low) for u in self._quantities]
        seconds = [self._curvature(ca.dot(w, u.slope)) for w, u in zip(weights, self._quantities, strict=True)]
        seconds = [second for second in seconds if second.nnz()]
        curvatures = [self._curvature(part) for part in parts]
        if seconds:
            curvatures += ca.substitute(seconds, weights, [nu[u.low : u.high] for u in self._quantities])
        M, left = ca.triu(self._at_zero([_total(curvatures, n)])[0]), list(range(n))
        for low, high, D in self._folds:
            at = bisect_left(left, low)
            left[at : at + high - low] = []
            M = _folded(M, at, D[:, left])
        return ca.triu2symm(M)

    @cached_property
    def _values(self) -> tuple[ca.SX, set[int], ca.SX]:
        """All symbols, x first, their hashes, and their values, functions of x."""
        known, definitions = [symbol for symbol, _ in self._known], [ca.densify(value) for _, value in self._known]
        symbols = ca.vertcat(self.x, *known)
        found = ca.substitute_inplace(known, definitions, [], False)[0] if known else []
        within, values = {symbol.element_hash() for symbol in symbols.elements()}, ca.vertcat(self.x, *found)
        return symbols, within, values

    @cached_property
    def _w(self) -> ca.SX:
        return ca.vertcat(*self._lifted)

    @cached_property
    def _slopes(self) -> list[ca.SX]:
        """D_i of each quantity, over all of w."""
        return self._at_zero([self._slope(u.slope) for u in self._quantities])

    @cached_property
    def _places(self) -> dict[int, int]:
        """The index of each symbol in w."""
        return {symbol.element_hash(): i for i, symbol in enumerate(self._w.elements())}

    def _near(self, expression: ca.SX) -> tuple[ca.SX, list[int]]:
        """The symbols of w in an expression, and their indices: only these need to be differentiated by."""
        found = [(s, self._places[s.element_hash()]) for s in ca.symvar(expression) if s.element_hash() in self._places]
        return ca.vertcat(*[symbol for symbol, _ in found]), [place for _, place in found]

    def _slope(self, rows: ca.SX) -> ca.SX:
        """∂rows/∂w (n, nw)."""
        symbols, at = self._near(rows)
        J = ca.jacobian(rows, symbols) if at else ca.SX(rows.numel(), 0)
        row, column = J.sparsity().get_triplet()
        return ca.SX.triplet(row, [at[j] for j in column], J.nz[:], rows.numel(), self._w.numel())

    def _curvature(self, scalar: ca.SX) -> ca.SX:
        """∂²scalar/∂w² (nw, nw)."""
        symbols, at = self._near(scalar)
        n = self._w.numel()
        H = ca.hessian(scalar, symbols)[0] if at else ca.SX(0, 0)
        row, column = H.sparsity().get_triplet()
        return ca.SX.triplet([at[i] for i in row], [at[j] for j in column], H.nz[:], n, n)

    def _adjoints(self, g: ca.SX) -> ca.SX:
        """ν (nw,) for the partial derivatives g (nw,) of a scalar; its first part is the total derivative by x."""
        g = ca.densify(g)
        for u, D in zip(reversed(self._quantities), reversed(self._slopes), strict=True):
            before = sorted(set(D.sparsity().get_triplet()[1]))
            g[before] += D[:, before].T @ g[u.low : u.high]
        return g

    @cached_property
    def _folds(self) -> list[tuple[int, int, ca.SX]]:
        """(first index, one past the last, D over symbols not folded yet) of each quantity, in the order of folding."""
        order = sorted(range(len(self._quantities)), key=lambda i: (self._quantities[i].late, -i))
        waiting, folds = {i: self._slopes[i] for i in order}, []
        for i in order:
            u, D = self._quantities[i], waiting.pop(i)
            folds.append((u.low, u.high, D))
            for j, other in waiting.items():
                if j > i and (through := other[:, u.low : u.high]).nnz():
                    waiting[j] = _without(other, u.low, u.high) + through @ D
        return folds

    def _at_zero(self, expressions: list[ca.SX]) -> list[ca.SX]:
        """The expressions with displacements 0, without the entries that become 0."""
        if not (self._zeros and expressions):
            return expressions
        zeros = ca.vertcat(*self._zeros)
        return [ca.sparsify(e) for e in ca.substitute(expressions, [zeros], [ca.SX.zeros(zeros.numel())])]


def _total(matrices: Sequence[ca.SX], n: int) -> ca.SX:
    """The sum of sparse matrices (n, n), in pairs, so that each is added only a few times."""
    if len(matrices) > 1:
        half = len(matrices) // 2
        return _total(matrices[:half], n) + _total(matrices[half:], n)
    return matrices[0] if matrices else ca.SX(n, n)


def _without(matrix: ca.SX, low: int, high: int) -> ca.SX:
    """A matrix with empty columns from `low` to `high`."""
    return ca.horzcat(matrix[:, :low], ca.SX(matrix.shape[0], high - low), matrix[:, high:])


def _folded(M: ca.SX, at: int, D: ca.SX) -> ca.SX:
    """The upper triangle of a symmetric matrix without the rows and columns from `at` on, as many as D has rows.

    The lower one is never made: it would take most of the time.
    """
    end, size = at + D.shape[0], M.shape[0]
    rest = [*range(at), *range(end, size)]
    core = ca.triu2symm(M[at:end, at:end])
    mixed = D.T @ ca.horzcat(M[:at, at:end].T, M[at:end, end:])
    M = M[rest, rest] + ca.triu(mixed) + ca.triu(mixed.T)
    return M + ca.triu(D.T @ (core @ D))


def _free(expression: ca.SX, within: set[int]) -> list[ca.SX]:
    """Symbols of the expression whose hashes are not among those of w: its parameters."""
    symbols = [s for s in ca.symvar(expression) if s.element_hash() not in within]
    return [ca.vertcat(*symbols)] if symbols else []
