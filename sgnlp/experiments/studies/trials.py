"""Trials: a grasp is planned from what some cameras saw, and the first choice is carried out on the true object.

A condition is a number of cameras and a change of the settings. Every trial is judged under two loads. A plan without
a feasible grasp counts as a failed trial.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import nan, pi
from pathlib import Path
from typing import Any

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import Frame, Lines, percent, pick, sign_test, wilson
from sgnlp.experiments.studies.study import Case, Setup, view_sets
from sgnlp.hand.hand import load_hand
from sgnlp.perception.observation import Observation, load
from sgnlp.planning.ending import ROUNDS
from sgnlp.planning.plan import Plan
from sgnlp.planning.solve import solve
from sgnlp.show.plots import Panel, Series
from sgnlp.simulation import Outcome, SimulationSettings, command, execute, true_body

DEGREE = 180 / pi
LOADS = {
    "0.1 kg, μ 1": SimulationSettings(mass=0.1, friction=1.0, push_weights=0.0),
    "0.3 kg, μ 0.6": SimulationSettings(mass=0.3, friction=0.6, push_weights=0.0),
}
"""Mass and friction of the true object: easy, and hard."""
NO_PLAN = "no feasible grasp"
HALVES = {"tuning": "tuning", "held_out": "held out"}  # the halves of a problem set, in files and in tables
NEAR_MM, NEAR_DEG = 5.0, 5.0
"""An object within this distance and angle of its planned equilibrium is at its planned place."""
ENDINGS = ("held", "slid", "dropped", "not lifted", "in collision", "diverged", NO_PLAN)


@dataclass(frozen=True)
class Condition:
    """How a trial is planned: by 1, 2 or 3 cameras, with changed settings."""

    name: str
    cameras: int
    change: Callable[[Settings], Settings] = lambda settings: settings


Work = Callable[[Setup, Path, Condition, list[str]], list[Any]]


@dataclass(frozen=True)
class Row:
    """The first choice for one object in one condition under one load. Lengths in mm, force in N.

    `starts` and `feasible` count the first round of starts alone, `rounds` those that were tried.
    """

    object: str
    condition: str
    load: str
    half: str
    views: str
    starts: int
    feasible: int
    seconds: float
    margin: float = nan
    gap_mm: float = nan
    ending: str = NO_PLAN
    score: float = 0.0
    strict: float = 0.0
    penetration_mm: float = nan
    rise_mm: float = nan
    slip_mm: float = nan
    shift_mm: float = nan
    shift_error_mm: float = nan
    turn_error_deg: float = nan
    force_error: float = nan
    premature: bool = False
    tip_error_mm: float = nan
    links_touched: float = nan  # how many while closing
    links_force: float = nan
    pads_loaded: float = nan
    torque: float = nan  # the largest over the joint's effort, at the equilibrium
    joints_limited: float = nan  # share of the joints at their effort, at the equilibrium
    rounds: int = 1
    widened: bool = False  # with wide limits of motion, since no start was feasible with the narrow ones


def cases(
    conditions: Sequence[Condition], setup: Setup, observations: Sequence[Observation], work: Work | None = None
) -> list[Case]:
    """A case for each object and condition, a trial if no other work is given; rows begin with both names.

    Raises `InputError` if an object has no true surface or too few cameras.
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
    """What trials depend on: also the loads, and the settings that each condition changes, by name."""
    return setup.facts() | changes(conditions, setup) | loads()


def changes(conditions: Sequence[Condition], setup: Setup) -> dict[str, Any]:
    """The settings that each condition changes, by their names."""
    plain = flat(asdict(setup.settings))
    changed = {
        condition.name: {"cameras": condition.cameras}
        | {key: value for key, value in flat(asdict(condition.change(setup.settings))).items() if value != plain[key]}
        for condition in conditions
    }
    return {"conditions": changed}


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
    row = Row(load="", **told(plan, condition, views))
    if plan.best is None:
        return [replace(row, load=name) for name in LOADS]
    return [replace(row, load=name, **measured(carried_out(plan, settings))) for name, settings in LOADS.items()]


def told(plan: Plan, condition: Condition, views: list[str]) -> dict[str, Any]:
    """The columns of a row about the plan."""
    found = {
        "object": plan.observation.name,
        "condition": condition.name,
        "half": plan.observation.half,
        "views": " ".join(views),
        "starts": plan.count,
        "feasible": feasible(plan) if plan.rounds == 1 and not plan.widened else 0,
        "rounds": plan.rounds,
        "widened": plan.widened,
        "seconds": plan.seconds["solve"],
    }
    if plan.best is not None:
        found |= {"margin": plan.best.worst_margin, "gap_mm": 1e3 * float(abs(plan.best.grasp.gaps).max())}
    return found


def planned(setup: Setup, file: Path, condition: Condition, views: list[str] | None, rounds: int = ROUNDS) -> Plan:
    """The plan for an object as some cameras see it, or all, made in one process."""
    settings = condition.change(setup.settings)
    hand, observation = load_hand(setup.hand, settings.spheres), load(file, views=views)
    options = {"count": setup.starts, "seed": setup.seed, "timeout": setup.timeout, "rounds": rounds}
    return solve(observation, hand, settings, jobs=1, **options)  # type: ignore[arg-type]


def feasible(plan: Plan) -> int:
    """The number of feasible solutions."""
    return sum(solution.feasible for solution in plan.solutions)


def carried_out(plan: Plan, load_settings: SimulationSettings, rank: int = 0) -> Outcome:
    """The outcome of the plan's first choice, or of the grasp with another rank, on the true object."""
    return execute(command(plan.arrays(), rank), true_body(plan.observation), plan.problem.hand, load_settings)


def measured(outcome: Outcome) -> dict[str, Any]:
    """The columns of a row about the simulation; values of phases that were not reached stay unknown."""
    before, closing, lift = outcome.pregrasp, outcome.closing, outcome.lift
    found: dict[str, Any] = {"ending": outcome.ending, "score": outcome.score, "strict": outcome.score_strict}
    found["penetration_mm"] = 1e3 * max(before.penetration_object, before.penetration_table)
    if closing:
        found |= {"shift_mm": 1e3 * closing.shift_before_contact, "premature": bool(closing.premature)}
        found |= {"links_touched": len(closing.links), "links_force": closing.links_force}
        found |= {"pads_loaded": closing.pads_loaded, "torque": closing.torque_share}
        found["joints_limited"] = closing.joints_limited
    if closing and closing.tip_errors is not None:
        found["tip_error_mm"] = 1e3 * float(closing.tip_errors.mean())
    if closing and closing.shift_error is not None and closing.force_errors is not None:
        found["shift_error_mm"] = 1e3 * closing.shift_error
        found["turn_error_deg"] = DEGREE * float(closing.turn_error or 0.0)
        found["force_error"] = float(closing.force_errors.mean())
    if lift:
        found |= {"rise_mm": 1e3 * lift.rise, "slip_mm": 1e3 * float(lift.slip.max())}
    return found


def groups(rows: Frame) -> Iterator[tuple[dict[str, str], Frame]]:
    """The trials of each load and condition, with the names of both in tables."""
    for load_name, under in rows.groupby("load", sort=False):
        for condition, found in under.groupby("condition", sort=False):
            yield {"condition": str(condition), "load": str(load_name)}, found


def totals(rows: Frame) -> Lines:
    """A line for each condition and load: success in percent with its 95 % interval, on each half and on all.

    Then the strict score, the share of planned pregrasps that do not collide, and how many starts are feasible.
    """
    lines = []
    for names, found in groups(rows):
        planned = found[found.ending != NO_PLAN]
        lines.append(
            names
            | {text: success(found[found.half == half]) for half, text in HALVES.items()}
            | {"all": success(found), "strict": percent(found.strict.sum(), len(found))}
            | {"free of collision": percent((planned.ending != "in collision").sum(), len(planned))}
            | {"feasible starts": f"{found.feasible.sum()} of {found.starts.sum()}"}
        )
    return lines


def fidelity(rows: Frame) -> Lines:
    """A line for each condition and load: agreement with the plan, over the trials in which the hand closed.

    How often a link other than a pad touches the object, the median force of such links and the mean number of loaded
    pads at the equilibrium, how often the object is near its planned place there, and the mean share of joints at
    their effort. Older rows without these columns do not count.
    """
    lines = []
    for names, found in groups(rows[rows.links_touched.notna()]):
        near = (found.shift_error_mm <= NEAR_MM) & (found.turn_error_deg <= NEAR_DEG)
        lines.append(
            names
            | {"hands": str(len(found)), "a link touches [%]": percent((found.links_touched > 0).sum(), len(found))}
            | {"links [N]": f"{found.links_force.median():.1f}", "pads": f"{found.pads_loaded.mean():.2f}"}
            | {f"within {NEAR_MM:g} mm, {NEAR_DEG:g}° [%]": percent(near.sum(), len(found))}
            | {"joints at the limit [%]": f"{100 * found.joints_limited.mean():.0f}"}
        )
    return lines


def endings(rows: Frame) -> Lines:
    """How the trials of each condition and load ended, counted."""
    return [names | {e: str((found.ending == e).sum()) for e in ENDINGS} for names, found in groups(rows)]


def paired(rows: Frame, pairs: Sequence[tuple[str, str]]) -> Lines:
    """A line for each pair of conditions and load: how many held-out problems score higher in the first, or lower."""
    lines = []
    for load_name, found in rows[rows.half == "held_out"].groupby("load", sort=False):
        scores = found.pivot(index="object", columns="condition", values="score")
        for one, other in pairs:
            both = scores.reindex(columns=[one, other]).dropna()
            better, worse = int((both[one] > both[other]).sum()), int((both[one] < both[other]).sum())
            counts = {"better": better, "worse": worse, "same": len(both) - better - worse}
            line = {"load": str(load_name), "condition": one, "against": other}
            if len(both):
                line |= {name: str(count) for name, count in counts.items()}
                lines.append(line | {"p": f"{sign_test(better, worse):.2g}"})
    return lines


def success(rows: Frame) -> str:
    """Mean score in percent. A trial that slid counts half; Wilson's interval is too wide for such, if anything."""
    return percent(rows.score.sum(), len(rows))


def of(rows: Frame, condition: str, load_name: str, half: str = "") -> Frame:
    """The rows of a condition under a load, of one half of the objects or of all."""
    found = pick(rows, condition=condition, load=load_name)
    return pick(found, half=half) if half else found


def panels(rows: Frame, half: str = "held_out") -> list[Panel]:
    """Success in every condition on a half, with its interval; a panel for each load."""
    shown, names = [], list(rows.condition.unique())
    for load_name in LOADS:
        scores = {name: of(rows, name, load_name, half).score for name in names}
        shown.append(success_panel(load_name, f"{HALVES[half]} half", scores))
    return shown


def success_panel(title: str, label: str, scores: Mapping[str, Any]) -> Panel:
    """Mean score in percent with its interval, a bar for each name; the scores are columns of a frame."""
    spans = [wilson(score.sum(), len(score)) for score in scores.values()]
    low, high = ([100 * end for end in ends] for ends in zip(*spans, strict=True))
    series = Series(label, list(scores), [100 * score.mean() for score in scores.values()], low, high)
    return Panel(title, "", "success [%]", (series,), bars=True, y_range=(0, 100))
