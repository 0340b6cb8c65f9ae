"""The user's cache of compiled libraries.

A library is cached under a key of its sources, flags, compiler and processor. A finished build is moved into place in
one step, so several processes can build at once, and a reader finds a whole library or none. Each library ends with its
digest, which is verified before loading: loading a truncated library would kill the process with SIGBUS.
"""

import hashlib
import os
import shlex
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from platformdirs import user_cache_path

from sgnlp.base.compilers import C, Compiler
from sgnlp.base.errors import MachineError, SolverError, gives_out

TIMEOUT = 900.0
"""Time limit of a compiler for one file [s]; it takes 1 to 3 s for a C file, 40 to 150 s for the C++ file."""
BUILDING = ".build-"
"""Prefix of the folders of unfinished builds."""
PART = ".part"
"""Suffix of files that a compiler has not finished."""
SIZE_BYTES, DIGEST = 8, hashlib.sha256
"""A library ends with a note, the note's length in this many bytes, and the digest of all before it."""
ELSEWHERE = "set XDG_CACHE_HOME to a folder that can be written and holds programs"
FULL = "No space left on device"
"""Text that a compiler prints when the disk is full."""


@dataclass(frozen=True)
class Linking:
    """The compiler of a library, and its arguments before and after the object files."""

    compiler: Compiler
    flags: tuple[str, ...]
    libraries: tuple[str, ...]


LIBRARY = Linking(C, ("-shared", "-fPIC"), ("-lm",))
"""A shared library of C."""


def cache_folder() -> Path:
    """The folder of the libraries: the user's cache folder, in XDG_CACHE_HOME if that is an absolute path.

    If that folder cannot be used, or there is no home, it is a private folder among the temporary files.
    """
    usual = _usual_folder()
    if usual is not None and not _fault(usual, writing=False):
        return usual
    private = _private_folder()
    if private is not None and not _fault(private, writing=False):
        return private
    return usual or private or Path(os.sep, "nonexistent")


def cache_fault() -> str:
    """Why nothing can be built into the cache, with the remedy; "" if it can. A full disk only shows when writing."""
    fault = _fault(cache_folder(), writing=True)
    return fault and f"the cache '{cache_folder()}' {fault}; {ELSEWHERE}"


def passed_over() -> str:
    """Why the cache is not the usual folder, with the remedy; "" if it is."""
    usual = _usual_folder()
    if usual == cache_folder():
        return ""
    return f"'{usual}' {_fault(usual, writing=False)}; {ELSEWHERE}" if usual else f"there is no home; {ELSEWHERE}"


def entries() -> list[Path]:
    """The files in the cache, sorted by name."""
    try:
        return sorted(file for file in cache_folder().iterdir() if file.is_file())
    except OSError:
        return []


def clear() -> None:
    """Delete everything in the cache, also the remains of killed builds.

    Raises:
        SolverError: something cannot be deleted.
    """
    try:
        for file in entries():
            file.unlink(missing_ok=True)
        for folder in cache_folder().glob(f"{BUILDING}*"):
            shutil.rmtree(folder, ignore_errors=True)
    except OSError as error:
        raise SolverError(f"the cache '{cache_folder()}' cannot be cleared: {error.strerror}") from None


def fingerprint(*parts: str | bytes, compiler: Compiler = C) -> str:
    """A digest of parts, of the compiler and of the processor."""
    digest = hashlib.sha256()
    for part in (*parts, compiler.identity(), processor()):
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "big") + data)
    return digest.hexdigest()[:24]


def build(
    target: Path,
    sources: Mapping[str, str],
    flags: Sequence[str],
    jobs: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
    note: bytes = b"",
    linking: Linking = LIBRARY,
) -> None:
    """Compile files, `jobs` at a time, link them, append a note and the digest, and move the library to `target`.

    Raises:
        SolverError: there is no compiler, it fails, or the folder cannot be written.
        MachineError: the disk is full.
    """
    if linking.compiler.words() is None:
        raise SolverError(linking.compiler.fault())
    with _inside(target.parent) as folder:
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        finish(folder, target, sources, flags, jobs, progress, note, linking)


def keep(target: Path, note: bytes) -> None:
    """Put a note without a library into the cache.

    Raises:
        SolverError: the folder cannot be written.
        MachineError: the disk is full.
    """
    with _inside(target.parent) as folder:
        (folder / target.name).write_bytes(_sealed(b"", note))
        os.replace(folder / target.name, target)


def once(target: Path, make: Callable[[], None], compiler: Compiler = C) -> None:
    """Make a file of the cache, unless it exists; one process makes it, and others that need it wait.

    Raises:
        SolverError: there is no compiler, or the folder cannot be written; also whatever `make` raises.
        MachineError: the disk is full.
    """
    if note_of(target) is not None:
        return
    if fault := cache_fault() or compiler.fault():
        raise SolverError(fault)
    from filelock import FileLock  # imported here: commands that find everything compiled do not need it

    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(target.with_suffix(".lock")):
            if note_of(target) is None:
                make()
    except OSError as error:  # of the lock
        raise _unwritten(target.parent, error) from None


def note_of(library: Path) -> bytes | None:
    """The note of a library; None if the library is missing or damaged."""
    try:
        content = library.read_bytes()
    except OSError:
        return None
    size = DIGEST().digest_size
    if len(content) < size + SIZE_BYTES or DIGEST(content[:-size]).digest() != content[-size:]:
        return None
    end = len(content) - size - SIZE_BYTES
    return content[end - int.from_bytes(content[end : end + SIZE_BYTES], "big") : end]


@lru_cache(maxsize=1)
def processor() -> str:
    """The processor's model and features on Linux; "" elsewhere."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").split("\n\n")[0].splitlines()
    except OSError:
        return ""
    return "\n".join(line for line in lines if line.startswith(("model name", "flags", "Features")))


@contextmanager
def _inside(cache: Path) -> Iterator[Path]:
    """A temporary folder in the cache."""
    if fault := _fault(cache, writing=True):
        raise SolverError(f"the cache '{cache}' {fault}; {ELSEWHERE}")
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=cache, prefix=BUILDING) as name:
            yield Path(name)
    except OSError as error:
        raise _unwritten(cache, error) from None


def _unwritten(cache: Path, error: OSError) -> SolverError | MachineError:
    kind = MachineError if gives_out(error) else SolverError
    return kind(f"the cache '{cache}' cannot be written: {error.strerror or error}; {ELSEWHERE}")


def finish(
    folder: Path,
    target: Path,
    files: Collection[str],
    flags: Sequence[str],
    jobs: int,
    progress: Callable[[int, int], None],
    note: bytes,
    linking: Linking = LIBRARY,
) -> None:
    """`build` from files in a folder, which also gets the compiler's temporary files.

    Files that an interrupted build has compiled already are not compiled again.
    """
    words, compiler, name = linking.compiler.words() or [], linking.compiler, target.name
    told = f"the {compiler.language} compiler '{shlex.join(words)}'"
    environment = os.environ | {"TMPDIR": str(folder), "LC_ALL": "C"}

    def run(*arguments: str) -> None:
        command = [*words, *arguments]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, timeout=TIMEOUT, env=environment)
        except subprocess.TimeoutExpired:
            raise SolverError(f"{told} takes longer than {TIMEOUT:g} s") from None
        if done.returncode and FULL.encode() in done.stderr + done.stdout:
            raise MachineError(f"there is no room in the cache '{folder.parent}' ({FULL}); make some, or {ELSEWHERE}")
        if done.returncode:
            raise SolverError(compiler.complaint(words, done.stderr or done.stdout))

    def one(file: str) -> None:
        made = folder / f"{Path(file).stem}.o"
        if not made.exists():
            run(*flags, "-fPIC", "-c", file, "-o", f"{made.name}{PART}")
            with suppress(FileNotFoundError):  # linking will report it
                os.replace(f"{made}{PART}", made)

    largest_first = sorted(files, key=lambda file: -(folder / file).stat().st_size)
    with ThreadPoolExecutor(jobs) as pool:  # the threads only wait for compilers
        for done, _ in enumerate(pool.map(one, largest_first), start=1):
            progress(done, len(files))
    run(*linking.flags, "-o", name, *(f"{Path(file).stem}.o" for file in largest_first), *linking.libraries)
    library = folder / name
    if not library.is_file():
        raise SolverError(f"{told} ends well, but makes no library; name another in {compiler.variable}")
    library.write_bytes(_sealed(library.read_bytes(), note))
    os.replace(library, target)


def _sealed(content: bytes, note: bytes) -> bytes:
    content += note + len(note).to_bytes(SIZE_BYTES, "big")
    return content + DIGEST(content).digest()


def _usual_folder() -> Path | None:
    """The user's cache folder; None without a home. Relative paths are ignored, as XDG requires."""
    named = os.environ.get("XDG_CACHE_HOME", "").strip()
    if named and os.path.isabs(named):
        return Path(named, "sgnlp")
    try:
        folder = Path.home() / ".cache" / "sgnlp" if named else user_cache_path("sgnlp")
    except (RuntimeError, KeyError):
        return None
    return folder if folder.is_absolute() else None


def _private_folder() -> Path | None:
    """A private folder of this user among the temporary files; None if none can be trusted."""
    try:
        folder = Path(tempfile.gettempdir()).absolute() / f"sgnlp-{os.getuid()}"
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except (OSError, AttributeError):
        return None
    shared = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return folder if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not shared else None


def _fault(folder: Path, writing: bool) -> str:
    """Why a folder cannot hold libraries, "" if it can. With `writing` false, it must contain some already."""
    try:
        existing = next(path for path in (folder, *folder.parents) if os.path.lexists(path))
        if not existing.is_dir():
            return f"cannot be made: '{existing}' is not a folder"
        if os.statvfs(existing).f_flag & os.ST_NOEXEC:
            return "is on a file system that runs no programs (noexec)"
        if not os.access(existing, os.W_OK | os.X_OK) and (writing or not any(folder.glob("*.so"))):
            return "cannot be written"
    except OSError as error:
        return f"cannot be used: {error.strerror}"
    return ""
