"""Checks of the flags that more than one command has."""

from sgnlp.errors import InputError


def check(starts: int, seed: int, jobs: int, timeout: float, scale: float = 1.0) -> None:
    """Raise `InputError`, naming the flag, for a number of which no plan can be made."""
    for flag, value in {"starts": starts, "jobs": jobs, "timeout": timeout, "scale": scale}.items():
        if not value > 0:
            raise InputError(f"--{flag} must be positive, not {value}")
    if seed < 0:
        raise InputError(f"--seed must not be negative; found {seed}")
