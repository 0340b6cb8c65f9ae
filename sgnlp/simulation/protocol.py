"""The experiment, phase by phase: settle, approach by a route, pregrasp, close until rest, lift, hold, six pushes."""

import copy
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from sgnlp.base.arrays import Array
from sgnlp.control.command import Command
from sgnlp.control.controller import Controller
from sgnlp.control.law import WEIGHTLESS, Law
from sgnlp.hand.hand import Hand
from sgnlp.perception.shape import Shape
from sgnlp.planning.motion.trajectory import APPROACH
from sgnlp.planning.recompute import rotation_angle
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.simulation.body import Body
from sgnlp.simulation.contacts import overlaps, penetrations
from sgnlp.simulation.driver import Driver
from sgnlp.simulation.outcome import Knock
from sgnlp.simulation.recorder import Reading, Recorder
from sgnlp.simulation.route import Leg, Route
from sgnlp.simulation.settings import ROUNDING, SAMPLE, SimulationSettings
from sgnlp.simulation.world import ARM_INERTIA, object_alone, world

REST_SPEED, REST_TURN = 1e-3, 2e-2
"""At rest, tips and object are slower than this [m/s] and the object turns slower than this [rad/s] ..."""
REST_SAMPLES = 20
"""... for this number of successive samples."""
SETTLE_TIME = 3.0
"""Longest wait for the object to rest on the table [s]."""
AXES = {"+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0), "+z": (0, 0, 1), "-z": (0, 0, -1)}


class Experiment:
    """One grasp in the simulator. The phases are generators of readings, to be run in their order."""

    def __init__(
        self,
        command: Command,
        body: Body,
        hand: Hand,
        settings: SimulationSettings,
        obstacles: Sequence[Shape] = (),
        route: Route | None = None,
    ) -> None:
        """Without a route the hand floats: it begins at its pregrasp, and rises by the settings."""
        import mujoco

        self.settings, self.body, self.ramp, self.route = settings, body, command.closing_seconds, route
        self.world = world(body, hand, command, settings, obstacles, route)
        self.data: Any = mujoco.MjData(self.world.model)
        self.data.qpos[self.world.object_place] = settled(body, settings, obstacles)
        self.data.qpos[self.world.hand_joints] = hand.moving_angles(command.joints)
        self.controller = Controller(hand, command, law(settings))
        if route:
            self.data.qpos[self.world.carrier] = route.approach.end
        mujoco.mj_fwdPosition(self.world.model, self.data)
        self._inside = penetrations(self.world, self.data), overlaps(self.world, self.data)
        self._driver = self._stand_off(route) if route else None
        self.act()
        mujoco.mj_forward(self.world.model, self.data)
        hull = body.vertices[ConvexHull(body.vertices).vertices]
        self.recorder = Recorder(self.world, hull)
        self.given = self.world.model.body_ipos[self.world.object_body].copy()  # (3,) centre of mass before settling
        self.begin = self.recorder.read(self.data, APPROACH if route else "pregrasp")

    def _stand_off(self, route: Route) -> Driver:
        """Go back from the pregrasp to the stand-off; the approach ends at time 0."""
        import mujoco

        driver = Driver(self.world, self.data, route.approach.end, self.settings)
        self.data.qpos[self.world.carrier] = route.approach.coordinates[0]
        driver.drive(self.data, route.approach, 0.0)
        self.data.time = -SAMPLE * samples(route.approach)
        mujoco.mj_fwdPosition(self.world.model, self.data)
        return driver

    def penetrations(self) -> dict[str, float]:
        """Penetrations of hand and arm at the planned pregrasp [m], by what they are in."""
        return self._inside[0]

    def overlaps(self) -> tuple[Knock, ...]:
        """Unwanted overlaps of hand and arm at the planned pregrasp."""
        return self._inside[1]

    def approach(self) -> Iterator[Reading]:
        """Follow the route to the pregrasp, with the fingers in its posture; nothing without a route."""
        if self.route:
            yield from self._along(APPROACH, self.route.approach)
            self.data.time = 0.0  # but for rounding

    def close(self) -> Iterator[Reading]:
        """Ramp the setpoints to their ends, then let the springs act until all is at rest, or for the longest wait."""
        last: list[Reading] = []
        ramp = ceil(self.ramp / SAMPLE - ROUNDING)
        for i in range(1, ramp + round(self.settings.close_time / SAMPLE) + 1):
            reading = self._advance("close")
            yield reading
            if i >= ramp:  # before that, standing still does not count as being at rest
                last = [*last[-REST_SAMPLES:], reading]
            if calm(last):
                return

    def lift(self) -> Iterator[Reading]:
        """Follow the route; without one, wrist and targets rise by h (10 s³ - 15 s⁴ + 6 s⁵), at rest at both ends."""
        if self.route:
            yield from self._along("lift", self.route.lift)
            return
        (rise,), samples = self.world.carrier_speeds, round(self.settings.lift_time / SAMPLE)
        for i in range(samples):
            s = (i + 0.5) / samples
            acceleration = self.settings.lift_height * (60 * s - 180 * s**2 + 120 * s**3) / (samples * SAMPLE) ** 2
            self.data.qfrc_applied[rise] = ARM_INERTIA * acceleration
            yield self._advance("lift")
        self.data.qfrc_applied[rise] = 0.0

    def hold(self) -> Iterator[Reading]:
        """Hold still."""
        for _ in range(round(self.settings.hold_time / SAMPLE)):
            yield self._advance("hold")

    def push(self, direction: str) -> Iterator[Reading]:
        """Apply a constant force at the centre of mass, then restore the state before the push."""
        before = copy.copy(self.data)
        weight = self.settings.push_weights * self.settings.mass * GRAVITY
        self.data.xfrc_applied[self.world.object_body, :3] = weight * np.array(AXES[direction])
        try:
            for _ in range(round(self.settings.push_time / SAMPLE)):
                yield self._advance(f"push {direction}")
        finally:
            self.data = before
            self.recorder.forget()

    def _along(self, phase: str, leg: Leg) -> Iterator[Reading]:
        for i in range(samples(leg)):
            yield self._advance(phase, leg, i * SAMPLE)
        if self._driver:
            self._driver.rest(self.data, leg)

    def _advance(self, phase: str, leg: Leg | None = None, time: float = 0.0) -> Reading:
        """Simulate to the next sample, along a leg of which `time` [s] has passed."""
        import mujoco

        for i in range(round(SAMPLE / self.settings.timestep)):
            if self._driver and leg:
                self._driver.drive(self.data, leg, time + i * self.settings.timestep)
            mujoco.mj_step1(self.world.model, self.data)
            self.act()
            mujoco.mj_step2(self.world.model, self.data)
        reading = self.recorder.read(self.data, phase)
        return replace(reading, off=self._driver.off(reading.wrist)) if self._driver else reading

    def act(self) -> None:
        """Write the controller's torques into the motors. Closing begins at time 0."""
        now, motors = self.data, len(self.world.effort)
        now.ctrl[:motors] = self.controller.torques(now.time, self.world.wrist(now), *self.world.own_joints(now))


def samples(leg: Leg) -> int:
    """Number of samples of a leg."""
    return ceil(leg.seconds / SAMPLE - ROUNDING)


def law(settings: SimulationSettings) -> Law:
    """The law of the simulated hand.

    The law has no gravity term, because MuJoCo compensates the weight. The URDF's inertias are placeholders, so MuJoCo
    spreads a link's mass over its visual geometry, and the controller does not know these centres of mass.
    """
    return Law(control=settings.control, gravity=WEIGHTLESS, joint_inertia=settings.joint_armature)


def calm(readings: Sequence[Reading]) -> bool:
    """Whether object and tips were at rest over the last of these readings."""
    last = readings[-REST_SAMPLES - 1 :]
    return len(last) > REST_SAMPLES and all(_slow(before, now) for before, now in pairwise(last))


def _slow(before: Reading, now: Reading) -> bool:
    steps = np.vstack([now.tips - before.tips, now.centre - before.centre])
    turn = rotation_angle(now.rotation @ before.rotation.T)
    return bool(np.linalg.norm(steps, axis=1).max() < REST_SPEED * SAMPLE and turn < REST_TURN * SAMPLE)


def settled(body: Body, settings: SimulationSettings, obstacles: Sequence[Shape] = ()) -> Array:
    """The object's qpos (7,) at rest on the table, relative to its given mesh."""
    import mujoco

    model = object_alone(body, settings, obstacles)
    data = mujoco.MjData(model)
    steps, still = round(SAMPLE / settings.timestep), 0
    for _ in range(round(SETTLE_TIME / SAMPLE)):
        mujoco.mj_step(model, data, steps)
        slow = np.linalg.norm(data.qvel[:3]) < REST_SPEED and np.linalg.norm(data.qvel[3:]) < REST_TURN
        still = still + 1 if slow else 0
        if still >= REST_SAMPLES:
            break
    return np.array(data.qpos)
