"""What exact, structured second derivatives gain: against limited-memory Ipopt, plain CasADi, first-order steps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from threadpoolctl import threadpool_limits

from sgnlp.base.settings import Solver
from sgnlp.experiments.benchmarks.bench import Bench
from sgnlp.experiments.benchmarks.measure import Row, Time, clocked, spread, timing, warm_times
from sgnlp.experiments.benchmarks.oracle import call, scene
from sgnlp.experiments.benchmarks.plain import plain_hessian
from sgnlp.planning.kkt import SOLVED_FACTOR
from sgnlp.planning.planner import Iterate, Planner
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.solvers.first_order import OPTIMISERS, Descent, descent
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.starts import Start, starts
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.nlp import ENERGY_UNIT

STEPS = 200
"""First-order steps, as many as the paper's release takes."""
PLAIN_POINTS = 12
"""Surface and interior points for which CasADi's plain Hessian is built: at full size that takes many minutes."""


@dataclass(frozen=True)
class Pair:
    """One start solved with exact and with limited-memory Hessians."""

    exact: tuple[Iterate, Time]
    limited: tuple[Iterate, Time]


def rows(bench: Bench) -> Iterator[Row]:
    """Rows of each opponent, and of its time over ours for the same start in the same run."""
    with threadpool_limits(1):
        yield from _limited_memory(bench)
        yield from _first_order(bench)
        yield from _plain(bench)


def _limited_memory(bench: Bench) -> Iterator[Row]:
    pairs = []
    for problem in bench.problems:
        exact, limited = Planner(problem), Planner(problem, Ipopt(hessian="limited-memory"))
        for start in starts(problem, bench.starts, bench.seed):
            pairs.append(Pair(*(clocked(partial(planner.solve, start)) for planner in (exact, limited))))
    for name, ended in {
        "exact Hessian": [pair.exact for pair in pairs],
        "limited memory": [pair.limited for pair in pairs],
    }.items():
        note = _solved([iterate for iterate, _ in ended], bench.settings.solver)
        yield timing(f"{name}: a start", "s", [time for _, time in ended], note)
        yield spread(f"{name}: iterations", "1", [iterate.iterations for iterate, _ in ended], note)
    note = "the same start, in the same formulations with the same limits of iterations"
    yield spread("limited memory over exact", "1", [p.limited[1].wall / p.exact[1].wall for p in pairs], note)


def _solved(iterates: Sequence[Iterate], solver: Solver) -> str:
    solved = sum(iterate.kkt.worst <= SOLVED_FACTOR * solver.tolerance for iterate in iterates)
    return f"{solved} of {len(iterates)} starts solved"


def _first_order(bench: Bench) -> Iterator[Row]:
    for optimiser in sorted(OPTIMISERS, reverse=True):
        times, over, above = [], [], []
        for problem in bench.problems:
            planner = Planner(replace(problem, formulation=Penalty()))
            for start in starts(problem, bench.starts, bench.seed):
                iterate, ours = clocked(partial(planner.solve, start))
                found, theirs = clocked(partial(_descent, planner, start, optimiser))
                times.append(theirs)
                over.append(theirs.wall / ours.wall)
                above.append(ENERGY_UNIT * (found.best - iterate.objective))
        name = f"{STEPS} steps of {optimiser}"
        yield timing(f"{name}: a start", "s", times, "penalty formulation")
        yield spread(f"{name} over Ipopt", "1", over, "the same start, both in the penalty formulation")
        note = f"the lowest on the way; Ipopt's is lower for {sum(a > 0 for a in above)} of {len(above)} starts"
        yield spread(f"{name}: energy above Ipopt's", "1", above, note)


def _descent(planner: Planner, start: Start, optimiser: str) -> Descent:
    return descent(*planner.begin(planner.stages[-1], start), optimiser, STEPS)


def _plain(bench: Bench) -> Iterator[Row]:
    problem = small(bench)
    joined, x, p = scene(problem, bench.seed)
    hessian, built = clocked(partial(plain_hessian, problem.hand, joined.nlp.structure, problem.gpis))
    size = f"N = {len(problem.gpis.X)}"
    yield timing("plain Hessian: build", "s", [built], size)
    ours = warm_times(call(joined.hessian, x, p, moving=True), bench.repeats)
    plain = warm_times(call(hessian, x, p, moving=True), bench.repeats)
    yield timing("our Hessian: a call", "ms", ours, f"{size}; {'compiled' if bench.compiles else 'interpreted'}")
    yield timing("plain Hessian: a call", "ms", plain, f"{size}; interpreted")
    yield spread("plain Hessian over ours", "1", [q.wall / o.wall for q, o in zip(plain, ours, strict=True)], size)


def small(bench: Bench) -> Problem:
    """The first problem with few enough points for CasADi's plain Hessian."""
    gpis = replace(bench.settings.gpis, surface_points=PLAIN_POINTS, interior_points=PLAIN_POINTS)
    return build_problem(bench.observations[0], bench.hand, replace(bench.settings, gpis=gpis), bench.seed)
