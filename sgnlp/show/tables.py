"""Tables of a plan for the terminal: built here, printed by the command line."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

from rich.console import Console
from rich.text import Text

from sgnlp.hand.arm import Arm
from sgnlp.hand.listing import Listing
from sgnlp.planning.plan import Plan
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution
from sgnlp.show import sheets
from sgnlp.show.columns import Table
from sgnlp.show.sheets import Sheet

COLOURED = {"yes": Text("yes", style="green"), "no": Text("no", style="red")}


def legend(problem: Problem) -> list[str]:
    """One line each: what every term of the energy rewards, and what every constraint bounds."""
    named = [[(p.name, p.about) for p in parts] for parts in (problem.terms, problem.constraints)]
    width = max(len(name) for parts in named for name, _ in parts)
    terms, constraints = ([f"  {name:{width}}  {about}" for name, about in parts] for parts in named)
    return ["Terms of the energy reward", *terms, "Constraints bound", *constraints]


def violations_table(s: Solution) -> Table:
    """The constraints that a grasp violates, and by how much; the worst in the scale of its row comes first."""
    table = Table(f"Start {s.start}, not satisfied", "constraint", "value", "limit", "by")
    for v in s.violations:
        numbers = (v.value, v.limit, abs(v.value - v.limit))
        table.add_row(v.name, *(f"{number:.3g} {v.unit}".rstrip() for number in numbers))
    return table


def tables(plan: Plan, summary: Mapping[str, Any]) -> list[Table]:
    """Everything to print about a plan with its summary: the starts, then the best grasp or the least bad one."""
    grasps = plan.arrays()
    solved = {"starts_table": [start for start in summary["starts_table"] if "failure" not in start]}
    shown = [table(_without("same as", sheets.starts(solved, grasps, apart=" ")))] if plan.solutions else []
    shown += [_failures(plan)] if plan.failures else []
    if plan.solutions:
        first = plan.solutions[0]
        energy = table(sheets.energy(grasps, 0, plan.problem.weights()), f"Start {first.start}, exact energy")
        energy.rows[-1].style = "bold"
        recomputed = sheets.checks({check.name: asdict(check) | {"demand": check.demand} for check in first.checks})
        shown.append(table(sheets.fingers(grasps, 0), f"Start {first.start}, by finger"))
        shown += [energy, table(_without("worst at", recomputed), f"Start {first.start}, recomputed")]
        shown += [violations_table(first)] if first.violations else []
    return shown


def _failures(plan: Plan) -> Table:
    """The starts that gave no grasp, those with the same reason in one row."""
    reasons: dict[str, list[str]] = {}
    for failure in sorted(plan.failures, key=lambda failure: failure.start):
        reasons.setdefault(failure.reason, []).append(str(failure.start))
    made = Table("Starts without a grasp", "start", "why", prose=["start", "why"])
    for reason, starts in reasons.items():
        made.add_row(" ".join(starts), reason)
    return made


def _without(head: str, sheet: Sheet) -> Sheet:
    """A sheet without one of its columns, so that it fits a terminal of 80 characters."""
    i = sheet.rows[0].index(head)
    return replace(sheet, rows=tuple((*row[:i], *row[i + 1 :]) for row in sheet.rows))


def pose_lines(plan: Plan, s: Solution) -> list[str]:
    """Lines with the wrist pose and joints of a grasp; `report.html` and `grasps.npz` have all digits and names."""
    wrist = " ".join(f"{v:.3f}" for v in s.wrist)
    joints = " ".join(f"{q:.2f}" for q in s.joints)
    root = plan.problem.hand.root
    return [f"wrist, {root} in the world, x y z [m] qx qy qz qw: {wrist}", f"joints, in order of joint_names: {joints}"]


def headline(plan: Plan) -> str:
    """One line: how many starts, how many feasible, how long."""
    feasible = sum(s.feasible for s in plan.solutions)
    seconds = sum(plan.seconds.values())
    other = "narrower" if plan.widened else "wider"
    vain = f", {plan.vain} more with {other} limits of motion in vain," if plan.vain else ""
    left = f", {plan.left} left out," if plan.left else ""
    starts = f"{feasible} of {plan.tried - plan.left} starts feasible"
    return f"{plan.observation.name}: {starts}{left}{vain} in {seconds:.1f} s"


def hands_table(hands: Sequence[Listing]) -> Table:
    """One row for each hand: its joints, + joints that follow others, and what has to be installed for it."""
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
    """Lines with equal keys as a table; the column `prose` holds text that may be folded."""
    return table(Sheet(title, (tuple(lines[0]), *(tuple(line.values()) for line in lines))), prose=prose)


def table(sheet: Sheet, title: str = "", prose: str = "") -> Table:
    """A sheet as a table of the terminal; the column `prose` holds text that may be folded."""
    made = Table(title or sheet.title, *sheet.rows[0], prose=[prose] if prose else ())
    for row in sheet.rows[1:]:
        made.add_row(*(COLOURED.get(cell, cell) for cell in row))
    return made


def markdown(lines: list[dict[str, str]]) -> str:
    """Lines with equal keys as a Markdown table."""
    return sheets.markdown([list(lines[0]), *(list(line.values()) for line in lines)]) + "\n"


def text(made: Table) -> str:
    """A table as plain text, as wide as it needs to be."""
    console = Console(width=1000, color_system=None, force_terminal=False, markup=False, emoji=False, highlight=False)
    with console.capture() as capture:
        console.print(made)
    return "".join(line.rstrip() + "\n" for line in capture.get().splitlines())
