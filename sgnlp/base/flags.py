"""The command-line flags that turn one set of settings into another."""

from collections.abc import Iterator, Mapping
from typing import Any


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """The flags that turn the settings `before` into those of `now`. Sections are nested mappings."""
    for name, value in before.items():
        if isinstance(value, dict):
            yield from changed(f"{name}.", value, now[name])
        else:
            yield from changed("", {name: value}, now)


def changed(prefix: str, defaults: Mapping[str, Any], values: Mapping[str, Any]) -> list[str]:
    """The flags of the values that differ from their defaults."""
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
