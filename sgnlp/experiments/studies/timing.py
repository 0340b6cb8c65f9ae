"""The paper's study of computation time: 1 and 7 starts, ours and its bilevel baseline, in one process.

The cases run one at a time, whatever the number of jobs; the machine should have nothing else to do. The paper's times
are of an i7-13700K.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from statistics import median

from sgnlp.base.presets import VARIANTS
from sgnlp.experiments.studies.study import Case, Lines, Setup, Study
from sgnlp.experiments.studies.trials import Condition, planned
from sgnlp.perception.observation import Observation
from sgnlp.show.plots import Panel, Series

CAMERAS = 0
"""All there are."""
CONDITIONS = (Condition("ours", CAMERAS), Condition("bilevel", CAMERAS, VARIANTS["bilevel-high"]))
"""The gains of the bilevel baseline are the paper's high ones."""
REPEATS = 3
PAPER = {("ours", 7): 15.58, ("ours", 1): 7.02, ("bilevel", 7): 34.97, ("bilevel", 1): 9.17}
"""Seconds on its processor."""
QUARTILES = (0.25, 0.75)


@dataclass(frozen=True)
class Row:
    """A plan. `fit` and `solve` are the seconds of fitting the surface and of solving all starts in one process."""

    object: str
    condition: str
    starts: int
    repeat: int
    fit: float
    solve: float
    feasible: int

    @property
    def seconds(self) -> float:
        """Of the whole plan."""
        return self.fit + self.solve


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object with one start and with as many as the setup says."""
    return [
        Case((whole.name, condition.name, str(count)), partial(repeated, replace(setup, starts=count), file, condition))
        for file, whole in zip(setup.files, observations, strict=True)
        for condition in CONDITIONS
        for count in sorted({1, setup.starts})
    ]


def repeated(setup: Setup, file: Path, condition: Condition) -> list[Row]:
    """The rows of an object; a plan of one start before them, which is not timed, builds what all plans share."""
    planned(replace(setup, starts=1), file, condition, None)
    rows = []
    for repeat in range(REPEATS):
        plan = planned(setup, file, condition, None)
        feasible = sum(solution.feasible for solution in plan.solutions)
        key = (plan.observation.name, condition.name, setup.starts)
        rows.append(Row(*key, repeat, plan.seconds["fit"], plan.seconds["solve"], feasible))
    return rows


def medians(rows: Sequence[Row], of: Callable[[Row], float]) -> list[float]:
    """The median over the repeats for each object, in ascending order."""
    found: dict[str, list[float]] = {}
    for row in rows:
        found.setdefault(row.object, []).append(of(row))
    return sorted(median(values) for values in found.values())


def quantile(values: Sequence[float], level: float) -> float:
    """Of values in ascending order, linear between them."""
    place = level * (len(values) - 1)
    i = int(place)
    j = min(i + 1, len(values) - 1)
    return values[i] + (place - i) * (values[j] - values[i])


def groups(rows: Sequence[Row]) -> dict[tuple[str, int], list[Row]]:
    """The rows of each condition and number of starts."""
    found: dict[tuple[str, int], list[Row]] = {}
    for row in sorted(rows, key=lambda row: -row.starts):
        found.setdefault((row.condition, row.starts), []).append(row)
    return found


def table(rows: Sequence[Row]) -> Lines:
    """A line for each condition and number of starts: median seconds and their spread over the objects."""
    lines = []
    for (condition, count), group in groups(rows).items():
        whole = medians(group, lambda row: row.seconds)
        low, high = (quantile(whole, level) for level in QUARTILES)
        theirs = PAPER.get((condition, count))
        lines.append(
            {"condition": f"{condition} ({count})", "objects": str(len(whole))}
            | {"median [s]": f"{median(whole):.2f}", "quartiles [s]": f"{low:.2f}-{high:.2f}"}
            | {"range [s]": f"{whole[0]:.2f}-{whole[-1]:.2f}"}
            | {f"{name} [s]": f"{median(medians(group, of)):.2f}" for name, of in PARTS.items()}
            | {"feasible": f"{sum(row.feasible for row in group)} of {sum(row.starts for row in group)}"}
            | {"paper [s]": "-" if theirs is None else f"{theirs:.2f}"}
        )
    return lines


PARTS: dict[str, Callable[[Row], float]] = {"fit": lambda row: row.fit, "solve": lambda row: row.solve}


def panels(rows: Sequence[Row]) -> list[Panel]:
    """Median seconds with quartiles beside the paper's, for each condition and number of starts."""
    found = {key: medians(group, lambda row: row.seconds) for key, group in groups(rows).items()}
    names = [f"{condition} ({count})" for condition, count in found]
    low, high = ([quantile(values, level) for values in found.values()] for level in QUARTILES)
    ours = Series("here", names, [median(values) for values in found.values()], low, high)
    paper = Series("paper, i7-13700K", names, [PAPER.get(key, float("nan")) for key in found])
    return [Panel("One process", "", "time of a plan [s]", (ours, paper), bars=True)]


STUDY = Study(
    question="how long does a plan take with 1 and 7 starts, against the paper's times?",
    row=Row,
    cases=cases,
    tables=lambda rows: {"Seconds of a plan in one process": table(rows)},
    panels=panels,
    caption="Median seconds of a plan in one process with their quartiles, beside the paper's.",
    alone=True,
)
