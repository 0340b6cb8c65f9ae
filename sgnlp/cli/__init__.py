"""The command line. Only this package prints."""

import argparse
import sys
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.text import Text

from sgnlp import __version__
from sgnlp.cli import codes
from sgnlp.cli.batch import Batch
from sgnlp.cli.benchmark import Benchmark
from sgnlp.cli.cache import Cache
from sgnlp.cli.info import Doctor, Hands
from sgnlp.cli.solve import Solve
from sgnlp.cli.study import Study
from sgnlp.errors import SgnlpError
from sgnlp.settings import PRESETS, Settings, preset


def _commands(settings: Settings, name: str) -> Any:
    """The subcommands, `solve` beginning with the settings of a preset."""
    default = Solve(file=tyro.MISSING, preset=name, settings=settings)
    batch = Batch(files=tyro.MISSING, preset=name, settings=settings)
    study = Study(name=tyro.MISSING, files=tyro.MISSING, preset=name, settings=settings)
    return (
        Annotated[Solve, tyro.conf.subcommand("solve", default=default)]
        | Annotated[Batch, tyro.conf.subcommand("batch", default=batch)]
        | Annotated[Hands, tyro.conf.subcommand("hands")]
        | Annotated[Study, tyro.conf.subcommand("study", default=study)]
        | Annotated[Benchmark, tyro.conf.subcommand("benchmark", default=Benchmark(preset=name, settings=settings))]
        | Annotated[Cache, tyro.conf.subcommand("cache", default=Cache(preset=name, settings=settings))]
        | Annotated[Doctor, tyro.conf.subcommand("doctor")]
    )


def _preset(arguments: list[str]) -> str:
    """The value of --preset, which decides the defaults of the other flags."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--preset", default="robust")
    return str(parser.parse_known_args(arguments)[0].preset)


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the command `sgnlp`."""
    sys.exit(run(sys.argv[1:] if arguments is None else arguments))


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code."""
    console, errors = _console(), _console(stderr=True)
    if arguments == ["--version"]:
        console.print(__version__)
        return 0
    try:
        name = _preset(arguments)
        command = tyro.cli(_commands(preset(name), name), args=arguments, prog="sgnlp", description=_about())
        return int(command.run(console))
    except SgnlpError as error:
        errors.print(Text.assemble(("error:", "red"), f" {error}"), soft_wrap=True)
        return codes.BAD_INPUT
    except KeyboardInterrupt:
        errors.print("interrupted")
        return codes.INTERRUPTED
    except SystemExit as exit_:
        return codes.USAGE if exit_.code not in (0, None) else 0


def _console(stderr: bool = False) -> Console:
    """A console that takes brackets for what they are: those of units, arrays and file names."""
    return Console(stderr=stderr, markup=False, emoji=False, highlight=False)


def _about() -> str:
    return f"Compliant dexterous pregrasps under shape uncertainty. Presets: {', '.join(sorted(PRESETS))}."
