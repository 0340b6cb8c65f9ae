"""The system's compilers of C and C++: their paths, whether they start, and their error messages."""

import os
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import dropwhile
from pathlib import Path

WRAPPERS = frozenset({"ccache", "sccache", "distcc"})
"""Wrappers that are removed from $CC: builds are cached here anyway, and a wrapper may be missing or need a home."""


@dataclass(frozen=True)
class Compiler:
    """The compiler of a language."""

    language: str
    variable: str
    """The environment variable that names it."""
    programs: tuple[str, ...]
    """Programs that are tried in this order if the variable is not set."""

    def words(self) -> list[str] | None:
        """The command: the words of the variable, such as `gcc -std=gnu11`, or a program; None if there is none."""
        named = self._named
        if named and (whole := shutil.which(named)):  # the variable may also be a path with blanks
            return [whole]
        try:
            words = shlex.split(named)
        except ValueError:
            return None
        words = list(dropwhile(lambda word: Path(word).name in WRAPPERS, words))
        if not words:
            return next(([found] for found in map(shutil.which, self.programs) if found), None)
        found = shutil.which(words[0])
        return [found, *words[1:]] if found else None

    def fault(self) -> str:
        """Why no compiler starts, with the remedy; "" if one does."""
        words, variable = self.words(), self.variable
        if words is None:
            named = self._named
            return f"no {self.language} compiler: " + (
                f"${variable} is '{named}', which is not found; unset {variable} or name one that is"
                if named
                else f"none of {', '.join(self.programs)} is on PATH; install one, or name it in {variable}"
            )
        try:
            asked = subprocess.run([*words, "--version"], capture_output=True, timeout=10)
        except (OSError, subprocess.SubprocessError) as error:
            said = getattr(error, "strerror", None) or error
            return f"the {self.language} compiler '{shlex.join(words)}' does not start: {said}"
        return self.complaint(words, asked.stderr or asked.stdout) if asked.returncode else ""

    def complaint(self, words: Sequence[str], output: bytes) -> str:
        """A message that it fails, with its own line of error, or else its first line of output."""
        lines = [line.strip() for line in output.decode(errors="replace").splitlines() if line.strip()]
        said = next((line for line in lines if "error" in line.lower()), lines[0] if lines else "it says nothing")
        where = f"${self.variable}" if self._named else f"the {self.language} compiler"
        return f"{where} '{shlex.join(words)}' fails: {said}; name another in {self.variable}"

    def identity(self) -> str:
        """Identifies it: path, size and time of change of its program, and its options."""
        return " ".join(map(_identity, self.words() or ())) or "none"

    @property
    def _named(self) -> str:
        return os.environ.get(self.variable, "").strip()


C = Compiler("C", "CC", ("cc", "gcc", "clang"))
CPP = Compiler("C++", "CXX", ("c++", "g++", "clang++"))


def _identity(word: str) -> str:
    program = os.path.realpath(shutil.which(word) or "")
    if not os.path.isfile(program):
        return word
    status = os.stat(program)
    return f"{program} {status.st_size} {status.st_mtime_ns}"
