"""The tables of the README are those of the rows in results/: every number of ours is computed again and compared."""

from pathlib import Path

import pytest

from sgnlp.experiments.benchmarks.measure import Row
from sgnlp.experiments.frames import Frame, frame
from sgnlp.experiments.studies import calibration, comparison, convergence, trials, triangles
from sgnlp.experiments.studies.trials import LOADS
from sgnlp.planning import results

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def table(head: str) -> list[list[str]]:
    """The cells of the table whose first line begins so, below its head."""
    lines = README[README.index(f"\n{head}") + 1 :].split("\n\n")[0].splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def rows(folder: str, kind: type) -> list:
    found = results.read_rows(ROOT / "results" / folder / "rows.csv", kind)
    assert found
    return found


def sentence(words: str) -> bool:
    """Whether the README says so, however its lines break."""
    return words in " ".join(README.split())


def test_success_is_that_of_the_held_out_trials():
    tried = frame(rows("comparison", trials.Row))
    expected = [
        [trials.success(trials.of(tried, condition.name, load, "held_out")) for load in LOADS]
        for condition in comparison.CONDITIONS
    ]
    assert [line[1:3] for line in table("| | 0.1 kg, μ 1 | 0.3 kg, μ 0.6 |")] == expected


SPEED = {  # how a row of the README is called in the benchmark, in which unit it stands there and here
    "one start, one core, 59 iterations": ("a start", "s", 1),
    "its 7 starts, two processes: solving": ("sgnlp.solve, 7 starts, 2 jobs: solving", "s", 1),
    "the same with the fit and the start of the processes": ("sgnlp.solve, 7 starts, 2 jobs", "s", 1),
    "an iteration, all included": ("an iteration", "ms", 1),
    "Hessian of the Lagrangian, the surface known": ("H, same x", "ms", 1),
    "`sgnlp solve`, the whole command, functions compiled": ("sgnlp solve, warm", "s", 1),
    "the same, first time (interpreted, nothing cached)": ("sgnlp solve, cold", "s", 1),
    "peak memory, all processes": ("sgnlp solve, peak memory", "MB", 1),
    "`sgnlp batch`, 1000 objects with 7 starts each": ("sgnlp batch, 1000 objects", "min", 1 / 60),
}


def test_times_are_those_of_the_benchmark():
    measured = {row.name: row.median for row in rows("benchmark", Row)}
    lines = table("| | | target |")
    assert [line[0] for line in lines] == list(SPEED)
    assert measured["iterations of a start"] == 59
    for label, cell, _ in lines:
        name, unit, factor = SPEED[label]
        number, there = cell.split()
        assert there == unit
        decimals = len(number.partition(".")[2])
        assert float(number) == pytest.approx(measured[name] * factor, abs=0.5 * 10**-decimals * 1.001), label


KERNELS = {
    "thin plate, as set": ("thin_plate", "1"),
    "Matérn 3/2, as set": ("matern32", "1"),
    "Matérn 3/2, an eighth of its length": ("matern32", "0.125"),
    "Matérn 5/2, an eighth of its length": ("matern52", "0.125"),
    "squared exponential, 0.18 of its length": ("squared_exponential", "0.18"),
}


def test_factors_on_the_deviation_are_those_of_the_calibration():
    lines = {(e["kernel"], e["length"]): e for e in calibration.factor_table(calibrated()) if e["noise [mm]"] == "5"}
    columns = ("factor", "other half's", "seen: within 50, 90, 95 %", "unseen: within 50, 90, 95 %", "error [mm]")
    for label, *cells in table("| | factor | the rest's own |"):
        expected = [lines[KERNELS[label]][column] for column in columns]
        assert cells == [*expected[:-1], f"{expected[-1]} mm"]


def calibrated() -> Frame:
    return frame(rows("calibration", calibration.Row))


def test_what_is_said_of_the_intervals_as_set_is_so():
    seen = [line for line in calibration.coverage_table(calibrated()) if line["kernel"] == "thin_plate"]
    on, off = ([line for line in seen if (line["side"], line["offset [mm]"]) == ("seen", o)] for o in ("0", "12"))
    assert {line["within 90 %"] for line in on} == {"100"}
    assert sorted(line["within 90 %"] for line in off) == ["96", "98", "98"]
    assert [round(float(line["sigma [mm]"])) for line in on] == [10, 13, 14]
    assert {round(float(line["error [mm]"])) for line in on} == {1, 2}
    (unseen,) = (e for e in seen if (e["side"], e["offset [mm]"], e["cameras"]) == ("unseen", "0", "1"))
    assert unseen["bias [mm]"] == "-13.0"
    assert sentence(
        "those of 90 % hold all points of the seen surface, where σ_d is 10 to 14 mm and the error 1 to 2 mm"
    )
    assert sentence("and 96 to 98 % of those 12 mm outside it")
    assert sentence("what one camera does not see it puts 13 mm too far out")


def test_what_is_said_of_convergence_is_so():
    line = convergence.table(frame(rows("convergence", convergence.Row)))[-1]
    solved, feasible, starts = line["solved"], line["feasible"], line["starts"]
    assert sentence(f"{solved} of {starts} solved, {feasible} feasible with every check recomputed")
    below, met, anywhere = line["below AdamW there"], line["AdamW meets the rows"], line["below AdamW anywhere"]
    assert sentence(f"below AdamW on {below} of the {met} starts where AdamW meets the rows")
    assert sentence(f"on {anywhere} of {starts} below AdamW's lowest energy anywhere")


def test_the_planar_experiment_is_that_of_its_rows():
    kind = triangles.STUDY.row
    lines = next(iter(triangles.tables(frame(rows("triangles", kind))).values()))
    found = {(line["limit on"], line["limit [N m]"]): list(line.values())[3:6] for line in lines}
    keys = [*(("Jᵀf", limit) for limit in ("3", "3.5", "4", "5", "7")), ("J⁻¹f", "12")]
    written = [[a, b, c.replace(" %", "")] for _, a, b, c, _ in table("| | compliant | direct | direct of compliant |")]
    assert written == [found[key] for key in keys]
    assert found["Jᵀf", "12"] == found["Jᵀf", "7"]
