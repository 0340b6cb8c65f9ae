"""The printed tables: units are seen, numbers are those of the plan, nothing in a name is taken for markup."""

import re
from dataclasses import replace

import numpy as np
import pytest
from plans import small_plan
from readings import REST, TOUCHED, Played
from rich.console import Console
from scenes import hand

from sgnlp import cli
from sgnlp.hand.listing import Listing
from sgnlp.planning.ending import ENOUGH
from sgnlp.planning.plan import Plan
from sgnlp.planning.pool import Failure
from sgnlp.planning.violations import Violation
from sgnlp.show import sheets, trials
from sgnlp.show import tables as report
from sgnlp.show.columns import Table
from sgnlp.simulation import Command
from sgnlp.simulation.judge import judge


def tables(plan: Plan) -> list[Table]:
    """What `sgnlp solve` prints."""
    return report.tables(plan, plan.summary())


def printed(*tables: object, width: int = 80) -> str:
    """What the command line's console shows of tables on a terminal of that width."""
    console = cli._Console()
    console.width = width
    with console.capture() as capture:
        for table in tables:
            console.print(table)
    return capture.get()


def lines(table: object, width: int = 80) -> list[list[str]]:
    """The cells of a printed table, split at double spaces."""
    return [re.split(r"\s{2,}", line.strip()) for line in printed(table, width=width).splitlines()]


@pytest.fixture
def plan() -> Plan:
    return small_plan()


def test_the_starts_are_listed_best_first_and_failures_last(plan):
    failures = (Failure(9, "stopped after 1 s"), Failure(7, ENOUGH), Failure(8, "stopped after 1 s"))
    table, failed = (lines(each, width=100) for each in tables(replace(plan, failures=failures))[:2])
    assert table[0] == ["Starts, best first"]
    assert [line[0] for line in table[2:]] == [str(s.start) for s in plan.solutions]
    assert failed == [["Starts without a grasp"], ["start", "why"], ["7", ENOUGH], ["8 9", "stopped after 1 s"]]
    first = plan.solutions[0]
    assert table[2][1:5] == [
        "yes",
        f"{first.worst_margin:.3f}",
        f"{first.grasp.stiffness:.3f}",
        f"{first.energy:.1f}",
    ]
    assert table[2][-2:] == [str(first.iterations), f"{first.seconds:.2f}"]


def test_what_fails_is_named_in_the_row(plan):
    bad = plan.solutions[0]
    checks = tuple(replace(c, passed=c.name not in ("force", "stiffness")) for c in bad.checks)
    row = lines(tables(replace(plan, solutions=(replace(bad, checks=checks),)))[0], width=100)[2]
    assert row[1] == "no"
    assert row[-1] == "stiffness force"


def test_names_of_checks_are_broken_at_an_underscore_on_a_terminal_of_80_columns(plan):
    failing = ("margin_initial", "margin_equilibrium", "torque_initial", "torque_equilibrium", "object_contact")
    checks = tuple(replace(plan.best.checks[0], name=name, passed=False) for name in failing)
    changed = replace(plan.solutions[0], energy=-3422.1, kkt=replace(plan.best.kkt, dual=7e-07), checks=checks)
    text = printed(tables(replace(plan, solutions=(changed,)))[0])
    assert max(map(len, text.splitlines())) <= 80
    _title, _units, heads, *rows = text.splitlines()
    assert "[N m]" in heads
    parts = [row.split()[-1] for row in rows if row.strip()]
    assert "".join(parts) == "".join(failing)
    assert set(parts) == {"margin_", "initial", "equilibrium", "object_", "contact", "torque_"}


def test_a_column_of_prose_is_narrow_though_it_has_numbers():
    table = Table("Objects", "name", "numbers", "why", prose=["why"])
    table.add_row("can", "1234567 " * 3, "it has 5 points, at least 30 are needed")
    assert printed(table, width=40).splitlines()[1].split() == ["name", "numbers", "why"]


def test_a_title_that_is_wider_than_its_table_stays_in_one_line():
    assert printed(report.facts_table("Compiled, in /home/me/.cache/sgnlp", {"a": 1})).splitlines()[0].rstrip() == (
        "Compiled, in /home/me/.cache/sgnlp"
    )


@pytest.mark.parametrize("width", [30, 200])
def test_a_column_without_a_header_is_shown_too(width):
    table = Table("Clusters", "number", "")
    table.add_row("1", "no object: it is cut off by the image")
    assert " ".join(printed(table, width=width).split()).endswith("1 no object: it is cut off by the image")


def test_a_zero_has_no_sign(plan):
    grasps = plan.arrays()
    below = replace(
        grasps, contact_distance=grasps.contact_distance * 0 - 1e-9, energy_terms=0 * grasps.energy_terms - 1e-9
    )
    gaps = [row[4] for row in sheets.fingers(below, 0).rows[1:]]
    assert gaps == ["0.00"] * len(gaps)
    assert all(row[-1] == "0.00" for row in sheets.energy(below, 0, np.ones(len(below.term_names))).rows[1:-1])


def test_units_are_seen_and_every_table_fits_a_terminal_of_80_columns(plan):
    starts, fingers, energy, checks = tables(plan)
    text = printed(starts, fingers, energy, checks)
    for unit in ("[N m]", "[s]", "[N/m]", "[N]", "[mm]"):
        assert unit in text, unit
    assert printed(starts).count("\n") == 2 + len(plan.solutions)
    assert printed(fingers).count("\n") == 2 + len(hand().fingers)
    assert printed(energy).count("\n") == 3 + len(plan.problem.terms)
    assert printed(checks).count("\n") == 2 + len(plan.best.checks)


def test_the_fingers_table_has_the_numbers_of_the_summary(plan):
    table = lines(tables(plan)[1])
    assert "margin t0, eq" in table[1]
    for line, (name, finger) in zip(table[2:], plan.summary()["best"]["fingers"].items(), strict=True):
        assert line == [
            name,
            f"{finger['gain']:.0f}",
            f"{finger['force']:.2f}",
            f"{finger['margin_initial']:.3f} {finger['margin_equilibrium']:.3f}",
            f"{round(finger['contact_distance_mm'], 2) + 0.0:.2f}",
            f"{finger['deviation_mm']:.1f}",
            " ".join(f"{1e3 * x:+.0f}" for x in finger["target"]),
        ]


def test_the_shares_of_the_energy_add_up(plan):
    table = lines(tables(plan)[2])
    shares = [float(line[-1]) for line in table[2:]]
    assert sum(shares[:-1]) == pytest.approx(shares[-1], abs=0.005 * len(shares))
    assert table[-1] == ["total", f"{plan.best.energy:.2f}"]


def test_what_a_grasp_does_not_satisfy_is_listed_by_name_in_millimetres(plan):
    missed = (
        Violation("table[palm_ring]", 3.0, 12.0, "mm", 0.9),
        Violation("margin_initial[ring]", -0.1, 0.0, "", 0.1),
    )
    first = replace(plan.solutions[0], violations=missed)
    assert lines(report.violations_table(first))[2:] == [
        ["table[palm_ring]", "3 mm", "12 mm", "9 mm"],
        ["margin_initial[ring]", "-0.1", "0", "0.1"],
    ]
    with_list, without = (
        tables(replace(plan, solutions=(replace(first, violations=v), *plan.solutions[1:]))) for v in (missed, ())
    )
    assert len(with_list) == len(without) + 1


def test_every_check_is_shown_with_its_bound(plan):
    table = {line[0]: line[1:] for line in lines(tables(plan)[3])}
    for check in plan.best.checks:
        value, demanded, passed = table[check.name]
        shown = check.value if abs(check.value) >= 1e-3 else 0.0
        assert value == f"{shown:.3g}"
        assert demanded == check.demand
        assert passed == "yes"


def test_a_plan_without_solutions_has_only_the_table_of_starts(plan):
    none = replace(plan, solutions=(), failures=(Failure(0, "a"), Failure(1, "b")))
    some = replace(plan, solutions=plan.solutions[:1], failures=(Failure(1, ENOUGH),))
    assert report.headline(some).startswith("ellipsoid: 1 of 1 starts feasible, 1 left out, in ")
    assert len(tables(none)) == 1
    assert len(tables(plan)) == 4
    assert report.headline(none).startswith("ellipsoid: 0 of 2 starts feasible in ")
    assert report.headline(plan).startswith("ellipsoid: 2 of 2 starts feasible in ")


@pytest.mark.parametrize("text", ["[red]", "[/]", "[1]", ":warning:", "[N] [/bold]"])
def test_what_looks_like_markup_is_shown_as_it_is(plan, text):
    assert text in printed(tables(replace(plan, failures=(Failure(0, text),)))[1], width=100)
    assert text in printed(report.facts_table(text, {"name": "value"}))
    assert text in printed(report.rows_table("title", [{"views": text}]))


def test_hands_are_listed_with_what_makes_them_usable():
    here = Listing("here", 5, 15, 5, "", None)
    away = Listing("away", 4, 16, None, "hands", "pip install hands")
    lost = Listing("lost", 3, 9, None, "gone", "")
    assert lines(report.hands_table([here, away, lost]))[2:] == [
        ["here", "5", "15 + 5", "its own", "yes"],
        ["away", "4", "16", "hands", "pip install hands"],
        ["lost", "3", "9", "gone", "no"],
    ]


def test_lines_become_a_table_and_the_same_in_markdown():
    rows = [{"object": "mug", "starts": "7"}, {"object": "all", "starts": "7"}]
    assert lines(report.rows_table("A title", rows)) == [["A title"], ["object", "starts"], ["mug", "7"], ["all", "7"]]
    assert report.markdown(rows) == "| object | starts |\n| --- | --- |\n| mug | 7 |\n| all | 7 |\n"


def test_tables_are_built_without_printing(plan, capfd):
    tables(plan)
    assert capfd.readouterr() == ("", "")
    assert isinstance(cli._Console(), Console)


def test_the_legend_has_a_line_for_every_term_and_constraint(plan):
    told = report.legend(plan.problem)
    for part in (*plan.problem.terms, *plan.problem.constraints):
        assert any(line.split()[0] == part.name and part.about in line for line in told), part.name
        assert part.about


def closed(**changes: object) -> list[str]:
    """The words on a closing whose readings are made by hand, and whose plan is off by all that it can be off by."""
    planned = Command(
        *(np.zeros(7), np.zeros(3), np.zeros((2, 3)), np.zeros((2, 3)), np.ones(2)),
        contacts_eq=np.add(TOUCHED.tips, [[0.001, 0.0, 0.0], [0.0, 0.0, 0.0024]]),
        forces_eq=np.array([[1.5, 0.0, 0.0], [0.0, 0.0, 0.25]]),
        rotation_eq=np.eye(3),
        translation_eq=np.add(REST.translation, [0.0, 0.003, 0.004]),
    )
    return trials.closing_lines(judge(Played(**changes), planned))


def test_a_closing_is_told_in_words():
    one = replace(REST, touching=np.array([True, False]), links={"palm": 2.0}, torques=np.array([1.0, 0.4, 1.0]))
    end = replace(TOUCHED, links={"link_3": 1.25}, torques=np.array([0.5, 1.0, 0.0]))
    assert closed(close=[one, one, replace(end, forces=np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]))]) == [
        "Links touched the object while closing: link_3, palm.",
        "At the equilibrium links press by 1.2 N: link_3.",
        "1 of 2 pads carry load. The last pad touched 0.02 s after the first.",
        "Off the planned equilibrium: object 5.0 mm and 0.0°; tips 1.0 to 2.4 mm; forces 0.2 to 1.8 N.",
        "Joint torques reach 100 % of the effort at the equilibrium, 100 % while closing; at the limit are 33 % of the "
        "joints, while closing 100 %.",
    ]


def test_a_clean_closing_says_so_and_a_pad_that_never_touches_is_told():
    first, pads, *_ = closed(close=[replace(REST, touching=np.array([True, False]))])
    assert first == "No link but the pads touched the object while closing."
    assert pads == "0 of 2 pads carry load. A pad never touched."


def test_of_a_hand_that_did_not_close_nothing_is_told():
    assert closed(depth={"object": 0.1}) == []
