"""Write what a depth camera on a robot would measure of 1 to 4 bodies on a table: scene.png, and K in camera.json."""

import json
import sys
from pathlib import Path

import numpy as np
import open3d

import sgnlp
from sgnlp.perception.synthetic.cameras import DepthCamera, image, looking_at
from sgnlp.perception.synthetic.meshes import Mesh

PLACES = [(-0.05, 0.14), (0.08, 0.02), (-0.08, -0.04), (0.05, -0.17)]  # [m] of the bodies on the table
EYE, TARGET = np.array([-0.5, -0.05, 0.45]), np.array([0.0, 0.0, 0.03])

if not 1 <= len(sys.argv[1:]) <= len(PLACES):
    sys.exit(f"usage: python {sys.argv[0]} PROBLEM.npz ...: one to {len(PLACES)} files of problems/")
camera, rng = DepthCamera(), np.random.default_rng(0)
axes = looking_at(EYE, TARGET)  # columns: x right, y down, z ahead, in the world
directions = camera.rays() @ axes.T
depth, cosine = np.full(directions.shape[:2], np.inf), np.ones(directions.shape[:2])
for file, place in zip(sys.argv[1:], PLACES, strict=False):
    problem = sgnlp.load(file)
    seen = image(Mesh(problem.mesh_vertices, problem.mesh_faces).standing(place), EYE, directions)
    cosine = np.where(seen.depth < depth, seen.cosine, cosine)
    depth = np.minimum(seen.depth, depth)
measured = camera.measured(camera.flying(depth, rng), cosine, rng)
millimetres = np.nan_to_num(np.round(1000 * measured)).astype(np.uint16)  # 0 where nothing came back
open3d.io.write_image("scene.png", open3d.geometry.Image(millimetres))
Path("camera.json").write_text(json.dumps({"K": camera.intrinsics.tolist()}), encoding="utf-8")
