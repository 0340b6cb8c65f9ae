"""The README is short and true, and so is what the pages of results say: numbers are computed again from the rows."""

import csv
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from statistics import mean
from typing import Any

import pytest
from plans import small_plan
from readers import pieces_are_coarse, plans_are_cheap, simulations_are_brief

from sgnlp.experiments.benchmarks import replanning
from sgnlp.experiments.benchmarks.measure import Row
from sgnlp.experiments.frames import Frame, frame, wilson
from sgnlp.experiments.reliability import bins
from sgnlp.experiments.studies import arm, calibration, confidence, convergence, hands, pose, triangles
from sgnlp.experiments.studies.trials import NO_PLAN
from sgnlp.planning import results
from sgnlp.planning.cautions.clouds import UNSEEN_ERROR_MM
from sgnlp.planning.cautions.plans import CALIBRATION
from sgnlp.simulation import Outcome

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
MAX_LINES, MAX_NUMBERS = 120, 30
LIGHT, HEAVY = "0.1 kg, μ 1", "0.3 kg, μ 0.6"
NUMBER = re.compile(r"\d+(?:[.,]\d+)*")
PROSE = re.sub(r"\]\([^)]*\)", "]", re.sub(r"^```.*?^```$", "", README, flags=re.DOTALL | re.MULTILINE))
"""The README without its code and without the targets of links."""


def blocks(language: str) -> list[str]:
    """The README's blocks of code of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)


def table(head: str) -> list[list[str]]:
    """The cells of the table whose first line begins so, below its head."""
    lines = README[README.index(f"\n{head}") + 1 :].split("\n\n")[0].splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def rows(folder: str) -> list[dict[str, str]]:
    with (ROOT / "results" / folder / "rows.csv").open(encoding="utf-8", newline="") as file:
        found = list(csv.DictReader(file))
    assert found
    return found


def records(folder: str, kind: type) -> list:
    return results.read_rows(ROOT / "results" / folder / "rows.csv", kind)


def framed(folder: str, kind: type) -> Frame:
    return frame(records(folder, kind))


def says(page: str, words: str) -> bool:
    """Whether a page of results says so, however its lines break."""
    text = (ROOT / "docs" / "pages" / "results" / f"{page}.md").read_text(encoding="utf-8")
    return words in " ".join(text.replace("\n* ", "\n").split())


def percent(shares: Iterable[float]) -> str:
    return f"{100 * mean(shares):.0f}"


def test_the_readme_is_short():
    assert len(README.splitlines()) <= MAX_LINES
    numbers = NUMBER.findall(PROSE)
    assert len(numbers) <= MAX_NUMBERS, numbers


def test_the_two_commands_are_those_that_ci_runs():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    commands = "".join(blocks("bash")).splitlines()
    for words in re.findall(r'block "([^"]+)"', script):
        assert len([line for line in commands if words in line]) == 1, words


def test_the_program_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    """A term and a constraint of one's own, solved, saved and simulated, then the result read again."""
    (tmp_path / "problems").symlink_to(ROOT / "problems")
    monkeypatch.chdir(tmp_path)
    plans_are_cheap(monkeypatch)
    pieces_are_coarse(monkeypatch)
    simulations_are_brief(monkeypatch)
    found: dict[str, Any] = {}
    exec("\n".join(blocks("python")), found)
    assert capsys.readouterr().out
    assert found["plan"].best is not None
    assert isinstance(found["outcome"], Outcome)


def test_the_lines_that_read_a_result_run(tmp_path, monkeypatch, capsys):
    plan = small_plan()
    results.save(plan.arrays(), plan.summary(), tmp_path / "results" / "mug")
    monkeypatch.chdir(tmp_path)
    lines = blocks("python")[1]
    assert len(lines.splitlines()) <= 10
    exec("import sgnlp\n" + lines)
    printed = capsys.readouterr().out
    assert all(name in printed for name in ("index", "thumb", *plan.problem.hand.joint_names))


CONDITIONS = {
    "two views": ("robust", "2 views"),
    "one view": ("robust", "1 view"),
    "two views, an earlier version, the pregrasp alone": ("comparison", "2 views"),
    "two views, the same with force closure instead of springs": ("comparison", "bilevel high, 2 views"),
}


def test_success_is_that_of_the_held_out_trials():
    tried = {name: [row for row in rows(name) if row["half"] == "held_out"] for name in ("robust", "comparison")}
    objects = [{row["object"] for row in found} for found in tried.values()]
    assert objects[0] == objects[1]
    assert f"on the {len(objects[0])} problems" in " ".join(README.split())
    lines = table("| the plan saw |")
    assert [line[0] for line in lines] == list(CONDITIONS)
    for label, *cells in lines:
        for cell, load in zip(cells, (LIGHT, HEAVY), strict=True):
            folder, condition = CONDITIONS[label]
            chosen = [row for row in tried[folder] if (row["condition"], row["load"]) == (condition, load)]
            assert cell == percent(float(row["score"]) for row in chosen), (label, load)


SPEED = {  # how a row of the README is called in the benchmark, and how much of its unit is one of the README's
    "seven starts, the fit included": ("sgnlp.solve, 7 starts, 2 jobs", 1),
    "`sgnlp solve`, the whole command": ("sgnlp solve, warm", 1),
    "the same, the first time": ("sgnlp solve, cold", 1),
    "`sgnlp.replan`, an object that moves": (replanning.STEP, 1000),
    "`sgnlp batch`, a hundred objects": ("sgnlp batch, 100 objects", 60),
}


def test_times_are_those_of_the_benchmark():
    measured = {row.name: row.median for row in records("benchmark", Row)}
    lines = table("| what | median time |")
    assert [line[0] for line in lines] == list(SPEED)
    for label, cell in lines:
        name, seconds = SPEED[label]
        number, unit = cell.split()
        assert unit == {1: "s", 1000: "s", 60: "min"}[seconds]
        decimals = len(number.partition(".")[2])
        assert float(number) == pytest.approx(measured[name] / seconds, abs=0.5 * 10**-decimals * 1.001), label


def ends(formulation: str) -> list[dict[str, str]]:
    """Where each start ended in a formulation: the run to the tightest tolerance that gave an answer."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for row in sorted(rows("formulations"), key=lambda row: -float(row["tolerance"])):
        key = row["object"], row["start"]
        if row["formulation"] == formulation and (row["energy"] != "nan" or key not in found):
            found[key] = row
    return list(found.values())


def test_what_is_said_of_starts_is_so():
    phased, lifted = ends("two_phase"), ends("lifted")
    short = [row for row in phased if row["reached"] == "False" or row["tolerance"] != "1e-06"]
    infeasible = [row for row in phased if row["feasible"] == "False"]
    assert round(len(phased) / len(short)) == 20
    counted = rows("feasible")
    starts, feasible = (sum(int(row[column]) for row in counted) for column in ("starts", "feasible_starts"))
    assert says("formulations", f"{feasible} of the {starts} starts of")
    assert round(starts / (starts - feasible), -1) == 20
    later = [row for row in rows("rounds") if int(row["starts"]) > 7]
    assert (len(rows("rounds")), len(later)) == (49, 3)
    assert [-(-int(row["starts"]) // 7) for row in later if row["feasible"] == "True"] == [5]
    planned = rows("robust")
    starts, feasible = (sum(int(row[column]) for row in planned) for column in ("starts", "feasible"))
    assert round(starts / (starts - feasible)) == 6
    assert "One start in six is not feasible." in README
    steep = [row for row in short if row["object"].startswith("pyramid")]
    poses = {row["object"] for row in steep}
    assert len(poses) == 2
    assert len(steep) == sum(row["object"] in poses for row in phased)
    assert says("formulations", f"Of the {len(short)} starts that it does not solve, {len(steep)} are all those on two")
    lost = sum(row["feasible"] == "False" for row in lifted) - len(infeasible)
    assert round(len(lifted) / lost, -1) == 50
    assert says("formulations", "It loses one start in fifty against `two_phase`")


def test_what_is_said_of_links_is_so():
    chosen = [row for row in rows("comparison") if (row["condition"], row["load"]) == ("3 views", LIGHT)]
    early = sum(row["premature"] == "True" for row in chosen)
    assert says("grasping", f"in {early} of the {len(chosen)} from three views under the light load")
    assert early > 0.5 * len(chosen)
    planned = [row for row in rows("robust") if row["condition"] == "2 views"]
    early = sum(row["premature"] == "True" for row in planned)
    assert says("grasping", f"before the last pad in {early} of {len(planned)} trials from two views")
    assert round(len(planned) / early) == 24
    assert "In one of twenty-four trials from two views a link touches the object before the last fingertip" in README
    closed = [row for row in planned if row["shift_error_mm"] != "nan"]
    near = sum(float(row["shift_error_mm"]) <= 5 and float(row["turn_error_deg"]) <= 5 for row in closed)
    assert round(10 * near / len(closed)) == 9
    assert says("grasping", "within 5 mm and 5° of its planned place in nine of ten trials from two views")
    assert says("grasping", "in nine of ten")
    alone = [row for row in rows("comparison") if (row["half"], row["condition"]) == ("held_out", "2 views")]
    assert round(10 * sum(row["premature"] == "True" for row in alone) / len(alone)) == 9


def test_what_fails_is_what_the_readme_says():
    tried = rows("comparison")
    plain = [row for row in tried if row["condition"] in ("3 views", "2 views", "1 view")]
    assert not [row for row in plain if row["ending"] == "in collision"]
    lost = Counter(row["object"].rpartition("_")[0] for row in plain if float(row["score"]) < 1)
    assert {name for name, count in lost.items() if count > 2} == {"plane", "pyramid", "banana", "mug"}
    lost = Counter(row["object"].rpartition("_")[0] for row in rows("robust") if float(row["score"]) < 1)
    assert lost.most_common(1)[0][0] == "pyramid"


def test_what_is_said_of_the_moving_object_is_so():
    with_term, without = pose.means(framed("pose", pose.STUDY.row))
    count = with_term["objects"].split()[0]
    assert says("grasping", f"On {count} problems it was planned to rise by {with_term['planned rise [mm]']} mm")
    assert says("grasping", f"and rose by {with_term['simulated rise [mm]']} mm")
    assert says("grasping", f"Without the term it rose by {without['simulated rise [mm]']} mm")


def test_no_change_of_a_weight_loses_the_light_load():
    tried = rows("weights")
    assert {float(row["score"]) for row in tried if row["load"] == LIGHT} == {1.0}
    assert says("defaults", f"{len({row['object'] for row in tried})} problems, every change holds the light load")


def test_what_is_said_of_first_order_steps_is_so():
    report = (ROOT / "results" / "solvers-starts" / "report.md").read_text(encoding="utf-8")
    below = re.findall(r"ends below `(\w+)-1000` on (\d+) of the (\d+) starts.*?rows met or not, on (\d+) \(", report)
    found = {name: counts for name, *counts in below}
    assert found["adamw"][0] == found["adamw"][1]
    assert found["rmsprop"][0] == found["rmsprop"][1]
    assert says("solvers", f"on all {found['adamw'][0]} starts where AdamW meets the rows")
    assert says("solvers", f"on all {found['rmsprop'][0]} where RMSProp does")
    assert says("solvers", f"rows met or not, on {found['adamw'][2]} % of the starts")


def test_what_is_said_of_solvers_is_so():
    tried = [row for row in rows("solvers") if float(row["tolerance"]) == 1e-6]
    kinds = {row["formulation"] for row in tried}
    everywhere = set.intersection(
        *({row["solver"] for row in tried if row["formulation"] == kind} for kind in kinds),
        {row["solver"] for row in tried} - {row["solver"] for row in tried if row["reached"] == "False"},
    )
    assert everywhere == {"ipopt", "ipopt-spral"}
    names = {row["solver"] for row in tried}
    absent = {row["solver"] for row in rows("solvers") if re.search("has no plugin|libcasadi_linsol", row["failure"])}
    assert says("solvers", f"All {len(names)} known solvers were asked, {len(names - absent)} of which run here")


def test_what_is_said_of_an_iteration_is_so():
    measured = {row.name: row.median for row in records("benchmark", Row)}
    calls, rest = measured["an iteration: f, ∇f, g, J, H"], measured["an iteration: the rest"]
    assert says("speed", f"{calls:.2f} ms are calls of the functions, and {rest:.2f} ms are Ipopt")
    mumps = measured["MUMPS over exact Hessian"]
    assert says("speed", f"our condensed factors a start takes {mumps:.1f} times as long in the median")
    memory = measured["sgnlp batch, 100 objects: memory, late"]
    assert says("speed", f"All 100 objects got a feasible grasp, and memory stayed flat at {memory:.0f} MB")


def test_what_is_said_of_the_surface_is_so():
    measured = framed("calibration", calibration.Row)
    held_out = calibration.coverage_table(measured[measured.half == "held out"])
    tuning = calibration.coverage_table(measured[measured.half == "tuning"])

    def told(lines: list[dict[str, str]], surface: str, cameras: int, side: str) -> dict[str, str]:
        (line,) = (e for e in lines if (e["surface"], e["cameras"], e["side"]) == (surface, str(cameras), side))
        return line

    errors = {
        (surface, cameras, side): told(held_out, surface, cameras, side)["error [mm]"]
        for surface in ("cloud alone", calibration.AS_SET)
        for cameras in (1, 2)
        for side in calibration.SIDES
    }
    two, one = ([errors[surface, n, "unseen"] for surface in (calibration.AS_SET, "cloud alone")] for n in (2, 1))
    seen = [errors[surface, 2, "seen"] for surface in (calibration.AS_SET, "cloud alone")]
    assert says(
        "surface", f"{two[0]} mm off instead of {two[1]} mm, the seen side {seen[0]} mm instead of {seen[1]} mm"
    )
    assert says("surface", f"From one view the guessed side is {one[0]} mm off instead of {one[1]} mm")
    ours, theirs = (told(tuning, name, 1, "unseen")["error [mm]"] for name in (calibration.AS_SET, "cloud alone"))
    assert says("surface", f"On the tuning half it is {ours} mm instead of {theirs} mm")
    plain = [told(held_out, "free space without symmetry", n, "unseen")["error [mm]"] for n in (1, 2)]
    assert says("surface", f"the guessed side is {plain[0]} mm off from one view and {plain[1]} mm from two")
    lines = {(n, side): told(held_out, calibration.AS_SET, n, side) for n in (1, 2) for side in calibration.SIDES}
    seen90, guessed90 = (sorted(lines[n, side]["within 90 %"] for n in (1, 2)) for side in calibration.SIDES)
    assert says(
        "surface", f"hold {seen90[0]} % to {seen90[1]} % on the seen side and {guessed90[0]} % on the guessed one"
    )
    assert guessed90[0] == guessed90[1]
    for line in lines.values():
        assert 40 <= int(line["within 50 %"]) <= 60
        assert 85 <= int(line["within 90 %"]) <= 96
        assert 90 <= int(line["within 95 %"]) <= 99
    factors = {line["surface"]: line["factor"] for line in calibration.factor_table(measured)}
    assert float(factors["cloud alone"]) == CALIBRATION["thin_plate"]
    assert says("surface", f"is a factor of {float(factors[calibration.AS_SET]):.1f}")
    assert float(lines[1, "unseen"]["error [mm]"]) == UNSEEN_ERROR_MM


def test_what_is_said_of_the_confidence_is_so():
    measured = framed("confidence", confidence.Row)
    held_out, told = confidence.judged(measured)
    assert says("confidence", f"{len(held_out)} grasps of {held_out.object.nunique()} problems")
    found = list(bins(told, held_out.held.to_numpy(bool), confidence.BINS))
    off = [100 * (b.mean - b.held / b.number) for b in found]
    assert [f"{b.low:.2f} to {b.high:.2f}" for b, far in zip(found, off, strict=True) if far < -4] == ["0.82 to 0.91"]
    assert round(min(off)) == -8
    assert sorted(map(abs, off))[-2] < 3
    assert all(wilson(b.held, b.number)[0] < b.mean < wilson(b.held, b.number)[1] for b in found)
    assert says("confidence", "between 0.82 and 0.91 the confidence is eight points too low")
    tuning = confidence.of_half(measured, "tuning")
    assert (len(tuning), round(100 * tuning.held.mean())) == (274, 89)


def test_the_table_of_convergence_ends_with_the_sum():
    line = convergence.table(framed("convergence", convergence.Row))[-1]
    written = (ROOT / "results" / "convergence" / "table.md").read_text(encoding="utf-8")
    assert "| " + " | ".join(line.values()) + " |" in written


def test_the_planar_limit_of_the_release_never_binds():
    found = next(iter(triangles.tables(framed("triangles", triangles.STUDY.row)).values()))
    (line,) = (line for line in found if (line["limit on"], line["limit [N m]"]) == ("Jᵀf", "12"))
    assert line["compliant"] == line["direct"] == line["poses"]
    assert says("triangles", "the same limit never binds")


def test_the_page_on_hands_says_what_its_rows_do():
    found = framed("hands", hands.Row)
    held = found[found.ending == "held"]
    assert dict(held[held.widened].condition.value_counts()) == {"svh_right": 7, "dex3_right": 1}
    assert (held.condition == "svh_right").sum() == 12
    assert says("hands", "Seven of the SVH's twelve grasps that held, and one of the Dex3's, came from the wide limits")
    inspire = found[found.condition == "inspire_right-light"]
    assert (len(inspire), (inspire.ending != NO_PLAN).sum(), (inspire.ending == "held").sum()) == (13, 12, 11)
    assert (found[found.condition == "inspire_right"].ending == NO_PLAN).all()
    assert says("hands", "it has one for twelve of 13 objects, and eleven hold")


def test_the_page_on_an_arm_says_what_its_rows_do():
    found = framed("arm", arm.Row)
    heavy = found[found.load == "0.3 kg, μ 0.6"]
    held = heavy.pivot(index="object", columns="condition", values="score")
    planned = held.drop(index=heavy[heavy.ending == NO_PLAN].object.unique())
    assert dict((planned < 1).sum()) == {"free wrist": 2, "free wrist, obstacle": 4, "panda": 1, "panda, obstacle": 1}
    assert says(
        "arm", "two objects fail on the free wrist, one with the arm, one with both, and four with the box alone"
    )
    assert says("arm", f"{len(held)} held-out problems")
    assert 8.0 < found.obstacle_mm.min() < 10.0
    assert says("arm", "No grasp that was called feasible comes nearer than 8 mm")
    assert not (found.obstacles_touched > 0).any()
    assert found.condition.str.contains("obstacle").sum() == 196
    assert says("arm", "None of the 196 motions beside a box touches it")
    seconds = found.pivot_table(index="object", columns="condition", values="seconds")
    assert round((seconds["panda, obstacle"] / seconds["free wrist"]).median(), 1) == 2.2
    assert says("arm", "A plan takes 2.2 times as long with both")
