"""A scene as one HTML file that opens offline: the data, a page of our own, and the whole of plotly.js.

Plotly's Python package ships plotly.js whole, and it draws meshes, lines and texts; viser's own export is one file too,
but without a panel: neither grasps to choose from nor numbers beside them.
"""

import base64
import json
from importlib import resources
from typing import Any

import numpy as np

from sgnlp.errors import InputError
from sgnlp.scene3d import LAYERS, Scene, Shape


def page(scene: Scene) -> str:
    """The whole page.

    Raises:
        InputError: Plotly is not installed.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError:
        raise InputError("the page needs Plotly: pip install 'sgnlp[view]'") from None
    template = resources.files("sgnlp").joinpath("viewer.html").read_text(encoding="utf-8")
    data = json.dumps(_plain(scene)).replace("<", "\\u003c")  # no text may end the script
    return template.replace("/*SCENE*/", data).replace("/*PLOTLY*/", get_plotlyjs())


def _plain(scene: Scene) -> dict[str, Any]:
    return {
        "name": scene.name,
        "kind": scene.kind,
        "notes": scene.notes,
        "layers": LAYERS,
        "hidden": scene.hidden,
        "links": [_shape(link) for link in scene.links],
        "shapes": [_shape(shape) for shape in scene.shapes],
        "views": [
            {
                "title": view.title,
                "links": view.links[:, :3].tolist(),
                "shapes": [_shape(shape) for shape in view.shapes],
                "stages": [
                    {
                        "name": stage.name,
                        "rotation": stage.rotation.tolist(),
                        "translation": stage.translation.tolist(),
                        "shapes": [_shape(shape) for shape in stage.shapes],
                    }
                    for stage in view.stages
                ],
                "labels": [{"text": label.text, "place": label.place} for label in view.labels],
                "sheets": [{"title": sheet.title, "rows": sheet.rows} for sheet in view.sheets],
            }
            for view in scene.views
        ],
    }


def _shape(shape: Shape) -> dict[str, Any]:
    return {
        "layer": shape.layer,
        "vertices": _bytes(shape.vertices, np.float32),
        "cells": _bytes(shape.cells, np.int32),
        "corners": shape.cells.shape[1],
        "colour": shape.colour,
        "opacity": shape.opacity,
        "width": shape.width,
        "values": None if shape.values is None else _bytes(shape.values, np.float32),
        "moves": shape.moves,
    }


def _bytes(array: Any, kind: Any) -> str:
    """An array's little-endian bytes in base64."""
    return base64.b64encode(np.ascontiguousarray(array, np.dtype(kind).newbyteorder("<")).tobytes()).decode()
