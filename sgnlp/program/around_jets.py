"""The jets of what stands around, in the order of `sgnlp.program.around`, at the points that were asked for last."""

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
        self._ends = np.cumsum(counts)[:-1]
        self.jets = np.zeros((sum(counts), JET), order="F")
        kinds = (fields.near, fields.way, fields.arm, fields.avoid, fields.touch)
        self._fields = [shape_jets(field, compiled) for field in kinds]

    def update(self, points: Array, feet: Array, complete: bool) -> None:
        """Take them at points (P, 3) and feet (m, 3) [m]; derivatives are 0 unless they are asked for by `complete`."""
        places = (*np.split(points, self._ends[:2]), feet, feet)
        for field, at, jets in zip(self._fields, places, np.split(self.jets, self._ends), strict=True):
            if len(jets):
                field.into(jets, at, complete)
