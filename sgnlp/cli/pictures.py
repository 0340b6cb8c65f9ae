"""Pictures of a simulated grasp, drawn without a screen."""

import io
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp import results
from sgnlp.hand import Hand
from sgnlp.simulation import Body, Command, SimulationSettings, Trace
from sgnlp.simulation.scene import OBJECT, TABLE
from sgnlp.simulation.world import assembled

SIZE = 640
"""Pixels of a square view."""
AZIMUTHS, ELEVATION, DISTANCE = (30.0, 120.0, 210.0), -15.0, 0.55
"""Views side by side [deg], all from this far above [deg] and away [m]."""
TARGET_SIZE, FORCE_WIDTH, FORCE_SCALE = 0.005, 0.0025, 0.008
"""Radius of a target [m], radius of an arrow [m], its length over the force [m/N]."""
OBJECT_COLOUR, TABLE_COLOUR = (0.45, 0.65, 0.75, 0.4), (0.6, 0.58, 0.55, 1.0)
TARGET_COLOUR, FORCE_COLOUR = (0.95, 0.55, 0.1, 1.0), (0.8, 0.1, 0.2, 1.0)
BRIGHTNESS, WHITE = 0.35, (1.0, 1.0, 1.0)
LAMP = ((0.3, -0.4, 1.5), (-0.2, 0.3, -1.0))
"""Place [m] and direction of the light that casts the shadows."""
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
    """Write a PNG picture of the end of each phase; see `images`, also for what it raises."""
    from PIL import Image

    files = []
    for phase, image in images(command, body, hand, settings, trace, SIZE).items():
        content = io.BytesIO()
        Image.fromarray(image).save(content, "PNG")
        files.append(folder / f"simulation-{phase}.png")
        results.write_bytes(files[-1], content.getvalue())
    return files


def images(
    command: Command, body: Body, hand: Hand, settings: SimulationSettings, trace: Trace, size: int
) -> dict[str, NDArray[np.uint8]]:
    """The end of each phase from three sides, (size, 3 size, 3) pixels: targets yellow, forces on the object red.

    Raises:
        NoRenderer: there is no OpenGL that works without a screen.
    """
    try:
        import mujoco

        model = _lit(assembled(body, hand, command, settings)).compile()
        renderer = mujoco.Renderer(model, size, size)
    except Exception as error:  # drivers raise what they like
        raise NoRenderer(f"{error}; on Debian: apt install libegl1 libgl1-mesa-dri, and MUJOCO_GL=egl") from None
    data, drawn = mujoco.MjData(model), {}
    with renderer:
        for phase in PHASES:
            rows = np.flatnonzero(trace.phase == phase)
            if len(rows):
                data.qpos[:] = trace.qpos[rows[-1]]
                mujoco.mj_forward(model, data)
                views = [_view(renderer, data, azimuth, command, trace, rows[-1]) for azimuth in AZIMUTHS]
                drawn[phase] = np.hstack(views)
    return drawn


def _lit(spec: Any) -> Any:
    """The model with light, a white sky, and colours to tell table, object and hand apart."""
    import mujoco

    position, direction = LAMP
    spec.worldbody.add_light(pos=position, dir=direction)
    sky = {"type": mujoco.mjtTexture.mjTEXTURE_SKYBOX, "builtin": mujoco.mjtBuiltin.mjBUILTIN_FLAT}
    spec.add_texture(name="sky", width=8, height=8, rgb1=WHITE, rgb2=WHITE, **sky)
    spec.geom(TABLE).rgba, spec.geom(OBJECT).rgba = TABLE_COLOUR, OBJECT_COLOUR
    spec.visual.headlight.ambient = spec.visual.headlight.diffuse = np.full(3, BRIGHTNESS)
    spec.visual.global_.offwidth = spec.visual.global_.offheight = SIZE
    return spec


def _view(renderer: Any, data: Any, azimuth: float, command: Command, trace: Trace, row: int) -> NDArray[np.uint8]:
    """One view: the camera stands still, the targets rise with the wrist."""
    import mujoco

    camera, lifted = mujoco.MjvCamera(), np.array([0.0, 0.0, trace.qpos[row, 0]])
    camera.lookat[:] = np.mean(command.targets, axis=0)
    camera.azimuth, camera.elevation, camera.distance = azimuth, ELEVATION, DISTANCE
    renderer.update_scene(data, camera)
    for target, tip, force in zip(command.targets, trace.tips[row], trace.forces[row], strict=True):
        ball = _shape(renderer.scene, mujoco.mjtGeom.mjGEOM_SPHERE, TARGET_COLOUR)
        ball.pos[:], ball.size[:] = target + lifted, TARGET_SIZE
        if force.any():
            arrow = mujoco.mjtGeom.mjGEOM_ARROW
            end = tip + FORCE_SCALE * force
            mujoco.mjv_connector(_shape(renderer.scene, arrow, FORCE_COLOUR), arrow, FORCE_WIDTH, tip, end)
    return np.asarray(renderer.render())


def _shape(scene: Any, kind: Any, colour: tuple[float, ...]) -> Any:
    """A new shape in a scene, without place or size."""
    import mujoco

    scene.ngeom += 1
    geom = scene.geoms[scene.ngeom - 1]
    mujoco.mjv_initGeom(geom, kind, np.ones(3), np.zeros(3), np.eye(3).ravel(), np.array(colour))
    geom.emission = 1.0
    return geom
