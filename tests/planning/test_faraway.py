"""Clouds far from the origin: their plan is the near one's, moved."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import SMALL, ellipsoid

from sgnlp import observe, solve
from sgnlp.planning.faraway import moved_cloud, origin
from sgnlp.planning.solution import Solution

UTM = np.array([694386.0, 5155487.0, 381.0])


def plan(at):
    return solve(observe(ellipsoid() + at, table_height=at[2], name="egg"), settings=SMALL, count=1, jobs=1)


@pytest.fixture(scope="module")
def near() -> Solution:
    return plan(np.zeros(3)).solutions[0]


def test_a_far_plan_is_the_near_one_moved(near):
    found = plan(UTM)
    far = found.solutions[0]
    assert far.feasible == near.feasible
    assert [c.passed for c in far.checks] == [c.passed for c in near.checks]
    np.testing.assert_allclose(far.wrist[:3] - UTM, near.wrist[:3], atol=1e-6)
    np.testing.assert_allclose(far.joints, near.joints, atol=1e-5)
    np.testing.assert_allclose(far.contact_points - UTM, near.contact_points, atol=1e-6)
    for name in ("tips", "targets", "contacts", "contacts_eq", "contacts_desired", "spheres"):
        np.testing.assert_allclose(getattr(far.grasp, name) - UTM, getattr(near.grasp, name), atol=1e-6)
    np.testing.assert_allclose(
        far.grasp.contacts @ far.grasp.rotation.T + far.translation_eq, far.grasp.contacts_eq, atol=1e-8
    )
    np.testing.assert_allclose(found.problem.gpis.mean(far.contact_points), 0.0, atol=0.02)
    np.testing.assert_allclose(found.problem.box.mean(axis=0), found.problem.com)
    assert found.problem.table_height == UTM[2]


def test_the_planning_frame_is_at_whole_metres_and_the_world_s_own_near_it():
    cloud = observe(ellipsoid() + UTM)
    np.testing.assert_array_equal(origin(cloud), UTM)
    assert not origin(observe(ellipsoid() + np.array([9.0, -3.0, 0.7]))).any()
    whole = replace(
        cloud,
        camera_positions=UTM[None] + 0.5,
        mesh_vertices=UTM[None] + np.eye(3),
        obstacle_points=UTM[None] + 0.25,
        background=UTM[None] + 0.75,
    )
    moved = moved_cloud(whole, -UTM)
    assert moved.table_height == pytest.approx(observe(ellipsoid()).table_height, abs=1e-9)
    np.testing.assert_array_equal(moved.camera_positions, [[0.5, 0.5, 0.5]])
    np.testing.assert_array_equal(moved.mesh_vertices, np.eye(3))
    np.testing.assert_array_equal(moved.background, [[0.75, 0.75, 0.75]])
    np.testing.assert_array_equal(moved.obstacle_points, [[0.25, 0.25, 0.25]])
