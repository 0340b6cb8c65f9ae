"""Exact first and second derivatives through named intermediate quantities.

A problem is written over w = (x, u_1, u_2, …) where each u_i has a definition in terms of what stands before it.
Derivatives with respect to x follow by eliminating the u_i backwards, with D_i = ∂u_i/∂(before):

    ∇L  ←  ∇L_before + D_iᵀ ν_i,                                   ν_i = (∇L)_i
    H   ←  H_bb + H_bi D_i + D_iᵀ H_ib + D_iᵀ H_ii D_i + ∇²(ν_iᵀ u_i)
    J   ←  J_b + J_i D_i

This is the chain rule, so the result equals that of differentiating the substituted expression; but every Hessian
is one of a short expression in few variables, which CasADi's colouring does in a fraction of the work. H before
the elimination is the Hessian of the problem lifted to the variables w.
"""

from collections.abc import Sequence

import casadi as ca


class Lifting:
    """Variables x and, in order, quantities lifted out of the expressions in them."""

    def __init__(self, x: ca.SX):
        self.x = x
        self._w = x  # all symbols so far, x first
        self._definitions: list[ca.SX] = []
        self._frozen: set[int] = set()

    def lift(self, name: str, definition: ca.SX) -> ca.SX:
        """A symbol of the definition's shape that stands for it from here on."""
        symbol = ca.SX.sym(name, *definition.shape)
        self._definitions.append(ca.vec(definition))
        self._w = ca.vertcat(self._w, ca.vec(symbol))
        return symbol

    def freeze(self, name: str, definition: ca.SX) -> ca.SX:
        """A symbol that has the definition's value but is a constant to every derivative."""
        symbol = self.lift(name, definition)
        self._frozen.add(len(self._definitions) - 1)
        return symbol

    def value(self, expressions: Sequence[ca.SX]) -> list[ca.SX]:
        """The expressions with every lifted symbol replaced by its definition: functions of x alone."""
        w, within = self._w, {symbol.element_hash() for symbol in self._w.elements()}
        n = self.x.numel()
        values = self.x
        for definition in self._definitions:
            parameters = _free(definition, within)
            known = ca.Function("definition", [w[:n], *parameters], [definition])
            values = ca.vertcat(values, known(values, *parameters))
            n += definition.numel()
        parameters = _free(ca.vertcat(*[ca.vec(e) for e in expressions]), within)
        result = ca.Function("value", [w, *parameters], list(expressions))(values, *parameters)
        return list(result) if isinstance(result, tuple | list) else [result]

    def jacobian(self, rows: ca.SX) -> ca.SX:
        """∂rows/∂x (n, nx), still written over w."""
        J = ca.jacobian(rows, self._w)
        for low, high, definition in self._backwards():
            J = J[:, :low] + J[:, low:high] @ ca.jacobian(definition, self._w[:low])
        return J

    def gradient(self, scalar: ca.SX) -> ca.SX:
        """∂scalar/∂x (nx), still written over w."""
        g = ca.gradient(scalar, self._w)
        for low, high, definition in self._backwards():
            g = g[:low] + ca.jtimes(definition, self._w[:low], g[low:high], True)
        return g

    def hessian(self, parts: Sequence[ca.SX]) -> ca.SX:
        """∂²(Σ parts)/∂x² (nx, nx), still written over w. Each part is coloured on its own."""
        g, H = ca.SX(self._w.numel(), 1), ca.SX(self._w.numel(), self._w.numel())
        for part in parts:
            second, first = ca.hessian(part, self._w)
            g, H = g + first, H + second
        for low, high, definition in self._backwards():
            before = self._w[:low]
            D = ca.jacobian(definition, before)
            mixed = H[:low, low:high] @ D
            curvature = _weighted_hessian(definition, before, g[low:high])
            H = H[:low, :low] + mixed + mixed.T + D.T @ H[low:high, low:high] @ D + curvature
            g = g[:low] + D.T @ g[low:high]
        return H

    def _backwards(self) -> list[tuple[int, int, ca.SX]]:
        """(first index, one past the last index, definition) of every lifted quantity, last first."""
        ranges, low = [], self.x.numel()
        for i, definition in enumerate(self._definitions):
            constant = ca.SX(definition.numel(), 1)
            ranges.append((low, low + definition.numel(), constant if i in self._frozen else definition))
            low += definition.numel()
        return ranges[::-1]


def _weighted_hessian(definition: ca.SX, before: ca.SX, weights: ca.SX) -> ca.SX:
    """∇²(νᵀ definition) at ν = weights, which must not be differentiated."""
    nu = ca.SX.sym("nu", definition.numel())
    hessian = ca.hessian(ca.dot(nu, definition), before)[0]
    return ca.substitute(hessian, nu, ca.densify(weights))


def _free(expression: ca.SX, within: set[int]) -> list[ca.SX]:
    """Symbols of the expression whose hashes are not among those of w: its parameters."""
    symbols = [s for s in ca.symvar(expression) if s.element_hash() not in within]
    return [ca.vertcat(*symbols)] if symbols else []
