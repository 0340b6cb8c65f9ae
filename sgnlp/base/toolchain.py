"""The system's C compiler and the user's cache of what it has built.

A library is cached under a key of its sources, flags, compiler and processor. A finished build is moved into place in
one step, so several processes can build at once, and a reader finds a whole library or none. Each library ends with its
digest, which is compared before loading: loading a truncated library would kill the process with SIGBUS.
"""

import hashlib
import os
import shlex
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import dropwhile
from pathlib import Path

from platformdirs import user_cache_path

from sgnlp.base.errors import MachineError, SolverError, gives_out

TIMEOUT = 300.0
"""Longest time that a compiler may take for one file [s]; it usually takes 1 to 3."""
SHARED = ("-shared", "-fPIC")
LIBRARIES = ("-lm",)
COMPILERS = ("cc", "gcc", "clang")
"""Compilers in the order in which they are tried where $CC is not set."""
WRAPPERS = frozenset({"ccache", "sccache", "distcc"})
"""Wrappers that are removed from $CC: builds are cached here anyway, and a wrapper may be missing or need a home."""
BUILDING = ".build-"
"""How the names of folders begin in which something is being built."""
SIZE_BYTES, DIGEST = 8, hashlib.sha256
"""The end of a library is a note, the length of the note in so many bytes, and the digest of all before it."""
ELSEWHERE = "set XDG_CACHE_HOME to a folder that can be written and holds programs"
FULL = "No space left on device"
"""Part of what a compiler prints when the disk is full."""


def cache_folder() -> Path:
    """Where libraries are kept: the user's cache folder, in XDG_CACHE_HOME where that is set to an absolute path.

    Where that cannot serve, and without a home, it is a folder in the one for temporary files that is the user's alone.
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
    """Delete everything in the cache, also what builds that were killed have left.

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


def compiler() -> list[str] | None:
    """The words of $CC, such as `gcc -std=gnu11`, or cc, gcc, clang where it is not set; None if there is none."""
    named = os.environ.get("CC", "").strip()
    if named and (whole := shutil.which(named)):  # a path with blanks in it, too
        return [whole]
    try:
        words = shlex.split(named)
    except ValueError:
        return None
    words = list(dropwhile(lambda word: Path(word).name in WRAPPERS, words))
    if not words:
        return next(([found] for found in map(shutil.which, COMPILERS) if found), None)
    found = shutil.which(words[0])
    return [found, *words[1:]] if found else None


def compiler_fault() -> str:
    """Why there is no compiler that starts, with the remedy; "" if there is one."""
    words, named = compiler(), os.environ.get("CC", "").strip()
    if words is None:
        return (
            f"no C compiler: $CC is '{named}', which is not found; unset CC or name one that is"
            if named
            else f"no C compiler: none of {', '.join(COMPILERS)} is on PATH; install one, or name it in CC"
        )
    try:
        asked = subprocess.run([*words, "--version"], capture_output=True, timeout=10)
    except (OSError, subprocess.SubprocessError) as error:
        return f"the C compiler '{shlex.join(words)}' does not start: {getattr(error, 'strerror', None) or error}"
    return _complaint(words, asked.stderr or asked.stdout) if asked.returncode else ""


def fingerprint(*parts: str | bytes) -> str:
    """A digest of parts, of the compiler and of the processor."""
    identity = " ".join(map(_identity, compiler() or ())) or "none"
    digest = hashlib.sha256()
    for part in (*parts, identity, processor()):
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
) -> None:
    """Compile C files, `jobs` at a time, link and seal them with a note, and move the library to `target`.

    Raises:
        SolverError: there is no compiler, it fails, or the folder cannot be written.
        MachineError: there is no room for it.
    """
    words = compiler()
    if words is None:
        raise SolverError(compiler_fault())
    if fault := _fault(target.parent, writing=True):
        raise SolverError(f"the cache '{target.parent}' {fault}; {ELSEWHERE}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=BUILDING) as name:
            _compile(words, Path(name), target.name, sources, flags, jobs, progress)
            library = Path(name, target.name)
            library.write_bytes(_sealed(library.read_bytes(), note))
            os.replace(library, target)
    except OSError as error:
        kind = MachineError if gives_out(error) else SolverError
        raise kind(f"the cache '{target.parent}' cannot be written: {error.strerror}; {ELSEWHERE}") from None


def note_of(library: Path) -> bytes | None:
    """The note that a library was sealed with; None if it is not there, or not as it was built."""
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


def _compile(
    words: Sequence[str],
    folder: Path,
    name: str,
    sources: Mapping[str, str],
    flags: Sequence[str],
    jobs: int,
    progress: Callable[[int, int], None],
) -> None:
    """The library `name` in a folder, where the compiler has its temporary files too."""
    for file, text in sources.items():
        (folder / file).write_text(text, encoding="utf-8")
    files = sorted(sources, key=lambda file: -len(sources[file]))
    environment = os.environ | {"TMPDIR": str(folder), "LC_ALL": "C"}

    def run(*arguments: str) -> None:
        command = [*words, *arguments]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, timeout=TIMEOUT, env=environment)
        except subprocess.TimeoutExpired:
            raise SolverError(f"the C compiler '{shlex.join(words)}' takes longer than {TIMEOUT:g} s") from None
        if done.returncode and FULL.encode() in done.stderr + done.stdout:
            raise MachineError(f"there is no room in the cache '{folder.parent}' ({FULL}); make some, or {ELSEWHERE}")
        if done.returncode:
            raise SolverError(_complaint(words, done.stderr or done.stdout))

    with ThreadPoolExecutor(jobs) as pool:  # the threads only wait for compilers
        for done, _ in enumerate(pool.map(lambda file: run(*flags, "-fPIC", "-c", file), files), start=1):
            progress(done, len(files))
    objects = [f"{Path(file).stem}.o" for file in files]
    run(*SHARED, "-o", name, *objects, *LIBRARIES)
    if not (folder / name).is_file():
        raise SolverError(f"the C compiler '{shlex.join(words)}' ends well, but makes no library; name another in CC")


def _sealed(content: bytes, note: bytes) -> bytes:
    content += note + len(note).to_bytes(SIZE_BYTES, "big")
    return content + DIGEST(content).digest()


def _complaint(words: Sequence[str], output: bytes) -> str:
    """That a compiler fails, in its own words: the line with its error, else its first."""
    lines = [line.strip() for line in output.decode(errors="replace").splitlines() if line.strip()]
    said = next((line for line in lines if "error" in line.lower()), lines[0] if lines else "it says nothing")
    where = "$CC" if os.environ.get("CC", "").strip() else "the C compiler"
    return f"{where} '{shlex.join(words)}' fails: {said}; name another in CC"


def _identity(word: str) -> str:
    """What identifies a word of $CC: of a program its path, size and time of change, of an option the word itself."""
    program = os.path.realpath(shutil.which(word) or "")
    if not os.path.isfile(program):
        return word
    status = os.stat(program)
    return f"{program} {status.st_size} {status.st_mtime_ns}"


def _usual_folder() -> Path | None:
    """The user's cache folder; None where there is no home. A path that is not absolute is to be ignored (XDG)."""
    named = os.environ.get("XDG_CACHE_HOME", "").strip()
    if named and os.path.isabs(named):
        return Path(named, "sgnlp")
    try:
        folder = Path.home() / ".cache" / "sgnlp" if named else user_cache_path("sgnlp")
    except (RuntimeError, KeyError):
        return None
    return folder if folder.is_absolute() else None


def _private_folder() -> Path | None:
    """A folder for temporary files of this user alone; None where there is none to be trusted."""
    try:
        folder = Path(tempfile.gettempdir()).absolute() / f"sgnlp-{os.getuid()}"
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except (OSError, AttributeError):
        return None
    shared = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return folder if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not shared else None


def _fault(folder: Path, writing: bool) -> str:
    """Why libraries cannot be kept in a folder and loaded from it, "" if they can; to read it, some must be there."""
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
