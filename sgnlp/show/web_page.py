"""A scene as one HTML file that opens offline: the data, our own page, and all of plotly.js.

Plotly's Python package contains plotly.js. `sgnlp view` writes the file, or serves it to a browser.
"""

import base64
import json
from contextlib import suppress
from dataclasses import asdict
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any

import numpy as np

from sgnlp.base import palette
from sgnlp.base.errors import InputError
from sgnlp.show.camera import FIELD, FILL, axes_of_view, ball, placed, seen
from sgnlp.show.scene_parts import Scene, Shape, Stage

REACH = 1.1
"""Half the edge of the drawn cube, over what the first stage needs: in later stages the object moves."""


def page(scene: Scene) -> str:
    """The whole page.

    Raises:
        InputError: Plotly is not installed.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError:
        raise InputError("the page needs Plotly: pip install 'sgnlp[view]'") from None
    template = resources.files("sgnlp.show").joinpath("viewer.html").read_text(encoding="utf-8")
    data = json.dumps(plain(scene)).replace("<", "\\u003c")  # no text in the data may close the script tag
    return template.replace("/*SCENE*/", data).replace("/*PLOTLY*/", get_plotlyjs())


def server(content: str, port: int) -> ThreadingHTTPServer:
    """A server of the page, which answers at every address of a port once `serve_forever` is called.

    Raises:
        InputError: the port is not free.
    """
    body = content.encode()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            with suppress(ConnectionError):  # the browser has gone
                self.send_response(200)
                self.send_header("Content-Type", "text/html; charset=utf-8")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

        def log_message(self, format: str, *arguments: Any) -> None:
            """Log nothing: the terminal belongs to the command."""

    try:
        return ThreadingHTTPServer(("localhost", port), Handler)
    except (OSError, OverflowError) as error:
        raise InputError(f"port {port} cannot be used ({error}); choose another by --port") from None


def plain(scene: Scene) -> dict[str, Any]:
    """The data of the page: texts, numbers, and arrays as base64."""
    return {
        "name": scene.name,
        "kind": scene.kind,
        "notes": scene.notes,
        "hidden": scene.hidden,
        "legend": [asdict(entry) | {"colour": palette.css(entry.colour)} for entry in scene.legend],
        "fingers": [{"name": name, "colour": palette.css(palette.finger(i))} for i, name in enumerate(scene.fingers)],
        "camera": {"towards": axes_of_view()[2].tolist(), "field": FIELD, "fill": FILL},
        "links": [_shape(link) for link in scene.links],
        "shapes": [_shape(shape) for shape in scene.shapes],
        "views": [_view(scene, rank) for rank in range(len(scene.views))],
    }


def _view(scene: Scene, rank: int) -> dict[str, Any]:
    view, shown = scene.views[rank], placed(scene, rank, 0)
    centre, radius = ball(seen(shown))
    reach = max(float(np.abs(shape.vertices - centre).max()) for shape in shown)
    wandering = max((float(np.linalg.norm(f.links[0, :3, 3] - view.links[0, :3, 3])) for f in view.frames), default=0.0)
    return {
        "title": view.title,
        "centre": centre.tolist(),
        "radius": radius,
        "reach": REACH * (reach + wandering),
        "wandering": wandering,
        "links": view.links[:, :3].tolist(),
        "shapes": [_shape(shape) for shape in view.shapes],
        "stages": [_stage(stage) for stage in view.stages],
        "frames": [_stage(f.stage) | {"time": f.time, "links": f.links[:, :3].tolist()} for f in view.frames],
        "labels": [asdict(label) | {"colour": palette.css(label.colour)} for label in view.labels],
        "sheets": [{"title": sheet.title, "rows": sheet.rows} for sheet in view.sheets],
    }


def _stage(stage: Stage) -> dict[str, Any]:
    told = {"name": stage.name, "rotation": stage.rotation.tolist(), "translation": stage.translation.tolist()}
    return told | {"shapes": [_shape(shape) for shape in stage.shapes]}


def _shape(shape: Shape) -> dict[str, Any]:
    values = None if shape.values is None else _bytes(shape.values, np.float32)
    arrays = {"vertices": _bytes(shape.vertices, np.float32), "cells": _bytes(shape.cells, np.int32), "values": values}
    return vars(shape) | arrays | {"corners": shape.cells.shape[1]}


def _bytes(array: Any, kind: Any) -> str:
    """An array's little-endian bytes in base64."""
    return base64.b64encode(np.ascontiguousarray(array, np.dtype(kind).newbyteorder("<")).tobytes()).decode()
