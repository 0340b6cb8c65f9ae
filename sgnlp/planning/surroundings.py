"""Obstacles around the object, and regions of its surface to touch or avoid: given by the user, or seen by cameras."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.perception.clutter import seen_shapes
from sgnlp.perception.observation import Observation
from sgnlp.perception.shape import FAR, Shape
from sgnlp.program.around import Around, Fields, fields

MOST_INSIDE = 0.05
"""Largest share of the object's points in an obstacle: noise puts a few points into an obstacle that touches it."""
BESIDE = 0.5
"""A region that no finger may touch is at most this far from the points [m]: it may be on the unseen side."""
NEAR = 0.02
"""[m] A region to touch has measured points within this distance: unseen sides are no farther away."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Obstacles for hand and arm, and regions of the surface that fingers must avoid or touch."""

    obstacles: tuple[Shape, ...] = ()
    avoid: tuple[Shape, ...] = ()
    touch: tuple[Shape, ...] = ()

    def check(self, observation: Observation) -> None:
        """Raise `InputError` for implausible shapes: an obstacle in the object, or one 10 m away.

        The same for regions that leave nothing to touch.
        """
        for kind, shapes in self.kinds():
            for shape in shapes:
                if not isinstance(shape, Shape):
                    raise InputError(f"{kind} holds a {type(shape).__name__}; sgnlp.load_shapes(file) gives shapes")
        told = {kind: [(s.name, s.distance(observation.points)) for s in shapes] for kind, shapes in self.kinds()}
        for name, distances in chain(*told.values()):
            if distances.min() > FAR:
                raise InputError(f"'{name}' is more than {FAR:g} m from the object; is it in metres?")
        for name, distances in told["obstacles"]:
            inside = float((distances < 0).mean())
            if inside > MOST_INSIDE:
                said = "is it in metres, in the frame of the cloud?"
                raise InputError(f"the obstacle '{name}' holds {inside:.0%} of the object's points; {said}")
        for name, distances in told["avoid"]:
            if distances.min() > BESIDE:
                said = "is it in the frame of the cloud?"
                raise InputError(f"the region '{name}' of --avoid is {distances.min():.2f} m from the object; {said}")
        for flag, allowed in (("avoid", False), ("touch", True)):
            near = [distances < NEAR * allowed for _, distances in told[flag]]
            if near and not (np.any(near, axis=0) == allowed).any():
                said = "are its shapes in metres, in the frame of the cloud?"
                raise InputError(f"--{flag} leaves nothing of the object to touch; {said}")

    def and_seen(self, observation: Observation) -> "Surroundings":
        """These, and the obstacles that the observation has seen around its object."""
        return replace(self, obstacles=(*self.obstacles, *seen_shapes(observation)))

    def around(self, settings: Settings, carried: bool = False) -> Around:
        """The kinds of surroundings that programs include, and whether an arm carries the hand."""
        some = bool(self.obstacles)
        return Around(some, settings.motion.samples if some else 0, bool(self.avoid), bool(self.touch), carried)

    def fields(self, thing: Shape, table: float) -> Fields:
        """The distance fields, with a table at this height [m]; `thing` is a box around the object."""
        return fields(self.obstacles, self.avoid, self.touch, thing, table)

    def moved(self, by: Array) -> "Surroundings":
        """The same, displaced by (3,) [m]."""
        if not by.any():
            return self
        return Surroundings(*(tuple(shape.moved(by) for shape in shapes) for _, shapes in self.kinds()))

    def words(self) -> str:
        """Sentences that name the obstacles and the regions that fingers avoid or touch; "" if there are none."""
        told = {"obstacles": "The hand stays clear of", "avoid": "No finger touches", "touch": "Fingers touch within"}
        return " ".join(f"{told[kind]} {_listed(shapes)}." for kind, shapes in self.kinds() if shapes)

    def plain(self) -> dict[str, list[dict[str, Any]]]:
        """The shapes as plain values for JSON."""
        return {kind: [_plain(shape) for shape in shapes] for kind, shapes in self.kinds()}

    @classmethod
    def restored(cls, plain: Mapping[str, Any]) -> "Surroundings":
        """The surroundings from `plain`; older results have none."""
        return cls(**{kind: tuple(_shape(told) for told in plain.get(kind, ())) for kind, _ in NOWHERE.kinds()})

    def kinds(self) -> Iterator[tuple[str, tuple[Shape, ...]]]:
        """The name of each kind and its shapes."""
        yield from (("obstacles", self.obstacles), ("avoid", self.avoid), ("touch", self.touch))


def _listed(shapes: tuple[Shape, ...]) -> str:
    """The names of shapes, with a count if several have the same name."""
    counts = Counter(shape.name for shape in shapes)
    return ", ".join(f"{name} ({count} shapes)" if count > 1 else name for name, count in counts.items())


def _plain(shape: Shape) -> dict[str, Any]:
    return {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in asdict(shape).items()}


def _shape(told: Mapping[str, Any]) -> Shape:
    arrays = {key: np.array(told[key], float) for key in ("centre", "rotation", "half")}
    return Shape(**dict(told) | arrays)


NOWHERE = Surroundings()
"""Nothing around the object, and no region."""
