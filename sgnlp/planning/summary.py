"""A plan in plain values: what `summary.json` and the meta block of `grasps.npz` hold."""

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.planning.cautions import cautions
from sgnlp.planning.cautions.planned import Planned
from sgnlp.planning.environment import kinematics_backend, machine, surface_backend, versions
from sgnlp.planning.grasps import Grasps, stack
from sgnlp.planning.ipopt import Course
from sgnlp.planning.plan import Plan
from sgnlp.planning.solution import Solution, torque_share
from sgnlp.program.terms import TERMS


def meta(plan: Plan) -> dict[str, Any]:
    """How a plan was made: enough to make it again."""
    observation = plan.observation
    return {
        "object": observation.name,
        "source": observation.source,
        "working_folder": str(Path.cwd()),
        "input_digest": observation.digest,
        "reading": observation.reading and asdict(observation.reading, dict_factory=_plain),
        "table_height": observation.table_height,
        "hand": plan.problem.hand.name,
        "settings": asdict(plan.problem.settings, dict_factory=_plain),
        "seed": plan.seed,
        "starts": len(plan.solutions) + len(plan.failures),
        "timeout": plan.timeout,
        "versions": versions(),
        "kinematics": kinematics_backend(),
        "surface": surface_backend() if plan.problem.settings.solver.compiled else "NumPy",
        "machine": machine(),
        "seconds": plan.seconds | {"jobs": plan.jobs},
    }


def _plain(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A mapping as JSON reads it back: with lists for tuples."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in pairs}


def arrays(plan: Plan) -> Grasps:
    """The plan's grasps as arrays, best first, infeasible ones last."""
    return stack(plan.problem.hand, plan.solutions, meta(plan))


def courses(plan: Plan) -> dict[str, NDArray[Any]]:
    """How every start went: the columns of `Course` with the number of the start before them, start by start."""
    if not plan.solutions:
        return {}
    ordered = sorted(plan.solutions, key=lambda s: s.start)
    columns = {f.name: np.concatenate([getattr(s.course, f.name) for s in ordered]) for f in fields(Course)}
    return {"start": np.concatenate([np.full(len(s.course.energy), s.start) for s in ordered])} | columns


def summary(plan: Plan) -> dict[str, Any]:
    """The plan's outcome: counts, every start, the best grasp's breakdown, what was dropped or assumed."""
    tolerance = plan.problem.settings.solver.tolerance
    return meta(plan) | {
        "notes": list(plan.observation.notes),
        "cautions": cautions(Planned(arrays(plan), plan.problem.hand, plan.observation, plan.problem)),
        "feasible": sum(s.feasible for s in plan.solutions),
        "solved": sum(s.solved(tolerance) for s in plan.solutions),
        "starts_table": [_start(s, rank) for rank, s in enumerate(plan.solutions)]
        + [{"start": f.start, "failure": f.reason} for f in plan.failures],
        "best": _grasp(plan.best, plan) if plan.best else None,
    }


def _start(s: Solution, rank: int) -> dict[str, Any]:
    return {
        "rank": rank,
        "start": s.start,
        "feasible": s.feasible,
        "violated": list(s.violated),
        "worst_margin": s.worst_margin,
        "energy": s.energy,
        "stiffness": float(s.grasp.stiffness),
        "kkt": asdict(s.kkt),
        "violations": [asdict(violation) for violation in s.violations],
        "status": s.status,
        "iterations": s.iterations,
        "seconds": s.seconds,
    }


def _grasp(s: Solution, plan: Plan) -> dict[str, Any]:
    hand, g, weights = plan.problem.hand, s.grasp, plan.problem.weights()
    fingers = {
        finger.name: {
            "gain": float(g.gains[i]),
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
        "fingers": fingers,
        "energy": s.energy,
        "energy_terms": {
            term.name: {"weight": float(w), "value": float(e), "share": float(w * e)}
            for term, w, e in zip(TERMS, weights, s.energy_terms, strict=True)
        },
        "torque_over_effort": torque_share(g, plan.problem.settings.contact.metric),
        "checks": {check.name: asdict(check) | {"passed": check.passed} for check in s.checks},
    }
