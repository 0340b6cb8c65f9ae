"""Files of cameras: those of other programs are the same camera as ours, or are refused by name."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from sgnlp.base.errors import InputError
from sgnlp.perception import camera_files

K = np.array([[340.0, 0, 159.5], [0, 341.0, 119.5], [0, 0, 1]])
FLAT = K.ravel().tolist()
POSE = np.array([[0.0, -0.6, -0.8, 0.5], [1, 0, 0, 0.1], [0, -0.8, 0.6, 0.4], [0, 0, 0, 1]])
INVERSE = np.linalg.inv(POSE)
ROWS = POSE.tolist()
SIZE = {"width": 320, "height": 240}
OPEN3D = {
    "class_name": "PinholeCameraParameters",
    "extrinsic": INVERSE.T.ravel().tolist(),
    "intrinsic": SIZE | {"intrinsic_matrix": K.T.ravel().tolist()},
}
ROS2 = SIZE | {"d": [0.0] * 5, "k": FLAT, "p": np.c_[K, [0, 0, 0]].ravel().tolist(), "pose": ROWS}
ROS1 = SIZE | {"D": [0.0] * 5, "K": FLAT, "P": np.c_[K, [0, 0, 0]].ravel().tolist(), "pose": ROWS}
MANAGER = {
    "image_width": 320,
    "image_height": 240,
    "camera_matrix": {"rows": 3, "cols": 3, "data": FLAT},
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": [0.0] * 5},
    "pose": {"rows": 4, "cols": 4, "data": POSE.ravel().tolist()},
}
REALSENSE = SIZE | {"fx": 340, "fy": 341, "ppx": 159.5, "ppy": 119.5, "coeffs": [0.0] * 5, "pose": ROWS}
BOP = {
    "cam_K": FLAT,
    "cam_R_w2c": INVERSE[:3, :3].ravel().tolist(),
    "cam_t_w2c": (1000 * INVERSE[:3, 3]).tolist(),
    "depth_scale": 0.1,
}

OPENCV = """%YAML:1.0
---
calibration_time: "Mon 30 Nov 2026 09:12:44"
nframes: 13
image_width: 320
image_height: 240
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 3.4000000000000000e+02, 0., 1.5950000000000000e+02, 0.,
       3.4100000000000000e+02, 1.1950000000000000e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ 0., 0., 0., 0., 0. ]
avg_reprojection_error: 2.1e-01
pose: !!opencv-matrix
   rows: 4
   cols: 4
   dt: d
   data: [ 0., -0.6, -0.8, 0.5, 1., 0., 0., 0.1, 0., -0.8, 0.6, 0.4, 0., 0., 0., 1. ]
"""
OLD_OPENCV = OPENCV.replace("---\n", "").replace("camera_matrix", "Camera_Matrix").replace(
    "distortion_coefficients", "Distortion_Coefficients"
)  # fmt: skip


@pytest.fixture
def read(tmp_path):
    """Write a content to a file and read it as a camera of the image '000012'."""

    def reading(content: object, suffix: str = ".json") -> camera_files.Camera:
        text = content if isinstance(content, str) else (json.dumps if suffix == ".json" else yaml.safe_dump)(content)
        path = Path(tmp_path, f"camera{suffix}")
        path.write_text(text, encoding="utf-8")
        return camera_files.read(path, "000012")

    return reading


@pytest.mark.parametrize("suffix", [".json", ".yaml"])
@pytest.mark.parametrize(
    "content",
    [
        {"K": FLAT, "pose": ROWS},
        {"K": K.tolist(), "pose": POSE.ravel().tolist()},
        {"K": {"fx": 340, "fy": 341, "cx": 159.5, "cy": 119.5}, "pose": ROWS},
        {"intrinsics": SIZE | {"fx": 340, "fy": 341, "cx": 159.5, "cy": 119.5}, "pose": ROWS},
        {"intrinsics": K.tolist(), "pose": ROWS},
        OPEN3D,
        OPEN3D | {"extrinsic": INVERSE.ravel().tolist()},
        OPEN3D["intrinsic"] | {"pose": ROWS},
        ROS2,
        ROS2 | {"d": []},
        ROS1,
        MANAGER,
        REALSENSE,
        BOP,
        {"0": BOP},
        {"7": {}, "12": BOP},
        {"000012": {"K": FLAT, "pose": ROWS}, "000013.png": {"K": FLAT, "pose": np.eye(4).tolist()}},
        {"left": {"K": FLAT, "pose": ROWS}},
        {"K": FLAT, "camera_matrix": FLAT, "pose": ROWS},
        ROS2 | {"binning_x": 1, "binning_y": 0, "roi": {"x_offset": 0, "y_offset": 0, "width": 320}},
        OPEN3D | {"pose": None},
        OPEN3D | {"pose": ROWS},
    ],
)
def test_every_kind_of_file_is_the_same_camera(read, content, suffix):
    found = read(content, suffix)
    np.testing.assert_array_equal(found.intrinsics, K)
    np.testing.assert_allclose(found.pose, POSE, atol=1e-15)
    assert found.size in (None, (320, 240))
    assert ("width" in content or "image_width" in content) <= (found.size is not None)
    assert any("world to camera" in note for note in found.notes) == (
        content.get("pose") is None and ("cam_K" in str(content) or "extrinsic" in content)
    )


@pytest.mark.parametrize("content", [OPENCV, OLD_OPENCV, OPENCV.replace("%YAML:1.0", "%YAML 1.0"), OPENCV.replace(
    "image_width", "image_Width").replace("image_height", "image_Height")])  # fmt: skip
def test_what_opencv_writes_is_the_same_camera_and_no_other_tag_is_constructed(read, content):
    found = read(content, ".yml")
    np.testing.assert_array_equal(found.intrinsics, K)
    np.testing.assert_array_equal(found.pose, POSE)
    assert found.size == (320, 240)
    with pytest.raises(InputError, match="is not the JSON or YAML of a camera: could not determine a constructor"):
        read(content.replace("!!opencv-matrix", "!!python/object:os.system"), ".yml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("data: [ 0., 0., 0., 0., 0. ]", "data: [ 0.1, 0., 0., 0., 0. ]", "lens distortion '.istortion_.oefficients'"),
        ("rows: 3", "rows: 2", "'.amera_.atrix' must have rows x cols numbers, 2 x 3; found 9"),
        ("3.4000000000000000e+02, 0.,", "0.,", "'.amera_.atrix' must have rows x cols numbers, 3 x 3; found 8"),
        ("dt: d", "dt: d\n   dt: f", "the key 'dt' is there twice"),
        ("!!opencv-matrix\n", "!!opencv-matrix [1]\n", "is not the JSON or YAML of a camera"),
    ],
)
@pytest.mark.parametrize("content", [OPENCV, OLD_OPENCV])
def test_a_calibration_of_opencv_that_cannot_be_used_is_refused(read, content, old, new, message):
    with pytest.raises(InputError, match=message) as told:
        read(content.replace(old, new), ".yaml")
    assert len(str(told.value).splitlines()) == 1


def test_what_open3d_writes_is_read(tmp_path):
    camera = pytest.importorskip("open3d").camera
    parameters = camera.PinholeCameraParameters()
    parameters.intrinsic, parameters.extrinsic = camera.PinholeCameraIntrinsic(320, 240, K), INVERSE
    path = tmp_path / "open3d.json"
    assert pytest.importorskip("open3d").io.write_pinhole_camera_parameters(str(path), parameters)
    found = camera_files.read(path, "depth")
    np.testing.assert_allclose(found.intrinsics, K)
    np.testing.assert_allclose(found.pose, POSE, atol=1e-12)


def test_three_rows_of_a_pose_are_read(read):
    np.testing.assert_array_equal(read({"K": FLAT, "pose": ROWS[:3]}).pose, POSE[:3])
    np.testing.assert_array_equal(read({"K": FLAT, "pose": POSE[:3].ravel().tolist()}).pose, POSE[:3])


def test_a_scale_of_depths_is_used_where_its_meaning_is_known(read):
    assert read(BOP).unit == pytest.approx(1e-4)
    found = read(REALSENSE | {"depth_scale": 0.00025})
    assert found.unit is None
    assert found.notes == ("Did not use 'depth_scale', 0.00025, of the camera's file; see --unit.",)


def test_a_stream_of_messages_is_its_first(read):
    np.testing.assert_array_equal(read(yaml.safe_dump(ROS2) + "---\n", ".yaml").intrinsics, K)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({}, "the key 'K' is missing; a camera has K and pose, Open3D's"),
        ({"fx": 1, "fy": 1, "cx": 1, "pose": ROWS}, "the key 'cy' is missing"),
        ({"K": FLAT}, r"the key 'pose' is missing: the 16 numbers of the matrix from the camera's \(optical\) frame"),
        (OPEN3D["intrinsic"], "the key 'pose' is missing"),
        ({"parameters": [OPEN3D, OPEN3D]}, "is a trajectory of 2 cameras"),
        ({"frames": [], "camera_angle_x": 0.8}, "has 'transform_matrix' with OpenGL's axes"),
        ({"1": BOP, "2": BOP}, "has the cameras of 2 images, none of which is '000012'"),
        (ROS2 | {"d": [0.1, 0, 0, 0, 0]}, "the lens distortion 'd' is not zero, but images must be rectified"),
        (ROS1 | {"D": [0.1]}, "the lens distortion 'D' is not zero"),
        (MANAGER | {"distortion_coefficients": {"data": [0.1]}}, "the lens distortion 'distortion_coefficients'"),
        (REALSENSE | {"coeffs": [0.1]}, "the lens distortion 'coeffs' is not zero"),
        ({"K": FLAT, "pose": [0, 0, 0, 0, 0, 0, 1]}, "'pose' has a quaternion; give the matrix"),
        ({"K": FLAT, "pose": {"position": {}, "orientation": {}}}, "'pose' has a quaternion"),
        ({"K": FLAT, "pose": [0, 0, 0, 0, 0, 0]}, r"'pose' must have the 16 numbers of .*; found 6"),
        ({"K": [[1, 2], [3]], "pose": ROWS}, "'K' must be an array of real numbers; its rows differ in length"),
        (ROS2 | {"height": None}, "'height' must be an array of real numbers"),
        ({"K": FLAT, "pose": ROWS, "width": 320}, "has 'width' alone; give both 'width' and 'height', or neither"),
        ({"K": FLAT, "pose": ROWS, "image_height": 240}, "has 'image_height' alone"),
        ("<?xml version='1.0'?><opencv_storage>", "is XML; save it as YAML"),
        ({"K": "abc", "pose": ROWS}, "'K' must be an array of real numbers"),
        ({"K": FLAT, "pose": ROWS, "width": "w", "height": 1}, "'width' must be an array of real numbers"),
        ([1], "is not the JSON or YAML of a camera, which has"),
        ("", "is not the JSON or YAML of a camera"),
        ("{", "is not the JSON or YAML of a camera"),
        ('{"K": 1, "pose": 2, "pose": 3}', "the key 'pose' is there twice"),
        (ROS2 | {"distortion": {"k1": 0.1}}, "the lens distortion 'k1' is not zero"),
        ({"pose": ROWS, "intrinsics": REALSENSE | {"coeffs": [0.1]}}, "the lens distortion 'coeffs' is not zero"),
        ("{{fx}: 1}", "is not the JSON or YAML of a camera"),
        (ROS2 | {"k1": 0.1}, "the lens distortion 'k1' is not zero"),
        ({"K": FLAT, "pose": np.eye(4).tolist(), **OPEN3D}, "'pose' and 'extrinsic' are different poses of the camera"),
        ({"K": FLAT, "camera_matrix": (2 * K).tolist(), "pose": ROWS}, "'K' and 'camera_matrix' are different intrin"),
        ({"K": FLAT, "pose": None}, "the key 'pose' is missing: the 16 numbers"),
        ({"K": None, "pose": ROWS}, "the key 'K' is missing"),
        ({"K": [340, 341, 159.5, 119.5], "pose": ROWS}, "'K' has 4 numbers; give the 9 of"),
        ({"K": FLAT, "R": [1], "t": [2]}, "the key 'pose' is missing, and 'R' and 't' may go either way"),
        ({"K": FLAT, "T_world_cam": ROWS}, "and 'T_world_cam' may go either way"),
        (ROS2 | {"binning_x": 2, "binning_y": 2}, "has 'binning_x' of 2, and in ROS K is that of the whole sensor"),
        (ROS2 | {"roi": {"x_offset": 100, "y_offset": 50}}, "has a 'roi' from 100, 50 on"),
        ({"a": ROS2, "b": ROS2}, "has the cameras a, b, none of which is '000012'"),
        ("PK\x03\x04", "is an npz or a zip archive, not the JSON or YAML of a camera"),
        (ROS2 | {"distCoeffs": [0.1, 0.2]}, "the lens distortion 'distCoeffs' is not zero"),
    ],
)
@pytest.mark.parametrize("suffix", [".json", ".yaml"])
def test_what_is_no_camera_is_told(read, content, message, suffix):
    with pytest.raises(InputError, match=message) as told:
        read(content, suffix)
    assert len(str(told.value).splitlines()) == 1


def test_a_file_of_one_camera_in_a_list_and_one_in_utf_16_are_read(read, tmp_path):
    np.testing.assert_array_equal(read([{"K": FLAT, "pose": ROWS}]).intrinsics, K)
    file = tmp_path / "wide.json"
    file.write_bytes(json.dumps({"K": FLAT, "pose": ROWS}).encode("utf-16"))
    np.testing.assert_array_equal(camera_files.read(file, "0").intrinsics, K)


def test_a_mark_of_byte_order_is_no_part_of_a_file(read):
    np.testing.assert_array_equal(read("\ufeff" + json.dumps({"K": FLAT, "pose": ROWS})).intrinsics, K)


def test_a_file_that_cannot_be_opened_is_told(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        camera_files.read(tmp_path / "none.json", "")
