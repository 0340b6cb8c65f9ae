"""The reference pages that are made from the code: settings from their docstrings, commands from their parsers."""

import ast
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
from typing import Any, Literal, get_args, get_origin, get_type_hints
from unittest.mock import patch

import griffe

from sgnlp import preset
from sgnlp.base.checked import NOT_NEGATIVE, POSITIVE, Checked
from sgnlp.cli import COMMANDS, run
from sgnlp.perception.observation import ObservationSettings
from sgnlp.perception.synthetic.cameras import DepthCamera
from sgnlp.perception.synthetic.scenes import Ring
from sgnlp.planning.solvers import SOLVERS
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
GROUP = re.compile(r" \w+ options\n")
"""The title of the flags of one group of settings."""


def settings() -> str:
    """The page of all settings: flag, value in each preset, valid values, meaning."""
    chosen = {name: preset(name) for name in PRESETS}
    text = [
        "# Settings",
        "Every setting of a plan is a flag of the commands that plan (`sgnlp solve --gpis.kernel matern52`) and a "
        'field in Python (`sgnlp.preset("robust").gpis.kernel`). A value that is not valid is refused in one line that '
        "names the flag and what is valid. Presets and their variants: [the command line](commands.md). This page is "
        "made from the docstrings of the settings when it is built; bold is what differs from the first column.",
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
    yield table(head, rows)
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
    kind = get_type_hints(type(owner))[name]
    if get_origin(kind) is Literal:
        return ", ".join(f"`{choice}`" for choice in get_args(kind))
    interval = owner.valid.get(name)
    words = {POSITIVE: "positive", NOT_NEGATIVE: "not negative", None: "yes or no" if kind is bool else ""}
    if interval in words:
        return words[interval]
    low, high = interval  # type: ignore[misc]
    return f"at least {low:g}" if high >= POSITIVE[1] else f"{low:g} to {high:g}"


@cache
def _package(name: str) -> Any:
    return griffe.load(name)


def _meaning(kind: type, name: str) -> str:
    """The docstring under a field, else the comment behind it, in one line."""
    package, _, module = kind.__module__.partition(".")
    attribute = _package(package)[f"{module}.{kind.__name__}"].members[name]
    if attribute.docstring:
        return " ".join(attribute.docstring.value.split())
    line = inspect.getsource(import_module(kind.__module__)).splitlines()[attribute.lineno - 1]
    return line.partition("  # ")[2]


def table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table; bars in its cells do not end them."""
    lines = [head, ["---"] * len(head), *([cell.replace("|", r"\|") for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def record(name: str) -> str:
    """The fields of a dataclass with what its source says of each, or their names where it says nothing."""
    module, _, kind = name.rpartition(".")
    made = getattr(import_module(module), kind)
    rows = [[f"`{f.name}`", _meaning(made, f.name)] for f in fields(made)]
    return table(["field", ""], rows) if any(said for _, said in rows) else ", ".join(field for field, _ in rows) + "."


def stages() -> str:
    """The stages of the package's modules in the order in which imports point, from the test that holds it."""
    tree = ast.parse((ROOT / "tests" / "test_architecture.py").read_text(encoding="utf-8"))
    assigned = {ast.unparse(node.targets[0]): node.value for node in tree.body if isinstance(node, ast.Assign)}
    rows = [[str(i), _modules(stage)] for i, stage in enumerate(ast.literal_eval(assigned["STAGES"]), 1)]
    return table(["stage", "modules, each with what it says of itself"], rows)


def _modules(stage: str) -> str:
    return "<br>".join(f"`{name}`: {_about(name)}" for name in stage.split())


def _about(name: str) -> str:
    """The first line of a module's docstring."""
    text = inspect.getdoc(import_module(f"sgnlp.{name}")) if name != "__main__" else "`python -m sgnlp`."
    return (text or "").split("\n\n")[0].replace("\n", " ")


MARKER = re.compile(r"<!-- (?P<maker>fields|stages|table|solvers)(?:: (?P<name>[\w./]+))? -->")


def filled(markdown: str) -> str:
    """A page with its markers replaced by what they stand for."""
    makers: dict[str, Callable[[str], str]] = {
        "fields": record,
        "stages": lambda _: stages(),
        "table": copied,
        "solvers": lambda _: solvers(),
    }
    return MARKER.sub(lambda marker: makers[marker["maker"]](marker["name"]), markdown)


def solvers() -> str:
    """The table of solvers."""
    rows = [[f"`{name}`", e.kind, str(e.derivatives), e.summary, e.known] for name, e in SOLVERS.items()]
    return table(["name", "kind", "derivatives", "what it is", "why a comparison leaves it out"], rows)


def copied(file: str) -> str:
    """The first table of a Markdown file of the project."""
    lines = iter((ROOT / file).read_text(encoding="utf-8").splitlines())
    rest = dropwhile(lambda line: not line.startswith("|"), lines)
    return "\n".join(takewhile(lambda line: line.startswith("|"), rest))


def commands() -> str:
    """The page of all commands: what each prints for --help, without the settings of the other page."""
    text = [
        "# Command line",
        "Exit codes: 0 a feasible grasp was found, or the command did what it was asked; 1 no start ended in a "
        "feasible grasp; 2 the flags are wrong; 3 a file, name or value is wrong; 4 the machine "
        "gives out (a full disk, no more memory, processes or open files), and nothing is left half-written; 130 ended "
        "by Ctrl-C; 141 whoever read the output has ended. This page is made from the parsers when it is "
        "built; the flags of [settings](settings.md) are left out here.",
    ]
    for name in ("", *COMMANDS):
        text += [f"## sgnlp {name}", "```text\n" + help_text(*name.split()) + "```"]
    return "\n\n".join(text) + "\n"


def help_text(*command: str) -> str:
    """What `sgnlp COMMAND --help` prints, without the groups of settings."""
    printed = io.StringIO()
    with redirect_stdout(printed), patch.dict(os.environ, COLUMNS="88", NO_COLOR="1"):
        run([*command, "--help"])
    lines = "\n".join(line.rstrip() for line in printed.getvalue().strip("\n").splitlines())
    return "\n\n".join(block for block in lines.split("\n\n") if not GROUP.match(block)) + "\n"
