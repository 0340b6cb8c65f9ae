"""The report of a result: its numbers, its cautions, its pages, and the command that makes it again."""

import json
import re
import shlex
import shutil
from dataclasses import asdict, replace
from fnmatch import fnmatch
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
import tyro
from browser import FLAT, loaded, needs_a_browser
from scenes import ellipsoid

pytest.importorskip("skimage")
pytest.importorskip("matplotlib")

from sgnlp.base.errors import InputError
from sgnlp.base.presets import PRESETS, ROBUST, preset
from sgnlp.cli import again, report, run
from sgnlp.cli.flags import beginning
from sgnlp.cli.simulate import PICTURE, SIMULATION
from sgnlp.cli.solve import Solve
from sgnlp.perception.observation import ObservationSettings, Reading
from sgnlp.planning import reopen, results
from sgnlp.planning.cautions.plans import alike
from sgnlp.show import sheets
from sgnlp.show.report.content import best, distinct
from sgnlp.show.report.figures import convergence
from sgnlp.show.simulation_pictures import PHASES

SMALL = ("--gpis.surface-points", "60", "--gpis.interior-points", "15", "--contact.mass", "0", "--contact.samples", "4")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A small plan of an ellipsoid from two starts, with its report."""
    place = tmp_path_factory.mktemp("report")
    view = (ellipsoid()[:, 0] > 0).astype(int)
    cameras = np.array([[-0.5, 0.0, 0.4], [0.5, 0.0, 0.4]])
    np.savez(place / "egg.npz", points=ellipsoid(), view=view, camera_positions=cameras, table_height=0.0)
    words = ["solve", str(place / "egg.npz"), "--out", str(place / "egg"), "--starts", "2", "--quiet", "--report"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("matplotlib.figure.Figure.set_layout_engine", lambda *_, **__: None)  # takes half of the time
        patch.setattr("matplotlib.axes.Axes._update_title_position", lambda *_: None)
        assert run([*words, *SMALL]) == 0
    return place / "egg"


@pytest.fixture(scope="module")
def result(folder) -> reopen.Reopened:
    return reopen.reopen(folder)


def tables(text: str) -> dict[str, list[list[str]]]:
    """The rows of the tables of a Markdown text, by the heading above each."""
    found: dict[str, list[list[str]]] = {}
    for block in text.split("\n\n"):
        if block.startswith("#"):
            heading = block.lstrip("# ")
        elif block.startswith("|"):
            rows = [[cell.strip() for cell in line[1:-1].split(" | ")] for line in block.splitlines()]
            found[heading] = [rows[0], *rows[2:]]
    return found


# What it says ---------------------------------------------------------------------------------------------------------


def test_the_numbers_are_those_of_the_summary(folder):
    summary, shown = (
        json.loads((folder / "summary.json").read_text(encoding="utf-8")),
        tables((folder / "report.md").read_text(encoding="utf-8")),
    )
    heads, *rows = shown["Starts, best first"]
    for row, start in zip(rows, summary["starts_table"], strict=True):
        told = dict(zip(heads, row, strict=True))
        assert int(told["start"]) == start["start"]
        assert (told["feasible"] == "yes") is start["feasible"]
        assert float(told["energy"]) == pytest.approx(start["energy"], abs=0.05)
        assert float(told["margin"]) == pytest.approx(start["worst_margin"], abs=5e-4)
        assert float(told["KKT"]) == pytest.approx(
            max(v for v in start["kkt"].values() if v != start["kkt"]["where"]), rel=0.5
        )
        assert int(told["iterations"]) == start["iterations"]
    *terms, total = shown["Energy, exact"][1:]
    assert [row[0] for row in terms] == list(summary["best"]["energy_terms"])
    for row, term in zip(terms, summary["best"]["energy_terms"].values(), strict=True):
        assert float(row[3]) == pytest.approx(term["share"], abs=5e-3)
    assert float(total[3]) == pytest.approx(summary["best"]["energy"], abs=5e-3)
    for row in shown["Margins and checks"][1:]:
        value = summary["best"]["checks"][row[0]]["value"]
        assert float(row[2]) == pytest.approx(value if abs(value) >= sheets.NOTHING else 0.0, rel=5e-3)


def test_the_confidence_of_the_best_grasp_is_told_or_that_it_is_unknown(folder, result):
    told = result.grasps.confidence[0]
    assert f"Confidence {told:.2f}: of 100 such grasps, about" in (folder / "report.md").read_text(encoding="utf-8")
    grasps = replace(result.grasps, confidence=np.full(len(result.grasps), np.nan))
    unknown = reopen.Reopened(grasps, result.hand, result.cloud, result.problem)
    assert best(unknown).sentences[0].startswith("Confidence unknown: only a feasible grasp")


def test_the_pictures_of_the_text_are_beside_it_and_different_grasps(folder, result):
    text = (folder / "report.md").read_text(encoding="utf-8")
    named = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert all((folder / name).read_bytes().startswith(b"\x89PNG") for name in named)
    ranks = [int(rank) for rank in re.findall(r"grasp-(\d+).png", text)]
    assert ranks == list(dict.fromkeys(alike(result.grasps.contacts)))[:3]
    for name in ("approach", "convergence"):
        assert (folder / "report" / f"{name}.svg").read_bytes().startswith(b"<?xml")


def test_the_history_has_the_iterations_of_every_start(folder, result):
    with np.load(folder / results.HISTORY) as history:
        for start, iterations in zip(result.grasps.start, result.grasps.iterations, strict=True):
            own = history["start"] == start
            phases = len(set(history["formulation"][own].tolist()))
            assert phases == 2
            assert own.sum() == iterations + phases  # with the point that each begins at
        last = history["primal"][history["start"] == result.grasps.start[0]][-1]
        assert last < 1e-4
        panels = convergence(dict(history))
    assert [len(panel.series) for panel in panels] == [2] * 4
    assert [panel.log for panel in panels] == [False, True] * 2


def test_a_simulation_is_told_with_the_pictures_that_were_drawn_of_it(folder, result):
    closing = {"shift_before_contact": 0.0021, "shift_error": None}
    lift = {"rise": 0.0495, "slip": [0.001, 0.0042]}
    grasp = {"rank": 0, "ending": "held", "score": 1.0, "score_strict": 1.0, "closing": closing, "lift": lift}
    grasp["pushes"] = [{"held": True}] * 5 + [{"held": False}]
    told = {
        "object": "egg.npz",
        "settings": {"mass": 0.1, "friction": 1.0},
        "grasps": [grasp],
        "plan": result.grasps.digest,
    }
    file = folder / "simulation.json"
    file.write_text(json.dumps(told), encoding="utf-8")
    section = report._simulated(folder, result.grasps)
    assert section.sheets[0].rows[1] == ("0", "held", "1", "1", "49.5", "4.2", "5/6", "2.1", "")
    assert "on the true object of egg.npz, 0.1 kg" in section.sentences[0]
    file.write_text(json.dumps(told | {"estimated": True}), encoding="utf-8")
    assert "on the estimated surface of egg.npz, 0.1 kg" in report._simulated(folder, result.grasps).sentences[0]
    picture = folder / "simulation-lift.png"
    picture.write_bytes(b"drawn")
    assert not report._simulated(folder, result.grasps).figures
    drawn = {"simulation-lift.png": sha256(b"drawn").hexdigest()}
    file.write_text(json.dumps(told | {"pictures": drawn}), encoding="utf-8")
    assert len(report._simulated(folder, result.grasps).figures) == 1
    file.write_text("[]", encoding="utf-8")
    with pytest.raises(InputError, match=r"simulation\.json' belongs to another plan"):
        report._simulated(folder, result.grasps)
    file.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match=r"no outcome of sgnlp simulate; delete it, or simulate again"):
        report._simulated(folder, result.grasps)
    picture.unlink()
    file.unlink()
    assert report._simulated(folder, result.grasps) is None


def test_wrist_and_joints_of_every_shown_grasp_are_those_of_the_result(folder, result):
    g, shown = result.grasps, tables((folder / "report.md").read_text(encoding="utf-8"))
    page = (folder / "report.html").read_text(encoding="utf-8")
    for rank in distinct(result):
        wrist, joints = (
            f"Wrist of grasp {rank}: link {result.hand.root} in the world frame",
            f"Joints of grasp {rank}",
        )
        assert wrist in page
        assert joints in page
        position, quaternion = shown[wrist][1:3]
        np.testing.assert_allclose([float(v) for v in position[1:4]], g.wrist[rank, :3], atol=5e-5)
        np.testing.assert_allclose([float(v) for v in quaternion[1:]], g.wrist[rank, 3:], atol=5e-6)
        assert [row[0] for row in shown[joints][1:]] == g.joint_names.tolist()
        np.testing.assert_allclose([float(row[1]) for row in shown[joints][1:]], g.joints[rank], atol=5e-5)


def test_the_page_fits_a_phone(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert '<meta name="viewport" content="width=device-width, initial-scale=1">' in page[:500]
    assert page.count("<table>") == page.count('<div class="sheet"><table>') > 0  # they scroll in their boxes
    assert page.count("<figure>") == page.count('<figure><div class="cells">') > 0
    assert page.count('alt="grasp-0"') == 4  # three views and the legend, below each other where it is narrow


# The pages ------------------------------------------------------------------------------------------------------------


def test_the_page_holds_everything_and_runs_nothing(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert not re.search(r'(?:src|href)="(?!data:)', page)
    assert page.count("<figure>") == len(re.findall(r"!\[", (folder / "report.md").read_text(encoding="utf-8")))


@needs_a_browser
def test_the_page_loads_without_an_error_or_a_request(folder, tmp_path):
    log = tmp_path / "net.json"
    elements, told = loaded((folder / "report.html").as_uri(), tmp_path, *FLAT, f"--log-net-log={log}")
    assert "</html>" in elements
    assert not told
    assert not re.search(r'"url":"https?://(?!(?:[\w.-]+\.)?google|[\w.-]*gvt)[^"]*', log.read_text(encoding="utf-8"))


def test_without_its_cloud_a_report_says_so_and_leaves_out_what_needs_it(folder, tmp_path):
    copy = tmp_path / "egg"
    shutil.copytree(folder, copy)
    meta = reopen.load_grasps(copy).meta | {"source": "gone.npz"}
    results.save(
        replace(reopen.load_grasps(copy), meta=meta),
        json.loads((copy / "summary.json").read_text(encoding="utf-8")),
        copy,
    )
    report.write(copy)
    text = (copy / "report.md").read_text(encoding="utf-8")
    assert re.search(r"cautions that need the cloud are left out: '\S*gone.npz' is not there", text)
    assert "Where the fingers meet" not in text
    assert "## Convergence" not in text  # the history went with the older result


def test_a_missing_summary_is_refused(folder, tmp_path, capfd):
    shutil.copy(folder / "grasps.npz", tmp_path)
    assert run(["report", str(tmp_path)]) == 3
    assert "summary.json' is missing" in capfd.readouterr().err


@pytest.mark.parametrize("damage", ["", "PK", "array", "length"])
def test_a_damaged_history_is_refused_in_one_line(folder, tmp_path, capfd, damage):
    copy = shutil.copytree(folder, tmp_path / "egg")
    if damage in ("", "PK"):
        (copy / "history.npz").write_text(damage, encoding="utf-8")
    else:
        with np.load(folder / "history.npz") as data:
            arrays = dict(data)
        np.savez(copy / "history.npz", **arrays | {"energy": arrays.pop("energy")[:-1]} if damage == "length" else {})
    assert run(["report", str(copy)]) == 3
    said = capfd.readouterr().err
    assert "history.npz' " in said
    assert said.endswith("; delete it, or solve again\n")
    assert said.count("\n") == 1


def test_a_new_result_takes_away_what_report_and_simulate_write():
    written = [report.HTML, report.MARKDOWN, SIMULATION, *map(PICTURE.format, PHASES)]
    assert [name for name in written if not any(fnmatch(name, pattern) for pattern in results.AFTER)] == []


@pytest.mark.parametrize("name", ["history.npz", "summary.json", "simulation.json"])
def test_a_file_of_another_plan_is_refused_and_told_what_to_do(folder, tmp_path, capfd, name):
    copy, other = (shutil.copytree(folder, tmp_path / name) for name in ("egg", "other"))
    grasps, summary = reopen.load_grasps(other), json.loads((other / "summary.json").read_text(encoding="utf-8"))
    found = replace(grasps, meta=grasps.meta | {"seed": 1})
    with np.load(other / "history.npz") as data:
        histories = dict(data)
    results.save(found, summary | {"plan": found.digest}, other, histories)
    results.write_text(other / "simulation.json", json.dumps({"plan": found.digest}))
    shutil.copy(other / name, copy / name)
    assert run(["report", str(copy)]) == 3
    said = capfd.readouterr().err
    assert f"{name}' belongs to another plan than the grasps.npz beside it" in said
    assert said.endswith("delete it, or make it again\n")


@pytest.mark.parametrize("words", [["report"], ["view", "--html", "page.html"]])
def test_a_result_that_does_not_fit_its_hand_is_not_shown(folder, tmp_path, capfd, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    grasps = reopen.load_grasps(folder)
    results.save(replace(grasps, joint_names=grasps.joint_names[::-1]), {}, tmp_path / "egg")
    assert run([words[0], "egg", *words[1:]]) == 3
    assert "'egg/grasps.npz': joint_names must be those of the hand" in capfd.readouterr().err
    assert not Path("page.html").exists()


# The command ----------------------------------------------------------------------------------------------------------


def parsed(words: str) -> Solve:
    """The command as `sgnlp` reads it."""
    name, command, *rest = shlex.split(words)
    assert (name, command) == ("sgnlp", "solve")
    chosen = rest[rest.index("--preset") + 1] if "--preset" in rest else "robust"
    return tyro.cli(Solve, args=rest, default=beginning(Solve, chosen))


ODD = replace(
    PRESETS["paper"],
    contact=replace(ROBUST.contact, displacement=(0.0, -0.01, 0.02), pad=False, density="density"),
    solver=replace(ROBUST.solver, compiled=False, tolerance=1e-7),
    gpis=replace(ROBUST.gpis, interior_value=-0.25, kernel="matern52"),
)


@pytest.mark.parametrize("settings", [*PRESETS.values(), preset("paper+bilevel-low"), ODD])
def test_the_command_parses_back_to_the_same_settings(settings):
    cleaning = asdict(replace(ObservationSettings(), min_points=50))
    reading = {"views": ["435", "455"], "scale": 0.001, "table_height": 0.013, "cleaning": cleaning}
    meta = {"settings": asdict(settings), "source": "a b.npz", "object": "egg", "hand": "allegro_right", "seed": 3}
    meta |= {"starts": 9, "timeout": 5.0, "first": 2, "deadline": 1.5, "reading": reading}
    found = parsed(again.command(meta, Path("results/egg")))
    assert found.settings == settings
    assert found.file == Path("a b.npz")
    assert (found.hand, found.starts, found.seed, found.timeout, found.out) == ("allegro_right", 9, 3, 5.0, None)
    assert (found.first, found.deadline) == (2, 1.5)
    cleaning = replace(ObservationSettings(), min_points=50)
    assert found.reading == Reading(("435", "455"), 0.001, 0.013, cleaning=cleaning)


def test_the_command_has_the_file_of_the_users_own_parts():
    meta = {"settings": asdict(ROBUST), "source": "egg.npz", "object": "egg", "hand": "allegro_left"}
    meta |= {"extension": {"file": "/my/own terms.py", "sha256": "0"}}
    assert again.command(meta, Path("results/egg")) == "sgnlp solve egg.npz --with '/my/own terms.py'"
    assert parsed(again.command(meta, Path("results/egg"))).with_ == Path("/my/own terms.py")


def test_the_command_of_defaults_is_short(folder):
    meta = {"settings": asdict(ROBUST), "source": "egg.npz", "object": "egg", "hand": "allegro_left", "seed": 0}
    meta |= {"starts": 7, "timeout": 60.0}
    assert again.command(meta, Path("results/egg")) == "sgnlp solve egg.npz"
    assert again.command(meta | {"settings": asdict(PRESETS["lift"])}, Path("x")) == (
        "sgnlp solve egg.npz --preset lift --out x"
    )
    assert f"sgnlp solve {folder.parent}/egg.npz --starts 2" in (folder / "report.md").read_text(encoding="utf-8")
