"""The command `sgnlp`: what it prints and writes, its exit codes, and every bad input in one clear line."""

import json
import os
import re
import shutil
import signal
import subprocess
from dataclasses import fields, is_dataclass, replace
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from plans import SMALL_FLAGS, small_plan
from processes import COMMAND, command_with, hang, interrupted, running, wait_for
from rich.console import Console
from scenes import SMALL, ellipsoid, hand

import sgnlp
from sgnlp import load_grasps
from sgnlp.base.errors import InputError
from sgnlp.base.presets import PRESETS, ROBUST
from sgnlp.base.settings import Closing, Settings
from sgnlp.cli import codes, run
from sgnlp.cli.progress import bars
from sgnlp.cli.solve import _remedy
from sgnlp.perception.observation import ObservationSettings
from sgnlp.planning import results
from sgnlp.planning.grasps import same
from sgnlp.planning.pool import Failure, solve_start
from sgnlp.planning.reach import OUT_OF_REACH
from sgnlp.surface.kernels import KERNELS

ORANGE = Path(__file__).parents[2] / "problems" / "orange_0.npz"
NAN = float("nan")
MOTION = ("trajectory.npz", "trajectory.json", "trajectory.yaml", "grasp.yaml", "pregrasp.yaml")
FILES = ("grasps.npz", "summary.json", "history.npz", *MOTION)
"""Of a result with a feasible grasp."""


@pytest.fixture(autouse=True)
def workplace(tmp_path, monkeypatch) -> Path:
    """An empty folder as the current one; the hand that the tests share is not loaded again."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    loaded = {"allegro_left": hand}
    original = sgnlp.load_hand
    monkeypatch.setattr(
        "sgnlp.cli.flags.load_hand",
        lambda name, s, *arm: loaded.get(name, partial(original, name))(s, *filter(None, arm)),
    )
    return tmp_path


@pytest.fixture
def cloud(workplace) -> str:
    """The file of the ellipsoid."""
    return save("ellipsoid.npz", points=ellipsoid(), table_height=0.0)


def save(file: str, /, **arrays: object) -> str:
    with open(file, "wb") as stream:
        np.savez(stream, **arrays)
    return file


ONE_ITERATION = ["--starts", 1, "--rounds", 1, "--solver.max-iterations", 1]
"""The flags of a plan that is quick and not feasible."""


def solve(*arguments: object) -> int:
    return run(["solve", *map(str, arguments)])


def tree(folder: Path = Path()) -> set[str]:
    return {str(path) for path in folder.rglob("*")}


# What it does ---------------------------------------------------------------------------------------------------------


def test_solve_from_a_shell_writes_the_result_and_shows_it(workplace):
    flags = ["--starts", "2", "--no-build", "--spheres", "paper", "--solver.formulation", "constrained", *SMALL_FLAGS]
    done = subprocess.run([*COMMAND, "solve", ORANGE, *flags], capture_output=True, encoding="utf-8")
    assert (done.returncode, done.stderr) == (codes.FEASIBLE, "")
    files = {f"results/orange_0/{name}" for name in FILES}
    assert tree() == {"results", "results/orange_0"} | files
    grasps = load_grasps("results/orange_0")
    summary = json.loads(Path("results/orange_0/summary.json").read_text(encoding="utf-8"))
    assert len(grasps) == summary["starts"] == 2
    assert summary["best"]["energy"] == grasps.energy[0]
    for text in ("Starts, best first", "gain [N/m]", "exact energy", "margin_equilibrium", "outliers"):
        assert text in done.stdout
    said = [line for line in done.stdout.splitlines() if not line.startswith("caution: ")]
    names = ("grasps.npz", "summary.json", "trajectory.npz")
    written = said.index(f"written: {', '.join(f'results/orange_0/{name}' for name in names)}")
    assert said[written - 1].startswith(f"orange_0: {summary['feasible']} of 2 starts feasible in ")
    assert said[written + 1].startswith("next:  sgnlp view results/orange_0 ")


def test_json_is_all_that_is_printed_where_it_is_asked_for(cloud, capfd):
    assert solve(cloud, "--starts", 1, "--json", "--out", "here", *SMALL_FLAGS) == codes.FEASIBLE
    out, err = capfd.readouterr()
    assert err == ""
    assert out == Path("here/summary.json").read_text(encoding="utf-8")
    assert json.loads(out)["best"]["energy"] == load_grasps("here").energy[0]
    assert tree(Path("here")) == {f"here/{name}" for name in FILES}


def test_quiet_prints_nothing_and_a_few_invalid_points_are_dropped_and_counted(workplace, capfd):
    points = ellipsoid()
    points[::10] = NAN, 0, np.inf
    cloud = save("holes.npz", points=points, table_height=0.0)
    assert solve(cloud, "--quiet", "--starts", 1, *SMALL_FLAGS) == codes.FEASIBLE
    assert capfd.readouterr() == ("", "")
    notes = json.loads(Path("results/holes/summary.json").read_text(encoding="utf-8"))["notes"]
    assert any(note.startswith(f"Dropped {len(points[::10])} of {len(points)} points that are NaN") for note in notes)


def test_it_ends_with_1_where_no_start_is_feasible_and_says_what_fails(cloud, capfd):
    force = ["--limits.force-min", 1000, "--limits.force-max", 2000]  # gains end at 400 N/m
    few = ["--starts", 1, "--rounds", 2, "--solver.max-iterations", 20]  # so far off, no round follows
    assert solve(cloud, *force, *few, *SMALL_FLAGS) == codes.NONE_FEASIBLE
    out = capfd.readouterr().out
    assert "ellipsoid: 0 of 1 starts feasible" in out
    assert "--starts 4 tries more" in out
    summary = json.loads(Path("results/ellipsoid/summary.json").read_text(encoding="utf-8"))
    assert summary["best"] is None
    assert all("force" in start["violated"] for start in summary["starts_table"])
    assert not load_grasps("results/ellipsoid").feasible.any()


def test_the_flags_of_settings_reach_the_plan_and_a_preset_is_their_beginning(cloud, workplace):
    flags = ["--preset", "paper", "--weights.reg", 20, "--contact.friction", 0.8, "--rank-by", "energy", "--seed", 5]
    solve(cloud, "--quiet", *ONE_ITERATION, *flags, *SMALL_FLAGS)
    meta = load_grasps("results/ellipsoid").meta
    assert meta["seed"] == 5
    assert meta["settings"]["weights"]["reg"] == 20
    assert meta["settings"]["contact"]["friction"] == 0.8
    assert meta["settings"]["rank_by"] == "energy"
    assert meta["settings"]["spheres"] == PRESETS["paper"].spheres == "paper"
    assert meta["settings"]["weights"]["gain"] == PRESETS["paper"].weights.gain != ROBUST.weights.gain


def test_the_same_seed_gives_the_same_result_bit_for_bit_whatever_the_jobs(cloud):
    for name, seed, jobs in (("a", 0, 1), ("b", 0, 2), ("c", 1, 2)):
        solve(cloud, "--quiet", "--out", name, "--seed", seed, "--jobs", jobs, "--starts", 2, *SMALL_FLAGS)
    a, b, c = map(load_grasps, "abc")
    assert same(a, b)
    assert not same(a, c)


def test_the_views_that_are_named_are_used(capfd):
    solve(ORANGE, "--views", 0, 2, "--quiet", *ONE_ITERATION, *SMALL_FLAGS)
    notes = json.loads(Path("results/orange_0/summary.json").read_text(encoding="utf-8"))["notes"]
    assert any("belong to views that were not chosen" in note for note in notes)
    assert capfd.readouterr() == ("", "")


def test_an_old_result_is_replaced(cloud):
    for seed in (3, 4):
        solve(cloud, "--quiet", "--seed", seed, *ONE_ITERATION, *SMALL_FLAGS)
        assert load_grasps("results/ellipsoid").meta["seed"] == seed
    assert len(tree(Path("results/ellipsoid"))) == 3


# Starts that fail -----------------------------------------------------------------------------------------------------


def first_is_killed(planner, start):
    if start.index == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return replace(small_plan().solutions[0], start=start.index)


def first_overruns(planner, start):
    if start.index == 0:
        raise TimeoutError  # as the pool tells of it; it stops a process in `planning/test_solve.py`
    return replace(small_plan().solutions[0], start=start.index)


def first_raises(planner, start):
    if start.index == 0:
        raise RuntimeError("and more\nCasADi says [no]")
    return replace(small_plan().solutions[0], start=start.index)


@pytest.mark.parametrize(
    ("task", "timeout", "reason"),
    [
        (first_is_killed, 60, "process ended with exit code -9"),
        (first_overruns, 60, "stopped after 60 s"),
        (first_raises, 60, "RuntimeError: CasADi says [no]"),
    ],
)
def test_a_start_that_fails_is_a_row_and_not_the_end(cloud, capfd, monkeypatch, task, timeout, reason):
    small_plan()
    monkeypatch.setattr("sgnlp.planning.pool.Planner", lambda *given: None)
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", task)
    assert solve(cloud, "--starts", 3, "--timeout", timeout, "--jobs", 2, *SMALL_FLAGS) == codes.FEASIBLE
    out = " ".join(capfd.readouterr().out.split())
    assert "ellipsoid: 2 of 3 starts feasible" in out
    summary = json.loads(Path("results/ellipsoid/summary.json").read_text(encoding="utf-8"))
    assert summary["starts_table"][-1] == {"start": 0, "failure": reason}
    assert all(word in out for word in reason.split())
    assert sorted(load_grasps("results/ellipsoid").start) == [1, 2]


def test_a_result_without_any_solution_is_written_and_read(cloud, capfd, monkeypatch):
    monkeypatch.setattr("sgnlp.planning.pool.solve_start", hang)
    assert solve(cloud, "--starts", 2, "--timeout", 0.1, *SMALL_FLAGS) == codes.NONE_FEASIBLE
    out, err = capfd.readouterr()
    assert "0 1    stopped after 0.1 s" in out
    assert "next:  a longer --timeout: every start was stopped after 0.1 s" in out
    assert err == ""
    assert load_grasps("results/ellipsoid").wrist.shape == (0, 7)


def test_where_the_time_was_over_too_soon_more_time_is_proposed(cloud, capfd):
    assert solve(cloud, "--starts", 2, "--deadline", 1e-3, *SMALL_FLAGS) == codes.NONE_FEASIBLE
    out = capfd.readouterr().out
    assert "ellipsoid: 0 of 0 starts feasible, 2 left out, in " in out
    assert "next:  a longer --deadline (starts not done: 2)" in out


def test_where_the_arm_reaches_nothing_another_place_of_it_is_proposed():
    nothing = replace(small_plan(), solutions=(), failures=(Failure(0, OUT_OF_REACH), Failure(1, OUT_OF_REACH)))
    assert _remedy(nothing).startswith("move the arm: --arm-base X Y Z")


# Ctrl-C ---------------------------------------------------------------------------------------------------------------


def test_ctrl_c_ends_every_worker_and_leaves_no_file(cloud):
    hanging = command_with("import sgnlp.planning.pool, processes; sgnlp.planning.pool.solve_start = processes.hang")
    quick = ["--solver.formulation", "penalty", "--spheres", "paper"]
    with running([*hanging, "solve", cloud, "--jobs", "2", "--out", "here", *SMALL_FLAGS, *quick]) as process:
        assert wait_for(Path("hanging").exists), "no start has begun"
        assert interrupted(process) == (codes.INTERRUPTED, "", "interrupted\n")
    assert codes.INTERRUPTED == 130
    assert tree() == {cloud, "hanging"}


def test_the_bar_counts_starts_on_a_terminal_and_nowhere_else(capsys):
    for terminal, show, seen in ((True, True, True), (False, True, False), (True, False, False)):
        with bars(Console(force_terminal=terminal), show) as bar:
            advance = bar("solving starts", 3).advance
            advance(None)
            advance(None)
        assert ("2/3" in capsys.readouterr().out) == seen


# Bad input ------------------------------------------------------------------------------------------------------------


class Touch:
    """Makes a file called `unpickled` when it is unpickled."""

    def __reduce__(self):
        return partial(Path.touch, Path("unpickled").absolute()), ()


def pickled(key: str) -> str:
    payload = np.empty(1, object)
    payload[0] = Touch()
    return save("bad.npz", **({"points": ellipsoid()} | {key: payload}))


def truncated() -> str:
    data = Path(save("whole.npz", points=ellipsoid())).read_bytes()
    Path("bad.npz").write_bytes(data[: len(data) // 2])
    return "bad.npz"


def text(content: str, name: str = "bad.npz") -> str:
    Path(name).write_text(content, encoding="utf-8")
    return name


def points(array: object, **more: object) -> str:
    return save("bad.npz", points=np.asarray(array), **more)


def invalid(share: float) -> str:
    cloud = ellipsoid()
    cloud[: int(share * len(cloud)), 1] = NAN
    return points(cloud)


SPREAD = np.random.default_rng(0).uniform(0, 0.1, (100, 1))
BAD_FILES = {
    "missing": (lambda: "none.npz", "there is no such file"),
    "markup": (lambda: "[/red][1] :x: .npz", "[/red][1] :x: .npz: there is no such file"),
    "directory": (lambda: Path("bad.npz").mkdir() or "bad.npz", "is a directory"),
    "not an npz": (lambda: text("hello"), "is not an npz"),
    "empty file": (lambda: text(""), "is not an npz"),
    "truncated": (truncated, "truncated"),
    "pickled points": (lambda: pickled("points"), "pickled objects, which are never read"),
    "pickled name": (lambda: pickled("name"), "pickled objects, which are never read"),
    "misnamed": (lambda: save("bad.npz", xyz=ellipsoid(), rgb=ellipsoid()), "its keys: rgb, xyz"),
    "no arrays": (lambda: save("bad.npz"), "its keys: none"),
    "four columns": (lambda: points(np.zeros((100, 4))), "shape (100, 4)"),
    "flat": (lambda: points(np.zeros(300)), "shape (300,)"),
    "text array": (lambda: points(np.full((100, 3), "x")), "real numbers"),
    "complex": (lambda: points(np.zeros((100, 3), complex)), "complex128"),
    "all NaN": (lambda: invalid(1.0), "the cloud has 0 points, at least 30 are needed"),
    "no points": (lambda: points(np.zeros((0, 3))), "has 0 points"),
    "29 points": (lambda: points(ellipsoid()[:29]), "the cloud has 29 points, at least 30 are needed"),
    "equal": (lambda: points(np.full((100, 3), 0.1)), "the cloud has 1 different points of 100"),
    "collinear": (lambda: points(SPREAD * [1, 2, 3]), "lie on one line"),
    "coplanar": (lambda: points(np.hstack([SPREAD, SPREAD[::-1], 0 * SPREAD])), "lie on one plane"),
    "millimetres": (lambda: points(1e3 * ellipsoid()), "--scale 0.001"),
    "tiny": (lambda: points(0.05 * ellipsoid()), "--scale"),
    "table above": (lambda: points(ellipsoid(), table_height=0.2), "is above 100% of the cloud"),
    "table NaN": (lambda: points(ellipsoid(), table_height=NAN), "the table height must be a finite number"),
    "damaged ply": (lambda: text("ply\nhello", "bad.ply"), "bad.ply"),
}
BAD_VALUES = {
    "hand": (["--hand", "nope"], ["unknown hand 'nope'", "allegro_left", "allegro_right"]),
    "kernel": (["--gpis.kernel", "nope"], ["unknown kernel 'nope'", *KERNELS]),
    "preset": (["--preset", "nope"], ["unknown preset 'nope'", *PRESETS]),
    "view": (["--views", "nope"], ["unknown view 'nope'", "valid: 0"]),
    "scale": (["--scale", "0"], ["--scale must be positive"]),
    "scale too large": (["--scale", "1000"], ["m wide, more than 0.5 m"]),
    "scale NaN": (["--scale", "nan"], ["--scale must be a finite number, not nan"]),
    "scale infinite": (["--scale", "inf"], ["--scale must be a finite number, not inf"]),
    "table": (["--table-height", "0.5"], ["the table at 0.5000 m is above 100% of the cloud"]),
    "table NaN": (["--table-height", "nan"], ["--table-height must be a finite number, not nan"]),
    "starts": (["--starts", "0"], ["--starts must be positive"]),
    "starts below zero": (["--starts", "-7"], ["--starts must be positive"]),
    "jobs": (["--jobs", "0"], ["--jobs must be positive"]),
    "timeout": (["--timeout", "-1"], ["--timeout must be positive"]),
    "timeout NaN": (["--timeout", "nan"], ["--timeout must be a finite number, not nan"]),
    "seed": (["--seed", "-1"], ["--seed must be at least 0, not -1"]),
    "cleaning": (["--cleaning.min-points", "0"], ["--cleaning.min-points must be at least 4, not 0"]),
    "out empty": (["--out", ""], ["--out is empty"]),
    "file in the way": (["--out", "taken"], ["the output folder 'taken' cannot be written"]),
    "file above": (["--out", "taken/below/far"], ["the output folder 'taken/below/far' cannot be written"]),
}


def assert_refused(capfd, code: int, *messages: str) -> None:
    """Exit code 3, one line on stderr with every message in it, and nothing on stdout."""
    out, err = capfd.readouterr()
    assert (code, out) == (codes.BAD_INPUT, "")
    assert err.startswith("error: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1
    for message in messages:
        assert message in err


@pytest.mark.parametrize(("make", "message"), BAD_FILES.values(), ids=BAD_FILES)
def test_a_bad_file_is_refused_in_one_line_and_nothing_is_written(capfd, make, message):
    file = make()
    before = tree()
    assert_refused(capfd, solve(file), f"{file}: ", message)
    assert tree() == before


@pytest.mark.parametrize(("flags", "messages"), BAD_VALUES.values(), ids=BAD_VALUES)
def test_a_bad_value_is_refused_in_one_line_and_nothing_is_written(capfd, cloud, flags, messages):
    text("in the way", "taken")
    before = tree()
    assert_refused(capfd, solve(cloud, "--starts", 1, *flags), *messages)
    assert tree() == before


@pytest.mark.parametrize("command", ["batch", "study convergence", "benchmark", "cache"])
def test_the_flags_that_commands_share_are_checked_in_each(capfd, cloud, command):
    name, files = command.split()[0], [] if command == "cache" else [cloud]
    bad = {"jobs": 0, "starts": 0, "seed": -1, "timeout": "nan", "scale": -1, "contact.friction": 0}
    assert run([name, "--help"]) == 0
    help_text = capfd.readouterr().out
    known = [flag for flag in bad if f"--{flag} " in help_text]
    assert {"jobs", "contact.friction"} <= set(known)
    for flag in known:
        assert_refused(capfd, run([*command.split(), *files, f"--{flag}", str(bad[flag])]), f"--{flag} must be ")
    assert tree() == {cloud}


def test_a_pickled_payload_works_where_it_is_let_in():
    with np.load(pickled("name"), allow_pickle=True) as data:
        data["name"]
    assert Path("unpickled").exists()  # so that its absence above means something


def test_a_result_that_cannot_be_put_in_place_is_refused_in_one_line(capfd, cloud):
    (Path("here") / results.GRASPS).mkdir(parents=True)
    code = solve(cloud, "--out", "here", *ONE_ITERATION, *SMALL_FLAGS)
    assert_refused(capfd, code, "'here/grasps.npz' cannot be written")
    assert tree(Path("here")) == {"here/grasps.npz"}


BAD_SETTINGS = {
    "contact.c": (0, -0.1, 1.1),
    "contact.friction": (-0.5, 0),
    "contact.samples": (1, 0, -1),
    "contact.mass": (-0.1,),
    "gpis.surface-points": (0, -1, 3),
    "gpis.interior-points": (-1,),
    "gpis.surface-noise": (0, -0.005),
    "gpis.exterior-noise": (0, -0.2),
    "gpis.interior-noise": (0, -0.05),
    "gpis.cube-scale": (0, -1, 0.9),
    "gpis.cube-half-min": (-0.1,),
    "gpis.interior-value": (0.3,),
    "gpis.interior-temperature": (0, -1),
    "limits.force-min": (-1, 11),
    "limits.force-max": (-1, 3),
    "limits.gain-min": (0, -1, 401),
    "limits.gain-max": (0, 99),
    "limits.stiffness": (0, -1),
    "limits.rotation-deg": (0, -10, 181),
    "limits.shift": (0, -0.01),
    "limits.margin-equilibrium": (1.5,),
    "limits.wrist-travel": (0, -1),
    **{f"weights.{field.name}": (-1,) for field in fields(ROBUST.weights)},
    **{f"smoothing.{field.name}": (0, -1) for field in fields(ROBUST.smoothing)},
    "solver.penalty-iterations": (0, -1),
    "solver.max-iterations": (0, -1),
    "solver.tolerance": (0, -1e-6),
    "solver.mu-init": (0, -0.1),
}


@pytest.mark.parametrize(("flag", "values"), BAD_SETTINGS.items(), ids=BAD_SETTINGS)
def test_a_setting_that_makes_no_sense_is_refused_by_its_flag(capfd, monkeypatch, cloud, flag, values):
    monkeypatch.setattr("sgnlp.cli.solve.solve", never)
    for value in values:
        assert_refused(capfd, solve(cloud, f"--{flag}", value), f"--{flag}")
    assert tree() == {cloud}


def never(*arguments: object, **options: object) -> None:
    raise AssertionError("a plan was made of settings that make no sense")


def leaves(settings: object, prefix: str = "") -> list[tuple[str, str, object]]:
    """(flag, help, value) of every setting, sections first resolved."""
    found = []
    for field in fields(settings):
        value, flag = getattr(settings, field.name), f"{prefix}{field.name}".replace("_", "-")
        found += leaves(value, f"{flag}.") if is_dataclass(value) else [(flag, field.name, value)]
    return found


def test_no_setting_takes_what_is_not_a_finite_number(capfd, cloud, monkeypatch):
    monkeypatch.setattr("sgnlp.cli.solve.solve", never)
    flags = [flag for flag, _, default in leaves(ROBUST) if isinstance(default, float)]
    assert len(flags) > 30
    first = {flag.partition(".")[0]: flag for flag in reversed(flags)}  # of each section: the next test has them all
    for flag, value in zip(first.values(), cycle(("nan", "inf")), strict=False):
        assert_refused(capfd, solve(cloud, f"--{flag}", value), f"--{flag} ")


@pytest.mark.parametrize("value", [NAN, float("inf")])
def test_so_it_is_for_settings_in_python(value):
    for settings in (ROBUST, *(getattr(ROBUST, field.name) for field in fields(ROBUST))):
        for field in fields(settings) if is_dataclass(settings) else ():
            if isinstance(getattr(settings, field.name), float):
                with pytest.raises(InputError, match=field.name.replace("_", "-")):
                    replace(settings, **{field.name: value})


# Usage and help -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["nope"],
        ["solve"],
        ["solve", "x.npz", "--nope"],
        ["solve", "x.npz", "y.npz"],
        ["solve", "x.npz", "--starts"],
        ["solve", "x.npz", "--starts", "two"],
        ["solve", "x.npz", "--starts", "2.5"],
        ["solve", "x.npz", "--preset"],
        ["solve", "x.npz", "--weights.nope", "1"],
        ["solve", "x.npz", "--spheres", "nope"],
        ["solve", "x.npz", "--solver.formulation", "nope"],
        ["study", "nope", "x.npz"],
        ["study"],
        ["hands", "--nope"],
    ],
    ids=" ".join,
)
def test_wrong_usage_ends_with_2_and_says_so_on_stderr(capfd, arguments):
    assert run(arguments) == codes.USAGE
    out, err = capfd.readouterr()
    assert out == ""
    assert err
    assert "Traceback" not in err
    assert tree() == set()


@pytest.mark.parametrize(
    ("flag", "names"),
    [
        ("--spheres", ["cover", "paper"]),
        ("--rank-by", ["margin", "energy", "stiffness"]),
        ("--solver.formulation", ["penalty", "constrained", "two_phase", "elastic", "lifted"]),
        ("--contact.equilibrium", ["exact", "printed"]),
        ("--contact.density", ["share", "density"]),
        ("--solver.mu-strategy", ["monotone", "adaptive"]),
        ("--solver.linear-solver", ["condensed", "mumps", "spral"]),
    ],
)
def test_an_unknown_choice_lists_the_valid_ones(capfd, flag, names):
    assert solve("x.npz", flag, "nope") == codes.USAGE
    err = capfd.readouterr().err
    assert all(name in err for name in names)


@pytest.mark.parametrize("command", [[], ["solve"], ["hands"], ["study"], ["doctor"]], ids=" ".join)
def test_every_command_has_help(capfd, command):
    assert run([*command, "--help"]) == 0
    out, err = capfd.readouterr()
    assert out.startswith(" ".join(["usage: sgnlp", *command]))
    assert err == ""


def test_every_setting_is_a_flag_with_a_help_of_its_own(capfd):
    assert run(["solve", "--help"]) == 0
    plain = " ".join(re.sub(r"[│╭╮╰╯─]", " ", capfd.readouterr().out).split())
    described = dict(re.findall(r"--([\w.-]+)(?:, --[\w.-]+)? (.*?)(?= --[a-z]|$)", plain))
    settings = [flag for flag, _, _ in leaves(ROBUST)]
    cleaning = [f"cleaning.{flag}" for flag, _, _ in leaves(ObservationSettings())]
    own = ["preset", "views", "hand", "starts", "seed", "jobs", "timeout", "scale", "table-height", "out", "json"]
    assert len(settings) == len(set(settings)) > 50
    for flag in (*settings, *cleaning, *own, "quiet"):
        explanation = re.sub(r"\(default: .*", "", described[flag])
        words = re.sub(r"^(INT|FLOAT|STR|PATH|\{\S*\}(\|\S+)?|\[STR.*?\]\])", "", explanation).split()
        assert len(words) >= 2, f"--{flag}: {described[flag]}"


@pytest.mark.parametrize("preset", PRESETS)
def test_the_defaults_in_the_help_are_those_of_the_preset(capfd, preset):
    assert run(["solve", "--preset", preset, "--help"]) == 0
    plain = " ".join(re.sub(r"[│╭╮╰╯─]", " ", capfd.readouterr().out).split())
    settings = PRESETS[preset]
    assert f"(default: {settings.spheres})" in plain
    for section, name in (("limits", "force_min"), ("contact", "friction"), ("weights", "gain")):
        flag, value = f"--{section}.{name}".replace("_", "-"), getattr(getattr(settings, section), name)
        assert re.search(rf"{flag} FLOAT .*?\(default: {value}\)", plain)


def test_the_settings_of_the_small_flags_are_those_of_the_shared_scene():
    gpis = replace(ROBUST.gpis, surface_points=60, interior_points=15, exterior_noise=0.2)
    contact = replace(ROBUST.contact, mass=0.0, samples=4)
    limits = replace(ROBUST.limits, place_error=0.0, effort=0.0, rotation_deg=10.0, shift=0.01, give=0.0)
    weights, smoothing = replace(ROBUST.weights, uncer=20.0), replace(ROBUST.smoothing, deviation=0.008)
    changed = {"gpis": gpis, "contact": contact, "closing": Closing(), "limits": limits}
    assert replace(ROBUST, **changed, weights=weights, smoothing=smoothing) == SMALL
    assert isinstance(SMALL, Settings)
    assert solve_start is sgnlp.planning.pool.solve_start


COMPLETED = [
    (["so"], ["solve", "solvers"]),
    (["solve", "--gpis.k"], ["--gpis.kernel"]),
    (["solve", "--solver.formulation", ""], ["penalty", "constrained", "two_phase", "elastic", "lifted"]),
    (["solve", "--sphe"], ["--spheres"]),
]


@pytest.mark.skipif(not shutil.which("bash"), reason="needs bash")
def test_the_completion_script_completes_in_bash(capfd):
    assert run(["--tyro-print-completion", "bash"]) == 0
    script = capfd.readouterr().out
    (function,) = re.findall(r"^complete -F (\w+) sgnlp$", script, re.MULTILINE)
    asked = []
    for words, _ in COMPLETED:
        quoted = " ".join(f"'{word}'" for word in ["sgnlp", *words])
        asked.append(f'COMP_WORDS=({quoted}); COMP_CWORD={len(words)}; {function}; echo "${{COMPREPLY[@]}}"')
    done = subprocess.run(["bash"], input="\n".join([script, *asked]), capture_output=True, encoding="utf-8")
    assert done.stderr == ""
    assert [line.split() for line in done.stdout.splitlines()] == [expected for _, expected in COMPLETED]


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_have_a_completion_script_too(capfd, shell):
    assert run(["--tyro-print-completion", shell]) == 0
    assert "gpis.kernel" in capfd.readouterr().out


def test_the_version_is_printed_alone(capfd):
    assert run(["--version"]) == 0
    assert capfd.readouterr() == (f"{sgnlp.__version__}\n", "")


def test_hands_are_listed(capfd):
    assert run(["hands"]) == 0
    out, err = capfd.readouterr()
    assert "allegro_left" in out
    assert "allegro_right" in out
    assert err == ""


def test_arms_are_listed_and_are_no_hands(capfd):
    assert run(["arms"]) == 0
    out, err = capfd.readouterr()
    assert all(name in out for name in ("panda", "ur5", "ur10", "-0.55 0 0"))
    assert err == ""
    assert run(["hands"]) == 0
    assert "panda" not in capfd.readouterr().out


def test_the_doctor_tells_versions_solvers_and_backend(capfd):
    assert run(["doctor"]) == 0
    out, err = capfd.readouterr()
    for name in ("casadi", "pin", "numpy", "open3d", "nlpsol ipopt", "forward kinematics", "surface", "processor"):
        assert name in out
    for what in ("by pinocchio.casadi", "by pinocchio (compiled)", "of a hand of your own"):
        assert f"\nkinematics {what}: " in out
    assert "\nC++ compiler: " in out
    assert err == ""


@pytest.mark.parametrize("arguments", [("--version",), ("arms",), ("solve", "--help")])
def test_a_reader_that_ends_early_is_no_error(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*COMMAND, *arguments], stdout=writer, stderr=subprocess.PIPE, encoding="utf-8")
    os.close(writer)
    assert (done.returncode, done.stderr) == (codes.BROKEN_PIPE, "")
