"""Marks for no return, copies, rounded coordinates, units, other frames: dropped, turned or refused, and told."""

import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.perception.observation import observe

TABLE = 0.0


def ball(count=600, radius=0.04, seed=0):
    """Points (count, 3) on a sphere that rests on the table."""
    direction = np.random.default_rng(seed).normal(size=(count, 3))
    return radius * (direction / np.linalg.norm(direction, axis=1, keepdims=True) + [0, 0, 1])


BALL = ball()
ELSEWHERE = np.random.default_rng(1).uniform(-0.3, 0.3, (60, 2))
MARKS = {
    "zeros": np.full((200, 3), [0.3, 0.3, 0.0]),
    "the camera's place": np.full((60, 3), [0.5, 0.1, 0.4]),
    "a sentinel": np.full((60, 3), 65.535),
    "minus one": np.full((60, 3), -1.0),
    "a point of the body, repeated": np.repeat(BALL[:1], 300, axis=0),
    "z alone, low": np.c_[ELSEWHERE, np.full(60, -1.0)],
    "z alone, far": np.c_[60 * ELSEWHERE, np.full(60, 65.535)],
    "x alone": np.c_[np.full(60, -9.999), ELSEWHERE],
}


@pytest.mark.parametrize("marks", MARKS.values(), ids=MARKS.keys())
def test_marks_for_no_return_are_dropped_and_told(marks):
    mixed = np.random.default_rng(2).permutation(np.vstack([BALL, marks]))
    found = observe(mixed, table_height=TABLE)
    expected = observe(BALL, table_height=TABLE).points
    missing = {tuple(p) for p in expected} - {tuple(p) for p in found.points}
    assert missing <= {tuple(BALL[0])}
    assert len(found.points) <= len(expected)
    assert any("no return" in note or "same as many others" in note for note in found.notes)


def test_points_that_a_table_may_have_are_no_marks():
    top = np.c_[np.random.default_rng(3).uniform(-0.03, 0.03, (400, 2)), np.full(400, 0.12)]
    table = np.c_[np.random.default_rng(4).uniform(-0.03, 0.03, (40, 2)), np.zeros(40)]
    for given in (None, TABLE):
        found = observe(np.vstack([top, table, BALL]), table_height=given)
        assert not any("no return" in note for note in found.notes)
        assert found.points[:, 2].max() == 0.12
    found = observe(np.vstack([top, table]), table_height=TABLE)
    assert not any("no return" in note for note in found.notes)
    assert found.points[:, 2].max() == 0.12


def test_few_equal_points_are_no_mark_but_copies():
    found = observe(np.vstack([BALL, BALL, BALL[:5]]), table_height=TABLE)
    assert found.notes[0] == "Dropped 605 of 1205 points that are copies of others."
    np.testing.assert_array_equal(found.points, observe(BALL, table_height=TABLE).points)


def test_an_organised_cloud_keeps_what_is_measured():
    grid = np.full((6000, 3), np.nan)
    grid[::10] = BALL
    found = observe(grid.reshape(60, 100, 3), table_height=TABLE)
    assert found.notes[:2] == (
        "Took 'points' of shape (60, 100, 3) for 6000 points.",
        "Dropped 5400 of 6000 points that are NaN or infinite.",
    )
    np.testing.assert_array_equal(found.points, observe(BALL, table_height=TABLE).points)


@pytest.mark.parametrize(("step", "refused"), [(0.001, False), (0.01, False), (0.02, True)])
def test_coordinates_that_are_rounded_too_far_are_refused(step, refused):
    rounded = np.round(ball(3000, 0.08) / step) * step
    if not refused:
        observe(rounded, table_height=TABLE)
        return
    with pytest.raises(InputError, match="its coordinates are rounded to 20 mm"):
        observe(rounded, table_height=TABLE)


def test_whole_millimetres_are_told_by_their_width_and_not_by_their_steps():
    with pytest.raises(InputError, match=r"m wide, more than 0.5 m; is it in mm \(--scale 0.001\)"):
        observe(np.round(1000 * ball(3000, 0.08)))


def test_32_bits_far_from_the_origin_are_refused_and_64_are_not():
    offset = np.array([694386.212, 5155487.512, 381.036])
    far = BALL + offset
    near = observe(BALL, table_height=TABLE)
    found = observe(far, table_height=381.036)
    np.testing.assert_allclose(found.points - offset, near.points, atol=2e-9)
    with pytest.raises(InputError, match="too far from the origin for 32-bit numbers"):
        observe(far.astype(np.float32))
    with pytest.raises(InputError, match="rounded to 512 mm"):
        observe((1000 * far).astype(np.float32), scale=0.001)


@pytest.mark.parametrize(("factor", "units"), [(1e3, "in mm (--scale 0.001)"), (1e2, "in cm (--scale 0.01)"),
                                               (1 / 0.0254, "in inches (--scale 0.0254)")])  # fmt: skip
def test_the_scale_of_a_cloud_in_another_unit_is_said(factor, units):
    with pytest.raises(InputError) as caught:
        observe(factor * BALL)
    assert units in str(caught.value)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_flat_top_is_closed_by_a_table_that_is_given_alone(slope):
    x, y = (g.ravel() for g in np.meshgrid(np.linspace(-0.03, 0.03, 40), np.linspace(-0.03, 0.03, 40)))
    top = np.c_[x, y, 0.05 + slope * x]
    assert len(observe(top, table_height=TABLE).points) > 1400
    with pytest.raises(InputError, match=r"one plane; .* if it is the top of a body, give --table-height"):
        observe(top)


def test_a_camera_below_the_table_is_refused_with_the_flags_that_turn_a_cloud():
    with pytest.raises(InputError, match=r"a camera at z = -0.500 m is below the table .*--pose.*--up"):
        observe(BALL, table_height=TABLE, view=np.zeros(600, int), camera_positions=[[0.3, 0.0, -0.5]])


@pytest.mark.parametrize("up", ["x", "y", "z", "minus-x", "minus-y", "minus-z"])
def test_an_axis_that_points_up_is_turned_to_z(tmp_path, up):
    from sgnlp import load

    axis, sign = "xyz".index(up[-1]), -1.0 if "-" in up else 1.0
    turned = np.roll(BALL, axis - 2, axis=1) * [sign if i == axis else 1.0 for i in range(3)]
    np.savez(tmp_path / "c.npz", points=turned, table_height=-0.001)
    found = load(tmp_path / "c.npz", up=up)
    np.testing.assert_allclose(np.sort(found.points[:, 2]), np.sort(observe(BALL, table_height=-0.001).points[:, 2]))
    distances = np.linalg.norm(found.points - found.points[0], axis=1)
    assert distances.max() < 0.081  # nothing is stretched
    assert found.reading.up == up


def test_a_pose_turns_points_cameras_and_mesh_but_no_height(tmp_path):
    from sgnlp import load

    a = 0.7
    pose = np.array([[np.cos(a), 0, np.sin(a), 0.3], [0, 1, 0, -0.2], [-np.sin(a), 0, np.cos(a), 0.5], [0, 0, 0, 1]])
    back = lambda points: (np.asarray(points) - pose[:3, 3]) @ pose[:3, :3]  # noqa: E731
    arrays = {"camera_positions": back([[0.4, 0, 0.5]]), "mesh_vertices": back(np.eye(3)), "mesh_faces": [[0, 1, 2]]}
    np.savez(tmp_path / "c.npz", points=back(BALL), table_height=9.0, **arrays)
    found = load(tmp_path / "c.npz", pose=pose.ravel().tolist())
    np.testing.assert_allclose(found.camera_positions, [[0.4, 0, 0.5]], atol=1e-12)
    np.testing.assert_allclose(found.mesh_vertices, np.eye(3), atol=1e-12)
    assert found.table_height == pytest.approx(observe(BALL).table_height)
    assert "Ignored the table's height in the file: it is not in the world's frame." in found.notes
    for wrong, message in ((2 * pose, "a rotation matrix"), (pose[:3], "16 numbers")):
        with pytest.raises(InputError, match=message):
            load(tmp_path / "c.npz", pose=wrong.ravel().tolist())
    with pytest.raises(InputError, match="not both"):
        load(tmp_path / "c.npz", pose=pose.ravel().tolist(), up="y")
