"""Reads the XML of a URDF or an MJCF; refuses other files, and xacro that is not expanded."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from sgnlp.base.errors import InputError

INCLUDES = ("include", "model")
"""The elements of an MJCF that include another file."""


def read_xml(file: Path) -> ElementTree.Element:
    """The root element, <robot> of a URDF or <mujoco> of an MJCF.

    Raises:
        InputError: it cannot be read, has another root, or is xacro that is not expanded.
    """
    expand = f"expand it (pip install xacro; xacro {file.name} -o expanded.urdf) and name the result in the hand's file"
    try:
        robot = ElementTree.parse(file).getroot()
    except OSError as error:
        raise InputError(f"{file.name} cannot be read: {error.strerror}") from None
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        if "unbound prefix" in str(error) and b"xacro:" in file.read_bytes():
            raise InputError(f"{file.name} is xacro; {expand}") from None
        if "invalid token" in str(error) and not _is_utf8(file):
            raise InputError(
                f"{file.name} is not UTF-8; give a URDF or MJCF, save it so, or declare its encoding in <?xml ?>"
            ) from None
        raise InputError(f"{file.name} is no URDF that can be read: {' '.join(str(error).split())}") from None
    for element in robot.iter():
        texts = [element.tag, *element.attrib.values(), element.text or ""]
        left = next((text for text in texts if "xacro}" in text or "${" in text or "$(" in text), None)
        if left is not None:
            shown = f"<xacro:{left.rpartition('}')[2]}>" if "xacro}" in left else f"'{left.strip()}'"
            raise InputError(f"{file.name} is xacro, it has {shown}; {expand}")
    if robot.tag not in ("robot", "mujoco"):
        raise InputError(f"{file.name} is no URDF that can be read: its root is <{robot.tag}>, not <robot> or <mujoco>")
    return robot


def content(file: Path) -> bytes:
    """The content of a description: the bytes of its file, and of all files that an MJCF includes."""
    found = {file: file.read_bytes()}
    unread = [file]
    while unread:
        for part in ElementTree.fromstring(found[unread.pop()]).iter():
            # MuJoCo searches beside the first file, whichever file includes it
            named = file.parent / part.get("file", "")
            if part.tag in INCLUDES and named.is_file() and named not in found:
                found[named] = named.read_bytes()
                unread.append(named)
    return b"\0".join(found.values())


def _is_utf8(file: Path) -> bool:
    try:
        file.read_bytes().decode()
    except UnicodeDecodeError:
        return False
    return True
