"""What stands around the object: which shapes count where."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import CROWD, SMALL, posed, random_point

from sgnlp.perception.shape import FAR, Shape
from sgnlp.program.around import ALONE, Around, fields
from sgnlp.program.around_jets import AroundJets
from sgnlp.program.compiled import path
from sgnlp.program.formulations.penalty import FreeWrist, Penalty
from sgnlp.program.formulations.two_phase import TwoPhase
from sgnlp.program.nlp import build

THING = Shape.box([0.0, 0.0, 0.05], [0.06, 0.06, 0.1])
FIELDS = fields([Shape.sphere([0.3, 0.0, 0.1], 0.05)], [THING], [Shape.sphere([0.0, 0.0, 1.0], 0.1)], THING, 0.0)
OF_ARM = {"arm", "arm_self", "arm_hand", "wrist", "standoff", "lift", "dexterity", "arm_turn"}
LOW, NEAR = np.array([[0.0, 0.3, 0.02]]), np.array([[0.0, 0.04, 0.3]])


@pytest.mark.parametrize(
    ("name", "at_the_table", "over_the_object"),
    [
        ("near", 0.3817, 0.3128),
        ("way", 0.02, 0.3),
        ("arm", 0.02, 0.2002),
        ("avoid", 0.27, 0.2002),
        ("touch", 0.9249, 0.6011),
    ],
)
def test_the_table_counts_on_the_way_and_the_object_for_the_arm(name, at_the_table, over_the_object):
    field = getattr(FIELDS, name)
    assert field.distance(LOW)[0] == pytest.approx(at_the_table, abs=1e-4)
    assert field.distance(NEAR)[0] == pytest.approx(over_the_object, abs=1e-4)


def test_points_and_regions_are_counted_as_they_are_asked_for():
    assert (ALONE.points(45), ALONE.regions(4)) == (0, 0)
    assert Around(obstacles=True, approach=2).points(45) == 5 * 45
    assert Around(avoid=True, touch=True).regions(4) == 8


@pytest.mark.parametrize("compiled", [True, False])
def test_jets_come_in_the_order_of_the_points(compiled):
    around, rng = CROWD.around(SMALL, carried=True), np.random.default_rng(0)
    points, feet = rng.uniform(-0.2, 0.3, (around.points(3) + 6, 3)), rng.uniform(-0.05, 0.05, (4, 3))
    crowd = CROWD.fields(THING, 0.0)
    around_jets = AroundJets(crowd, around, (3, len(points), 4), compiled)
    around_jets.update(np.asfortranarray(points), np.asfortranarray(feet), complete=True)
    parts = [
        crowd.near.jets(points[:6]),
        crowd.way.jets(points[6:15]),
        crowd.arm.jets(points[15:]),
        crowd.avoid.jets(feet),
        crowd.touch.jets(feet),
    ]
    np.testing.assert_allclose(around_jets.jets, np.concatenate(parts), rtol=1e-8, atol=1e-8)


def test_without_anything_around_no_jet_is_asked_for():
    assert AroundJets(FIELDS, ALONE, (45, 0, 4)).jets.shape == (0, 10)
    assert fields([], [], [], THING, 0.0).near.distance(LOW)[0] == FAR


def test_a_first_phase_is_that_of_the_hand_alone_and_its_program_the_same_with_and_without_an_arm():
    alone, carried = posed(SMALL, CROWD), posed(SMALL, CROWD, "panda")
    first, second = (phase.formulation for phase in replace(carried, formulation=TwoPhase()).phases)
    assert carried.structure(first) == alone.structure(first)
    assert path(carried.hand, carried.structure(first)) == path(alone.hand, alone.structure(first))
    assert path(carried.hand, carried.structure(second)) != path(alone.hand, alone.structure(second))
    rows, terms = carried.structure(second).constraints, carried.structure(second).terms
    assert {row.name for row in rows} - {row.name for row in carried.structure(first).constraints} == OF_ARM
    assert {term.name for term in terms} - {term.name for term in carried.structure(first).terms} == {"arm"}


def test_the_numbers_of_a_first_phase_on_an_arm_are_those_of_the_hand_alone():
    numbers = []
    for problem in (posed(SMALL, CROWD), posed(SMALL, CROWD, "panda")):
        nlp = build(problem.hand, problem.structure(FreeWrist()))
        start, _ = random_point(problem, nlp, 0)
        p = problem.parameters(nlp, start.wrist, start.joints, start.arm)
        numbers.append((p, *problem.variable_bounds(nlp, start.joints), *problem.row_bounds(nlp)))
    for one, other in zip(*numbers, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_penalty_formulation_by_itself_keeps_the_arm():
    assert posed(SMALL, CROWD, "panda").structure(Penalty()).around.carried
