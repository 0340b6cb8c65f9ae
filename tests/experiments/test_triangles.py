"""The triangle study: the paper's geometry, poses within reach, what is counted."""

from dataclasses import replace
from itertools import islice
from math import inf

import numpy as np
import pytest

from sgnlp.base.presets import ROBUST
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import triangles
from sgnlp.experiments.studies.planar import cross, turn
from sgnlp.experiments.studies.study import Setup
from sgnlp.experiments.studies.triangles import (
    CONTACTS,
    Row,
    counts,
    edge_normals,
    inverted,
    least_limit,
    panels,
    poses,
    search,
    tables,
    way,
)

ROW = Row("1", "1", 0, 0.0, 0.0, 0.0, 4.0, 3.0, 14.0, 11.0)


@pytest.mark.parametrize("key", CONTACTS)
def test_every_contact_lies_on_an_edge_of_its_own(key):
    vertices = np.array(triangles.TRIANGLES[key[0]], dtype=float)
    normals, edges = edge_normals(key[0]), np.roll(vertices, -1, axis=0) - vertices
    for contact, vertex, edge, normal in zip(np.array(CONTACTS[key]), vertices, edges, normals, strict=True):
        assert abs(cross(contact - vertex, edge)) < 1e-12
        assert 0 < (contact - vertex) @ edge < edge @ edge
        assert (vertices.mean(axis=0) - contact) @ normal < 0


def test_poses_are_seeded_and_within_reach():
    first = list(islice(poses(0, "1", "2"), 20))
    assert list(islice(poses(0, "1", "2"), 20)) == first
    assert list(islice(poses(1, "1", "2"), 20)) != first
    for x, y, angle in first:
        assert max(abs(x), abs(y)) <= 0.5
        assert abs(angle) <= np.pi / 4
        tips = np.array(CONTACTS["1", "2"]) @ turn(angle).T + (x, y)
        assert all(finger.torques(tip) is not None for finger, tip in zip(triangles.FINGERS, tips, strict=True))


def test_a_way_begins_at_the_pose_and_ends_after_the_motion():
    points, normals = np.array(CONTACTS["1", "1"]), edge_normals("1")
    stages = way(points, normals, np.array([0.1, -0.05, 0.2]))
    assert len(stages) == triangles.STAGES
    assert stages[0].points == pytest.approx(points)
    assert stages[-1].points.mean(axis=0) == pytest.approx(points.mean(axis=0) + np.array([0.1, -0.05]))
    assert stages[-1].normals == pytest.approx(normals @ turn(0.2).T)
    assert np.linalg.norm(np.diff(stages[-1].points, axis=0)) == pytest.approx(np.linalg.norm(np.diff(points, axis=0)))
    assert len(way(points, normals, np.zeros(3))) == 1
    assert way(points, normals, np.array([3.0, 0.0, 0.0])) is None


def test_the_inverse_is_that_of_the_jacobian():
    points, normals = np.array(CONTACTS["1", "1"]), edge_normals("1")
    (right,) = way(points, normals, np.zeros(3))
    assert inverted(right).torques @ np.swapaxes(right.torques, 1, 2) == pytest.approx(np.stack([np.eye(2)] * 3))


def test_a_motion_never_needs_more_than_none_and_at_times_less(monkeypatch):
    monkeypatch.setattr(triangles, "HALVINGS", 0)
    (row,) = triangles.rows_of(0, "1", "1", 7)
    assert 0 < row.compliant < row.direct < inf
    assert 0 < row.compliant_inverse <= row.direct_inverse
    points = np.array(CONTACTS["1", "1"]) @ turn(np.radians(row.angle_deg)).T + (row.x, row.y)
    normals = edge_normals("1") @ turn(np.radians(row.angle_deg)).T
    assert least_limit(way(points, normals, np.zeros(3))) == pytest.approx(row.direct, abs=1e-4)
    assert least_limit(None) == inf


def test_the_search_finds_a_bowls_bottom_to_its_smallest_step_and_stays_inside():
    asked = []

    def bowl(motion):
        asked.append(motion / triangles.FARTHEST)
        return float(((asked[-1] - [0.3, -0.6, 2.0]) ** 2).sum())

    still, best = search(bowl)
    assert still == pytest.approx(0.09 + 0.36 + 4)
    assert best == pytest.approx(0.05**2 + 0.1**2 + 1)  # at 0.25, -0.5, 1
    assert np.abs(asked).max() == 1
    assert len({tuple(step) for step in asked}) == len(asked)


def test_there_is_a_case_for_each_pose_and_it_depends_on_the_seed_alone():
    cases = triangles.cases(Setup((), "allegro_left", ROBUST, 7, 3, 1.0), [])
    assert len({case.key for case in cases}) == 6 * 100
    assert triangles.STUDY.facts(Setup((), "other", ROBUST, 1, 3, 9.0)) == {"seed": 3, "poses": 100}


def test_what_is_counted_is_under_the_limit_directly_or_by_a_motion():
    rows = frame([ROW, replace(ROW, direct=3.4, compliant=3.4), replace(ROW, direct=inf, compliant=inf)])
    assert counts(rows, "Jᵀf", 3.5) == (2, 1)
    assert counts(rows, "Jᵀf", 4.0) == (2, 2)
    assert counts(rows, "Jᵀf", 2.0) == (0, 0)
    assert counts(rows, "J⁻¹f", 12.0) == (3, 0)


def test_the_tables_stand_beside_the_papers_number():
    by_limit, by_configuration = tables(frame([ROW, replace(ROW, triangle="2", direct=3.2)])).values()
    line = next(line for line in by_limit if line["limit [N m]"] == "3.5")
    assert (line["poses"], line["compliant"], line["direct"]) == ("2", "2", "1")
    assert line["direct of compliant [%] (95 %)"] == "50 (9-91)"
    assert {line["paper [%]"] for line in by_limit} == {"about 85"}
    assert len(by_configuration) == 12
    assert by_configuration[1]["direct of compliant [%] (95 %)"] == "-"


def test_the_figure_rises_with_the_limit():
    (panel,) = panels(frame([ROW, replace(ROW, pose=1, direct=5.0, compliant=5.0)]))
    compliant, direct = panel.series
    assert (compliant.y[0], compliant.y[-1], direct.y[-1]) == (0, 100, 100)
    assert all(c >= d for c, d in zip(compliant.y, direct.y, strict=True))
