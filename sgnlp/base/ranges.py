"""Types of settings with the range that a quantity can have: values outside are of another unit, or typing errors."""

from math import pi
from typing import Annotated

from sgnlp.base.checked import POSITIVE

TINY = POSITIVE[0]
HEAVIEST = 100.0
"""[kg] No hand lifts more; a mass in grams is more."""
SOFTEST, STIFFEST = 1.0, 1e5
"""[N/m] Gains are 40 to 400 (paper). In N/mm they would be below 1; at 100 N/mm, 0.1 mm of error makes 10 N."""
ROUGHEST = 5.0
"""Friction coefficient: dry rubber has about 1, the softest silicones about 3; an angle in degrees is more."""

Mass = Annotated[float, (0.0, HEAVIEST)]
BodyMass = Annotated[float, (TINY, HEAVIEST)]
"""Of a body, which has one."""
Friction = Annotated[float, (TINY, ROUGHEST)]
Force = Annotated[float, (0.0, 1e4)]
"""[N] Ten times the bound of the preset `paper`, which is so high that it hardly limits anything."""
LargestForce = Annotated[float, (TINY, 1e4)]
Gain = Annotated[float, (SOFTEST, STIFFEST)]
Compliance = Annotated[float, (0.0, 1.0)]
"""[m/N] That of the softest gain."""
JointStiffness = Annotated[float, (0.0, 1e4)]
"""[N m/rad] The large joints of a Panda have 2900 (`simulation.arm_give`)."""
PositiveJointStiffness = Annotated[float, (TINY, 1e4)]
JointDamping = Annotated[float, (0.0, 1e4)]
"""[N m s] As its spring, for a joint that settles within a second."""
Margin = Annotated[float, (-0.05, 0.5)]
"""[m] The largest sphere of the package's hands has a radius of 45 mm: deeper, it would be through. Hands are 0.2 m
long: farther off, none touches."""
Distance = Annotated[float, (0.0, 0.5)]
"""[m] A margin that only adds, or how far apart two things are."""
Width = Annotated[float, (TINY, 1.0)]
"""[m] A noise, a shift, a smoothing: an object is at most half as wide (`cleaning.max_width`)."""
Travel = Annotated[float, (TINY, 2.0)]
"""[m] A hand and its arm are at most 2 m long."""
Speed = Annotated[float, (TINY, 5.0)]
"""[m/s] The flange of a Panda reaches 2, of a UR10 about 3."""
Seconds = Annotated[float, (0.0, 600.0)]
"""A robot is not to wait longer than ten minutes for a finger."""
Turn = Annotated[float, (TINY, 2 * pi)]
"""[rad] One turn."""
Factor = Annotated[float, (0.0, 1000.0)]
"""Over a hand's own effort or gains: three powers of ten are another unit."""
Weight = Annotated[float, (0.0, 1e7)]
"""A thousand times the largest of the paper; beyond, the other terms vanish in the solver's tolerance."""
SurfaceValue = Annotated[float, (-10.0, 10.0)]
"""[m] A value of the surface's function: objects are smaller."""
SurfaceLength = Annotated[float, (TINY, 10.0)]
"""[m] A length of the surface's model: objects are smaller."""
