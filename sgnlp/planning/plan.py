"""A plan: the ranked grasps of one observation, and what is said of them in arrays and in plain values."""

from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from math import ceil, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.brief import brief
from sgnlp.base.checked import Typed, typed
from sgnlp.hand.hand import Hand, told
from sgnlp.hand.library import called
from sgnlp.perception.observation import Observation
from sgnlp.planning import results
from sgnlp.planning.cautions import cautions
from sgnlp.planning.cautions.planned import Planned
from sgnlp.planning.ending import LEFT, Ending
from sgnlp.planning.environment import machine, surface_backend, versions
from sgnlp.planning.extension import Extension
from sgnlp.planning.grasps import Grasps, stack
from sgnlp.planning.motion import files
from sgnlp.planning.motion.plan_motion import trajectory
from sgnlp.planning.motion.trajectory import Trajectory
from sgnlp.planning.planner import History
from sgnlp.planning.pool import Failure
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution, torque_share
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.solvers.solver import Solver
from sgnlp.planning.surroundings import NOWHERE, Surroundings
from sgnlp.program.constraint import Check


@dataclass(frozen=True, eq=False)
class Plan(Typed):
    """Ranked solutions of one observation, best first, and the starts that gave none.

    `seconds` has the wall times of fitting the surface and of solving all starts.
    """

    called = "a plan"
    __repr__ = brief

    observation: Observation
    problem: Problem
    solutions: tuple[Solution, ...]
    failures: tuple[Failure, ...]
    count: int  # of the starts of a round
    seed: int
    jobs: int
    timeout: float
    seconds: dict[str, float]
    extension: Extension | None = None
    solver: Solver = field(default_factory=Ipopt)
    given: Surroundings = NOWHERE  # what the user told of, beside what the observation has seen
    ending: Ending = field(default_factory=Ending)
    widened: bool = False  # its limits of the object's motion: no start was feasible with the narrow ones
    vain: int = 0  # starts that were solved with narrow limits before it was widened, or with wide ones in vain
    replanned: str = ""  # "moved" or "fitted" of a plan carried over from another one: its surface was

    @property
    def tolerance(self) -> float:
        """What the solver was asked for."""
        return self.solver.tolerance or self.problem.settings.solver.tolerance

    @property
    def tried(self) -> int:
        """The number of starts in all rounds, with those that gave none or were left out."""
        return len(self.solutions) + len(self.failures)

    @property
    def left(self) -> int:
        """How many of these were left out, because enough grasps were found or the time was over."""
        return sum(failure.reason in LEFT for failure in self.failures)

    @property
    def rounds(self) -> int:
        """How many rounds of starts were begun."""
        return ceil(self.tried / self.count)

    @property
    def best(self) -> Solution | None:
        """The first feasible solution, if there is one."""
        return self.solutions[0] if self.solutions and self.solutions[0].feasible else None

    @cached_property
    def motion(self) -> Trajectory | None:
        """The whole motion of the best grasp, with times and checks; None if none is feasible."""
        return trajectory(self.problem, self.arrays(), self.observation.points) if self.best else None

    def motion_files(self) -> dict[str, bytes]:
        """What the files of the motion hold, by name; none without a motion."""
        return files.contents(self.motion, self.arrays()) if self.motion else {}

    def meta(self) -> dict[str, Any]:
        """How a plan was made: enough to make it again."""
        observation = self.observation
        return {
            "object": observation.name,
            "source": observation.source,
            "working_folder": str(Path.cwd()),
            "input_digest": observation.digest,
            "reading": observation.reading and asdict(observation.reading, dict_factory=_plain),
            "table_height": observation.table_height,
            "hand": self.problem.hand.name,
            "hand_folder": called(self.problem.hand.folder),
            "hand_digest": self.problem.hand.digest,
            "arm": told(self.problem.hand),
            "settings": asdict(self.problem.settings, dict_factory=_plain),
            "surroundings": self.given.plain(),
            "seed": self.seed,
            "starts": self.count,
            "tried": self.tried,
            "left": self.left,
            "widened": self.widened,
            "vain": self.vain,
            "timeout": self.timeout,
            **asdict(self.ending),
            "replanned": self.replanned,
            "versions": versions(),
            "kinematics": self.problem.hand.kinematics,
            "formulation": self.problem.formulation.name,
            "kernel": self.problem.gpis.kernel.name,
            "free_space": self.problem.gpis.free_space,
            "solver": self.solver.told(),
            "terms": [term.name for term in self.problem.terms],
            "constraints": [constraint.name for constraint in self.problem.constraints],
            "extension": {"file": self.extension.file, "sha256": self.extension.digest} if self.extension else None,
            "surface": surface_backend() if self.problem.settings.solver.compiled else "NumPy",
            **self.solver.backends(),
            "machine": machine(),
            "seconds": self.seconds | {"jobs": self.jobs},
        }

    def arrays(self) -> Grasps:
        """The plan's grasps as arrays, best first, infeasible ones last."""
        return stack(self.problem.hand, self.problem.terms, self.solutions, self.meta())

    def histories(self) -> dict[str, NDArray[Any]]:
        """How every start went: the columns of `History` with the number of the start before them, start by start.

        Empty if the solver told of no point that it went through.
        """
        if not any(len(s.history.energy) for s in self.solutions):
            return {}
        ordered = sorted(self.solutions, key=lambda s: s.start)
        columns = {f.name: np.concatenate([getattr(s.history, f.name) for s in ordered]) for f in fields(History)}
        return {"start": np.concatenate([np.full(len(s.history.energy), s.start) for s in ordered])} | columns

    def summary(self) -> dict[str, Any]:
        """The plan's outcome: counts, every start, the best grasp's breakdown, what was dropped or assumed."""
        grasps = self.arrays()
        return self.meta() | {
            "plan": grasps.digest,
            "notes": [*self.observation.notes, *filter(None, [self.problem.surroundings.words()])],
            "cautions": cautions(Planned(grasps, self.problem.hand, self.observation, self.problem)),
            "feasible": sum(s.feasible for s in self.solutions),
            "solved": sum(s.solved(self.tolerance) for s in self.solutions),
            "starts_table": [_start(s, rank) for rank, s in enumerate(self.solutions)]
            + [{"start": f.start, "failure": f.reason} for f in self.failures],
            "best": _grasp(self.best, self) if self.best else None,
            "motion": _motion(self.motion) if self.motion else None,
        }

    @typed
    def save(self, folder: str | Path) -> None:
        """Write `grasps.npz`, `summary.json`, `history.npz` and the motion's files into a folder, all or none."""
        results.save(self.arrays(), self.summary(), Path(folder), self.histories(), self.motion_files())


def _plain(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A mapping as JSON reads it back: with lists for tuples."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in pairs}


def _start(s: Solution, rank: int) -> dict[str, Any]:
    return {
        "rank": rank,
        "start": s.start,
        "feasible": s.feasible,
        "violated": list(s.violated),
        "worst_margin": s.worst_margin,
        "confidence": _known(s.confidence),
        "energy": s.energy,
        "stiffness": float(s.grasp.stiffness),
        "kkt": asdict(s.kkt),
        "violations": [asdict(violation) for violation in s.violations],
        "status": s.status,
        "iterations": s.iterations,
        "seconds": s.seconds,
    }


def _known(value: float) -> float | None:
    """A number, or nothing where it is unknown: JSON has no NaN."""
    return value if isfinite(value) else None


def _arm(s: Solution, hand: Hand) -> dict[str, Any] | None:
    """The arm's joints by name, at the pregrasp, at the stand-off and lifted; nothing without an arm."""
    if s.arm is None or hand.arm is None:
        return None
    places = zip(("pregrasp", "standoff", "lift"), s.arm.tolist(), strict=True)
    return {place: dict(zip(hand.arm.joint_names, joints, strict=True)) for place, joints in places}


def _check(check: Check) -> dict[str, Any]:
    """A check, with no bound where there is none: JSON has no infinity."""
    plain = asdict(check) | {"demand": check.demand}
    return plain | {name: plain[name] if isfinite(plain[name]) else None for name in ("lower", "upper")}


def _motion(made: Trajectory) -> dict[str, Any]:
    checks = {check.name: _check(check) for check in made.checks}
    return {"seconds": made.seconds, "phases": made.phase_seconds(), "clear": made.clear, "checks": checks}


def _grasp(s: Solution, plan: Plan) -> dict[str, Any]:
    hand, g, weights = plan.problem.hand, s.grasp, plan.problem.weights()
    fingers = {
        finger.name: {
            "gain": float(g.gains[i]),
            "c": float(s.c[i]),
            "target": g.targets[i].tolist(),
            "tip_pregrasp": g.tips[i].tolist(),
            "contact_point": s.contact_points[i].tolist(),
            "normal": g.normals[i].tolist(),
            "force": float(np.linalg.norm(g.forces_eq[i])),
            "margin_initial": float(s.margins_initial[i]),
            "margin_equilibrium": float(s.margins_equilibrium[i]),
            "contact_distance_mm": 1e3 * float(g.gaps[i]),
            "deviation_mm": 1e3 * float(g.contact_deviations[i]),
        }
        for i, finger in enumerate(hand.fingers)
    }
    return {
        "start": s.start,
        "wrist": s.wrist.tolist(),
        "joints": dict(zip(hand.joint_names, s.joints.tolist(), strict=True)),
        "joints_contact": dict(zip(hand.joint_names, s.joints_contact.tolist(), strict=True)),
        "joints_squeeze": dict(zip(hand.joint_names, s.joints_squeeze.tolist(), strict=True)),
        "arm": _arm(s, hand),
        "closing": asdict(plan.problem.settings.closing),
        "fingers": fingers,
        "confidence": _known(s.confidence),
        "energy": s.energy,
        "energy_terms": {
            term.name: {"weight": float(w), "value": float(e), "share": float(w * e)}
            for term, w, e in zip(plan.problem.terms, weights, s.energy_terms, strict=True)
        },
        "torque_over_effort": torque_share(g, plan.problem.settings.contact.metric),
        "checks": {check.name: _check(check) for check in s.checks},
    }
