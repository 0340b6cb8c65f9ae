"""The report of a result: its numbers, its cautions, its pages, and the command that makes it again."""

import json
import os
import re
import shlex
import shutil
import subprocess
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import tyro
from scenes import ellipsoid

pytest.importorskip("skimage")
pytest.importorskip("matplotlib")

from sgnlp import observe, refit, results
from sgnlp.cli import again, report, run
from sgnlp.cli.flags import beginning
from sgnlp.cli.solve import Solve
from sgnlp.dossier.figures import convergence
from sgnlp.observation import ObservationSettings
from sgnlp.presets import PRESETS, ROBUST, preset

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
FLAGS = "--headless=new --no-sandbox --disable-gpu --enable-logging=stderr --v=0"
SMALL = ("--gpis.surface-points", "60", "--gpis.interior-points", "15", "--contact.mass", "0")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A small plan of an ellipsoid from two starts, with its report."""
    place = tmp_path_factory.mktemp("dossier")
    view = (ellipsoid()[:, 0] > 0).astype(int)
    cameras = np.array([[-0.5, 0.0, 0.4], [0.5, 0.0, 0.4]])
    np.savez(place / "egg.npz", points=ellipsoid(), view=view, camera_positions=cameras, table_height=0.0)
    words = ["solve", str(place / "egg.npz"), "--out", str(place / "egg"), "--starts", "2", "--quiet", "--report"]
    assert run([*words, *SMALL]) == 0
    return place / "egg"


@pytest.fixture(scope="module")
def result(folder) -> refit.Reopened:
    return refit.reopen(folder)


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
    *terms, total = shown["Energy, term by term"][1:]
    assert [row[0] for row in terms] == list(summary["best"]["energy_terms"])
    for row, term in zip(terms, summary["best"]["energy_terms"].values(), strict=True):
        assert float(row[3]) == pytest.approx(term["share"], abs=5e-3)
    assert float(total[3]) == pytest.approx(summary["best"]["energy"], abs=5e-3)
    for row in shown["Margins and checks"][1:]:
        assert float(row[1].split()[0]) == pytest.approx(summary["best"]["checks"][row[0]]["value"], rel=5e-3)


def test_the_pictures_of_the_text_are_beside_it_and_different_grasps(folder, result):
    text = (folder / "report.md").read_text(encoding="utf-8")
    named = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert all((folder / name).read_bytes().startswith(b"\x89PNG") for name in named)
    ranks = [int(rank) for rank in re.findall(r"grasp-(\d+).png", text)]
    assert ranks == list(dict.fromkeys(wary.alike(result.grasps.contacts)))[:3]
    for name in ("approach", "convergence"):
        assert (folder / "report" / f"{name}.svg").read_bytes().startswith(b"<?xml")


def test_grasps_with_the_same_contacts_count_once():
    contacts = np.zeros((4, 4, 3))
    contacts[1] += 0.5e-3
    contacts[2, 3] = 0.01
    contacts[3, 3] = 0.011
    assert wary.alike(contacts) == [0, 0, 2, 2]


def test_the_courses_are_the_iterations_of_every_start(folder, result):
    with np.load(folder / results.COURSES) as courses:
        for start, iterations in zip(result.grasps.start, result.grasps.iterations, strict=True):
            own = courses["start"] == start
            phases = len(set(courses["formulation"][own].tolist()))
            assert phases == 2
            assert own.sum() == iterations + phases  # with the point that each begins at
        last = courses["primal"][courses["start"] == result.grasps.start[0]][-1]
        assert last < 1e-4
        panels = convergence(dict(courses))
    assert [len(panel.series) for panel in panels] == [2] * 4
    assert [panel.log for panel in panels] == [False, True] * 2


def test_a_simulation_is_told_if_it_is_of_this_plan(folder):
    closing = {"shift_before_contact": 0.0021, "shift_error": None}
    lift = {"rise": 0.0495, "slip": [0.001, 0.0042]}
    grasp = {"rank": 0, "ending": "held", "score": 1.0, "score_strict": 1.0, "closing": closing, "lift": lift}
    grasp["pushes"] = [{"held": True}] * 5 + [{"held": False}]
    told = {"object": "egg.npz", "settings": {"mass": 0.1, "friction": 1.0}, "grasps": [grasp]}
    file = folder / "simulation.json"
    file.write_text(json.dumps(told), encoding="utf-8")
    section = report._simulated(folder)
    assert section.sheets[0].rows[1] == ("0", "held", "1", "1", "49.5", "4.2", "5 of 6", "2.1", "")
    os.utime(file, (0, 0))
    assert report._simulated(folder) is None
    file.unlink()


# Cautions -------------------------------------------------------------------------------------------------------------


def with_meta(result: refit.Reopened, **sections: dict) -> refit.Reopened:
    """The result with other settings told in its meta."""
    settings = {name: value | sections.get(name, {}) for name, value in result.grasps.meta["settings"].items()
                if isinstance(value, dict)}  # fmt: skip
    meta = result.grasps.meta | {"settings": result.grasps.meta["settings"] | settings}
    return replace(result, grasps=replace(result.grasps, meta=meta))


def with_grasps(result: refit.Reopened, **arrays: object) -> refit.Reopened:
    return replace(result, grasps=replace(result.grasps, **arrays))


def cup(thickness: float) -> np.ndarray:
    """Points of two walls that face two cameras."""
    rng = np.random.default_rng(0)
    front, back = rng.uniform(-0.04, 0.04, (2, 1500, 3))
    front[:, 0], back[:, 0] = thickness / 2, -thickness / 2
    points = np.concatenate([front, back])
    return points + np.array([0, 0, 0.05])


def walls(thickness: float):
    cameras = [[0.5, 0, 0.1], [-0.5, 0, 0.1]]
    return observe(cup(thickness), view=np.repeat([0, 1], 1500), camera_positions=cameras, table_height=0.0)


def test_a_sound_result_gives_no_reason_but_the_ones_it_has(result):
    quiet = {"missing", "no_feasible", "stopped", "unsolved", "few_points", "one_view", "table_assumed", "thin_walls"}
    assert not [c.__name__ for c in wary.CAUTIONS if c.__name__ in quiet and c(result)]
    assert all(said.endswith(".") for said in wary.cautions(result))


def test_each_caution_is_told_where_its_threshold_is_passed(result):
    g, cloud = result.grasps, result.cloud
    far = g.contact_points + np.array([0.0, 0.0, 1.0])
    assert "No start ended feasible" in wary.no_feasible(with_grasps(result, feasible=np.zeros(len(g), bool)))
    assert "Only 2 of 9" in wary.no_feasible(with_grasps(result, meta=g.meta | {"starts": 9}))
    assert "7 of the starts gave nothing" in wary.stopped(with_grasps(result, meta=g.meta | {"starts": 9}))
    assert "not an optimum" in wary.unsolved(with_grasps(result, kkt=g.kkt + 2e-5))
    assert "fewer than the 5000" in wary.few_points(with_meta(result, gpis={"surface_points": 5000}))
    assert "of one view" in wary.one_view(replace(result, cloud=replace(cloud, view_names=("0",))))
    assert "index 9" in wary.unseen_contacts(with_grasps(result, contact_points=far))
    assert not wary.unseen_contacts(with_grasps(result, contact_points=g.contact_points * 0 + cloud.points[0]))
    deviation = np.full_like(g.contact_deviation, 0.012 / wary.CALIBRATION)
    assert not wary.uncertain_contacts(with_grasps(result, contact_deviation=0.99 * deviation))
    assert "thumb 12 mm" in wary.uncertain_contacts(with_grasps(result, contact_deviation=1.01 * deviation))
    assert "Without cloud" in wary.missing(replace(result, missing="it is gone"))


def test_an_assumed_table_is_told(result):
    guessed = observe(ellipsoid(), name="egg")
    assert "cropped" in wary.table_assumed(replace(result, cloud=guessed))


@pytest.mark.parametrize(("travel", "said"), [(0.0, ""), (0.2, "went 20 cm"), (0.3, "stopped by the bound")])
def test_a_wrist_far_from_its_start_is_told(result, travel, said):
    begin = wary.starts(result.problem, 2, 0)[int(result.grasps.start[0])].wrist
    turn = wary.pin.XYZQUATToSE3(begin).rotation
    wrist = result.grasps.wrist.copy()
    wrist[0] = begin
    wrist[0, :3] += turn @ [0, travel, 0]
    told = wary.far_start(with_grasps(result, wrist=wrist))
    assert said in told
    assert bool(said) == bool(told)


@pytest.mark.parametrize(("margin", "shift", "told"), [(0.005, 0.02, True), (0.02, 0.02, False), (0.005, 1e-3, False)])
def test_a_runner_up_is_close_if_it_is_as_good_and_another_grasp(result, margin, shift, told):
    two = np.array([0, 0])
    g = result.grasps
    chosen = {name: getattr(g, name)[two] for name in ("contacts", "margins_initial", "margins_equilibrium", "energy")}
    chosen["contacts"] = chosen["contacts"] + np.array([0, shift])[:, None, None]
    for name in ("margins_initial", "margins_equilibrium"):
        chosen[name] = np.full_like(chosen[name], 0.1) - np.array([0, margin])[:, None]
    both = with_grasps(result, feasible=np.array([True, True]), start=np.array([4, 5]), **chosen)
    assert ("start 5 is as good" in wary.close_runner_up(both)) is told


def test_walls_that_noise_hides_are_told_and_thick_ones_are_not(result):
    assert wary.wall_share(walls(0.004), 0.01) > 0.5
    assert wary.wall_share(walls(0.03), 0.01) == 0
    assert "walls thinner than 10 mm" in wary.thin_walls(replace(result, cloud=walls(0.004)))
    assert not wary.thin_walls(replace(result, cloud=walls(0.03)))


# The pages ------------------------------------------------------------------------------------------------------------


def test_the_page_holds_everything_and_runs_nothing(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert not re.search(r'(?:src|href)="(?!data:)', page)
    assert page.count("<img") == len(re.findall(r"!\[", (folder / "report.md").read_text(encoding="utf-8")))


@pytest.mark.skipif(BROWSER is None, reason="needs chromium")
def test_the_page_loads_without_an_error_or_a_request(folder, tmp_path):
    log = tmp_path / "net.json"
    command = [str(BROWSER), *FLAGS.split(), f"--log-net-log={log}", f"--user-data-dir={tmp_path}", "--dump-dom"]
    page = folder / "report.html"
    done = subprocess.run([*command, page.as_uri()], capture_output=True, encoding="utf-8", timeout=300)
    assert "</html>" in done.stdout
    assert "CONSOLE" not in done.stderr
    assert not re.search(r'"url":"https?://(?!(?:[\w.-]+\.)?google|[\w.-]*gvt)[^"]*', log.read_text(encoding="utf-8"))


def test_without_its_cloud_a_report_says_so_and_leaves_out_what_needs_it(folder, tmp_path):
    copy = tmp_path / "egg"
    shutil.copytree(folder, copy)
    meta = refit.load_grasps(copy).meta | {"source": "gone.npz"}
    results.save(
        replace(refit.load_grasps(copy), meta=meta),
        json.loads((copy / "summary.json").read_text(encoding="utf-8")),
        copy,
    )
    report.write(copy)
    text = (copy / "report.md").read_text(encoding="utf-8")
    assert "Without cloud and surface, and cautions that need them: 'gone.npz' is not there" in text
    assert "Where the fingers meet" not in text
    assert "## Convergence" not in text  # the courses went with the older result


def test_a_missing_summary_is_refused(folder, tmp_path, capfd):
    shutil.copy(folder / "grasps.npz", tmp_path)
    assert run(["report", str(tmp_path)]) == 3
    assert "summary.json' is missing" in capfd.readouterr().err


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
    reading = {"views": ["435", "455"], "scale": 0.001, "table_height": 0.013, "settings": cleaning}
    meta = {"settings": asdict(settings), "source": "a b.npz", "object": "egg", "hand": "allegro_right", "seed": 3}
    meta |= {"starts": 9, "timeout": 5.0, "reading": reading}
    found = parsed(again.command(meta, Path("results/egg")))
    assert found.settings == settings
    assert (found.file, found.views, found.scale, found.table_height) == (Path("a b.npz"), ("435", "455"), 0.001, 0.013)
    assert (found.hand, found.starts, found.seed, found.timeout, found.out) == ("allegro_right", 9, 3, 5.0, None)
    assert found.cleaning == replace(ObservationSettings(), min_points=50)


def test_the_command_of_defaults_is_short(folder):
    meta = {"settings": asdict(ROBUST), "source": "egg.npz", "object": "egg", "hand": "allegro_left", "seed": 0}
    meta |= {"starts": 7, "timeout": 60.0}
    assert again.command(meta, Path("results/egg")) == "sgnlp solve egg.npz"
    assert again.command(meta | {"settings": asdict(PRESETS["lift"])}, Path("x")) == (
        "sgnlp solve egg.npz --preset lift --out x"
    )
    assert f"sgnlp solve {folder.parent}/egg.npz --starts 2" in (folder / "report.md").read_text(encoding="utf-8")
