"""Carries out a grasp of a result on a robot with ROS 2: joint states and the wrist's pose in, joint torques out.

    python grasp_node.py --ros-args -p result:=results/can_1 -r commands:=/hand_effort_controller/commands

It answers each `joint_states` that has all joints of the hand with a message on `commands`, for ros2_control's
`effort_controllers/JointGroupEffortController` or `forward_command_controller/ForwardCommandController` with the
interface `effort`. At first it holds the pregrasp; the service `close` closes the hand. Nothing is sent while no states
come, and ros2_control keeps the last torques then: let the hardware stop by itself.
"""

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

import sgnlp
from sgnlp.control import Controller, Law, command
from sgnlp.hand.model import check_unit


class GraspNode(Node):
    """The controller of one grasp between three topics and a service."""

    def __init__(self) -> None:
        super().__init__("sgnlp_grasp")
        self.declare_parameter("result", "results/can_1")
        self.declare_parameter("rank", 0)
        self.declare_parameter("control", "impedance")
        self.declare_parameter("joints", [""])  # in the order of the effort controller; [""]: the hand's order
        grasps = sgnlp.load_grasps(self._value("result"))
        hand = sgnlp.load_hand(grasps.meta["hand"])
        told = command(grasps, self._value("rank"))
        self.controller = Controller(hand, told, Law(control=self._value("control")))
        self.names = hand.joint_names
        asked = [name for name in self._value("joints") if name] or self.names
        self.order = [self.names.index(name) for name in asked]  # of torques in a message
        self.wrist = told.wrist  # planned, until it is told
        self.begin = None  # of closing [ns]
        self.publisher = self.create_publisher(Float64MultiArray, "commands", 1)
        self.create_subscription(PoseStamped, "wrist", self.on_wrist, 1)
        self.create_subscription(JointState, "joint_states", self.on_joints, 1)
        self.create_service(Trigger, "close", self.on_close)

    def on_wrist(self, message: PoseStamped) -> None:
        """Where the hand's root link is in the world: which way is down."""
        p, q = message.pose.position, message.pose.orientation
        wrist = np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w])
        try:
            if wrist.tolist() == [0, 0, 0, 0, 0, 0, 1] and not message.header.frame_id:
                raise sgnlp.InputError("nobody filled it in")
            check_unit(wrist, "the wrist")
        except sgnlp.InputError as error:
            self.get_logger().error(f"left out a wrist: {error}")
            return
        self.wrist = wrist

    def on_joints(self, message: JointState) -> None:
        """One cycle."""
        place = {name: i for i, name in enumerate(message.name)}
        if not place.keys() >= set(self.names) or len(message.velocity) < len(message.name):
            return  # the states of another part of the robot, or without speeds
        rows = [place[name] for name in self.names]
        joints, speeds = np.array(message.position)[rows], np.array(message.velocity)[rows]
        torques = self.controller.torques(self.seconds(), self.wrist, joints, speeds)
        if not np.isfinite(torques).all():
            self.get_logger().error("the joint states are no numbers: no torque")
            torques = np.zeros(len(self.names))
        self.publisher.publish(Float64MultiArray(data=[float(torques[i]) for i in self.order]))

    def on_close(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Begin to close; the setpoints ramp from now on."""
        self.begin = self.get_clock().now().nanoseconds
        response.success, response.message = True, f"closes in {self.controller.command.closing_seconds:g} s"
        return response

    def seconds(self) -> float:
        """Since closing began [s], 0 before."""
        return 0.0 if self.begin is None else 1e-9 * (self.get_clock().now().nanoseconds - self.begin)

    def _value(self, name: str):
        return self.get_parameter(name).value


def main() -> None:
    """Run the node until it is interrupted; its last message lets the hand go limp."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # else the last message would not go out any more
    node = GraspNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.publisher.publish(Float64MultiArray(data=[0.0] * len(node.order)))
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
