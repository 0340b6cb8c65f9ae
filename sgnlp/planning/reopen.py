"""Rebuilds the problem of a saved result: reads its cloud from the source, and fits the same surface."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sgnlp.base.errors import InputError, KindError
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, available_hands, load_hand
from sgnlp.perception.observation import Observation, Reading, load
from sgnlp.planning.additions import NOTHING, Additions
from sgnlp.planning.cautions.planned import Planned
from sgnlp.planning.extension import extension
from sgnlp.planning.grasps import Grasps, unfit
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.results import GRASPS, load_grasps
from sgnlp.planning.surroundings import Surroundings

UNREADABLE = (AttributeError, KeyError, TypeError, ValueError, KindError)
"""What wrong types in the settings of a result raise."""


def settings(meta: dict[str, Any]) -> Settings:
    """The settings of a result; raises `InputError` if they are missing, damaged, or not valid in this version."""
    try:
        return Settings.restored(meta["settings"])
    except UNREADABLE:
        raise InputError(
            "settings of the result cannot be read; solve it again: they are another version's, or damaged"
        ) from None


def reading(meta: dict[str, Any]) -> Reading:
    """The options with which a result's cloud was read."""
    return Reading.restored(meta.get("reading") or {})


def source(grasps: Grasps, folder: Path, file: Path | None = None) -> Path:
    """The file that the result in a folder was solved from, or `file` instead.

    A relative path is tried in the folder where `sgnlp solve` was called, in the current one, and in those above the
    result, since both may have been moved together.

    Raises `InputError` if it is in none of them.
    """
    if file is not None:
        named, tried = file, [file]
    else:
        named = Path(grasps.meta.get("source") or "")
        places = (Path(grasps.meta.get("working_folder") or ""), Path(), *folder.absolute().parents)
        tried = [place / named for place in places]
    found = next((path for path in tried if path.is_file()), None)
    if found is None:
        said = f"'{tried[0]}' is not there" if str(named) != "." else "the result names no file"
        raise InputError(said if file else f"{said}; name its file with --object")
    return found


def observation(grasps: Grasps, folder: Path, file: Path | None = None) -> Observation:
    """The cloud of the result in a folder, read from its source or from `file`.

    Raises:
        InputError: the file is missing, or it is not the cloud that was solved.
    """
    path = source(grasps, folder, file)
    found = load(path, reading(grasps.meta))
    if found.digest != grasps.meta.get("input_digest"):
        raise InputError(f"'{path}' has changed, or was read with other options, since it was solved")
    return found


def problem(grasps: Grasps, cloud: Observation, hand: Hand) -> Problem:
    """The problem that the grasps solve: the same seed and settings fit the same surface."""
    added = additions(grasps.meta)
    given = Surroundings.restored(grasps.meta.get("surroundings", {}))
    found = build_problem(cloud, hand, settings(grasps.meta), int(grasps.meta["seed"]), added, given)
    if grasps.meta.get("replanned"):
        raise InputError("it was replanned: its surface is known from clouds before this one, or from touches")
    names = {
        "terms": [term.name for term in found.terms],
        "constraints": [constraint.name for constraint in found.constraints],
        "kernel": found.gpis.kernel.name,
    }
    if any(grasps.meta.get(part, own) != own for part, own in names.items()):
        raise InputError("it was planned with terms, constraints or a kernel that came from no file")
    return found


def additions(meta: Mapping[str, Any]) -> Additions:
    """The additions from the result's extension; raises `InputError` if its file is missing or has changed."""
    told = meta.get("extension")
    if not told:
        return NOTHING
    found = extension(told["file"])
    if found.digest != told["sha256"]:
        raise InputError(f"'{told['file']}' has changed since it was solved")
    return found.additions()


def opened(folder: Path, hand: str | None = None) -> tuple[Grasps, Hand]:
    """The grasps of a result and their hand; `hand` is the hand's folder, if it has moved.

    Raises:
        InputError: the result or the hand does not exist, or the result is damaged: its arrays do not fit the hand, or
            its settings cannot be read.
    """
    grasps, file = load_grasps(folder), folder / GRASPS if folder.is_dir() else folder
    try:
        spheres = grasps.meta["settings"]["spheres"]
        Settings.restored(grasps.meta["settings"])
    except UNREADABLE:
        raise InputError(f"settings of '{file}' cannot be read; solve it again") from None
    except InputError:  # a value that only another version takes: the grasps can still be looked at
        pass
    arm = grasps.meta.get("arm") or {}
    told = hand or grasps.meta.get("hand_folder") or grasps.meta.get("hand")
    if not isinstance(told, str) or not isinstance(arm, dict):
        raise InputError(f"'{file}': it does not name its hand; solve it again")
    found = _hand(grasps.meta, told, spheres)
    if fault := unfit(grasps, found):
        raise InputError(f"'{file}': {fault}; solve it again")
    return grasps, found


def _hand(meta: Mapping[str, Any], folder: str, spheres: str) -> Hand:
    """The hand of a result in a folder; where that is missing, a hand of the package that equals it."""
    arm, name = meta.get("arm") or {}, meta.get("hand")
    try:
        return load_hand(folder, spheres, arm.get("name"), arm.get("base", ()))
    except InputError as error:
        if Path(folder).is_dir() or folder in available_hands():
            raise
        if name in available_hands():
            found = load_hand(name, spheres, arm.get("name"), arm.get("base", ()))
            if found.digest == meta.get("hand_digest"):
                return found
        raise InputError(f"the hand '{name}' is not in '{folder}' any more; name its folder with --hand") from error


def changed(grasps: Grasps, hand: Hand) -> str:
    """Words on a hand whose files are others than when the grasps were planned; "" if they are the same."""
    if grasps.meta.get("hand_digest", hand.digest) == hand.digest:
        return ""
    return f"the hand in '{hand.folder}', or its arm, has changed since it was solved"


def replaced(grasps: Grasps, folder: Path) -> str:
    """Words on a file that holds another cloud than when it was solved; "" if it is the same, or is not known."""
    if not grasps.meta.get("input_digest"):
        return ""
    try:
        observation(grasps, folder)
    except InputError as error:
        return str(error)
    return ""


class Reopened(Planned):
    """A result read again."""


def reopen(folder: Path, file: Path | None = None, hand: str | None = None) -> Reopened:
    """A result with its problem; `file` is the cloud and `hand` the hand's folder, if they have moved.

    Raises:
        InputError: as `opened`.
    """
    grasps, found = opened(folder, hand)
    try:
        if said := changed(grasps, found):
            raise InputError(said)
        cloud = observation(grasps, folder, file)
        return Reopened(grasps, found, cloud, problem(grasps, cloud, found))
    except InputError as error:
        return Reopened(grasps, found, None, None, str(error))
