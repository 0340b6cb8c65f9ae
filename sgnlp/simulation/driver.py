"""Moves the hand along a route: by the servos of an arm, or as a floating wrist at the commanded speed."""

from typing import Any

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.arm_kinematics import wrist_pose
from sgnlp.simulation.arm_articulation import ARM, tune
from sgnlp.simulation.route import Leg
from sgnlp.simulation.settings import SimulationSettings
from sgnlp.simulation.world import World


class Driver:
    """Moves the wrist along a leg, and knows its commanded pose.

    A servo gets joints and speeds: τ = k (q* - q) + d (q̇* - q̇), on top of the weight of arm and hand. A floating
    wrist has so much inertia that it keeps the speed that is written into it.
    """

    def __init__(self, world: World, data: Any, pregrasp: Array, settings: SimulationSettings) -> None:
        """Tune the servos of an arm at the pregrasp (d,), the present state of `data`."""
        self.world, self.step, self.told = world, settings.timestep, pregrasp
        self._origin = world.wrist(data)[:3] - (pregrasp if world.arm is None else 0.0)
        if world.arm is not None:
            tune(world.model, world.arm, data.qpos, settings)
            names = [world.model.actuator(ARM + name).id for name in world.arm.joint_names]
            self._servos = np.array(names)
            self._lead = -world.model.actuator_biasprm[names, 2] / world.model.actuator_gainprm[names, 0]

    def drive(self, data: Any, leg: Leg, time: float) -> None:
        """Command the next step, at a time [s] since the beginning of a leg."""
        self.told, speeds = leg.at(time)
        if self.world.arm is None:
            there = leg.at(time + self.step)[0]
            data.qvel[self.world.carrier_speeds] = (there - data.qpos[self.world.carrier]) / self.step
        else:
            data.ctrl[self._servos] = self.told + self._lead * speeds

    def rest(self, data: Any, leg: Leg) -> None:
        """Stay at the end of a leg."""
        self.told = leg.end
        if self.world.arm is None:
            data.qvel[self.world.carrier_speeds] = 0.0
        else:
            data.ctrl[self._servos] = leg.end

    def off(self, wrist: Array) -> float:
        """Distance of the wrist (7,) from its commanded place [m]."""
        arm = self.world.arm
        place = self._origin + self.told if arm is None else wrist_pose(arm, self.told)[:3]
        return float(np.linalg.norm(wrist[:3] - place))
