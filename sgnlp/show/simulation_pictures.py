"""Pictures of a simulated grasp, drawn without a screen."""

import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base import palette
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import frames
from sgnlp.planning import results
from sgnlp.show.camera import ball, distance
from sgnlp.show.png import AZIMUTHS
from sgnlp.simulation import Body, Command, Outcome, SimulationSettings, Trace
from sgnlp.simulation.displacement import erred
from sgnlp.simulation.scene import OBJECT, SHOWN, TABLE
from sgnlp.simulation.world import assembled

SIZE = 640
"""Pixels of a square view."""
ELEVATION = 20.0
"""From where the views are taken [deg]; their azimuths are those of the plan's pictures."""
TARGET_SIZE, FORCE_WIDTH, FORCE_SCALE = 0.005, 0.0025, 0.008
"""Radius of a target [m], radius of an arrow [m], its length over the force [m/N]."""
OBJECT_COLOUR, TABLE_COLOUR, HAND_OPACITY = (0.45, 0.65, 0.75, 0.4), (0.8, 0.79, 0.77, 1.0), 0.5
BRIGHTNESS, WHITE = 0.35, (1.0, 1.0, 1.0)
LAMP = ((0.3, -0.4, 1.5), (-0.2, 0.3, -1.0))
"""Place [m] and direction of the light that casts the shadows."""
PHASES = {"pregrasp": "pregrasp", "close": "after closing", "lift": "after the lift", "hold": "after the hold"}
"""The phases that have a picture, each of its end, and the picture's name."""
LETTERS, LINES = 26, 16
"""Letters in a line, and lines in a cell."""


class NoRenderer(Exception):
    """OpenGL cannot draw here; the message says what would help."""


def headless() -> None:
    """Let MuJoCo draw without a screen; it asks once, when it is imported."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("MUJOCO_GL", "egl")


def draw(
    folder: Path, command: Command, body: Body, hand: Hand, settings: SimulationSettings, outcome: Outcome, title: str
) -> list[Path]:
    """Write a PNG picture of the end of each phase; see `images`, also for what it raises."""
    from PIL import Image

    files = []
    for phase, image in images(command, body, hand, settings, outcome.trace, SIZE).items():
        content = io.BytesIO()
        Image.fromarray(titled(image, title, told(phase, settings, outcome), hand)).save(content, "PNG")
        files.append(folder / f"simulation-{phase}.png")
        results.write_bytes(files[-1], content.getvalue())
    return files


def told(phase: str, settings: SimulationSettings, outcome: Outcome) -> list[str]:
    """What a picture shows: load, phase with its end, and how the whole run ended."""
    times = outcome.trace.time[outcome.trace.phase == phase]
    return [
        f"{PHASES[phase]}, {times[-1]:.1f} s",
        f"{settings.mass:g} kg, friction {settings.friction:g}",
        f"in the end: {outcome.ending}",
    ]


def titled(image: NDArray[np.uint8], title: str, lines: Sequence[str], hand: Hand) -> NDArray[np.uint8]:
    """Three views (size, 3 size, 3) in two columns, with title, lines and legend in the fourth cell."""
    from PIL import Image, ImageDraw, ImageFont

    views = np.hsplit(image, len(AZIMUTHS))
    size = views[0].shape[1]
    cell = Image.new("RGB", (size, image.shape[0]), "white")
    pen, step = ImageDraw.Draw(cell), size / (LINES + 1)
    font = ImageFont.load_default(max(1.0, 0.72 * step))
    text = [(word, palette.INK) for line in (title, *lines) for word in wrap(line, LETTERS)]
    text += [(f"finger: {f.name}", palette.finger(i)) for i, f in enumerate(hand.fingers)]
    text += [(word, palette.INK) for word in ("ball: target of the spring", "arrow: force on the object,")]
    text += [(f"{1e3 * FORCE_SCALE:g} mm for each newton", palette.INK)]
    for row, (word, colour) in enumerate(text):
        pen.text((step, (row + 0.5) * step), word, fill=palette.css(colour), font=font)
    for view, azimuth in zip(views, AZIMUTHS, strict=True):
        view[:] = _captioned(view, f"from azimuth {azimuth:.0f}°", font)
    return np.vstack([np.hstack(views[:2]), np.hstack([views[2], np.asarray(cell)])])


def _captioned(view: NDArray[np.uint8], text: str, font: Any) -> NDArray[np.uint8]:
    """A view with a text in its upper left corner."""
    from PIL import Image, ImageDraw

    picture = Image.fromarray(view)
    ImageDraw.Draw(picture).text((font.size / 2, font.size / 3), text, fill=palette.css(palette.INK), font=font)
    return np.asarray(picture)


def images(
    command: Command, body: Body, hand: Hand, settings: SimulationSettings, trace: Trace, size: int
) -> dict[str, NDArray[np.uint8]]:
    """The end of each phase from three sides, (size, 3 size, 3) pixels: targets and forces in the fingers' colours.

    Raises:
        NoRenderer: there is no OpenGL that works without a screen.
    """
    command = erred(command, settings)
    try:
        import mujoco

        model = _painted(_lit(assembled(body, hand, command, settings)).compile(), hand)
        renderer = mujoco.Renderer(model, size, size)
    except Exception as error:  # drivers raise what they like
        raise NoRenderer(f"{error}; on Debian: apt install libegl1 libgl1-mesa-dri, and MUJOCO_GL=egl") from None
    data, drawn, look = mujoco.MjData(model), {}, _look(command, body, hand, trace)
    with renderer:
        for phase in PHASES:
            rows = np.flatnonzero(trace.phase == phase)
            if len(rows):
                data.qpos[:] = trace.qpos[rows[-1]]
                mujoco.mj_forward(model, data)
                views = [_view(renderer, data, (azimuth, *look), command, trace, rows[-1]) for azimuth in AZIMUTHS]
                drawn[phase] = np.hstack(views)
    return drawn


def _lit(spec: Any) -> Any:
    """The model with light, a white sky, and different colours for table, object and hand."""
    import mujoco

    position, direction = LAMP
    spec.worldbody.add_light(pos=position, dir=direction)
    sky = {"type": mujoco.mjtTexture.mjTEXTURE_SKYBOX, "builtin": mujoco.mjtBuiltin.mjBUILTIN_FLAT}
    spec.add_texture(name="sky", width=8, height=8, rgb1=WHITE, rgb2=WHITE, **sky)
    spec.geom(TABLE).rgba, spec.geom(OBJECT).rgba = TABLE_COLOUR, OBJECT_COLOUR
    spec.visual.headlight.ambient = spec.visual.headlight.diffuse = np.full(3, BRIGHTNESS)
    spec.visual.global_.offwidth = spec.visual.global_.offheight = SIZE
    return spec


def _painted(model: Any, hand: Hand) -> Any:
    """The model with a light, transparent hand, its tips in the fingers' colours."""
    tips = {f"hand/{finger.frame}": palette.finger(i) for i, finger in enumerate(hand.fingers)}
    for i in np.flatnonzero(model.geom_group == SHOWN):
        name = model.body(model.geom_bodyid[i]).name
        if name != OBJECT:
            model.geom_rgba[i] = (*tips.get(name, palette.lightened(model.geom_rgba[i, :3])), HAND_OPACITY)
    return model


def _look(command: Command, body: Body, hand: Hand, trace: Trace) -> tuple[NDArray[np.float64], float]:
    """What the camera looks at (3,) and from how far away [m]: hand and object, as they stand and lifted."""
    points = np.concatenate([frames(hand, command.wrist, command.joints)[1], body.vertices])
    centre, radius = ball(np.concatenate([points, points + np.array([0.0, 0.0, trace.qpos[:, 0].max()])]))
    return centre, distance(radius)


def _view(renderer: Any, data: Any, look: tuple[Any, ...], command: Command, trace: Trace, row: int) -> Any:
    """One view (size, size, 3): the camera stands still, the targets rise with the wrist."""
    import mujoco

    camera, lifted = mujoco.MjvCamera(), np.array([0.0, 0.0, trace.qpos[row, 0]])
    azimuth, camera.lookat[:], camera.distance = look
    camera.azimuth, camera.elevation = azimuth - 180, -ELEVATION  # MuJoCo's are of the way that it looks
    renderer.update_scene(data, camera)
    for i, (target, tip, force) in enumerate(zip(command.targets, trace.tips[row], trace.forces[row], strict=True)):
        colour = (*palette.finger(i), 1.0)
        dot = _shape(renderer.scene, mujoco.mjtGeom.mjGEOM_SPHERE, colour)
        dot.pos[:], dot.size[:] = target + lifted, TARGET_SIZE
        if force.any():
            arrow = mujoco.mjtGeom.mjGEOM_ARROW
            end = tip + FORCE_SCALE * force
            mujoco.mjv_connector(_shape(renderer.scene, arrow, colour), arrow, FORCE_WIDTH, tip, end)
    return np.asarray(renderer.render())


def _shape(scene: Any, kind: Any, colour: tuple[float, ...]) -> Any:
    """A new shape in a scene, without place or size."""
    import mujoco

    scene.ngeom += 1
    geom = scene.geoms[scene.ngeom - 1]
    mujoco.mjv_initGeom(geom, kind, np.ones(3), np.zeros(3), np.eye(3).ravel(), np.array(colour))
    geom.emission = 1.0
    return geom
