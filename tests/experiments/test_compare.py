"""The comparison of solvers: measures by hand, solvers that crash, hang or lie, and studies that go on."""

import math
import os
import signal
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from pandas import DataFrame
from processes import PATIENT
from scenes import SMALL, ellipsoid

from sgnlp.cli import run
from sgnlp.experiments.cli.compare import Compare
from sgnlp.experiments.compare import carried, page
from sgnlp.experiments.compare.figures import data_profile, performance_profile
from sgnlp.experiments.compare.route import Run
from sgnlp.experiments.compare.row import Row, course
from sgnlp.experiments.compare.runs import rows_of
from sgnlp.experiments.compare.table import Table, claims, optima, pairs, shifted_geometric_mean, success
from sgnlp.experiments.compare.verdict import across, advice, formulations_advice, hessians, verdicts
from sgnlp.experiments.frames import frame
from sgnlp.planning import results
from sgnlp.planning.solvers import SOLVERS
from sgnlp.planning.solvers.solver import Answer, Entry, Solver
from sgnlp.show import plots

INF = math.inf
TIMES = {  # no number: not run
    "p": {"a": 1.0, "b": 2.0, "c": INF},
    "q": {"a": 4.0, "b": 2.0, "c": 2.0},
    "r": {"a": INF, "b": 3.0, "c": INF},
    "s": {"a": INF, "b": INF, "c": INF},
    "only a": {"a": 1.0},
}
TIMES = DataFrame(TIMES).T
"""Instances p to s are common to all three."""


def test_the_shifted_geometric_mean_is_that_computed_by_hand():
    assert shifted_geometric_mean([1.0, 4.0], 0.0) == pytest.approx(2.0)
    assert shifted_geometric_mean([0.0, 3.0], 1.0) == pytest.approx(1.0)  # √(1 · 4) - 1
    assert shifted_geometric_mean([2.0] * 5, 7.0) == pytest.approx(2.0)
    assert shifted_geometric_mean([1.0, INF]) == INF
    assert math.isnan(shifted_geometric_mean([]))


def test_performance_profiles_are_those_computed_by_hand():
    found = performance_profile(TIMES, [1.0, 1.9, 2.0, 1e9])
    assert found.to_dict("list") == {"a": [0.25, 0.25, 0.5, 0.5], "b": [0.5, 0.5, 0.75, 0.75], "c": [0.25] * 4}


def test_data_profiles_are_those_computed_by_hand():
    assert data_profile(TIMES[["a", "b"]], [0.5, 2.0, 3.0, 9.0]).to_dict("list") == {
        "a": [0, 0.25, 0.25, 0.5],
        "b": [0, 0.5, 0.75, 0.75],
    }


def test_a_solver_is_faster_where_both_were_run():
    only = replace(GOOD, solver="slsqp", start=7, cpu=0.01)
    rows = [*both(), *both(start=1), *both(solver="slsqp", cpu=0.05), *missed("slsqp", start=1), only]
    first, second = pairs(
        Table([replace(row, tolerance=1e-6) for row in rows if row.tolerance == 1e-6 or row is only]), "penalty"
    )
    assert {first["faster"]: first, second["faster"]: second} == {
        "ipopt": {"faster": "ipopt", "ipopt": "", "slsqp": "50"},
        "slsqp": {"faster": "slsqp", "ipopt": "50", "slsqp": ""},
    }


@pytest.mark.parametrize(("gap", "enough"), [(0.0, True), (1e-3, True), (1.1e-3, False)])
def test_the_decrease_is_measured_from_the_start_to_the_best(gap, enough):
    other = replace(GOOD, solver="slsqp", energy=GOOD.energy + gap * (GOOD.energy_start - GOOD.energy))
    works = Table([GOOD, other]).works("penalty", 38)
    assert works.ipopt.item() == (60 + 51 + 60 + 51 + 50) / 39
    assert math.isfinite(works.slsqp.item()) == enough


# --- tables of rows --------------------------------------------------------------------------------------------------

GOOD = Row("mug", "penalty", "ipopt", 0, 1e-3, 1, True, -30.0, 10.0, math.nan, 1e-9, 0.0, 1e-9, cpu=0.1, seconds=0.2)
GOOD = replace(GOOD, iterations=50, f=60, grad=51, g=60, jac=51, hess=50, status="Solve_Succeeded", feasible=True)
TIGHT = replace(GOOD, tolerance=1e-6, cpu=0.2)


def both(**change) -> list[Row]:
    return [replace(GOOD, **change), replace(TIGHT, **change)]


def missed(solver: str, **change) -> list[Row]:
    loose = replace(GOOD, solver=solver, reached=False, dual=1.0, energy=-20.0, lowest=-25.0, status="", **change)
    return [
        loose,
        Row(loose.object, loose.formulation, solver, loose.start, 1e-6, 0, failure="not tried: a looser tolerance"),
    ]


ROWS = [
    *both(),
    *both(start=1, energy=-31.0),
    *missed("ipopt-limited"),
    *both(solver="ipopt-limited", start=1, cpu=0.8, iterations=100),
    *missed("adamw-1000"),
    *missed("adamw-1000", start=1),
    *both(solver="slsqp", cpu=0.05),
    *missed("slsqp", start=1),
]


def test_the_table_counts_a_failure_as_infinite_and_solvers_come_best_first():
    lines = {line["solver"]: line for line in success(Table(ROWS), "penalty")}
    assert list(lines) == ["ipopt", "slsqp", "ipopt-limited", "adamw-1000"]
    assert lines["ipopt"]["1e-06 [%]"].startswith("100")
    assert lines["ipopt"]["with failures"] == "0.2"
    assert lines["slsqp"]["1e-06 [%]"].startswith("50")
    assert (lines["slsqp"]["time to 0.001 [s]"], lines["slsqp"]["with failures"]) == ("0.05", "∞")


def test_a_cold_repeat_gives_way_to_a_warm_one():
    table = Table([replace(GOOD, repeat=0, cpu=9.0), GOOD])
    assert table.times("penalty", 1e-3).to_dict("index") == {("mug", "penalty", 0): {"ipopt": 0.1}}


def test_the_best_of_a_start_is_the_lowest_energy_where_the_rows_are_met():
    off = replace(GOOD, solver="slsqp", energy=-99.0, primal=0.5, reached=False)
    assert set(Table([*both(), off]).ends.best) == {-30.0}
    line = next(line for line in optima(Table(ROWS), "penalty") if line["solver"] == "adamw-1000")
    assert (line["above it, median"], line["above the object's best, median"]) == ("10.5", "11")


def test_expectations_are_shown_or_refuted_by_the_rows():
    said = "\n".join(verdicts(Table(ROWS)))
    assert "Shown: `ipopt` reaches 1e-06 on 100" in said
    assert "Shown: `ipopt` ends below `adamw-1000` on 2 of the 2 starts where `adamw-1000` meets the rows" in said
    assert "Refuted: Limited-memory Ipopt reaches 1e-06 on 50" in said
    assert "Shown: First-order steps reach 1e-06 on 0" in said
    worse = [replace(row, energy=-10.0) if row.solver == "ipopt" else row for row in ROWS]
    assert "Refuted: `ipopt` ends below `adamw-1000` on 0 of the 2" in "\n".join(verdicts(Table(worse)))
    off = [replace(r, primal=0.5) if (r.solver, r.start) == ("adamw-1000", 0) else r for r in ROWS]
    assert "on 1 of the 1 starts where `adamw-1000` meets the rows" in "\n".join(verdicts(Table(off)))


def test_the_advice_names_the_surest_solver_and_the_fastest_where_it_gets_there():
    first, second = advice(Table(ROWS))
    assert first.startswith("**penalty**: use `ipopt`. It reaches 1e-06 on 100")
    assert "`slsqp`. It reaches 1e-06 on 50" in second


def test_exact_and_limited_hessians_are_compared_on_the_same_starts():
    (line,) = hessians(Table(ROWS))
    assert line["starts"] == "2"
    assert line["time to 1e-06, where both reach it"] == "4"


@pytest.mark.parametrize(
    ("status", "said"),
    [("Solve_Succeeded", True), ("optimal", True), ("Terminated with not optimal point", False), ("stopped", False)],
)
def test_a_solvers_word_of_success_is_understood(status, said):
    assert claims(status) == said


def test_formulations_are_told_apart_by_success_time_and_the_margin_of_the_widest_feasible_solution():
    assert not across(Table(ROWS), "ipopt")
    lifted = [
        *both(formulation="lifted", margin=0.1, cpu=0.3, iterations=30),
        *both(formulation="lifted", start=1, margin=0.4, feasible=False),
        *both(formulation="lifted", object="can", feasible=False),
        *missed("slsqp", formulation="lifted"),
    ]
    penalty = both(margin=0.2) + both(start=1, margin=0.3) + both(object="can", margin=0.5)
    first, second = across(Table(penalty + lifted), "ipopt")
    assert (first["formulation"], first["objects planned"], first["margin, mean"]) == ("penalty", "2 of 2", "0.4")
    assert (second["formulation"], second["objects planned"], second["margin, mean"]) == ("lifted", "1 of 2", "0.1")
    assert (second["starts"], second["iterations"], second["mean time [s]"]) == ("3", "50", "0.233")
    assert second["feasible [%]"].startswith("33")
    often, optimal, quick = formulations_advice(Table(penalty + lifted), "ipopt")
    assert often.startswith("Feasible most often: `penalty`. 100")
    assert optimal.startswith("Reaches 1e-06 most often: `penalty`")
    assert quick.startswith("Fastest: `penalty`")


def test_the_first_choice_is_the_widest_among_the_answers_at_which_a_solver_ended_by_itself():
    late = replace(TIGHT, solver="slsqp", reached=False, failure="over 3 s of processor time")
    tight = [*both(margin=0.2), *both(start=1, margin=0.1)]
    loose = [replace(GOOD, solver="slsqp", margin=0.1), replace(late, margin=0.4)]
    none = missed("adamw-1000", margin=0.5)
    table = Table([*tight, *loose, *[replace(row, feasible=False) for row in none]])
    run_ = Run(Path("mug.npz"), "penalty", "ipopt", 0, "allegro_left", SMALL, 0, (1e-3, 1e-6), 2, 3.0)
    keys = {(row.object, row.formulation, row.solver, str(row.start)): row for row in table.rows.itertuples()}
    runs = {key: replace(run_, solver=row.solver, start=row.start) for key, row in keys.items()}
    found = {case.key[2]: case.work.args for case in carried.cases(table, runs)}
    again, first = found["ipopt"]
    assert (again.start, again.tolerances, first.start, first.margin, first.starts) == (0, (1e-6,), 0, 0.2, 2)
    again, first = found["slsqp"]
    assert (again.tolerances, first.margin) == ((1e-3,), 0.1)
    assert found["adamw-1000"][0] is None
    assert found["adamw-1000"][1].start == -1


def test_solvers_without_a_first_choice_are_named_below_the_table_of_those_with_one():
    first = carried.Row("mug", "penalty", "slsqp", 1, "", 0, 0.1, "held", 0.5)
    best, no = replace(first, solver="ipopt", score=1.0), replace(first, solver="sleqp", start=-1, score=0.0)
    rows = [replace(row, load=load) for row in (first, best, no) for load in carried.LOADS]
    lines = carried.lines(frame(rows))
    assert [line["solver"] for line in lines] == ["ipopt", "slsqp"]
    assert lines[1]["planned"] == "1 of 1"
    assert carried.without(frame(rows)) == {"penalty": ["sleqp"]}
    text = page.page(Table(ROWS), HOW, rows)
    assert "* penalty: no feasible grasp from sleqp." in text


HOW = {
    "command": "sgnlp compare",
    "study": {"time_limit": 3.0, "repeats": 2},
    "versions": {"casadi": "3"},
    "machine": {"processor": "P", "system": "S"},
}


def test_the_page_has_every_section_and_every_figure_draws():
    table = Table([replace(row, trace="0.1:-10:1 0.2:-20:0.1") if row.cpu else row for row in ROWS])
    text = page.page(table, HOW, [])
    for title in ("Which solver should I use?", "What was expected", "Exact against limited", "How it was measured"):
        assert title in text
    for name, panels in page.figures_of(table).items():
        assert f"![{name}]({name}.svg)" in text
        assert plots.draw(panels, page.CAPTIONS[name])["svg"].startswith(b"<?xml")


def test_one_solver_alone_has_no_profiles_and_is_faster_than_none():
    table = Table([replace(row, trace="0.1:-10:1 0.2:-20:0.1") for row in both() + both(formulation="lifted")])
    assert set(page.figures_of(table)) == {"courses"}
    assert pairs(table, "penalty") == []


# --- runs ------------------------------------------------------------------------------------------------------------


def cloud(folder: Path) -> Path:
    np.savez(folder / "egg.npz", points=ellipsoid(), table_height=0.0)
    return folder / "egg.npz"


def setup(folder: Path, solver: str, **change) -> Run:
    settings = replace(SMALL, solver=replace(SMALL.solver, compiled=False))
    given = Run(cloud(folder), "penalty", solver, 0, "allegro_left", settings, 0, (1e-3, 1e-6), 2, 5.0)
    return replace(given, **change)


def pretend(monkeypatch, solve) -> None:
    """Have a solver `fake` whose solve is given."""
    kind = type("Fake", (Solver,), {"solve": lambda self, nlp, x: solve(nlp, x)})
    monkeypatch.setitem(SOLVERS, "fake", Entry(kind(), "none", 1, "pretends"))


def test_a_solver_that_reaches_both_tolerances_has_every_repeat(tmp_path):
    rows = rows_of(setup(tmp_path, "ipopt"))
    assert [(row.tolerance, row.repeat, row.reached) for row in rows] == [
        (t, i, True) for t in (1e-3, 1e-6) for i in range(2)
    ]
    assert all(max(row.dual, row.primal, row.complementarity) <= row.tolerance for row in rows)
    assert all(row.hess == row.iterations > 5 for row in rows)
    assert rows[0].object == "egg"
    assert rows[-1].energy < rows[-1].energy_start
    seconds, _, residuals = course(rows[0].trace)
    assert residuals[-1] < 1e-2 < residuals[0]
    assert sorted(seconds) == seconds


def test_a_lie_about_the_status_is_caught_by_the_residuals(tmp_path, monkeypatch):
    pretend(monkeypatch, lambda nlp, x: Answer(x, "Solve_Succeeded", 1))
    first, second = rows_of(setup(tmp_path, "fake"))
    assert claims(first.status)
    assert not first.reached
    assert first.dual > 1e-2
    assert second.failure == "not tried: a looser tolerance was not reached"


def test_a_crash_is_a_row_with_the_reason(tmp_path, monkeypatch):
    pretend(monkeypatch, lambda nlp, x: os.kill(os.getpid(), signal.SIGKILL))
    rows = rows_of(setup(tmp_path, "fake"))
    assert [row.failure for row in rows] == ["killed by SIGKILL", "not tried: a looser tolerance was not reached"]
    assert not any(row.reached for row in rows)


def test_a_solver_that_goes_on_is_stopped_where_it_is(tmp_path, monkeypatch):
    def forever(nlp, x):
        while True:
            x = x + 1e-6
            nlp.gradient(x)

    monkeypatch.setattr("sgnlp.planning.solvers.process.WALL_FACTOR", PATIENT)
    pretend(monkeypatch, forever)
    row = rows_of(setup(tmp_path, "fake", limit=0.2))[0]
    assert row.failure == "over 0.2 s of processor time"
    assert row.cpu >= 0.2
    assert math.isfinite(row.energy)
    assert row.trace


def test_a_solver_that_burns_without_a_call_is_ended_by_the_kernel(tmp_path, monkeypatch):
    def burn(nlp, x):
        while True:
            pass

    monkeypatch.setattr("sgnlp.planning.solvers.process.WALL_FACTOR", PATIENT)
    pretend(monkeypatch, burn)
    row = rows_of(setup(tmp_path, "fake", limit=0.2))[0]
    assert row.failure.startswith("over 0.3")


def test_a_point_that_is_not_finite_is_not_reached(tmp_path, monkeypatch):
    pretend(monkeypatch, lambda nlp, x: Answer(np.full_like(x, np.nan), "optimal", 1))
    assert not rows_of(setup(tmp_path, "fake"))[0].reached


def test_a_study_goes_on_and_takes_more_starts_and_solvers(tmp_path, monkeypatch, capfd):
    worked: list[tuple[str, int]] = []

    def work(given: Run) -> list[Row]:
        worked.append((given.solver, given.start))
        return [replace(row, object="egg", solver=given.solver, start=given.start) for row in both()]

    def inline(function, items, workers):
        yield from ((item, function(item)) for item in items)

    monkeypatch.setattr("sgnlp.experiments.cli.compare.rows_of", work)
    monkeypatch.setattr("sgnlp.experiments.studies.study.each", inline)
    monkeypatch.setattr(plots, "draw", lambda *given, **named: {"svg": b"", "png": b""})
    common = ["compare", str(cloud(tmp_path)), "--formulations", "penalty", "--out", str(tmp_path / "out")]
    common += ["--solver.no-compiled"]
    with monkeypatch.context() as unreported:
        unreported.setattr(Compare, "_report", lambda *given: None)
        assert run([*common, "--solvers", "ipopt", "--starts", "1"]) == 0
        assert run([*common, "--solvers", "ipopt", "fatrop", "--starts", "2"]) == 0
    assert worked == [("ipopt", 0), ("fatrop", 0), ("ipopt", 1), ("fatrop", 1)]
    assert len(results.read_rows(tmp_path / "out" / "rows.csv", Row)) == 8
    assert run([*common, "--solvers", "all", "--starts", "1"]) == 0
    assert {name for name, _ in worked} == set(SOLVERS)
    assert (tmp_path / "out" / "report.md").read_text(encoding="utf-8").startswith("# Which solver should I use?")
    assert run([*common, "--solvers", "ipopt", "--starts", "1", "--time-limit", "9"]) == 3
    assert "other settings" in capfd.readouterr().err


@pytest.mark.skipif(find_spec("pyarrow") is None, reason="needs the package pyarrow")
def test_the_rows_are_written_as_parquet_too(tmp_path, capfd, monkeypatch):
    from pyarrow import parquet

    monkeypatch.setattr(plots, "draw", lambda *given, **named: {"svg": b"", "png": b""})
    results.write_rows(tmp_path / "rows.csv", ROWS)
    results.write_text(tmp_path / "made.json", results.json_text(HOW))
    assert run(["compare", "--redraw", "--parquet", "--out", str(tmp_path)]) == 0
    assert "written" in capfd.readouterr().out
    columns = parquet.read_table(tmp_path / "rows.parquet").to_pydict()
    assert columns["solver"] == [row.solver for row in ROWS]
    assert columns["iterations"] == [row.iterations for row in ROWS]


def test_bad_flags_are_named(tmp_path, capfd):
    assert run(["compare", str(cloud(tmp_path)), "--solvers", "newton"]) == 3
    assert "unknown solver 'newton'" in capfd.readouterr().err
    assert run(["compare", "--redraw", "--out", str(tmp_path / "none")]) == 3
    assert "no rows" in capfd.readouterr().err
