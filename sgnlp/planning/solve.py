"""Plan grasps: from an observation to ranked solutions."""

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace

from sgnlp.base.errors import InputError
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.observation import Observation
from sgnlp.perception.shape import Shape
from sgnlp.planning.additions import Additions
from sgnlp.planning.confidence import with_confidence
from sgnlp.planning.extension import Extension
from sgnlp.planning.faraway import moved_cloud, moved_hand, moved_problem, moved_solution, origin
from sgnlp.planning.plan import Plan
from sgnlp.planning.pool import Failure, solve_all
from sgnlp.planning.problem import build_problem
from sgnlp.planning.reach import OUT_OF_REACH, reachable
from sgnlp.planning.solution import Solution, rank
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
    progress: Callable[[Solution | Failure], None] = lambda result: None,
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
        progress: called with each result as it comes.

    Raises:
        InputError: the hand, a setting or a name is not valid, or the surface cannot be fitted.
    """
    if min(count, jobs) < 1 or not timeout > 0 or seed < 0:
        raise InputError(f"count {count}, jobs {jobs}, timeout {timeout:g} must be positive, seed {seed} not negative")
    begin = time.perf_counter()
    solver = solver_named(solver) if isinstance(solver, str) else solver
    middle = origin(observation)
    far = bool(middle.any())
    without = tuple(without_terms), tuple(without_constraints)
    additions = Additions(tuple(terms), tuple(constraints), *without, formulation, solver, kernel)
    additions = additions.and_of(extension.additions()) if extension else additions
    chosen = settled(additions.solver, settings.solver)
    near = moved_cloud(observation, -middle) if far else observation
    given = Surroundings(tuple(obstacles), tuple(avoid), tuple(touch))
    hand = load_hand(hand, settings.spheres) if isinstance(hand, str) else hand
    if far:
        hand, given_near = moved_hand(hand, -middle), given.moved(-middle)
    problem = build_problem(near, hand, settings, seed, additions, given_near if far else given)
    fitted = time.perf_counter()
    results: list[Solution | Failure] = []
    begins, missed = reachable(problem, count, seed)
    out = [Failure(index, OUT_OF_REACH) for index in missed[: count - len(begins)]]
    with closing(solve_all(problem, begins, jobs, timeout, chosen)) as ended:
        for outcome in ended:
            result = replace(outcome, hand=problem.hand) if isinstance(outcome, Solution) else outcome
            progress(result)
            results.append(result)
    solved = [r for r in results if isinstance(r, Solution)]
    solutions = rank(with_confidence(solved, near, settings, problem.gpis.free_space), settings.rank_by)
    if far:
        problem, solutions = moved_problem(problem, middle), [moved_solution(s, middle) for s in solutions]
    failures = sorted((r for r in (*results, *out) if isinstance(r, Failure)), key=lambda f: f.start)
    seconds = {"fit": fitted - begin, "solve": time.perf_counter() - fitted}
    return Plan(
        observation, problem, tuple(solutions), tuple(failures), seed, jobs, timeout, seconds, extension, chosen, given
    )
