"""The surroundings of the object in the program: distances at points of the hand, as jets like the surface's.

Points, in their order, with S spheres of the hand, A postures of the approach, A' free spheres of the arm, m fingers:

    pregrasp s (S), first contact w (S), approach s - (j/A) l R a (A S), lift w + h e_z (S)     if there are obstacles
    free spheres of the arm, at the pregrasp, at the stand-off and lifted (3 A')             if the hand is on an arm
    feet of the contacts (m)                                                     if there are regions to avoid or touch

a is the direction that the palm faces, l the stand-off, h the lift. The program gets the jets as numbers, so that one
compiled program serves every scene, with any number of obstacles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from sgnlp.perception.shape import Shape
from sgnlp.surface.shape_field import ShapeField

POSTURES = 3
"""Number of postures besides those of the approach: pregrasp, first contact, lift."""


@dataclass(frozen=True)
class Around:
    """The kinds of surroundings in a program."""

    obstacles: bool = False
    """whether obstacles are kept clear of"""
    approach: int = 0
    """A, postures of the approach; 0 without obstacles"""
    avoid: bool = False
    """whether pads avoid a part of the surface"""
    touch: bool = False
    """whether pads touch a part of the surface"""
    carried: bool = False
    """whether an arm carries the hand"""

    def points(self, spheres: int) -> int:
        """The number of points that follow from the variables alone, for this number of spheres."""
        return spheres * (POSTURES + self.approach) if self.obstacles else 0

    def regions(self, fingers: int) -> int:
        """The number of feet whose distances are needed."""
        return fingers * (self.avoid + self.touch)


ALONE = Around()
"""Nothing around the object but the table."""


@dataclass(frozen=True, eq=False)
class Fields:
    """The distance fields of the surroundings.

    `near` has the obstacles. `way` has the table too, which counts as an obstacle on approach and lift. `arm` also has
    the box of the object.
    """

    near: ShapeField = field(default_factory=lambda: ShapeField(()))
    way: ShapeField = field(default_factory=lambda: ShapeField(()))
    avoid: ShapeField = field(default_factory=lambda: ShapeField(()))
    touch: ShapeField = field(default_factory=lambda: ShapeField(()))
    arm: ShapeField = field(default_factory=lambda: ShapeField(()))


def fields(
    obstacles: Sequence[Shape], avoid: Sequence[Shape], touch: Sequence[Shape], thing: Shape, table: float
) -> Fields:
    """The fields of these shapes over a table at a height [m]; `thing` is a box around the object."""
    floor = Shape.half_space([0.0, 0.0, table], [0.0, 0.0, 1.0], "table")
    way = (*obstacles, floor)
    kinds = (obstacles, way, avoid, touch, (*way, thing))
    return Fields(*map(ShapeField, kinds))
