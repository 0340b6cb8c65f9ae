"""The energy terms of the paper, and those that it lacks, one class each."""

from dataclasses import replace

from sgnlp.base.settings import Settings
from sgnlp.program.around import ALONE, Around
from sgnlp.program.terms.barrier import Stability
from sgnlp.program.terms.closure import Closure, Deviation
from sgnlp.program.terms.collision import Collision
from sgnlp.program.terms.contact import Distance, Targets, Uncertainty
from sgnlp.program.terms.regularisation import Arm, Closing, Gains, Joints, Motion, Pose
from sgnlp.program.terms.spring import Force, Spring
from sgnlp.program.terms.term import Term

COMPLIANT: tuple[Term, ...] = (
    Spring(),
    Distance(),
    Uncertainty(),
    Gains(),
    Targets(),
    Collision(),
    Joints(),
    Motion(),
    Force(),
    Pose(),
    Stability(),
)
"""The terms of a compliant grasp, in the order of the paper's equation and of every table."""
CLOSURE: tuple[Term, ...] = (Distance(), Collision(), Joints(), Closure(), Deviation())
"""The terms of force closure, the paper's bilevel baseline."""

__all__ = ["CLOSURE", "COMPLIANT", "Term", "preset_terms"]


def preset_terms(settings: Settings, around: Around = ALONE) -> tuple[Term, ...]:
    """The built-in terms of the settings, with their weights. E_pose replaces the penalty of the motion.

    E_arm is added if an arm carries the hand.
    """
    terms = COMPLIANT if settings.contact.metric == "spring" else CLOSURE
    terms += (Closing(),) if settings.closing.planned else ()
    terms += (Arm(),) if around.carried else ()
    moved = settings.weights.pose > 0
    weights = {t: 0.0 if moved and isinstance(t, Motion) else getattr(settings.weights, t.setting) for t in terms}
    return tuple(replace(term, weight=weight) for term, weight in weights.items())
