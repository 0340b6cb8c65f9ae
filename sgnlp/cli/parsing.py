"""A command from its arguments, by tyro.

Tyro builds a parser of all flags for every call: a command that plans has 150 of them, two thirds of which are settings
in sections, and most calls name none or one of the sections. The others are left out, which takes half of the time. A
call for help, and arguments that are refused, are parsed with all flags. Only these messages reach the user.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import fields, is_dataclass
from functools import partial
from io import StringIO
from typing import Any, TypeVar, get_type_hints

import docstring_parser
import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from sgnlp.base.settings import Settings

Command = TypeVar("Command")
WRAPPED = re.compile(r"[ \t]*\n[ \t]+(?=\S)")
"""The end of a line of a flag's text, where the source goes on in the next line."""
HELPFUL = ("-h", "--help", "--tyro")
"""How arguments begin that ask about all flags: for help, or for the completions of a shell."""


def parsed(command: type[Command], arguments: Sequence[str], prog: str, default: Command) -> Command:
    """The command with its flags; a `SystemExit`, after tyro has told why, if they are not valid."""
    with texts_joined():
        return _parsed(partial(tyro.cli, command, args=arguments, prog=prog, default=default), command, arguments)


def _parsed(parse: Callable[..., Command], command: type[Command], arguments: Sequence[str]) -> Command:
    if not any(argument.startswith(HELPFUL) for argument in arguments):
        registry, no_comments = _without_sections(command, arguments), tyro.conf.HelptextFromCommentsOff
        try:
            with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
                return parse(registry=registry, config=(no_comments,))
        except SystemExit:
            pass
    return parse()


@contextmanager
def texts_joined() -> Iterator[None]:
    """The text of a flag is one paragraph, which the terminal folds: Tyro breaks it where the source does."""
    whole = docstring_parser.parse_from_object

    def joined(*documented: Any, **style: Any) -> docstring_parser.Docstring:
        text = whole(*documented, **style)
        for flag in text.params:
            flag.description = flag.description and WRAPPED.sub(" ", flag.description)
        return text

    docstring_parser.parse_from_object = joined
    try:
        yield
    finally:
        docstring_parser.parse_from_object = whole


def _without_sections(command: Any, arguments: Sequence[str]) -> ConstructorRegistry:
    """A registry by which a section that no argument names, nor a flag of the command, stays as it is by default."""
    said, registry = " ".join(arguments).replace("-", "_"), ConstructorRegistry()
    kinds = {name: kind for name, kind in get_type_hints(Settings).items() if is_dataclass(kind)}
    taken = {flag.name for flag in fields(command)}
    unnamed = {kind: _fixed(kind) for name, kind in kinds.items() if name not in said and name not in taken}

    @registry.primitive_rule
    def section(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
        return unnamed.get(info.type)

    return registry


def _fixed(kind: Any) -> PrimitiveConstructorSpec[Any]:
    """Of a section as a whole: there is no text for it."""

    def refuse(words: list[str]) -> Any:
        raise ValueError(words)

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="",
        instance_from_str=refuse,
        is_instance=lambda value: isinstance(value, kind),
        str_from_instance=lambda value: [""],
    )
