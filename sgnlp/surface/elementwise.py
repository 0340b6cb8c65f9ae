"""A scalar CasADi function applied to every element of a NumPy array, one instruction after the other.

CasADi's own virtual machine runs all instructions for each element, which takes twenty times as long.
"""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from scipy.special import erf

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError

BLOCK = 4096
"""Number of elements in a chunk: intermediate results then stay in the processor's cache, three times as fast."""
SAME_NAMES = (
    *("sqrt", "exp", "expm1", "log", "log1p", "sin", "cos", "tan", "sinh", "cosh", "tanh", "hypot"),
    *("sign", "floor", "ceil", "fmin", "fmax"),
)
"""Functions that have the same name in NumPy and CasADi."""
OTHER_NAMES: dict[str, Callable[..., Any]] = {
    "assign": np.positive, "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative,
    "inv": np.reciprocal, "twice": lambda x: x + x, "sq": np.square, "pow": np.power, "constpow": np.power, "erf": erf,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2, "fabs": np.abs, "lt": np.less,
    "le": np.less_equal, "eq": np.equal, "ne": np.not_equal, "not": np.logical_not, "and": np.logical_and,
    "or": np.logical_or, "if_else_zero": lambda condition, x: np.where(condition, x, 0.0),
}  # fmt: skip
NAMES = {name: getattr(np, name) for name in SAME_NAMES} | OTHER_NAMES
OPERATIONS: dict[int, Callable[..., Any]] = {getattr(ca, f"OP_{name.upper()}"): f for name, f in NAMES.items()}
"""NumPy's functions for the instructions of CasADi."""


class Elementwise:
    """A function of one scalar with scalar outputs.

    Attributes:
        function: the CasADi function.

    Raises:
        InputError: it has an operation that is not in `OPERATIONS`; the message calls the function `name`.
    """

    def __init__(self, function: ca.Function, name: str):
        self.function = function
        self._steps = [self._step(i, name) for i in range(function.n_instructions())]

    def _step(self, i: int, name: str) -> tuple[int, list[int], list[int], Any]:
        """Operation, indices of inputs and output, and the constant or NumPy's function."""
        f, operation = self.function, self.function.instruction_id(i)
        what: Any = None
        if operation == ca.OP_CONST:
            what = np.float64(f.instruction_constant(i))
        elif operation not in (ca.OP_INPUT, ca.OP_OUTPUT):
            if operation not in OPERATIONS:
                raise InputError(f"'{name}' has an operation of CasADi that is not known here, number {operation}")
            what = OPERATIONS[operation]
        return operation, list(f.instruction_input(i)), list(f.instruction_output(i)), what

    def __call__(self, x: Array) -> tuple[Array, ...]:
        """The outputs at every element of x, each of the shape of x; NaN where they are not defined."""
        flat = x.ravel()
        every = np.empty((self.function.n_out(), flat.size))
        with np.errstate(all="ignore"):  # warnings of branches that are not taken
            for begin in range(0, flat.size, BLOCK):
                self._run(flat[begin : begin + BLOCK], every[:, begin : begin + BLOCK])
        return tuple(row.reshape(x.shape) for row in every)

    def _run(self, x: Array, rows: Array) -> None:
        work: dict[int, Any] = {}
        for operation, inputs, outputs, what in self._steps:
            if operation == ca.OP_OUTPUT:
                rows[outputs[0]] = work[inputs[0]]
            elif operation == ca.OP_INPUT:
                work[outputs[0]] = x
            elif operation == ca.OP_CONST:
                work[outputs[0]] = what
            else:
                work[outputs[0]] = what(*(work[place] for place in inputs))
