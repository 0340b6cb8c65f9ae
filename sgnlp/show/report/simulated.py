"""What a simulation of the planned grasps gave, as a section of a report."""

from collections.abc import Mapping
from typing import Any

from sgnlp.show.report.content import Figure, Section
from sgnlp.show.sheets import Sheet


def simulated(found: Mapping[str, Any], pictures: Mapping[str, bytes]) -> Section:
    """The outcomes of `simulation.json`, and the pictures beside it as PNG by name."""
    settings = found["settings"]
    load = f"{settings['mass']:g} kg, friction {settings['friction']:g}"
    said = (
        f"Carried out in MuJoCo on the true object of {found['object']}, {load}.",
        "Lengths in mm; moved is the object's motion before the last pad touched.",
    )
    heads = ("grasp", "ending", "score", "strict", "rise", "slip", "pushes held", "moved", "off plan")
    rows = [heads, *(_row(grasp) for grasp in found["grasps"])]
    figures = tuple(Figure(name, f"Grasp 0, end of {_phase(name)}.", {"png": png}) for name, png in pictures.items())
    return Section("Simulation", said, sheets=(Sheet("", tuple(rows)),), figures=figures)


def _phase(name: str) -> str:
    return name.rpartition("-")[2]


def _row(grasp: Mapping[str, Any]) -> tuple[str, ...]:
    closing, lift, pushes = grasp["closing"], grasp["lift"], grasp["pushes"]
    return (
        str(grasp["rank"]),
        grasp["ending"],
        f"{grasp['score']:g}",
        f"{grasp['score_strict']:g}",
        _mm(lift and lift["rise"]),
        _mm(lift and max(lift["slip"])),
        f"{sum(push['held'] for push in pushes)} of {len(pushes)}" if pushes else "",
        _mm(closing and closing["shift_before_contact"]),
        _mm(closing and closing["shift_error"]),
    )


def _mm(length: float | None) -> str:
    return "" if length is None else f"{1e3 * length:.1f}"
