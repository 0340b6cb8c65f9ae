"""The arrays of a result: documented shapes, the solutions' numbers in their order, the equations among them."""

import inspect
import re
from dataclasses import fields, replace

import numpy as np
import pytest
from plans import small_plan
from scenes import SMALL, hand

from sgnlp.planning.grasps import PER_HAND, Grasps, stack
from sgnlp.program.terms import preset_terms

ARRAYS = [field.name for field in fields(Grasps) if field.name != "meta"]
C = SMALL.contact.c
TERMS = preset_terms(SMALL)


@pytest.fixture
def grasps() -> Grasps:
    return small_plan().arrays()


def documented_shapes(G: int) -> dict[str, tuple[int, ...]]:
    """The shapes in the comments of `Grasps`."""
    m = len(hand().fingers)
    sizes = {"G": G, "m": m, "n": len(hand().joint_names), "T": len(TERMS), "S": len(hand().spheres), "a": 0}
    sizes["S - m"] = sizes["S"] - m
    comments = re.findall(r"^    (\w+): .*?# \(([^)]*)\)", inspect.getsource(Grasps), re.MULTILINE)
    axes = {name: [axis.strip() for axis in shape.split(",") if axis.strip()] for name, shape in comments}
    return {name: tuple(sizes[a] if a in sizes else int(a) for a in names) for name, names in axes.items()}


@pytest.mark.parametrize("count", [0, 1, 2])
def test_every_array_has_its_documented_shape_and_a_plain_type(count):
    stacked = stack(hand(), TERMS, small_plan().solutions[:count], {})
    assert len(stacked) == count
    assert list(documented_shapes(count)) == ARRAYS
    for name, shape in documented_shapes(count).items():
        array = getattr(stacked, name)
        assert array.shape == shape, name
        assert array.dtype.kind in "fibU", name


def test_an_array_of_no_grasps_has_the_type_of_one_of_many(grasps):
    none = stack(hand(), TERMS, [], {})
    for name in ARRAYS:
        assert getattr(none, name).dtype.kind == getattr(grasps, name).dtype.kind, name


def test_names_say_what_the_columns_are(grasps):
    assert tuple(grasps.joint_names) == hand().joint_names
    assert list(grasps.finger_names) == ["index", "middle", "ring", "thumb"]
    assert list(grasps.term_names) == [term.name for term in TERMS]
    assert set(PER_HAND) == {"joint_names", "arm_joint_names", "finger_names", "term_names"}


def test_each_row_holds_the_numbers_of_one_solution_in_the_order_of_the_ranking(grasps):
    for i, s in enumerate(small_plan().solutions):
        np.testing.assert_array_equal(grasps.wrist[i], s.wrist)
        np.testing.assert_array_equal(grasps.joints[i], s.joints)
        np.testing.assert_array_equal(grasps.tips_pregrasp[i], s.grasp.tips)
        np.testing.assert_array_equal(grasps.contact_distance[i], s.grasp.gaps)
        np.testing.assert_array_equal(grasps.object_clearance[i], s.grasp.object_clearances)
        np.testing.assert_array_equal(grasps.table_clearance[i], s.grasp.table_clearances)
        np.testing.assert_array_equal(grasps.pad_height[i], s.grasp.pad_heights)
        assert (grasps.start[i], grasps.iterations[i], grasps.status[i]) == (s.start, s.iterations, s.status)
        assert (grasps.energy[i], grasps.stiffness[i]) == (s.energy, s.grasp.stiffness)
        assert grasps.kkt[i].tolist() == [s.kkt.dual, s.kkt.primal, s.kkt.complementarity]
        assert grasps.feasible[i] == s.feasible
        assert grasps.violated[i] == "; ".join(s.violated)


def test_the_checks_that_fail_are_named_in_one_text():
    good = small_plan().solutions[0]
    bad = replace(good, checks=tuple(replace(c, passed=c.name not in ("object", "self")) for c in good.checks))
    stacked = stack(hand(), TERMS, [good, bad], {})
    assert stacked.violated.tolist() == ["", "object; self"]
    assert stacked.feasible.tolist() == [True, False]


def test_the_arrays_obey_the_equations_of_the_springs(grasps):
    o, k = grasps.targets, grasps.gains[:, :, None]
    p = o + C * (grasps.tips_pregrasp - o)
    p_eq = np.einsum("gab,gmb->gma", grasps.rotation_eq, p) + grasps.translation_eq[:, None]
    np.testing.assert_allclose(grasps.contacts, p, atol=1e-15)
    np.testing.assert_allclose(grasps.contacts_eq, p_eq, atol=1e-14)
    np.testing.assert_allclose(grasps.forces_initial, k * (o - p), atol=1e-12)
    np.testing.assert_allclose(grasps.forces_eq, k * (o - p_eq), atol=1e-11)
    np.testing.assert_allclose(grasps.forces_eq.sum(axis=1), 0, atol=1e-11)
    np.testing.assert_allclose(np.cross(p_eq, grasps.forces_eq).sum(axis=1), 0, atol=1e-11)


def test_the_arrays_obey_the_equations_of_the_contacts(grasps):
    radii = np.array([finger.radius for finger in hand().fingers])[:, None]
    np.testing.assert_allclose(grasps.contact_points, grasps.contacts - radii * grasps.normals, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(grasps.normals, axis=2), 1, atol=1e-4)  # |∇μ| is rounded at 0
    np.testing.assert_allclose(np.linalg.norm(grasps.wrist[:, 3:], axis=1), 1, atol=1e-12)
    cone = 1 / np.sqrt(1 + SMALL.contact.friction**2)
    n_eq = np.einsum("gab,gmb->gma", grasps.rotation_eq, grasps.normals)
    states = [
        (grasps.forces_initial, grasps.normals, grasps.margins_initial),
        (grasps.forces_eq, n_eq, grasps.margins_equilibrium),
    ]
    for f, n, margin in states:
        np.testing.assert_allclose(-(f * n).sum(axis=2) / np.linalg.norm(f, axis=2) - cone, margin, atol=1e-12)


def test_the_energy_is_the_weighted_sum_of_the_terms(grasps):
    np.testing.assert_allclose(grasps.energy, grasps.energy_terms @ small_plan().problem.weights(), rtol=1e-14)


def test_grasps_are_sorted_feasible_first_then_by_the_worst_margin(grasps):
    worst = np.minimum(grasps.margins_initial.min(axis=1), grasps.margins_equilibrium.min(axis=1))
    assert list(np.lexsort((-worst, ~grasps.feasible))) == list(range(len(grasps)))
    reversed_rows = stack(hand(), TERMS, small_plan().solutions[::-1], {})
    np.testing.assert_array_equal(reversed_rows.energy, grasps.energy[::-1])
