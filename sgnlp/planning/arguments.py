"""The kinds of the arguments of `sgnlp.solve`, `replan` and `simulate`, and where to get what was not given."""

from collections.abc import Callable, Mapping
from numbers import Integral, Real
from types import NoneType
from typing import Any

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand
from sgnlp.perception.observation import Observation
from sgnlp.planning.ending import MOST
from sgnlp.planning.extension import Extension
from sgnlp.planning.plan import Plan
from sgnlp.planning.solvers.solver import Solver
from sgnlp.program.formulation import Formulation

Kinds = tuple[tuple[type, ...], str]

LIST: Kinds = ((list, tuple, set, frozenset), "it is a list")
WHOLE: Kinds = ((Integral,), "it is a whole number")
SECONDS: Kinds = ((Real,), "it is a number of seconds")
PLAN: Kinds = ((Plan,), "sgnlp.solve gives one")
OBSERVATION: Kinds = ((Observation,), "sgnlp.load(file) and sgnlp.observe(points) give one")
OF_SOLVE: Mapping[str, Kinds] = {
    "observation": OBSERVATION,
    "hand": ((str, Hand), "it is a name of `sgnlp hands`, or of sgnlp.load_hand"),
    "settings": ((Settings,), 'sgnlp.preset("robust") gives them'),
    "formulation": ((Formulation, NoneType), "it is an object of sgnlp.Formulation; names stand in settings.solver"),
    "solver": ((str, Solver, NoneType), "it is a name of `sgnlp solvers`, or an object of sgnlp.Solver"),
    "extension": ((Extension, NoneType), "sgnlp.extension(file) gives one"),
    **dict.fromkeys(("obstacles", "avoid", "touch", "terms", "constraints"), LIST),
    **dict.fromkeys(("without_terms", "without_constraints"), LIST),
    **dict.fromkeys(("count", "seed", "jobs", "rounds"), WHOLE),
    "first": ((Integral, NoneType), WHOLE[1]),
    "widen": ((bool,), "it is True or False"),
    "timeout": SECONDS,
    "deadline": ((Real, NoneType), SECONDS[1]),
    "progress": ((Callable,), "it is a function of each result; leave it out for none"),  # type: ignore[dict-item]
}


def check(given: Mapping[str, Any], kinds: Mapping[str, Kinds] = OF_SOLVE) -> None:
    """Raise `InputError` for the first argument, by name, that is of no allowed kind."""
    for name in kinds:
        value, (allowed, hint) = given[name], kinds[name]
        if not isinstance(value, allowed):
            what = f"the class {value.__name__}" if isinstance(value, type) else f"of type {type(value).__name__}"
            raise InputError(f"{name} is {what}; {hint}")


def check_search(count: int, jobs: int, timeout: float, seed: int) -> None:
    """Raise `InputError` for numbers of a search that are out of range."""
    if min(count, jobs) < 1 or not timeout > 0 or seed < 0:
        raise InputError(f"count {count}, jobs {jobs}, timeout {timeout:g} must be positive, seed {seed} not negative")
    if count > MOST:
        raise InputError(f"count (--starts) must be at most {MOST}, not {count}")
