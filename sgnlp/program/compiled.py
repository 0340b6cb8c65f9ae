"""The compiled functions of a nonlinear program, which serve every object and are kept in the user's cache.

The key is known before anything symbolic is built: the package's sources, the hand's files, the structure, CasADi, the
compiler, its flags and the processor. So a warm start builds no graph at all. Compiled and interpreted functions give
the same bits (`sgnlp.program.codegen`); a result does not depend on which of them ran.
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
"""Flags of the compiler: -O1 compiles half as long again and gains nothing; without optimisation the functions run
three times as long. Contraction would change the bits."""

LEVEL = 1
"""Level of zlib for functions in the cache: a seventh of the size. Level 6 gives a ninth, in twice the time."""

ROOMS = ("base", "perception", "surface", "hand", "program")
"""The rooms whose sources define the functions of a program: a change in one of them requires a new build."""


def program(hand: Hand, structure: Structure, compiled: bool = True) -> Nlp:
    """The program of a hand and structure: compiled if that is wanted and in the cache, else interpreted by CasADi.

    Both give the same bits.
    """
    if structure.inner != structure:
        return structure.formulation.wrap(program(hand, structure.inner, compiled))
    return (load(hand, structure) or interpreted(hand, structure)) if compiled else build(hand, structure)


@lru_cache(maxsize=KEPT)
def load(hand: Hand, structure: Structure) -> Nlp | None:
    """The compiled program from the cache; None if it is missing, damaged or cannot be loaded."""
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
    """The interpreted program: its functions come from the package, else from the cache, else they are built."""
    for content in _contents(hand, structure):
        if found := serialised.read(content):
            return Nlp(**frame(structure.of(hand), structure, found[0]), **found[1])
    return build(hand, structure)


def keep(hand: Hand, structure: Structure) -> None:
    """Put the functions of a program into the cache, unless package or cache have them: reading takes a third of
    building.

    Raises:
        SolverError: the cache cannot be written.
        MachineError: the disk is full.
    """
    kept = _kept(hand, structure)
    if kept is not None and not any(True for _ in _contents(hand, structure)):
        toolchain.keep(kept, zlib.compress(serialised.written(interpreted(hand, structure.inner)), LEVEL))


def file_name(hand: Hand, structure: Structure) -> str | None:
    """The name of the package's file with the functions of a program; None as in `path`.

    It is a digest of the same inputs as in `path`, except CasADi's version: CasADi reads files of its older versions.
    """
    key = _key(hand, structure)
    digest = key and hashlib.sha256("\0".join(key).encode() + _package()).hexdigest()[:16]
    return f"program-{structure.inner.formulation.name}-{digest}.xz" if digest else None


def _contents(hand: Hand, structure: Structure) -> Iterator[bytes]:
    """Candidates for the serialised functions of a program: from the package, then from the cache."""
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
    """Compile a program into the cache, unless it is there, and return its library, with the sizes of its rows as a
    note.

    One process builds, and others that need the same library wait. An interrupted build is resumed.

    Raises:
        SolverError: there is no compiler, it fails, the cache cannot be written, or the source of a part of the program
            is not known (`Structure.key`).
        MachineError: the disk is full.
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
        kept.unlink(missing_ok=True)  # the library replaces it
    load.cache_clear()
    return library


def built(library: Path) -> bool:
    """Whether an undamaged library is in the cache."""
    return toolchain.note_of(library) is not None


def share(library: Path) -> float:
    """The share of a library's files that are compiled, also by interrupted builds."""
    return 1.0 if built(library) else workshop.done(library)


def instructions(nlp: Nlp) -> int:
    """Number of instructions to compile."""
    functions = (getattr(nlp, name) for name in FUNCTIONS)
    return sum(f.n_instructions() for f in functions if f.is_a("SXFunction"))


def can_compile() -> bool:
    """Whether there is a working compiler and a usable cache."""
    return not (toolchain.cache_fault() or C.fault())


def path(hand: Hand, structure: Structure) -> Path | None:
    """The path of the compiled program of a hand and structure, whether or not it exists.

    None if the source of a part of it is not known: it could have changed unnoticed.
    """
    parts = _key(hand, structure)
    if parts is None:
        return None
    key = toolchain.fingerprint(_package(), *parts, ca.__version__, *FLAGS)
    return toolchain.cache_folder() / f"program-{structure.inner.formulation.name}-{key}.so"


def _key(hand: Hand, structure: Structure) -> tuple[str, ...] | None:
    """What the functions of a program depend on besides the package; None as in `path`."""
    of, key = structure.of(hand), structure.inner.key
    return None if key is None else (of.digest, key, identity(of.kinematics, *of.models))


def _kept(hand: Hand, structure: Structure) -> Path | None:
    """The path of a program's serialised functions in the cache, as `path`."""
    library = path(hand, structure)
    return library and library.with_suffix(".casadi")


def _sources(name: str, made: Callable[[], Nlp]) -> dict[str, str]:
    function = getattr(made(), name)
    if function.is_a("SXFunction"):
        return codegen.sources(function)
    generator = ca.CodeGenerator(f"{name}.c")  # the mapped jets, which are short
    generator.add(function)
    return {f"{name}.c": generator.dump()}


@lru_cache(maxsize=1)
def _package() -> bytes:
    """The sources of `ROOMS`, one after the other."""
    package = Path(__file__).parents[1]
    files = sorted(file for room in ROOMS for file in (package / room).rglob("*.py"))
    return b"\0".join(file.read_bytes() for file in files)
