"""What a plan says of itself: the numbers of the arrays in plain values, every start in it, valid JSON."""

import json
import math
import pickle
from dataclasses import asdict, replace

import numpy as np
import pytest
from plans import small_plan
from scenes import SMALL, hand, observation

from sgnlp.base.settings import Settings
from sgnlp.planning import results
from sgnlp.planning.environment import versions
from sgnlp.planning.plan import Plan
from sgnlp.planning.pool import Failure
from sgnlp.planning.solution import Solution

FAILURE = Failure(7, "stopped after 1 s")


def strict(text: str) -> dict:
    """The JSON in a text, with no NaN and no infinity in it."""

    def refuse(token: str) -> None:
        raise AssertionError(f"{token} is not JSON")

    return json.loads(text, parse_constant=refuse)


def infeasible(s: Solution) -> Solution:
    """The same solution with a check that fails on NaN."""
    return replace(s, checks=(replace(s.checks[0], value=math.nan, passed=False), *s.checks[1:]))


@pytest.fixture
def plan() -> Plan:
    return small_plan()


def test_the_best_grasp_has_the_numbers_of_the_first_row_of_the_arrays(plan):
    best, grasps = plan.summary()["best"], plan.arrays()
    assert best["start"] == grasps.start[0]
    assert best["wrist"] == grasps.wrist[0].tolist()
    assert best["joints"] == dict(zip(grasps.joint_names.tolist(), grasps.joints[0].tolist(), strict=True))
    assert best["energy"] == grasps.energy[0]
    assert list(best["fingers"]) == grasps.finger_names.tolist()
    for i, finger in enumerate(best["fingers"].values()):
        assert finger["gain"] == grasps.gains[0, i]
        assert finger["target"] == grasps.targets[0, i].tolist()
        assert finger["force"] == pytest.approx(np.linalg.norm(grasps.forces_eq[0, i]), rel=1e-15)
        assert finger["margin_initial"] == grasps.margins_initial[0, i]
        assert finger["margin_equilibrium"] == grasps.margins_equilibrium[0, i]
        assert finger["contact_distance_mm"] == 1e3 * grasps.contact_distance[0, i]
        assert finger["deviation_mm"] == 1e3 * grasps.contact_deviation[0, i]


def test_the_breakdown_adds_up_to_the_energy(plan):
    best, grasps = plan.summary()["best"], plan.arrays()
    terms = best["energy_terms"]
    assert list(terms) == [term.name for term in plan.problem.terms] == grasps.term_names.tolist()
    assert [term["value"] for term in terms.values()] == grasps.energy_terms[0].tolist()
    assert [term["weight"] for term in terms.values()] == plan.problem.weights().tolist()
    assert all(term["share"] == term["weight"] * term["value"] for term in terms.values())
    assert sum(term["share"] for term in terms.values()) == pytest.approx(best["energy"], rel=1e-13)


def test_the_checks_are_those_of_the_solution(plan):
    for check in plan.best.checks:
        found = plan.summary()["best"]["checks"][check.name]
        assert found.items() >= {"value": check.value, "passed": check.passed, "row": check.row}.items()
        assert found["demand"] == check.demand
        assert found["lower"] == (None if math.isinf(check.lower) else check.lower)


def test_every_start_is_in_the_table_with_the_numbers_of_its_row(plan):
    table, grasps = plan.summary()["starts_table"], plan.arrays()
    assert len(table) == len(grasps)
    for i, line in enumerate(table):
        margins = [*grasps.margins_initial[i], *grasps.margins_equilibrium[i]]
        assert (line["rank"], line["start"]) == (i, grasps.start[i])
        assert (line["feasible"], "; ".join(line["violated"])) == (grasps.feasible[i], grasps.violated[i])
        assert (line["worst_margin"], line["energy"]) == (min(margins), grasps.energy[i])
        assert (line["stiffness"], list(line["kkt"].values())[:3]) == (grasps.stiffness[i], grasps.kkt[i].tolist())
        assert (line["status"], line["iterations"]) == (grasps.status[i], grasps.iterations[i])
        assert line["seconds"] == grasps.solve_seconds[i]


def test_counts_and_notes_are_those_of_the_plan(plan):
    found = plan.summary()
    assert found["feasible"] == plan.arrays().feasible.sum() == len(plan.solutions)
    assert found["solved"] == (plan.arrays().kkt.max(axis=1) <= 10 * SMALL.solver.tolerance).sum()
    assert found["notes"] == list(observation().notes)


def test_a_start_that_failed_is_told_with_its_reason(plan):
    found = replace(plan, failures=(FAILURE,)).summary()
    assert found["starts_table"][-1] == {"start": 7, "failure": "stopped after 1 s"}
    assert found["tried"] == len(plan.solutions) + 1
    assert found["feasible"] == len(plan.solutions)


def test_without_a_feasible_grasp_there_is_no_best(plan):
    found = replace(plan, solutions=tuple(map(infeasible, plan.solutions))).summary()
    assert found["best"] is None
    assert found["feasible"] == 0
    assert found["starts_table"][0]["violated"] == [plan.solutions[0].checks[0].name]
    assert replace(plan, solutions=()).summary()["starts_table"] == []


def test_a_plan_with_numbers_that_are_not_numbers_is_still_valid_json(plan):
    nan = replace(plan.solutions[0], energy=math.nan, seconds=math.inf)
    found = strict(results.json_text(replace(plan, solutions=(nan,)).summary()))
    assert found["best"]["energy"] is None
    assert found["starts_table"][0]["seconds"] is None


def test_the_summary_is_plain_and_survives_json_unchanged(plan):
    assert strict(results.json_text(plan.summary())) == json.loads(json.dumps(plan.summary()))
    assert strict(json.dumps(plan.arrays().meta)) == json.loads(json.dumps(plan.meta()))


def test_a_worker_can_return_a_plan_since_it_pickles(plan):
    again = pickle.loads(pickle.dumps(plan))
    assert again.problem.structure(plan.problem.formulation) == plan.problem.structure(plan.problem.formulation)
    assert again.summary() == plan.summary()


def test_the_meta_block_says_how_to_make_the_plan_again(plan):
    found = plan.meta()
    assert (found["object"], found["input_digest"]) == (observation().name, observation().digest)
    assert (found["hand"], found["seed"], found["starts"]) == (hand().name, 0, 2)
    assert (found["versions"], found["kinematics"]) == (versions(), hand().kinematics)
    assert set(found["seconds"]) == {"fit", "solve", "jobs"}
    assert found["settings"] == json.loads(json.dumps(asdict(SMALL)))
    rebuilt = {
        name: type(getattr(SMALL, name))(**value) if isinstance(value, dict) else value
        for name, value in found["settings"].items()
    }
    assert Settings(**rebuilt) == SMALL
