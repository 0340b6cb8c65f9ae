"""Write depth images of a problem's body, as two calibrated cameras on a robot would: depth, mask, intrinsics, pose."""

import json
import sys
from pathlib import Path

import numpy as np
import open3d

import sgnlp
from sgnlp.perception.synthetic.cameras import DepthCamera, image, looking_at
from sgnlp.perception.synthetic.meshes import Mesh

problem = sgnlp.load(sys.argv[1])
body, camera, rng = Mesh(problem.mesh_vertices, problem.mesh_faces), DepthCamera(), np.random.default_rng(0)
middle = (body.vertices.min(axis=0) + body.vertices.max(axis=0)) / 2
for i, place in enumerate(problem.camera_positions[:2]):
    axes = looking_at(place, middle)  # columns: x right, y down, z ahead, in the world
    seen = image(body, place, camera.rays() @ axes.T)
    depth = camera.measured(camera.flying(seen.depth, rng), seen.cosine, rng)
    millimetres = np.nan_to_num(np.round(1000 * depth)).astype(np.uint16)  # 0 where nothing came back
    open3d.io.write_image(f"depth_{i}.png", open3d.geometry.Image(millimetres))
    open3d.io.write_image(f"mask_{i}.png", open3d.geometry.Image(255 * seen.body.astype(np.uint8)))
    pose = np.block([[axes, place[:, None]], [np.zeros(3), 1.0]])
    Path(f"camera_{i}.json").write_text(
        json.dumps({"K": camera.intrinsics.tolist(), "pose": pose.tolist()}), encoding="utf-8"
    )
