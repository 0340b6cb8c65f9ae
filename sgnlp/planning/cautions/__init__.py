"""Cautions: reasons to doubt a plan, each computed from the result, with its threshold and the reason for it.

A caution is a function that returns a sentence, or "" if there is no reason for doubt.
"""

from collections.abc import Callable

from sgnlp.perception.observation import Observation
from sgnlp.planning.cautions import clouds, joined, plans
from sgnlp.planning.cautions.planned import Planned

OfCloud = Callable[[Observation, Planned], str]
OfPlan = Callable[[Planned], str]

OF_CLOUDS: tuple[OfCloud, ...] = (
    clouds.bodies,
    clouds.plane,
    clouds.table_around,
    joined.stand,
    joined.touching,
    clouds.camera_frame,
    clouds.underside,
    clouds.in_the_air,
    clouds.rounded,
    clouds.thin,
    clouds.few_points,
    clouds.cameras,
    clouds.views_apart,
    clouds.thin_walls,
)
OF_PLANS: tuple[OfPlan, ...] = (
    plans.no_feasible,
    plans.moves,
    plans.stopped,
    plans.unsolved,
    plans.beside,
    plans.unseen_contacts,
    plans.uncertain_contacts,
    plans.torques,
    plans.far_start,
    plans.foreign_mount,
    plans.replaced,
)
REMARKS: tuple[OfCloud, ...] = (clouds.one_view, clouds.table_assumed)
"""Remarks that hold for so many clouds that only a report shows them."""


def cautions(result: Planned) -> list[str]:
    """The sentences of all cautions that apply; for a plan without grasps, only those of its cloud."""
    of_plan = [caution(result) for caution in (OF_PLANS if len(result.grasps) else ())]
    return [said for said in (*_of_cloud(OF_CLOUDS, result), *of_plan) if said]


def remarks(result: Planned) -> list[str]:
    """The remarks that a report shows before the cautions."""
    missing = f"The surface and the cautions that need the cloud are left out: {result.missing}."
    said = (missing if result.missing else "", *_of_cloud(REMARKS, result), plans.close_runner_up(result))
    return [sentence for sentence in said if sentence]


def _of_cloud(cautions: tuple[OfCloud, ...], result: Planned) -> list[str]:
    return [] if result.cloud is None else [caution(result.cloud, result) for caution in cautions]
