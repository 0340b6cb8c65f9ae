"""A URDF as a tree of XML, refused where it is none, or xacro that nobody expanded."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from sgnlp.base.errors import InputError


def read_urdf(urdf: Path) -> ElementTree.Element:
    """The root element; refused where it is none of a URDF, or xacro that nobody expanded."""
    expand = f"expand it (pip install xacro; xacro {urdf.name} -o expanded.urdf) and name the result in the hand's file"
    try:
        robot = ElementTree.parse(urdf).getroot()
    except OSError as error:
        raise InputError(f"{urdf.name} cannot be read: {error.strerror}") from None
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        if "unbound prefix" in str(error) and b"xacro:" in urdf.read_bytes():
            raise InputError(f"{urdf.name} is xacro; {expand}") from None
        if "invalid token" in str(error) and not _is_utf8(urdf):
            raise InputError(f"{urdf.name} is not UTF-8; save it so, or declare its encoding in <?xml ?>") from None
        raise InputError(f"{urdf.name} is no URDF that can be read: {' '.join(str(error).split())}") from None
    for element in robot.iter():
        texts = [element.tag, *element.attrib.values(), element.text or ""]
        left = next((text for text in texts if "xacro}" in text or "${" in text or "$(" in text), None)
        if left is not None:
            shown = f"<xacro:{left.rpartition('}')[2]}>" if "xacro}" in left else f"'{left.strip()}'"
            raise InputError(f"{urdf.name} is xacro, it has {shown}; {expand}")
    if robot.tag != "robot":
        raise InputError(f"{urdf.name} is no URDF that can be read: its root is <{robot.tag}>, not <robot>")
    return robot


def _is_utf8(file: Path) -> bool:
    try:
        file.read_bytes().decode()
    except UnicodeDecodeError:
        return False
    return True
