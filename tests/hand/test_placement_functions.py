"""Pinocchio's placements as serialised functions: those that the package carries, and those that C++ makes."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from arms import rail
from carry import URDF, main, shipped
from hands import THREE, coupled

from sgnlp.base import toolchain
from sgnlp.base.errors import InputError, SolverError
from sgnlp.hand import placement_functions as functions
from sgnlp.hand.arm import load_arm
from sgnlp.hand.hand import load_hand
from sgnlp.hand.placements import BACKENDS, Backend, backend, identity, lack, placements

WALK = BACKENDS[-1]

needs_cpp = pytest.mark.skipif(bool(functions.fault()), reason=functions.fault())


def models() -> list[Any]:
    """Each as a parameter of its name."""
    return [pytest.param(model, id=name) for name, model in shipped().items()]


def without(monkeypatch: pytest.MonkeyPatch) -> None:
    """The package carries nothing."""
    monkeypatch.setattr(functions.library, "beside", lambda name: None)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The C++ program in a cache of these tests' own: all others move made-up hands by the walk."""
    built, folder = functions.program(), tmp_path_factory.mktemp("cache") / "sgnlp"
    folder.mkdir()
    shutil.copy2(built, folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder.parent))
        yield


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty one."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return toolchain.cache_folder()


def test_the_package_carries_one_function_beside_each_description_that_of_its_model():
    there = {file.parent.name: file.name for file in sorted(URDF.glob("*/*.casadi"))}
    assert there == {name: functions.file_name(model) for name, model in shipped().items()}


@pytest.mark.parametrize("model", models())
def test_what_is_carried_is_what_runs(model: pin.Model, cache: Path):
    assert lack(model, "pinocchio (compiled)") == ""
    assert backend(model) in BACKENDS[:2]
    assert not cache.exists()


def derivatives(model: pin.Model, using: Backend) -> tuple[ca.Function, list[ca.Sparsity]]:
    """All placements, gradient and Hessian of a weighted sum of them, and their structural zeros."""
    q = ca.SX.sym("q", model.nq)
    parts = [part for placed in placements(model, q, using) for part in placed]
    every = ca.vertcat(*map(ca.vec, parts))
    weights = ca.DM(np.random.default_rng(2).normal(size=every.numel()))
    hessian, gradient = ca.hessian(ca.dot(weights, every), q)
    return ca.Function("f", [q], [every, gradient, hessian]), [part.sparsity() for part in parts]


def assert_same(model: pin.Model) -> None:
    """The program and the walk give the same placements, derivatives and structural zeros."""
    (f, zeros), (g, same) = (derivatives(model, using) for using in ("pinocchio (compiled)", WALK))
    assert zeros == same
    for at in np.random.default_rng(0).uniform(-2, 2, (20, model.nq)):
        for one, other, scale in zip(f(at), g(at), (1, 100, 100), strict=True):  # a sum of some hundred products
            np.testing.assert_allclose(np.array(one), np.array(other), atol=scale * functions.EXACT, rtol=0)


@pytest.mark.parametrize("model", models())
def test_the_walk_gives_the_placements_of_pinocchio(model: pin.Model):
    assert_same(model)


@pytest.mark.parametrize("made", [lambda folder: THREE, coupled])
def test_the_walk_of_slides_skew_axes_and_mimic_joints_is_that_of_numeric_pinocchio(made, tmp_path: Path):
    model = load_hand(made(tmp_path)).model
    q = ca.SX.sym("q", model.nq)
    chain = [ca.horzcat(*placed) for placed in placements(model, q, WALK)[1:]]
    f = ca.Function("f", [q], [ca.vertcat(*[ca.vec(ca.densify(part).T) for part in chain])])
    for check in functions.CHECKS:
        found = np.array(f(functions._configuration(model, *check)))[:, 0]
        np.testing.assert_allclose(found, functions._placed(model, *check), atol=functions.EXACT, rtol=0)


@needs_cpp
@pytest.mark.parametrize(
    "made",
    [lambda folder: load_hand(coupled(folder)), lambda folder: load_arm(rail(folder))],
    ids=["slides, skew axes and mimic joints", "a slanted rail"],
)
def test_the_program_gives_what_the_walk_gives(made, tmp_path: Path, program: None):
    model = made(tmp_path).model
    functions.build(model)
    assert backend(model) in BACKENDS[:2]
    assert_same(model)


@needs_cpp
@pytest.mark.parametrize("model", models())
def test_what_is_carried_is_what_the_program_makes(model: pin.Model, program: None):
    carried, made = functions.function(model), ca.Function.deserialize(functions.make(model))
    assert carried is not None
    assert [carried.instruction_id(k) for k in range(carried.n_instructions())] == [
        made.instruction_id(k) for k in range(made.n_instructions())
    ]
    assert [carried.sparsity_out(i) for i in (0, 1)] == [made.sparsity_out(i) for i in (0, 1)]
    for at in np.random.default_rng(1).uniform(-2, 2, (20, model.nq)):
        for one, other in zip(carried(at), made(at), strict=True):
            np.testing.assert_allclose(np.array(one), np.array(other), atol=1e-15, rtol=0)


@needs_cpp
def test_the_program_makes_the_placements_of_every_joint_that_turns_or_slides_and_of_no_other(program: None):
    model = pin.buildSampleModelManipulator()
    skew = np.array([2.0, -1.0, 2.0]) / 3
    kinds = [getattr(pin, f"JointModel{kind}{axis}")() for kind in "RP" for axis in "XYZ"]
    kinds += [pin.JointModelRevoluteUnaligned(skew), pin.JointModelPrismaticUnaligned(skew)]
    composite = pin.JointModelComposite(pin.JointModelRX())
    composite.addJoint(pin.JointModelPZ(), pin.SE3.Random())
    nested = pin.JointModelComposite(pin.JointModelPrismaticUnaligned(skew), pin.SE3.Random())
    nested.addJoint(composite, pin.SE3.Random())
    nested.addJoint(pin.JointModelRY(), pin.SE3.Random())
    for i, kind in enumerate([*kinds, composite, nested, pin.JointModelRZ()]):
        model.addJoint(model.njoints - 1 - i % 2, kind, pin.SE3.Random(), f"joint {i}")
    made = functions._read(functions.make(model), model)
    assert made is not None
    assert made.size_out(1) == (3, model.njoints - 1)
    half = pin.JointModelComposite(pin.JointModelRX())
    half.addJoint(pin.JointModelSpherical())
    for kind, strange in (
        (pin.JointModelFreeFlyer(), pin.JointModelFreeFlyer()),
        (pin.JointModelRUBX(), pin.JointModelRUBX()),
        (pin.JointModelHX(0.1), pin.JointModelHX(0.1)),
        (half, pin.JointModelSpherical()),
    ):
        other = model.copy()
        other.addJoint(model.njoints - 1, kind, pin.SE3.Random(), "last")
        with pytest.raises(SolverError, match=rf"joint 'last' is {strange.shortname()}: not supported"):
            functions.make(other)


@needs_cpp
def test_a_function_is_built_once_and_found_again_by_its_model(program: None, monkeypatch: pytest.MonkeyPatch):
    model = load_hand(THREE).model
    assert "sgnlp cache --build --hand HAND builds it" in lack(model, "pinocchio (compiled)")
    with pytest.raises(InputError, match="does not run here: no function of this model"):
        load_hand(THREE, kinematics="pinocchio (compiled)")
    before = load_hand(THREE)
    assert before.kinematics == WALK
    functions.build(model)
    monkeypatch.setattr(functions, "make", lambda model: pytest.fail("it is there"))
    functions.build(model)
    assert load_hand(THREE).kinematics == "pinocchio (compiled)"
    assert (before.kinematics, load_hand(THREE, kinematics=WALK).kinematics) == (WALK, WALK)


def test_another_model_a_damaged_and_an_unreadable_function_are_not_taken(cache: Path, monkeypatch: pytest.MonkeyPatch):
    left, right = (load_hand(f"allegro_{side}").model for side in ("left", "right"))
    text = (URDF / "allegro_left" / functions.file_name(left)).read_text(encoding="utf-8")
    assert functions._read(text, left) is not None
    for wrong in (text[: len(text) // 2], "", "x" + text):
        assert functions._read(wrong, left) is None
    assert functions._read(text, right) is None
    without(monkeypatch)
    assert functions.function(left) is None
    toolchain.keep(cache / functions.file_name(left), text.encode())
    assert functions.function(left) is not None
    toolchain.keep(cache / functions.file_name(left), text[:-100].encode())
    assert functions.function(left) is None
    assert "cannot read the function" in lack(left, "pinocchio (compiled)")
    assert backend(left) in ("pinocchio.casadi", WALK)


def test_models_that_differ_by_a_micrometre_or_an_axis_have_other_digests():
    model = load_hand("allegro_left").model
    moved = model.copy()
    moved.jointPlacements[5].translation = moved.jointPlacements[5].translation + np.array([0, 0, 1e-6])
    coupled, free = (pin.buildModelFromXML(CHAIN.format(axis), mimic=True) for axis in ("0 0 1", "0 1 0"))
    digests = [functions.digest(m) for m in (model, model.copy(), moved, coupled, free)]
    assert len(set(digests)) == 4
    assert digests[0] == digests[1]


CHAIN = """<robot name="chain"><link name="a"/><link name="b"/><joint name="ab" type="revolute"><parent link="a"/>
<child link="b"/><axis xyz="{}"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda patch, folder: patch.setenv("CXX", "no-such-compiler"), "no C++ compiler: $CXX is 'no-such-compiler'"),
        (lambda patch, folder: patch.setattr(pin, "__file__", f"{folder}/1/2/3/4/5"), "C++ headers are not in"),
    ],
)
def test_what_is_missing_is_told_with_the_remedy(cache, monkeypatch, tmp_path, change, said):
    change(monkeypatch, tmp_path)
    model = load_hand(THREE).model
    assert said in lack(model, "pinocchio (compiled)")
    with pytest.raises(SolverError, match=r"^[^\n]*$"):
        functions.build(model)
    assert backend(model) == WALK or backend(model) == "pinocchio.casadi"


def test_a_program_that_fails_or_makes_something_else_is_told(cache, monkeypatch):
    monkeypatch.setattr(functions, "fault", lambda: "")
    model, failing = load_hand(THREE).model, cache.parent / "failing"
    failing.write_text("#!/bin/sh\necho 'it is old' >&2; exit 1\n", encoding="utf-8")
    failing.chmod(0o755)
    monkeypatch.setattr(functions, "program", lambda: failing)
    with pytest.raises(SolverError, match=r"placements.cpp fails: it is old"):
        functions.build(model)
    failing.write_text("#!/bin/sh\necho nothing\n", encoding="utf-8")
    with pytest.raises(SolverError, match="are not those of Pinocchio"):
        functions.build(model)
    monkeypatch.setattr(functions, "TIMEOUT", 0.01)
    failing.write_text("#!/bin/sh\nsleep 5\n", encoding="utf-8")
    with pytest.raises(SolverError, match="timed out"):
        functions.build(model)
    assert not cache.exists()


def test_what_identifies_the_expressions_is_the_function_or_the_version(cache: Path, monkeypatch: pytest.MonkeyPatch):
    left, right = (load_hand(f"allegro_{side}").model for side in ("left", "right"))
    found = {identity("pinocchio (compiled)", *given) for given in ([left], [right], [left, right])}
    assert len(found | {identity(WALK, left)}) == 4
    monkeypatch.setattr(pin, "__version__", "0.0.0")
    assert identity(WALK, left) == f"{WALK} 0.0.0"
    without(monkeypatch)
    with pytest.raises(InputError, match="does not run here"):
        identity("pinocchio (compiled)", left)


def test_carrying_asks_for_the_casadi_that_all_can_read(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(ca, "__version__", "9.0.0")
    with pytest.raises(SystemExit, match=r"this is CasADi 9\.0\.0; the files are to be written by 3\.8\.0"):
        main()
