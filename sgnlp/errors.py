"""The errors of the package: one base class, so that a caller can catch them all at once."""


class SgnlpError(Exception):
    """Base of every error that sgnlp raises on purpose. Its message is one line and says what is valid."""


class InputError(SgnlpError):
    """An input (file, array, name or setting) is wrong. The command line ends with exit code 3."""


class SolverError(SgnlpError):
    """A solver or worker process failed in a way that is not the input's fault."""


def unknown(kind: str, name: str, valid: object) -> InputError:
    """An `InputError` for a name that is not known, listing the valid ones."""
    names = ", ".join(sorted(str(v) for v in valid))  # type: ignore[attr-defined]
    return InputError(f"unknown {kind} '{name}'; valid: {names}")
