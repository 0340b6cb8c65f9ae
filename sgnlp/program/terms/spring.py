"""Terms of the springs: contact margins and contact force."""

from typing import Any

from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.terms.term import Term


def margins(forces: Any, normals: Any, friction: Any, op: Ops) -> Any:
    """Contact margins ε_i = -f_i·n_i/|f_i| - 1/√(1 + μ²) (m,), in [-1 - c_μ, 1 - c_μ].

    The paper divides by |f|², which is not an angle. ε_i ≥ 0 exactly when f_i lies in the friction cone.
    """
    return -op.dot(forces, normals) / op.norm(forces) - 1 / (1 + friction**2) ** 0.5


class Spring(Term):
    """E_sp = -Σ log(1 + ε_i(t0)) - Σ log(1 + ε_i(eq))."""

    name = setting = "sp"
    about = "contact forces well inside their friction cones, at first contact and at equilibrium"

    def value(self, g: Grasp, op: Ops) -> Any:
        """Both states have the same weight."""
        initial = margins(g.forces, g.normals, g.friction, op)
        equilibrium = margins(g.forces_eq, g.normals_eq, g.friction, op)
        return -op.sum(op.log(1 + initial)) - op.sum(op.log(1 + equilibrium))


class Force(Term):
    """E_force = -Σ min(f_min, |f_i(eq)|): force is rewarded (the printed sign would minimise it)."""

    name = setting = "force"
    about = "enough contact force"
    constrained_elsewhere = True

    def value(self, g: Grasp, op: Ops) -> Any:
        """Rewarded up to f_min and no further."""
        return -op.sum(op.least(g.force_min, op.norm(g.forces_eq)))
