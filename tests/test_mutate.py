"""The table of mutations fits the code and the tests, and a mutation is told by what its tests do."""

import ast
from collections import Counter
from functools import cache

import mutate
import pytest
from mutate import BROKEN, KILLED, ROOT, SURVIVED, UNSOUND, Mutation, copied, table, verdict

TABLE = table()
BALL = "simulation/test_slip.py::test_a_ball_that_slides_covers_its_way"
COVERED = (
    *("program/equilibrium", "program/terms/spring", "program/terms/contact", "program/constraints"),
    *("surface/kernels", "surface/gpis", "surface/jets", "program/lifting"),
    *("hand/kinematics", "planning/kkt", "planning/starts", "planning/recompute", "program/formulations/elastic"),
    *(
        "program/formulations/lifted",
        "program/assembly",
        "program/constraint",
        "simulation/judge",
        "simulation/protocol",
    ),
    *("simulation/recorder", "simulation/slip", "control/law", "control/controller", "control/command"),
    *("simulation/contacts", "simulation/articulation", "control/tree", "control/export"),
)
"""Files of which there are mutations at least."""


def test_a_mutation_has_its_text_in_one_place_and_leaves_a_file_that_can_be_read():
    assert [mutation.name for mutation in TABLE if not changes(mutation)] == []


def changes(mutation: Mutation) -> bool:
    """Whether the file can be read with the mutation, and then holds other code."""
    text = (ROOT / "sgnlp" / mutation.file).read_text(encoding="utf-8")
    mutated = mutation.applied(text)  # which raises unless the text is there once
    if not mutation.file.endswith(".py"):  # C is compiled when it is run
        return mutated != text
    return ast.dump(ast.parse(mutated)) != code(text)


@cache
def code(text: str) -> str:
    """What a file says, without its layout and comments."""
    return ast.dump(ast.parse(text))


@cache
def functions(file: str) -> set[str]:
    """The functions of a file of tests."""
    tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_the_tests_that_must_notice_a_mutation_exist():
    for mutation in TABLE:
        assert mutation.tests, mutation.name
        for test in mutation.tests:
            file, name = test.split("::")
            assert name.split("[")[0] in functions(file), test


def test_names_are_given_once_and_every_part_of_the_mathematics_and_of_the_judge_has_some():
    assert max(Counter(mutation.name for mutation in TABLE).values()) == 1
    assert {f"{file}.py" for file in COVERED} <= {mutation.file for mutation in TABLE}
    assert len(TABLE) >= 40


@pytest.mark.parametrize(("old", "count"), [("np.linalg.norm", 1), ("Array", 12), ("no such text", 0)])
def test_a_text_that_is_not_there_exactly_once_is_told_and_nothing_is_tried(tmp_path, old, count):
    stale = Mutation("stale", "simulation/slip.py", old, "x", (BALL,))
    assert (ROOT / "sgnlp" / stale.file).read_text(encoding="utf-8").count(old) == count
    if count == 1:
        assert stale.applied(f"1 + {old}") == "1 + x"
    else:
        assert verdict(stale, tmp_path) == f"{BROKEN}: stale: its text is {count} times in simulation/slip.py"


def test_a_copy_has_the_package_the_hands_and_the_tests_and_nothing_is_mutated_elsewhere(tmp_path):
    folder = copied(tmp_path)
    places = {name: name for name in ("sgnlp/surface/gpis_jets.c", "tests/scenes.py", "pyproject.toml")}
    for inside, ours in (places | {"sgnlp/urdf/allegro_left/hand.yaml": "urdf/allegro_left/hand.yaml"}).items():
        assert (folder / inside).read_bytes() == (ROOT / ours).read_bytes()
        assert not (folder / inside).resolve().is_relative_to(ROOT)


PARTED = "self.normal * (self.normal @ parted)"


@pytest.mark.parametrize(("new", "told"), [("parted", KILLED), ("(self.normal @ parted) * self.normal", SURVIVED)])
def test_a_mutation_that_its_tests_notice_is_killed_and_another_survives(tmp_path, new, told):
    assert verdict(Mutation("slip", "simulation/slip.py", PARTED, new, (BALL,)), tmp_path) == told


@pytest.mark.parametrize(
    ("code", "told"), [(0, SURVIVED), (1, KILLED), (2, BROKEN), (4, BROKEN), (UNSOUND, BROKEN), (None, BROKEN)]
)
def test_only_a_failure_kills_and_no_tests_at_all_or_none_that_end_do_not(monkeypatch, tmp_path, code, told):
    monkeypatch.setattr(mutate, "tested", lambda folder, tests: code)
    found = verdict(Mutation("slip", "simulation/slip.py", PARTED, "parted", (BALL,)), tmp_path)
    assert found.split(":")[0] == told


@pytest.mark.parametrize(("verdicts", "code"), [([KILLED, KILLED], 0), ([KILLED, SURVIVED], 1), ([BROKEN, KILLED], 1)])
def test_it_ends_with_1_where_one_is_not_killed_and_tells_of_each(monkeypatch, capsys, verdicts, code):
    rows = [Mutation(f"{word} one", "simulation/slip.py", PARTED, "parted", (BALL,)) for word in ("first", "second")]
    told = dict(zip(rows, verdicts, strict=True))
    monkeypatch.setattr(mutate, "table", lambda: [*rows, Mutation("other", "", "", "", ())])
    monkeypatch.setattr(mutate, "sound", lambda mutations, parent: "")
    monkeypatch.setattr(mutate, "verdict", lambda mutation, parent: told[mutation])
    assert mutate.main(["first", "second"]) == code
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith(f"{verdicts.count(KILLED)} of 2 mutations killed in ")
    assert {line.split()[0] for line in lines[:-1]} == set(verdicts)
    assert mutate.main(["none"]) == 1


def test_tests_that_fail_without_a_mutation_end_it(monkeypatch, capsys):
    monkeypatch.setattr(mutate, "sound", lambda mutations, parent: "why")
    assert mutate.main([]) == 1
    assert capsys.readouterr().out == "why\n"
