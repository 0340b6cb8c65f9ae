"""The constrained program with tips and the pose at equilibrium as variables, defined by equations.

    a = FK(v),   Σ k (o - p_eq) = M g e_z,   Σ (p_eq - c_eq) × k (o - p_eq) = 0,
    p_eq = R p + t,   c_eq = R c_g + t = c_g + s,   R the rotation of the Gibbs vector w, tan(θ/2) times its axis

In the variables (x, a, w, s) contacts, path and forces do not depend on the joints, and R depends on the grasp only
through the balance. So every function is shorter and less curved, and the program is larger. Its solutions are those of
the constrained one, because `stiffness` excludes equilibria that are not minima.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import casadi as ca
import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand
from sgnlp.hand.kinematics import frames
from sgnlp.program import equilibrium
from sgnlp.program.attitude import stiffness
from sgnlp.program.constraint import FORCE, LENGTH, TORQUE, Constraint, Rows
from sgnlp.program.formulation import Bounds
from sgnlp.program.formulations.constrained import Constrained
from sgnlp.program.lifting import Lifting
from sgnlp.program.names import AXES
from sgnlp.program.nlp import Nlp
from sgnlp.program.oracle import Oracle
from sgnlp.program.variables import Variables, posture

UNITS = {"tip": 0.1, "rotation": 0.1, "displacement": 0.01}
"""Units of the added variables [m, -, m], so that all are of order 1."""
EQUATIONS = (
    Constraint("tip", Rows("tip_errors"), 0.0, 0.0, LENGTH, over="tip"),
    Constraint("balance_force", Rows("wrench_eq", row=0), 0.0, 0.0, FORCE, over="axis"),
    Constraint("balance_torque", Rows("wrench_eq", row=1), 0.0, 0.0, TORQUE, over="axis"),
)
"""The equations that define the added variables."""


@dataclass(frozen=True)
class Lifted(Constrained):
    """More variables and more equations, each of them short."""

    def check(self, settings: Settings) -> None:
        """Refuse settings without the springs' exact equilibrium, whose equations it uses."""
        metric, kind = settings.contact.metric, settings.contact.equilibrium
        if (metric, kind) != ("spring", "exact"):
            needs = "needs --contact.metric spring and --contact.equilibrium exact"
            raise InputError(f"--solver.formulation lifted {needs}, not {metric} and {kind}")

    def constraints(self, constraints: Sequence[Constraint]) -> tuple[Constraint, ...]:
        """The constraints of the plan, and its own equations."""
        return (*constraints, *EQUATIONS)

    def variables(self, hand: Hand) -> Variables:
        """Tips (m, 3) row by row, Gibbs vector (3) and shift (3) of the motion to the equilibrium."""
        tips = [f"tip.{finger.name}.{axis}" for finger in hand.fingers for axis in AXES]
        motion = [f"equilibrium.{kind}{axis}" for kind in ("r", "") for axis in AXES]
        units = [UNITS["tip"]] * len(tips) + [UNITS["rotation"]] * 3 + [UNITS["displacement"]] * 3
        return Variables((*tips, *motion), np.array(units))

    def variable_bounds(self, nlp: Nlp, g_bounds: Bounds) -> Bounds:
        """No bounds: the equations determine them."""
        free = np.full(len(self.variables(nlp.hand).units), np.inf)
        return -free, free

    def begin(self, oracle: Oracle, x: Array, p: Array, g_bounds: Bounds) -> Array:
        """The tips, Gibbs vector and shift that x defines."""
        hand, given = oracle.nlp.hand, oracle.nlp.parameters.unpack(p)
        at = posture(hand, oracle.nlp.structure.at_contact, (given.wrist, given.joints), x, float(given.c[0]))
        a, _ = frames(hand, at.wrist, at.joints)
        o, k = at.targets, at.gains
        grasp = ca.DM(o + at.c[:, None] * (a - o)), ca.DM(o), ca.DM(k)
        B = equilibrium.profile(*grasp, given.mass, ca.DM(given.com))
        R, _ = equilibrium.rotation(B, equilibrium.root_guess(B))
        mean_p, mean_o = (equilibrium.weighted_mean(grasp[2], points) for points in grasp[:2])
        shift = R @ given.com + equilibrium.translation(R, mean_p, mean_o, grasp[2], given.mass) - given.com
        motion = ca.vertcat(equilibrium.gibbs_vector(R), shift)
        return np.concatenate([a.ravel(), np.array(motion).ravel()]) / self.variables(hand).units

    def tips(self, added: ca.SX, tips: ca.SX) -> ca.SX:
        """Those that are variables."""
        m = tips.shape[0]
        return ca.reshape(added[: 3 * m], 3, m).T

    def rotation(self, added: ca.SX, B: ca.SX, lifting: Lifting) -> tuple[ca.SX, ca.SX]:
        """R of the Gibbs vector, and ρ, which is correct if R is that of an equilibrium."""
        R = lifting.lift("rotation", equilibrium.turned(added[-6:-3]))
        return R, stiffness(R, B, lifting)

    def translation(self, added: ca.SX, R: ca.SX, par: SimpleNamespace, p: ca.SX, o: ca.SX, k: ca.SX) -> ca.SX:
        """t, which moves the object's centre by the shift."""
        return par.com + added[-3:] - R @ par.com
