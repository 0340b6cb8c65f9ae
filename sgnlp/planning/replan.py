"""A plan carried over to what is seen now, or was touched: from its own grasp and multipliers, in this process."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import acos, degrees
from types import NoneType

import numpy as np

from sgnlp.base.arrays import Array, floats
from sgnlp.base.errors import InputError, SolverError
from sgnlp.base.threads import one_thread
from sgnlp.hand.hand import Hand
from sgnlp.perception.observation import Observation
from sgnlp.planning import arguments
from sgnlp.planning.faraway import moved_cloud, moved_hand, moved_problem, origin
from sgnlp.planning.plan import Plan
from sgnlp.planning.planner import Planner
from sgnlp.planning.pool import Failure
from sgnlp.planning.problem import Known, Problem, build_problem, with_limits
from sgnlp.planning.resuming import resuming
from sgnlp.planning.search import Result, Search
from sgnlp.planning.solution import Solution, solution
from sgnlp.planning.solve import Asked, searched
from sgnlp.planning.warm_start import WarmStart
from sgnlp.planning.widening import narrow
from sgnlp.surface.gpis import Gpis
from sgnlp.surface.registration import PlanarMotion, registered

TRIES = 3
"""So many grasps of the plan are carried over, best first, until one is feasible."""
NOISE = 0.001
"""Deviation of a touched point [m]: what joint sensors and a URDF leave of a fingertip's place."""
BESIDE, SLANT = 0.008, 0.004
"""A touch's normal is told by a point so far outside and one inside [m], with this deviation [m]: the normal is right
to atan(SLANT/BESIDE) then, 27°."""
REACH = 0.03
"""A touch is within this [m] of the box of what was seen; farther off it is another thing, or another frame."""
OPPOSITE = -0.5
"""A touch is doubted whose normal has a smaller cosine with that of the surface there, 120° off or more. On 12 objects
seen from one view that is so for 5 of 100 true normals, most in the mug, and for 87 of 100 that point inward."""

TINY = float(np.finfo(float).tiny)
STILL = PlanarMotion(np.zeros(3), 0.0, np.zeros(3))


@dataclass(frozen=True)
class Touch:
    """A finger met the object at `point` (3,) [m] of its surface, whose outward `normal` (3,) was felt there."""

    point: Sequence[float] | Array
    normal: Sequence[float] | Array

    def __post_init__(self) -> None:
        """Also that both are three finite numbers, and the normal is a direction."""
        for name in ("point", "normal"):
            value = floats(getattr(self, name), f"the {name} of a touch", (3,))
            if not np.isfinite(value).all():
                raise InputError(f"the {name} of a touch must be three finite numbers, not {getattr(self, name)}")
        if not np.linalg.norm(self.normal) > 0:
            raise InputError("the normal of a touch must not be 0")


TOUCH: arguments.Kinds = ((Touch,), "sgnlp.Touch(point, normal) makes one")
KINDS: dict[str, arguments.Kinds] = {
    "plan": arguments.PLAN,
    "observation": ((Observation, NoneType), arguments.OBSERVATION[1]),
    "touches": arguments.LIST,
}


def replan(plan: Plan, observation: Observation | None = None, touches: Sequence[Touch] = ()) -> Plan:
    """Plan again for a cloud that differs a little, or for what fingers have touched, in some hundredths of a second.

    If the new points lie on the known surface, moved on the table, the surface moves with them. Else it is fitted anew.
    The grasps of the plan move with the object, and the solver goes on from where it ended, with its multipliers. If
    none of the best `TRIES` is feasible then, all is planned afresh. `Plan.replanned` says which it was.

    Args:
        plan: of `sgnlp.solve` or `sgnlp.replan`.
        observation: what is seen now, with its table and obstacles; what was seen before if None.
        touches: where fingers met the object, in the frame of the cloud. The notes of the new plan's observation tell
            of those whose normal points into the object, as far as it is known.

    Raises:
        InputError: a touch is far from the object.
    """
    arguments.check({"plan": plan, "observation": observation, "touches": touches}, KINDS)
    for touch in touches:
        arguments.check({"a touch": touch}, {"a touch": TOUCH})
    with one_thread():
        return _replanned(plan, observation, touches)


def _replanned(plan: Plan, observation: Observation | None, touches: Sequence[Touch]) -> Plan:
    begin, seen = time.perf_counter(), observation or plan.observation
    middle, asked = origin(seen), _asked(plan)
    hand = moved_hand(asked.hand, -middle)
    settled_in = PlanarMotion(np.zeros(3), 0.0, origin(plan.observation) - middle)
    near, cloud = moved_problem(plan.problem, -middle), moved_cloud(seen, -middle)
    motion, known = _carried(near, plan.observation.points - middle, cloud) if observation else (STILL, _known(near))
    felt = [Touch(np.asarray(touch.point) - middle, touch.normal) for touch in touches]
    bare = _posed(cloud, hand, asked, middle, known)
    _check_reach(touches, bare.box + middle)
    problem = _with_touches(bare, felt)
    seen = replace(seen, notes=tuple(dict.fromkeys((*seen.notes, *_inward(bare.gpis, felt, middle)))))
    fitted, planner, results = time.perf_counter(), resuming(problem, plan.solver), list[Result]()
    nlp = planner.stages[-1].nlp
    for old in [s.ended for s in plan.solutions if s.feasible and s.ended][:TRIES]:
        results.append(_resumed(planner, old.moved(nlp, settled_in).moved(nlp, motion)))
        if isinstance(results[-1], Solution) and results[-1].feasible:
            break
    else:
        problem = problem if known is None else _with_touches(_posed(cloud, hand, asked, middle, None), felt)
        if plan.widened:
            problem = with_limits(problem, narrow(problem.settings).limits)
            asked = replace(asked, settings=problem.settings)
        return searched(seen, (problem, cloud, middle), asked, begin)
    search = Search(problem, cloud, middle, plan.solver, 1, plan.seed, 1, plan.timeout)
    seconds = {"fit": fitted - begin, "solve": time.perf_counter() - fitted}
    again = asked.plan(seen, search.found(results), seconds, plan.solver, "moved" if known else "fitted")
    return replace(again, widened=plan.widened)


def _asked(plan: Plan) -> Asked:
    """What the plan was asked for, but for its end."""
    problem = plan.problem
    given = problem.hand, problem.settings, plan.given, problem.additions, plan.extension
    return Asked(*given, plan.count, plan.seed, plan.jobs, plan.timeout, plan.ending.whole)


def _known(problem: Problem) -> Known | None:
    return problem.gpis, problem.com


def _carried(problem: Problem, before: Array, cloud: Observation) -> tuple[PlanarMotion, Known | None]:
    """The motion of the object since points (N, 3) of it were seen, and its surface moved, if it is known by that."""
    found = registered(problem.gpis, before, cloud.points, cloud.table_height - problem.table_height)
    motion = found.motion
    return motion, (motion.moved(problem.gpis), motion(problem.com)) if found.fits else None


def _posed(cloud: Observation, hand: Hand, asked: Asked, middle: Array, known: Known | None) -> Problem:
    """The problem of a cloud whose surface is known, or is to be fitted; moved by -`middle`."""
    return build_problem(cloud, hand, asked.settings, asked.seed, asked.additions, asked.given.moved(-middle), known)


def _inward(gpis: Gpis, touches: Sequence[Touch], middle: Array) -> Iterator[str]:
    """Sentences on touches, moved by -`middle`, whose normals are opposite to those of the surface."""
    for touch in touches:
        point, normal = np.asarray(touch.point, float), np.asarray(touch.normal, float)
        surface = gpis.normal(point[None])[0]
        cosine = float(normal @ surface) / max(float(np.linalg.norm(normal) * np.linalg.norm(surface)), TINY)
        if cosine < OPPOSITE:
            yield (
                f"The normal of the touch at {(point + middle).round(3).tolist()} m points into the object as it is "
                f"known, {degrees(acos(max(cosine, -1.0))):.0f} deg off its surface; it must point outward, from the "
                "object to the finger: if it does not, give it the other sign."
            )


def _with_touches(problem: Problem, touches: Sequence[Touch]) -> Problem:
    """The problem of an object that was touched."""
    return replace(problem, gpis=touched(problem.gpis, touches)) if touches else problem


def _check_reach(touches: Sequence[Touch], box: Array) -> None:
    """Raise `InputError` for a touch far from the seen points, whose `box` (2, 3) [m] is in the frame of the cloud."""
    for touch in touches:
        point = np.asarray(touch.point, float)
        if (np.maximum(box[0] - point, point - box[1]) > REACH).any():
            raise InputError(
                f"the touch at {point.round(3).tolist()} m is more than {100 * REACH:g} cm beside the object; "
                "is it in metres, in the frame of the cloud?"
            )


def touched(gpis: Gpis, touches: Sequence[Touch]) -> Gpis:
    """The surface that goes through touched points with their normals.

    Three observations a touch: 0 at the point p, ±`BESIDE` at p ± `BESIDE` n.
    """
    for touch in touches:
        point, normal = np.asarray(touch.point, float), np.asarray(touch.normal, float)
        side = BESIDE * normal / np.linalg.norm(normal)
        gpis = gpis.observed(point[None], np.zeros(1), NOISE)
        gpis = gpis.observed(point + np.stack([side, -side]), np.array([BESIDE, -BESIDE]), SLANT)
    return gpis


def _resumed(planner: Planner, warm: WarmStart) -> Result:
    """The solution that a warm start leads to."""
    try:
        iterate = planner.resume(warm)
    except SolverError as error:
        return Failure(warm.start.index, str(error))
    return solution(planner.problem, warm.start, iterate, planner.stages[-1].nlp)
