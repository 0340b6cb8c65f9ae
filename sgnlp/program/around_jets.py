"""The jets of the surroundings, in the order of `sgnlp.program.around`, at the last points."""

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.program.around import Around, Fields
from sgnlp.surface.jets import JET
from sgnlp.surface.native_shapes import shape_jets


class AroundJets:
    """`jets` (P + regions, 10) at P points of an `Around` and at its regions' feet, in C if `compiled`.

    `sizes` are the numbers of spheres of the hand, of all points P, and of fingers.
    """

    def __init__(self, fields: Fields, around: Around, sizes: tuple[int, int, int], compiled: bool = True):
        spheres, points, m = sizes
        still, own = 2 * spheres * around.obstacles, around.points(spheres)  # pregrasp and first contact; all
        counts = [still, own - still, points - own, m * around.avoid, m * around.touch]
        self.jets = np.zeros((sum(counts), JET), order="F")
        kinds = (fields.near, fields.way, fields.arm, fields.avoid, fields.touch)
        at = (slice(still), slice(still, own), slice(own, None), None, None)  # of the points; else the feet
        parts = zip(kinds, at, np.split(self.jets, np.cumsum(counts)[:-1]), strict=True)
        self._parts = [(shape_jets(field, compiled), where, jets) for field, where, jets in parts if len(jets)]

    def update(self, points: Array, feet: Array, complete: bool) -> None:
        """Evaluate them at points (P, 3) and feet (m, 3) [m]; derivatives are 0 unless `complete`."""
        for field, where, jets in self._parts:
            field.into(jets, feet if where is None else points[where], complete)
