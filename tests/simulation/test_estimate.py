"""The estimated surface as a body: closed, on the table, of the size of what was seen."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("skimage")

from scenes import observation

from sgnlp.base.errors import InputError
from sgnlp.planning.problem import Problem
from sgnlp.simulation import estimated, true_body

BOX = np.array([[-0.04, -0.03, 0.0], [0.04, 0.03, 0.08]])
CENTRES = np.array([[0.0, 0.0, 0.03], [0.06, 0.0, 0.02]])


def balls(points):
    """Negative in a ball of 40 mm that reaches through the table, and in one of 8 mm beside it."""
    return np.min([np.linalg.norm(points - c, axis=1) - r for c, r in zip(CENTRES, (0.04, 0.008), strict=True)], axis=0)


def posed(mean):
    """A problem of which only the box and the surface are known."""
    problem = object.__new__(Problem)
    vars(problem).update(box=BOX, gpis=SimpleNamespace(mean=mean))
    return problem


@pytest.fixture(scope="module")
def believed():
    return estimated(observation(), posed(balls))


def test_it_is_a_closed_body_of_the_largest_part_cut_flat_at_the_table(believed):
    thing, (radius, height) = true_body(believed), (0.04, 0.07)
    cap = np.pi * height**2 * (3 * radius - height) / 3  # of a ball, above the table
    assert thing.volume == pytest.approx(cap, rel=0.02)
    bottom = thing.vertices[thing.vertices[:, 2] < 0.002]
    assert len(bottom) > 20
    assert thing.vertices[:, 2].min() == pytest.approx(0.0, abs=0.0025)  # less than a cell of the grid
    assert np.linalg.norm(thing.vertices - CENTRES[0], axis=1).max() < 0.042


def test_all_else_of_the_observation_is_kept(believed):
    np.testing.assert_array_equal(believed.points, observation().points)
    assert believed.table_height == observation().table_height
    assert observation().mesh_vertices is None


def test_a_surface_that_leaves_the_box_is_closed_there():
    thing = true_body(estimated(observation(), posed(lambda points: np.abs(points[:, 1]) - 0.04)))
    assert thing.volume == pytest.approx(0.14 * 0.08 * 0.11, rel=0.03)


def test_arguments_of_another_kind_are_refused_by_name():
    with pytest.raises(InputError, match="observation must be of Observation"):
        estimated(None, posed(balls))
    with pytest.raises(InputError, match="problem must be of Problem"):
        estimated(observation(), observation())
