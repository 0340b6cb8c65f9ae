"""The study of confidence: how likely is a planned grasp to hold, and is it so likely as the plan says?

For each plan, from one view and from two, the first, the middle and the last of the feasible grasps that differ are
carried out on the true object, with the mass and friction of the plan. A grasp held if it has the full score.
`sgnlp.planning.confidence` is fitted to the tuning half, with a ridge chosen by leaving out one object after the other
in all its poses, and judged on the held-out half.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from math import isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.experiments.frames import Frame, Lines, Tables, percent, pick, sign_test, wilson
from sgnlp.experiments.logistic import fitted
from sgnlp.experiments.reliability import area, bins, brier, log_loss
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Case, Setup, Study, body
from sgnlp.experiments.studies.trials import HALVES, NO_PLAN, Condition
from sgnlp.perception.observation import Observation
from sgnlp.planning.cautions.plans import alike
from sgnlp.planning.confidence import MODEL, UNKNOWN, Model, known, values
from sgnlp.planning.plan import Plan
from sgnlp.show.plots import Panel, Series
from sgnlp.simulation import SimulationSettings
from sgnlp.surface.training import carves

CONDITIONS = (Condition("1 view", 1), Condition("2 views", 2))
BINS = 5
"""Bins of the reliability, of as many grasps each."""
NAMES = [feature.name for feature in MODEL.features]


@dataclass(frozen=True)
class Row:
    """A grasp of a plan; rank -1 for a plan without one. The fields in the middle are the features of the
    confidence."""

    object: str
    condition: str
    half: str
    views: str
    feasible: int  # grasps of the plan
    rank: int = -1
    margin: float = nan
    margin_mean: float = nan
    deviation_mm: float = nan
    deviation_max_mm: float = nan
    link_mm: float = nan
    torque_reserve: float = nan
    way_mm: float = nan
    unseen_mm: float = nan
    shift_mm: float = nan
    log_stiffness: float = nan
    ending: str = NO_PLAN
    score: float = 0.0
    held: bool = False


def load(settings: Settings) -> SimulationSettings:
    """The simulation with the load that a plan assumes."""
    contact = settings.contact
    return SimulationSettings(mass=contact.mass, friction=contact.friction, push_weights=0.0)


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """Every object from one view and from two.

    Raises `InputError` if plans of these settings or for one of the clouds have no confidence.
    """
    load(setup.settings)
    for whole in observations:
        if not known(setup.settings, carves(whole, setup.settings.free_space)):
            raise InputError(f"'{whole.name}': {UNKNOWN}")
    return trials.cases(CONDITIONS, setup, observations, tried)


def tried(setup: Setup, file: Path, condition: Condition, views: list[str]) -> list[Row]:
    """A row for each of the grasps that are carried out, or one row if there is none."""
    plan = trials.planned(setup, file, condition, views)
    observation = plan.observation
    row = Row(observation.name, condition.name, observation.half, " ".join(views), trials.feasible(plan))
    points, simulation, rows = cKDTree(observation.points), load(plan.problem.settings), []
    for rank in chosen(plan):
        found: dict[str, Any] = dict(zip(NAMES, values(plan.solutions[rank], points).tolist(), strict=True))
        outcome = trials.carried_out(plan, simulation, rank)
        found |= {"ending": outcome.ending, "score": outcome.score, "held": outcome.score == 1}
        rows.append(replace(row, rank=rank, **found))
    return rows or [row]


def chosen(plan: Plan) -> list[int]:
    """Ranks of the first, the middle and the last of the feasible grasps that differ."""
    contacts = np.array([s.grasp.contacts for s in plan.solutions if s.feasible])
    different = list(dict.fromkeys(alike(contacts)))
    last = len(different) - 1
    return [different[place] for place in sorted({0, last // 2, last})] if different else []


def matrix(rows: Frame) -> Array:
    """The features (N, F) of grasps."""
    return np.asarray(rows[NAMES].to_numpy(float))


def of_half(rows: Frame, half: str) -> Frame:
    """The grasps of a half that were carried out."""
    return pick(rows[rows["rank"] >= 0], half=half)


def fit(rows: Frame) -> tuple[Model, float] | None:
    """The model fitted to the tuning half, and its λ; None if all its grasps held, or none did."""
    tuning = of_half(rows, "tuning")
    if tuning.held.nunique() < 2:
        return None
    return fitted(MODEL, matrix(tuning), tuning.held.to_numpy(bool), [body(name) for name in tuning.object])


def judged(rows: Frame) -> tuple[Frame, Array]:
    """The held-out grasps and the confidence (N,) in each, by the model of the tuning half, else by the package's."""
    held_out, found = of_half(rows, "held_out"), fit(rows)
    return held_out, (found[0] if found else MODEL).probability(matrix(held_out))


def counts(rows: Frame) -> Lines:
    """A line for each half and number of views: plans, those without a feasible grasp, grasps, and how many held."""
    return [
        {"half": HALVES.get(str(half), str(half)), "condition": str(condition)}
        | {"plans": str(found.object.nunique()), "none feasible": str((found["rank"] < 0).sum())}
        | {"grasps": str((found["rank"] >= 0).sum()), "held [%]": percent(found.held.sum(), (found["rank"] >= 0).sum())}
        for (half, condition), found in rows.groupby(["half", "condition"], sort=False)
    ]


def coefficients(model: Model, strength: float) -> Lines:
    """A line for each number of the model, as `sgnlp/planning/confidence.py` has it."""
    empty = {"unit": "", "from": "", "to": "", "feature": ""}
    lines = [
        {"name": f.name, "weight": f"{f.weight:.4g}", "unit": f"{f.unit:g}"}
        | {"from": f"{f.low:.4g}", "to": f"{f.high:.4g}", "feature": f.about}
        for f in model.features
    ]
    rest = {"intercept": f"{model.intercept:.4g}", "ridge λ": f"{strength:.3g}"}
    return lines + [{"name": name, "weight": text} | empty for name, text in rest.items()]


def reliability(p: Array, held: BoolArray) -> Lines:
    """A line for each bin: the predicted confidence, and the share that held with its 95 % interval."""
    return [
        {"told": f"{found.low:.2f} to {found.high:.2f}", "mean told [%]": f"{100 * found.mean:.0f}"}
        | {"held [%]": percent(found.held, found.number), "grasps": str(found.number)}
        for found in bins(p, held, BINS)
    ]


def scores(rows: Frame, p: Array, base: float) -> Lines:
    """The confidence beside one constant for all, the share `base` of the tuning half that held."""
    held = rows.held.to_numpy(bool)
    groups = {"all": np.ones(len(rows), bool)} | {c.name: (rows.condition == c.name).to_numpy() for c in CONDITIONS}
    return [
        {"grasps": f"{name}: {there.sum()}", "told": told}
        | {"Brier": f"{brier(q[there], held[there]):.3f}", "log loss": f"{log_loss(q[there], held[there]):.3f}"}
        | {"area under the ROC": _area(q[there], held[there])}
        for name, there in groups.items()
        if there.any()
        for told, q in (("confidence", p), (f"always {base:.2f}", np.full(len(rows), base)))
    ]


def _area(p: Array, held: BoolArray) -> str:
    found = area(p, held)
    return "-" if isnan(found) else f"{found:.2f}"


def rankings(rows: Frame, p: Array) -> Lines:
    """Success if each plan with several grasps takes the one with the best margin, or with the highest confidence."""
    plans = [g for _, g in rows.assign(p=p).groupby(["object", "condition"], sort=False) if len(g) > 1]
    picks = {key: np.array([g.held[g[key].idxmax()] for g in plans], bool) for key in ("margin", "p")}
    better, worse = (int((picks[a] & ~picks[b]).sum()) for a, b in (("p", "margin"), ("margin", "p")))
    names = {"margin": "margin", "p": "confidence"}
    lines = [{"first by": n, "held [%]": percent(picks[key].sum(), len(plans))} for key, n in names.items()]
    told = {"better": str(better), "worse": str(worse), "p": f"{sign_test(better, worse):.2g}"}
    return [lines[0] | dict.fromkeys(told, ""), lines[1] | told]


def tables(rows: Frame) -> Tables:
    """The grasps; if there are any, coefficients of the tuning half and their quality on the held-out half."""
    found: Tables = {"Grasps": counts(rows)}
    if model := fit(rows):
        found["Coefficients, fitted on the tuning half"] = coefficients(*model)
    held_out, p = judged(rows)
    if model and len(held_out):
        base = float(of_half(rows, "tuning").held.mean())
        found["Reliability on the held-out half"] = reliability(p, held_out.held.to_numpy(bool))
        found["Scores on the held-out half"] = scores(held_out, p, base)
        found["Which grasp of a plan holds, on the held-out half"] = rankings(held_out, p)
    return found


def panels(rows: Frame) -> list[Panel]:
    """The share that held over the predicted confidence, on the held-out half."""
    held_out, p = judged(rows)
    found = list(bins(p, held_out.held.to_numpy(bool), BINS)) if len(held_out) else []
    ends = [[100 * end for end in wilson(b.held, b.number)] for b in found]
    told, held = [100 * b.mean for b in found], [100 * b.held / b.number for b in found]
    series = Series("grasps", told, held, [low for low, _ in ends], [high for _, high in ends])
    return [Panel("Reliability", "confidence [%]", "held [%]", (series,), diagonal=bool(found), y_range=(0, 102))]


def facts(setup: Setup) -> dict[str, Any]:
    """What the rows depend on: also the load."""
    return setup.facts() | trials.changes(CONDITIONS, setup) | {"load": asdict(load(setup.settings))}


STUDY = Study(
    question="how likely is a planned grasp to hold, and is it so likely as the plan says?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=panels,
    caption=(
        "Share of grasps of the held-out half that held over the confidence in them, in bins of as many grasps each, "
        "with Wilson's 95 % intervals; on the grey diagonal a confidence is what it says."
    ),
    facts=facts,
)
