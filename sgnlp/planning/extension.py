"""A user's file that adds to plans: `sgnlp solve mug.npz --with my_terms.py`.

The file is Python. It may define any of `TERMS` and `CONSTRAINTS` (lists), `WITHOUT_TERMS` and `WITHOUT_CONSTRAINTS`
(lists of names), `KERNEL` (a class), `FORMULATION` and `SOLVER` (objects). Its text is sent to worker processes, also
on other machines. Its hash is part of the key of compiled functions and of the result.
"""

import hashlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from sgnlp.base.checked import typed
from sgnlp.base.errors import InputError, unknown
from sgnlp.planning.additions import Additions
from sgnlp.planning.solvers.solver import Solver
from sgnlp.program.constraint import Constraint
from sgnlp.program.formulation import Formulation
from sgnlp.program.terms import Term

LISTS: dict[str, type] = {
    "TERMS": Term,
    "CONSTRAINTS": Constraint,
    "WITHOUT_TERMS": str,
    "WITHOUT_CONSTRAINTS": str,
}
OBJECTS: dict[str, type] = {"FORMULATION": Formulation, "SOLVER": Solver}
"""The names that a file may define, and the type of each object, or of each part of a list."""
NAMES = (*LISTS, *OBJECTS, "KERNEL")
ALIKE = 0.8
"""A name in capitals that is this similar (difflib) to one of these is taken for a typing error."""


@dataclass(frozen=True)
class Extension:
    """The text of a user's file, and its path."""

    file: str
    text: str

    @property
    def digest(self) -> str:
        """SHA-256 of the text."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    def additions(self) -> Additions:
        """The additions in the file; the same text gives the same objects. Raises `InputError` if anything is wrong."""
        return _additions(self)


@typed
def extension(file: str | Path) -> Extension:
    """The extension in a Python file, for `solve(extension=...)` or `additions()`.

    Raises:
        InputError: the file cannot be read, fails, or defines nothing that an extension may define.
    """
    path = Path(file)
    try:
        found = Extension(str(path.absolute()), path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"'{file}' cannot be read: {getattr(error, 'strerror', None) or error}") from None
    found.additions()
    return found


@lru_cache(maxsize=8)
def _additions(given: Extension) -> Additions:
    module = ModuleType(f"sgnlp_extension_{given.digest[:8]}")
    module.__file__ = given.file
    sys.modules[module.__name__] = module  # so that its classes can be pickled, and looked up by dataclasses
    try:
        with _beside(Path(given.file).parent):
            exec(compile(given.text, given.file, "exec"), vars(module))
    except (Exception, SystemExit) as error:
        line = str(error).splitlines()[0] if str(error) else ""
        raise InputError(f"'{given.file}' fails: {type(error).__name__}: {line}") from None
    found: dict[str, Any] = {}
    for name, kind in LISTS.items():
        if hasattr(module, name):
            found[name.lower()] = _parts(module, name, kind, given)
    for name, kind in OBJECTS.items():
        if hasattr(module, name):
            found[name.lower()] = _signed(getattr(module, name), name, kind, given)
    if hasattr(module, "KERNEL"):
        found["kernel"] = module.KERNEL
    for name in vars(module):
        meant = get_close_matches(name, NAMES, 1, ALIKE) if name.isupper() and name not in NAMES else []
        if meant and not hasattr(module, meant[0]) and not name.startswith("_"):
            raise unknown(f"name in '{given.file}'", name, NAMES)
    if not found:
        raise InputError(f"'{given.file}' defines none of {', '.join(NAMES)}")
    try:
        return Additions(**found)
    except InputError as error:
        raise InputError(f"'{given.file}': {error}") from None


@contextmanager
def _beside(folder: Path) -> Iterator[None]:
    """Allow imports from the file's folder."""
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))


def _parts(module: ModuleType, name: str, kind: type, given: Extension) -> tuple[Any, ...]:
    values = getattr(module, name)
    if not isinstance(values, list | tuple):
        raise InputError(f"{name} in '{given.file}' must be a list, not {type(values).__name__}")
    return tuple(_signed(value, name, kind, given) for value in values)


def _signed(value: Any, name: str, kind: type, given: Extension) -> Any:
    """The part, with the hash of its source."""
    if not isinstance(value, kind):
        wrong = f"{value.__name__}, a class; call it" if isinstance(value, type) else type(value).__name__
        raise InputError(f"{name} in '{given.file}' needs {kind.__name__} objects, not {wrong}")
    if isinstance(value, Constraint):
        return replace(value, source=given.digest)
    if isinstance(value, Term | Formulation) and type(value).__module__.startswith("sgnlp_extension_"):
        type(value).source = given.digest
    return value
