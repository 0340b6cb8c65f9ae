"""Tables of a plan for the terminal: built here, printed by the command line."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from sgnlp.base.arrays import Array
from sgnlp.hand.arm import Arm
from sgnlp.hand.hand import Hand
from sgnlp.hand.listing import Listing
from sgnlp.planning.plan import Plan
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution
from sgnlp.show import sheets
from sgnlp.show.columns import Table
from sgnlp.show.sheets import Sheet
from sgnlp.simulation import Closing, Outcome, plain

COLOURED = {"yes": Text("yes", style="green"), "no": Text("no", style="red")}


def legend(problem: Problem) -> list[str]:
    """What each term of the energy rewards, and what each constraint bounds, a line each."""
    named = [[(p.name, p.about) for p in parts] for parts in (problem.terms, problem.constraints)]
    width = max(len(name) for parts in named for name, _ in parts)
    terms, constraints = ([f"  {name:{width}}  {about}" for name, about in parts] for parts in named)
    return ["Terms of the energy reward", *terms, "Constraints bound", *constraints]


def violations_table(s: Solution) -> Table:
    """The constraints that a grasp does not satisfy, the worst first in the scales of the rows, and by how much."""
    table = Table(f"Start {s.start}, not satisfied", "constraint", "value", "limit", "by")
    for v in s.violations:
        numbers = (v.value, v.limit, abs(v.value - v.limit))
        table.add_row(v.name, *(f"{number:.3g} {v.unit}".rstrip() for number in numbers))
    return table


def tables(plan: Plan, summary: Mapping[str, Any]) -> list[Table]:
    """Everything to print about a plan with its summary: the starts, then the best grasp or the least bad one."""
    grasps = plan.arrays()
    shown = [table(_without("same as", sheets.starts(summary, grasps)))]
    if plan.solutions:
        first = plan.solutions[0]
        energy = table(sheets.energy(grasps, 0, plan.problem.weights()), f"Start {first.start}, exact energy")
        energy.rows[-1].style = "bold"
        recomputed = sheets.checks({check.name: asdict(check) | {"demand": check.demand} for check in first.checks})
        shown.append(table(sheets.fingers(grasps, 0), f"Start {first.start}, by finger"))
        shown += [energy, table(_without("worst at", recomputed), f"Start {first.start}, recomputed")]
        shown += [violations_table(first)] if first.violations else []
    return shown


def _without(head: str, sheet: Sheet) -> Sheet:
    """A sheet without one of its columns, so that it fits a terminal of 80."""
    i = sheet.rows[0].index(head)
    return replace(sheet, rows=tuple((*row[:i], *row[i + 1 :]) for row in sheet.rows))


def pose_lines(plan: Plan, s: Solution) -> list[str]:
    """Where a grasp sends the wrist and the joints: `report.html` and `grasps.npz` have all digits and names."""
    wrist = " ".join(f"{v:.3f}" for v in s.wrist)
    joints = " ".join(f"{q:.2f}" for q in s.joints)
    root = plan.problem.hand.root
    return [f"wrist, {root} in the world, x y z [m] qx qy qz qw: {wrist}", f"joints, in order of joint_names: {joints}"]


def headline(plan: Plan) -> str:
    """One line: how many starts, how many feasible, how long."""
    count = len(plan.solutions) + len(plan.failures)
    feasible = sum(s.feasible for s in plan.solutions)
    seconds = sum(plan.seconds.values())
    return f"{plan.observation.name}: {feasible} of {count} starts feasible in {seconds:.1f} s"


def simulation_table(outcomes: Sequence[Outcome]) -> Table:
    """One row a simulated grasp, in the order of their ranks."""
    return table(sheets.simulated([plain(outcome) for outcome in outcomes]))


def touches_table(outcome: Outcome, hand: Hand, planned: Array) -> Table:
    """One row a finger of a simulated grasp; planned forces (m, 3) [N]."""
    columns = ("touches", "tip off", "force", "planned", "off by", "slip closing", "lifting")
    table = Table("First grasp, by finger; s, N and mm", "finger", *columns)
    closing, lift = outcome.closing, outcome.lift
    if closing is None:
        return table
    for i, finger in enumerate(hand.fingers):
        time = closing.contact_times[i]
        table.add_row(
            finger.name,
            "never" if np.isnan(time) else f"{time:.2f}",
            "" if closing.tip_errors is None else f"{1e3 * closing.tip_errors[i]:.1f}",
            f"{np.linalg.norm(closing.forces[i]):.2f}",
            f"{np.linalg.norm(planned[i]):.2f}",
            f"{np.linalg.norm(closing.forces[i] - planned[i]):.2f}",
            f"{1e3 * closing.slip[i]:.1f}",
            f"{1e3 * lift.slip[i]:.1f}" if lift else "",
        )
    return table


def closing_lines(outcome: Outcome) -> list[str]:
    """What a closing did beside the plan, in words; nothing where the hand did not close."""
    closing = outcome.closing
    if closing is None:
        return []
    touched = f"Links touched the object while closing: {', '.join(closing.links)}."
    held = f"At the equilibrium links press by {closing.links_force:.1f} N: {', '.join(closing.links_equilibrium)}."
    pads = f"{closing.pads_loaded} of {len(closing.forces)} pads carry load."
    spread = f"The last pad touched {closing.contact_spread:.2f} s after the first."
    torque, limited = closing.torque_share, closing.joints_limited
    return [
        touched if closing.links else "No link but the pads touched the object while closing.",
        *([held] if closing.links_equilibrium else []),
        f"{pads} {'A pad never touched.' if np.isnan(closing.contact_spread) else spread}",
        *_off_plan(closing),
        f"Joint torques reach {100 * torque:.0f} % of the effort at the equilibrium, "
        f"{100 * closing.torque_share_closing:.0f} % while closing; at the limit are {100 * limited:.0f} % of the "
        f"joints, while closing {100 * closing.joints_limited_closing:.0f} %.",
    ]


def motion_lines(outcome: Outcome) -> list[str]:
    """How the motion was followed, and what touched that should not, in words; nothing where there was neither."""
    found, way = [], outcome.carriage
    if way is not None:
        off = [1e3 * value for value in (way.approach_off, way.closing_off, way.lift_off)]
        found.append(
            f"The wrist was off its path by at most {off[0]:.1f} mm on the approach, {off[1]:.1f} mm while closing, "
            f"{off[2]:.1f} mm on lift and hold."
        )
        if way.torque_share:
            found.append(f"Joint torques of the arm reach {100 * way.torque_share:.0f} % of the effort.")
    for knock in outcome.knocks:
        where = f"In the phase {knock.phase}, {knock.part} touched {knock.hit}"
        found.append(f"{where}: {1e3 * knock.depth:.1f} mm deep, {knock.force:.1f} N.")
    return found


def _off_plan(closing: Closing) -> list[str]:
    """How far the equilibrium is off the plan, as far as there is one."""
    found = []
    if closing.shift_error is not None and closing.turn_error is not None:
        found.append(f"object {1e3 * closing.shift_error:.1f} mm and {np.degrees(closing.turn_error):.1f}°")
    if closing.tip_errors is not None:
        found.append(f"tips {1e3 * closing.tip_errors.min():.1f} to {1e3 * closing.tip_errors.max():.1f} mm")
    if closing.force_errors is not None:
        found.append(f"forces {closing.force_errors.min():.1f} to {closing.force_errors.max():.1f} N")
    return [f"Off the planned equilibrium: {'; '.join(found)}."] if found else []


def hands_table(hands: Sequence[Listing]) -> Table:
    """One row a hand: with its joints, + those that follow others, and what makes it usable."""
    rows: list[tuple[str, ...]] = [("name", "fingers", "joints", "description", "usable")]
    for hand in hands:
        joints = f"{hand.joints} + {hand.coupled}" if hand.coupled else str(hand.joints)
        usable = "yes" if hand.command is None else hand.command or "no"
        rows.append((hand.name, str(hand.fingers), joints, hand.package or "its own", usable))
    return table(Sheet("Hands", tuple(rows)))


def arms_table(arms: list[Arm]) -> Table:
    """One row an arm."""
    rows: list[tuple[str, ...]] = [("name", "joints", "flange", "base [m]", "spheres")]
    for arm in arms:
        base = " ".join(f"{x:g}" for x in arm.base[:3])
        rows.append((arm.name, str(len(arm.joint_names)), arm.flange, base, str(len(arm.spheres))))
    return table(Sheet("Arms", tuple(rows)))


def facts_table(title: str, facts: dict[str, Any]) -> Table:
    """Names and values."""
    return table(Sheet(title, (("name", "value"), *((name, str(value)) for name, value in facts.items()))))


def rows_table(title: str, lines: list[dict[str, str]], prose: str = "") -> Table:
    """Lines of equal keys as a table; the column `prose` is text to read."""
    made = table(Sheet(title, (tuple(lines[0]), *(tuple(line.values()) for line in lines))))
    for column in made.columns:
        if column.header == prose:
            column.justify = "left"
    return made


def table(sheet: Sheet, title: str = "") -> Table:
    """A sheet as a table of the terminal."""
    made = Table(title or sheet.title, *sheet.rows[0])
    for row in sheet.rows[1:]:
        made.add_row(*(COLOURED.get(cell, cell) for cell in row))
    return made


def markdown(lines: list[dict[str, str]]) -> str:
    """Lines of equal keys as a Markdown table."""
    return sheets.markdown([list(lines[0]), *(list(line.values()) for line in lines)]) + "\n"


def text(made: Table) -> str:
    """A table as plain text, as wide as it needs to be."""
    console = Console(width=1000, color_system=None, force_terminal=False, markup=False, emoji=False, highlight=False)
    with console.capture() as capture:
        console.print(made)
    return "".join(line.rstrip() + "\n" for line in capture.get().splitlines())
