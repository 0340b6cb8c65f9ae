"""The table around an object must lie level: what wrong intrinsics and poses do to it, and what noise does not."""

from dataclasses import replace

import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.perception import level
from sgnlp.perception.depth import DepthImage, arrays
from sgnlp.perception.synthetic.cameras import DepthCamera, Image, image, looking_at
from sgnlp.perception.synthetic.meshes import Mesh

CAMERA = DepthCamera(width=160, height=120)
K = CAMERA.intrinsics
EYE, TARGET = np.array([0.35, 0.1, 0.4]), np.array([0.0, 0.0, 0.04])
AXES = looking_at(EYE, TARGET)
POSE = np.block([[AXES, EYE[:, None]], [np.zeros(3), 1.0]])
TETRAHEDRON = Mesh(
    0.1 * np.array([[0.5, 0, 0], [-0.5, 0.5, 0], [-0.5, -0.5, 0], [0.0, 0, 1]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
)
SEEN: Image = image(TETRAHEDRON, EYE, CAMERA.rays() @ AXES.T)
SHOT = DepthImage(SEEN.depth, SEEN.body, K, POSE)
OPENGL = np.diag([1.0, -1, -1, 1])
BODY = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # optical axes in x ahead, z up
Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def tilt(shot: DepthImage) -> float:
    """Of the largest plane around the object [deg]."""
    world = shot.points()
    around = level.around(shot.mask) & np.isfinite(world[..., 2])
    return level.planes(world[around], np.asarray(shot.pose)[:3, 3])[0].tilt


def test_a_level_table_is_found_level_without_noise_and_with_it():
    assert tilt(SHOT) < 1e-3
    rng = np.random.default_rng(0)
    for _ in range(5):
        noisy = CAMERA.measured(CAMERA.flying(SEEN.depth, rng), SEEN.cosine, rng)
        assert tilt(replace(SHOT, depth=noisy)) < 0.3  # a tenth of the threshold, of a hundredth of the pixels


def test_the_tilt_of_a_table_is_that_by_which_the_camera_is_turned():
    for degrees in (2.0, 5.0, 30.0):
        c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
        turn = np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])
        assert tilt(replace(SHOT, pose=turn @ POSE)) == pytest.approx(degrees, abs=1e-3)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (POSE @ OPENGL, "above the camera, which sees its underside: the pose has OpenGL axes"),
        (np.linalg.inv(POSE), "but the table is level: the pose has an inverse, world to camera"),
        (np.linalg.inv(POSE @ OPENGL), "but the table is level: the pose has an inverse with OpenGL axes"),
        (POSE @ np.linalg.inv(BODY), "but the table is level: the pose has the body's axes"),
        (Y_UP @ POSE, "is tilted by 90.0 deg, .* the pose has a world whose y is up"),
        (np.eye(4), "but the table is level: look at K, the pose and which stream"),
    ],
)
def test_a_pose_of_another_convention_is_refused_by_its_name(pose, message):
    with pytest.raises(InputError, match=rf"image '0': 100% of the pixels around the object .*{message}"):
        arrays([replace(SHOT, pose=pose)])
    with pytest.raises(InputError, match=message):
        arrays([replace(SHOT, pose=pose)], table_height=0.0)


@pytest.mark.parametrize("factor", [0.72, 1.5])
def test_intrinsics_of_another_stream_are_remarked_upon(factor):
    notes = arrays([replace(SHOT, intrinsics=K * [[factor], [factor], [1]])])["notes"]
    assert any("more than 3, but the table is level: look at K" in note for note in notes), notes


def test_a_refusal_says_what_else_is_odd_of_the_intrinsics():
    corner = K * [[1, 1, 0], [1, 1, 0], [1, 1, 1]]
    with pytest.raises(
        InputError, match=r"but the table is level: look at K.*\. cx, cy = 0, 0 lie 50% of the image off"
    ):
        arrays([replace(SHOT, intrinsics=corner)])


def test_depths_along_the_rays_are_told_by_the_bent_table_and_true_ones_are_not():
    along = np.linalg.norm(CAMERA.rays(), axis=-1)
    noise = np.random.default_rng(0).normal(0, 0.002, SHOT.depth.shape)
    for more in (0.0, noise):
        told = arrays([replace(SHOT, depth=SHOT.depth * along + more)])["notes"]
        assert [note for note in told if note.startswith("The table is bent: 5")]
        assert not [note for note in arrays([replace(SHOT, depth=SHOT.depth + more)])["notes"] if "bent" in note]


def test_a_wrong_pose_is_refused_with_depths_along_the_rays_too():
    along = np.linalg.norm(CAMERA.rays(), axis=-1)
    with pytest.raises(InputError, match="the pose has OpenGL axes"):
        arrays([replace(SHOT, depth=SHOT.depth * along, pose=POSE @ OPENGL)])


def test_a_wall_that_fills_most_of_the_image_is_no_tilted_table():
    world = SHOT.points()
    rays = (world - EYE) / np.asarray(SHOT.depth)[..., None]
    with np.errstate(divide="ignore"):
        wall = np.where(rays[..., 0] < 0, (-0.06 - EYE[0]) / rays[..., 0], np.inf)  # the plane x = -0.06
    depth = np.where(SHOT.mask, SHOT.depth, np.minimum(SHOT.depth, wall))
    behind = replace(SHOT, depth=np.where((world[..., 0] > 0.02) & ~np.asarray(SHOT.mask), 0, depth))
    assert tilt(behind) == pytest.approx(90, abs=1)
    assert len(arrays([behind])["notes"]) == 1


def test_a_tilted_plane_of_few_pixels_is_not_refused():
    rng = np.random.default_rng(0)
    slope = np.column_stack([rng.uniform(-0.1, 0.1, (2000, 2)), np.zeros(2000)])
    slope[:, 2] = 0.5 * slope[:, 0]
    clutter = rng.uniform([-0.1, -0.1, 0], [0.1, 0.1, 0.2], (3000, 3))
    assert level.check(np.vstack([slope, clutter]), POSE)[0].endswith("which stream they are of.")
    with pytest.raises(InputError, match=r"is tilted by 26\.\d deg"):
        level.check(slope, POSE)


def test_where_nothing_was_measured_around_nothing_is_checked():
    bare = replace(SHOT, depth=np.where(SHOT.mask, SHOT.depth, 0.0))
    assert "neither pose nor intrinsics could be checked" in arrays([bare])["notes"][0]
    clutter = np.random.default_rng(0).uniform([-0.2, -0.2, 0], [0.2, 0.2, 0.4], (2000, 3))
    assert "neither pose nor intrinsics could be checked" in level.check(clutter, POSE)[0]


def test_the_pixels_around_depend_on_the_mask_alone():
    mask = np.zeros((40, 60), bool)
    mask[10:14, 20:30] = True
    v, u = np.nonzero(level.around(mask))
    assert (v.min(), v.max(), u.min(), u.max()) == (0, 23, 10, 39)
    assert not (level.around(mask) & mask).any()
