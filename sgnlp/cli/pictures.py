"""Pictures of a simulated grasp, drawn without a screen."""

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.hand import Hand
from sgnlp.simulation import Body, Command, SimulationSettings, Trace
from sgnlp.simulation.world import world

WIDTH, HEIGHT = 640, 640
AZIMUTHS, ELEVATION, DISTANCE = (60.0, 150.0), -20.0, 0.55  # [deg], [deg], [m]
TARGET_SIZE, TARGET_COLOUR = 0.006, (0.95, 0.45, 0.1, 1.0)  # [m]
FORCE_SCALE, FORCE_WIDTH, FORCE_COLOUR = 0.01, 0.004, (0.8, 0.1, 0.2, 1.0)  # [m/N], [m]
PHASES = ("pregrasp", "close", "lift", "hold")


class NoRenderer(Exception):
    """OpenGL cannot draw here; the message says what would help."""


def headless() -> None:
    """Let MuJoCo draw without a screen; it asks once, when it is imported."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("MUJOCO_GL", "egl")


def draw(
    folder: Path, command: Command, body: Body, hand: Hand, settings: SimulationSettings, trace: Trace
) -> list[Path]:
    """Write PNG pictures of the ends of the phases, from two sides; springs' targets orange, contact forces red.

    Raises:
        NoRenderer: no OpenGL that works without a screen.
    """
    try:
        import mujoco
        from PIL import Image

        model = world(body, hand, command, settings).model
        renderer = mujoco.Renderer(model, HEIGHT, WIDTH)
    except Exception as error:  # drivers raise what they like
        raise NoRenderer(f"{error}; on Debian: apt install libegl1 libgl1-mesa-dri, and MUJOCO_GL=egl") from None
    data, files = mujoco.MjData(model), []
    with renderer:
        for phase in PHASES:
            rows = np.flatnonzero(trace.phase == phase)
            if not len(rows):
                continue
            data.qpos[:] = trace.qpos[rows[-1]]
            mujoco.mj_forward(model, data)
            image = np.hstack([_view(renderer, data, azimuth, command, trace, rows[-1]) for azimuth in AZIMUTHS])
            files.append(folder / f"simulation-{phase}.png")
            Image.fromarray(image).save(files[-1])
    return files


def _view(renderer: Any, data: Any, azimuth: float, command: Command, trace: Trace, row: int) -> NDArray[np.uint8]:
    import mujoco

    camera, lifted = mujoco.MjvCamera(), np.array([0, 0, data.qpos[0]])
    camera.lookat[:] = np.mean(command.targets, axis=0) + lifted
    camera.azimuth, camera.elevation, camera.distance = azimuth, ELEVATION, DISTANCE
    renderer.update_scene(data, camera)
    scene = renderer.scene
    for target, tip, force in zip(command.targets, trace.tips[row], trace.forces[row], strict=True):
        ball = _more(scene)
        sphere, arrow = mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ARROW
        mujoco.mjv_initGeom(
            ball, sphere, np.full(3, TARGET_SIZE), target + lifted, np.eye(3).ravel(), np.array(TARGET_COLOUR)
        )
        if force.any():
            line = _more(scene)
            mujoco.mjv_initGeom(line, arrow, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(FORCE_COLOUR))
            mujoco.mjv_connector(line, arrow, FORCE_WIDTH, tip, tip + FORCE_SCALE * force)
    return np.asarray(renderer.render())


def _more(scene: Any) -> Any:
    """The next free geom of a scene."""
    scene.ngeom += 1
    return scene.geoms[scene.ngeom - 1]
