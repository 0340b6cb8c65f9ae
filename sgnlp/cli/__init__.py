"""The command line. Only this room and the commands of `experiments` print.

Flags and files come in, printed tables and written files go out. It imports from all rooms before it, and finds the
commands of `experiments` by name.

A command's module is imported when the command is called, and only its flags are parsed: importing all commands takes
a quarter of a second.
"""

import argparse
import gc
import operator
import sys
import traceback
from functools import reduce
from importlib import import_module
from itertools import pairwise
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.text import Text

from sgnlp import __version__
from sgnlp.base.errors import InputError, MachineError, SgnlpError, gives_out
from sgnlp.base.presets import PRESETS, VARIANTS
from sgnlp.cli import codes, interrupts, streams
from sgnlp.cli.parsing import parsed, texts_joined

COMMANDS = {
    "solve": "sgnlp.cli",
    "batch": "sgnlp.cli",
    "simulate": "sgnlp.cli",
    "view": "sgnlp.cli",
    "report": "sgnlp.cli",
    "cloud": "sgnlp.cli",
    "observe": "sgnlp.cli",
    "hands": "sgnlp.cli",
    "arms": "sgnlp.cli",
    "draft-hand": "sgnlp.cli",
    "check-hand": "sgnlp.cli",
    "study": "sgnlp.experiments.cli",
    "compare": "sgnlp.experiments.cli",
    "solvers": "sgnlp.experiments.cli",
    "benchmark": "sgnlp.experiments.cli",
    "export": "sgnlp.experiments.cli",
    "cache": "sgnlp.cli",
    "doctor": "sgnlp.cli",
}
"""The commands and the packages that hold them: `a-name` is the class `AName` of the module `a_name`."""


def command(name: str) -> Any:
    """The class of a command."""
    return getattr(import_module(f"{COMMANDS[name]}.{name.replace('-', '_')}"), name.title().replace("-", ""))


def _parsed(arguments: list[str]) -> Any:
    """The command in the arguments, parsed; commands that plan take their defaults from the preset."""
    beginning = import_module("sgnlp.cli.flags").beginning  # which imports all that plans
    for flag, value in pairwise(["", *arguments]):
        if not value:  # of a variable of the shell that is not set; as a path it would be the current folder
            raise InputError(f"{flag if flag.startswith('-') else 'an argument'} is empty")
    preset = _preset(arguments)
    if arguments and arguments[0] in COMMANDS:
        chosen, prog = command(arguments[0]), f"sgnlp {arguments[0]}"
        return parsed(chosen, arguments[1:], prog, beginning(chosen, preset))
    all_ = [(command(name), name) for name in COMMANDS]
    each = [Annotated[c, tyro.conf.subcommand(name, default=beginning(c, preset))] for c, name in all_]
    any_: Any = reduce(operator.or_, each)
    with texts_joined():
        return tyro.cli(any_, args=arguments, prog="sgnlp", description=_about())


def _preset(arguments: list[str]) -> str:
    """The value of --preset, which decides the defaults of the other flags."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--preset", default="robust")
    return str(parser.parse_known_args(arguments)[0].preset)


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the command `sgnlp`.

    The garbage collector skips all imported objects, and everything at the end, which saves a tenth of a second.
    """
    streams.steady()
    gc.disable()
    code = run(sys.argv[1:] if arguments is None else arguments)
    if code == codes.INTERRUPTED:
        interrupts.silence()
    gc.freeze()
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code."""
    console, errors = _Console(), _Console(stderr=True)
    with interrupts.listening():
        try:
            return _command(arguments, console)
        except BaseException as error:
            code, text = _told(error)
            try:
                if text:
                    errors.print(text, soft_wrap=True)
            except OSError:  # nobody reads stderr
                streams.lost(sys.stderr)
            if code is None:
                raise
            return code


def _command(arguments: list[str], console: Console) -> int:
    if arguments == ["--version"]:
        console.print(__version__)
        return 0
    try:
        asked = _parsed(arguments)
        if not gc.isenabled():  # by `main`
            gc.freeze()
            gc.enable()
        return int(asked.run(console))
    finally:
        interrupts.check()
        _flush()


def _flush() -> None:
    """Flush the output while an error can still be reported."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError as error:
        streams.lost(sys.stdout)
        if isinstance(error, BrokenPipeError):
            raise
        raise MachineError(f"the output cannot be written: {error.strerror}") from None


def _told(error: BaseException) -> tuple[int | None, Text | str]:
    """The exit code and the message of an error. A bug has no code (None): its traceback is shown."""

    def line(text: object) -> Text:
        return Text.assemble(("error:", "red"), f" {text}")

    if isinstance(error, SystemExit):
        return (codes.USAGE if error.code not in (0, None) else 0), ""
    if isinstance(error, KeyboardInterrupt):
        return codes.INTERRUPTED, "interrupted"
    if isinstance(error, BrokenPipeError):
        streams.lost(sys.stdout)
        return codes.BROKEN_PIPE, ""
    if isinstance(error, MachineError):
        return codes.MACHINE, line(error)
    if isinstance(error, SgnlpError):
        return codes.BAD_INPUT, line(f"{error}{_own_line(error)}")
    if isinstance(error, OSError):
        where = f"'{error.filename}': " if error.filename else ""
        said = error.strerror or str(error) or type(error).__name__
        return (codes.MACHINE if gives_out(error) else codes.BAD_INPUT), line(where + said)
    if isinstance(error, MemoryError) or "bad_alloc" in str(error):
        return codes.MACHINE, line("out of memory; raise the limit (ulimit -v), or use fewer --jobs")
    if isinstance(error, RuntimeError) and "start new thread" in str(error):
        return codes.MACHINE, line("no more processes can be started; raise the limit (ulimit -u)")
    return None, ""


def _own_line(error: BaseException) -> str:
    """The line of a file of --with in which an error began, in brackets; "" if it began elsewhere."""
    frames = traceback.walk_tb(error.__context__.__traceback__ if error.__context__ else None)
    own = [
        f" ({frame.f_code.co_filename}, line {number})"
        for frame, number in frames
        if str(frame.f_globals.get("__name__")).startswith("sgnlp_extension_")
    ]
    return own[-1] if own else ""


class _Console(Console):
    """A console that prints brackets as they are, and lets `run` handle a closed pipe."""

    def __init__(self, stderr: bool = False):
        super().__init__(stderr=stderr, markup=False, emoji=False, highlight=False)

    def render_str(self, text: str, **options: Any) -> Text:
        """The text, with characters that the output cannot encode replaced."""
        return super().render_str(streams.plain(text, self.encoding), **options)

    def on_broken_pipe(self) -> None:
        """Do nothing here, where Rich would end the process."""
        raise


def _about() -> str:
    bases = ", ".join(name for name in PRESETS if name not in VARIANTS)
    text = "Compliant dexterous pregrasps under shape uncertainty."
    return f"{text} Presets: {bases}. Variants of them, as paper+NAME, or NAME of robust: {', '.join(VARIANTS)}."
