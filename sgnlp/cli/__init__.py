"""The command line. Only this package prints."""

import argparse
import operator
import sys
from functools import reduce
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.text import Text

from sgnlp import __version__
from sgnlp.cli import codes, interrupts
from sgnlp.cli.batch import Batch
from sgnlp.cli.benchmark import Benchmark
from sgnlp.cli.cache import Cache
from sgnlp.cli.flags import beginning
from sgnlp.cli.info import Doctor, Hands
from sgnlp.cli.observe import Observe
from sgnlp.cli.simulate import Simulate
from sgnlp.cli.solve import Solve
from sgnlp.cli.study import Study
from sgnlp.cli.view import View
from sgnlp.errors import SgnlpError
from sgnlp.settings import PRESETS, VARIANTS

COMMANDS = (Solve, Batch, Simulate, View, Observe, Hands, Study, Benchmark, Cache, Doctor)


def _commands(name: str) -> Any:
    """The subcommands, those that plan beginning with the settings of a preset."""
    return reduce(
        operator.or_,
        (
            Annotated[command, tyro.conf.subcommand(command.__name__.lower(), default=beginning(command, name))]
            for command in COMMANDS
        ),
    )


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
    console, errors = _console(), _console(stderr=True)
    if arguments == ["--version"]:
        console.print(__version__)
        return 0
    with interrupts.listening():
        try:
            return _command(arguments, console)
        except SgnlpError as error:
            errors.print(Text.assemble(("error:", "red"), f" {error}"), soft_wrap=True)
            return codes.BAD_INPUT
        except KeyboardInterrupt:
            errors.print("interrupted")
            return codes.INTERRUPTED
        except SystemExit as exit_:
            return codes.USAGE if exit_.code not in (0, None) else 0


def _command(arguments: list[str], console: Console) -> int:
    try:
        command = tyro.cli(_commands(_preset(arguments)), args=arguments, prog="sgnlp", description=_about())
        return int(command.run(console))
    finally:
        interrupts.check()


def _console(stderr: bool = False) -> Console:
    """A console that takes brackets for what they are: those of units, arrays and file names."""
    return Console(stderr=stderr, markup=False, emoji=False, highlight=False)


def _about() -> str:
    bases = ", ".join(name for name in PRESETS if name not in VARIANTS)
    text = "Compliant dexterous pregrasps under shape uncertainty."
    return f"{text} Presets: {bases}. Variants of them, as paper+NAME, or NAME of robust: {', '.join(VARIANTS)}."
