"""The estimated surface in the place of the true one, for an object that nobody has measured.

A grasp that holds it holds what the plan believes in: this tests motors, mass, friction, gaps and errors of the hand's
place, but not the estimate.
"""

from dataclasses import replace

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.checked import require
from sgnlp.perception.observation import Observation
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.planning.problem import Problem
from sgnlp.surface.level_set import level_set

MARGIN = 0.03
"""Around the measured points, within which the surface may lie [m]: twice the mean error of sides that nobody saw where
no free space is known (`results/calibration`)."""


def estimated(observation: Observation, problem: Problem) -> Observation:
    """The observation with the zero level set of the posterior mean, above the table, as its true surface.

    Of several closed parts it is the one with the most faces. Both arguments are a plan's: `plan.observation` and
    `plan.problem`.

    Raises:
        InputError: an argument is of another kind, the posterior has no surface near the points, or scikit-image is
            not installed.
    """
    require("observation", observation, Observation)
    require("problem", problem, Problem)
    table = observation.table_height
    low, high = problem.box[0] - MARGIN, problem.box[1] + MARGIN
    low[2] = table

    def outside(points: Array) -> Array:
        walls = np.maximum(low - points, points - high).max(axis=1)  # closed at the table, and at the box's sides
        return np.asarray(np.maximum(problem.gpis.mean(points), walls))

    step = MARGIN / 2
    parts = Mesh(*level_set(outside, low - step, high + step)).parts()
    largest = max(parts, key=lambda part: len(part.faces))
    return replace(observation, mesh_vertices=largest.vertices, mesh_faces=largest.faces)
