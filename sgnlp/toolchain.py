"""The system's C compiler and the user's cache of what it has built.

A library is cached under a key of its sources, flags, compiler and processor; a build that ends is moved into place
whole, so that processes may build at once and a reader finds all of it or nothing.
"""

import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path

from platformdirs import user_cache_path

TIMEOUT = 300.0
"""A compiler that takes longer than this for one file [s] is given up; it takes 1 to 3."""
SHARED = ("-shared", "-fPIC")
LIBRARIES = ("-lm",)


def cache_folder() -> Path:
    """Where libraries are kept: the user's cache folder, XDG_CACHE_HOME where that is set."""
    return user_cache_path("sgnlp")


def entries() -> list[Path]:
    """The files in the cache, sorted by name."""
    return sorted(file for file in cache_folder().glob("*") if file.is_file())


def compiler() -> str | None:
    """The path of $CC, or of cc; None where there is none."""
    return shutil.which(os.environ.get("CC", "cc"))


def fingerprint(*parts: str | bytes) -> str:
    """A digest of parts, of the compiler and of the processor."""
    program = os.path.realpath(compiler() or "")
    status = os.stat(program) if program and os.path.isfile(program) else None
    identity = f"{program} {status.st_size} {status.st_mtime_ns}" if status else "none"
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
) -> None:
    """Compile C files, `jobs` at a time, link them, and move the library to `target`.

    Raises:
        OSError, subprocess.SubprocessError: there is no compiler, it fails, or the folder cannot be written.
    """
    program = compiler()
    if program is None:
        raise FileNotFoundError("no C compiler")
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".build-") as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        files = sorted(sources, key=lambda file: -len(sources[file]))

        def run(*arguments: str) -> None:
            command = [program, *arguments]
            subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=TIMEOUT)

        with ThreadPoolExecutor(jobs) as pool:  # the threads only wait for compilers
            for done, _ in enumerate(pool.map(lambda file: run(*flags, "-fPIC", "-c", file), files), start=1):
                progress(done, len(files))
        objects = [f"{Path(file).stem}.o" for file in files]
        run(*SHARED, "-o", target.name, *objects, *LIBRARIES)
        os.replace(folder / target.name, target)


@lru_cache(maxsize=1)
def processor() -> str:
    """The processor's model and features, as Linux tells them; "" elsewhere."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").split("\n\n")[0].splitlines()
    except OSError:
        return ""
    return "\n".join(line for line in lines if line.startswith(("model name", "flags", "Features")))
