"""The controller in C++ gives the torques of the one in Python, from a file that this one writes."""

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import casadi
import numpy as np
import pytest
from commands import aimed, inside, pose
from hands import coupled, weighed

from sgnlp.base.errors import InputError
from sgnlp.control import Controller, Law, export, include
from sgnlp.hand.hand import Hand, load_hand

EIGEN = (Path(casadi.__file__).parent / "include" / "eigen3", Path("/usr/include/eigen3"))
"""CasADi's wheel brings Eigen's headers."""
FLAGS = ("-std=c++17", "-Og", "-Wall", "-Wextra", "-Werror", "-Wno-deprecated-declarations")
LAWS = {"impedance": Law(), "position": Law(control="position"), "other": Law("impedance", (1.0, -2.0, 3.0), 0.5, 2e-3)}
CYCLES = 20


@pytest.fixture(scope="session")
def program(tmp_path_factory) -> Path:
    """The program that runs the C++ controller, compiled."""
    compiler = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
    eigen = next((folder for folder in EIGEN if (folder / "Eigen" / "Dense").is_file()), None)
    if compiler is None or eigen is None:
        pytest.skip("needs a C++ compiler and Eigen's headers")
    made = tmp_path_factory.mktemp("program") / "controller"
    source = Path(__file__).with_name("controller.cpp")
    subprocess.run([compiler, *FLAGS, "-I", include(), "-isystem", eigen, "-o", made, source], check=True)
    return made


@pytest.fixture(scope="module", params=["allegro_left", "dlr_hit_right", "coupled"])
def hand(request, tmp_path_factory) -> Hand:
    made = request.param == "coupled"
    return load_hand(weighed(coupled(tmp_path_factory.mktemp("hand"))) if made else request.param)


@pytest.fixture
def told(program, tmp_path) -> Callable[..., np.ndarray]:
    """Setpoints and torques of the C++ controller, in a row, at each of some states."""

    def run(controller: Controller, states: list[tuple]) -> np.ndarray:
        export(controller, tmp_path / "grasp.txt")
        lines = [" ".join(repr(float(x)) for part in state for x in np.ravel(part)) for state in states]
        command = [program, tmp_path / "grasp.txt"]
        done = subprocess.run(command, input="\n".join(lines), capture_output=True, encoding="utf-8")
        assert (done.returncode, done.stderr) == (0, ""), "3 is a cycle that allocates"
        return np.array([line.split() for line in done.stdout.splitlines()], float)

    return run


def states(hand: Hand, told, seed: int) -> list[tuple]:
    """Times before, at, on and after the way, wrists that move, joints near the pregrasp and anywhere, speeds."""
    rng, n = np.random.default_rng(seed), len(hand.joint_names)
    near = [(t, told.wrist, told.joints + rng.normal(0, 0.02, n), rng.normal(0, 0.1, n)) for t in (-1.0, 0.0, 0.1, 0.5)]
    return [*near, *((rng.uniform(0, 1), pose(rng), inside(hand, rng), rng.normal(size=n)) for _ in range(CYCLES))]


@pytest.mark.parametrize("name", LAWS)
def test_setpoints_and_torques_are_those_of_python(hand, told, name):
    aim = aimed(hand)
    controller = Controller(hand, aim, LAWS[name])
    at = states(hand, aim, 1)
    expected = [np.concatenate([controller.setpoints(state[0]).ravel(), controller.torques(*state)]) for state in at]
    np.testing.assert_allclose(told(controller, at), expected, atol=1e-9, rtol=0)
    torques = np.array(expected)[:, -len(hand.joint_names) :]
    assert (np.abs(torques) < hand.effort).any()


@pytest.mark.parametrize("changes", [{"posture": 0.0}, {"closing_seconds": 0.0}, {"joints_contact": None}])
def test_so_they_are_without_posture_or_ramp(hand, told, changes):
    aim = aimed(hand, 2, **changes)
    controller, at = Controller(hand, aim), states(hand, aim, 2)
    expected = [controller.torques(*state) for state in at]
    np.testing.assert_allclose(told(controller, at)[:, -len(hand.joint_names) :], expected, atol=1e-9, rtol=0)


def test_so_they_are_at_the_limit(hand, told):
    aim = aimed(hand, 3, gains=np.full(len(hand.fingers), 5000.0))
    controller, at = Controller(hand, aim), states(hand, aim, 3)
    expected = np.array([controller.torques(*state) for state in at])
    limited = np.abs(expected) == hand.effort
    assert limited.any()
    assert not limited.all()
    np.testing.assert_allclose(told(controller, at)[:, -len(hand.joint_names) :], expected, atol=1e-9, rtol=0)


def test_so_they_are_with_a_quaternion_of_four_digits(hand, told):
    aim = aimed(hand, 4)
    controller = Controller(hand, aim)
    at = [(time, np.round(wrist, 4), joints, speeds) for time, wrist, joints, speeds in states(hand, aim, 4)]
    expected = [controller.torques(*state) for state in at]
    np.testing.assert_allclose(told(controller, at)[:, -len(hand.joint_names) :], expected, atol=1e-9, rtol=0)


def test_a_state_that_is_no_number_gives_a_torque_that_is_none_in_either(hand, told):
    aim, n = aimed(hand), len(hand.joint_names)
    state = (0.1, aim.wrist, aim.joints, np.full(n, np.nan))
    assert np.isnan(Controller(hand, aim).torques(*state)).any()
    assert np.isnan(told(Controller(hand, aim), [state])[0, -n:]).any()


@pytest.mark.parametrize("part", [0.0, 0.4, np.nan, np.inf])
def test_a_wrist_without_a_unit_quaternion_is_refused_in_either(program, tmp_path, part):
    hand = load_hand("allegro_left")
    aim = aimed(hand)
    state = (0.1, np.array([0.0, 0, 0, part, part, part, part]), aim.joints, np.zeros(16))
    with pytest.raises(InputError, match="the wrist must be"):
        Controller(hand, aim).torques(*state)
    export(Controller(hand, aim), tmp_path / "grasp.txt")
    line = " ".join(repr(float(x)) for values in state for x in np.ravel(values))
    done = subprocess.run([program, tmp_path / "grasp.txt"], input=line, capture_output=True, encoding="utf-8")
    assert (done.returncode, done.stdout) == (1, "")
    assert "sgnlp: the wrist's quaternion must have norm 1, not" in done.stderr


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("sgnlp-controller 1", "sgnlp-controller 2", "another version"),
        ("law impedance", "law force", "unknown law 'force'"),
        ("tip_mass", "mass", "'tip_mass' is missing, there is 'mass'"),
        ("end ", "end x", "a number is none"),
    ],
)
def test_a_file_that_is_none_is_refused_in_one_line(program, tmp_path, old, new, message):
    hand = load_hand("allegro_left")
    file = tmp_path / "grasp.txt"
    export(Controller(hand, aimed(hand)), file)
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new), encoding="utf-8")
    done = subprocess.run([program, file], input="", capture_output=True, encoding="utf-8")
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_file_that_cannot_be_written_and_a_number_that_is_none_are_refused(tmp_path):
    hand = load_hand("allegro_left")
    with pytest.raises(InputError, match="cannot be written"):
        export(Controller(hand, aimed(hand)), tmp_path / "nowhere" / "grasp.txt")
    for ours, file, said in ((aimed(hand), "grasp.txt", "controller"), (Controller(hand, aimed(hand)), None, "file")):
        with pytest.raises(InputError, match=f"^{said} must be "):
            export(ours, file)
    endless = replace(hand, effort=np.full(len(hand.effort), np.inf))
    with pytest.raises(InputError, match="not finite"):
        export(Controller(endless, aimed(hand)), tmp_path / "grasp.txt")
    assert not (tmp_path / "grasp.txt").exists()
