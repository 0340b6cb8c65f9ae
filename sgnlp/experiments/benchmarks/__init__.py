"""Benchmarks of everything between a cloud and its grasps, by the question that they answer.

Wall times are those of `time.perf_counter`; beside them stands the median of the CPU time. Rows come as they are
measured.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import isnan

from sgnlp.experiments.benchmarks import growth, many, oracle, ratios, solving, startup, surface, targets
from sgnlp.experiments.benchmarks.bench import Bench
from sgnlp.experiments.benchmarks.measure import Row

SECTIONS: dict[str, tuple[str, Callable[[Bench], Iterator[Row]]]] = {
    "startup": ("What does it take to begin?", startup.rows),
    "oracle": ("What does one call of the oracle cost?", oracle.rows),
    "surface": ("How near are the jets of the surface to the machine's peak?", surface.rows),
    "solving": ("How long does a solve take?", solving.solves),
    "whole": ("How long does the whole command take, and how much memory?", solving.whole),
    "ratios": ("What do exact, structured derivatives gain?", ratios.rows),
    "points": ("How does the time grow with the training points?", growth.points),
    "starts": ("How does the time grow with the starts?", growth.count_starts),
    "objects": ("How does the time grow with the objects?", growth.objects),
    "many": ("How long do many objects take, and does the memory stay flat?", many.rows),
}
"""The question of each section and what answers it."""


def measured(bench: Bench, sections: Sequence[str]) -> Iterator[Row]:
    """The rows of the sections, as they are measured."""
    for section in sections:
        question, rows = SECTIONS[section]
        for row in rows(bench):
            yield replace(row, question=question)


def tables(rows: Sequence[Row]) -> dict[str, list[dict[str, str]]]:
    """The lines of each question's table, the targets first if any was measured."""
    questions = dict.fromkeys(row.question for row in rows)
    judged = [_judged(row, target) for row, target in targets.judged(rows)]
    found = {question: [_line(row) for row in rows if row.question == question] for question in questions}
    return ({targets.QUESTION: judged} if judged else {}) | found


def _judged(row: Row, target: float) -> dict[str, str]:
    numbers = {"target": target, "median": row.median}
    texts = {name: number(value) for name, value in numbers.items()}
    return {"what": row.name, "unit": row.unit, **texts, "met": "yes" if row.median <= target else "no"}


def _line(row: Row) -> dict[str, str]:
    numbers = {"median": row.median, "min": row.min, "max": row.max, "CPU": row.cpu}
    texts = {name: number(value) for name, value in numbers.items()}
    return {"what": row.name, "unit": row.unit, **texts, "values": str(row.repeats), "note": row.note}


def number(value: float) -> str:
    """Three digits, more before the point; nothing for NaN."""
    return "" if isnan(value) else f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
