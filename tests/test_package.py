"""The package as it is installed: what the wheel holds, the public names, the entry point."""

import configparser
import importlib.metadata
import importlib.util
import inspect
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

import sgnlp

ROOT = Path(__file__).parents[1]
SOURCES = ("sgnlp", "urdf", "setup.cfg", "pyproject.toml", "README.md", "LICENSE")
WHEEL_ALONE = (70, 1)  # the version of setuptools that builds wheels without the package wheel


def setuptools_builds_wheels() -> bool:
    if importlib.util.find_spec("wheel"):
        return True
    if not importlib.util.find_spec("setuptools"):
        return False
    version = importlib.metadata.version("setuptools").split(".")
    return tuple(map(int, version[:2])) >= WHEEL_ALONE


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> zipfile.ZipFile:
    """The wheel built from a copy of the sources, so that no build folder is left in them."""
    if not setuptools_builds_wheels():
        pytest.skip("neither setuptools >= 70.1 nor wheel is installed, and the test suite downloads nothing")
    folder = tmp_path_factory.mktemp("source")
    for name in SOURCES:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, folder / name)
    pip = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", "dist", "."]
    done = subprocess.run(pip, cwd=folder, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    (file,) = (folder / "dist").glob("*.whl")
    return zipfile.ZipFile(file)


def python(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, encoding="utf-8")


def test_the_wheel_holds_every_module_hand_and_arm(wheel):
    names = set(wheel.namelist())
    modules = {str(path.relative_to(ROOT)) for path in (ROOT / "sgnlp").rglob("*.py")}
    hands = {f"sgnlp/{path.relative_to(ROOT)}" for path in (ROOT / "urdf").glob("*/hand.yaml")}
    arms = {f"sgnlp/{path.relative_to(ROOT)}" for path in (ROOT / "urdf").glob("*/arm.yaml")}
    assert min(len(hands), len(arms)) >= 2
    headers = {str(path.relative_to(ROOT)) for path in (ROOT / "sgnlp").rglob("*.hpp")}
    assert "sgnlp/control/include/sgnlp/controller.hpp" in headers
    assert modules | hands | arms | headers | {"sgnlp/py.typed"} <= names


def test_the_wheel_holds_nothing_but_the_package(wheel):
    top = {name.split("/")[0] for name in wheel.namelist()}
    assert top == {"sgnlp", f"sgnlp-{sgnlp.__version__}.dist-info"}
    assert not [
        name
        for name in wheel.namelist()
        if re.search(r"test(?!set\.py$)|problems|results/|\.npz|\.pyc|__pycache__|\.cache", name)
    ]


def test_the_wheel_names_the_command_and_what_it_needs(wheel):
    info = f"sgnlp-{sgnlp.__version__}.dist-info"
    assert "sgnlp = sgnlp.cli:main" in wheel.read(f"{info}/entry_points.txt").decode()
    metadata = wheel.read(f"{info}/METADATA").decode()
    for package in ("casadi", "pin", "example-robot-data", "numpy", "scipy", "open3d", "tyro", "rich", "pyyaml"):
        assert re.search(rf"^Requires-Dist: {package}\b", metadata, re.MULTILINE), package


@pytest.mark.parametrize("name", sgnlp.__all__)
def test_every_public_name_is_there_and_documented(name):
    documentation = inspect.getdoc(getattr(sgnlp, name))
    assert documentation
    assert not documentation.startswith(f"{name}(")  # what a dataclass writes for itself


def test_the_public_names_are_sorted_and_complete():
    assert list(sgnlp.__all__) == sorted(set(sgnlp.__all__))
    assert {"load", "solve", "load_grasps", "preset"} <= set(sgnlp.__all__)


def test_the_version_is_that_of_the_metadata():
    config = configparser.ConfigParser()
    config.read(ROOT / "setup.cfg", encoding="utf-8")
    assert config["metadata"]["version"] == sgnlp.__version__


@pytest.mark.parametrize(("file", "exact"), [("constraints.txt", False), ("constraints-lowest.txt", True)])
def test_the_pinned_versions_are_within_what_is_asked_for_or_the_lowest_of_it(file, exact):
    lines = (ROOT / "tests" / file).read_text(encoding="utf-8").splitlines()
    pinned = dict(line.split("==") for line in lines if not line.startswith("#"))
    config = configparser.ConfigParser()
    config.read(ROOT / "setup.cfg", encoding="utf-8")
    asked = [config["options"]["install_requires"], *config["options.extras_require"].values()]
    for requirement in (Requirement(line) for text in asked for line in text.split("\n") if line):
        version = pinned[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(version), requirement
        lowest = [Version(bound.version) for bound in requirement.specifier if bound.operator == ">="]
        assert not exact or lowest in ([], [Version(version)]), requirement


def test_the_command_is_an_entry_point():
    (entry,) = importlib.metadata.entry_points(group="console_scripts", name="sgnlp")
    assert callable(entry.load())


def test_planning_from_an_npz_loads_no_experiment_and_nothing_heavy(tmp_path):
    heavy = "sgnlp.experiments open3d pandas plotly mujoco trimesh matplotlib"
    flags = f"--starts 1 --jobs 1 --quiet --no-build --gpis.surface-points 40 --out {tmp_path / 'out'}"
    done = python(
        "import sys; from sgnlp.cli import run; "
        f"code = run('solve problems/orange_0.npz {flags}'.split()); "
        f"print(code in (0, 1), [name for name in '{heavy}'.split() if name in sys.modules])"
    )
    assert (done.stdout, done.stderr) == ("True []\n", "")


def test_neither_the_package_nor_the_command_needs_open3d():
    done = python("import sys; sys.modules['open3d'] = None; import sgnlp, sgnlp.cli; sgnlp.load('problems/mug_0.npz')")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
