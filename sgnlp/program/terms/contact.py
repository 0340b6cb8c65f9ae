"""Terms of the contacts: on the surface, where it is well known, with targets inside."""

from typing import Any

from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops
from sgnlp.program.terms.term import Term

FAINT_DENSITY = 1e-2
"""Added to the divisor Σ_k p [1/m], so that a path that never meets the surface has a share of 0, not 0/0."""


class Distance(Term):
    """E_dist = Σ |d_i|, d_i the metric distance of a pad to the surface."""

    name = setting = "dist"
    about = "pads on the surface"
    constrained_elsewhere = True

    def value(self, g: Grasp, op: Ops) -> Any:
        """In metres."""
        return op.sum(op.abs(g.gaps))


class Uncertainty(Term):
    """E_uncer = Σ_i [(1/K) Σ_k p(τ_ik) - p(p_i)]/s_i, p the density of touching under N(d, σ_d²).

    τ_ik are K points from the pregrasp tip to the target. s_i = Σ_k p(τ_ik) makes it a share of the density met on
    the way, as in the paper's release; s_i = 1 m⁻¹ is the printed form with its missing 1/K.
    """

    name = setting = "uncer"
    about = "contacts where the surface is known well"

    def value(self, g: Grasp, op: Ops) -> Any:
        """A pure number either way."""
        path = op.fingers(op.density(g.path_gaps, g.path_deviations), g.path_samples)
        contact = op.density(g.gaps, g.contact_deviations)
        scale = path + FAINT_DENSITY if g.density_share else 1.0
        return op.sum((path / g.path_samples - contact) / scale)


class Targets(Term):
    """E_tar = Σ μ(o_i): targets deep inside. The raw mean: a metric distance is undefined on the medial axis."""

    name = setting = "tar"
    about = "targets deep inside the object"

    def value(self, g: Grasp, op: Ops) -> Any:
        """In metres of the posterior mean."""
        return op.sum(g.target_means)
