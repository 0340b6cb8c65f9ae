"""Versions, machine, solvers and backends of the kinematics are told, and what is missing never stops a command."""

import importlib.util
import platform
import sys

import casadi
import numpy
import pytest

import sgnlp
from sgnlp.base.errors import InputError
from sgnlp.hand import placement_functions
from sgnlp.hand.arm import available_arms
from sgnlp.hand.hand import available_hands, load_hand
from sgnlp.hand.placements import BACKENDS
from sgnlp.planning import environment


def test_versions_are_those_that_run():
    found = environment.versions()
    assert found["python"] == platform.python_version()
    assert (found["numpy"], found["casadi"]) == (numpy.__version__, casadi.__version__)
    assert found["sgnlp"] == sgnlp.__version__
    assert set(found) == {"python", *environment.PACKAGES}


def test_a_package_that_is_not_installed_is_missing(monkeypatch):
    monkeypatch.setattr(environment, "PACKAGES", ("numpy", "no-such-package"))
    assert environment.versions()["no-such-package"] == "missing"


def test_the_commit_is_that_of_the_checkout_and_says_whether_files_differ(monkeypatch):
    answers = {"rev-parse": "f" * 40, "status": ""}
    monkeypatch.setattr(environment, "_git", lambda folder, verb, *_: answers[verb])
    assert environment.commit() == "f" * 40
    answers["status"] = " M sgnlp/planning/ipopt.py"
    assert environment.commit() == "f" * 40 + " + changes"


def test_there_is_no_commit_without_git_or_outside_a_checkout(monkeypatch, tmp_path):
    monkeypatch.setattr(environment, "__file__", str(tmp_path / "sgnlp" / "environment.py"))
    assert environment.commit() == "none"
    monkeypatch.setenv("PATH", "")
    assert environment.commit() == "none"


def test_the_machine_has_a_system_and_a_processor():
    found = environment.machine()
    assert found["system"] == platform.system()
    assert all(isinstance(value, str) and value for value in found.values())


@pytest.mark.parametrize("lines", ["", "flags : fpu vme"])
def test_a_processor_without_a_name_is_called_by_its_kind(monkeypatch, lines):
    monkeypatch.setattr(environment, "processor", lambda: lines)
    assert environment.machine()["processor"] == (platform.processor() or platform.machine())


def test_the_solvers_that_are_found_can_be_made():
    found = environment.solvers()
    assert found["nlpsol ipopt"]
    assert found["linsol mumps"]
    x, A = casadi.SX.sym("x"), casadi.diag(casadi.DM([2.0, 4.0]))
    for kind, name in (key.split() for key, there in found.items() if there):
        if kind == "nlpsol":
            made = casadi.nlpsol("s", name, {"x": x, "f": (x - 1) ** 2})
            assert made.size_out("x") == (1, 1)
        else:
            solved = casadi.Linsol("s", name, A.sparsity()).solve(A, casadi.DM([2.0, 8.0]))
            assert list(solved.full().ravel()) == [1.0, 2.0]
    solver = casadi.nlpsol("s", "ipopt", {"x": x, "f": (x - 1) ** 2}, {"ipopt.print_level": 0, "print_time": False})
    assert float(solver()["x"]) == pytest.approx(1)


def test_what_is_not_found_is_told_to_be_missing(monkeypatch):
    monkeypatch.setattr(casadi, "has_nlpsol", "uno".__eq__)
    monkeypatch.setattr(casadi, "has_linsol", "ma27".__eq__)
    assert {name for name, there in environment.solvers().items() if there} == {"nlpsol uno", "linsol ma27"}
    assert len(environment.solvers()) == 7


@pytest.mark.skipif(casadi.__version__ < "3.8", reason="CasADi before 3.8 does not read what 3.8 has written")
def test_the_best_backend_is_told_and_why_no_better_one_runs(monkeypatch):
    there = importlib.util.find_spec("pinocchio.casadi") is not None
    assert set(environment.shipped()) == {*available_hands(), *available_arms()}
    lacks = environment.kinematics_lacks()
    assert list(lacks) == list(BACKENDS[:-1])
    assert bool(lacks["pinocchio.casadi"]) != there
    assert lacks["pinocchio (compiled)"] == ""
    assert environment.kinematics_backends() == BACKENDS[0 if there else 1]
    monkeypatch.setitem(sys.modules, "pinocchio.casadi", None)
    carried = placement_functions.library.beside
    left = placement_functions.file_name(load_hand("allegro_left").model)
    monkeypatch.setattr(placement_functions.library, "beside", lambda name: None if name == left else carried(name))
    told = environment.kinematics_backends()
    assert told.startswith("model walk (allegro_left); pinocchio (compiled) (allegro_right, ")
    assert environment.kinematics_lacks()["pinocchio (compiled)"].startswith("not for allegro_left: no function of")


def test_a_description_that_is_not_installed_stops_nothing(monkeypatch):
    def missing(name):
        raise InputError("is its package installed?")

    monkeypatch.setattr(environment, "load_arm", missing)
    assert set(environment.shipped()) == set(available_hands())
