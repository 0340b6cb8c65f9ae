"""The command line. Only this package prints.

A command's module is imported when the command is called, and its flags alone are parsed: what all of them need takes
a quarter of a second.
"""

import argparse
import operator
import os
import sys
from functools import reduce
from importlib import import_module
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.text import Text

from sgnlp import __version__
from sgnlp.cli import codes, interrupts
from sgnlp.cli.flags import beginning
from sgnlp.errors import SgnlpError
from sgnlp.presets import PRESETS, VARIANTS

COMMANDS = (
    "solve",
    "batch",
    "simulate",
    "view",
    "report",
    "cloud",
    "observe",
    "hands",
    "check-hand",
    "study",
    "compare",
    "solvers",
    "benchmark",
    "export",
    "cache",
    "doctor",
)
"""The names of the commands; a-name would be the class `AName` of `sgnlp.cli.a_name`."""


def command(name: str) -> Any:
    """The class of a command."""
    return getattr(import_module(f"sgnlp.cli.{name.replace('-', '_')}"), name.title().replace("-", ""))


def _parsed(arguments: list[str]) -> Any:
    """The command that the arguments ask for; those that plan begin with the settings of their preset."""
    preset = _preset(arguments)
    if arguments and arguments[0] in COMMANDS:
        chosen, prog = command(arguments[0]), f"sgnlp {arguments[0]}"
        return tyro.cli(chosen, args=arguments[1:], prog=prog, default=beginning(chosen, preset))
    all_ = [(command(name), name) for name in COMMANDS]
    each = [Annotated[c, tyro.conf.subcommand(name, default=beginning(c, preset))] for c, name in all_]
    any_: Any = reduce(operator.or_, each)
    return tyro.cli(any_, args=arguments, prog="sgnlp", description=_about())


def _preset(arguments: list[str]) -> str:
    """The value of --preset, which decides the defaults of the other flags."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--preset", default="robust")
    return str(parser.parse_known_args(arguments)[0].preset)


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the command `sgnlp`."""
    code = run(sys.argv[1:] if arguments is None else arguments)
    if code == codes.INTERRUPTED:
        interrupts.silence()
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code."""
    console, errors = _Console(), _Console(stderr=True)
    with interrupts.listening():
        try:
            return _command(arguments, console)
        except SgnlpError as error:
            errors.print(Text.assemble(("error:", "red"), f" {error}"), soft_wrap=True)
            return codes.BAD_INPUT
        except KeyboardInterrupt:
            errors.print("interrupted")
            return codes.INTERRUPTED
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the flush at the end of Python
            return codes.BROKEN_PIPE
        except SystemExit as exit_:
            return codes.USAGE if exit_.code not in (0, None) else 0


def _command(arguments: list[str], console: Console) -> int:
    if arguments == ["--version"]:
        console.print(__version__)
        return 0
    try:
        code = int(_parsed(arguments).run(console))
        sys.stdout.flush()
        return code
    finally:
        interrupts.check()


class _Console(Console):
    """A console that takes brackets for what they are, and lets `run` hear that nobody reads any more."""

    def __init__(self, stderr: bool = False):
        super().__init__(stderr=stderr, markup=False, emoji=False, highlight=False)

    def on_broken_pipe(self) -> None:
        """Rich would end the process."""
        raise


def _about() -> str:
    bases = ", ".join(name for name in PRESETS if name not in VARIANTS)
    text = "Compliant dexterous pregrasps under shape uncertainty."
    return f"{text} Presets: {bases}. Variants of them, as paper+NAME, or NAME of robust: {', '.join(VARIANTS)}."
