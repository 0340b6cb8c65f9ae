"""The lifted program: the tips a and the pose at equilibrium are variables, and what defines them are equations.

    a = FK(v),   Σ k (o - p_eq) = M g e_z,   Σ (p_eq - c_eq) × k (o - p_eq) = 0,
    p_eq = R p + t,   c_eq = R c_g + t = c_g + s,   R the rotation of the Gibbs vector w, tan(θ/2) times its axis

In the variables (x, a, w, s) contacts, path and forces no longer depend on the joints, and R on the grasp only through
the balance: every function is shorter and less curved, the program larger. Its solutions are those of the constrained
one, for `stiffness` keeps out equilibria that are not minima.
"""

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from sgnlp.hand.kinematics import frames
from sgnlp.program import equilibrium
from sgnlp.program.nlp import Nlp, grasp_variables, lifted_units, variable_units

Array = NDArray[np.float64]


def lifted_values(nlp: Nlp, x: Array, p: Array) -> Array:
    """The scaled tips, Gibbs vector and shift (3 m + 6) that the leading variables of x define."""
    hand, given = nlp.hand, nlp.parameters.unpack(p)
    units = variable_units(hand)
    *pose, o, k = grasp_variables(hand, given.wrist, given.joints, x[: len(units)] * units)
    a, _ = frames(hand, *pose)
    grasp = ca.DM(o + given.c * (a - o)), ca.DM(o), ca.DM(k)
    B = equilibrium.profile(*grasp, given.mass, ca.DM(given.com))
    R, _ = equilibrium.rotation(B, equilibrium.root_guess(B))
    shift = R @ given.com + equilibrium.translation(R, *grasp, given.mass) - given.com
    motion = ca.vertcat(equilibrium.gibbs_vector(R), shift)
    return np.concatenate([a.ravel(), np.array(motion).ravel()]) / lifted_units(hand)
