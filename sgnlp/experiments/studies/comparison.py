"""The paper's comparison: fourteen objects in seven poses, its ablations and baselines, beside its own numbers.

The paper tried five poses of each real object (its Tab. II); here the first choice is carried out in simulation on the
true shape, while the plan knew the partial cloud alone.
"""

from collections.abc import Iterator, Sequence
from functools import partial

from sgnlp.base.presets import VARIANTS
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.failures import Failed, again
from sgnlp.experiments.studies.study import Case, Lines, Setup, Study, Tables, body
from sgnlp.experiments.studies.trials import LOADS, Condition, Row
from sgnlp.perception.observation import Observation, load
from sgnlp.show.plots import Panel

CONDITIONS = (
    Condition("3 views", 3),
    Condition("2 views", 2),
    Condition("1 view", 1),
    Condition("no uncertainty, 1 view", 1, VARIANTS["no-uncertainty"]),
    Condition("no pregrasp, 1 view", 1, VARIANTS["no-pregrasp"]),
    Condition("bilevel high, 2 views", 2, VARIANTS["bilevel-high"]),
    Condition("bilevel low, 2 views", 2, VARIANTS["bilevel-low"]),
    Condition("bilevel heuristic, 2 views", 2, VARIANTS["bilevel-heuristic"]),
)
"""The columns of the paper's Tab. II in its order."""
PAIRS = (
    ("1 view", "no uncertainty, 1 view"),
    ("1 view", "no pregrasp, 1 view"),
    ("2 views", "bilevel high, 2 views"),
    ("2 views", "bilevel low, 2 views"),
    ("2 views", "bilevel heuristic, 2 views"),
    ("3 views", "2 views"),
    ("2 views", "1 view"),
)
"""What is told apart, on the same problems."""
PAPER: dict[str, tuple[int, ...]] = {
    "mustard": (90, 100, 80, 70, 90, 50, 60, 60),
    "lego": (90, 70, 80, 70, 60, 70, 50, 50),
    "pyramid": (100, 100, 100, 80, 70, 70, 70, 80),
    "can": (100, 100, 100, 90, 100, 90, 90, 80),
    "cracker": (80, 90, 80, 60, 90, 30, 40, 80),
    "mug": (90, 80, 80, 70, 80, 70, 60, 80),
    "orange": (100, 100, 90, 100, 100, 90, 80, 100),
    "coffee": (80, 90, 90, 70, 90, 50, 60, 60),
    "spam": (80, 60, 60, 60, 60, 40, 60, 50),
    "plane": (100, 70, 70, 80, 80, 60, 70, 70),
    "car": (90, 100, 70, 70, 70, 60, 80, 60),
    "banana": (100, 80, 90, 60, 70, 30, 40, 60),
    "pear": (100, 100, 90, 100, 80, 80, 80, 80),
    "box": (100, 100, 100, 70, 70, 80, 60, 90),
}
"""Success in percent of five trials on the real robot, in the order of `CONDITIONS`; 13 cells of it cannot be the
result of five trials as the paper counts them."""


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object in every condition."""
    return trials.cases(CONDITIONS, setup, observations)


def tables(rows: Sequence[Row]) -> Tables:
    """Success by object beside the paper's, under each load, then totals, endings and every failure."""
    names = trials.present(rows)
    found = {
        **{f"Success in percent, {name}; in brackets the paper's real trials": by_object(rows, name) for name in LOADS},
        "Success in percent with 95 % intervals": trials.totals(rows, names),
        "The same held-out problems under two conditions, p of the exact sign test": trials.paired(rows, PAIRS),
        "Endings": trials.endings(rows, names),
        "Failures of the held-out half from 1, 2 and 3 views": failures(rows),
    }
    return {title: lines for title, lines in found.items() if lines}


def by_object(rows: Sequence[Row], load_name: str) -> Lines:
    """A line for each object and one for all: ours (the paper's)."""
    bodies = sorted({body(row.object) for row in rows})
    lines = [_line(name, [row for row in rows if (body(row.object), row.load) == (name, load_name)]) for name in bodies]
    return [*lines, _line("all", [row for row in rows if row.load == load_name])]


def _line(name: str, rows: Sequence[Row]) -> dict[str, str]:
    line = {"object": name}
    columns = zip(*PAPER.values(), strict=True)
    for i, (condition, column) in enumerate(zip(CONDITIONS, columns, strict=True)):
        found = [row.score for row in rows if row.condition == condition.name]
        theirs = PAPER[name][i] if name in PAPER else round(sum(column) / len(column))
        known = name in PAPER or name == "all"
        line[condition.name] = (f"{100 * sum(found) / len(found):.0f}" if found else "-") + f" ({theirs})" * known
    return line


def failures(rows: Sequence[Row]) -> Lines:
    """Each trial of the plain conditions that did not hold, with what is known of it."""
    return [
        {"object": row.object, "condition": row.condition, "load": row.load, "ending": row.ending}
        | {name: f"{getattr(row, name):.1f}" for name in ("penetration_mm", "rise_mm", "slip_mm", "shift_error_mm")}
        for row in failed(rows)
    ]


def failed(rows: Sequence[Row]) -> list[Row]:
    """The trials of the plain conditions on the held-out half that did not hold."""
    plain = [condition.name for condition in CONDITIONS[:3]]
    return [row for row in rows if row.condition in plain and row.half == "held_out" and row.score < 1]


def looked_at(setup: Setup, rows: Sequence[Row]) -> Iterator[Failed]:
    """Those trials carried out again."""
    files = {load(file).name: file for file in setup.files}
    return (again(setup, files, CONDITIONS, row) for row in failed(rows))


def panels(rows: Sequence[Row]) -> list[Panel]:
    """Success of every condition."""
    return trials.panels(rows, trials.present(rows))


STUDY = Study(
    question="how often does the first choice lift the object, against the paper's ablations and baselines?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=panels,
    facts=partial(trials.facts, CONDITIONS),
    failed=looked_at,
    caption=(
        "Success of the first choice in simulation under two loads, on the poses that no setting was chosen by, "
        "with Wilson's 95 % intervals."
    ),
)
