"""The errors of the package: one base class, so that a caller can catch them all at once."""

import errno


class SgnlpError(Exception):
    """Base of every error that sgnlp raises on purpose. Its message is one line and names what is valid."""


class InputError(SgnlpError):
    """An input (file, array, name or setting) is wrong. The command line ends with exit code 3."""

    def within(self, place: str) -> "InputError":
        """The same error, with the place that it is from before its message."""
        return InputError(f"{place}: {self}")


class KindError(InputError):
    """A value is of another kind than the type of its field, such as a text for a number."""


class NotInstalledError(InputError):
    """A package that an input needs is not installed; `command` installs it, if known."""

    def __init__(self, message: str, command: str = "") -> None:
        super().__init__(message)
        self.command = command

    def within(self, place: str) -> "NotInstalledError":
        """The same error, with the place that it is from before its message."""
        return NotInstalledError(f"{place}: {self}", self.command)


class SolverError(SgnlpError):
    """A solver, compiler or worker process failed in a way that is not the input's fault."""


class MachineError(SgnlpError):
    """The machine ran out of something: disk, memory or processes. The command line ends with exit code 4."""


GIVES_OUT = frozenset(
    {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ENOMEM, errno.EAGAIN, errno.EMFILE, errno.ENFILE}
)
"""System error numbers that are caused by the machine, not by a particular file."""


def gives_out(error: OSError) -> bool:
    """Whether the machine caused a system error, and not a particular file or name."""
    return error.errno in GIVES_OUT


def unknown(kind: str, name: str, valid: object) -> InputError:
    """An `InputError` for a name that is not known, listing the valid ones."""
    names = ", ".join(sorted(str(v) for v in valid))  # type: ignore[attr-defined]
    return InputError(f"unknown {kind} '{name}'; valid: {names}")
