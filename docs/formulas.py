"""Formulas of TeX as MathML, with names of several letters in one element: `argmin`, `tr`, `det`, upright and close.

The converter sets each letter of `\\mathrm` as a variable of its own, between which browsers leave the space of a
product; and it knows neither spaces within `\\operatorname` nor all of TeX's names of functions.
"""

import re
from itertools import pairwise
from xml.etree import ElementTree as ET

from latex2mathml.converter import convert

UNKNOWN = ("arg", "injlim", "projlim")
"""TeX's names of functions that the converter does not know."""
THIN = "0.167em"
"""TeX's space between a name and what it is applied to."""
OPENING = {"(", "[", "{", "|", "‖", "⟨"}
BELOW = {"argmin", "argmax", "min", "max", "lim", "inf", "sup"}
"""Names whose scripts stand below them in a formula of its own."""
LIMITS = {"msub": "munder", "msup": "mover", "msubsup": "munderover"}
PREFIX = "{http://www.w3.org/1998/Math/MathML}"
SPACED = {f"{PREFIX}mo", f"{PREFIX}mspace", f"{PREFIX}mtext"}
"""Elements that have a space of their own."""


def mathml(tex: str, display: str) -> str:
    """The formula as MathML; `display` is block or inline."""
    ET.register_namespace("", PREFIX[1:-1])
    root = ET.fromstring(convert(prepared(tex), display=display))
    for parent in list(root.iter()):
        _join(parent)
    for parent in list(root.iter()):
        _limit(parent, display)
    for parent in list(root.iter()):
        _space(parent)
    return ET.tostring(root, encoding="unicode")


def prepared(tex: str) -> str:
    """TeX with the names that the converter would take apart as operators of one word, or of two."""
    tex = re.sub(r"\\arg\s*(?:\\[,;!:])?\s*\\(min|max)(?![a-zA-Z])", r"\\operatorname*{arg \1}", tex)
    tex = re.sub(rf"\\({'|'.join(UNKNOWN)})(?![a-zA-Z])", r"\\operatorname{\1}", tex)
    return re.sub(r"(\\operatorname\*?)\s*\{([^}]*)\}", _plain, tex)


def _plain(found: re.Match[str]) -> str:
    words = re.sub(r"\\(?:mathrm|text)\b|\\[,;:! ]|[~{]", " ", found[2]).split()
    return f"{found[1]}{{{' '.join(words)}}}"


def _is_letter(element: ET.Element) -> bool:
    """Whether it is an upright letter, as `\\mathrm` gives one by one."""
    return element.tag == f"{PREFIX}mi" and element.get("mathvariant") == "normal" and len(element.text or "") == 1


def _join(parent: ET.Element) -> None:
    """Upright letters beside each other as one name; browsers set a name of several letters upright by themselves."""
    kept: list[ET.Element] = []
    for child in list(parent):
        if kept and parent.tag == f"{PREFIX}mrow" and _is_letter(child) and kept[-1].get("class") == "letters":
            kept[-1].text = f"{kept[-1].text}{child.text}"
            parent.remove(child)
            continue
        if _is_letter(child):
            child.set("class", "letters")
        kept.append(child)
    for child in kept:
        if child.attrib.pop("class", "") and len(child.text or "") > 1:
            child.attrib.pop("mathvariant")


def _limit(parent: ET.Element, display: str) -> None:
    """Scripts of `BELOW` stand where they belong in a formula of its own."""
    name = parent.tag.removeprefix(PREFIX)
    if display == "block" and name in LIMITS and parent[0].text in BELOW:
        parent.tag = PREFIX + LIMITS[name]


def _name(element: ET.Element) -> bool:
    """Whether it is a name of a function, perhaps with scripts."""
    while element.tag.removeprefix(PREFIX) in {*LIMITS, *LIMITS.values()} or (
        element.tag == f"{PREFIX}mrow" and len(element) == 1
    ):
        element = element[0]
    letters = (element.text or "").replace(" ", "")
    return (
        element.tag in {f"{PREFIX}mi", f"{PREFIX}mo"} and len(letters) > 1 and letters.isascii() and letters.isalpha()
    )


def _space(parent: ET.Element) -> None:
    """TeX's thin spaces around names in a row: not before an opening bracket, and none of the browser's own."""
    if parent.tag == f"{PREFIX}mo" and _name(parent):
        parent.set("lspace", "0")
        parent.set("rspace", "0")
    if parent.tag not in {f"{PREFIX}mrow", f"{PREFIX}math", f"{PREFIX}mtd"}:
        return
    children = list(parent)
    for before, after in reversed(list(pairwise(children))):
        applied = _name(before) and (after.tag not in SPACED or _name(after)) and not _opens(after)
        follows = _name(after) and before.tag.removeprefix(PREFIX) in {"mi", "mn", *LIMITS}
        if applied or follows:
            parent.insert(list(parent).index(after), ET.Element(f"{PREFIX}mspace", width=THIN))


def _opens(element: ET.Element) -> bool:
    """Whether it begins with a bracket."""
    first = next((e for e in element.iter() if e.tag == f"{PREFIX}mo" or (e.text or "").strip()), element)
    return (first.text or "").strip() in OPENING
