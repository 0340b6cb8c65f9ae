"""Runs a solver on the programs of a problem in turn, from a start to the end of the last program."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan

import numpy as np

from sgnlp.base.arrays import Array, StrArray
from sgnlp.base.errors import SolverError
from sgnlp.planning.kkt import SOLVED_FACTOR, Kkt
from sgnlp.planning.multipliers import recomputed
from sgnlp.planning.problem import Problem
from sgnlp.planning.solvers import settled
from sgnlp.planning.solvers.first_order import learning_rates
from sgnlp.planning.solvers.solver import Answer, Multipliers, NlpInstance, Solver
from sgnlp.planning.starts import Start, at_contact, initial
from sgnlp.planning.violations import Violation, violations
from sgnlp.planning.warm_start import WarmStart
from sgnlp.program.compiled import program
from sgnlp.program.formulation import Phase
from sgnlp.program.nlp import ENERGY_UNIT, Nlp
from sgnlp.program.oracle import Functions, Oracle, join
from sgnlp.program.variables import variable_units

STILL_SOLVED = "solved where it began"
"""The status of a warm start that needs no iteration."""
BEYOND = 1e-6
"""Ipopt ends at most 1e-8 beyond a bound of the scaled variables; who ends farther beyond is moved onto it."""


@dataclass(frozen=True, eq=False)
class History:
    """The T iterates of a solver from a start, in one program after the other."""

    formulation: StrArray  # (T,)
    energy: Array  # (T,) smoothed energy of the formulation's terms
    primal: Array  # (T,) largest violation of a scaled row
    dual: Array  # (T,) largest entry of the Lagrangian's gradient, as the solver scales it
    barrier: Array  # (T,) μ


@dataclass(frozen=True, eq=False)
class Iterate:
    """Where a solver ended from a start, in the scaled variables of the last program.

    x (nx), parameters p, and the recomputed residuals of the optimality conditions. `status` and `history` are the
    solver's own and are not trusted.
    """

    start: int
    formulation: str
    x: Array
    p: Array
    objective: float
    kkt: Kkt
    status: str
    iterations: int
    seconds: float
    history: History
    violations: tuple[Violation, ...] = ()
    multipliers: Multipliers | None = None


@dataclass(frozen=True, eq=False)
class Stage:
    """One of the programs: its oracle, the functions that the solver calls, and the limit of its iterations."""

    oracle: Oracle
    functions: Functions
    iterations: int

    @property
    def nlp(self) -> Nlp:
        """The program without its surface."""
        return self.oracle.nlp

    def admitted(self, x: Array, instance: NlpInstance) -> Array:
        """A point of another program as a point (nx,) of this one, within the bounds, with this one's added
        variables."""
        nlp = self.nlp
        shared = x[: len(variable_units(nlp.hand))]
        before = np.concatenate([shared, at_contact(nlp, shared, instance.p)])
        own = nlp.structure.formulation.begin(self.oracle, before, instance.p, instance.g_bounds)
        return np.clip(np.concatenate([before, own]), *instance.x_bounds)


class Planner:
    """A solver (an object, a name, or None for Ipopt) on one problem, in the problem's formulation.

    `metered` may replace an oracle's functions, for instance by ones that count calls. `phases` are by default those of
    the problem.
    """

    def __init__(
        self,
        problem: Problem,
        solver: Solver | str | None = None,
        metered: Callable[[Oracle], Functions] = lambda oracle: oracle,
        phases: Sequence[Phase] | None = None,
    ):
        self.problem, chosen = problem, problem.settings.solver
        self.solver = settled(solver, chosen)
        self.tolerance = self.solver.tolerance or chosen.tolerance
        self.stages = []
        for phase in problem.phases if phases is None else phases:
            nlp = program(problem.hand, problem.structure(phase.formulation), chosen.compiled)
            oracle = join(nlp, problem.gpis, chosen.compiled, problem.fields)
            self.stages.append(Stage(oracle, metered(oracle), phase.iterations))

    def take(self, problem: Problem) -> None:
        """Switch to another problem with the same hand, settings and structures; what was built is kept."""
        self.problem = problem
        for stage in self.stages:
            stage.oracle.surface.become(problem.gpis, problem.fields)

    def instance(self, stage: Stage, start: Start) -> NlpInstance:
        """The program of a stage with the numbers of a start."""
        nlp, problem, rates = stage.nlp, self.problem, learning_rates(self.problem.hand)
        return NlpInstance(
            functions=stage.functions,
            p=problem.parameters(nlp, start.wrist, start.joints, start.arm),
            x_bounds=problem.variable_bounds(nlp, start.joints),
            g_bounds=problem.row_bounds(nlp),
            tolerance=self.tolerance,
            iterations=stage.iterations,
            rates=np.pad(rates, (0, len(nlp.units) - len(rates)), constant_values=np.nan),
        )

    def begin(self, stage: Stage, start: Start) -> tuple[NlpInstance, Array]:
        """The program of a stage with the numbers of a start, and the start as a point of it (nx,)."""
        instance = self.instance(stage, start)
        return instance, stage.admitted(initial(stage.nlp, start), instance)

    def prepare(self, start: Start) -> None:
        """Let the solver build everything that does not depend on the numbers of a start."""
        for stage in self.stages:
            self.solver.prepare(self.instance(stage, start))

    def run(self, start: Start) -> list[Answer]:
        """The answers to the programs, each solved from where the one before it ended."""
        x, answers = initial(self.stages[0].nlp, start), list[Answer]()
        for stage in self.stages:
            for before in answers[-1:]:
                self._finite(before)
            instance = self.instance(stage, start)
            answers.append(_answer(self.solver, instance, stage.admitted(x, instance)))
            x = answers[-1].x
        return answers

    def solve(self, start: Start) -> Iterate:
        """Run all programs, and recompute the residuals at the end. Raises `SolverError` if the solver has no
        answer."""
        self.prepare(start)
        begin = time.perf_counter()
        answers = self.run(start)
        self._finite(answers[-1])
        return replace(self.ended(start, answers), seconds=time.perf_counter() - begin)

    def resume(self, warm: WarmStart) -> Iterate:
        """Run only the last program, from the end of a similar one and with its multipliers.

        If these satisfy the optimality conditions here too, as for an object that only moved, no iteration is made.
        """
        begin, last = time.perf_counter(), self.stages[-1]
        instance = replace(self.instance(last, warm.start), multipliers=warm.multipliers)
        x, kkt = np.clip(warm.x, *instance.x_bounds), None
        if warm.multipliers is not None:
            kkt, _ = recomputed(instance, x, warm.multipliers, (*last.nlp.variable_names, *last.nlp.row_names))
        if kkt is not None and kkt.worst <= SOLVED_FACTOR * self.tolerance:
            answer = Answer(x, STILL_SOLVED, multipliers=warm.multipliers)
        else:
            answer, kkt = _answer(self.solver.warm, instance, x), None
        self._finite(answer)
        return replace(self.ended(warm.start, [answer], kkt), seconds=time.perf_counter() - begin)

    def _finite(self, answer: Answer) -> None:
        if not np.isfinite(answer.x).all():
            raise SolverError(f"solver {self.solver.name} returned an x that is not finite")

    def ended(self, start: Start, answers: Sequence[Answer], kkt: Kkt | None = None) -> Iterate:
        """The iterate of the answers to the programs; `kkt` are the residuals of the last one, if they are known."""
        last, answer = self.stages[-1], answers[-1]
        instance, nlp = replace(self.instance(last, start), functions=last.oracle), last.nlp
        names, limit = (*nlp.variable_names, *nlp.row_names), SOLVED_FACTOR * self.tolerance
        rows = partial(last.oracle.values, p=instance.p)
        legs = [
            _leg(stage.nlp.structure.formulation.name, a)
            for stage, a in zip(self.stages[-len(answers) :], answers, strict=True)
        ]
        return Iterate(
            start=start.index,
            formulation=nlp.structure.formulation.name,
            x=answer.x,
            p=instance.p,
            objective=instance.objective(answer.x),
            multipliers=answer.multipliers,
            kkt=kkt or recomputed(instance, answer.x, answer.multipliers, names)[0],
            status=answer.status,
            iterations=sum(a.iterations for a in answers),
            seconds=nan,
            history=History(*(np.concatenate(column) for column in zip(*legs, strict=True))),
            violations=violations(nlp, rows, answer.x, instance.g_bounds, limit),
        )


def _answer(solver: Solver, instance: NlpInstance, x: Array) -> Answer:
    """The answer of a solver from x (nx,), within the bounds. Raises `SolverError` for one of another kind or shape."""
    low, high = (bound.copy() for bound in instance.x_bounds)  # a solver may write into its own
    answer, said = solver.solve(instance, x), f"solver {solver.name} returned"
    if not isinstance(answer, Answer):
        raise SolverError(f"{said} {type(answer).__name__}, expected sgnlp.Answer")
    parts = [("x", answer.x, x)]
    if answer.multipliers is not None:
        if not (isinstance(answer.multipliers, tuple | list) and len(answer.multipliers) == 2):
            raise SolverError(f"{said} multipliers that are no pair (λ_x, λ_g)")
        parts += zip(("λ_x", "λ_g"), answer.multipliers, (x, instance.g_bounds[0]), strict=True)
    for name, found, like in parts:
        values = np.asarray(found)
        if values.shape != like.shape or values.dtype.kind not in "fiu":
            raise SolverError(
                f"{said} {name} of shape {values.shape}, {values.dtype}; expected {like.shape} of numbers"
            )
    return _within(replace(answer, x=np.asarray(answer.x, float)), low, high)


def _within(answer: Answer, low: Array, high: Array) -> Answer:
    """The answer, moved onto the bounds (nx,) if it ended beyond: no check of a grasp bounds its gains, say."""
    beyond = float(np.maximum(low - answer.x, answer.x - high).max(initial=0.0))
    if not beyond > BEYOND:
        return answer
    said = f"it ended {beyond:.2g} beyond a bound of the variables and was moved onto it"
    return replace(answer, x=np.clip(answer.x, low, high), status="; ".join(filter(None, (answer.status, said))))


def _leg(formulation: str, answer: Answer) -> tuple[StrArray, Array, Array, Array, Array]:
    """The columns of `History` for one program; NaN where the solver gives no value."""
    energy = np.array(answer.way.get("obj", ()), float)
    others = [np.array(answer.way.get(name, ()), float) for name in ("inf_pr", "inf_du", "mu")]
    primal, dual, barrier = (o if len(o) == len(energy) else np.full(len(energy), nan) for o in others)
    return np.full(len(energy), formulation), ENERGY_UNIT * energy, primal, dual, barrier
