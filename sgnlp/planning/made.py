"""How the rows of a folder were made: by its `made.json`, rows of other settings are not mixed with them."""

import json
from pathlib import Path
from typing import Any

from sgnlp.base.errors import InputError
from sgnlp.planning.results import json_text

NAMED = 3
"""Largest number of differences that are named if rows of other settings are refused."""


def resumed(file: Path, made: dict[str, Any]) -> dict[str, Any]:
    """`made`, together with the other commits that made the folder's existing rows, by its `made.json`.

    Raises `InputError` if that file belongs to another study, whose rows must not be mixed with these.
    """
    if not file.is_file():
        return made
    try:
        before = json.loads(file.read_text(encoding="utf-8"))
    except ValueError:
        before = {}
    inputs, wanted = made.get("inputs", {}), json.loads(json_text(made["study"]))
    known = before.get("inputs", {})
    changed = [f"cloud {name}" for name, digest in inputs.items() if known.get(name, digest) != digest]
    study = before.get("study")
    changed += _changes(study, wanted) if isinstance(study, dict) else [] if study == wanted else ["settings"]
    if changed:
        said = f"{', '.join(changed[:NAMED])}{', ...' if len(changed) > NAMED else ''}"
        raise InputError(
            f"'{file.parent}' holds rows of other settings or clouds ({said}); choose another --out or delete it"
        )
    commits = [*before.get("earlier_commits", []), before.get("commit")]
    earlier = [commit for commit in dict.fromkeys(commits) if commit and commit != made.get("commit")]
    return made | {"earlier_commits": earlier} if earlier else made


def _changes(before: dict[str, Any], now: dict[str, Any], group: str = "") -> list[str]:
    """The differences of two nested mappings, such as `solver.tolerance was 1e-06, is 0.001`."""
    found = []
    for name in dict.fromkeys((*before, *now)):
        old, new = before.get(name), now.get(name)
        if isinstance(old, dict) and isinstance(new, dict):
            found += _changes(old, new, f"{group}{name}.")
        elif old != new:
            found.append(f"{group}{name} was {old}, is {new}")
    return found
