"""Standard streams that accept every character and are always open, whatever the encoding and the shell."""

import codecs
import os
import sys
from typing import Any

PLAIN = {
    "ρ": "rho", "σ": "sigma", "μ": "mu", "µ": "u", "ε": "eps", "τ": "tau", "π": "pi", "Σ": "Sum", "∇": "grad",
    "√": "sqrt", "∞": "inf", "±": "+-", "≤": "<=", "≥": ">=", "≠": "!=", "≈": "~", "−": "-", "–": "-", "—": "-",
    "×": "x", "·": "*", "→": "->", "⊕": "+", "°": " deg", "²": "^2", "³": "^3", "½": "1/2", "é": "e", "…": "...",
    "‘": "'", "’": "'", "“": '"', "”": '"', "•": "*", "\u00a0": " ", "₀": "0", "ₓ": "x", "‖": "|", "ᵀ": "^T",
    "─": "-", "━": "-", "│": "|", "┃": "|", "╭": "+", "╮": "+", "╰": "+", "╯": "+", "├": "+", "└": "+",
}  # fmt: skip
"""Replacements of characters that the output cannot encode; any other becomes a question mark."""
HANDLER = "sgnlp.plain"
FRAGILE = ("strict", "surrogateescape", "backslashreplace")
"""Error handlers that would end a command, or print escape codes instead of characters."""


def plain(text: str, encoding: str) -> str:
    """A text in which characters that an encoding lacks are replaced. Call it before layout: it may grow longer."""
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        return "".join(c if _encodes(c, encoding) else _stand_in(c) for c in text)
    except LookupError:
        pass
    return text


def steady() -> None:
    """Open the streams that the shell has closed, and let no character end the command."""
    for number in (0, 1, 2):  # else the next file that is opened would receive the output of libraries
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    codecs.register_error(HANDLER, _replaced)
    for name, number in (("stdout", 1), ("stderr", 2)):
        stream: Any = getattr(sys, name)
        if stream is None:
            setattr(sys, name, os.fdopen(os.dup(number), "w", encoding="utf-8", errors=HANDLER))
        elif getattr(stream, "errors", None) in FRAGILE and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=HANDLER)


def lost(stream: Any) -> None:
    """Redirect a stream that nobody reads, or that is full, to /dev/null, so that Python's last flush succeeds."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, stream.fileno())
    except (OSError, ValueError):
        pass
    finally:
        os.close(nowhere)


def _replaced(error: UnicodeError) -> tuple[str | bytes, int]:
    """Error handler for codecs: restores the bytes of a file's name, and replaces other characters."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    character = error.object[error.start]
    if "\udc80" <= character <= "\udcff":
        return bytes([ord(character) & 0xFF]), error.start + 1
    return _stand_in(character), error.start + 1


def _stand_in(character: str) -> str:
    return character if "\udc80" <= character <= "\udcff" else PLAIN.get(character, "?")


def _encodes(character: str, encoding: str) -> bool:
    try:
        character.encode(encoding)
    except UnicodeEncodeError:
        return False
    return True
