"""The tree of links and joints of a description, and the part of it below one link."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Collection

from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import unknown_name

Element = ElementTree.Element


def named(robot: Element, kind: str) -> dict[str, Element]:
    """The links or joints by name."""
    found: dict[str, Element] = {}
    for element in robot.findall(kind):
        name = element.get("name", "")
        if not name:
            raise InputError(f"a {kind} has no name; give each one its own")
        if name in found:
            raise InputError(f"two {kind}s have the name '{name}'; give each one its own")
        found[name] = element
    if kind == "link" and not found:
        raise InputError("has no link; a hand has a root link and one a joint")
    return found


def check_tree(links: Collection[str], joints: dict[str, Element]) -> None:
    """Check that the joints connect all links to one tree."""
    above: dict[str, str] = {}
    for name, joint in joints.items():
        ends = []
        for end in ("parent", "child"):
            element = joint.find(end)
            link = "" if element is None else element.get("link", "")
            if not link:
                raise InputError(f"joint '{name}' has no {end}; add <{end} link=\"...\"/>")
            if link not in links:
                raise unknown_name(f"{end} of joint '{name}'", link, links)
            ends.append(link)
        if ends[1] in above:
            raise InputError(f"link '{ends[1]}' is the child of two joints, '{name}' the second; a hand is a tree")
        above[ends[1]] = ends[0]
    roots = [link for link in links if link not in above]
    if len(roots) > 1:
        names = ", ".join(f"'{root}'" for root in roots)
        raise InputError(f"has {len(roots)} root links, {names}; join them by fixed joints, or remove the others")
    for link in links:
        line = [link]
        while line[-1] in above:
            line.append(above[line[-1]])
            if line[-1] in line[:-1]:
                raise InputError(f"the joints above link '{line[-1]}' form a circle; a hand is a tree")


def cut(robot: Element, root: str | None) -> None:
    """Reduce a tree to the link `root` and everything below it; None keeps all.

    Raises:
        InputError: the link does not exist, or a joint below it mimics one that is not below it.
    """
    links, joints = named(robot, "link"), named(robot, "joint")
    if root is None:
        return
    if root not in links:
        raise unknown_name("root", root, links)
    above = {end(joint, "child"): name for name, joint in joints.items()}

    def hangs(link: str) -> bool:
        return link == root or (link in above and hangs(end(joints[above[link]], "parent")))

    gone = [link for link in links if not hangs(link)]
    left_out = {above[link] for link in (*gone, root) if link in above}
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        if name not in left_out and mimic is not None and mimic.get("joint") in left_out:
            other = mimic.get("joint")
            raise InputError(
                f"joint '{name}' mimics '{other}', which is not below the root '{root}'; name one above both"
            )
    for link in gone:
        robot.remove(links[link])
    for name in left_out:
        robot.remove(joints[name])


def end(joint: Element, which: str) -> str:
    """The link at an end of a joint of a tree, "parent" or "child"."""
    element = joint.find(which)
    assert element is not None  # `check_tree` has checked this
    return element.get("link", "")
