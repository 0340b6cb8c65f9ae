"""Result files: what is written is read again bit for bit, whole or not at all, and never unpickled."""

import csv
import errno
import json
import math
import os
import pickle
import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass, fields, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from plans import small_plan
from scenes import SMALL, hand

from sgnlp.base.errors import InputError, MachineError
from sgnlp.planning import results
from sgnlp.planning.grasps import Grasps, stack
from sgnlp.program.terms import preset_terms

ODD_META = {"text": 'quotes " and ü', "numbers": [1, 0.1, 1e-300], "nothing": None}


@dataclass(frozen=True)
class Line:
    """A row with a field of every type that a CSV file can hold."""

    name: str
    count: int
    value: float
    flag: bool
    note: str = ""


ODD_LINES = [
    Line("plain", 1, 0.1, True),
    Line('a, "quoted" name', -3, math.nan, False, "two\nlines; and, commas"),
    Line("", 10**12, math.inf, True, " spaces "),
    Line("ü", 0, 1e-300, False, "True"),
]


@dataclass(frozen=True)
class Touch:
    """Leaves a file behind when it is unpickled."""

    file: str

    def __reduce__(self):
        return partial(Path.touch, Path(self.file)), ()


@pytest.fixture
def grasps() -> Grasps:
    return small_plan().arrays()


def assert_same(found: Grasps, expected: Grasps) -> None:
    for name in (field.name for field in fields(Grasps) if field.name != "meta"):
        a, b = getattr(found, name), getattr(expected, name)
        assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes()), name
    assert found.meta == expected.meta


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*"))


def edited(source: Path, target: Path, **arrays) -> Path:
    """A copy of an npz with some arrays replaced, or left out where None."""
    with np.load(source) as data:
        kept = dict(data) | arrays
    np.savez(target, **{name: array for name, array in kept.items() if array is not None})
    return target


def refusal(file: Path) -> str:
    """Why a file is not loaded, "" if it is; any other error than `InputError` passes through."""
    try:
        results.load_grasps(file)
    except InputError as error:
        return str(error)
    return ""


def test_a_saved_result_is_loaded_bit_for_bit_from_its_folder_and_from_its_file(grasps, tmp_path):
    folder = tmp_path / "new" / "folder"
    results.save(grasps, small_plan().summary(), folder)
    assert files(folder) == [results.GRASPS, results.SUMMARY]
    assert_same(results.load_grasps(folder), grasps)
    assert_same(results.load_grasps(str(folder / results.GRASPS)), grasps)


def test_odd_numbers_odd_texts_and_no_grasps_survive(grasps, tmp_path):
    odd = replace(grasps, energy=np.array([math.nan, -0.0]), violated=np.array(["a; b", "ü"]), meta=ODD_META)
    results.save(odd, {}, tmp_path)
    assert_same(results.load_grasps(tmp_path), odd)
    none = stack(hand(), preset_terms(SMALL), [], {})
    results.save(none, {}, tmp_path)
    assert_same(results.load_grasps(tmp_path), none)


def test_the_file_holds_no_objects_and_opens_without_sgnlp(grasps, tmp_path):
    results.save(grasps, {}, tmp_path)
    with np.load(tmp_path / results.GRASPS, allow_pickle=False) as data:
        assert {data[key].dtype.kind for key in data.files} <= set("fibU")
        assert sorted(data.files) == sorted(field.name for field in fields(Grasps))
        assert json.loads(str(data["meta"])) == grasps.meta


def test_the_files_can_be_read_by_others(grasps, tmp_path):
    results.save(grasps, {}, tmp_path)
    assert {path.stat().st_mode & 0o777 for path in tmp_path.iterdir()} == {0o644}


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_an_end_in_the_middle_of_writing_leaves_the_old_result_and_nothing_else(grasps, tmp_path, monkeypatch, error):
    results.save(grasps, {"old": True}, tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def ended(name, mode):
        assert Path(name).stat().st_size > 0
        raise error

    monkeypatch.setattr(os, "chmod", ended)
    with pytest.raises(error):
        results.save(replace(grasps, meta={}), {"old": False}, tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("room", [0, 1], ids=["nothing", "the_grasps"])
def test_a_full_disk_is_the_machines_error_and_changes_nothing(grasps, tmp_path, monkeypatch, room):
    results.save(grasps, {"old": True}, tmp_path / "old")
    before = (tmp_path / "old" / results.GRASPS).read_bytes()
    opened = []

    def full(handle, mode, fdopen=os.fdopen):
        opened.append(handle)
        if (len(opened) - 1) % (room + 1) < room:
            return fdopen(handle, mode)
        os.close(handle)
        return open("/dev/full", mode)

    monkeypatch.setattr(os, "fdopen", full)
    name = [results.GRASPS, results.SUMMARY][room]
    for folder in ("old", "new/deep"):
        with pytest.raises(MachineError, match=rf"{name}' cannot be written: No space left on device"):
            results.save(replace(grasps, meta={}), {"old": False}, tmp_path / folder)
    assert files(tmp_path) == ["grasps.npz", "old", "summary.json"]
    assert (tmp_path / "old" / results.GRASPS).read_bytes() == before


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EDQUOT, errno.EMFILE, errno.EIO])
def test_what_is_the_machines_is_told_from_what_is_the_folders(tmp_path, monkeypatch, error):
    def fails(**_):
        raise OSError(error, os.strerror(error))

    monkeypatch.setattr("tempfile.mkstemp", fails)
    with pytest.raises(MachineError, match="cannot be written"):
        results.write_text(tmp_path / "new" / "text", "text")
    assert not files(tmp_path)


def in_a_small_disk(folder: Path, size: str, code: str) -> subprocess.CompletedProcess[str]:
    """What Python says in a folder that is a disk of its own; skips where none can be mounted."""
    mount = f"mount -t tmpfs -o size={size} none . && cd . && "
    can = shutil.which("unshare") and subprocess.run(["unshare", "-m", "sh", "-c", mount + "true"], cwd=folder)
    if not can or can.returncode:
        pytest.skip("a disk cannot be mounted")
    command = ["unshare", "-m", "sh", "-c", f'{mount}cd "$PWD" && exec "$0" -c "$1"', sys.executable, code]
    return subprocess.run(command, cwd=folder, capture_output=True, encoding="utf-8")


def test_on_a_disk_that_is_really_full_the_old_files_stay(tmp_path):
    code = """
import os, pathlib
from sgnlp.base import errors
from sgnlp.planning import results
results.write_files(pathlib.Path("r"), {"a": b"old", "b": b"old"})
try:
    results.write_files(pathlib.Path("r"), {"a": b"new", "b": bytes(10**6)})
except errors.MachineError as error:
    print(error, sorted(os.listdir("r")), open("r/a").read())
"""
    done = in_a_small_disk(tmp_path, "64k", code)
    assert done.stdout == "'r/b' cannot be written: No space left on device ['a', 'b'] old\n", done.stderr


def test_a_summary_of_other_grasps_is_not_read(tmp_path):
    plan = small_plan()
    results.save(plan.arrays(), plan.summary(), tmp_path)
    assert results.load_summary(tmp_path, plan.arrays())["notes"] == list(plan.observation.notes)
    slower = replace(plan, seconds={"fit": 1.0, "solve": 2.0})
    results.load_summary(tmp_path, slower.arrays())
    for other in (replace(plan, seed=1), replace(plan, solutions=plan.solutions[:1])):
        with pytest.raises(
            InputError, match=r"summary\.json' belongs to another plan than the grasps\.npz .*; delete it"
        ):
            results.load_summary(tmp_path, other.arrays())
    (tmp_path / results.SUMMARY).unlink()
    with pytest.raises(InputError, match="is missing"):
        results.load_summary(tmp_path, plan.arrays())


def test_a_plan_is_known_by_its_arrays_and_by_what_it_was_for(grasps, tmp_path):
    results.save(grasps, {}, tmp_path)
    assert results.load_grasps(tmp_path).digest == grasps.digest
    assert replace(grasps, solve_seconds=grasps.solve_seconds + 1).digest == grasps.digest
    assert replace(grasps, energy=grasps.energy + 1e-9).digest != grasps.digest
    for name in ("object", "input_digest", "hand", "settings", "seed", "starts", "tried"):
        assert replace(grasps, meta=grasps.meta | {name: "another"}).digest != grasps.digest, name


def test_a_new_result_takes_away_what_was_made_of_the_old_one(grasps, tmp_path):
    made = ["simulation.json", "simulation-lift.png", "report.html", "report.md", "report/margins.svg", "history.npz"]
    (tmp_path / "report").mkdir()
    for name in (*made, "notes.txt", "report/notes.txt"):
        (tmp_path / name).touch()
    results.save(grasps, {}, tmp_path)
    assert files(tmp_path) == sorted([results.GRASPS, results.SUMMARY, "notes.txt", "notes.txt", "report"])


@pytest.mark.parametrize(
    "change", [{"notes": None}, {"starts_table": []}, {"starts_table": [1, 2, 3]}, {"starts_table": {}}, {"best": 5}]
)
def test_a_damaged_summary_is_refused_in_one_line(tmp_path, change):
    plan = small_plan()
    results.save(plan.arrays(), plan.summary() | change, tmp_path)
    with pytest.raises(InputError, match=r"summary.json' is not the summary of a result; solve it again$"):
        results.load_summary(tmp_path, plan.arrays())


def test_a_name_with_a_byte_that_is_no_text_is_written_and_read_again(tmp_path):
    lines = [Line(os.fsdecode(b"\xff"), 1, 0.5, True)]
    results.write_rows(tmp_path / "rows.csv", lines)
    assert results.read_rows(tmp_path / "rows.csv", Line) == lines


def test_a_folder_is_found_writable_without_making_it(tmp_path):
    results.writable(tmp_path / "a" / "b")
    results.writable(tmp_path)
    assert not files(tmp_path)


@pytest.mark.parametrize("folder", ["file", "file/below", "file/far/below", "x" * 300])
def test_a_folder_that_cannot_be_made_is_refused_by_name(tmp_path, folder):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(InputError, match=r"the output folder .* cannot be written"):
        results.writable(tmp_path / folder)
    with pytest.raises(InputError, match="cannot be written"):
        results.write_text(tmp_path / folder / "text", "text")
    assert files(tmp_path) == ["file"]


def test_a_link_to_nowhere_is_refused_before_any_work(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"the output folder .*link' cannot be written"):
        results.writable(tmp_path / "link")


def test_a_folder_in_the_place_of_the_file_is_refused(grasps, tmp_path):
    (tmp_path / results.GRASPS / "kept").mkdir(parents=True)
    with pytest.raises(InputError, match="cannot be written"):
        results.save(grasps, {}, tmp_path)
    assert files(tmp_path) == [results.GRASPS, "kept"]


def test_what_is_not_a_result_is_an_input_error_in_one_line(grasps, tmp_path):
    results.save(grasps, {}, tmp_path)
    good = tmp_path / results.GRASPS
    data = good.read_bytes()
    bad = {
        "missing.npz": (None, "no result at"),
        "text.npz": (b"hello", "not an npz"),
        "empty.npz": (b"", "not an npz"),
        "cut.npz": (data[: len(data) // 2], "not an npz, or a truncated one"),
        "array.npz": (b"\x93NUMPY" + data[6:], "cannot be read"),
        "pickle.npz": (pickle.dumps({"wrist": 1}), "not an npz"),
    }
    for name, (content, message) in bad.items():
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=message) as error:
            results.load_grasps(tmp_path / name)
        assert "\n" not in str(error.value)
    without = edited(good, tmp_path / "without.npz", targets=None)
    with pytest.raises(InputError, match=r"is not a result of sgnlp: .*targets"):
        results.load_grasps(without)
    for meta in (np.array("{"), np.array("5"), np.arange(3)):
        with pytest.raises(InputError, match="cannot be read"):
            results.load_grasps(edited(good, tmp_path / "meta.npz", meta=meta))
    with pytest.raises(InputError, match=r"should be a folder with grasps\.npz"):
        results.load_grasps(tmp_path / "nowhere")


def test_damaged_bytes_raise_nothing_but_input_errors(grasps, tmp_path):
    results.save(grasps, {}, tmp_path)
    good, rng = (tmp_path / results.GRASPS).read_bytes(), np.random.default_rng(0)
    for _ in range(60):
        damaged = bytearray(good)
        for place in rng.integers(len(good), size=8):
            damaged[place] ^= 1 << int(rng.integers(8))
        (tmp_path / "damaged.npz").write_bytes(damaged)
        assert len(refusal(tmp_path / "damaged.npz").splitlines()) <= 1


def test_a_pickled_array_is_refused_and_never_unpickled(grasps, tmp_path):
    results.save(grasps, {}, tmp_path)
    marker, array = tmp_path / "unpickled", np.empty(1, object)
    array[0] = Touch(str(marker))
    file = edited(tmp_path / results.GRASPS, tmp_path / "evil.npz", wrist=array)
    with pytest.raises(InputError, match="cannot be read"):
        results.load_grasps(file)
    assert not marker.exists()
    with np.load(file, allow_pickle=True) as data:
        data["wrist"]
    assert marker.exists()  # the payload works where it is let in


def test_a_zip_of_other_things_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "other.npz", "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(InputError, match="is not a result of sgnlp"):
        results.load_grasps(tmp_path / "other.npz")


def test_json_has_no_numbers_that_json_does_not_know():
    text = results.json_text({"a": [1.5, math.nan, (math.inf, -math.inf)], "b": {"c": math.nan}, "d": True, "e": "NaN"})

    def refuse(token):
        raise AssertionError(token)

    assert json.loads(text, parse_constant=refuse) == {
        "a": [1.5, None, [None, None]],
        "b": {"c": None},
        "d": True,
        "e": "NaN",
    }


def test_rows_are_read_as_they_were_written(tmp_path):
    file = tmp_path / "rows.csv"
    results.write_rows(file, ODD_LINES)
    assert repr(results.read_rows(file, Line)) == repr(ODD_LINES)  # repr, since nan is not equal to itself
    with open(file, encoding="utf-8", newline="") as handle:
        assert len(list(csv.reader(handle))) == 1 + len(ODD_LINES)
    assert files(tmp_path) == ["rows.csv"]


@pytest.mark.skipif(find_spec("pyarrow") is None, reason="needs the package pyarrow")
def test_parquet_has_the_same_rows_each_column_of_the_type_of_its_field(tmp_path):
    from pyarrow import parquet

    file = tmp_path / "rows.parquet"
    for lines in (ODD_LINES, ODD_LINES[:1]):
        results.write_parquet(file, lines)
        table = parquet.read_table(file)
        assert repr([Line(**line) for line in table.to_pylist()]) == repr(lines)
        assert [str(column.type) for column in table.columns] == ["string", "int64", "double", "bool", "string"]
        assert table.column_names == [field.name for field in fields(Line)]
    assert files(tmp_path) == ["rows.parquet"]


def test_without_pyarrow_parquet_says_what_to_install_and_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"needs the package pyarrow: pip install 'sgnlp\[parquet\]'"):
        results.write_parquet(tmp_path / "rows.parquet", ODD_LINES)
    assert not files(tmp_path)


def test_no_file_holds_no_rows(tmp_path):
    assert results.read_rows(tmp_path / "rows.csv", Line) == []


@pytest.mark.parametrize(
    "text",
    [
        "name,count,value,flag,note\na,one,1,True,\n",
        "name,count,value,flag,note\na,1,x,True,\n",
        "name,count,value,flag,note,more\na,1,1,True,,2\n",
        "name,count,value,flag,note\na,1,1,True,,surplus\n",
        "name,count\na,1\n",
        "name,count,value,flag,note\na\n",
        f'name,count,value,flag,note\n"{"x" * 200_000}",1,1,True,\n',
    ],
    ids=["not_an_int", "not_a_float", "other_column", "surplus", "fewer_columns", "short", "endless_field"],
)
def test_rows_of_something_else_are_refused_with_what_to_do(tmp_path, text):
    file = tmp_path / "rows.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"does not hold rows of this study.*delete it to begin anew"):
        results.read_rows(file, Line)


def test_binary_rows_are_refused(tmp_path):
    (tmp_path / "rows.csv").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="does not hold rows of this study"):
        results.read_rows(tmp_path / "rows.csv", Line)
