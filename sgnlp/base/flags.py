"""Settings as the words of a command line that has them: the flags of what is not as it was."""

from collections.abc import Iterator, Mapping
from typing import Any


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Flags and words that turn settings into others, both as mappings; sections are mappings in them."""
    for name, value in before.items():
        if isinstance(value, dict):
            yield from changed(f"{name}.", value, now[name])
        else:
            yield from changed("", {name: value}, now)


def changed(prefix: str, defaults: Mapping[str, Any], values: Mapping[str, Any]) -> list[str]:
    """Flags and words of the values that are not their defaults."""
    words = []
    for name, default in defaults.items():
        value, flag = values.get(name, default), name.replace("_", "-")
        if _plain(value) == _plain(default):
            continue
        if isinstance(value, bool):
            words.append(f"--{prefix}{flag}" if value else f"--{prefix}no-{flag}")
        else:
            words += [f"--{prefix}{flag}", *map(str, value if isinstance(value, list | tuple) else [value])]
    return words


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
