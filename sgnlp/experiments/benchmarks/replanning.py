"""The time of a replanning step for an object that moves on its table, against planning afresh in the same run."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from statistics import median

import numpy as np

from sgnlp.experiments.benchmarks.measure import Bench, Row, Time, clocked, spread, timing
from sgnlp.experiments.benchmarks.solving import planned
from sgnlp.perception.observation import Observation
from sgnlp.planning.replan import replan
from sgnlp.surface.registration import PlanarMotion

STEPS = 20
LENGTH, TURN, NOISE = 0.01, np.radians(3.0), 0.001
"""Shift and turn of a step [m], [rad]; noise of a point from step to step [m]."""
STEP = "a step of replanning"


def rows(bench: Bench) -> Iterator[Row]:
    """Streams of `STEPS` clouds of each object. The first plan, and a fresh plan of the last cloud, use a pool."""
    steps: list[Time] = []
    afresh: list[Time] = []
    over, how, lost = list[float](), {"moved": 0, "fitted": 0, "": 0}, 0
    for seen in bench.observations:
        plan, own = planned(bench, seen, bench.starts), list[Time]()
        for cloud in stream(seen, bench.seed):
            plan, time = clocked(partial(replan, plan, cloud))
            own.append(time)
            how[plan.replanned] += 1
            lost += plan.best is None
        _, fresh = clocked(partial(planned, bench, cloud, bench.starts))
        steps += own
        afresh.append(fresh)
        over.append(fresh.wall / median(time.wall for time in own))
    size = f"{len(bench.observations)} objects x {STEPS} steps"
    told = f"{how['moved']} moved, {how['fitted']} fitted, {how['']} planned afresh, {lost} without a grasp"
    yield timing(STEP, "ms", steps, f"{size}: {told}")
    yield timing("planning afresh, the last cloud", "ms", afresh, f"{bench.starts} starts, {bench.jobs} jobs")
    yield spread("planning afresh over replanning", "1", over, "of each object, the median of its steps")


def stream(seen: Observation, seed: int) -> Iterator[Observation]:
    """The clouds of an object that is shifted and turned step by step, each with independent noise."""
    rng, middle = np.random.default_rng(seed), seen.points.mean(axis=0)
    angle = rng.uniform(-np.pi, np.pi)
    for step in range(1, STEPS + 1):
        shift = step * LENGTH * np.array([np.cos(angle), np.sin(angle), 0.0])
        points = PlanarMotion(middle, step * TURN, shift)(seen.points)
        yield replace(seen, points=points + rng.normal(scale=NOISE, size=points.shape), digest=f"{seen.digest} {step}")
