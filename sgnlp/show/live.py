"""A scene in the browser, live: viser's server with a panel to choose the grasp, the stage and the layers."""

import threading
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base import palette
from sgnlp.base.errors import InputError
from sgnlp.base.palette import Colour
from sgnlp.show.camera import FIELD, axes_of_view, ball, beside, distance, in_space, placed, projected, seen
from sgnlp.show.scene_parts import AXES, HAND, PATCH, SPRINGS, SURFACE, TABLE, Label, Scene, Shape
from sgnlp.show.sheets import Sheet

Array = NDArray[np.float64]

POINT_SIZE = 4e-4
"""Of a point of the cloud [m]."""
LABEL_SCALE = 1.0
"""Of the letters, to viser's own size."""
SCALE = np.array([[0.27, 0.0, 0.33], [0.23, 0.32, 0.55], [0.13, 0.57, 0.55], [0.37, 0.79, 0.38], [0.99, 0.91, 0.15]])
"""Five colours of viridis, from the least deviation to the largest."""


class Live:
    """The server, and what it shows now.

    Raises:
        InputError: viser is not installed, or the port is taken.
    """

    def __init__(self, scene: Scene, port: int) -> None:
        try:
            import viser
        except ImportError:
            raise InputError("the live view needs viser: pip install 'sgnlp[view]'") from None
        self.scene = scene
        self.server = viser.ViserServer(port=port, verbose=False)
        self.port = self.server.get_port()
        self.server.scene.set_up_direction("+z")
        self._point(self.server.initial_camera)
        self.server.on_client_connect(self._fit)
        self.lock = threading.Lock()  # viser calls back from several threads
        self.handles: list[Any] = []
        self._panel()
        self.show()

    def wait(self) -> None:
        """Until the process is interrupted."""
        threading.Event().wait()

    def _fit(self, client: Any) -> None:
        """A view that is higher than wide, as on a phone, is from farther away, with its legend folded up."""
        wide = client.camera.aspect >= 1
        if not wide:
            self._point(client.camera, client.camera.aspect)
        with client.gui.add_folder("legend", expand_by_default=wide):
            client.gui.add_html(legend(self.scene))

    def _point(self, camera: Any, aspect: float = 1.0) -> None:
        camera.fov = np.radians(FIELD)
        camera.look_at, camera.position = first_view(self.scene, aspect)

    def _panel(self) -> None:
        gui, views = self.server.gui, self.scene.views
        for note in self.scene.notes:
            gui.add_markdown(note)
        titles = [view.title for view in views]
        self.grasp = gui.add_dropdown("grasp", titles, initial_value=titles[0])
        self.stage = gui.add_slider("object", min=0, max=len(views[0].stages) - 1, step=1, initial_value=0)
        with gui.add_folder("shown", expand_by_default=False):
            self.boxes = {layer: gui.add_checkbox(layer, layer not in self.scene.hidden) for layer in self.scene.layers}
        with gui.add_folder("numbers", expand_by_default=False):
            self.text = gui.add_markdown("")
        for control in (self.grasp, self.stage, *self.boxes.values()):
            control.on_update(lambda _: self.show())

    @property
    def rank(self) -> int:
        """The grasp that is chosen."""
        return [view.title for view in self.scene.views].index(self.grasp.value)

    def show(self) -> None:
        """Draw the chosen grasp at the chosen stage, in place of what was drawn."""
        with self.lock, self.server.atomic():
            view = self.scene.views[self.rank]
            stage = view.stages[int(self.stage.value)]
            while self.handles:
                self.handles.pop().remove()
            for link, pose in zip(self.scene.links, view.links, strict=True):
                self._add(link, pose[:3, :3], pose[:3, 3])
            for shape in (*self.scene.shapes, *view.shapes, *stage.shapes):
                self._add(shape, *((stage.rotation, stage.translation) if shape.moves else (np.eye(3), np.zeros(3))))
            self._name(view.labels)
            self.text.content = f"**{stage.name}**\n\n" + "\n\n".join(map(markdown, view.sheets))

    def _name(self, labels: Sequence[Label]) -> None:
        """Labels below hand and object as they are seen at first, with lines to their places, and letters of axes."""
        draw = self.server.scene
        for label, place in zip(labels, spots(self.scene, self.rank, labels), strict=True):
            if not self.boxes[AXES if label.here else SPRINGS].value:
                continue
            look = {"anchor": "center-center" if label.here else "top-center", "font_screen_scale": LABEL_SCALE}
            self.handles.append(draw.add_label(f"/label/{label.text}", label.text, position=place, **look))
            if not label.here:
                line = np.array([[label.place, place]], np.float32)
                self.handles.append(
                    draw.add_line_segments(f"/line/{label.text}", line, _bytes(label.colour), line_width=1.0)
                )

    def _add(self, shape: Shape, rotation: Array, translation: Array) -> None:
        if not self.boxes[shape.layer].value:
            return
        draw, name = self.server.scene, f"/{shape.layer}/{len(self.handles)}"
        vertices = (shape.vertices @ rotation.T + translation).astype(np.float32)
        colour = _bytes(shape.colour)
        if shape.cells.shape[1] == 1:
            self.handles.append(draw.add_point_cloud(name, vertices, colour, point_size=POINT_SIZE))
        elif shape.cells.shape[1] == 2:
            lines = vertices[shape.cells]
            self.handles.append(draw.add_line_segments(name, lines, colour, line_width=shape.width))
        elif shape.values is None:
            look = {"color": colour, "opacity": shape.opacity if shape.opacity < 1 else None, "side": "double"}
            self.handles.append(draw.add_mesh_simple(name, vertices, shape.cells.astype(np.uint32), **look))
        else:
            import trimesh

            rgba = np.column_stack([graded(shape.values), np.full(len(vertices), shape.opacity)])
            mesh = trimesh.Trimesh(vertices, shape.cells, vertex_colors=(255 * rgba).astype(np.uint8), process=False)
            self.handles.append(draw.add_mesh_trimesh(name, mesh))


def first_view(scene: Scene, aspect: float = 1.0) -> tuple[Array, Array]:
    """What the camera of a view of this aspect, width over height, looks at first, and where it stands, (3,) [m]."""
    centre, radius = ball(seen(placed(scene, 0, 0)))
    return centre, centre + distance(radius, aspect) * axes_of_view()[2]


def spots(scene: Scene, rank: int, labels: Sequence[Label]) -> Array:
    """Where the texts of labels stand (m, 3) [m]: below all that is seen at first, letters of axes at their places."""
    (centre, eye), camera, shown = first_view(scene), axes_of_view(), placed(scene, rank, 0)
    away = float(np.linalg.norm(eye - centre))
    places = np.reshape([label.place for label in labels], (-1, 3))
    there = np.array([not label.here for label in labels])
    points = np.concatenate([shape.vertices for shape in shown if shape.layer in (HAND, SURFACE, AXES)])
    flat = [projected(p, centre, camera, away) for p in (points, places[there])]
    heights = [float(shape.vertices[:, 2].max()) for shape in shown if shape.layer == TABLE]
    places[there] = in_space(beside(*flat), centre, camera, away, heights[0] if heights else -np.inf)
    return places


def _bytes(colour: Colour) -> tuple[int, int, int]:
    red, green, blue = (round(255 * c) for c in colour)
    return red, green, blue


def legend(scene: Scene) -> str:
    """The fingers' colours and every symbol as HTML, with the scale of the deviation."""
    row = '<div><b style="color:{0}">{1}</b> {2}</div>'
    lines = [row.format(palette.css(palette.finger(i)), PATCH, escape(name)) for i, name in enumerate(scene.fingers)]
    for entry in scene.legend:
        lines.append(row.format(palette.css(entry.colour), entry.glyph, escape(entry.text)))
        values = [shape.values for shape in scene.shapes if entry.graded and shape.values is not None]
        if values:
            colours = ", ".join(palette.css((r, g, b)) for r, g, b in SCALE)
            bar = f'<div style="height:10px;background:linear-gradient(90deg, {colours})"></div>'
            ends = f"<span>{values[0].min():.1f}</span><span>± σ [mm]</span><span>{values[0].max():.1f}</span>"
            lines.append(f'{bar}<div style="display:flex;justify-content:space-between">{ends}</div>')
    return '<div style="font-size:12px;line-height:1.5;padding:0 12px">' + "".join(lines) + "</div>"


def graded(values: Array) -> Array:
    """Colours (U, 3) of values (U,), spread over `SCALE`."""
    share = (values - values.min()) / max(float(np.ptp(values)), np.finfo(float).tiny)
    places = np.linspace(0, 1, len(SCALE))
    return np.stack([np.interp(share, places, SCALE[:, c]) for c in range(3)], axis=1)


def markdown(sheet: Sheet) -> str:
    """A sheet as a Markdown table."""
    rows = [sheet.rows[0], ("---",) * len(sheet.rows[0]), *sheet.rows[1:]]
    return f"{sheet.title}\n\n" + "\n".join("| " + " | ".join(row) + " |" for row in rows)
