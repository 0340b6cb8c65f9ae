"""The node for ROS 2 runs against messages as ROS defines them, without ROS."""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plans import small_plan

import sgnlp
from sgnlp.control import Controller, Law, command
from sgnlp.planning import results

NODE = Path(__file__).parents[1] / "docs" / "examples" / "ros2" / "grasp_node.py"
MESSAGES = ("sensor_msgs/JointState", "std_msgs/Float64MultiArray", "geometry_msgs/PoseStamped")
TURNED = [0.1, 0.2, 0.3, 0.5, -0.5, 0.5, 0.5]


def fields(kind: str) -> dict[str, Any]:
    """The fields of a message, from the definitions of ROS 2."""
    typesys = pytest.importorskip("rosbags.typesys", reason="carries the definitions of ROS's messages")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    return dict(store.fielddefs[kind.replace("/", "/msg/")][1])


def message(kind: str) -> type:
    """A message of ROS: it takes its fields as keywords and knows no others."""
    names = fields(kind)

    class Message:
        __slots__ = tuple(names)

        def __init__(self, **values: Any) -> None:
            for name, value in values.items():
                setattr(self, name, value)

    return Message


class FakeNode:
    """What the node uses of rclpy, with the parameters, topics and services that it has made."""

    given: dict[str, Any]  # parameters by name

    def __init__(self, name: str) -> None:
        self.name, self.sent, self.heard, self.served, self.defaults = name, [], {}, {}, {}
        self.now, self.told = 5_000_000_000, []

    def declare_parameter(self, name, value):
        self.defaults[name] = value

    def get_parameter(self, name):
        return SimpleNamespace(value=self.given.get(name, self.defaults[name]))

    def create_publisher(self, kind, topic, depth):
        assert topic == "commands"
        return SimpleNamespace(publish=self.sent.append)

    def create_subscription(self, kind, topic, callback, depth):
        self.heard[topic] = callback

    def create_service(self, kind, name, callback):
        self.served[name] = callback

    def get_clock(self):
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=self.now))

    def destroy_node(self):
        self.publisher = None

    def get_logger(self):
        return SimpleNamespace(error=self.told.append)


@pytest.fixture
def ros(monkeypatch) -> Iterator[dict[str, type]]:
    """Modules of ROS that hold no more than the node asks for."""
    made = {kind: message(kind) for kind in MESSAGES}
    modules = {name: ModuleType(name) for name in ("rclpy", "rclpy.node", "rclpy.signals")}
    modules["rclpy.node"].Node = FakeNode
    modules["rclpy.signals"].SignalHandlerOptions = SimpleNamespace(NO=0)
    for kind, cls in made.items():
        package, name = kind.split("/")
        modules |= {package: ModuleType(package), f"{package}.msg": ModuleType(f"{package}.msg")}
        setattr(modules[f"{package}.msg"], name, cls)
    modules |= {"std_srvs": ModuleType("std_srvs"), "std_srvs.srv": ModuleType("std_srvs.srv")}
    modules["std_srvs.srv"].Trigger = SimpleNamespace(Request=object, Response=object)
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    return made


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A small result."""
    plan, made = small_plan(), tmp_path_factory.mktemp("result")
    results.save(plan.arrays(), plan.summary(), made)
    return made


@pytest.fixture
def grasps(folder) -> sgnlp.Grasps:
    return sgnlp.load_grasps(folder)


def example() -> ModuleType:
    """The file of the node."""
    spec = importlib.util.spec_from_file_location("grasp_node", NODE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def node(given: dict[str, Any]) -> Any:
    """The node of the example with these parameters."""
    FakeNode.given = given
    return example().GraspNode()


def state(ros, names, joints, speeds) -> Any:
    """A message of joint states, an arm's joint first and the others in backward order."""
    rows = [("arm", 9.0, 9.0), *reversed(list(zip(names, joints, speeds, strict=True)))]
    name, position, velocity = zip(*rows, strict=True)
    return ros["sensor_msgs/JointState"](name=list(name), position=list(position), velocity=list(velocity))


def test_it_answers_joint_states_in_any_order_with_the_torques_of_the_controller_in_that_of_the_parameter(
    ros, folder, grasps
):
    names, told = [str(name) for name in grasps.joint_names], command(grasps)
    running = node({"result": str(folder), "joints": sorted(names, reverse=True)})
    joints, speeds = told.joints + 0.02, np.linspace(-0.5, 0.5, len(names))
    controller = Controller(sgnlp.load_hand(grasps.meta["hand"]), told)
    for seconds in (0.0, 0.25, 3.0):
        if seconds == 0.25:
            response = running.served["close"](None, SimpleNamespace())
            assert response.success
        running.now = 5_000_000_000 + round(1e9 * seconds)
        running.heard["joint_states"](state(ros, names, joints, speeds))
        torques = controller.torques(seconds, told.wrist, joints, speeds)
        expected = [torques[names.index(name)] for name in sorted(names, reverse=True)]
        np.testing.assert_allclose(running.sent[-1].data, expected, atol=1e-9)
    assert len(running.sent) == 3


def test_the_weight_is_borne_as_the_wrist_is_turned(ros, folder, grasps):
    names, told = [str(name) for name in grasps.joint_names], command(grasps)
    running, still = node({"result": str(folder), "control": "position"}), np.zeros(len(names))
    x, y, z, *turn = TURNED
    point, turned = SimpleNamespace(x=x, y=y, z=z), SimpleNamespace(**dict(zip("xyzw", turn, strict=True)))
    pose = SimpleNamespace(position=point, orientation=turned)
    running.heard["wrist"](ros["geometry_msgs/PoseStamped"](pose=pose))
    running.heard["joint_states"](state(ros, names, told.joints, still))
    controller = Controller(sgnlp.load_hand(grasps.meta["hand"]), told, Law(control="position"))
    expected = controller.torques(0.0, np.array(TURNED), told.joints, still)
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(running.sent[-1].data, expected, atol=1e-12)


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (np.nan, 0.0, 0.0, 1.0)])
def test_a_wrist_that_nobody_filled_in_is_left_out_in_one_line(ros, folder, grasps, turn):
    running = node({"result": str(folder)})
    turned = SimpleNamespace(**dict(zip("xyzw", turn, strict=True)))
    pose = SimpleNamespace(position=SimpleNamespace(x=0.0, y=0.0, z=0.0), orientation=turned)
    running.heard["wrist"](ros["geometry_msgs/PoseStamped"](header=SimpleNamespace(frame_id=""), pose=pose))
    np.testing.assert_array_equal(running.wrist, command(grasps).wrist)
    (line,) = running.told
    assert line.startswith("left out a wrist")
    assert "\n" not in line


def test_states_of_another_part_or_without_speeds_are_passed_over_and_those_that_are_no_numbers_give_no_torque(
    ros, folder, grasps
):
    names, told = [str(name) for name in grasps.joint_names], command(grasps)
    running = node({"result": str(folder)})
    running.heard["joint_states"](state(ros, names[1:], told.joints[1:], told.joints[1:]))
    halt = state(ros, names, told.joints, told.joints)
    halt.velocity = []
    running.heard["joint_states"](halt)
    assert running.sent == []
    running.heard["joint_states"](state(ros, names, np.full(len(names), np.nan), told.joints))
    assert running.sent[0].data == [0.0] * len(names)


def test_when_it_is_interrupted_its_last_message_is_no_torque(ros, folder, grasps, monkeypatch):
    FakeNode.given, running = {"result": str(folder)}, []

    def spin(made):
        running.append(made)
        raise KeyboardInterrupt

    known = {"init": lambda signal_handler_options: None, "spin": spin, "try_shutdown": lambda: None}
    for name, function in known.items():
        monkeypatch.setattr(sys.modules["rclpy"], name, function, raising=False)
    example().main()
    assert running[0].sent[-1].data == [0.0] * len(grasps.joint_names)


def test_poses_have_the_fields_that_the_node_reads():
    assert fields("geometry_msgs/Pose").keys() == {"position", "orientation"}
    assert fields("geometry_msgs/Point").keys() == set("xyz")
    assert fields("geometry_msgs/Quaternion").keys() == set("xyzw")
