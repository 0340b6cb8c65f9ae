"""The functions of a nonlinear program compiled, once for every object, and kept in the user's cache.

The key is known before anything symbolic is built: the sources that make it, the hand's files, the structure, CasADi,
the compiler, its flags and the processor. So a warm start builds no graph at all. Compiled and interpreted functions
give the same bits (`sgnlp.program.codegen`); a result does not depend on which of them ran.
"""

import hashlib
import json
import lzma
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache, partial
from pathlib import Path

import casadi as ca

from sgnlp.base import toolchain, workshop
from sgnlp.base.compilers import C
from sgnlp.base.errors import SolverError
from sgnlp.hand.hand import Hand
from sgnlp.hand.library import beside
from sgnlp.hand.placements import identity
from sgnlp.program import codegen, serialised
from sgnlp.program.nlp import FUNCTIONS, KEPT, Nlp, build, frame
from sgnlp.program.structure import Structure

FLAGS = ("-Og", "-ffp-contract=off")
"""-O1 compiles half as long again and gains nothing, and without optimising they run three times as long. Contraction
would change the bits."""

LEVEL = 1
"""Of zlib, for functions in the cache: a seventh of the size. 6 gives a ninth of it, for twice the time."""

ROOMS = ("base", "perception", "surface", "hand", "program")
"""The rooms that the functions of a program are made of: a change in one of them asks for a new build."""


def program(hand: Hand, structure: Structure, compiled: bool = True) -> Nlp:
    """The program of a hand and structure: compiled if it is wanted and in the cache, else in CasADi's machine.

    All three ways give the same bits.
    """
    if structure.inner != structure:
        return structure.formulation.wrap(program(hand, structure.inner, compiled))
    return (load(hand, structure) or interpreted(hand, structure)) if compiled else build(hand, structure)


@lru_cache(maxsize=KEPT)
def load(hand: Hand, structure: Structure) -> Nlp | None:
    """The compiled program from the cache; None if it is not there, is damaged or cannot be loaded."""
    hand, library = structure.of(hand), path(hand, structure)
    if library is None:
        return None
    note = toolchain.note_of(library)
    if note is None:
        return None
    try:
        sizes = tuple(json.loads(note))
        functions = {name: ca.external(name, str(library)) for name in FUNCTIONS}
    except (OSError, ValueError, RuntimeError):
        return None
    return Nlp(**frame(hand, structure, sizes), **functions)


@lru_cache(maxsize=KEPT)
def interpreted(hand: Hand, structure: Structure) -> Nlp:
    """The program in CasADi's machine: its functions as the package carries or the cache keeps them, else built."""
    for content in _contents(hand, structure):
        if found := serialised.read(content):
            return Nlp(**frame(structure.of(hand), structure, found[0]), **found[1])
    return build(hand, structure)


def keep(hand: Hand, structure: Structure) -> None:
    """Put the functions of a program into the cache, unless they are to be had: reading takes a third of building.

    Raises:
        SolverError: the cache cannot be written.
        MachineError: there is no room for it.
    """
    kept = _kept(hand, structure)
    if kept is not None and not any(True for _ in _contents(hand, structure)):
        toolchain.keep(kept, zlib.compress(serialised.written(interpreted(hand, structure.inner)), LEVEL))


def file_name(hand: Hand, structure: Structure) -> str | None:
    """The name of the file in which the package carries the functions of a program.

    It tells by what they were made, as `path` does, but for CasADi: it reads what older versions have written.
    """
    key = _key(hand, structure)
    digest = key and hashlib.sha256("\0".join(key).encode() + _package()).hexdigest()[:16]
    return f"program-{structure.inner.formulation.name}-{digest}.xz" if digest else None


def _contents(hand: Hand, structure: Structure) -> Iterator[bytes]:
    """What may be the functions of a program, serialised."""
    name, kept = file_name(hand, structure), _kept(hand, structure)
    with suppress(zlib.error, lzma.LZMAError, OSError):
        if name and (carried := beside(name)) is not None:
            yield lzma.decompress(carried.read_bytes())
    with suppress(zlib.error):
        if kept and (content := toolchain.note_of(kept)):
            yield zlib.decompress(content)


def compile_program(
    hand: Hand, structure: Structure, jobs: int = 1, progress: Callable[[int, int], None] = lambda done, total: None
) -> Path:
    """Compile a program into the cache, unless it is there, and return its library. It notes the sizes of its rows.

    One process builds and others that want the same wait for it. What a build that was broken off has done is not done
    again.

    Raises:
        SolverError: there is no compiler, it fails, the cache cannot be written, or a part of the program has no
            source that is known (`Structure.key`).
        MachineError: there is no room for it.
    """
    library = path(hand, structure)
    if library is None:
        raise SolverError("terms and constraints that come from no file are not compiled")

    def make() -> None:
        made = partial(interpreted, hand, structure.inner)
        parts = {name: partial(_sources, name, made) for name in FUNCTIONS}
        workshop.build(library, parts, lambda: json.dumps(made().row_sizes).encode(), FLAGS, jobs, progress)

    toolchain.once(library, make)
    if (kept := _kept(hand, structure)) is not None:
        kept.unlink(missing_ok=True)  # which the library makes superfluous
    load.cache_clear()
    return library


def built(library: Path) -> bool:
    """Whether a library is in the cache, as it was built."""
    return toolchain.note_of(library) is not None


def share(library: Path) -> float:
    """The share of a library's files that are compiled, by builds that were broken off too."""
    return 1.0 if built(library) else workshop.done(library)


def instructions(nlp: Nlp) -> int:
    """How many instructions there are to compile."""
    functions = (getattr(nlp, name) for name in FUNCTIONS)
    return sum(f.n_instructions() for f in functions if f.is_a("SXFunction"))


def can_compile() -> bool:
    """Whether a compiler that works is found, and a cache for what it makes."""
    return not (toolchain.cache_fault() or C.fault())


def path(hand: Hand, structure: Structure) -> Path | None:
    """Where the compiled program of a hand and structure lies, whether it is there or not.

    None if a part of it has no source that is known: it could have changed unnoticed.
    """
    parts = _key(hand, structure)
    if parts is None:
        return None
    key = toolchain.fingerprint(_package(), *parts, ca.__version__, *FLAGS)
    return toolchain.cache_folder() / f"program-{structure.inner.formulation.name}-{key}.so"


def _key(hand: Hand, structure: Structure) -> tuple[str, ...] | None:
    """What the functions of a program depend on beside the package; None as in `path`."""
    of, key = structure.of(hand), structure.inner.key
    return None if key is None else (of.digest, key, identity(of.kinematics, *of.models))


def _kept(hand: Hand, structure: Structure) -> Path | None:
    """Where the functions of a program lie that are not compiled, as `path`."""
    library = path(hand, structure)
    return library and library.with_suffix(".casadi")


def _sources(name: str, made: Callable[[], Nlp]) -> dict[str, str]:
    function = getattr(made(), name)
    if function.is_a("SXFunction"):
        return codegen.sources(function)
    generator = ca.CodeGenerator(f"{name}.c")  # the mapped jets: short
    generator.add(function)
    return {f"{name}.c": generator.dump()}


@lru_cache(maxsize=1)
def _package() -> bytes:
    """The sources of `ROOMS`, one after the other."""
    package = Path(__file__).parents[1]
    files = sorted(file for room in ROOMS for file in (package / room).rglob("*.py"))
    return b"\0".join(file.read_bytes() for file in files)
