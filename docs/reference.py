"""The reference pages that are made from the code: settings from their docstrings, commands from their parsers."""

import inspect
import io
import os
import re
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from itertools import dropwhile, takewhile
from pathlib import Path
from typing import Any
from unittest.mock import patch

import griffe
import rooms

from sgnlp import preset
from sgnlp.base.checked import NOT_NEGATIVE, POSITIVE, Checked
from sgnlp.cli import COMMANDS, run
from sgnlp.perception.observation import ObservationSettings
from sgnlp.perception.synthetic.cameras import DepthCamera
from sgnlp.perception.synthetic.scenes import Ring
from sgnlp.planning.solvers import SOLVERS
from sgnlp.show.sheets import markdown
from sgnlp.simulation import SimulationSettings

PRESETS = ("robust", "paper")
"""The presets whose values stand side by side."""
OTHERS = {
    "Cleaning of clouds": ObservationSettings(),
    "Simulation": SimulationSettings(),
    "Where the simulated cameras stand": Ring(),
    "What a simulated camera measures": DepthCamera(),
}
ROOT = Path(__file__).parents[1]
EXIT_CODES = {
    0: "a feasible grasp was found, or the command did what it was asked",
    1: "no start gave a feasible grasp, or the first choice is not as confident as `--min-confidence` asks; with "
    "`sgnlp batch` one of the objects is so; with `sgnlp simulate` no grasp held with the full score; with `sgnlp "
    "study` a case failed",
    2: "the flags are wrong",
    3: "a file, a name or a value is wrong; with `sgnlp check-hand` and `sgnlp draft-hand`, the hand",
    4: "the machine ran out of disk, memory, processes or open files; no file is half-written",
    130: "ended by Ctrl-C",
    141: "the reader of the output has closed the pipe",
}
BAR = re.compile(r"(?<!\\)\|")
"""What divides the cells of a Markdown table."""
INTERVAL = re.compile(r"^[\d.]+ \([\d.]+(?:-[\d.]+)?\)$")
"""A number and what belongs to it, 94 (83-98), in a line of its own cell."""
GROUP = re.compile(r"^ [\w-]+ options\n(?:(?! \w).*\n)*", re.MULTILINE)
"""The flags of one group of settings: the title, and all lines before the next one."""


def settings() -> str:
    """The page of all settings: flag, value in each preset, valid values, meaning."""
    chosen = {name: preset(name) for name in PRESETS}
    text = [
        "# Settings",
        "Every setting of a plan is a flag of the commands that plan (`sgnlp solve --gpis.kernel matern52`) and a "
        'field in Python (`sgnlp.preset("robust").gpis.kernel`). A value that is not valid is refused in one line that '
        "names the flag and what is valid. [Presets](../howto/variations.md#presets) set many at once. Bold is what "
        "differs from the first column. This page is made from the docstrings of the settings when it is built.",
        *_sections("Plan", chosen),
    ]
    for title, instance in OTHERS.items():
        text += _sections(title, {"default": instance})
    return "\n\n".join(text) + "\n"


def _sections(title: str, instances: dict[str, Any]) -> Iterator[str]:
    """A heading and a table of the plain fields, then the same of each field that is itself settings."""
    first = next(iter(instances.values()))
    nested = [f.name for f in fields(first) if is_dataclass(getattr(first, f.name))]
    plain = [f.name for f in fields(first) if f.name not in nested]
    yield f"## {title}"
    yield " ".join((inspect.getdoc(type(first)) or "").split())
    head = ["flag", *instances, "valid", "meaning"]
    rows = [_row(first, name, [getattr(instance, name) for instance in instances.values()]) for name in plain]
    yield markdown([head, *rows])
    for name in nested:
        inner = {preset_name: getattr(instance, name) for preset_name, instance in instances.items()}
        yield from _sections(name.capitalize(), inner)


def _row(owner: Checked, name: str, values: list[Any]) -> list[str]:
    flag = ".".join(filter(None, [owner.section, name])).replace("_", "-")
    if isinstance(owner, SimulationSettings):  # whose flags have no prefix
        flag = name.replace("_", "-")
    shown = [f"`{_value(value)}`" for value in values]
    shown = [f"**{v}**" if v != shown[0] else v for v in shown]
    return [f"`--{flag}`", *shown, _valid(owner, name), _meaning(type(owner), name)]


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return " ".join(map(_value, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _valid(owner: Checked, name: str) -> str:
    if names := owner.names(name):
        return ", ".join(f"`{choice}`" for choice in names)
    interval = owner.interval(name)
    words = {POSITIVE: "positive", NOT_NEGATIVE: "not negative"}
    if interval is None:
        return "yes or no" if isinstance(getattr(owner, name), bool) else ""
    low, high = interval
    return words.get(interval) or (f"at least {low:g}" if high >= POSITIVE[1] else f"{low:g} to {high:g}")


@cache
def _package(name: str) -> Any:
    return griffe.load(name)


def _meaning(kind: type, name: str) -> str:
    """The docstring under a field, else the comment behind it, else the one above it, in one line."""
    package, _, module = kind.__module__.partition(".")
    attribute = _package(package)[f"{module}.{kind.__name__}"].members[name]
    if attribute.docstring:
        return " ".join(attribute.docstring.value.split())
    lines = inspect.getsource(import_module(kind.__module__)).splitlines()
    above, line = (text.strip() for text in lines[attribute.lineno - 2 : attribute.lineno])
    return line.partition("  # ")[2] or (above.removeprefix("# ") if above.startswith("# ") else "")


def record(name: str) -> str:
    """The fields of a dataclass with what its source says of each, or their names where it says nothing."""
    module, _, kind = name.rpartition(".")
    made = getattr(import_module(module), kind)
    rows = [[f"`{f.name}`", _meaning(made, f.name)] for f in fields(made)]
    return (
        markdown([["field", ""], *rows])
        if any(said for _, said in rows)
        else ", ".join(field for field, _ in rows) + "."
    )


MARKER = re.compile(
    r"<!-- (?P<maker>fields|rooms|table|solvers)(?:: (?P<name>[\w./-]+)(?: \| (?P<title>[^\n]+))?)? -->"
)
"""A comment that stands for what is made: `table: FILE | the beginning of the title that the table stands below`."""


def filled(page: str) -> str:
    """A page with its markers replaced by what they stand for."""
    makers: dict[str, Callable[[re.Match[str]], str]] = {
        "fields": lambda marker: record(marker["name"]),
        "rooms": lambda _: rooms.drawn() + "\n\n" + rooms.described(),
        "table": lambda marker: copied(marker["name"], marker["title"] or ""),
        "solvers": lambda _: solvers(),
    }
    return MARKER.sub(lambda marker: makers[marker["maker"]](marker), page)


def solvers() -> str:
    """The table of solvers."""
    rows = [[f"`{name}`", e.kind, str(e.derivatives), e.summary, e.known] for name, e in SOLVERS.items()]
    return markdown([["name", "kind", "derivatives", "what it is", "why a comparison leaves it out"], *rows])


def copied(file: str, title: str = "") -> str:
    """The first table of a Markdown file of the project, or the first below a title that begins so.

    Columns that say nothing in any row are left out.

    Raises:
        ValueError: there is no such table; the build ends.
    """
    lines = (ROOT / file).read_text(encoding="utf-8").splitlines()
    below = dropwhile(lambda line: bool(title) and not line.startswith(f"## {title}"), lines)
    found = list(takewhile(_in_table, dropwhile(lambda line: not _in_table(line), below)))
    if not found:
        raise ValueError(f"{file} has no table '{title}'")
    columns = list(zip(*([cell.strip() for cell in BAR.split(line)[1:-1]] for line in found), strict=True))
    head, _, *rows = zip(*(column for column in columns if {*column[2:]} - {"", "-"}), strict=True)
    whole = [[INTERVAL.sub(r'<span class="whole">\g<0></span>', cell) for cell in row] for row in rows]
    return markdown([head, *whole])


def _in_table(line: str) -> bool:
    return line.startswith("|")


def commands() -> str:
    """The page of all commands: what each prints for --help, without the settings of the other page."""
    text = [
        "# Command line",
        "This page is made from the parsers when it is built. The flags of [settings](settings.md) are left out here. "
        "`sgnlp --tyro-print-completion bash` prints the completion for a shell.",
        markdown([["exit code", "meaning"], *([str(code), meaning] for code, meaning in EXIT_CODES.items())]),
    ]
    for name in ("", *COMMANDS):
        text += [f"## sgnlp {name}", "```text\n" + help_text(*name.split()) + "```"]
    return "\n\n".join(text) + "\n"


def help_text(*command: str) -> str:
    """What `sgnlp COMMAND --help` prints, without the groups of settings."""
    printed = io.StringIO()
    with redirect_stdout(printed), patch.dict(os.environ, COLUMNS="88", NO_COLOR="1"):
        run([*command, "--help"])
    lines = "".join(f"{line.rstrip()}\n" for line in printed.getvalue().strip("\n").splitlines())
    return GROUP.sub("", lines).rstrip("\n") + "\n"
