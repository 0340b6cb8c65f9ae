"""Which solver one should use, and whether what was expected of them is so: sentences computed from the rows."""

import math
from collections.abc import Callable, Sequence
from statistics import median

from sgnlp.experiments.compare.row import Row
from sgnlp.experiments.compare.table import ADMISSIBLE, Table, short
from sgnlp.experiments.studies.significance import percent
from sgnlp.experiments.studies.timing import PAPER

EXACT, LIMITED = "ipopt", "ipopt-limited"
"""Ipopt as it is used here, and without its Hessian."""
SHORT, LONG = ("rmsprop-200", "adamw-200"), ("rmsprop-1000", "adamw-1000")
"""As many steps as the release takes, and five times as many."""
RELEASE = PAPER["ours", 1]
"""Seconds of the release from one start, 200 steps, as the paper prints them."""
EXPECTED_SOLVED, EXPECTED_LOWER = 0.98, 0.95
"""Shares of starts on which Ipopt was expected to reach the tightest tolerance, and to end below the long descents."""


def advice(table: Table) -> list[str]:
    """For each formulation the solver that reaches the tightest tolerance most often, the fastest among equals."""
    said = []
    for formulation in table.formulations:
        order = table.order(formulation)
        tight = table.tolerances[-1]
        first = f"**{formulation}**: use `{order[0]}`, which {_reach(table, formulation, order[0], tight)}"
        others = "; ".join(
            f"`{name}` {_reach(table, formulation, name, tight)}"
            for name in order[1:4]
            if table.solved_at(formulation, name, tight)[0]
        )
        said.append(f"{first}." + (f" Next: {others}." if others else ""))
        quick = min(order, key=lambda name: _typical(table, formulation, name, tight))
        if quick != order[0] and math.isfinite(_typical(table, formulation, quick, tight)):
            said.append(
                f"The fastest where it gets there is `{quick}`, which {_reach(table, formulation, quick, tight)}."
            )
    return said


def _typical(table: Table, formulation: str, solver: str, tolerance: float) -> float:
    mean = table.mean_time(formulation, solver, tolerance)
    return math.inf if math.isnan(mean) else mean


def _reach(table: Table, formulation: str, solver: str, tolerance: float) -> str:
    solved, n = table.solved_at(formulation, solver, tolerance)
    time = table.mean_time(formulation, solver, tolerance)
    when = f" in {short(time)} s of processor time" if solved else ""
    return f"reaches {tolerance:g} on {percent(solved, n)} % of {n} starts{when}"


def verdicts(table: Table) -> list[str]:
    """What was expected, each shown or refuted by the rows, or not tested by them."""
    return [_solved(table), *_lower(table), *_faster(table), *_never(table)]


def _judged(shown: bool, text: str) -> str:
    return f"{'Shown' if shown else 'Refuted'}: {text}"


def _solved(table: Table) -> str:
    tight = table.tolerances[-1]
    counts = {f: table.solved_at(f, EXACT, tight) for f in table.formulations}
    if not any(n for _, n in counts.values()):
        return f"Not tested: `{EXACT}` was not run."
    parts = [f"{percent(*count)} % of {count[1]} starts ({name})" for name, count in counts.items() if count[1]]
    shown = all(solved >= EXPECTED_SOLVED * n for solved, n in counts.values())
    text = f"`{EXACT}` reaches {tight:g} on {', '.join(parts)}; expected was {100 * EXPECTED_SOLVED:.0f} %."
    return _judged(shown, text)


def _pairs(table: Table, one: str, other: str) -> list[tuple[Row, Row]]:
    """The ends of two solvers from the same starts in the penalty formulation."""
    return [
        (row, table.ends[instance, other])
        for (instance, solver), row in table.ends.items()
        if solver == one and instance[1] == "penalty" and (instance, other) in table.ends
    ]


def _lower(table: Table) -> list[str]:
    said = []
    for steps in LONG:
        pairs = _pairs(table, EXACT, steps)
        if pairs:
            met = [(ours, theirs) for ours, theirs in pairs if theirs.primal <= ADMISSIBLE]
            below = sum(ours.energy < theirs.energy for ours, theirs in met)
            anywhere = sum(ours.energy < theirs.lowest for ours, theirs in pairs)
            text = (
                f"`{EXACT}` ends below `{steps}` on {below} of the {len(met)} starts where `{steps}` meets the rows, "
                f"and below its lowest energy at any point, rows met or not, on {percent(anywhere, len(pairs))} % of "
                f"{len(pairs)}; expected was {100 * EXPECTED_LOWER:.0f} % of the first."
            )
            said.append(_judged(below >= EXPECTED_LOWER * len(met), text))
    return said


def _faster(table: Table) -> list[str]:
    rows = table.of("penalty", EXACT, table.tolerances[-1])
    times = [row.cpu for row in rows if row.reached]
    if not times:
        return []
    slowest, middle = max(times), median(times)
    text = (
        f"`{EXACT}` takes {short(middle)} s in the median and {short(slowest)} s at most, the release {RELEASE:g} s "
        f"for one start as the paper prints it, on a desktop processor."
    )
    said = [_judged(slowest < RELEASE, text)]
    for steps in SHORT:
        pairs = [(a.cpu, b.cpu) for a, b in _pairs(table, EXACT, steps) if a.reached and math.isfinite(b.cpu)]
        if pairs:
            ratio = median(theirs / ours for ours, theirs in pairs)
            faster = sum(ours < theirs for ours, theirs in pairs)
            said.append(
                f"The same 200 steps on the functions here, `{steps}`, take {short(ratio)} times as long as `{EXACT}` "
                f"in the median; it is faster on {faster} of {len(pairs)} starts."
            )
    return said


def _never(table: Table) -> list[str]:
    tight = table.tolerances[-1]
    said = []
    for what, names in (("limited-memory Ipopt", (LIMITED,)), ("first-order steps", SHORT + LONG)):
        counts = [table.solved_at(f, name, tight) for f in table.formulations for name in names]
        solved, n = (sum(part) for part in zip(*counts, strict=True))
        if n:
            reach = "reaches" if len(names) == 1 else "reach"
            text = f"{what} {reach} {tight:g} on {percent(solved, n)} % of {n} runs; expected was none."
            said.append(_judged(solved == 0, text))
    return said


def hessians(table: Table) -> list[dict[str, str]]:
    """Exact against limited-memory Hessians on the same instances, a line for each formulation."""
    lines = []
    for formulation in table.formulations:
        keys = [i for (i, s) in table.ends if s == EXACT and i[1] == formulation and (i, LIMITED) in table.ends]
        pairs = [(table.ends[i, EXACT], table.ends[i, LIMITED]) for i in keys]
        if pairs:
            lines.append({"formulation": formulation, "starts": str(len(pairs))} | _against(table, formulation, pairs))
    return lines


def _against(table: Table, formulation: str, pairs: Sequence[tuple[Row, Row]]) -> dict[str, str]:
    def ratio(of: Callable[[Row], float]) -> str:
        found = sorted(of(b) / of(a) for a, b in pairs if of(a) > 0 and math.isfinite(of(a)) and math.isfinite(of(b)))
        return short(median(found)) if found else "-"

    tight = table.tolerances[-1]
    lower = sum(a.energy < b.energy for a, b in pairs)
    return {
        **{f"exact reaches {t:g} [%]": percent(*table.solved_at(formulation, EXACT, t)) for t in table.tolerances},
        **{f"limited reaches {t:g} [%]": percent(*table.solved_at(formulation, LIMITED, t)) for t in table.tolerances},
        "iterations, limited over exact": ratio(lambda row: float(row.iterations)),
        "time, limited over exact": ratio(lambda row: row.cpu),
        f"time to {tight:g}, where both reach it": ratio(lambda row: row.time),
        "exact ends lower": f"{lower} of {len(pairs)}",
    }
