"""The page of a comparison: which solver to use, and the evidence for it."""

from collections.abc import Iterable, Sequence
from typing import Any

from sgnlp.experiments.compare import carried, figures
from sgnlp.experiments.compare import table as made
from sgnlp.experiments.compare.route import ASKED
from sgnlp.experiments.compare.runs import GRACE
from sgnlp.experiments.compare.table import Table
from sgnlp.experiments.compare.verdict import EXACT, across, advice, formulations_advice, hessians, verdicts
from sgnlp.experiments.frames import Lines, Tables, frame
from sgnlp.planning.solvers import SOLVERS
from sgnlp.show.plots import Panel
from sgnlp.show.tables import markdown

SIZE = 38  # variables that every formulation has of the Allegro hand: the unit of work is n + 1 calls
CAPTIONS = {
    "profiles": "Performance profiles (Dolan & Moré): the share of runs solved to the tolerance within a factor of the "
    "time of the fastest solver on each run. Processor time; a failure counts as infinite.",
    "work": "Data profiles (Moré & Wild): the share of runs that end within a thousandth of the decrease to the best "
    "known energy of the start, over calls of f, ∇f, g, J and H, each counted as one, in units of n + 1.",
    "courses": "Energy above the best known from the start, and lowest residual so far with estimated multipliers, "
    "over processor time: medians over the objects, from the first start. A curve begins when half of the runs have.",
}
"""What the figures show, by their names."""
TIMES = """\
Shares have Wilson's 95 % interval. Times are shifted geometric means (shift {shift:g} s) of the processor time of warm
solves that reached the tolerance. "With failures" is the mean to {tight} with failures as infinite. A grasp is feasible
if every check of `sgnlp solve` passes where the solver ended.
"""
HOW = """
## How it was measured

`{command}`

* {objects} objects, {rows} rows in `rows.csv`. A solve may take {time_limit:g} s of processor time. There are {repeats}
  repeats in one process, the first cold. Each run has its own process, which the kernel ends at {grace:g} times the
  limit.
* A run has reached a tolerance if the dual, primal and complementarity residuals of the scaled problem, recomputed, are
  all within it. The solver's own status does not count. Solvers are asked for {asked:g} of the tolerance, in their own
  scaling. Multipliers are the solver's, or estimated by non-negative least squares where those have the smaller
  residual ({estimated} rows).
* Energies are smoothed, as the solvers see them, and count at points that violate no bound by more than {admissible:g}.
  Optima within {same:g} of each other are the same. The data profiles ask for a decrease to {decrease:g}.
* {processor}, {system}; {versions}.
* Limits: solvers other than Ipopt run with their defaults except for tolerances and limits; an expert may do better.
  CasADi's plugins that differentiate by themselves get the exact derivatives through one more layer of calls. A product
  with a Hessian costs a whole Hessian here, which slows SLEQP and Uno's filtersqp. This is one family of problems with
  {size} variables; other problems may give other results.
"""


def tables(table: Table) -> Tables:
    """The main table of each formulation, for the terminal too."""
    return {f"{name}: success and time": made.success(table, name) for name in table.formulations}


def figures_of(table: Table) -> dict[str, list[Panel]]:
    """The panels of each figure by its name; those without a curve are left out."""
    found = {"courses": figures.courses(table)}
    if len(table.solvers) > 1:
        found = {"profiles": figures.profiles(table), "work": figures.data_profiles(table, SIZE)} | found
    return {name: panels for name, panels in found.items() if panels}


def page(table: Table, how: dict[str, Any], simulated: Sequence[carried.Row]) -> str:
    """The page in Markdown."""
    tight = f"{table.tolerances[-1]:g}"
    parts = [
        *_answer(table),
        "\n## What was expected\n",
        *_bullets(verdicts(table)),
        *(_section(title, lines) for title, lines in tables(table).items()),
        TIMES.format(shift=made.SHIFT, tight=tight),
        _section(f"Formulations, by `{EXACT}`", across(table, EXACT)),
        *(f"\n![{name}]({name}.svg)\n\n{CAPTIONS[name]}\n" for name in figures_of(table)),
        _section("Exact against limited-memory Hessian", hessians(table)),
    ]
    for name in table.formulations:
        faster = f"{name}: faster than, percent of the common runs to {tight}"
        parts += [
            _section(f"{name}: local optima", made.optima(table, name)),
            _section(f"{name}: effort, medians", made.effort(table, name)),
            _section(faster, made.pairs(table, name)),
        ]
    if simulated:
        rows = frame(simulated)
        parts.append(_section("The first choice in simulation, success in percent", carried.lines(rows)))
        none = carried.without(rows).items()
        parts += _bullets(f"{name}: no feasible grasp from {', '.join(names)}." for name, names in none)
    solvers = [
        {"solver": name, "kind": m.kind, "derivatives": str(m.derivatives), "what it is": m.summary}
        for name in table.solvers
        if (m := SOLVERS.get(name))
    ]
    parts += [
        _section("Status and residuals disagree", made.liars(table)),
        _section("Runs without an answer in time", made.failures(table)),
        _section("Solvers", solvers),
        _how(table, how),
    ]
    return "\n".join(part for part in parts if part)


def _answer(table: Table) -> list[str]:
    """What the page is about: solvers, or the formulations of one."""
    if table.solvers == [EXACT] and len(table.formulations) > 1:
        return ["# Which formulation should I use?\n", *_bullets(formulations_advice(table, EXACT))]
    return ["# Which solver should I use?\n", *_bullets(advice(table))]


def _bullets(sentences: Iterable[str]) -> list[str]:
    return [f"* {sentence}" for sentence in sentences]


def _section(title: str, lines: Lines) -> str:
    return f"\n## {title[0].upper()}{title[1:]}\n\n{markdown(lines)}" if lines else ""


def _how(table: Table, how: dict[str, Any]) -> str:
    return HOW.format(
        **{"command": how["command"], "asked": ASKED, "grace": GRACE, "size": SIZE} | how["study"] | how["machine"],
        versions=", ".join(f"{name} {version}" for name, version in how["versions"].items()),
        objects=table.rows.object.nunique(),
        rows=len(table.rows),
        estimated=table.rows.estimated.sum(),
        **{"admissible": made.ADMISSIBLE, "same": made.SAME, "decrease": made.DECREASE},
    )
