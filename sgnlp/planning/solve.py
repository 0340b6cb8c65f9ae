"""Plan grasps: from an observation to ranked solutions."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from math import inf

from sgnlp.base.errors import InputError
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.observation import Observation
from sgnlp.perception.shape import Shape
from sgnlp.planning.additions import Additions
from sgnlp.planning.ending import ENOUGH, LEFT, Ending
from sgnlp.planning.extension import Extension
from sgnlp.planning.faraway import moved_cloud, moved_hand, moved_problem, origin
from sgnlp.planning.plan import Plan
from sgnlp.planning.pool import Failure
from sgnlp.planning.problem import build_problem
from sgnlp.planning.reach import OUT_OF_REACH
from sgnlp.planning.search import Result, Search
from sgnlp.planning.solvers import settled, solver_named
from sgnlp.planning.solvers.solver import Solver
from sgnlp.planning.surroundings import Surroundings
from sgnlp.program.constraint import Constraint
from sgnlp.program.formulation import Formulation
from sgnlp.program.terms import Term
from sgnlp.surface.kernel import Kernel


def solve(
    observation: Observation,
    hand: str | Hand = "allegro_left",
    settings: Settings = ROBUST,
    *,
    obstacles: Sequence[Shape] = (),
    avoid: Sequence[Shape] = (),
    touch: Sequence[Shape] = (),
    terms: Sequence[Term] = (),
    constraints: Sequence[Constraint] = (),
    without_terms: Sequence[str] = (),
    without_constraints: Sequence[str] = (),
    formulation: Formulation | None = None,
    solver: Solver | str | None = None,
    kernel: type[Kernel] | None = None,
    extension: Extension | None = None,
    count: int = 7,
    seed: int = 0,
    jobs: int = 2,
    timeout: float = 60.0,
    first: int | None = None,
    deadline: float | None = None,
    progress: Callable[[Result], None] = lambda result: None,
) -> Plan:
    """Plan compliant pregrasps for an observation.

    Args:
        observation: the cloud, from `sgnlp.load` or `sgnlp.observe`.
        hand: name of a hand, or a loaded one.
        settings: all settings; `sgnlp.preset` has "robust" (default) and "paper".
        obstacles: what the hand stays clear of, beside the table and what the observation has seen around the object.
        avoid: regions in which no finger is to touch the object.
        touch: regions in one of which each finger is to touch it.
        terms: added to those of the settings; one of a built-in name takes that one's place.
        constraints: the same.
        without_terms: names of built-in terms to leave out.
        without_constraints: names of built-in constraints to leave out.
        formulation: in the place of that of the settings.
        solver: in the place of Ipopt as the settings have it: a name of `sgnlp solvers`, or an object of yours.
        kernel: of the surface, a subclass of `sgnlp.Kernel`; in the place of that of the settings.
        extension: what a file adds to all of these, from `sgnlp.extension`.
        count: number of starts; the first are those of the hand's file.
        seed: of the training set and of the starts beyond the file's. The same seed gives the same result.
        jobs: worker processes; the result does not depend on it.
        timeout: wall-clock limit of a start [s].
        first: end when so many feasible grasps are known, counted in the order of the starts, so that the result does
            not depend on `jobs`; None for all.
        deadline: end so long after the call [s], with the best known by then; None for never. Fitting the surface, and
            building the functions of the first plan of a process, are not interrupted.
        progress: called with each result as it comes.

    Raises:
        InputError: the hand, a setting or a name is not valid, or the surface cannot be fitted.
    """
    if min(count, jobs) < 1 or not timeout > 0 or seed < 0:
        raise InputError(f"count {count}, jobs {jobs}, timeout {timeout:g} must be positive, seed {seed} not negative")
    begin, ending = time.perf_counter(), Ending(first, deadline)
    solver = solver_named(solver) if isinstance(solver, str) else solver
    without = tuple(without_terms), tuple(without_constraints)
    additions = Additions(tuple(terms), tuple(constraints), *without, formulation, solver, kernel)
    additions = additions.and_of(extension.additions()) if extension else additions
    hand = load_hand(hand, settings.spheres) if isinstance(hand, str) else hand
    given = Surroundings(tuple(obstacles), tuple(avoid), tuple(touch))
    middle = origin(observation)
    near = moved_cloud(observation, -middle), moved_hand(hand, -middle), given.moved(-middle)
    far = bool(middle.any())
    cloud, hand, around = near if far else (observation, hand, given)
    problem = build_problem(cloud, hand, settings, seed, additions, around)
    chosen = settled(additions.solver, settings.solver)
    search = Search(problem, cloud, middle, chosen, count, seed, jobs, timeout)
    fitted = time.perf_counter()
    results: list[Result] = []
    with closing(search.results(until=inf if deadline is None else begin + deadline)) as ended:
        for result in ended:
            progress(result)
            results.append(result)
            if kept := ending.kept(results, search.order):
                results = kept
                break
    found = search.found(results)
    seconds = {"fit": fitted - begin, "solve": time.perf_counter() - fitted}
    return Plan(observation, *found, seed, jobs, timeout, seconds, extension, chosen, given, ending)


def improve(plan: Plan, count: int = 0) -> Iterator[Plan]:
    """Go on with the starts that a plan left out, yielding a better plan whenever one of them ends.

    Leaving the iteration ends the processes. The last plan is the one that `solve` gives without `first` and
    `deadline`.

    Args:
        plan: of `sgnlp.solve`, that ended with its `first` grasps or at its `deadline`.
        count: number of starts in all, if it is more than the plan's.

    Raises:
        InputError: `count` is negative.
    """
    if count < 0:
        raise InputError(f"count {count} must not be negative")
    begin, middle = time.perf_counter() - plan.seconds["solve"], origin(plan.observation)
    far, count = bool(middle.any()), max(count, len(plan.solutions) + len(plan.failures))
    problem = moved_problem(plan.problem, -middle) if far else plan.problem
    cloud = moved_cloud(plan.observation, -middle) if far else plan.observation
    search = Search(problem, cloud, middle, plan.solver, count, plan.seed, plan.jobs, plan.timeout)
    known: list[Result] = [*plan.solutions]
    known += [f for f in plan.failures if f.reason not in (*LEFT, OUT_OF_REACH)]
    results: list[Result] = []
    left = dict.fromkeys(search.order, ENOUGH) | {f.start: f.reason for f in plan.failures if f.reason in LEFT}
    for result in known:
        left.pop(result.start)
    with closing(search.results({result.start for result in known})) as ended:
        for result in ended:
            results.append(result)
            del left[result.start]
            waiting = [Failure(index, reason) for index, reason in left.items()]
            _, solutions, failures = search.found(results, [*known, *waiting])
            seconds = plan.seconds | {"solve": time.perf_counter() - begin}
            ending = plan.ending if left else Ending()
            yield replace(plan, solutions=solutions, failures=failures, seconds=seconds, ending=ending)
