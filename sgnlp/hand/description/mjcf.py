"""Converts an MJCF to a URDF: MuJoCo compiles it, and the tree below one body is written as links and joints.

A body is a link of its name, in its own frame. With the joints 1..k, their anchors p and axes a in that frame, and
their zeros q⁰ (`ref`), MuJoCo places a body in its parent at X · ∏ T(p_j) exp(a_j (q_j − q⁰_j)) T(−p_j), from the first
joint on. So there is a link at each anchor but the last, and at that too where it is not the frame's origin.
"""

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sgnlp.base.errors import InputError
from sgnlp.base.yaml_nodes import unknown_name
from sgnlp.hand.description.mjcf_file import compiled
from sgnlp.hand.description.mjcf_geometry import show
from sgnlp.hand.description.mjcf_motors import efforts
from sgnlp.hand.description.poses import add, place, pose, words

WORLD = 0
"""MuJoCo's number of the fixed world body."""


def read_mjcf(file: Path, root: str | None) -> ElementTree.Element:
    """The tree of an MJCF below the body `root` (by default the only body in the world), as a URDF.

    Joints above the root are left out. A linear equality of two joints becomes a <mimic>. Joints that one motor moves
    by a fixed tendon stay independent; couplings in the hand's file tie them.

    Raises:
        InputError: MuJoCo is missing or cannot read the file, the body does not exist, or it has a part that a URDF
            cannot express, such as a ball joint.
    """
    spec, model = compiled(file)
    below = _below(model, _root(model, root))
    robot = ElementTree.Element("robot", name=spec.modelname or file.stem)
    inside = {joint for body in below[1:] for joint in _joints(model, body)}
    strengths = efforts(model)
    for i, body in enumerate(below):
        link = add(robot, "link", name=_name(model.body(body), "body"))
        _weigh(link, model, body)
        show(link, spec, model, body)
        if i:
            _hang(robot, model, body, strengths)
    _couple(robot, model, inside)
    _check_loops(model, set(below))
    return robot


def mjcf_bones(file: Path) -> tuple[list[str], dict[str, tuple[str, str, bool]]]:
    """The bodies of an MJCF, with the world, and by joint its parent, its child and whether it moves.

    A body with several joints hangs on the last one.
    """
    _, model = compiled(file)
    names = [_name(model.body(body), "body") for body in range(model.nbody)]
    joints = {}
    for body in range(1, model.nbody):
        moved = _joints(model, body)
        name = _name(model.joint(moved[-1]), "joint") if moved else f"{names[body]}_fixed"
        joints[name] = names[model.body_parentid[body]], names[body], bool(moved)
    return names, joints


def _root(model: Any, root: str | None) -> int:
    """The number of the body with this name; of the only one in the world if it is None."""
    names = {_name(model.body(i), "body"): i for i in range(model.nbody)}
    if root is None:
        standing = [name for name, i in names.items() if i != WORLD and model.body_parentid[i] == WORLD]
        if len(standing) != 1:
            listed = ", ".join(f"'{name}'" for name in standing)
            raise InputError(f"has {len(standing)} bodies in the world ({listed}); name that of the hand as root")
        return names[standing[0]]
    if root not in names:
        raise unknown_name("root", root, names)
    return names[root]


def _below(model: Any, root: int) -> list[int]:
    """The numbers of a body and of all bodies below it, each after its parent."""
    below = [root]
    for body in range(root + 1, model.nbody):
        if model.body_parentid[body] in below:
            below.append(body)
    return below


def _name(thing: Any, kind: str) -> str:
    """The name of a body or joint; a name from its number if it has none."""
    return str(thing.name) or f"{kind}{thing.id}"


def _joints(model: Any, body: int) -> range:
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body])) if first >= 0 else range(0)


def _weigh(link: ElementTree.Element, model: Any, body: int) -> None:
    """The mass and the inertia of a body, about its centre of mass, along its principal axes."""
    if model.body_mass[body] == 0:
        return
    inertial = add(link, "inertial")
    add(inertial, "origin", **place(pose(model.body_ipos[body], model.body_iquat[body])))
    add(inertial, "mass", value=words(model.body_mass[body]))
    moments = dict(zip(("ixx", "iyy", "izz"), map(words, model.body_inertia[body]), strict=True))
    add(inertial, "inertia", **moments, ixy="0", ixz="0", iyz="0")


def _hang(robot: ElementTree.Element, model: Any, body: int, strengths: dict[int, float]) -> None:
    """Join a body to its parent by its joints, with a link between each two of them."""
    name, parent = _name(model.body(body), "body"), _name(model.body(model.body_parentid[body]), "body")
    here = pose(model.body_pos[body], model.body_quat[body])
    joints = _joints(model, body)
    for joint in joints:
        anchor, axis = pin.SE3(np.eye(3), model.jnt_pos[joint]), model.jnt_axis[joint]
        moved = _name(model.joint(joint), "joint")
        ends_here = joint == joints[-1] and not anchor.translation.any()
        child = name if ends_here else _free(robot, model, f"{moved}_link")
        kind, zero = _kind(model, joint, moved)
        turned = _motion(kind, axis, -zero)
        made = _join(robot, moved, kind, (parent, child), here * anchor * turned)
        add(made, "axis", xyz=words(*axis))
        _limit(made, model, joint, strengths.get(joint, 0.0))
        parent, here = child, anchor.inverse()
        if child != name:
            add(robot, "link", name=child)
    if parent != name:
        _join(robot, f"{name}_fixed", "fixed", (parent, name), here)


def _join(robot: Any, name: str, kind: str, ends: tuple[str, str], origin: pin.SE3) -> ElementTree.Element:
    joint = add(robot, "joint", name=name, type=kind)
    add(joint, "parent", link=ends[0])
    add(joint, "child", link=ends[1])
    add(joint, "origin", **place(origin))
    return joint


def _free(robot: ElementTree.Element, model: Any, name: str) -> str:
    """The name, or the first similar one that no body and no link has."""
    taken = {_name(model.body(i), "body") for i in range(model.nbody)} | {x.get("name") for x in robot.iter("link")}
    while name in taken:
        name += "_"
    return name


def _kind(model: Any, joint: int, name: str) -> tuple[str, float]:
    """The URDF type of a joint, and its angle or distance in MuJoCo's reference configuration."""
    import mujoco

    kinds = {
        mujoco.mjtJoint.mjJNT_HINGE: "revolute" if model.jnt_limited[joint] else "continuous",
        mujoco.mjtJoint.mjJNT_SLIDE: "prismatic",
    }
    kind = mujoco.mjtJoint(model.jnt_type[joint])
    if kind == mujoco.mjtJoint.mjJNT_BALL:
        raise InputError(f"joint '{name}' is a ball joint; write three hinges in its place, each with a range")
    if kind not in kinds:
        raise InputError(f"joint '{name}' is free; name a body below it as root")
    return kinds[kind], float(model.qpos0[model.jnt_qposadr[joint]])


def _motion(kind: str, axis: np.ndarray, value: float) -> pin.SE3:
    """The displacement by a joint at this angle [rad] or distance [m]."""
    if kind == "prismatic":
        return pin.SE3(np.eye(3), value * axis)
    return pin.SE3(pin.exp3(value * axis), np.zeros(3))


def _limit(made: ElementTree.Element, model: Any, joint: int, effort: float) -> None:
    """Write the range of a joint and the effort of its motor [N m or N], 0 if the file gives none."""
    if model.jnt_limited[joint]:
        lower, upper = map(words, model.jnt_range[joint])
        add(made, "limit", lower=lower, upper=upper, effort=words(effort), velocity="0")
    elif effort:
        add(made, "limit", effort=words(effort), velocity="0")


def _couple(robot: ElementTree.Element, model: Any, inside: set[int]) -> None:
    """A <mimic> for each equality q₁ − q₁⁰ = c₀ + c₁ (q₂ − q₂⁰) of two joints."""
    import mujoco

    made = {joint.get("name"): joint for joint in robot.iter("joint")}
    for i in range(model.neq):
        first, second = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
        if model.eq_type[i] != mujoco.mjtEq.mjEQ_JOINT or not model.eq_active0[i] or first not in inside:
            continue
        name = _name(model.joint(first), "joint")
        if second < 0:
            raise InputError(f"an equality holds joint '{name}' where it is; leave out the joint and the equality")
        c0, c1, *higher = model.eq_data[i][:5]
        if np.any(higher):
            raise InputError(f"the equality of joint '{name}' is not linear; leave its polycoef at 'c0 c1 0 0 0'")
        zeros = [float(model.qpos0[model.jnt_qposadr[joint]]) for joint in (first, second)]
        law = {"multiplier": words(c1), "offset": words(zeros[0] + c0 - c1 * zeros[1])}
        add(made[name], "mimic", joint=_name(model.joint(second), "joint"), **law)


def _check_loops(model: Any, below: set[int]) -> None:
    """Refuse equalities that close a loop: a URDF is a tree."""
    import mujoco

    for i in range(model.neq):
        kind = mujoco.mjtEq(model.eq_type[i])
        if not model.eq_active0[i] or kind not in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            continue
        ends = [int(model.eq_obj1id[i]), int(model.eq_obj2id[i])]
        if model.eq_objtype[i] == mujoco.mjtObj.mjOBJ_SITE:
            ends = [int(model.site_bodyid[site]) for site in ends]
        if below.issuperset(ends):
            names = " and ".join(f"'{_name(model.body(end), 'body')}'" for end in ends)
            raise InputError(f"an equality ties {names}, which closes a loop; couple joints linearly in its place")
