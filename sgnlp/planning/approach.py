"""Where on its path a finger is likely to meet the surface: the contact density of E_uncer along whole paths.

    τ_i(α) = a_i + α (o_i - a_i),   p(α) = N(d(τ_i(α)); 0, σ_d(τ_i(α))²),   contact at α = 1 - c

With `contact.density` share, p is divided by s_i, its sum over the K samples; then (1/K) Σ_k p(α_k) - p(1 - c) is the
finger's part of E_uncer. A good path has one narrow peak, at the contact (paper, figure of the p.d.f.).
"""

from dataclasses import dataclass, replace

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.planning.problem import Problem
from sgnlp.planning.recompute import recompute
from sgnlp.program.ops import Exact
from sgnlp.program.terms.contact import FAINT_DENSITY
from sgnlp.program.variables import Posture

FINE = 201
"""Number of points at which a path is drawn."""


@dataclass(frozen=True, eq=False)
class Approach:
    """A finger's path from the pregrasp tip to the target, at F points; densities are shares, or in 1/m."""

    finger: str
    way: Array  # (F,) [m] from the pregrasp tip
    gap: Array  # (F,) [m] mean distance of the pad to the surface
    deviation: Array  # (F,) [m]
    density: Array  # (F,)
    sample_way: Array  # (K,) [m]
    sample_density: Array  # (K,)
    contact_way: float  # [m]
    contact_density: float


def approaches(problem: Problem, at: Posture) -> list[Approach]:
    """The path of each finger of a grasp."""
    op, contact, m = Exact(), problem.settings.contact, len(at.gains)
    g, _ = recompute(problem, at)
    settings = replace(problem.settings, contact=replace(contact, samples=FINE))
    fine, _ = recompute(replace(problem, settings=settings), at)
    length = np.linalg.norm(g.targets - g.tips, axis=1)  # (m,)
    samples = op.density(g.path_gaps, g.path_deviations).reshape(m, -1)
    scale = samples.sum(axis=1) + FAINT_DENSITY if g.density_share else np.ones(m)
    gaps, deviations = fine.path_gaps.reshape(m, -1), fine.path_deviations.reshape(m, -1)
    densities = op.density(gaps, deviations) / scale[:, None]
    at_contact = op.density(g.gaps, g.contact_deviations) / scale
    return [
        Approach(
            finger=finger.name,
            way=np.linspace(0, length[i], FINE),
            gap=gaps[i],
            deviation=deviations[i],
            density=densities[i],
            sample_way=np.linspace(0, length[i], contact.samples),
            sample_density=samples[i] / scale[i],
            contact_way=float((1 - at.c[i]) * length[i]),
            contact_density=float(at_contact[i]),
        )
        for i, finger in enumerate(problem.hand.fingers)
    ]
