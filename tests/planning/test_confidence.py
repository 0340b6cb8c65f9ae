"""The confidence of a grasp: its features computed another way, its model, where it is not known, and what is said."""

from dataclasses import replace
from functools import lru_cache
from math import exp, inf, isnan, nan
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from plans import small_plan
from scenes import REACHING, SMALL, hand
from scipy.spatial import cKDTree
from views import ball

from sgnlp.base.settings import Settings
from sgnlp.base.surface_settings import FreeSpace
from sgnlp.hand.kinematics import frames
from sgnlp.planning import confidence
from sgnlp.planning.confidence import MODEL, Feature, Model, known, refusal, values, with_confidence, words
from sgnlp.planning.kkt import Kkt
from sgnlp.planning.planner import History, Iterate
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.solution import Solution, rank, solution
from sgnlp.planning.starts import initial, starts
from sgnlp.program.formulations import formulation
from sgnlp.program.nlp import FUNCTIONS, Nlp, frame
from sgnlp.surface.training import carves

FREE = FreeSpace(used=True, surface_points=60, table_points=10, near_points=20, far_points=5)
SEEN = replace(REACHING, free_space=FREE)
NAMES = [feature.name for feature in MODEL.features]
TRIALS = Path(__file__).parents[2] / "results" / "confidence" / "rows.csv"


@lru_cache
def reached() -> tuple[Problem, Solution]:
    """A grasp of the ball with the hand at contact planned, near the start: no symbolic function is built for it."""
    problem = build_problem(ball(), hand(), SEEN)
    structure = problem.structure(formulation("constrained"))
    nlp = Nlp(**frame(problem.hand, structure, [1] * len(structure.rows)), **dict.fromkeys(FUNCTIONS))
    start = starts(problem, 1, 0)[0]
    x = np.concatenate([initial(nlp, start), [0.6, 0.7, 0.8, 0.7], start.joints + 0.1])
    ended = Iterate(0, "constrained", x, np.zeros(0), 0.0, Kkt(0, 0, 0), "", 7, 0.5, History(*[np.zeros(8)] * 5))
    return problem, solution(problem, start, ended, nlp)


def feasible(s: Solution, stiffness: float = 0.02) -> Solution:
    """The same grasp as if every check had passed."""
    passed = tuple(replace(check, passed=True) for check in s.checks)
    return replace(s, checks=passed, grasp=replace(s.grasp, stiffness=stiffness))


def model(**weights: float) -> Model:
    """The features with these weights and wide ranges, the others with none."""
    return Model(0.1, tuple(replace(f, weight=weights.get(f.name, 0.0), low=-1e3, high=1e3) for f in MODEL.features))


def test_the_features_are_those_of_another_computation():
    problem, s = reached()
    g, points = s.grasp, ball().points
    links = [i for i in range(len(g.radii)) if i not in hand().tip_spheres]
    at = frames(hand(), s.wrist, s.joints_contact)[1][links]
    way = min(
        min(problem.gpis.distance(c[None])[0], c[2] - problem.table_height) - r
        for share in np.arange(1, 6) / 6
        for c, r in zip(
            frames(hand(), s.wrist, s.joints + share * (s.joints_contact - s.joints))[1][links],
            g.radii[links],
            strict=True,
        )
    )
    cone = 1 / np.sqrt(1 + SEEN.contact.friction**2)
    normals = problem.gpis.normal(g.contacts)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    states = [(g.forces, normals), (g.forces_eq, normals @ g.rotation.T)]
    margins = np.array([-(f * n).sum(axis=1) / np.linalg.norm(f, axis=1) - cone for f, n in states])
    deviations = 1e3 * problem.gpis.distance_deviation(g.contacts)
    far = [np.linalg.norm(points - p, axis=1).min() for p in s.contact_points]
    torques = max((abs(t) / hand().effort).max() for t in (g.torques, g.torques_eq))
    expected = {
        "margin": margins.min(),
        "margin_mean": margins.mean(),
        "deviation_mm": deviations.mean(),
        "deviation_max_mm": deviations.max(),
        "link_mm": 1e3 * (problem.gpis.distance(at) - g.radii[links]).min(),
        "torque_reserve": 1 - torques,
        "way_mm": 1e3 * way,
        "unseen_mm": 1e3 * max(far),
        "shift_mm": 1e3 * np.linalg.norm(g.contacts @ (g.rotation - np.eye(3)).T + s.translation_eq, axis=1).max(),
        "log_stiffness": np.log10(0.02 / 1e-3),
    }
    assert list(expected) == NAMES
    np.testing.assert_allclose(values(feasible(s), cKDTree(points)), list(expected.values()), rtol=1e-6, atol=1e-9)


def test_the_probability_is_the_logistic_of_the_weighted_features():
    two = Model(0.5, (Feature("a", "", 2.0, 3.0, -inf, inf), Feature("b", "", 0.1, -1.0, -inf, inf)))
    scores = [0.5 + 3.0 * 1.0 - 1.0 * 2.0, 0.5]
    found = two.probability(np.array([[2.0, 0.2], [0.0, 0.0]]))
    assert found == pytest.approx([1 / (1 + exp(-score)) for score in scores])


def test_beyond_the_range_of_the_trials_nothing_is_extrapolated():
    one = Model(0.0, (Feature("a", "", 1.0, 5.0, -1.0, 2.0),))
    found = one.probability(np.array([[-1e9], [-1.0], [2.0], [1e9]]))
    assert found[0] == found[1]
    assert found[2] == found[3]
    assert 0 < found[0] < 0.5 < found[3] < 1


@pytest.mark.parametrize(("weight", "sign"), [(0.4, 1), (-0.4, -1)])
def test_the_confidence_goes_the_way_of_the_margin_that_its_weight_says(monkeypatch, weight, sign):
    monkeypatch.setattr(confidence, "MODEL", model(margin=weight))
    s = feasible(reached()[1])
    better = [replace(s, margins_initial=s.margins_initial * 0 + m, margins_equilibrium=s.margins_equilibrium * 0 + m)
              for m in (0.05, 0.1, 0.2, 0.3)]  # fmt: skip
    found = np.array([s.confidence for s in with_confidence(better, ball(), SEEN, carves(ball(), SEEN.free_space))])
    assert (sign * np.diff(found) > 0).all()
    assert ((found > 0) & (found < 1)).all()


def test_the_confidence_of_a_grasp_is_that_of_its_features():
    s = feasible(reached()[1])
    (told,) = with_confidence([s], ball(), SEEN, carves(ball(), SEEN.free_space))
    assert told.confidence == MODEL.probability(values(s, cKDTree(ball().points))[None])[0]
    assert 0 < told.confidence < 1


@pytest.mark.parametrize(
    "settings",
    [
        replace(SEEN, closing=replace(SEEN.closing, planned=False)),
        replace(SEEN, free_space=FreeSpace(used=False)),
        replace(SEEN, contact=replace(SEEN.contact, metric="closure")),
    ],
    ids=["pregrasp alone", "cloud alone", "force closure"],
)
def test_it_is_not_known_where_the_model_was_not_fitted(settings: Settings):
    (told,) = with_confidence([feasible(reached()[1])], ball(), settings, carves(ball(), settings.free_space))
    assert isnan(told.confidence)
    assert known(SEEN, carves(ball(), SEEN.free_space))
    assert not known(settings, carves(ball(), settings.free_space))


def test_it_is_not_known_without_cameras_nor_of_a_grasp_that_is_not_feasible():
    s = reached()[1]
    assert not s.feasible
    assert [
        isnan(t.confidence) for t in with_confidence([s, feasible(s)], ball(), SEEN, carves(ball(), SEEN.free_space))
    ] == [True, False]
    blind = replace(ball(), camera_positions=None)
    assert isnan(with_confidence([feasible(s)], blind, SEEN, carves(blind, SEEN.free_space))[0].confidence)


def test_a_plan_of_the_pregrasp_alone_says_that_its_confidence_is_unknown():
    assert np.isnan(small_plan().arrays().confidence).all()
    assert small_plan().summary()["best"]["confidence"] is None
    assert "unknown" in words(nan)
    assert not known(SMALL, carves(small_plan().observation, SMALL.free_space))


def test_a_confidence_is_told_in_words_and_as_a_share_of_a_hundred():
    assert words(0.934) == "confidence 0.93: of 100 such grasps, about 93 held in simulation"


@pytest.mark.parametrize(
    ("told", "least", "refused"),
    [
        (0.9, 0.8, ""),
        (0.8, 0.8, ""),
        (0.7, 0.8, "its confidence 0.7 is below 0.8"),
        (nan, 0.8, "its confidence is unknown"),
        (nan, 0.0, ""),
        (0.01, 0.0, ""),
    ],
)
def test_a_grasp_is_refused_that_is_less_sure_than_asked_or_of_which_nothing_is_known(told, least, refused):
    assert refusal(told, least) == refused


def test_grasps_are_ranked_by_confidence_then_by_margin():
    told = [(0.9, 0.1, True), (0.95, 0.05, True), (nan, 0.5, True), (nan, 0.6, True), (0.99, 0.9, False)]
    found = [
        SimpleNamespace(start=i, confidence=p, worst_margin=m, feasible=good) for i, (p, m, good) in enumerate(told)
    ]
    assert [s.start for s in rank(found, "confidence")] == [1, 0, 3, 2, 4]


@pytest.mark.skipif(not TRIALS.is_file(), reason="the study of confidence has no rows here")
def test_the_model_is_the_fit_to_the_rows_of_the_study():
    pytest.importorskip("pandas")
    from sgnlp.experiments.frames import frame
    from sgnlp.experiments.studies.confidence import STUDY, fit
    from sgnlp.planning import results

    found = fit(frame(results.read_rows(TRIALS, STUDY.row)))
    assert found is not None
    assert MODEL.intercept == pytest.approx(found[0].intercept, rel=1e-3, abs=1e-4)
    for ours, theirs in zip(MODEL.features, found[0].features, strict=True):
        numbers = [(f.weight, f.low, f.high) for f in (ours, theirs)]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-3, abs=1e-4), ours.name
