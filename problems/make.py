"""Make the problem files: fourteen bodies, each in seven poses on a table, seen by three simulated depth cameras.

    python problems/make.py [OBJECT ...] [--settle] [--seed S] [--out DIR]

Writes OBJECT_0.npz to OBJECT_6.npz, as `sgnlp.perception.synthetic.scenes.scene` makes them, with the poses in
poses.json: the same seed gives the same bytes on one processor, and on another all but a few points, which are one
depth unit off. With --settle the poses are found first, by letting the bodies fall in MuJoCo.
"""

import argparse
import json
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any

import bodies
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.scenes import scene
from sgnlp.perception.synthetic.settling import random_orientation, settled
from sgnlp.planning import results

FOLDER = Path(__file__).parent
POSES = "poses.json"
COUNT = 7  # poses of each object
DROPS = 150
SAME_REST = 0.0015  # [m] rests whose centres of mass are equally high are of one kind
RARE = 3  # kinds that fewer drops end in are left out
MAX_WIDTH = 0.1  # [m] rests that are wider than this on every side are left out: no hand closes around them
DISTINCT_DEG = 15.0  # the least turn between two poses
SPREAD = 0.02  # [m] the body stands up to this far from the middle of the table, along x and y
FRICTION = 1.0  # between pad and body, as in the release of the paper


@dataclass(frozen=True)
class Body:
    """An object of the paper."""

    make: Callable[[], Mesh]
    mass: float  # [kg]


OBJECTS = {
    "banana": Body(lambda: bodies.banana(chord=0.178, bend=0.16, radius=0.018), 0.066),
    "box": Body(lambda: bodies.box(length=0.108, width=0.04, height=0.036), 0.08),
    "can": Body(lambda: bodies.can(radius=0.033, height=0.101, rim=0.002), 0.349),
    "car": Body(lambda: bodies.car(length=0.136, width=0.07, height=0.048, wheel=0.014), 0.09),
    "coffee": Body(lambda: bodies.coffee_bottle(radius=0.0365, neck=0.0185, height=0.207), 0.25),
    "cracker": Body(lambda: bodies.box(length=0.158, width=0.06, height=0.21), 0.411),
    "lego": Body(lambda: bodies.lego((7, 3), pitch=0.016, height=0.0495, radius=0.0047, rise=0.0045), 0.12),
    "mug": Body(lambda: bodies.mug(radius=0.04, height=0.082, wall=0.004, reach=0.031), 0.118),
    "mustard": Body(lambda: bodies.mustard_bottle(width=0.095, depth=0.058, height=0.19), 0.603),
    "orange": Body(lambda: bodies.orange(diameter=0.073, height=0.07, dimple=0.002), 0.047),
    "pear": Body(lambda: bodies.pear(diameter=0.0662, height=0.1), 0.049),
    "plane": Body(lambda: bodies.plane(length=0.12, span=0.114, height=0.046), 0.06),
    "pyramid": Body(lambda: bodies.pyramid(side=0.078, height=0.06), 0.06),
    "spam": Body(lambda: bodies.box(length=0.097, width=0.05, height=0.082, corner=0.018, edge=0.003), 0.37),
}
"""Sizes and masses of the YCB set (Calli et al. 2015, table I) for banana, can, cracker, mug, mustard, orange, pear
and spam; for the others, sizes as of the clouds released with the paper, and masses that are guesses."""

HALVES = ("tuning", "held_out")
TUNED, LATER = (0, 1), (5, 6)
"""Poses that settings were chosen with in every object, and poses that were made after the last choice."""


def half(name: str, pose: int) -> str:
    """Which half of the set a problem belongs to: choose settings on one, report on the other.

    Of the poses between, 2 is held out of every other object, 3 and 4 of the rest: 49 problems in each half. No setting
    of the package was chosen with a problem that is held out.
    """
    between = ((2,), (3, 4))[list(OBJECTS).index(name) % 2]
    return HALVES[pose not in TUNED and pose in LATER + between]


@dataclass(frozen=True)
class Pose:
    """Where a body rests."""

    quaternion: tuple[float, ...]  # (4,) x y z w
    position: tuple[float, ...]  # (2,) [m] of the middle of its box

    def turn_deg(self, other: "Pose") -> float:
        """The angle between two poses."""
        between = Rotation.from_quat(self.quaternion) * Rotation.from_quat(other.quaternion).inv()
        return float(np.rad2deg(between.magnitude()))


def placed(mesh: Mesh, pose: Pose) -> Mesh:
    """The body as it stands on the table."""
    return mesh.turned(pose.quaternion).standing(pose.position)


def narrowest(mesh: Mesh) -> float:
    """The least horizontal width [m] of a body."""
    angles = np.deg2rad(np.arange(180))
    along = mesh.vertices[:, :2] @ np.stack([np.cos(angles), np.sin(angles)])
    return float(np.ptp(along, axis=0).min())


def random(seed: int, *key: str) -> np.random.Generator:
    """A generator of its own for each object, pose and purpose."""
    return np.random.default_rng([seed, zlib.crc32(" ".join(key).encode())])


def rests(mesh: Mesh, rng: np.random.Generator) -> list[list[Pose]]:
    """How a body comes to rest from random orientations, by kind of rest, the most frequent kind first."""
    kinds: dict[int, list[Pose]] = defaultdict(list)
    heights: list[float] = []  # [m] of the centre of mass, one of each kind
    for _ in range(DROPS):
        quaternion = settled(mesh, random_orientation(rng))
        position = rng.uniform(-SPREAD, SPREAD, 2)
        if quaternion is None:
            continue
        pose = Pose(tuple(np.round(quaternion, 7).tolist()), tuple(np.round(position, 4).tolist()))
        stands = placed(mesh, pose)
        if narrowest(stands) > MAX_WIDTH:
            continue
        height = stands.centroid[2]
        kind = next((k for k, h in enumerate(heights) if abs(h - height) < SAME_REST), len(heights))
        heights += [height] if kind == len(heights) else []
        kinds[kind].append(pose)
    return sorted((found for found in kinds.values() if len(found) >= RARE), key=len, reverse=True)


def distinct(poses: Iterable[Pose], count: int) -> list[Pose]:
    """The first poses that differ from all those before them."""
    chosen: list[Pose] = []
    for pose in poses:
        if len(chosen) < count and all(pose.turn_deg(other) > DISTINCT_DEG for other in chosen):
            chosen.append(pose)
    return chosen


def found(name: str, seed: int) -> list[Pose]:
    """The poses of an object, one of each kind of rest in turn."""
    kinds = rests(OBJECTS[name].make(), random(seed, name, "drops"))
    return distinct((pose for pose in chain(*zip_longest(*kinds)) if pose), COUNT)


def problem(name: str, number: int, pose: Pose, seed: int) -> dict[str, Any]:
    """The arrays of one problem file."""
    body = OBJECTS[name]
    file = f"{name}_{number}"
    rng = random(seed, file)
    arrays = scene(placed(body.make(), pose), file, rng, mass=body.mass, friction=FRICTION)
    return arrays | {"half": np.array(half(name, number))}


def read_poses(file: Path) -> dict[str, list[Pose]]:
    lines = json.loads(file.read_text(encoding="utf-8"))
    return {name: [Pose(tuple(line[:4]), tuple(line[4:])) for line in rows] for name, rows in lines.items()}


def write_poses(file: Path, poses: dict[str, list[Pose]]) -> None:
    rows = {name: [json.dumps([*p.quaternion, *p.position]) for p in poses[name]] for name in sorted(poses)}
    objects = [f'"{name}": [\n  ' + ",\n  ".join(lines) + "\n]" for name, lines in rows.items()]
    file.write_text("{\n" + ",\n".join(objects) + "\n}\n", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description="Make the problem files.")
    parser.add_argument("objects", nargs="*", default=list(OBJECTS), help="which (default: all)")
    parser.add_argument("--settle", action="store_true", help="find the poses first")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args()
    for name in options.objects:
        if name not in OBJECTS:
            parser.error(f"unknown object '{name}'; valid: {', '.join(OBJECTS)}")
    stored = FOLDER / POSES
    poses = read_poses(stored) if stored.exists() else {}
    for name in options.objects:
        if options.settle:
            poses[name] = found(name, options.seed)
            write_poses(options.out / POSES, poses)
        for number, pose in enumerate(poses[name]):
            arrays = problem(name, number, pose, options.seed)
            file = options.out / f"{name}_{number}.npz"
            results.write_arrays(file, arrays)
            print(f"{file}: {described(arrays)}")


def described(arrays: dict[str, NDArray[np.generic]]) -> str:
    size = np.ptp(arrays["mesh_vertices"], axis=0) * 1e3
    return f"{' x '.join(f'{s:.0f}' for s in size)} mm, {len(arrays['points'])} points"


if __name__ == "__main__":
    main()
