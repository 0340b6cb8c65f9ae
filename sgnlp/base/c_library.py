"""Libraries of our own C sources: compiled once by the system's compiler, kept in the user's cache, and loaded."""

import ctypes
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

from sgnlp.base import toolchain
from sgnlp.base.errors import MachineError, SolverError

FLAGS = ("-march=native", "-fno-math-errno", "-fno-trapping-math")
"""No -ffast-math, because the same input must give the same bits."""


@dataclass(frozen=True)
class CLibrary:
    """C sources of a package that are compiled together. `name` begins the name of the file in the cache."""

    name: str
    package: str
    sources: tuple[str, ...]
    optimisation: str
    functions: tuple[str, ...]
    """Functions that it must have."""

    @property
    def flags(self) -> tuple[str, ...]:
        """The compiler's options."""
        return self.optimisation, *FLAGS

    @property
    def texts(self) -> dict[str, str]:
        """The sources, by name."""
        return {name: files(self.package).joinpath(name).read_text(encoding="utf-8") for name in self.sources}

    @property
    def path(self) -> Path:
        """Its place in the cache, where it is once it was loaded."""
        key = toolchain.fingerprint(*self.texts.values(), *self.flags)
        return toolchain.cache_folder() / f"{self.name}-{key}.so"

    def load(self) -> ctypes.CDLL | None:
        """The library, built if it is missing in the cache or damaged; None if it cannot be built or loaded."""
        return attempt(self)[0]

    def fault(self) -> str:
        """Why it cannot be built or loaded, with the remedy; "" if it can."""
        return attempt(self)[1]


@lru_cache
def attempt(library: CLibrary) -> tuple[ctypes.CDLL | None, str]:
    """The loaded library, or None and the reason with the remedy."""
    built = library.path
    try:
        if toolchain.note_of(built) is None:
            toolchain.build(built, library.texts, library.flags)
        loaded = ctypes.CDLL(str(built))
        for function in library.functions:
            getattr(loaded, function).restype = None
    except (SolverError, MachineError) as error:
        return None, str(error)
    except (OSError, AttributeError) as error:  # built for another processor, or on a file system that runs no programs
        return None, f"'{built}' cannot be loaded: {error}; {toolchain.ELSEWHERE}, or name another compiler in CC"
    return loaded, ""
