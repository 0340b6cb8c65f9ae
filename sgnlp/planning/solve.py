"""Plan grasps: from an observation to ranked solutions."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf

from sgnlp.base.arrays import Array
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.observation import Observation
from sgnlp.perception.shape import Shape
from sgnlp.planning import arguments
from sgnlp.planning.additions import Additions
from sgnlp.planning.ending import ROUNDS, Ending
from sgnlp.planning.extension import Extension
from sgnlp.planning.faraway import moved_cloud, moved_hand, origin
from sgnlp.planning.plan import Plan
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.rounds import in_rounds
from sgnlp.planning.search import Found, Result, Search
from sgnlp.planning.solvers import settled, solver_named
from sgnlp.planning.solvers.solver import Solver
from sgnlp.planning.surroundings import Surroundings
from sgnlp.program.constraint import Constraint
from sgnlp.program.formulation import Formulation
from sgnlp.program.terms import Term
from sgnlp.surface.kernel import Kernel


@dataclass(frozen=True)
class Asked:
    """What a plan is asked for, of whatever cloud: the arguments of `solve`, put together."""

    hand: Hand
    settings: Settings
    given: Surroundings
    additions: Additions
    extension: Extension | None
    count: int
    seed: int
    jobs: int
    timeout: float
    ending: Ending

    def plan(self, seen: Observation, found: Found, seconds: dict[str, float], solver: Solver, how: str = "") -> Plan:
        """What was found of it; `how` is what `Plan.replanned` says."""
        return Plan(
            seen,
            *found,
            self.count,
            self.seed,
            self.jobs,
            self.timeout,
            seconds,
            self.extension,
            solver,
            self.given,
            self.ending,
            replanned=how,
        )


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
    rounds: int = ROUNDS,
    widen: bool = True,
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
        count: number of starts of a round; the first are those of the hand's file.
        seed: of the training set and of the starts beyond the file's. The same seed gives the same result.
        jobs: worker processes; the result does not depend on it.
        timeout: wall-clock limit of a start [s].
        first: end when so many feasible grasps are known, counted in the order of the starts, so that the result does
            not depend on `jobs`; None for all.
        deadline: end so long after the call [s], with the best known by then; None for never. Fitting the surface, and
            building the functions of the first plan of a process, are not interrupted.
        rounds: where no start has ended feasible, but one near, try `count` more, up to so many rounds. 1 tries no
            more.
        widen: where none of these is feasible either, and the limits of the object's motion are those of "robust",
            solve the starts again with 10° and 10 mm. `Plan.widened` says so.
        progress: called with each result as it comes; with those of wide limits after the others.

    Raises:
        InputError: the hand, a setting or a name is not valid, or the surface cannot be fitted.
    """
    arguments.check(locals())
    arguments.check_search(count, jobs, timeout, seed)
    solver = solver_named(solver) if isinstance(solver, str) else solver
    without = tuple(without_terms), tuple(without_constraints)
    additions = Additions(tuple(terms), tuple(constraints), *without, formulation, solver, kernel)
    additions = additions.and_of(extension.additions()) if extension else additions
    hand = load_hand(hand, settings.spheres) if isinstance(hand, str) else hand
    given = Surroundings(tuple(obstacles), tuple(avoid), tuple(touch))
    ending = Ending(first, deadline, rounds, widen)
    numbers = int(count), int(seed), int(jobs), float(timeout)  # NumPy's cannot be written as JSON
    asked = Asked(hand, settings, given, additions, extension, *numbers, ending)
    return planned(observation, asked, progress)


def planned(observation: Observation, asked: Asked, progress: Callable[[Result], None] = lambda result: None) -> Plan:
    """The plan that is asked for, made near the origin."""
    begin, middle = time.perf_counter(), origin(observation)
    cloud, hand, given = observation, asked.hand, asked.given
    if middle.any():
        cloud, hand, given = moved_cloud(cloud, -middle), moved_hand(hand, -middle), given.moved(-middle)
    problem = build_problem(cloud, hand, asked.settings, asked.seed, asked.additions, given)
    return searched(observation, (problem, cloud, middle), asked, begin, progress)


def searched(
    observation: Observation,
    near: tuple[Problem, Observation, Array],
    asked: Asked,
    begin: float,
    progress: Callable[[Result], None] = lambda result: None,
) -> Plan:
    """The plan of a problem that was begun to be posed at `begin` [s].

    `near` has the problem and its cloud, both moved by -middle, and the middle (3,) [m].
    """
    solver = settled(asked.additions.solver, asked.settings.solver)
    search = Search(*near, solver, asked.count, asked.seed, asked.jobs, asked.timeout)
    fitted, deadline = time.perf_counter(), asked.ending.deadline
    search.agree()
    until = inf if deadline is None else begin + deadline
    ended = in_rounds(search, asked.ending, until, progress)
    seconds = {"fit": fitted - begin, "solve": time.perf_counter() - fitted}
    plan = asked.plan(observation, ended.search.found(ended.results), seconds, solver)
    return replace(plan, widened=ended.wide, vain=ended.vain)
