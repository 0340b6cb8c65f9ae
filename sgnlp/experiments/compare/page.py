"""The page of a comparison: which solver to use, and everything that says so."""

from collections.abc import Sequence
from typing import Any

from sgnlp.experiments.compare import carried, figures, formulations
from sgnlp.experiments.compare.measures import SHIFT
from sgnlp.experiments.compare.route import ASKED
from sgnlp.experiments.compare.runs import GRACE
from sgnlp.experiments.compare.table import (
    ADMISSIBLE,
    DECREASE,
    SAME,
    Table,
    effort,
    failures,
    liars,
    optima,
    pairs,
    success,
)
from sgnlp.experiments.compare.verdict import EXACT, advice, hessians, verdicts
from sgnlp.experiments.studies.study import Lines, Tables
from sgnlp.planning.solvers import SOLVERS
from sgnlp.show.plots import Panel
from sgnlp.show.tables import markdown

__all__ = ["CAPTIONS", "figures_of", "page", "tables", "verdicts"]

SIZE = 38
"""Variables that every formulation has of the Allegro hand: the unit of work is n + 1 calls."""
CAPTIONS = {
    "profiles": "Performance profiles (Dolan & Moré): the share of runs solved to the tolerance within a factor of the "
    "fastest solver of each run. Processor time; failures are infinite.",
    "work": "Data profiles (Moré & Wild): the share of runs that end within a thousandth of the decrease to the best "
    "known energy of the start, over calls of f, ∇f, g, J and H, each counted as one, in units of n + 1.",
    "courses": "Energy above the best known from the start, and worst residual so far with estimated multipliers, over "
    "processor time: medians over the objects from the first start. A curve begins when half of the runs have.",
}
"""What the figures show, by their names."""


def tables(table: Table) -> Tables:
    """The main table of each formulation, for the terminal too."""
    return {f"{name}: success and time": success(table, name) for name in table.formulations}


def figures_of(table: Table) -> dict[str, list[Panel]]:
    """The panels of each figure by its name; those without a curve are left out."""
    found = {"courses": figures.courses(table)}
    if len(table.solvers) > 1:
        found = {"profiles": figures.profiles(table), "work": figures.data_profiles(table, SIZE)} | found
    return {name: panels for name, panels in found.items() if panels}


def page(table: Table, how: dict[str, Any], simulated: Sequence[carried.Row]) -> str:
    """The page in Markdown."""
    tight = table.tolerances[-1]
    parts = [
        *_answer(table),
        "\n## What was expected\n",
        *_bullets(verdicts(table)),
        *(_section(title, lines) for title, lines in tables(table).items()),
        _times(table),
        _section(f"Formulations, by `{EXACT}`", formulations.across(table, EXACT)),
        *(_figure(name) for name in figures_of(table)),
        _section("Exact against limited-memory Hessian", hessians(table)),
    ]
    for name in table.formulations:
        parts += [
            _section(f"{name}: local optima", optima(table, name)),
            _section(f"{name}: effort, medians", effort(table, name)),
            _section(f"{name}: faster than, percent of the common runs to {tight:g}", pairs(table, name)),
        ]
    if simulated:
        parts += [
            _section("The first choice in simulation, success in percent", carried.lines(simulated)),
            *_bullets([f"{name}: none from {', '.join(s)}." for name, s in carried.without(simulated).items()]),
        ]
    parts += [
        _section("Said and done", liars(table)),
        _section("Runs without an answer in time", failures(table)),
        _section("Solvers", _solvers(table)),
        _how(table, how),
    ]
    return "\n".join(part for part in parts if part)


def _answer(table: Table) -> list[str]:
    """What the page is about: solvers, or the formulations of one."""
    if table.solvers == [EXACT] and len(table.formulations) > 1:
        return ["# Which formulation should I use?\n", *_bullets(formulations.advice(table, EXACT))]
    return ["# Which solver should I use?\n", *_bullets(advice(table))]


def _bullets(sentences: Sequence[str]) -> list[str]:
    return [f"* {sentence}" for sentence in sentences]


def _section(title: str, lines: Lines) -> str:
    return f"\n## {title[0].upper()}{title[1:]}\n\n{markdown(lines)}" if lines else ""


def _figure(name: str) -> str:
    return f"\n![{name}]({name}.svg)\n\n{CAPTIONS[name]}\n"


def _times(table: Table) -> str:
    return (
        f"Shares with Wilson's 95 % interval. Times are shifted geometric means (shift {SHIFT:g} s) of the processor "
        f'time of warm solves that reached the tolerance; "with failures" is the mean to {table.tolerances[-1]:g} with '
        f"failures as infinite. Feasible: every check of `sgnlp solve` passes where the solver ended.\n"
    )


def _solvers(table: Table) -> Lines:
    """What ran, and of what it was made."""
    return [
        {"solver": name, "kind": m.kind, "derivatives": str(m.derivatives), "what it is": m.summary}
        for name in table.solvers
        if (m := SOLVERS.get(name))
    ]


def _how(table: Table, how: dict[str, Any]) -> str:
    study, machine = how["study"], how["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in how["versions"].items())
    objects = len({row.object for row in table.rows})
    estimated = sum(row.estimated for row in table.rows)
    return (
        f"\n## How it was measured\n\n`{how['command']}`\n\n"
        f"* {objects} objects, {len(table.rows)} rows in `rows.csv`; limit {study['time_limit']:g} s of processor time "
        f"for a solve, {study['repeats']} repeats in one process, the first cold. Each run has a process of its own, "
        f"ended by the kernel at {GRACE:g} times the limit.\n"
        f"* A run has reached a tolerance if dual, primal and complementarity residual of the scaled problem, "
        f"recomputed, are all within it, whatever the solver says. Solvers are asked for {ASKED:g} of it, in their own "
        f"scaling. Multipliers are the solver's, or estimated by non-negative least squares where those have the "
        f"smaller residual ({estimated} rows).\n"
        f"* Energies are those that the solvers see, smoothed, of points that violate no bound by more than "
        f"{ADMISSIBLE:g}; optima within {SAME:g} of each other are the same; the data profiles ask for {DECREASE:g}.\n"
        f"* {machine['processor']}, {machine['system']}; {versions}.\n"
        f"* Limits: solvers other than Ipopt run at their defaults but for tolerances and limits, and an expert "
        f"may do better. Those that CasADi's plugins differentiate get exact derivatives through one more layer "
        f"of calls. A product with a Hessian costs a whole one here, which hurts SLEQP and Uno's filtersqp. One family "
        f"of problems, {SIZE} variables: what holds here need not hold elsewhere.\n"
    )
