"""Advice on solvers, and tests of what was expected of them: sentences computed from the rows."""

import math

import numpy as np

from sgnlp.experiments.compare.table import ADMISSIBLE, INSTANCE, Table, middle, short
from sgnlp.experiments.frames import Frame, Lines, percent
from sgnlp.experiments.studies.timing import PAPER

EXACT, LIMITED = "ipopt", "ipopt-limited"  # Ipopt as it is used here, and without its Hessian
SHORT, LONG = ("rmsprop-200", "adamw-200"), ("rmsprop-1000", "adamw-1000")
"""As many steps as the release takes, and five times as many."""
RELEASE = PAPER["ours", 1]  # seconds of the release from one start, 200 steps, as the paper prints them
EXPECTED_SOLVED, EXPECTED_LOWER = 0.98, 0.95
"""Shares of starts on which Ipopt was expected to reach the tightest tolerance, and to end below the long descents."""


def advice(table: Table) -> list[str]:
    """For each formulation the solver that reaches the tightest tolerance most often, the fastest among equals."""
    said, tight = [], table.tolerances[-1]
    for formulation in table.formulations:
        order = table.order(formulation)
        reaching = {name: _reach(table, formulation, name) for name in order}
        means = {name: table.mean_time(formulation, name, tight) for name in order}
        others = [name for name in order[1:4] if table.solved_at(formulation, name, tight)[0]]
        following = f" Next: {'; '.join(f'`{name}` {reaching[name]}' for name in others)}." if others else ""
        said.append(f"**{formulation}**: use `{order[0]}`. It {reaching[order[0]]}.{following}")
        quick = min(order, key=lambda name: np.nan_to_num(means[name], nan=math.inf))
        if quick != order[0] and math.isfinite(means[quick]):
            said.append(f"Fastest where it succeeds: `{quick}`. It {reaching[quick]}.")
    return said


def _reach(table: Table, formulation: str, solver: str) -> str:
    tight = table.tolerances[-1]
    solved, n = table.solved_at(formulation, solver, tight)
    mean = short(table.mean_time(formulation, solver, tight))
    return f"reaches {tight:g} on {percent(solved, n)} % of {n} starts" + (f" in {mean} s" if solved else "")


def verdicts(table: Table) -> list[str]:
    """The expectations, each shown, refuted or not tested by the rows."""
    return [_solved(table), *_lower(table), *_faster(table), *_never(table)]


def _judged(shown: bool, text: str) -> str:
    return f"{'Shown' if shown else 'Refuted'}: {text}"


def _solved(table: Table) -> str:
    tight = table.tolerances[-1]
    counts = {f: table.solved_at(f, EXACT, tight) for f in table.formulations}
    counts = {f: count for f, count in counts.items() if count[1]}
    if not counts:
        return f"Not tested: `{EXACT}` was not run."
    parts = ", ".join(f"{percent(*count)} % of {count[1]} starts ({name})" for name, count in counts.items())
    shown = all(solved >= EXPECTED_SOLVED * n for solved, n in counts.values())
    return _judged(shown, f"`{EXACT}` reaches {tight:g} on {parts}. Expected: {100 * EXPECTED_SOLVED:.0f} %.")


def _pairs(table: Table, formulation: str, one: str, other: str) -> Frame:
    """The ends of two solvers from the same starts; columns of the other solver end in `_`."""
    ours, theirs = (table.answers(formulation, solver) for solver in (one, other))
    return ours.merge(theirs, on=INSTANCE, suffixes=("", "_"))


def _lower(table: Table) -> list[str]:
    said = []
    for steps in LONG:
        pairs = _pairs(table, "penalty", EXACT, steps)
        if len(pairs):
            met = pairs[pairs.primal_ <= ADMISSIBLE]
            below, anywhere = (met.energy < met.energy_).sum(), (pairs.energy < pairs.lowest_).sum()
            text = (
                f"`{EXACT}` ends below `{steps}` on {below} of the {len(met)} starts where `{steps}` meets the rows. "
                f"Expected: {100 * EXPECTED_LOWER:.0f} %. It ends below the lowest energy that `{steps}` has at any "
                f"point, rows met or not, on {percent(anywhere, len(pairs))} % of {len(pairs)} starts."
            )
            said.append(_judged(below >= EXPECTED_LOWER * len(met), text))
    return said


def _faster(table: Table) -> list[str]:
    rows = table.of("penalty", EXACT, table.tolerances[-1])
    times = rows.cpu[rows.reached]
    if not len(times):
        return []
    text = (
        f"`{EXACT}` takes {middle(times, 2)} s in the median and {short(times.max())} s at most. The paper gives "
        f"{RELEASE:g} s for one start of its release, on a desktop processor."
    )
    said = [_judged(times.max() < RELEASE, text)]
    for steps in SHORT:
        pairs = _pairs(table, "penalty", EXACT, steps)
        pairs = pairs[pairs.reached & np.isfinite(pairs.cpu_)]
        if len(pairs):
            said.append(
                f"The same 200 steps on the functions here, `{steps}`, take {middle(pairs.cpu_ / pairs.cpu, 2)} times "
                f"as long as `{EXACT}` in the median. `{EXACT}` is faster on {(pairs.cpu < pairs.cpu_).sum()} of "
                f"{len(pairs)} starts."
            )
    return said


def _never(table: Table) -> list[str]:
    said, tight = [], table.tolerances[-1]
    for what, names in (("Limited-memory Ipopt reaches", (LIMITED,)), ("First-order steps reach", SHORT + LONG)):
        counts = [table.solved_at(f, name, tight) for f in table.formulations for name in names]
        solved, n = (sum(part) for part in zip(*counts, strict=True))
        if n:
            said.append(_judged(not solved, f"{what} {tight:g} on {percent(solved, n)} % of {n} runs. Expected: none."))
    return said


def hessians(table: Table) -> Lines:
    """Exact against limited-memory Hessians on the same instances, a line for each formulation."""
    found = []
    for formulation in table.formulations:
        pairs = _pairs(table, formulation, EXACT, LIMITED)
        line = {"formulation": formulation, "starts": str(len(pairs))}
        for what, solver in (("exact", EXACT), ("limited", LIMITED)):
            counts = {t: table.solved_at(formulation, solver, t) for t in table.tolerances}
            line |= {f"{what} reaches {t:g} [%]": percent(*count) for t, count in counts.items()}
        line["iterations, limited over exact"] = _ratio(pairs, "iterations")
        line["time, limited over exact"] = _ratio(pairs, "cpu")
        line[f"time to {table.tolerances[-1]:g}, where both reach it"] = _ratio(pairs, "time")
        if len(pairs):
            found.append(line | {"exact ends lower": f"{(pairs.energy < pairs.energy_).sum()} of {len(pairs)}"})
    return found


def _ratio(pairs: Frame, column: str) -> str:
    """The median of limited over exact, where both are finite."""
    exact, limited = pairs[column], pairs[f"{column}_"]
    return middle((limited / exact)[(exact > 0) & np.isfinite(exact)], 2)


def across(table: Table, solver: str) -> Lines:
    """A line for each formulation; none unless the solver ran on two or more.

    Energies are of different functions. So solutions are compared by the exact worst margin of each object's widest
    feasible one, as `sgnlp solve` ranks them.
    """
    ran = [name for name in table.formulations if len(table.of(name, solver, table.tolerances[0]))]
    return [_line(table, name, solver) for name in ran] if len(ran) > 1 else []


def formulations_advice(table: Table, solver: str) -> list[str]:
    """The formulations that are feasible most often, optimal most often, and quickest."""
    lines, tight = across(table, solver), f"{table.tolerances[-1]:g}"

    def first(column: str, sign: int) -> str:
        line = min(lines, key=lambda line: sign * float(line[column].split()[0]))
        shares = f"{line['feasible [%]']} % of {line['starts']} starts are feasible, {line[f'{tight} [%]']} % reach"
        return f"`{line['formulation']}`. {shares} {tight}; the median time is {line['time [s]']} s."

    return [
        f"Feasible most often: {first('feasible [%]', -1)}",
        f"Reaches {tight} most often: {first(f'{tight} [%]', -1)}",
        f"Fastest: {first('time [s]', 1)}",
    ]


def _line(table: Table, formulation: str, solver: str) -> dict[str, str]:
    ends = table.answers(formulation, solver)
    margins = widest(ends)
    planned = margins[np.isfinite(margins)]
    line = {"formulation": formulation, "starts": str(len(ends))}
    line |= {f"{t:g} [%]": percent(*table.solved_at(formulation, solver, t)) for t in table.tolerances}
    line |= {"feasible [%]": percent(ends.feasible.sum(), len(ends)), "iterations": middle(ends.iterations)}
    line |= {"time [s]": middle(ends.cpu), "mean time [s]": short(ends.cpu[np.isfinite(ends.cpu)].mean(), 3)}
    return line | {"objects planned": f"{len(planned)} of {len(margins)}", "margin, mean": short(planned.mean(), 3)}


def widest(ends: Frame) -> Frame:
    """The widest worst margin of a feasible end for each object, -∞ where there is none."""
    return ends.margin.where(ends.feasible, -math.inf).groupby(ends.object).max()
