"""What exact, structured second derivatives and condensed linear systems gain.

Against limited-memory Ipopt, MUMPS, plain CasADi and first-order steps.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from threadpoolctl import threadpool_limits

from sgnlp.experiments.benchmarks.growth import with_points
from sgnlp.experiments.benchmarks.measure import Bench, Row, Time, clocked, spread, timing, warm_times
from sgnlp.experiments.benchmarks.oracle import call, scene
from sgnlp.experiments.benchmarks.plain import plain_hessian
from sgnlp.planning.kkt import SOLVED_FACTOR
from sgnlp.planning.planner import Iterate, Planner
from sgnlp.planning.problem import build_problem
from sgnlp.planning.solvers.first_order import OPTIMISERS, Descent, descent
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.starts import Start, starts
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.nlp import ENERGY_UNIT

STEPS = 200  # first-order steps, as many as the paper's release takes
OURS = "exact Hessian"
OTHERS = {"limited memory": Ipopt(hessian="limited-memory"), "MUMPS": Ipopt(linear_solver="mumps")}
PLAIN_POINTS = 12
"""Surface and interior points for which CasADi's plain Hessian is built: at full size a call of it takes a second."""


def rows(bench: Bench) -> Iterator[Row]:
    """Rows of each opponent, and of its time over ours for the same start in the same run."""
    with threadpool_limits(1):
        yield from _other_ipopts(bench)
        yield from _first_order(bench)
        yield from _plain(bench)


def _other_ipopts(bench: Bench) -> Iterator[Row]:
    ended: dict[str, list[tuple[Iterate, Time]]] = {name: [] for name in (OURS, *OTHERS)}
    for problem in bench.problems:
        planners = {name: Planner(problem, solver) for name, solver in {OURS: Ipopt(), **OTHERS}.items()}
        for start in starts(problem, bench.starts, bench.seed):
            for name, planner in planners.items():
                ended[name].append(clocked(partial(planner.solve, start)))
    for name, runs in ended.items():
        good = sum(i.kkt.worst <= SOLVED_FACTOR * bench.settings.solver.tolerance for i, _ in runs)
        note = f"{good} of {len(runs)} starts solved"
        yield timing(f"{name}: a start", "s", [time for _, time in runs], note)
        yield spread(f"{name}: iterations", "1", [iterate.iterations for iterate, _ in runs], note)
    note = "the same start, in the same formulations with the same limits of iterations"
    for name in OTHERS:
        over = [theirs.wall / ours.wall for (_, ours), (_, theirs) in zip(ended[OURS], ended[name], strict=True)]
        yield spread(f"{name} over {OURS}", "1", over, note)


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
    settings = with_points(bench.settings, PLAIN_POINTS, PLAIN_POINTS)
    problem = build_problem(bench.observations[0], bench.hand, settings, bench.seed)
    joined, x, p = scene(problem, bench.seed)
    hessian, built = clocked(partial(plain_hessian, problem.hand, joined.nlp.structure, problem.gpis))
    size = f"N = {len(problem.gpis.X)}"
    yield timing("plain Hessian: build", "s", [built], size)
    ours = warm_times(call(joined.hessian, x, p, moving=True), bench.repeats)
    plain = warm_times(call(hessian, x, p, moving=True), bench.repeats)
    yield timing("our Hessian: a call", "ms", ours, f"{size}; {'compiled' if bench.compiles else 'interpreted'}")
    yield timing("plain Hessian: a call", "ms", plain, f"{size}; interpreted")
    yield spread("plain Hessian over ours", "1", [q.wall / o.wall for q, o in zip(plain, ours, strict=True)], size)
