"""Trials: a grasp planned for what some cameras saw, the first choice carried out on the true object.

A condition is a number of cameras and a change of the settings. Every trial is judged under two loads, and a plan
without a feasible grasp is a trial that failed: nothing is left out.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import pi
from pathlib import Path
from typing import Any

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.experiments.studies.significance import percent, sign_test, wilson
from sgnlp.experiments.studies.study import Case, Lines, Setup, view_sets
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import Observation, load
from sgnlp.planning.plan import Plan
from sgnlp.planning.solve import solve
from sgnlp.show.plots import Panel, Series
from sgnlp.simulation import Outcome, SimulationSettings, command, execute, true_body

DEGREE = 180 / pi
LOADS = {
    "0.1 kg, μ 1": SimulationSettings(mass=0.1, friction=1.0, push_weights=0.0),
    "0.3 kg, μ 0.6": SimulationSettings(mass=0.3, friction=0.6, push_weights=0.0),
}
"""What the true object weighs and how it grips: easy, and hard."""
NO_PLAN = "no feasible grasp"
HALVES = {"tuning": "tuning", "held_out": "held out"}
"""The halves of a problem set as files and tables call them."""
ENDINGS = ("held", "slid", "dropped", "not lifted", "in collision", "diverged", NO_PLAN)


@dataclass(frozen=True)
class Condition:
    """How a trial is planned: by 1, 2 or 3 cameras, with changed settings."""

    name: str
    cameras: int
    change: Callable[[Settings], Settings] = lambda settings: settings


@dataclass(frozen=True)
class Row:
    """The first choice for one object in one condition under one load. Lengths in mm, force in N."""

    object: str
    condition: str
    load: str
    half: str
    views: str
    starts: int
    feasible: int
    seconds: float
    margin: float
    gap_mm: float
    ending: str
    score: float
    strict: float
    penetration_mm: float
    rise_mm: float
    slip_mm: float
    shift_mm: float
    shift_error_mm: float
    turn_error_deg: float
    force_error: float
    premature: bool


def cases(
    conditions: Sequence[Condition],
    setup: Setup,
    observations: Sequence[Observation],
    work: Callable[[Setup, Path, Condition, list[str]], list[Any]] | None = None,
) -> list[Case]:
    """A case for each object and condition, a trial if no other work is given; rows begin with both names.

    Raises:
        InputError: an object has no true surface or too few cameras.
    """
    for whole in observations:
        true_body(whole)
    return [
        Case((whole.name, condition.name), partial(work or trial, setup, file, condition, _views(whole, condition)))
        for file, whole in zip(setup.files, observations, strict=True)
        for condition in conditions
    ]


def _views(whole: Observation, condition: Condition) -> list[str]:
    sets = {len(views): views for views in view_sets(whole.view_names)}
    if condition.cameras not in sets:
        raise InputError(f"'{whole.name}' was not seen by {condition.cameras} cameras, as '{condition.name}' asks")
    return sets[condition.cameras]


def facts(conditions: Sequence[Condition], setup: Setup) -> dict[str, Any]:
    """What trials depend on: also the settings that each condition changes, by their names, and the loads."""
    plain = flat(asdict(setup.settings))
    changes = {
        condition.name: {"cameras": condition.cameras}
        | {key: value for key, value in flat(asdict(condition.change(setup.settings))).items() if value != plain[key]}
        for condition in conditions
    }
    return setup.facts() | {"conditions": changes} | loads()


def loads() -> dict[str, Any]:
    """Every setting of the simulation under each load."""
    return {"loads": {name: asdict(settings) for name, settings in LOADS.items()}}


def flat(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings by their full names, `limits.shift`."""
    return {
        f"{section}.{name}" if name else section: value
        for section, part in settings.items()
        for name, value in (part.items() if isinstance(part, dict) else [("", part)])
    }


def trial(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """The rows of one object in one condition, one for each load."""
    plan = planned(setup, file, condition, views)
    rows = []
    for name, load_settings in LOADS.items():
        row = _planned(plan, condition, name, views)
        if plan.best:
            row = replace(row, **_simulated(carried_out(plan, load_settings)))
        rows.append(row)
    return rows


def planned(setup: Setup, file: Path, condition: Condition, views: list[str] | None) -> Plan:
    """The plan for an object as some cameras see it, or all, made in one process."""
    settings = condition.change(setup.settings)
    hand, observation = load_hand(setup.hand, settings.spheres), load(file, views=views)
    options = {"count": setup.starts, "seed": setup.seed, "timeout": setup.timeout}
    return solve(observation, hand, settings, jobs=1, **options)  # type: ignore[arg-type]


def carried_out(plan: Plan, load_settings: SimulationSettings) -> Outcome:
    """What the plan's first choice does to the true object."""
    return execute(command(plan.arrays()), true_body(plan.observation), plan.problem.hand, load_settings)


def _planned(plan: Plan, condition: Condition, load_name: str, views: list[str]) -> Row:
    """A row of which only the plan is known."""
    best, nan = plan.best, float("nan")
    return Row(
        object=plan.observation.name,
        condition=condition.name,
        load=load_name,
        half=plan.observation.half,
        views=" ".join(views),
        starts=len(plan.solutions) + len(plan.failures),
        feasible=sum(solution.feasible for solution in plan.solutions),
        seconds=plan.seconds["solve"],
        margin=best.worst_margin if best else nan,
        gap_mm=1e3 * float(abs(best.grasp.gaps).max()) if best else nan,
        ending=NO_PLAN,
        score=0.0,
        strict=0.0,
        penetration_mm=nan,
        rise_mm=nan,
        slip_mm=nan,
        shift_mm=nan,
        shift_error_mm=nan,
        turn_error_deg=nan,
        force_error=nan,
        premature=False,
    )


def _simulated(outcome: Outcome) -> dict[str, Any]:
    """What a row says of the simulation; what was not reached stays unknown."""
    before, closing, lift = outcome.pregrasp, outcome.closing, outcome.lift
    found: dict[str, Any] = {"ending": outcome.ending, "score": outcome.score, "strict": outcome.score_strict}
    found["penetration_mm"] = 1e3 * max(before.penetration_object, before.penetration_table)
    if closing:
        found["shift_mm"] = 1e3 * closing.shift_before_contact
        found["premature"] = bool(closing.premature)
    if closing and closing.shift_error is not None and closing.force_errors is not None:
        found["shift_error_mm"] = 1e3 * closing.shift_error
        found["turn_error_deg"] = DEGREE * float(closing.turn_error or 0.0)
        found["force_error"] = float(closing.force_errors.mean())
    if lift:
        found |= {"rise_mm": 1e3 * lift.rise, "slip_mm": 1e3 * float(lift.slip.max())}
    return found


def totals(rows: Sequence[Row], conditions: Sequence[str]) -> Lines:
    """A line for each condition and load: success in percent with its 95 % interval, on each half and on all."""
    return [
        {"condition": condition, "load": load_name}
        | {half: success(of(rows, condition, load_name, key)) for key, half in (HALVES | {"": "all"}).items()}
        | _shares(of(rows, condition, load_name, ""))
        for load_name in LOADS
        for condition in conditions
    ]


def endings(rows: Sequence[Row], conditions: Sequence[str]) -> Lines:
    """How the trials of each condition and load ended, counted."""
    return [
        {"condition": condition, "load": load_name}
        | {e: str(sum(row.ending == e for row in of(rows, condition, load_name, ""))) for e in ENDINGS}
        for load_name in LOADS
        for condition in conditions
    ]


def paired(rows: Sequence[Row], pairs: Sequence[tuple[str, str]]) -> Lines:
    """A line for each two conditions and load: how many held-out problems score higher in the first, or not."""
    lines = []
    for load_name in LOADS:
        for one, other in pairs:
            scores = [{row.object: row.score for row in of(rows, name, load_name, "held_out")} for name in (one, other)]
            both = [(scores[0][key], scores[1][key]) for key in scores[0].keys() & scores[1].keys()]
            better, worse = sum(a > b for a, b in both), sum(a < b for a, b in both)
            counts = {"better": better, "worse": worse, "same": len(both) - better - worse}
            line = {"load": load_name, "condition": one, "against": other} | {k: str(v) for k, v in counts.items()}
            if both:
                lines.append(line | {"p": f"{sign_test(better, worse):.2g}"})
    return lines


def success(rows: Sequence[Row]) -> str:
    """Mean score in percent; a trial that slid counts half, of which Wilson's interval is too wide if anything."""
    return percent(sum(row.score for row in rows), len(rows))


def mean_score(rows: Sequence[Row]) -> float:
    """Mean score, NaN of no trials."""
    return sum(row.score for row in rows) / len(rows) if rows else float("nan")


def of(rows: Sequence[Row], condition: str, load_name: str, half: str = "") -> list[Row]:
    """The rows of a condition under a load, of one half of the objects or of all."""
    return [r for r in rows if (r.condition, r.load) == (condition, load_name) and half in ("", r.half)]


def _shares(rows: Sequence[Row]) -> dict[str, str]:
    """The strict score, pregrasps free of collision among those planned, and starts that are feasible."""
    planned = [row for row in rows if row.ending != NO_PLAN]
    clear = sum(row.ending != "in collision" for row in planned)
    return {
        "strict": percent(sum(row.strict for row in rows), len(rows)),
        "free of collision": percent(clear, len(planned)),
        "feasible starts": f"{sum(row.feasible for row in rows)} of {sum(row.starts for row in rows)}",
    }


def panels(rows: Sequence[Row], conditions: Sequence[str], half: str = "held_out") -> list[Panel]:
    """Success of every condition on a half, with its interval, a panel for each load."""
    return [
        Panel(load_name, "", "success [%]", (_bars(rows, conditions, load_name, half),), bars=True, y_range=(0, 100))
        for load_name in LOADS
    ]


def _bars(rows: Sequence[Row], conditions: Sequence[str], load_name: str, half: str) -> Series:
    groups = [of(rows, condition, load_name, half) for condition in conditions]
    spans = [wilson(sum(row.score for row in group), len(group)) for group in groups]
    return Series(
        f"{HALVES[half]} half",
        conditions,
        [100 * mean_score(group) for group in groups],
        [100 * low for low, _ in spans],
        [100 * high for _, high in spans],
    )


def present(rows: Sequence[Row]) -> list[str]:
    """The conditions of rows in their order."""
    return list(dict.fromkeys(row.condition for row in rows))
