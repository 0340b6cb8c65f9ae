"""Output that cannot show a character, is closed, full or narrow: a command goes on, and no number is cut."""

import errno
import io
import os
import subprocess
import sys

import pytest
from plans import small_plan
from processes import COMMAND

from sgnlp import cli
from sgnlp.base.errors import MachineError
from sgnlp.cli import codes, streams
from sgnlp.show import tables as report
from sgnlp.show.columns import Table


def printed(encoding: str, *objects: object, width: int = 80) -> bytes:
    """The bytes that the console sends to a stream of an encoding."""
    streams.steady()
    raw = io.BytesIO()
    console = cli._Console()
    console.file, console.width = io.TextIOWrapper(raw, encoding, errors=streams.HANDLER), width
    for thing in objects:
        console.print(thing)
    console.file.flush()
    return raw.getvalue()


def test_a_sign_that_cannot_be_encoded_has_a_stand_in_and_the_table_stays_straight():
    table = Table("Title", "ρ [N m]", "±σ")
    table.add_row("0.123", "1 … 2")
    lines = printed("ascii", table).decode("ascii").splitlines()
    assert lines[1].split() == ["rho", "[N", "m]", "+-sigma"]
    assert len({len(line.rstrip()) for line in lines[1:]}) == 1
    assert "ρ" in printed("utf-8", table).decode()
    assert printed("latin-1", "µ ± σ ☃") == "µ ± sigma ?\n".encode("latin-1")


def test_a_byte_of_a_name_that_is_no_text_is_itself_again():
    for encoding in ("ascii", "utf-8"):
        assert printed(encoding, os.fsdecode(b"\xff.npz")) == b"\xff.npz\n"


@pytest.mark.parametrize("width", [20, 30, 40, 60, 79, 80, 200])
def test_no_number_or_word_is_cut_at_any_width(width):
    plan = small_plan()
    tables = report.tables(plan, plan.summary())
    for table in tables:
        words = {w for c in table.columns for cell in c.cells for w in str(cell).split()}
        text = printed("utf-8", table, width=width).decode()
        assert {word for word in words if any(map(str.isdigit, word))} <= set(text.split())
        assert "…" not in text
        assert max(map(len, text.splitlines())) <= width


def test_rows_stand_below_each_other_where_the_columns_do_not_fit():
    table = Table("Title", "name", "value", "nothing")
    table.add_row("name_1", "0.123456789", "")
    lines = printed("utf-8", table, width=24).decode().splitlines()
    assert lines == ["Title", "name: name_1", "  value: 0.123456789"]


class Full(io.StringIO):
    """A stream without room."""

    def flush(self) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")


def test_output_that_finds_no_room_has_the_code_of_the_machine(monkeypatch, capfd):
    monkeypatch.setattr(sys, "stdout", Full())
    assert cli.run(["--version"]) == codes.MACHINE
    assert capfd.readouterr().err == "error: No space left on device\n"


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (MachineError("full"), codes.MACHINE, "error: full"),
        (OSError(errno.ENOSPC, "No space", "a"), codes.MACHINE, "error: 'a': No space"),
        (OSError(errno.EAGAIN, "try again"), codes.MACHINE, "error: try again"),
        (PermissionError(errno.EACCES, "denied", "a"), codes.BAD_INPUT, "error: 'a': denied"),
        (MemoryError(), codes.MACHINE, "error: out of memory"),
        (RuntimeError("std::bad_alloc"), codes.MACHINE, "error: out of memory"),
        (RuntimeError("can't start new thread"), codes.MACHINE, "error: no more processes"),
    ],
)
def test_what_the_machine_refuses_is_one_line_and_a_code(monkeypatch, capfd, error, code, said):
    def fails(arguments, console):
        raise error

    monkeypatch.setattr(cli, "_command", fails)
    assert cli.run(["hands"]) == code
    err = capfd.readouterr().err
    assert err.startswith(said)
    assert err.count("\n") == 1


def test_a_fault_of_the_program_keeps_its_traceback(monkeypatch):
    def fails(arguments, console):
        raise RuntimeError("a fault")

    monkeypatch.setattr(cli, "_command", fails)
    with pytest.raises(RuntimeError, match="a fault"):
        cli.run(["hands"])


def test_a_command_in_ascii_with_a_closed_stream_ends_well():
    for more in ("", ">&-", "2>&-", "<&-"):
        environment = os.environ | {"PYTHONIOENCODING": "ascii", "COLUMNS": "40"}
        done = subprocess.run(
            ["sh", "-c", f'"$0" -c "$1" solve --help {more}', COMMAND[0], COMMAND[2]],
            env=environment,
            capture_output=True,
            encoding="ascii",
        )
        assert (done.returncode, done.stderr) == (0, "")
