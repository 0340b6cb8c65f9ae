"""How far a hand's description is from its meshes, itself and an object, on hands where that is known."""

from pathlib import Path

import numpy as np
import pytest
from hands import THREE, changed, coupled

from sgnlp.hand.geometry import kinematics_error, pair_gaps, protrusions, start_offsets, surface_points, tips
from sgnlp.hand.hand import load_hand
from sgnlp.hand.meshes import link_meshes, mesh_links
from sgnlp.perception.synthetic.meshes import box, cylinder

SOLID = '<visual><origin xyz="{}" rpy="0 0 0"/><geometry>{}</geometry></visual>'


def dressed(target: Path, link: str, place: str, geometry: str) -> Path:
    """The made-up hand with one solid on a link."""
    return changed(
        target, "hand.urdf", (f'<link name="{link}"/>', f'<link name="{link}">{SOLID.format(place, geometry)}</link>')
    )


@pytest.mark.parametrize(
    ("geometry", "extents"),
    [
        ('<box size="0.02 0.04 0.06"/>', (0.02, 0.04, 0.06)),
        ('<cylinder radius="0.01" length="0.06"/>', (0.02, 0.02, 0.06)),
        ('<sphere radius="0.03"/>', (0.06, 0.06, 0.06)),
    ],
)
def test_solids_of_a_urdf_are_meshes_too(tmp_path: Path, geometry: str, extents: tuple[float, ...]):
    hand = load_hand(dressed(tmp_path, "base", "0 0 0", geometry))
    (mesh,), _ = link_meshes(hand)
    assert mesh_links(hand) == ["base"]
    assert mesh.open_edges == 0
    assert mesh.volume > 0
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), extents, rtol=0.02)


def test_what_reaches_out_of_the_spheres_is_measured(tmp_path: Path):
    ball = '<sphere radius="0.01"/>'  # the sphere of the palm has 30 mm about the same point
    assert protrusions(load_hand(dressed(tmp_path, "base", "0.025 0 0", ball)))["base"] == pytest.approx(
        0.005, abs=1e-4
    )


def test_what_the_spheres_cover_is_negative(tmp_path: Path):
    hand = load_hand(dressed(tmp_path, "base", "0.005 0 0", '<sphere radius="0.01"/>'))
    assert protrusions(hand)["base"] == pytest.approx(-0.015, abs=1e-4)


def test_a_face_without_vertices_in_its_middle_is_measured_there(tmp_path: Path):
    hand = load_hand(dressed(tmp_path, "base", "0 0 0", '<box size="0.08 0.001 0.001"/>'))
    corners = np.abs(link_meshes(hand)[0][0].vertices[:, 0])
    points = surface_points(link_meshes(hand)[0][0], 500)
    assert corners.min() == pytest.approx(0.04)
    assert np.abs(points[:, 0]).min() < 0.005


def test_the_gaps_of_pairs_are_those_of_their_spheres():
    hand = load_hand(THREE)
    (i, j), *_ = hand.pairs
    pads = tips(hand)  # the first pair is the pads of a and b
    assert (hand.spheres[i].name, hand.spheres[j].name) == ("a_pad", "b_pad")
    assert pair_gaps(hand)[0] == pytest.approx(np.linalg.norm(pads[0] - pads[1]) - 0.016)


def test_the_offset_of_a_start_is_from_the_middle_of_the_cube_to_that_of_the_tips():
    hand = load_hand(THREE)
    middle = tips(hand).mean(axis=0) * [1, -1, -1]  # the only start turns by 180 degrees about x, then about z
    expected = np.linalg.norm(middle + np.array([0, 0, 0.1 + 0.03]))
    assert start_offsets(hand, 0.06) == pytest.approx([expected], rel=1e-9)


def test_the_symbolic_kinematics_are_those_of_pinocchio(tmp_path: Path):
    for folder in (THREE, coupled(tmp_path), "dlr_hit_right"):
        assert kinematics_error(load_hand(folder), 20) < 1e-12


def test_a_box_and_a_cylinder_have_their_volumes():
    assert box([1, 2, 3]).volume == pytest.approx(6)
    assert box([1, 2, 3]).open_edges == cylinder(1, 1, 24).open_edges == 0
    assert cylinder(2.0, 3.0, 500).volume == pytest.approx(np.pi * 4 * 3, rel=1e-3)
