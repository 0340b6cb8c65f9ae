"""The files of a motion: arrays for NumPy, JSON for other programs, YAML for ROS 2; and reading the arrays again."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sgnlp.base.checked import typed
from sgnlp.base.errors import InputError
from sgnlp.planning import results
from sgnlp.planning.archive import read_archive
from sgnlp.planning.grasps import Grasps
from sgnlp.planning.motion import messages
from sgnlp.planning.motion.trajectory import Trajectory
from sgnlp.program.constraint import Check

ARRAYS = tuple(f.name for f in fields(Trajectory) if f.name not in ("checks", "meta"))
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
"""LibYAML's dumper, which takes a tenth of the time, if PyYAML was built with it."""


def contents(made: Trajectory, grasps: Grasps) -> dict[str, bytes]:
    """The contents of a motion's files, by name."""
    arrays = {name: getattr(made, name) for name in ARRAYS}
    told: dict[str, Any] = {"checks": [asdict(check) for check in made.checks], "meta": made.meta}
    found = (
        results.npz(arrays | {name: np.array(json.dumps(value, sort_keys=True)) for name, value in told.items()}),
        results.encoded(_json(made)),
        *map(_yaml, (messages.joint_trajectory(made), messages.grasp(made, grasps), messages.pregrasp(made))),
    )
    return dict(zip(results.MOTION, found, strict=True))


@typed
def load_trajectory(path: str | Path) -> Trajectory:
    """Read the trajectory of a result folder, or of its `trajectory.npz`.

    Raises:
        InputError: there is no such file, it is damaged, or of another plan than the grasps beside it. A result without
            a feasible grasp has none.
    """
    file = Path(path)
    file = file / results.MOTION[0] if file.is_dir() else file
    if not file.is_file():
        raise InputError(f"no trajectory at '{path}': a result with a feasible grasp has {results.MOTION[0]}")
    found = read_archive(file, "a trajectory of sgnlp", _trajectory)
    if (file.parent / results.GRASPS).is_file():
        results.check_plan(file, found.meta.get("plan"), results.load_grasps(file.parent))
    return found


def _trajectory(data: Mapping[str, Any]) -> Trajectory:
    arrays = {name: data[name] for name in ARRAYS}
    checks, meta = (json.loads(str(data[name])) for name in ("checks", "meta"))
    return Trajectory(**arrays, checks=tuple(Check(**check) for check in checks), meta=meta)


def _json(made: Trajectory) -> str:
    """The same arrays as JSON, one on each line."""
    lists = {name: getattr(made, name).tolist() for name in ARRAYS} | {"velocities": made.velocities.tolist()}
    values = lists | {"checks": [asdict(check) for check in made.checks], "meta": made.meta}
    lines = [
        f"{json.dumps(name)}: {json.dumps(results.finite(value), allow_nan=False)}" for name, value in values.items()
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _yaml(message: dict[str, Any]) -> bytes:
    text = yaml.dump(message, Dumper=_DUMPER, sort_keys=False, default_flow_style=None, width=120, allow_unicode=True)
    return results.encoded(text)
