"""Why trials failed: the plan compared with the true object, for first choices that did not hold."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.experiments.studies import trials
from sgnlp.experiments.studies.study import Setup
from sgnlp.experiments.studies.trials import LOADS, Condition, Row
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.truth import signed_distance
from sgnlp.planning.plan import Plan
from sgnlp.simulation import Outcome, true_body

# a pad has missed the surface if the surface is farther off than this [m], a quarter of the pads' size
SURFACE_ERROR = 5e-3
MOTION_ERROR = 10.0  # an equilibrium farther off than this [mm] counts as a reason


@dataclass(frozen=True, eq=False)
class Failed:
    """A trial carried out again, to look at it.

    `surface_errors` (m,) [m] are the distances of the true surface behind the planned contacts, negative before them.
    Without a feasible grasp there are none, and no outcome.
    """

    row: Row
    plan: Plan
    outcome: Outcome | None
    surface_errors: Array

    @property
    def name(self) -> str:
        """Object, condition and load, as the name of a file."""
        words = f"{self.row.object} {self.row.condition} {self.row.load}"
        return "".join(c if c.isalnum() or c in "._" else "-" for c in words.replace("μ", "mu").replace(", ", " "))

    @property
    def reasons(self) -> list[str]:
        """What differed from the plan, the earliest first."""
        row, outcome = self.row, self.outcome
        if outcome is None:
            return [row.ending]
        fingers = [finger.name for finger in self.plan.problem.hand.fingers]
        found = [
            f"{finger}: the true surface is {1e3 * abs(e):.0f} mm {'behind' if e > 0 else 'before'} the estimated one"
            for finger, e in zip(fingers, self.surface_errors, strict=True)
            if abs(e) > SURFACE_ERROR
        ]
        if row.ending == "in collision":
            found.append(f"the pregrasp is {row.penetration_mm:.0f} mm inside")
        if outcome.closing and outcome.closing.premature:
            found.append(f"{', '.join(outcome.closing.premature)} touch before the last pad")
        if row.shift_error_mm > MOTION_ERROR:
            found.append(f"the equilibrium is {row.shift_error_mm:.0f} mm off the planned one")
        if row.slip_mm > 1e3 * LOADS[row.load].slip_limit:
            found.append(f"a pad slides {row.slip_mm:.0f} mm")
        return found or [f"the object rises {row.rise_mm:.0f} mm only"]


def again(setup: Setup, files: dict[str, Path], conditions: Sequence[Condition], row: Row) -> Failed:
    """A failed trial of one of the conditions, carried out again; `files` by the names of their objects."""
    (condition,) = (c for c in conditions if c.name == row.condition)
    plan = trials.planned(setup, files[row.object], condition, row.views.split())
    if plan.best is None:
        return Failed(row, plan, None, np.empty(0))
    truth = true_body(plan.observation)
    errors = signed_distance(Mesh(truth.vertices, truth.faces.astype(np.int64)), plan.best.contact_points)
    return Failed(row, plan, trials.carried_out(plan, LOADS[row.load]), errors)
