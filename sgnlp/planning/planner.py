"""A solver on the programs of a problem, in turn: from a start to the point where the last one ends."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sgnlp.planning.firstorder import learning_rates
from sgnlp.planning.kkt import SOLVED_FACTOR, Kkt
from sgnlp.planning.multipliers import recomputed
from sgnlp.planning.problem import Problem
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.solvers.solver import Answer, NlpInstance, Solver
from sgnlp.planning.starts import Start, initial
from sgnlp.planning.violations import Violation, violations
from sgnlp.program.compiled import program
from sgnlp.program.nlp import ENERGY_UNIT, Nlp, variable_units
from sgnlp.program.oracle import Functions, Oracle, join

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class History:
    """The points that a solver went through from a start, T of them, in one program after the other."""

    formulation: NDArray[np.str_]  # (T,)
    energy: Array  # (T,) smoothed, of the terms that the formulation has
    primal: Array  # (T,) largest violation of a scaled row
    dual: Array  # (T,) largest entry of the Lagrangian's gradient, as the solver scales it
    barrier: Array  # (T,) μ


@dataclass(frozen=True, eq=False)
class Iterate:
    """Where a solver ended from a start, in the scaled variables of the last program.

    x (nx), parameters p, and the residuals of the optimality conditions that we recomputed there; `status` is the
    solver's word, never believed, and so is the `history`.
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


@dataclass(frozen=True, eq=False)
class Stage:
    """One of the programs: its oracle, the functions that the solver calls, and its iterations at most."""

    oracle: Oracle
    functions: Functions
    iterations: int

    @property
    def nlp(self) -> Nlp:
        """The program without its surface."""
        return self.oracle.nlp

    def admitted(self, x: Array, instance: NlpInstance) -> Array:
        """A point of another program as one of this (nx,), within the bounds, with the variables that this one adds."""
        shared = x[: len(variable_units(self.nlp.hand))]
        added = self.nlp.structure.formulation.begin(self.oracle, shared, instance.p, instance.g_bounds)
        return np.clip(np.concatenate([shared, added]), *instance.x_bounds)


class Planner:
    """A solver on one problem, in its formulation.

    `metered` may put other functions in the place of an oracle's, for instance ones that count.
    """

    def __init__(
        self, problem: Problem, solver: Solver | None = None, metered: Callable[[Oracle], Functions] = lambda o: o
    ):
        self.problem, chosen = problem, problem.settings.solver
        self.solver = solver or Ipopt.of(chosen)
        self.tolerance = self.solver.tolerance or chosen.tolerance
        self.stages = []
        for phase in problem.phases:
            nlp = program(problem.hand, problem.structure(phase.formulation), chosen.compiled)
            oracle = join(nlp, problem.gpis, chosen.compiled)
            self.stages.append(Stage(oracle, metered(oracle), phase.iterations))

    def instance(self, stage: Stage, start: Start) -> NlpInstance:
        """The program of a stage with the numbers of a start."""
        nlp, problem, rates = stage.nlp, self.problem, learning_rates(self.problem.hand)
        return NlpInstance(
            functions=stage.functions,
            p=problem.parameters(nlp, start.wrist, start.joints),
            x_bounds=problem.variable_bounds(nlp, start.joints),
            g_bounds=problem.row_bounds(nlp),
            tolerance=self.tolerance,
            iterations=stage.iterations,
            rates=np.pad(rates, (0, len(nlp.units) - len(rates)), constant_values=np.nan),
        )

    def run(self, start: Start) -> list[tuple[NlpInstance, Answer]]:
        """The programs with their answers, each from where the one before it ended."""
        x, found = initial(self.stages[0].nlp, start), []
        for stage in self.stages:
            instance = self.instance(stage, start)
            answer = self.solver.solve(instance, stage.admitted(x, instance))
            x = answer.x
            found.append((instance, answer))
        return found

    def solve(self, start: Start) -> Iterate:
        """Run all, and recompute what the end is worth."""
        begin, last = time.perf_counter(), self.stages[-1]
        legs = self.run(start)
        instance, answer = legs[-1]
        nlp, p = last.nlp, instance.p
        kkt, _ = recomputed(instance, answer.x, answer.multipliers, (*nlp.variable_names, *nlp.row_names))
        parts = [_leg(s.nlp.structure.formulation.name, a) for s, (_, a) in zip(self.stages, legs, strict=True)]
        return Iterate(
            start=start.index,
            formulation=nlp.structure.formulation.name,
            x=answer.x,
            p=p,
            objective=float(last.oracle.objective(answer.x, p)),
            kkt=kkt,
            status=answer.status,
            iterations=sum(answer.iterations for _, answer in legs),
            seconds=time.perf_counter() - begin,
            history=History(*(np.concatenate(column) for column in zip(*parts, strict=True))),
            violations=violations(
                nlp, partial(last.oracle.values, p=p), answer.x, instance.g_bounds, SOLVED_FACTOR * self.tolerance
            ),
        )


def _leg(formulation: str, answer: Answer) -> tuple[NDArray[np.str_], Array, Array, Array, Array]:
    """The columns of `History` for one program."""
    energy, primal, dual, barrier = (np.array(answer.way.get(k, ()), float) for k in ("obj", "inf_pr", "inf_du", "mu"))
    return np.full(len(energy), formulation), ENERGY_UNIT * energy, primal, dual, barrier
