"""A result's problem posed again: its cloud read from its source, its surface fitted as it was."""

from dataclasses import fields
from pathlib import Path
from typing import Any

from sgnlp.errors import InputError
from sgnlp.grasps import Grasps
from sgnlp.hand import Hand
from sgnlp.observation import Observation, ObservationSettings, load
from sgnlp.problem import Problem, pose
from sgnlp.settings import Settings


def settings(meta: dict[str, Any]) -> Settings:
    """The settings that a result was planned with."""
    known: dict[str, Any] = {f.name: f.default_factory for f in fields(Settings)}
    values = {name: value for name, value in meta["settings"].items() if name in known}
    return Settings(**{n: known[n](**value) if isinstance(value, dict) else value for n, value in values.items()})


def observation(grasps: Grasps, file: Path | None = None) -> Observation:
    """The cloud that was solved, from its source or from `file`.

    Raises:
        InputError: the file is missing, or it is not the cloud that was solved.
    """
    source = file or Path(grasps.meta.get("source") or "")
    if not source.is_file():
        named = f"'{source}' is not there" if str(source) != "." else "the result names no file"
        raise InputError(f"{named}; name the file that was solved with --object")
    options = dict(grasps.meta.get("reading") or {})
    if "settings" in options:
        options["settings"] = ObservationSettings(**options["settings"])
    found = load(source, **options)
    if found.digest != grasps.meta.get("input_digest"):
        raise InputError(f"'{source}' has changed, or was read with other options, since it was solved")
    return found


def problem(grasps: Grasps, cloud: Observation, hand: Hand) -> Problem:
    """The problem that the grasps solve: the same seed and settings fit the same surface."""
    return pose(cloud, hand, settings(grasps.meta), int(grasps.meta["seed"]))
