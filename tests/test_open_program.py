"""The program as others extend it: terms, constraints and formulations from outside the package."""

import json
import pickle
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from finite_differences import assert_jacobian
from plans import SMALL_FLAGS
from scenes import SMALL, ellipsoid, hand, observation, random_point

import sgnlp
from sgnlp.cli import codes, run
from sgnlp.planning import extension as planning_extension
from sgnlp.planning.additions import CHECKS, Additions
from sgnlp.planning.batch import Task
from sgnlp.planning.planner import Planner
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.starts import starts
from sgnlp.program.formulation import Phase
from sgnlp.program.formulations import FORMULATIONS
from sgnlp.program.nlp import build
from sgnlp.program.oracle import join

INTERPRETED = replace(SMALL, solver=replace(SMALL.solver, compiled=False))
ONE_PHASE = replace(INTERPRETED, solver=replace(INTERPRETED.solver, formulation="constrained"))


@dataclass(frozen=True)
class Reach(sgnlp.Term):
    """E = Σ (|a_i - w| - r)²: tips at one distance r from the wrist, a quantity that no built-in term has."""

    distance: float = 0.12  # [m]

    def value(self, g, op):
        wrist = [g.wrist_position[i] for i in range(3)]
        away = [(g.tips[:, i] - wrist[i]) ** 2 for i in range(3)]
        return op.sum(((away[0] + away[1] + away[2]) ** 0.5 - self.distance) ** 2)


def palm_over_centre(g, op):
    """Height of the palm's frame over the object's centre, and its distance beside it along x [m]."""
    return op.stack(g.links["palm_link"][2] - g.centre[2], g.links["palm_link"][0] - g.centre[0])


OVER = sgnlp.Constraint("over", palm_over_centre, lower=-0.2, upper=0.2, unit="m")


def problem(**added: object) -> Problem:
    return build_problem(observation(), hand(), INTERPRETED, 0, Additions(**added))


@pytest.mark.parametrize("form", ["penalty", "constrained"])
def test_a_term_and_a_constraint_have_exact_derivatives_and_their_exact_value_in_the_result(form):
    posed = problem(terms=(Reach(weight=100.0),), constraints=(OVER,))
    functions = join(build(hand(), posed.structure(FORMULATIONS[form])), posed.gpis)
    start, x = random_point(posed, functions.nlp, 0)
    p = posed.parameters(functions.nlp, start.wrist, start.joints)
    lam = np.random.default_rng(0).normal(size=sum(functions.nlp.row_sizes))

    def lagrangian(y):
        return np.array(functions.gradient(y, p)[1]).ravel() + np.array(functions.jacobian(y, p)[1]).T @ lam

    assert_jacobian(lambda y: float(functions.objective(y, p)), functions.gradient(x, p)[1], x)
    H = np.array(functions.hessian(x, p, 1.0, lam))
    assert_jacobian(lagrangian, H + np.triu(H, 1).T, x)
    if form == "constrained":
        J, rows = np.array(functions.jacobian(x, p)[1]), functions.nlp.row_names
        assert rows[-2:] == ("over[0]", "over[1]")
        assert_jacobian(lambda y: functions.values(y, p)[-2:], J[-2:], x)


@pytest.fixture(scope="module")
def plan() -> sgnlp.Plan:
    impossible = sgnlp.Constraint("impossible", lambda g, op: g.wrist_position[2], lower=5.0, unit="m")
    return sgnlp.solve(
        observation(),
        hand(),
        ONE_PHASE,
        terms=[Reach(100.0)],
        constraints=[OVER, impossible],
        count=1,
        jobs=1,
        rounds=1,
    )


def test_what_is_added_is_in_the_tables_and_what_is_not_met_is_named(plan):
    s = plan.solutions[0]
    g, names = s.grasp, plan.arrays().term_names.tolist()
    value = ((np.linalg.norm(g.tips - g.wrist_position, axis=1) - 0.12) ** 2).sum()
    assert s.energy_terms[names.index("reach")] == pytest.approx(value, rel=1e-12)
    checks = {check.name: check for check in s.checks}
    assert checks["over"].unit == "mm"
    assert -200 <= checks["over"].value <= 200
    assert "impossible" in s.violated
    assert "impossible" in {v.name for v in s.violations}
    assert not s.feasible
    assert plan.best is None


def test_no_constraint_can_have_the_name_of_a_check_of_every_plan(plan):
    of_plan = {check.name for check in plan.solutions[0].checks} - {one.name for one in plan.problem.constraints}
    assert of_plan == {"joint_limits", "stable"} <= set(CHECKS)


def test_a_formulation_of_ones_own_is_solved_in_its_phases():
    class Polished(sgnlp.Formulation):
        def phases(self, solver):
            return (Phase(FORMULATIONS["constrained"], solver.max_iterations), Phase(FORMULATIONS["lifted"], 50))

    planner = Planner(problem(formulation=Polished()))
    assert Polished.name == "polished"
    iterate = planner.solve(starts(planner.problem, 1, 0)[0])
    assert [stage.nlp.structure.formulation.name for stage in planner.stages] == ["constrained", "lifted"]
    assert set(iterate.history.formulation) == {"constrained", "lifted"}
    assert iterate.kkt.worst < 1e-5


def test_built_in_parts_are_looked_up_changed_and_left_out_by_name():
    stiffer = replace(sgnlp.constraints(SMALL)["stiffness"], lower=0.02)
    deeper = replace(sgnlp.terms(SMALL)["tar"], weight=2000.0)
    without = {"without_terms": ("uncer",), "without_constraints": ("shift",)}
    posed = problem(terms=(deeper,), constraints=(stiffer,), **without)
    assert [t.name for t in posed.terms] == [name for name in sgnlp.terms(SMALL) if name != "uncer"]
    assert [c.name for c in posed.constraints] == [name for name in sgnlp.constraints(SMALL) if name != "shift"]
    assert {t.name: t.weight for t in posed.terms}["tar"] == 2000.0
    assert {c.name: c.lower for c in posed.constraints}["stiffness"] == 0.02


def test_a_name_that_is_not_there_or_twice_and_bounds_that_are_crossed_are_refused():
    with pytest.raises(sgnlp.InputError, match=r"unknown term 'uncertain'; valid: .*uncer"):
        sgnlp.terms(SMALL)["uncertain"]
    with pytest.raises(sgnlp.InputError, match=r"unknown constraint 'slip'; valid: .*shift"):
        problem(without_constraints=("slip",))
    with pytest.raises(sgnlp.InputError, match="two of the given terms are called 'reach'"):
        problem(terms=(Reach(1.0), Reach(2.0)))
    with pytest.raises(sgnlp.InputError, match="constraint 'x' has the bounds 2 to 1"):
        sgnlp.Constraint("x", palm_over_centre, lower=2.0, upper=1.0)


def test_a_part_without_its_method_is_told_by_name():
    class Empty(sgnlp.Term):
        pass

    class Idle(sgnlp.Solver):
        pass

    with pytest.raises(sgnlp.InputError, match=r"term 'empty' has no method `value\(self, g, op\)`"):
        Additions(terms=(Empty(),))
    with pytest.raises(sgnlp.InputError, match=r"solver 'idle' has no method `solve\(self, nlp, x\)`"):
        Additions(solver=Idle())


@pytest.mark.parametrize("phases", [(), None, FORMULATIONS["lifted"]])
def test_a_formulation_without_phases_is_refused(phases):
    class Nowhere(sgnlp.Formulation):
        def phases(self, solver):
            return phases

    added = Additions(formulation=Nowhere())
    with pytest.raises(sgnlp.InputError, match=r"the phases of formulation 'nowhere' must be one `Phase\("):
        added.structures(SMALL)
    with pytest.raises(sgnlp.InputError, match="the phases of formulation 'nowhere' must be"):
        _ = problem(formulation=Nowhere()).phases


def test_a_plan_without_any_term_is_refused():
    without = tuple(sgnlp.terms(SMALL))
    with pytest.raises(sgnlp.InputError, match="the formulation 'penalty' has no term in its objective; leave one in"):
        problem(without_terms=without).structure(FORMULATIONS["penalty"])


def test_a_term_that_casadi_cannot_take_or_that_is_no_number_is_told_by_name():
    class Odd(sgnlp.Term):
        def value(self, g, op):
            return np.linalg.norm(g.contacts)

    class Many(sgnlp.Term):
        def value(self, g, op):
            return g.gains

    class Nothing(sgnlp.Term):
        def value(self, g, op):
            op.sum(g.gains)

    class Leaving(sgnlp.Term):
        def value(self, g, op):
            raise SystemExit(0)

    for ours, said in ((Nothing(), "'nothing' gives no value; return one"), (Leaving(), "CasADi .*: SystemExit: 0")):
        with pytest.raises(sgnlp.InputError, match=said):
            build(hand(), problem(terms=(ours,)).structure(FORMULATIONS["penalty"]))
    line = r"at line \d+, 'return np.linalg.norm\(g.contacts\)'"
    with pytest.raises(
        sgnlp.InputError, match=rf"term 'odd' cannot be written in CasADi {line}: .*`op`, such as op\.sum"
    ):
        build(hand(), problem(terms=(Odd(),)).structure(FORMULATIONS["penalty"]))
    with pytest.raises(sgnlp.InputError, match=r"term 'many' has 4 values, not one; sum them with op.sum"):
        build(hand(), problem(terms=(Many(),)).structure(FORMULATIONS["penalty"]))


@pytest.mark.parametrize(
    "value",
    [
        lambda g, op: np.sum(g.gains),
        lambda g, op: np.linalg.norm(g.contacts, axis=1)[0],
        lambda g, op: sum(g.gains),
        lambda g, op: max(g.gains, 0),
        lambda g, op: g.contacts.sum(),
    ],
)
def test_what_only_numpy_can_do_is_refused_with_the_operations_that_both_have(value):
    own = type("Own", (sgnlp.Term,), {"value": lambda self, g, op: value(g, op), "__module__": __name__})
    for _ in range(2):  # CasADi warns once
        with pytest.raises(
            sgnlp.InputError, match=r"term 'own' cannot .* at line \d+, .*: .*; write it in the operations"
        ) as told:
            build(hand(), problem(terms=(own(),)).structure(FORMULATIONS["penalty"]))
        assert len(str(told.value)) < 650, "CasADi's own advice, of several hundred characters, is left out"


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (lambda g, op: op.sum(g.torque), r"line \d+, .*: g has no 'torque'; valid: .*, torques, torques_eq, "),
        (lambda g, op: op.mean(g.gains), r"line \d+, .*: op has no 'mean'; valid: abs, .*, sum$"),
        (
            lambda g, op: g.links["plam_link"],
            r"line \d+, .*: KeyError: 'plam_link'; the names in g.links: .* palm_link",
        ),
        (lambda g, op: [g.gains[0], g.gains[1]], r"'own' gives a list; put its parts into op\.stack"),
        (lambda g: g.stiffness, r"takes 1 positional argument .*; a term has `value\(self, g, op\)`"),
    ],
)
def test_a_name_that_grasp_or_operations_lack_and_other_arguments_are_told_with_the_valid_ones(value, told):
    own = sgnlp.Constraint("own", value, lower=0.0)
    with pytest.raises(sgnlp.InputError, match=told):
        build(hand(), problem(constraints=(own,)).structure(FORMULATIONS["constrained"]))


def test_the_line_of_a_function_that_was_typed_into_a_console_has_its_number_alone():
    space: dict = {"np": np}
    exec(compile("def value(g, op):\n    return np.max(g.gains)", "<console>", "exec"), space)
    own = sgnlp.Constraint("own", space["value"], lower=0.0)
    with pytest.raises(sgnlp.InputError, match="cannot be written in CasADi at line 2: a function of NumPy"):
        build(hand(), problem(constraints=(own,)).structure(FORMULATIONS["constrained"]))


# --- from a file ------------------------------------------------------------------------------------------------------

FILE = """
import sgnlp

class Level(sgnlp.Term):
    def value(self, g, op):
        z = g.contacts[:, 2]
        return op.sum((z - op.sum(z) / z.shape[0]) ** 2)

TERMS = [Level(1e6)]
CONSTRAINTS = [sgnlp.Constraint("high", lambda g, op: g.wrist_position[2], lower=0.05, unit="m")]
WITHOUT_TERMS = ["uncer"]
"""


@pytest.fixture
def file(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("own.py").write_text(FILE, encoding="utf-8")
    np.savez("egg.npz", points=ellipsoid(), table_height=0.0)
    return Path("own.py")


def test_a_file_adds_to_a_plan_and_its_hash_is_in_the_result(file):
    flags = ["--starts", "1", "--jobs", "1", "--with", "own.py", "--solver.formulation", "constrained", *SMALL_FLAGS]
    assert run(["solve", "egg.npz", "--quiet", *flags]) in (codes.FEASIBLE, codes.NONE_FEASIBLE)
    summary = json.loads(Path("results/egg/summary.json").read_text(encoding="utf-8"))
    assert summary["extension"] == {"file": str(file.absolute()), "sha256": sgnlp.extension(file).digest}
    assert (summary["terms"][-1], summary["constraints"][-1]) == ("level", "high")
    assert "uncer" not in summary["terms"]


def test_the_parts_of_a_file_have_its_hash_in_the_key_of_compiled_functions(file):
    posed = problem(**vars(sgnlp.extension(file).additions()))
    key = posed.structure(FORMULATIONS["constrained"]).key
    assert key is not None
    file.write_text(FILE.replace("1e6", "1e5"), encoding="utf-8")
    changed = problem(**vars(sgnlp.extension(file).additions()))
    assert changed.structure(FORMULATIONS["constrained"]).key not in (None, key)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import nothing_there", "fails: ModuleNotFoundError: No module named 'nothing_there'"),
        ("TERMS = [", "fails: SyntaxError"),
        ("import sys\nsys.exit(0)", "fails: SystemExit: 0"),
        ("\n\nx = 1 / 0", "fails: ZeroDivisionError: division by zero"),
        ("x = 1", "defines none of TERMS, CONSTRAINTS"),
        ("TERMS = 3", "TERMS in .* must be a list, not int"),
        ("import sgnlp\nTERMS = [sgnlp.Term]", "TERMS in .* needs Term objects, not Term, a class; call it"),
        ("TERMZ = []", "unknown name in .* 'TERMZ'; valid: CONSTRAINTS"),
        ("TERMS = []\nCONSTRAINT = [3]", "unknown name in .* 'CONSTRAINT'; valid: CONSTRAINTS"),
        ("CONSTRAINTS = [4]", "CONSTRAINTS in .* needs Constraint objects, not int"),
    ],
)
def test_what_is_wrong_with_a_file_is_told_in_a_line(file, text, said, capfd):
    file.write_text(text, encoding="utf-8")
    with pytest.raises(sgnlp.InputError, match=said):
        sgnlp.extension(file)
    assert run(["solve", "egg.npz", "--with", "own.py"]) == codes.BAD_INPUT
    err = capfd.readouterr().err
    assert err.startswith("error: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "line"), [("\n\nx = 1 / 0", 3), ("def f():\n    raise OSError\n\n\nf()", 2), ("\nTERMS = [", 2)]
)
def test_the_line_of_a_file_that_fails_is_told(file, text, line, capfd):
    file.write_text(text, encoding="utf-8")
    assert run(["solve", "egg.npz", "--with", "own.py"]) == codes.BAD_INPUT
    assert re.search(rf"own\.py, line {line}\)\n$", capfd.readouterr().err)


def test_a_file_that_is_not_there_is_told(file, capfd):
    assert run(["solve", "egg.npz", "--with", "none.py"]) == codes.BAD_INPUT
    assert "'none.py' cannot be read: No such file or directory" in capfd.readouterr().err


def test_the_task_of_a_batch_carries_the_file_to_workers_that_do_not_have_it(file):
    sent = pickle.dumps(Task(extension=sgnlp.extension(file)))
    file.unlink()
    planning_extension._additions.cache_clear()
    found = pickle.loads(sent).extension.additions()
    assert [term.name for term in found.terms] == ["level"]
    assert [constraint.name for constraint in found.constraints] == ["high"]
