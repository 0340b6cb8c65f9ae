"""Make the problem files: parametric bodies on a table, seen by three simulated depth cameras.

    python problems/make.py [NAME ...] [--seed S] [--out DIR]

Writes <name>.npz with `points` (N, 3), `view` (N,), `camera_positions` (3, 3), `table_height`, `name` and the
true surface, `mesh_vertices` (U, 3) and `mesh_faces` (F, 3); metres, z up, the table at z = 0. The same seed gives
the same bytes. The clouds are cut off at `CROP` above the table, as one removes a table from a real cloud.
"""

import argparse
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bodies
import numpy as np
from bodies import Mesh
from cameras import DepthCamera, miscalibrated, ring, view

DISTANCE = 0.55  # [m] of the cameras from the target
ELEVATION_DEG = 45.0
AZIMUTH_DEG = -10.0  # of the first camera; the others follow at 120 and 240 degrees
CAMERAS = 3
TARGET = np.array([0.0, 0.0, 0.05])  # [m] where the cameras look
SHIFT = (0.001, 0.002)  # [m] each camera's calibration is off by this much, two of them by up to twice that
TURN_DEG = 0.2
CROP = 0.003  # [m] measured points lower than this go with the table
POINTS_PER_VIEW = 4000
RESOLUTION = 1e-5  # [m] of the stored points

CATALOGUE: dict[str, Callable[[], Mesh]] = {
    "ball": lambda: bodies.ball(radius=0.0365).placed(0),
    "banana": lambda: bodies.banana(bend=0.1, radius=0.018, half_angle_deg=52).placed(35),
    "bottle": lambda: bodies.bottle(radius=0.034, neck=0.014, height=0.19).placed(0),
    "box": lambda: bodies.box(length=0.095, width=0.06, height=0.13).placed(20),
    "can": lambda: bodies.can(radius=0.033, height=0.115, bevel=0.003).placed(0),
    "mug": lambda: bodies.mug(radius=0.04, height=0.09, wall=0.004, reach=0.028).placed(-60),
    "pyramid": lambda: bodies.pyramid(side=0.08, height=0.06).placed(15),
    "spam": lambda: bodies.box(length=0.098, width=0.058, height=0.084, corner=0.012, edge=0.005).placed(70),
}


def problem(name: str, seed: int, camera: DepthCamera | None = None) -> dict[str, Any]:
    """The arrays of one problem file."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    mesh = CATALOGUE[name]()
    positions = ring(CAMERAS, DISTANCE, ELEVATION_DEG, AZIMUTH_DEG, TARGET)
    clouds = []
    for position in positions:
        cloud = view(mesh, camera or DepthCamera(), position, TARGET, rng)
        cloud = miscalibrated(cloud, SHIFT, TURN_DEG, TARGET, rng)
        cloud = cloud[cloud[:, 2] > CROP]
        chosen = rng.permutation(len(cloud))[:POINTS_PER_VIEW]
        clouds.append(cloud[np.sort(chosen)])
    points = np.round(np.concatenate(clouds) / RESOLUTION) * RESOLUTION
    return {
        "points": points.astype(np.float32),
        "view": np.repeat(np.arange(CAMERAS, dtype=np.int8), [len(cloud) for cloud in clouds]),
        "camera_positions": positions,
        "table_height": np.array(0.0),
        "name": np.array(name),
        "mesh_vertices": mesh.vertices.astype(np.float32),
        "mesh_faces": mesh.faces.astype(np.int32),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Make the problem files.")
    parser.add_argument("names", nargs="*", default=sorted(CATALOGUE), help="which (default: all)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    options = parser.parse_args()
    for name in options.names:
        if name not in CATALOGUE:
            parser.error(f"unknown problem '{name}'; valid: {', '.join(sorted(CATALOGUE))}")
    for name in options.names:
        arrays = problem(name, options.seed)
        file = options.out / f"{name}.npz"
        np.savez_compressed(file, **arrays)
        size = np.ptp(arrays["mesh_vertices"], axis=0) * 1e3
        print(f"{file}: {' x '.join(f'{s:.0f}' for s in size)} mm, {len(arrays['points'])} points")


if __name__ == "__main__":
    main()
