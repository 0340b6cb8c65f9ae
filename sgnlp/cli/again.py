"""The command that plans a result again, from what the result says of itself."""

import shlex
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sgnlp.base.flags import changed, differences
from sgnlp.base.presets import PRESETS, VARIANTS, preset
from sgnlp.cli.flags import Observing
from sgnlp.perception.observation import ObservationSettings
from sgnlp.planning import reopen
from sgnlp.planning.solvers import SOLVERS, settled

FILE = "FILE"
"""In the place of the cloud, if it was planned from Python and no file is known."""
DEFAULTS = Observing()


def command(meta: Mapping[str, Any], folder: Path) -> str:
    """`sgnlp solve` with the flags that are not at their defaults, the preset being the one that leaves fewest.

    A hand that is none of `sgnlp hands` is named; its folder is for the reader to know, as is a solver of their own.
    """
    reading = meta.get("reading") or {}
    words = ["sgnlp", "solve", str(meta.get("source") or FILE)]
    words += ["--views", *map(str, reading["views"])] if reading.get("views") else []
    words += changed("", {"scale": DEFAULTS.scale, "table_height": None, "key": None, "up": DEFAULTS.up}, reading)
    words += ["--pose", *map(repr, reading["pose"])] if reading.get("pose") else []
    for name in ("hand", "starts", "seed", "timeout"):
        words += changed("", {name: getattr(DEFAULTS, name)}, meta)
    usual = settled(None, reopen.settings(dict(meta)).solver).name
    solver = (meta.get("solver") or {}).get("name", usual)
    words += ["--solver", solver] if solver != usual and solver in SOLVERS else []
    words += changed("cleaning.", asdict(ObservationSettings()), reading.get("settings") or {})
    words += _settings(dict(meta))
    place = Path("results") / str(meta["object"])
    return shlex.join(words + (["--out", str(folder)] if folder != place else []))


def _settings(meta: dict[str, Any]) -> list[str]:
    """The preset, if it is not the first choice, and what differs from it."""
    found = asdict(reopen.settings(meta))
    names = [*PRESETS, *(f"paper+{variant}" for variant in VARIANTS)]
    flags = {name: list(differences(asdict(preset(name)), found)) for name in names}
    name = min(flags, key=lambda name: len(flags[name]) + (name != DEFAULTS.preset))
    return (["--preset", name] if name != DEFAULTS.preset else []) + flags[name]
