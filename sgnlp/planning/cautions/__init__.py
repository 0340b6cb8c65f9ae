"""What to be wary of before a plan is trusted: each caution computed from the result, with its threshold and why.

A caution takes the result and returns a sentence, or "" where there is no reason for one.
"""

from collections.abc import Callable

from sgnlp.planning.cautions import clouds, plans
from sgnlp.planning.cautions.planned import Planned

Caution = Callable[[Planned], str]

OF_CLOUDS: tuple[Caution, ...] = (
    clouds.bodies,
    clouds.plane,
    clouds.camera_frame,
    clouds.underside,
    clouds.in_the_air,
    clouds.rounded,
    clouds.thin,
    clouds.few_points,
    clouds.thin_walls,
)
OF_PLANS: tuple[Caution, ...] = (
    plans.no_feasible,
    plans.stopped,
    plans.unsolved,
    plans.beside,
    plans.unseen_contacts,
    plans.uncertain_contacts,
    plans.torques,
    plans.far_start,
)
REMARKS: tuple[Caution, ...] = (clouds.missing, clouds.one_view, clouds.table_assumed, plans.close_runner_up)
"""True of so many clouds that only a report says them."""


def cautions(result: Planned) -> list[str]:
    """Every sentence there is reason for; of a plan without grasps, those of its cloud."""
    return _said((*OF_CLOUDS, *(OF_PLANS if len(result.grasps) else ())), result)


def remarks(result: Planned) -> list[str]:
    """What a report says before them."""
    return _said(REMARKS, result)


def _said(cautions: tuple[Caution, ...], result: Planned) -> list[str]:
    return [said for caution in cautions if (said := caution(result))]
