"""The examples of the documentation that are no page: a term of the energy, a program that knows no Python."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pinocchio
import pytest
from plans import SMALL_FLAGS, small_plan
from scipy.spatial.transform import Rotation

import sgnlp
from sgnlp.cli import run
from sgnlp.planning import results

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "docs" / "examples"
BOOST = Path(pinocchio.__file__).parents[4] / "include"  # Pinocchio's wheel brings its headers
SMALL = [*SMALL_FLAGS[:4], "--contact.samples", "4", "--solver.no-compiled", "--solver.formulation", "constrained"]
SMALL += ["--starts", "1", "--jobs", "1"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A small result."""
    plan = small_plan()
    made = tmp_path_factory.mktemp("result")
    results.save(plan.arrays(), plan.summary(), made)
    return made


@pytest.fixture(scope="module")
def reader(tmp_path_factory) -> Path:
    """The C++ program, compiled."""
    compiler = shutil.which("c++") or shutil.which("g++")
    if compiler is None or not (BOOST / "boost").is_dir():
        pytest.skip("needs a C++ compiler and Boost's headers")
    program = tmp_path_factory.mktemp("program") / "read_grasp"
    source = EXAMPLES / "read_grasp.cpp"
    flags = ["-std=c++17", "-Wall", "-Wextra", "-Werror", "-isystem", BOOST]
    subprocess.run([compiler, *flags, "-o", program, source], check=True)
    return program


def test_a_program_without_python_reads_the_best_grasp(folder, reader):
    done = subprocess.run([reader, folder / results.SUMMARY], capture_output=True, encoding="utf-8", check=True)
    read = {line.split()[0]: np.array(line.split()[1:], float) for line in done.stdout.splitlines()}
    grasps = sgnlp.load_grasps(folder)
    np.testing.assert_allclose(read["wrist"], grasps.wrist[0], atol=1e-6)
    for name, angle in zip(grasps.joint_names, grasps.joints[0], strict=True):
        assert read[str(name)][0] == pytest.approx(angle, abs=1e-6)
    for name, target, gain in zip(grasps.finger_names, grasps.targets[0], grasps.gains[0], strict=True):
        np.testing.assert_allclose(read[str(name)], [*target, gain], atol=1e-3)


def test_it_says_when_no_start_is_feasible(reader, tmp_path):
    (tmp_path / "summary.json").write_text('{"best": null}', encoding="utf-8")
    done = subprocess.run([reader, tmp_path / "summary.json"], capture_output=True, encoding="utf-8")
    assert (done.returncode, done.stdout) == (1, "no start is feasible\n")


def test_the_summary_has_of_each_finger_what_the_arrays_have(folder):
    grasps, best = sgnlp.load_grasps(folder), json.loads((folder / results.SUMMARY).read_text(encoding="utf-8"))["best"]
    for i, name in enumerate(grasps.finger_names):
        finger = best["fingers"][str(name)]
        for key, values in {
            "target": "targets",
            "tip_pregrasp": "tips_pregrasp",
            "contact_point": "contact_points",
        }.items():
            assert finger[key] == getattr(grasps, values)[0, i].tolist()
        assert finger["normal"] == grasps.normals[0, i].tolist()


def test_a_file_with_a_term_and_a_constraint_changes_plan_energy_and_checks(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    spread = []
    for own in ([], ["--with", str(EXAMPLES / "my_terms.py")]):
        run(["solve", str(ROOT / "problems" / "mug_0.npz"), "--out", "made", "--quiet", *own, *SMALL])
        grasps, summary = sgnlp.load_grasps("made"), json.loads(Path("made/summary.json").read_text(encoding="utf-8"))
        spread.append(np.ptp(grasps.contacts[0, :, 2]))
    heights = grasps.contacts[0, :, 2]
    assert grasps.term_names[-1] == "level"
    assert grasps.energy_terms[0, -1] == pytest.approx(((heights - heights.mean()) ** 2).sum())
    assert spread[1] < 0.5 * spread[0]
    assert summary["constraints"][-1] == "upright"
    assert summary["extension"]["sha256"] == grasps.meta["extension"]["sha256"]
    named = "upright" in "".join(grasps.violated)
    rotation = Rotation.from_quat(grasps.wrist[0, 3:]).as_matrix()
    assert named == (rotation[2, 0] > -np.cos(np.radians(30)) + 1e-3)
