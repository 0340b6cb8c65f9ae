"""Benchmarks of everything between a cloud and its grasps, by the question that they answer.

Wall times are from `time.perf_counter`; the median CPU time is given besides.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import isnan

from sgnlp.experiments.benchmarks import cluster, earlier, growth, oracle, ratios, replanning, solving, startup
from sgnlp.experiments.benchmarks.measure import Bench, Row
from sgnlp.experiments.frames import Tables

SECTIONS: dict[str, tuple[str, Callable[[Bench], Iterator[Row]]]] = {
    "startup": ("What does it take to begin?", startup.rows),
    "oracle": ("What does one call of the oracle cost?", oracle.rows),
    "surface": ("How near are the jets of the surface to the machine's peak?", oracle.surface),
    "solving": ("How long does a solve take?", solving.solves),
    "whole": ("How long does the whole command take, and how much memory?", solving.whole),
    "replanning": ("How long does replanning take?", replanning.rows),
    "ratios": ("What do exact, structured derivatives and condensed systems gain?", ratios.rows),
    "points": ("How does the time grow with the training points?", growth.points),
    "starts": ("How does the time grow with the starts?", growth.count_starts),
    "objects": ("How does the time grow with the objects?", growth.objects),
    "many": ("How long do many objects take, and does the memory stay flat?", growth.many),
    "cluster": ("Does a cluster keep its workers busy?", cluster.rows),
    "earlier": ("What has become quicker since an earlier version?", earlier.rows),
}
"""The question of each section, and the function that answers it."""
TARGETS_MET = "Are the targets met?"
TARGETS = {
    "sgnlp.solve, 7 starts, 2 jobs: solving": 0.35,  # [s]
    "a start": 0.12,  # [s]
    "an iteration": 0.9,  # [ms]
    "sgnlp solve, warm": 1.0,  # [s]
    "sgnlp solve, cold": 2.5,  # [s]
    "compile the functions": 15.0,  # [s]
    "sgnlp solve, peak memory": 400.0,  # [MB]
    replanning.STEP: 50.0,  # [ms]
    "sgnlp batch, 1000 objects": 480.0,  # [s]
    cluster.LOST: 12.5,  # [%]: 4 workers then have 3.5 times the throughput of one
}
"""The largest median of each quantity, in the unit of its row, on two cores with compiled functions."""


def measured(bench: Bench, sections: Sequence[str]) -> Iterator[Row]:
    """The rows of the sections, as they are measured."""
    for section in sections:
        question, rows = SECTIONS[section]
        for row in rows(bench):
            yield replace(row, question=question)


def tables(rows: Sequence[Row]) -> Tables:
    """The lines of each question's table, the targets first if any was measured."""
    by_name = {row.name: row for row in rows}
    found = {TARGETS_MET: [_judged(by_name[name], target) for name, target in TARGETS.items() if name in by_name]}
    for row in rows:
        found.setdefault(row.question, []).append(_line(row))
    return {question: lines for question, lines in found.items() if lines}


def _judged(row: Row, target: float) -> dict[str, str]:
    line = {"what": row.name, "unit": row.unit, "target": number(target), "median": number(row.median)}
    return line | {"met": "yes" if row.median <= target else "no"}


def _line(row: Row) -> dict[str, str]:
    numbers = {"median": row.median, "min": row.min, "max": row.max, "CPU": row.cpu}
    texts = {name: number(value) for name, value in numbers.items()}
    return {"what": row.name, "unit": row.unit, **texts, "values": str(row.repeats), "note": row.note}


def number(value: float) -> str:
    """At least three digits, without cutting off digits before the point; "" for NaN."""
    return "" if isnan(value) else f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
