"""The content of a report, for any kind of page: sections of sentences, tables and pictures."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.planning.approach import approaches
from sgnlp.planning.cautions import cautions, remarks
from sgnlp.planning.cautions.plans import alike
from sgnlp.planning.confidence import words
from sgnlp.planning.ending import LEFT
from sgnlp.planning.reopen import Reopened
from sgnlp.show import plots, png
from sgnlp.show.plots import Panel
from sgnlp.show.report import figures
from sgnlp.show.scene import scene
from sgnlp.show.scene_parts import Scene
from sgnlp.show.sheets import Sheet, checks, energy, fingers, joints, simulated, starts, wrist

SHOWN = 3
"""Largest number of grasps with a picture, best first; duplicates of a better grasp are skipped."""

PICTURE_WIDTH, PANEL_WIDTH = 26, 15
"""Least width of a view and of a panel on a page, if there is room [rem]."""


@dataclass(frozen=True)
class Figure:
    """A picture as files by suffix, `png` and perhaps `svg`, with what it shows.

    A page may show its `cells` instead of it, side by side or below each other as the width allows; each cell should be
    `cell_width` wide.
    """

    name: str
    caption: str
    files: Mapping[str, bytes]
    cells: tuple[Mapping[str, bytes], ...] = ()
    cell_width: int = PICTURE_WIDTH  # [rem]


@dataclass(frozen=True)
class Section:
    """Sentences, then code, tables and pictures."""

    title: str
    sentences: tuple[str, ...] = ()
    code: str = ""
    sheets: tuple[Sheet, ...] = ()
    figures: tuple[Figure, ...] = ()


@dataclass(frozen=True)
class Report:
    """A whole report."""

    title: str
    lead: str
    sections: tuple[Section, ...]


def report(
    result: Reopened,
    summary: Mapping[str, Any],
    courses: Mapping[str, NDArray[Any]],
    command: str,
    simulation: Section | None = None,
) -> Report:
    """The report of a result of at least one grasp.

    Args:
        result: the grasps, and their problem where its cloud is still there.
        summary: of the same plan, as `summary.json` has it.
        courses: the arrays of `history.npz`, iteration by iteration; empty for older results.
        command: the command that makes the result again.
        simulation: the section on a simulation of it, if there was one.

    Raises:
        InputError: Matplotlib or scikit-image is not installed.
    """
    said = [*remarks(result), *cautions(result)] or ["None: all checks passed."]
    sections = [
        Section("Cautions", tuple(said)),
        best(result),
        poses(result),
        Section("Starts, best first", sheets=(replace(starts(summary, result.grasps), title=""),)),
        numbers(result, summary),
        *([paths(result)] if result.problem is not None else []),
        *([convergence(courses)] if courses else []),
        *([simulation] if simulation else []),
        assumptions(result, summary),
        again(summary, command),
    ]
    return Report(f"Grasps of {summary['object']}", lead(summary), tuple(sections))


def lead(summary: Mapping[str, Any]) -> str:
    """The outcome in one line."""
    first = summary["starts_table"][0]
    left = sum(start.get("failure") in LEFT for start in summary["starts_table"])
    found = f"{summary['feasible']} of {summary['tried'] - left} starts feasible with {summary['hand']}"
    found += f", {left} left out" if left else ""
    kind = "best" if first["feasible"] else "least bad"
    return f"{found}; the {kind} is start {first['start']}, worst margin {first['worst_margin']:.3f}."


def best(result: Reopened) -> Section:
    """Pictures of the best grasps that differ, and a table of the best one's fingers."""
    g = result.grasps
    points = result.cloud.points if result.cloud is not None else np.zeros((0, 3))
    shown = scene(g, result.hand, result.problem, points)
    said = (
        "At first contact, from three sides: the hand at the pregrasp, the measured points, the fitted surface "
        "coloured by its deviation, and for each finger, in its colour, the contact with its normal and friction cone "
        "and the spring from the pad to its target."
    )
    trust = f"{words(float(g.confidence[0])).capitalize()}."
    return Section(
        "The best grasps",
        (trust, said),
        sheets=(fingers(g, 0),),
        figures=tuple(_pictured(shown, rank, result) for rank in distinct(result)),
    )


def distinct(result: Reopened) -> list[int]:
    """Ranks of the grasps that are shown: the best ones that differ."""
    return list(dict.fromkeys(alike(result.grasps.contacts)))[:SHOWN]


def _pictured(shown: Scene, rank: int, result: Reopened) -> Figure:
    picture = png.cells(shown, rank)
    caption = _titled(shown.views[rank].title, rank, result)
    views = tuple({"png": cell} for cell in picture.cells)
    return Figure(f"grasp-{rank}", caption, {"png": png.joined(picture)}, views)


def poses(result: Reopened) -> Section:
    """Wrist pose and joints of the grasps that are shown: the goal of a robot."""
    g, hand = result.grasps, result.hand
    said = (
        "Of the pregrasps above. Quaternions are x y z w; roll, pitch and yaw turn about the world's x, then y, then "
        "z, R = Rz(yaw) Ry(pitch) Rx(roll). Joints are in the order of joint_names in grasps.npz."
    )
    pairs = [(wrist(g, rank, hand), joints(g, rank, hand)) for rank in distinct(result)]
    return Section("Wrist and joints", (said,), sheets=tuple(sheet for pair in pairs for sheet in pair))


def _titled(title: str, rank: int, result: Reopened) -> str:
    firsts = alike(result.grasps.contacts)
    others = [str(result.grasps.start[r]) for r, first in enumerate(firsts) if first == rank and r != rank]
    return f"Grasp {title}" + (f"; the same from starts {', '.join(others)}" if others else "")


def numbers(result: Reopened, summary: Mapping[str, Any]) -> Section:
    """Energy and checks of the best grasp, all recomputed without smoothing."""
    said = "Recomputed from the solver's variables, without any smoothing."
    found = summary["best"]
    if found is None:
        known = None if result.problem is None else result.problem.weights()
        return Section("Energy of the least bad", (said,), sheets=(energy(result.grasps, 0, known),))
    weights = [term["weight"] for term in found["energy_terms"].values()]
    both = (energy(result.grasps, 0, weights), checks(found["checks"]))
    return Section("Energy and checks of the best", (said,), sheets=both)


def paths(result: Reopened) -> Section:
    """Density of contact along each finger's path of the best grasp."""
    assert result.problem is not None
    g = result.grasps
    found = approaches(result.problem, g.posture())
    share = result.problem.settings.contact.density == "share"
    panels = figures.approach(found, ", share" if share else " [1/m]")
    caption = (
        "Above, how likely the surface is met along each finger's path from its pregrasp tip to its target, "
        f"{'over the sum of the samples' if share else 'in 1/m'}; below, the pad's mean distance to the surface with "
        "its deviation σ. The dotted line is the planned contact: a good path has one narrow peak there."
    )
    columns = [panels[i :: len(found)] for i in range(len(found))]
    return Section("Where the fingers meet the surface", figures=(_plotted("approach", caption, panels, columns),))


def convergence(courses: Mapping[str, NDArray[Any]]) -> Section:
    """Energy and violation of every start over its iterations."""
    caption = (
        "Smoothed energy and largest violation of a scaled constraint over the iterations of each start. The energy of "
        "a formulation counts only its own terms: the constrained one has no terms for what its constraints require."
    )
    panels = figures.convergence(courses)
    columns = [panels[i::2] for i in range(2)]
    return Section("Convergence", figures=(_plotted("convergence", caption, panels, columns),))


def _plotted(name: str, caption: str, panels: list[Panel], columns: list[list[Panel]]) -> Figure:
    """The panels as one figure, and each of its columns as a cell of its own, which a page shows as an svg."""
    cells = tuple(plots.draw(column, caption, 1, ("svg",)) for column in columns)
    return Figure(name, caption, plots.draw(panels, caption, columns=len(columns)), cells, PANEL_WIDTH)


def simulation(found: Mapping[str, Any], pictures: Mapping[str, bytes]) -> Section:
    """The outcomes of `simulation.json`, and the pictures beside it as PNG by phase."""
    load = f"{found['settings']['mass']:g} kg, friction {found['settings']['friction']:g}"
    thing = "estimated surface" if found.get("estimated") else "true object"
    said = f"Carried out in MuJoCo on the {thing} of {found['object']}, {load}."
    shown = tuple(
        Figure(f"simulation-{phase}", f"Grasp 0, end of {phase}.", {"png": png}) for phase, png in pictures.items()
    )
    note = "*Moved* is the object's motion before the last pad touched."
    return Section("Simulation", (said, note), sheets=(simulated(found["grasps"]),), figures=shown)


def assumptions(result: Reopened, summary: Mapping[str, Any]) -> Section:
    """What was assumed about the input."""
    contact, cloud = summary["settings"]["contact"], result.cloud
    rows = [("assumed", ""), ("table height", f"{summary['table_height']:.4f} m")]
    if cloud is not None:
        rows.append(("points", str(len(cloud.points))))
        rows.append(("views", f"{len(cloud.view_names)}: {', '.join(cloud.view_names)}"))
        rows.append(("positions of the cameras", "known" if cloud.camera_positions is not None else "unknown"))
    mass = f"{contact['mass']:g} kg, at the middle of the cloud's box" if contact["mass"] else "none: without gravity"
    rows += [("friction", f"{contact['friction']:g}"), ("mass", mass)]
    rows.append(("fingertips", "spheres that touch" if contact["pad"] else "their centres touch"))
    notes = tuple(summary["notes"]) or ("Nothing was dropped from the cloud.",)
    return Section("What was assumed about the input", notes, sheets=(Sheet("", tuple(rows)),))


def again(summary: Mapping[str, Any], command: str) -> Section:
    """The command that makes the result again, and all that the result depends on."""
    rows = [("", ""), *((name, str(version)) for name, version in summary["versions"].items())]
    known = ("kinematics", "surface", "linear_systems", "seed", "input_digest")
    rows += [(name, str(summary[name])) for name in known if name in summary]
    rows += [(name, str(value)) for name, value in summary["machine"].items()]
    rows += [(f"seconds: {name}" if name != "jobs" else name, f"{s:.3g}") for name, s in summary["seconds"].items()]
    return Section("Make it again", code=command, sheets=(Sheet("Versions and machine", tuple(rows)),))
