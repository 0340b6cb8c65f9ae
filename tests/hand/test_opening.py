"""The largest ball between the pads of a hand, and how hard it is pressed there."""

from pathlib import Path

import numpy as np
import pytest

from sgnlp.hand.hand import load_hand
from sgnlp.hand.kinematics import frames
from sgnlp.hand.opening import GIVE, OPPOSED, ORIGIN, Opening, opening, press

REACH, BESIDE, PAD, EFFORT = 0.07, 0.0005, 0.01, 3.0
SLIDE = """<link name="{name}"/><joint name="{name}_slide" type="prismatic"><parent link="base"/><child link="{name}"/>
<origin xyz="0 {y} 0"/><axis xyz="{x} 0 0"/><limit lower="0.01" upper="0.07" effort="1" velocity="1"/></joint>"""
YAML = """
name: vice
urdf: hand.urdf
root: base
effort: 3.0
fingers: [{a}, {b}, {t}]
reference: {a_slide: 0.05, b_slide: 0.05, t_slide: 0.05}
gains: {lower: 20, upper: 300, initial: 100}
wrist: {root_euler_deg: [0, 0, 0], starts: [{position: [0, 0, 0.1], euler_deg: [0, 0, 0]}]}
spheres:
  cover:
    spheres: {a_pad: {link: a, centre: [0, 0, 0], radius: 0.01}, b_pad: {link: b, centre: [0, 0, 0], radius: 0.01},
      t_pad: {link: t, centre: [0, 0, 0], radius: 0.01}, palm: {link: base, centre: [0, 0, -0.2], radius: 0.01}}
    pads: {a: a_pad, b: b_pad, t: t_pad}
    pairs: []
"""


@pytest.fixture
def vice(tmp_path: Path) -> Path:
    """Two pads that slide along x, one that slides along -x, each up to 7 cm from the middle."""
    links = [SLIDE.format(name=n, x=x, y=y) for n, x, y in (("a", 1, BESIDE), ("b", 1, -BESIDE), ("t", -1, 0))]
    (tmp_path / "hand.urdf").write_text(f'<robot name="vice"><link name="base"/>{"".join(links)}</robot>', "utf-8")
    text = YAML
    for name in "abt":
        text = text.replace(f"{{{name}}}", f"{{name: {name}, tip: {name}, offset: [0, 0, 0], radius: {PAD}}}")
    (tmp_path / "hand.yaml").write_text(text, encoding="utf-8")
    return tmp_path


def test_the_ball_in_a_vice_is_as_large_as_geometry_has_it(vice):
    hand = load_hand(vice)
    found = opening(hand)
    aside = np.arccos(OPPOSED) / 2  # the centre is off the pads' line until they are no longer opposite
    assert found.diameter / 2 == pytest.approx(REACH / np.cos(aside) - PAD, abs=1e-4)
    np.testing.assert_allclose(found.joints, REACH, atol=1e-5)
    assert press(hand, found) == pytest.approx(EFFORT / np.cos(aside), rel=1e-3)


@pytest.mark.parametrize("name", ["allegro_left", "dlr_hit_right"])
def test_all_pads_touch_the_ball_and_nothing_else_does(name):
    hand = load_hand(name)
    found = opening(hand)
    tips, spheres = frames(hand, ORIGIN, found.joints)
    touching = np.linalg.norm(tips - found.centre, axis=1) - hand.tip_radii - found.diameter / 2
    assert touching.min() >= -1e-6
    assert touching.max() <= GIVE + 1e-6
    radii = np.array([sphere.radius for sphere in hand.spheres])
    gaps = np.linalg.norm(spheres - found.centre, axis=1) - radii - found.diameter / 2
    assert np.delete(gaps, hand.tip_spheres).min() >= -1e-6
    thumb, others = tips[-1] - found.centre, (tips[:-1] - found.centre).sum(axis=0)
    assert thumb @ others <= -(OPPOSED - 1e-6) * np.linalg.norm(thumb) * np.linalg.norm(others)
    assert (found.joints >= hand.lower - 1e-6).all()
    assert (found.joints <= hand.upper + 1e-6).all()


def test_twice_the_effort_presses_twice_as_hard(vice):
    hand, file = load_hand(vice), vice / "hand.yaml"
    file.write_text(file.read_text("utf-8").replace("effort: 3.0", "effort: 6.0"), "utf-8")
    at = Opening(0.1, np.zeros(3), hand.reference)
    assert press(load_hand(vice), at) == pytest.approx(2 * press(hand, at))
