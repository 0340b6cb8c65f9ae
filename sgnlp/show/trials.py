"""Tables and sentences of simulated trials for the terminal: built here, printed by the command line."""

from collections.abc import Sequence

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.show import sheets, tables
from sgnlp.show.columns import Table
from sgnlp.simulation import Closing, Outcome, plain


def simulation_table(outcomes: Sequence[Outcome]) -> Table:
    """One row for each simulated grasp, in the order of their ranks."""
    return tables.table(sheets.simulated([plain(outcome) for outcome in outcomes]))


def touches_table(outcome: Outcome, hand: Hand, planned: Array) -> Table:
    """One row for each finger of a simulated grasp; `planned` are the forces (m, 3) of the plan [N]."""
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
    """How the closing differed from the plan, in sentences; empty if the hand did not close."""
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
    """How well the motion was followed, and unwanted touches, in sentences; empty if there was neither."""
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
    """How far the equilibrium is off the plan, for the quantities that are known."""
    found = []
    if closing.shift_error is not None and closing.turn_error is not None:
        found.append(f"object {1e3 * closing.shift_error:.1f} mm and {np.degrees(closing.turn_error):.1f}°")
    if closing.tip_errors is not None:
        found.append(f"tips {1e3 * closing.tip_errors.min():.1f} to {1e3 * closing.tip_errors.max():.1f} mm")
    if closing.force_errors is not None:
        found.append(f"forces {closing.force_errors.min():.1f} to {closing.force_errors.max():.1f} N")
    return [f"Off the planned equilibrium: {'; '.join(found)}."] if found else []
