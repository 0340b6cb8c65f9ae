"""Writes the functions of a program as bytes and reads them: same instructions in the same order, so the same bits."""

import json

import casadi as ca

from sgnlp.program.nlp import FUNCTIONS, Nlp


def written(nlp: Nlp) -> bytes:
    """The functions of a program and the sizes of its rows: dozens of megabytes, which compress well."""
    serialiser = ca.StringSerializer()
    serialiser.pack([getattr(nlp, name) for name in FUNCTIONS])
    return f"{json.dumps(nlp.row_sizes)}\n{serialiser.encode()}".encode()


def read(content: bytes) -> tuple[tuple[int, ...], dict[str, ca.Function]] | None:
    """The sizes of the rows and the functions by name; None if this CasADi cannot read them."""
    try:
        sizes, _, text = content.decode().partition("\n")
        functions = ca.StringDeserializer(text).unpack()
        return tuple(json.loads(sizes)), dict(zip(FUNCTIONS, functions, strict=True))
    except (ValueError, RuntimeError):
        return None
