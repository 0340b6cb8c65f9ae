"""A scene in the browser, live: viser's server with a panel to choose the grasp, the stage and the layers."""

import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.errors import InputError
from sgnlp.scene3d import LAYERS, Label, Scene, Shape, Sheet

Array = NDArray[np.float64]

POINT_SIZE = 1.2e-3
"""Of a point of the cloud [m]."""
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
        self.lock = threading.Lock()  # viser calls back from several threads
        self.handles: list[Any] = []
        self._panel()
        self.show()

    def wait(self) -> None:
        """Until the process is interrupted."""
        threading.Event().wait()

    def _panel(self) -> None:
        gui, views = self.server.gui, self.scene.views
        for note in self.scene.notes:
            gui.add_markdown(note)
        titles = [view.title for view in views]
        self.grasp = gui.add_dropdown("grasp", titles, initial_value=titles[0])
        self.stage = gui.add_slider("object", min=0, max=len(views[0].stages) - 1, step=1, initial_value=0)
        self.boxes = {layer: gui.add_checkbox(layer, layer not in self.scene.hidden) for layer in LAYERS}
        self.text = gui.add_markdown("")
        for control in (self.grasp, self.stage, *self.boxes.values()):
            control.on_update(lambda _: self.show())

    def show(self) -> None:
        """Draw the chosen grasp at the chosen stage, in place of what was drawn."""
        with self.lock, self.server.atomic():
            view = next(view for view in self.scene.views if view.title == self.grasp.value)
            stage = view.stages[int(self.stage.value)]
            while self.handles:
                self.handles.pop().remove()
            for link, pose in zip(self.scene.links, view.links, strict=True):
                self._add(link, pose[:3, :3], pose[:3, 3])
            for shape in (*self.scene.shapes, *view.shapes, *stage.shapes):
                self._add(shape, *((stage.rotation, stage.translation) if shape.moves else (np.eye(3), np.zeros(3))))
            if self.boxes["springs"].value:
                self.handles += [self._label(label) for label in view.labels]
            self.text.content = f"**{stage.name}**\n\n" + "\n\n".join(map(markdown, view.sheets))

    def _label(self, label: Label) -> Any:
        return self.server.scene.add_label(f"/label/{label.text}", label.text, position=label.place)

    def _add(self, shape: Shape, rotation: Array, translation: Array) -> None:
        if not self.boxes[shape.layer].value:
            return
        draw, name = self.server.scene, f"/{shape.layer}/{len(self.handles)}"
        vertices = (shape.vertices @ rotation.T + translation).astype(np.float32)
        colour = tuple(round(255 * c) for c in shape.colour)
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


def graded(values: Array) -> Array:
    """Colours (U, 3) of values (U,), spread over `SCALE`."""
    share = (values - values.min()) / max(float(np.ptp(values)), np.finfo(float).tiny)
    places = np.linspace(0, 1, len(SCALE))
    return np.stack([np.interp(share, places, SCALE[:, c]) for c in range(3)], axis=1)


def markdown(sheet: Sheet) -> str:
    """A sheet as a Markdown table."""
    rows = [sheet.rows[0], ("---",) * len(sheet.rows[0]), *sheet.rows[1:]]
    return f"{sheet.title}\n\n" + "\n".join("| " + " | ".join(row) + " |" for row in rows)
