"""The study of arm and obstacle: where the obstacle stands, the distance of the true meshes, and the table."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scenes import SMALL, posed

from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import arm
from sgnlp.experiments.true_clearance import true_clearance
from sgnlp.hand.meshes import link_meshes, link_poses
from sgnlp.perception.observation import load
from sgnlp.perception.shape import Shape
from sgnlp.planning.starts import starts

PROBLEMS = Path(__file__).parents[2] / "problems"


@pytest.mark.parametrize("name", ["mug_0", "banana_3", "pyramid_1"])
def test_the_obstacle_stands_three_centimetres_beside_the_true_object_on_its_table(name):
    whole = load(PROBLEMS / f"{name}.npz")
    box = arm.obstacle(whole, 0)
    assert box.distance(whole.mesh_vertices).min() == pytest.approx(0.03, abs=2e-3)
    assert box.centre[2] - box.half[2] == pytest.approx(whole.table_height)
    assert not np.allclose(arm.obstacle(whole, 1).centre, box.centre)


def grasp(problem):
    start = starts(problem, 1, 0)[0]
    bent = np.clip(start.joints + 0.2, problem.hand.lower, problem.hand.upper)
    return SimpleNamespace(wrist=start.wrist, joints=start.joints, joints_contact=bent, arm=None)


def test_the_true_clearance_is_that_of_the_meshes_on_the_whole_way():
    problem = posed(SMALL)
    solution, centre = grasp(problem), np.array([0.3, 0.1, 0.2])
    near, far = (true_clearance(problem, solution, [Shape.sphere(centre, r)]) for r in (0.02, 0.03))
    assert near - far == pytest.approx(0.01, abs=1e-9)
    up = np.array([0.0, 0.0, problem.settings.motion.lift])
    for place, joints in ((np.zeros(3), solution.joints), (up, solution.joints_contact)):
        wrist = solution.wrist + np.concatenate([place, np.zeros(4)])
        mesh, T = link_meshes(problem.hand)[0][-1], link_poses(problem.hand, wrist, joints)[-1]
        corner = T[:3, :3] @ mesh.vertices[0] + T[:3, 3]
        assert true_clearance(problem, solution, [Shape.sphere(corner, 0.001)]) <= -0.001 + 1e-9


def test_the_table_counts_objects_with_a_grasp_among_those_within_reach():
    row = arm.Row(
        "a", "free wrist", "0.1 kg, μ 1", "held_out", "0 1", 7, 6, 2.0, ending="held", score=1.0, iterations=60
    )
    rows = [
        row,
        replace(row, condition="panda, obstacle", seconds=3.0, obstacle_mm=12.0, out_of_reach=1),
        replace(row, object="b"),
        replace(row, object="b", condition="panda, obstacle", seconds=5.0, ending="no feasible grasp", feasible=0),
        replace(row, object="c"),
        replace(
            row, object="c", condition="panda, obstacle", ending="no feasible grasp", feasible=0, within_reach=False
        ),
    ]
    free, crowded = arm.table(frame(rows))
    assert free["time ratio"] == "1.00"
    assert (crowded["objects"], crowded["within reach"]) == ("3", "2")
    assert crowded["with a grasp [%]"].startswith("50")
    assert crowded["obstacle, least [mm]"] == "12.0"
    assert crowded["time ratio"] == "1.50"
    assert crowded["feasible starts"] == "6 of 21"
