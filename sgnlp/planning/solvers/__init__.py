"""Solvers of nonlinear programs, one file each with the same anatomy, found when they are asked for."""

from functools import lru_cache
from importlib import import_module
from pkgutil import iter_modules

from sgnlp.base.errors import unknown
from sgnlp.planning.solvers.anatomy import Method


@lru_cache(maxsize=1)
def found() -> dict[str, Method]:
    """Every method of every file beside this one that has `METHODS`, by name."""
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    return {method.name: method for module in modules for method in getattr(module, "METHODS", ())}


def method(name: str) -> Method:
    """The method of a name; raises `InputError` with the valid ones."""
    if name not in found():
        raise unknown("solver", name, found())
    return found()[name]
