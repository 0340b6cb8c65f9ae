"""Builds that are broken off: what is done of them is not done again, and what cannot be done leaves nothing."""

import os
from functools import partial
from pathlib import Path

import pytest

from sgnlp.base import toolchain, workshop
from sgnlp.base.errors import SolverError

COMPILER = """
for word; do [ "$before" = -o ] && made="$word"; before="$word"; done
echo "$made" >> "{log}"
[ "$made" = "{bad}.o.part" ] && { echo 'error: bad' >&2; exit 1; }
echo "$made" > "$made"
"""


@pytest.fixture
def log(tmp_path, monkeypatch) -> Path:
    """Where a compiler that needs no source writes what it is asked for; it fails at `bad.c`."""
    script = tmp_path / "cc"
    text = COMPILER.replace("{log}", str(tmp_path / "log")).replace("{bad}", "bad")
    script.write_text(f"#!/bin/sh\n{text}", encoding="utf-8")
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))
    return tmp_path / "log"


def made(log: Path) -> list[str]:
    """What was compiled and linked since the last call."""
    lines = log.read_text(encoding="utf-8").split() if log.exists() else []
    log.unlink(missing_ok=True)
    return [line.removesuffix(".o.part") for line in lines]


class Parts(dict):
    """Parts of a library, that note which of them were made; Ctrl-C comes when the one that is named is."""

    def __init__(self, names: str, broken: str = "", file: str = "{}{}"):
        self.asked: list[str] = []
        super().__init__({name: partial(self._make, name, name == broken, file) for name in names.split()})

    def _make(self, name, broken, file):
        if broken:
            raise KeyboardInterrupt
        self.asked.append(name)
        return {file.format(name, i) + ".c": name for i in range(2)}


def build(target: Path, parts: Parts, progress=lambda done, total: None) -> None:
    workshop.build(target, parts, lambda: b"note", (), progress=progress)


def test_a_build_that_was_broken_off_goes_on_where_it_was(tmp_path, log):
    target = tmp_path / "cache" / "f.so"
    with pytest.raises(KeyboardInterrupt):
        build(target, Parts("a b c", broken="b"))
    assert workshop.done(target) == 0
    (workshop.place(target) / "b0.c").write_text("half", encoding="utf-8")

    def stop(done, total):
        assert total == 6
        raise KeyboardInterrupt

    parts = Parts("a b c")
    with pytest.raises(KeyboardInterrupt):
        build(target, parts, stop)
    assert parts.asked == ["b", "c"]
    before = made(log)
    assert workshop.done(target) == len(before) / 6 > 0
    assert not target.exists()
    (workshop.place(target) / "c1.o.part").write_bytes(b"half")
    parts = Parts("a b c")
    build(target, parts)
    after = made(log)
    assert parts.asked == []
    assert sorted([*before, *after]) == ["a0", "a1", "b0", "b1", "c0", "c1", "f.so"]
    assert toolchain.note_of(target) == b"note"
    assert os.listdir(target.parent) == ["f.so"]


def test_a_compiler_that_fails_leaves_nothing_to_go_on_with(tmp_path, log):
    target = tmp_path / "cache" / "f.so"
    with pytest.raises(SolverError, match="error: bad"):
        build(target, Parts("a bad", file="{}"))
    assert not os.listdir(target.parent)


def test_builds_of_long_ago_are_forgotten(tmp_path, log):
    old, new = (workshop.place(tmp_path / name) for name in ("old.so", "new.so"))
    for folder in (old, new):
        folder.mkdir()
    os.utime(old, (1e9, 1e9))
    build(tmp_path / "f.so", Parts("a"))
    assert new.exists()
    assert not old.exists()
