"""The command that plans a result again, from the result's own `meta`."""

import shlex
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sgnlp.base.flags import changed, differences
from sgnlp.base.presets import PRESETS, VARIANTS, preset
from sgnlp.cli.flags import Observing
from sgnlp.perception.observation import PLAIN
from sgnlp.planning import reopen
from sgnlp.planning.ending import Ending
from sgnlp.planning.solvers import SOLVERS, settled
from sgnlp.planning.surroundings import Surroundings
from sgnlp.planning.widening import narrow

FILE = "FILE"
"""Placeholder for a file that is not known: the cloud of a plan from Python, and files of its surroundings."""
DEFAULTS = Observing()


def command(meta: Mapping[str, Any], folder: Path) -> str:
    """`sgnlp solve` with the flags that differ from their defaults; the preset is the one that needs the fewest.

    A solver of the user's own that came from no file is left out; for files of obstacles and regions it has `FILE`.
    """
    words = ["sgnlp", "solve", str(meta.get("source") or FILE)]
    words += differences(asdict(PLAIN), asdict(reopen.reading(dict(meta))))
    asked = dict(meta) | {"hand": meta.get("hand_folder") or meta.get("hand")}
    for name in ("hand", "starts", "seed", "timeout"):
        words += changed("", {name: getattr(DEFAULTS, name)}, asked)
    words += changed("", asdict(Ending()), meta)
    arm = meta.get("arm")
    words += ["--arm", arm["name"], "--arm-base", *map(str, arm["base"])] if arm else []
    usual = settled(None, reopen.settings(dict(meta)).solver).name
    solver = (meta.get("solver") or {}).get("name", usual)
    words += ["--with", meta["extension"]["file"]] if meta.get("extension") else []
    words += ["--solver", solver] if solver != usual and solver in SOLVERS else []
    given = Surroundings.restored(meta.get("surroundings") or {})
    for flag, shapes in (("obstacle", given.obstacles), ("avoid", given.avoid), ("touch", given.touch)):
        words += [f"--{flag}", FILE] if shapes else []
    words += _settings(dict(meta))
    place = Path("results") / str(meta["object"])
    return shlex.join(words + (["--out", str(folder)] if folder != place else []))


def _settings(meta: dict[str, Any]) -> list[str]:
    """The preset, if it is not the first choice, and what differs from it."""
    used = reopen.settings(meta)
    found = asdict(narrow(used) if meta.get("widened") else used)
    names = [*PRESETS, *(f"paper+{variant}" for variant in VARIANTS)]
    flags = {name: list(differences(asdict(preset(name)), found)) for name in names}
    name = min(flags, key=lambda name: len(flags[name]) + (name != DEFAULTS.preset))
    return (["--preset", name] if name != DEFAULTS.preset else []) + flags[name]
