"""The experiment, phase by phase: settle, pregrasp, close until rest, lift, hold, six pushes."""

import copy
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from sgnlp.control.command import Command
from sgnlp.control.controller import Controller
from sgnlp.control.law import WEIGHTLESS, Law
from sgnlp.hand.hand import Hand
from sgnlp.program.equilibrium import GRAVITY
from sgnlp.simulation.body import Body
from sgnlp.simulation.contacts import penetrations
from sgnlp.simulation.recorder import Reading, Recorder
from sgnlp.simulation.settings import ROUNDING, SAMPLE, SimulationSettings
from sgnlp.simulation.world import ARM_INERTIA, object_alone, world

Array = NDArray[np.float64]

REST_SPEED, REST_TURN = 1e-3, 2e-2
"""At rest, tips and object are slower than this [m/s] and the object turns slower than this [rad/s] ..."""
REST_SAMPLES = 20
"""... for as many samples on end."""
SETTLE_TIME = 3.0
"""Longest wait for the object to rest on the table [s]."""
AXES = {"+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0), "+z": (0, 0, 1), "-z": (0, 0, -1)}


class Experiment:
    """One grasp in the simulator. The phases are generators of readings, to be taken in their order."""

    def __init__(self, command: Command, body: Body, hand: Hand, settings: SimulationSettings) -> None:
        import mujoco

        self.settings, self.body, self.ramp = settings, body, command.closing_seconds
        self.world = world(body, hand, command, settings)
        self.data: Any = mujoco.MjData(self.world.model)
        self.data.qpos[self.world.object_place] = settled(body, settings)
        self.data.qpos[self.world.hand_joints] = hand.moving_angles(command.joints)
        self.controller = Controller(hand, command, law(settings))
        mujoco.mj_fwdPosition(self.world.model, self.data)
        self.act()
        mujoco.mj_forward(self.world.model, self.data)
        hull = body.vertices[ConvexHull(body.vertices).vertices]
        self.recorder = Recorder(self.world, hull)
        self.given = self.world.model.body_ipos[self.world.object_body].copy()  # (3,) centre of mass before settling
        self.begin = self.recorder.read(self.data, "pregrasp")

    def penetrations(self) -> dict[str, float]:
        """Of the hand at the pregrasp [m]."""
        return penetrations(self.world, self.data)

    def close(self) -> Iterator[Reading]:
        """The setpoints ramp to their ends, then the springs act until all is at rest, or for the longest wait."""
        last: list[Reading] = []
        ramp = ceil(self.ramp / SAMPLE - ROUNDING)
        for i in range(1, ramp + round(self.settings.close_time / SAMPLE) + 1):
            reading = self._advance("close")
            yield reading
            if i >= ramp:  # before, a hand that stands still is no hand at rest
                last = [*last[-REST_SAMPLES:], reading]
            if calm(last):
                return

    def lift(self) -> Iterator[Reading]:
        """Wrist and targets rise along the quintic h (10 s³ - 15 s⁴ + 6 s⁵), at rest at both ends."""
        samples = round(self.settings.lift_time / SAMPLE)
        for i in range(samples):
            s = (i + 0.5) / samples
            acceleration = self.settings.lift_height * (60 * s - 180 * s**2 + 120 * s**3) / (samples * SAMPLE) ** 2
            self.data.qfrc_applied[self.world.lift] = ARM_INERTIA * acceleration
            yield self._advance("lift")
        self.data.qfrc_applied[self.world.lift] = 0.0

    def hold(self) -> Iterator[Reading]:
        """Nothing moves on purpose."""
        for _ in range(round(self.settings.hold_time / SAMPLE)):
            yield self._advance("hold")

    def push(self, direction: str) -> Iterator[Reading]:
        """A constant force at the centre of mass; the state before is restored after."""
        before = copy.copy(self.data)
        weight = self.settings.push_weights * self.settings.mass * GRAVITY
        self.data.xfrc_applied[self.world.object_body, :3] = weight * np.array(AXES[direction])
        try:
            for _ in range(round(self.settings.push_time / SAMPLE)):
                yield self._advance(f"push {direction}")
        finally:
            self.data = before
            self.recorder.forget()

    def _advance(self, phase: str) -> Reading:
        import mujoco

        for _ in range(round(SAMPLE / self.settings.timestep)):
            mujoco.mj_step1(self.world.model, self.data)
            self.act()
            mujoco.mj_step2(self.world.model, self.data)
        return self.recorder.read(self.data, phase)

    def act(self) -> None:
        """Write the torques of the controller into the motors. It closes from the begin on."""
        now = self.data
        now.ctrl[:] = self.controller.torques(now.time, self.world.wrist(now), *self.world.own_joints(now))


def law(settings: SimulationSettings) -> Law:
    """The law of the simulated hand.

    MuJoCo bears its weight: it spreads the mass of a link over what the URDF shows of it, because the URDF's inertias
    are placeholders. The centres of mass are not those that the controller knows.
    """
    return Law(control=settings.control, gravity=WEIGHTLESS, joint_inertia=settings.joint_armature)


def calm(readings: Sequence[Reading]) -> bool:
    """Whether object and tips were at rest over the last of these readings."""
    last = readings[-REST_SAMPLES - 1 :]
    return len(last) > REST_SAMPLES and all(_slow(before, now) for before, now in pairwise(last))


def _slow(before: Reading, now: Reading) -> bool:
    steps = np.vstack([now.tips - before.tips, now.centre - before.centre])
    turn = angle(now.rotation @ before.rotation.T)
    return bool(np.linalg.norm(steps, axis=1).max() < REST_SPEED * SAMPLE and turn < REST_TURN * SAMPLE)


def angle(R: Array) -> float:
    """Angle of a rotation matrix [rad], accurate near 0."""
    return float(2 * np.arcsin(min(np.linalg.norm(R - np.eye(3)) / np.sqrt(8.0), 1.0)))


def settled(body: Body, settings: SimulationSettings) -> Array:
    """The object's qpos (7,) at rest on the table, from where its mesh was given."""
    import mujoco

    model = object_alone(body, settings)
    data = mujoco.MjData(model)
    steps, still = round(SAMPLE / settings.timestep), 0
    for _ in range(round(SETTLE_TIME / SAMPLE)):
        mujoco.mj_step(model, data, steps)
        slow = np.linalg.norm(data.qvel[:3]) < REST_SPEED and np.linalg.norm(data.qvel[3:]) < REST_TURN
        still = still + 1 if slow else 0
        if still >= REST_SAMPLES:
            break
    return np.array(data.qpos)
