"""The C compiler however $CC names it, and a cache wherever there is room for one."""

import os
import stat
import tempfile
from pathlib import Path

import pytest

from sgnlp.base import toolchain
from sgnlp.base.compilers import CPP, C
from sgnlp.base.errors import MachineError, SolverError


@pytest.fixture
def programs(tmp_path, monkeypatch) -> Path:
    """A folder with blanks in its name that is all of PATH, with a compiler that starts."""
    folder = tmp_path / "a folder"
    folder.mkdir()
    program(folder / "cc", "exit 0")
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return folder


def program(file: Path, text: str) -> Path:
    """A script of the shell."""
    file.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    file.chmod(0o755)
    return file


@pytest.mark.parametrize("named", ["", " ", "cc", "cc ", "ccache cc", "ccache", "/usr/bin/ccache  cc", "sccache cc"])
def test_the_compiler_is_found_however_it_is_named(programs, monkeypatch, named):
    monkeypatch.setenv("CC", named)
    assert C.words() == [str(programs / "cc")]
    assert C.fault() == ""


def test_arguments_are_kept_and_a_path_with_blanks_is_one_word(programs, monkeypatch):
    monkeypatch.setenv("CC", "cc -std=gnu11 -DX='a b'")
    assert C.words() == [str(programs / "cc"), "-std=gnu11", "-DX=a b"]
    monkeypatch.setenv("CC", str(programs / "cc"))
    assert C.words() == [str(programs / "cc")]


@pytest.mark.parametrize("named", ["gone", "gone -O2", "'cc"])
def test_a_compiler_that_is_not_there_is_told_by_its_name(programs, monkeypatch, named):
    monkeypatch.setenv("CC", named)
    assert C.words() is None
    assert f"$CC is '{named}', which is not found; unset CC" in C.fault()


def test_each_language_has_a_variable_of_its_own(programs, monkeypatch):
    monkeypatch.setenv("CC", "cc")
    monkeypatch.setenv("CXX", "gone")
    assert "no C++ compiler: $CXX is 'gone'" in CPP.fault()
    program(programs / "g++", "exit 0")
    monkeypatch.delenv("CXX")
    assert CPP.words() == [str(programs / "g++")]
    assert toolchain.fingerprint("a", compiler=CPP) != toolchain.fingerprint("a")


def test_without_any_compiler_it_is_told_what_to_install(programs, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    (programs / "cc").unlink()
    assert "install one" in C.fault()
    with pytest.raises(SolverError, match="install one"):
        toolchain.build(programs / "f.so", {"f.c": ""}, ())


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        ("echo 'warning: odd' >&2; echo 'f.c:1: error: bad [x]' >&2; exit 1", SolverError, "fails: f.c:1: error: bad"),
        ("exit 1", SolverError, "it says nothing; name another in CC"),
        ("exit 0", SolverError, "makes no library"),
        ("echo 'cannot write: No space left on device' >&2; exit 1", MachineError, "there is no room in the cache"),
    ],
)
def test_a_compiler_that_fails_is_told_in_its_words_and_leaves_nothing(programs, monkeypatch, text, error, said):
    monkeypatch.delenv("CC", raising=False)
    program(programs / "cc", text)
    with pytest.raises(error, match=r"^[^\n]*$") as raised:
        toolchain.build(programs / "cache" / "f.so", {"f.c": ""}, ())
    assert said in str(raised.value)
    assert not list((programs / "cache").iterdir())


def test_a_compiler_that_only_warns_builds_what_is_sealed_with_its_note(programs, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    program(programs / "cc", 'echo warning >&2; [ "$1" = -shared ] && echo library > f.so; exit 0')
    file = programs / "f.so"
    toolchain.build(file, {"f.c": ""}, (), note=b"[1, 2]")
    assert toolchain.note_of(file) == b"[1, 2]"
    whole = file.read_bytes()
    assert whole.startswith(b"library\n")
    for damaged in (b"", whole[:-1], whole[:5], b"x" + whole[1:], whole + b"x", b"\x7fELF" * 100):
        file.write_bytes(damaged)
        assert toolchain.note_of(file) is None
    assert toolchain.note_of(programs / "none.so") is None


def test_what_is_kept_is_made_once_and_made_again_where_it_is_damaged(programs, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    file, made = toolchain.cache_folder() / "f.text", []

    def make() -> None:
        made.append(1)
        toolchain.keep(file, b"content")

    for damage in (False, False, True, False):
        if damage:
            file.write_bytes(file.read_bytes()[:-1])
        toolchain.once(file, make)
        assert toolchain.note_of(file) == b"content"
    assert len(made) == 2


def test_the_cache_is_the_users_where_that_can_serve(programs, tmp_path, monkeypatch):
    assert toolchain.cache_folder() == tmp_path / "cache" / "sgnlp"
    assert toolchain.cache_fault() == toolchain.passed_over() == ""
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert toolchain.cache_folder() == tmp_path / ".cache" / "sgnlp"


def test_where_it_cannot_serve_the_cache_is_among_the_temporary_files_and_private(programs, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    found = toolchain.cache_folder()
    assert found == tmp_path / f"sgnlp-{os.getuid()}"
    assert stat.S_IMODE(found.stat().st_mode) == 0o700
    assert "is not a folder; set XDG_CACHE_HOME" in toolchain.passed_over()
    found.chmod(0o777)  # others could put libraries there
    assert toolchain.cache_folder() == tmp_path / "file" / "sgnlp"
    assert "is not a folder; set XDG_CACHE_HOME" in toolchain.cache_fault()
    with pytest.raises(SolverError, match="is not a folder"):
        toolchain.build(toolchain.cache_folder() / "f.so", {"f.c": ""}, ())


def test_without_a_home_there_is_a_cache_all_the_same(programs, tmp_path, monkeypatch):
    def homeless(*_):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr("sgnlp.base.toolchain.user_cache_path", homeless)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert toolchain.cache_folder() == tmp_path / f"sgnlp-{os.getuid()}"
    assert toolchain.passed_over().startswith("there is no home")


def test_a_file_system_that_runs_no_programs_is_passed_over(programs, tmp_path, monkeypatch):
    class Status:
        f_flag = os.ST_NOEXEC

    monkeypatch.setattr(os, "statvfs", lambda path: Status)
    assert "(noexec)" in toolchain.cache_fault()


def test_clearing_takes_what_killed_builds_have_left(programs):
    folder = toolchain.cache_folder()
    (folder / ".build-x").mkdir(parents=True)
    (folder / "a.so").touch()
    toolchain.clear()
    assert not list(folder.iterdir())
