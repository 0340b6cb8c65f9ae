"""Names of variables and rows: one each, unique, and the right one beside each number."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import SMALL, hand, oracle, posed, random_point

from sgnlp.program.names import variable_names

TORQUES = replace(SMALL, limits=replace(SMALL.limits, effort=1.0))
CLOSURE = replace(TORQUES, contact=replace(SMALL.contact, metric="closure", heuristic=1.6))
PAPER = replace(SMALL, spheres="paper", contact=replace(SMALL.contact, samples=2))


@pytest.mark.parametrize("settings", [TORQUES, CLOSURE, PAPER], ids=["torques", "closure", "paper"])
@pytest.mark.parametrize("formulation", ["penalty", "constrained"])
def test_every_variable_and_every_row_has_a_name_of_its_own(settings, formulation):
    nlp = oracle(settings, formulation).nlp
    assert len(nlp.row_names) == len(set(nlp.row_names)) == sum(nlp.row_sizes)
    assert len(nlp.variable_names) == len(set(nlp.variable_names)) == len(nlp.units)


def test_the_names_are_those_of_fingers_joints_spheres_and_axes():
    rows, variables = oracle(TORQUES, "constrained").nlp.row_names, variable_names(hand())
    assert {"stiffness", "contact[ring]", "table[middle_distal]", "self[index_tip-thumb_tip]"} <= set(rows)
    assert {"torque_initial[joint_13.0]", "torque_equilibrium[joint_0.0]", "shift[thumb]"} <= set(rows)
    assert "table[index_tip]" not in rows  # a pad
    assert variables[:7] == ("wrist.x", "wrist.y", "wrist.z", "wrist.rx", "wrist.ry", "wrist.rz", "joint.joint_0.0")
    assert variables[-1] == "gain.thumb"
    assert "target.thumb.x" in variables


def moved(name: str, by: float) -> dict[str, float]:
    """The rows that change with one variable, by how much."""
    functions, problem = oracle(TORQUES, "constrained"), posed(TORQUES)
    start, x = random_point(problem, functions.nlp, 0)
    p = problem.parameters(functions.nlp, start.wrist, start.joints)
    y = x + by * (np.array(functions.nlp.variable_names) == name)
    change = functions.values(y, p) - functions.values(x, p)
    return {row: c for row, c in zip(functions.nlp.row_names, change, strict=True) if abs(c) > 1e-9}


def test_a_name_stands_for_the_number_in_its_place():
    thumb = moved("joint.joint_15.0", 0.02)
    assert "table[thumb_distal_2]" in thumb
    assert "pads_table[thumb]" in thumb
    assert not any(row.startswith(("table[ring", "table[palm", "pads_table[ring")) for row in thumb)
    assert set(moved("target.ring.z", 0.01)) >= {"contact_table[ring]", "contact[ring]", "margin_initial[ring]"}
    assert "contact_table[index]" not in moved("target.ring.z", 0.01)
    gain = moved("gain.middle", 0.1)
    assert gain["sag"] == pytest.approx(0.1)  # 10 N/m in its unit of 100 N/m
    torques = {row for row in gain if row.startswith("torque_initial")}
    assert torques == {f"torque_initial[joint_{i}.0]" for i in range(4, 8)}
