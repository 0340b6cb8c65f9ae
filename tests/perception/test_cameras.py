"""The simulated depth cameras: geometry, and each of their errors."""

from dataclasses import replace

import numpy as np
import pytest
from box import BOX

from sgnlp.base.errors import InputError
from sgnlp.perception.synthetic.cameras import DepthCamera, image, looking_at, miscalibrated, view
from sgnlp.perception.synthetic.meshes import Mesh

CAMERA = DepthCamera()
POSITION, TARGET = np.array([0.35, -0.2, 0.4]), np.array([0.0, 0.0, 0.04])
RAYS = CAMERA.rays() @ looking_at(POSITION, TARGET).T


def test_the_camera_looks_at_its_target_with_the_image_upright():
    rotation = looking_at(POSITION, TARGET)
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)
    distance = np.linalg.norm(TARGET - POSITION)
    np.testing.assert_allclose(rotation.T @ (TARGET - POSITION), [0, 0, distance], atol=1e-12)
    assert rotation[2, 1] < 0  # the image's y points down
    assert rotation[2, 0] == pytest.approx(0, abs=1e-12)  # its x is level


def test_the_rays_span_the_field_of_view():
    assert CAMERA.rays().shape == (480, 640, 3)
    widest = np.degrees(np.arctan(np.abs(CAMERA.rays()).max(axis=(0, 1))))
    assert widest[:2] == pytest.approx([25, 19.3], abs=0.1)
    assert np.degrees(CAMERA.half_angle) == pytest.approx(19.3, abs=0.1)


def test_an_image_holds_the_true_depths_of_body_and_table():
    assert BOX.open_edges == 0
    seen = image(BOX, POSITION, RAYS)
    points = POSITION + seen.depth[..., None] * RAYS
    np.testing.assert_allclose(points[~seen.body & np.isfinite(seen.depth)][:, 2], 0, atol=1e-12)
    body = points[seen.body]
    assert 5000 < len(body) < 20000
    planes = np.abs(np.column_stack([body[:, :2] - 0.04, body[:, :2] + 0.04, body[:, 2] - 0.08]))
    assert planes.min(axis=1).max() < 1e-6  # each point is on one of the box's sides
    upward = seen.body & (np.abs(points[..., 2] - 0.08) < 1e-6)
    ray = RAYS[upward] / np.linalg.norm(RAYS[upward], axis=1, keepdims=True)
    np.testing.assert_allclose(seen.cosine[upward], -ray[:, 2], atol=1e-5)


def test_the_faces_of_an_open_mesh_are_seen_from_behind_too():
    lid = Mesh(BOX.vertices, BOX.faces[[2, 3]])
    turned = Mesh(lid.vertices, lid.faces[:, ::-1])
    one, two = image(lid, POSITION, RAYS), image(turned, POSITION, RAYS)
    assert one.body.sum() > 2000
    np.testing.assert_array_equal(one.body, two.body)
    np.testing.assert_allclose(one.cosine, two.cosine, atol=1e-6)


def test_the_depth_noise_follows_its_formula():
    rng = np.random.default_rng(0)
    for depth, cosine in [(0.55, 1.0), (1.1, 1.0), (0.55, 0.5)]:
        true = np.full((480, 640), depth)
        measured = CAMERA.measured(true, np.full_like(true, cosine), rng)
        valid = np.isfinite(measured)
        assert valid.mean() == pytest.approx(1 - CAMERA.dropout_share, abs=0.01)
        expected = depth**2 * 0.08 / (CAMERA.focal_length * 0.055) / cosine
        assert np.std(measured[valid]) == pytest.approx(expected, rel=0.02)
        assert np.mean(measured[valid]) == pytest.approx(depth, abs=1e-5)
        steps = measured[valid] / CAMERA.depth_unit
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert np.isnan(CAMERA.measured(true, np.full_like(true, 0.1), rng)).all()


def test_what_is_lost_is_lost_in_whole_blocks():
    block = CAMERA.dropout_block
    measured = CAMERA.measured(np.full((480, 640), 0.5), np.ones((480, 640)), np.random.default_rng(1))
    blocks = np.isnan(measured).reshape(480 // block, block, 640 // block, block).swapaxes(1, 2)
    assert np.isin(blocks.sum(axis=(2, 3)), [0, block**2]).all()


def test_a_share_of_the_pixels_at_an_edge_flies_a_little_behind_it():
    depth = np.full((480, 640), 0.8)
    depth[:, :320] = 0.5  # the edge is 480 pixels long
    depth[:240, 320:] = 0.5 + 0.02
    flown = CAMERA.flying(depth, np.random.default_rng(0)) - depth
    assert flown.min() == 0  # nothing comes nearer
    assert (flown[:, np.r_[:319, 320:640]] == 0).sum() >= 480 * 639 - 320  # only at edges, one of them level
    edge = flown[:, 319]
    assert np.mean(edge > 0) == pytest.approx(CAMERA.flying_share, abs=0.05)
    assert edge[:240].max() == pytest.approx(0.02, abs=0.002)  # as far as the next surface
    assert edge[240:].max() == pytest.approx(CAMERA.flying_reach, abs=0.002)  # or its reach
    assert np.all(CAMERA.flying(np.linspace(0.5, 0.6, 480)[:, None] * np.ones(640), np.random.default_rng(0)) < 0.6001)


def test_a_view_is_the_body_seen_with_all_errors():
    rng = np.random.default_rng(0)
    seen = image(BOX, POSITION, RAYS)
    cloud = view(BOX, CAMERA, POSITION, TARGET, rng)
    expected = (1 - CAMERA.dropout_share) * seen.body.sum()
    assert len(cloud) == pytest.approx(expected, rel=0.03)
    exact = replace(CAMERA, subpixel_error=0.0, dropout_share=0.0, flying_share=0.0, depth_unit=1e-9)
    cloud = view(BOX, exact, POSITION, TARGET, rng)
    np.testing.assert_allclose(cloud, (POSITION + seen.depth[..., None] * RAYS)[seen.body], atol=1e-8)


def test_a_miscalibration_is_rigid_and_as_large_as_asked_for():
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.05, 0.05, (50, 3))
    for _ in range(20):
        moved = miscalibrated(points, (0.001, 0.002), 0.2, np.zeros(3), rng)
        before, after = (np.linalg.norm(p[:, None] - p, axis=-1) for p in (points, moved))
        np.testing.assert_allclose(after, before, atol=2e-6)
        shift = np.linalg.norm(miscalibrated(np.zeros((1, 3)), (0.001, 0.002), 0.2, np.zeros(3), rng))
        assert 0.001 <= shift <= 0.002


@pytest.mark.parametrize(
    ("setting", "value", "message"),
    [
        ("width", 0, "--camera.width must be between 1 and 4096, not 0"),
        ("flying_share", 1.5, "--camera.flying-share must be between 0 and 1"),
        ("depth_unit", 0.0, "--camera.depth-unit must be positive"),
        ("baseline", float("nan"), "--camera.baseline must be a finite number"),
    ],
)
def test_a_camera_out_of_range_is_refused(setting, value, message):
    with pytest.raises(InputError, match=message):
        DepthCamera(**{setting: value})
