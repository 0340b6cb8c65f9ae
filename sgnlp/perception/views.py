"""Which camera saw which point of a cloud, and the choice of some of them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array, IntArray, floats, integers
from sgnlp.base.errors import InputError, unknown


def in_order(views: Iterable[Any]) -> list[Any]:
    """The views of a list as they are, those of a set in the order of their names: a set has none of its own."""
    if isinstance(views, np.ndarray):
        return list(views.tolist())
    return sorted(views, key=str) if isinstance(views, set | frozenset) else list(views)


@dataclass(frozen=True, eq=False)
class Cameras:
    """Which camera saw which point."""

    view: IntArray  # (N,) index into names
    names: tuple[str, ...]  # (V,)
    positions: Array | None  # (V, 3)
    notes: tuple[str, ...] = ()  # what was ignored

    @classmethod
    def of(cls, count: int, view: object, names: Sequence[str] | None, positions: object) -> "Cameras":
        """The cameras of `count` points; without names a camera's name is its number in `view`.

        Without `view` it is unknown which of several positions saw a point: then there is one camera, without position.
        """
        number = np.zeros(count, np.int64) if view is None else integers(view, "view", (None,))
        if len(number) != count:
            raise InputError(f"'view' has {len(number)} entries for {count} points")
        place = None if positions is None else floats(positions, "camera_positions", (None, 3))
        if place is not None and not np.isfinite(place).all():
            raise InputError("'camera_positions' must be finite")
        notes: tuple[str, ...] = ()
        if view is None and place is not None and len(place) > 1:
            place, notes = None, ("Ignored the camera positions: no view says which of them saw a point.",)
        if names is None and place is None:
            numbers, number = np.unique(number, return_inverse=True)
            names = [str(n) for n in numbers]
        elif names is None and place is not None:
            names = [str(n) for n in range(len(place))]
        names = () if names is None else tuple(names)
        if len(set(names)) < len(names):
            raise InputError(f"two of the views have the same name; found {', '.join(map(str, names))}")
        if place is not None and len(place) != len(names):
            raise InputError(f"'camera_positions' has {len(place)} rows for {len(names)} views")
        if len(number) and (number.min() < 0 or number.max() >= len(names)):
            raise InputError(f"'view' must lie in 0..{len(names) - 1}; found {number.min()}..{number.max()}")
        return cls(number, names, place, notes)

    def background(self, points: object, view: object) -> tuple[Array, IntArray] | None:
        """The finite points (M, 3) that the cameras (M,) measured around the object.

        Raises `InputError` for another shape, or an unknown camera.
        """
        if points is None:
            return None
        found, number = floats(points, "background", (None, 3)), integers(view, "background_view", (None,))
        if len(number) != len(found):
            raise InputError(f"'background_view' has {len(number)} entries for {len(found)} points of 'background'")
        if len(number) and (number.min() < 0 or number.max() >= len(self.names)):
            raise InputError(f"'background_view' must lie in 0..{len(self.names) - 1}")
        finite = np.isfinite(found).all(axis=1)
        return found[finite], number[finite]

    def pick(self, views: Sequence[str | int] | None) -> IntArray:
        """Sorted indices of views given by name, or by index if no name matches; None: all."""
        if views is None:
            return np.arange(len(self.names))
        places = {str(i): i for i in range(len(self.names))} | {name: i for i, name in enumerate(self.names)}
        asked = [views] if isinstance(views, str) else [str(view) for view in views]
        for view in asked:
            if view not in places:
                raise unknown("view", view, self.names)
        if not asked:
            raise InputError(f"no view is chosen; valid: {', '.join(self.names)}")
        return np.unique([places[view] for view in asked])
