"""The command that plans a result again, from what the result says of itself."""

import shlex
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sgnlp import refit
from sgnlp.cli.flags import Observing
from sgnlp.observation import ObservationSettings
from sgnlp.presets import PRESETS, VARIANTS, preset

FILE = "FILE"
"""In the place of the cloud, if it was planned from Python and no file is known."""
DEFAULTS = Observing()


def command(meta: Mapping[str, Any], folder: Path) -> str:
    """`sgnlp solve` with the flags that are not at their defaults, the preset being the one that leaves fewest.

    A hand that is none of `sgnlp hands` is named; its folder is for the reader to know.
    """
    reading = meta.get("reading") or {}
    words = ["sgnlp", "solve", str(meta.get("source") or FILE)]
    words += ["--views", *map(str, reading["views"])] if reading.get("views") else []
    words += _changed("", {"scale": DEFAULTS.scale, "table_height": None}, reading)
    for name in ("hand", "starts", "seed", "timeout"):
        words += _changed("", {name: getattr(DEFAULTS, name)}, meta)
    words += _changed("cleaning.", asdict(ObservationSettings()), reading.get("settings") or {})
    words += _settings(dict(meta))
    usual = Path("results") / str(meta["object"])
    return shlex.join(words + (["--out", str(folder)] if folder != usual else []))


def _settings(meta: dict[str, Any]) -> list[str]:
    """The preset, if it is not the first choice, and what differs from it."""
    found = asdict(refit.settings(meta))
    names = [*PRESETS, *(f"paper+{variant}" for variant in VARIANTS)]
    flags = {name: list(_differences(asdict(preset(name)), found)) for name in names}
    name = min(flags, key=lambda name: len(flags[name]) + (name != DEFAULTS.preset))
    return (["--preset", name] if name != DEFAULTS.preset else []) + flags[name]


def _differences(base: dict[str, Any], found: dict[str, Any]) -> Iterator[str]:
    for name, value in base.items():
        if isinstance(value, dict):
            yield from _changed(f"{name}.", value, found[name])
        else:
            yield from _changed("", {name: value}, found)


def _changed(prefix: str, defaults: Mapping[str, Any], values: Mapping[str, Any]) -> list[str]:
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
