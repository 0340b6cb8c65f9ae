"""Descriptions of made-up hands whose palm, tips, pads and ways of closing are known."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

PROXIMAL, DISTAL, RADIUS = 0.05, 0.04, 0.008
"""Lengths of the two links of a finger and the radius of its capsules [m]; the pad is the ball at the end."""
LIMITS = "-0.1 1.5"


def _capsule(length: float) -> str:
    """A cylinder along z from the origin with a ball at its end."""
    solids = (
        (f'<cylinder radius="{RADIUS}" length="{length}"/>', length / 2),
        (f'<sphere radius="{RADIUS}"/>', length),
    )
    return "".join(f'<visual><origin xyz="0 0 {z}"/><geometry>{solid}</geometry></visual>' for solid, z in solids)


def finger(name: str, parent: str, xyz: Iterable[float], rpy: Iterable[float], limits: str = LIMITS) -> str:
    """Two links along z that bend towards +x."""
    low, high = limits.split()
    limit = f'<limit lower="{low}" upper="{high}" effort="0.5" velocity="1"/>'
    place = f'<origin xyz="{" ".join(map(str, xyz))}" rpy="{" ".join(map(str, rpy))}"/>'
    return f"""
    <joint name="{name}_flex" type="revolute"><parent link="{parent}"/><child link="{name}_proximal"/>
      {place}<axis xyz="0 1 0"/>{limit}</joint>
    <link name="{name}_proximal">{_capsule(PROXIMAL)}</link>
    <joint name="{name}_bend" type="revolute"><parent link="{name}_proximal"/><child link="{name}_distal"/>
      <origin xyz="0 0 {PROXIMAL}"/><axis xyz="0 1 0"/>{limit}</joint>
    <link name="{name}_distal">{_capsule(DISTAL)}</link>"""


def _written(folder: Path, name: str, parts: Iterable[str]) -> Path:
    file = folder / f"{name}.urdf"
    file.write_text(f'<robot name="{name}">{"".join(parts)}</robot>', encoding="utf-8")
    return file


def radial(folder: Path, count: int = 3, mounted: bool = False, hands: int = 1) -> Path:
    """Fingers around a flat palm that looks along z and bend to its axis; `mounted`: on an arm of two joints."""
    arm = """<link name="world"/><link name="upper"/>
    <joint name="fix" type="fixed"><parent link="world"/><child link="upper"/></joint>
    <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="1 0 0"/>
      <limit lower="-1" upper="1" effort="9" velocity="1"/></joint><link name="lower"/>"""
    parts = [arm if mounted else ""]
    for hand in range(hands):
        tail = f"_{hand}" if hand else ""
        if mounted:
            parts.append(f"""<joint name="wrist{tail}" type="revolute"><origin xyz="{hand} 0 0.3"/><axis xyz="0 1 0"/>
            <parent link="lower"/><child link="palm{tail}"/>
            <limit lower="-1" upper="1" effort="9" velocity="1"/></joint>""")
        solid = '<geometry><cylinder radius="0.045" length="0.02"/></geometry>'
        parts.append(f'<link name="palm{tail}"><visual>{solid}</visual></link>')
        for i in range(count):
            angle = 2 * np.pi * i / count
            xyz = (-0.04 * np.cos(angle), -0.04 * np.sin(angle), 0.01)
            parts.append(finger(f"f{i}{tail}", f"palm{tail}", xyz, (0, 0, angle)))
    return _written(folder, "radial", parts)


def row(folder: Path, words: tuple[str, ...] = ("index", "middle", "ring", "little", "thumb")) -> Path:
    """Fingers in a row along y that point along z and bend to x, and a thumb in front of the row that opposes it."""
    *others, thumb = words
    parts = ['<link name="palm"><visual><geometry><box size="0.03 0.1 0.08"/></geometry></visual></link>']
    for i, name in enumerate(others):
        parts.append(finger(name, "palm", (0, 0.036 - 0.024 * i, 0.04), (0, 0, 0)))
    parts.append(finger(thumb, "palm", (0.1, 0.012, 0.02), (0, 0, np.pi)))
    return _written(folder, "row", parts)
