"""Counts a solver's calls, and records the points at which it asked for ∇f, by wrapping its functions."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.solvers.casadi_call import CALLS
from sgnlp.program.oracle import Functions


class _Tap(ca.Callback):
    """x → x, which calls a listener. It uses raw memory: 10 µs, against tenths of a ms for a function."""

    def __init__(self, size: int, listener: Callable[[Array], None]):
        ca.Callback.__init__(self)
        self._size, self._listener = size, listener
        self.construct("tap", {})

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._size)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._size)

    def has_eval_buffer(self) -> bool:
        return True

    def eval_buffer(self, arguments: Sequence[Any], results: Sequence[Any]) -> int:
        x = np.zeros(self._size) if arguments[0] is None else np.frombuffer(arguments[0], dtype=float)
        self._listener(x)
        if results[0] is not None:
            np.frombuffer(results[0], dtype=float)[:] = x
        return 0


class Meter:
    """`functions` behave as the given ones, and are counted; `points` are (processor time [s], x) at each ∇f.

    `watch`, which may be replaced, is called with each of these points.
    """

    def __init__(self, functions: Functions):
        self.calls: Counter[str] = Counter()
        self.points: list[tuple[float, Array]] = []
        self.watch: Callable[[Array], None] = lambda x: None
        self._taps: list[_Tap] = []  # kept here, since CasADi holds no reference to them
        self.functions = Functions(**{name: self._metered(getattr(functions, name), CALLS[name]) for name in CALLS})

    def clear(self) -> None:
        """Begin anew."""
        self.calls.clear()
        self.points.clear()

    def _metered(self, function: ca.Function, call: str) -> ca.Function:
        """The function with a `_Tap` at its first argument."""

        def listen(x: Array) -> None:
            self.calls[call] += 1
            if call == "grad":
                self.points.append((time.process_time(), x.copy()))
                self.watch(x)

        tap = _Tap(function.size1_in(0), listen)
        self._taps.append(tap)
        symbols = [ca.MX.sym(function.name_in(i), function.sparsity_in(i)) for i in range(function.n_in())]
        results = function.call([tap(symbols[0]), *symbols[1:]])
        return ca.Function(function.name(), symbols, results, function.name_in(), function.name_out())
