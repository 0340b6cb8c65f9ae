"""The examination of a hand's folder: what is found, what is refused, and the pictures."""

import random
import re
import shutil
from pathlib import Path

import pytest
from browser import drawn, needs_a_browser
from descriptions import described, mjcf
from hands import BENT, THREE, changed, coupled, installed

from sgnlp.base.errors import SgnlpError
from sgnlp.cli import run
from sgnlp.hand import findings, geometry
from sgnlp.hand.check import examine
from sgnlp.hand.findings import Finding

CUBE = "middle of the tips to that of a 60 mm cube"
JUNK = ["", "{", "]", ":", "- ", "null", ".nan", "-1", "1e400", '"', "\t", "2001-99-99", "!!python/object:x", "*a", "é"]
URDF = Path(__file__).parents[2] / "urdf"


def finding(folder: Path, check: str) -> Finding:
    """The one finding of a check."""
    (found,) = (f for f in examine(folder).findings if f.check == check)
    return found


def wrong(folder: Path) -> dict[str, str]:
    """What is wrong, by check."""
    return {f.check: f.found for f in examine(folder).findings if f.verdict == "wrong"}


@pytest.mark.parametrize("name", ["allegro_left", "dlr_hit_right"])
def test_nothing_is_wrong_or_strange_about_the_hands_of_the_package(name: str):
    done = examine(URDF / name)
    assert {f.verdict for f in done.findings} == {"ok"}
    assert done.hand is not None
    assert done.wrong == 0


DRAFTED = (
    "barrett",
    "dex3_left",
    "dex3_right",
    "inspire_right",
    "leap_left",
    "leap_right",
    "shadow_left",
    "shadow_right",
    "svh_right",
)


@pytest.mark.parametrize("name", DRAFTED)
def test_nothing_is_wrong_about_drafted_hands_and_only_what_their_makers_built_is_strange(name: str):
    hand = installed(name)
    done = examine(URDF / name)
    assert not done.wrong
    assert {f.check.partition(" of ")[0] for f in done.findings if f.verdict == "look"} <= {
        "chain",
        "order",
    }  # few joints, a thumb across
    assert hand.name == name


def test_every_finding_says_what_was_found_and_what_is_valid(tmp_path: Path):
    for found in examine(coupled(tmp_path)).findings:
        assert found.check
        assert found.found
        assert found.valid
        assert "\n" not in found.found


def test_the_chain_of_each_finger_and_what_joints_follow_is_told(tmp_path: Path):
    folder = coupled(tmp_path)
    assert finding(folder, "chain of b").found == "b_slide, b_bend, a_bend"
    assert finding(folder, "mimic 'b_curl'").found == "-0.5 · a_bend + 0.2"
    assert finding(folder, "joints").found == "8 under 'base', 1 more mimic one of them"


def test_joints_that_share_a_motor_are_to_be_coupled(tmp_path: Path):
    found = finding(described(mjcf(tmp_path)), "shared motor")
    assert (found.verdict, found.found) == ("look", "one motor moves flex and bend")
    assert "couplings: {bend: {joint: flex, multiplier: 1, offset: 0}}" in found.valid


def test_one_mistake_hides_no_other(tmp_path: Path):
    folder = changed(
        tmp_path,
        "hand.yaml",
        ("tip: a_tip", "tip: a_nail"),
        ("effort: 1.0", "effort: -2"),
        ("a_bend: 0.2", "a_bend: 7"),
        ("euler_deg: [180, 0, 30]", "euler_deg: [180, 0]"),
    )
    mistakes = wrong(folder)
    assert set(mistakes) == {"finger 1", "their number", "effort", "reference", "wrist"}
    assert "a_nail" in mistakes["finger 1"]
    assert mistakes["effort"] == "effort of joint 'a_slide' must be positive, not -2"
    assert mistakes["reference"] == "reference angle 7 of 'a_bend' is outside [-0.5, 1.5]"


def test_pairs_that_overlap_at_the_reference_are_wrong(tmp_path: Path):
    folder = changed(tmp_path, "hand.yaml", ("radius: 0.01}\n      palm", "radius: 0.2}\n      palm"))
    assert wrong(folder)["pairs at the reference"].endswith("mm between a_bone and c_pad")


def test_kinematics_that_are_not_pinocchios_are_wrong(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(geometry, "kinematics_error", lambda hand, samples: 2e-12)
    assert wrong(THREE) == {"symbolic kinematics": "off Pinocchio by 2.0e-12 m"}


def test_a_mesh_that_is_not_there_is_wrong(tmp_path: Path):
    mesh = '<visual><geometry><mesh filename="palm.stl"/></geometry></visual>'
    folder = changed(tmp_path, "hand.urdf", ('<link name="base"/>', f'<link name="base">{mesh}</link>'))
    assert "link 'base': the mesh 'palm.stl' is not there; valid are" in wrong(folder)["links"]


def test_a_mesh_that_is_damaged_is_wrong(tmp_path: Path):
    mesh = '<visual><geometry><mesh filename="palm.stl"/></geometry></visual>'
    folder = changed(tmp_path, "hand.urdf", ('<link name="base"/>', f'<link name="base">{mesh}</link>'))
    (folder / "palm.stl").write_bytes(b"x" * 100)
    assert "a mesh of hand.urdf cannot be read" in wrong(folder)["meshes"]
    (folder / "palm.stl").write_bytes(b"version https://git-lfs.github.com/spec/v1")
    assert "git lfs pull" in wrong(folder)["links"]


def test_a_sphere_beside_its_link_is_to_be_looked_at(tmp_path: Path):
    mesh = '<link name="base"><visual><geometry><sphere radius="0.03"/></geometry></visual></link>'
    folder = changed(tmp_path, "hand.urdf", ('<link name="base"/>', mesh))
    palm = "palm: {link: base, centre: [0, 0, 0]"
    changed(tmp_path, "hand.yaml", (palm, palm.replace("0, 0, 0", "0, 0, 0.08")))
    told = finding(folder, "sphere 'palm'")
    assert (told.verdict, told.found) == ("look", "20 mm beside the mesh of its link")
    changed(tmp_path, "hand.yaml", ("0, 0, 0.08", "0, 0, 0.07"))
    assert not [f for f in examine(folder).findings if f.check == "sphere 'palm'"]


def test_fingers_that_are_named_in_another_order_than_they_stand_are_to_be_looked_at(tmp_path: Path):
    folder = Path(shutil.copytree(URDF / "dlr_hit_right", tmp_path / "hand"))
    text = (folder / "hand.yaml").read_text(encoding="utf-8")
    for old, new in (
        ("{name: index, tip: index_tip", "{name: index, tip: ring_tip"),
        ("{name: ring, tip: ring_tip", "{name: ring, tip: index_tip"),
        (
            "pads: {index: index_pad, middle: middle_pad, ring: ring_pad",
            "pads: {index: ring_pad, middle: middle_pad, ring: index_pad",
        ),
    ):
        assert old in text
        text = text.replace(old, new)
    (folder / "hand.yaml").write_text(text, encoding="utf-8")
    told = finding(folder, "order of the fingers")
    assert told.verdict == "look"
    assert told.found == "'index' is not beside the thumb: from the thumb on ring, middle, index, little"


@pytest.mark.parametrize(
    ("file", "old", "new", "check", "found"),
    [
        ("hand.yaml", "effort: 1.0", "effort: 15", "largest effort", "15 N m of 'a_slide'"),
        ("hand.yaml", "position: [0, 0, 0.1]", "position: [0, 0, 0.4]", CUBE, "start 1"),
        ("hand.yaml", "a_pad: {link: a_tip, centre: [0.01,", "a_pad: {link: a_tip, centre: [0,", "pad of a", "8 mm"),
        ("hand.urdf", 'lower="-0.5" upper="1.5"', 'lower="-0.5" upper="75"', "widest limits", "75 rad of 'a_bend'"),
        ("hand.yaml", "offset: [0, 0.002, 0.03]", "offset: [0, 0.1, 0.03]", "place of the pad of b", "mm off"),
        ("hand.yaml", "[[a_pad, b_pad], [a_bone, c_pad]]", "[]", "pairs at the reference", "none"),
        ("hand.urdf", 'name="a_slide" type="prismatic"', 'name="a_slide" type="fixed"', "chain of a", "a_bend, a_curl"),
        (
            "hand.urdf",
            '<link name="base"/>',
            '<link name="base"><visual><geometry><sphere radius="0.05"/></geometry></visual></link>',
            "mesh of 'base'",
            "20.0 mm out of the spheres",
        ),
    ],
)  # fmt: skip
def test_what_looks_like_a_mistake_is_to_be_looked_at(
    tmp_path: Path, file: str, old: str, new: str, check: str, found: str
):
    folder = changed(tmp_path, file, (old, new))
    if "fixed" in new:
        changed(tmp_path, "hand.yaml", ("{a_slide: 0, ", "{"))
    told = finding(folder, check)
    assert told.verdict == "look"
    assert found in told.found


def test_no_file_however_broken_ends_in_a_traceback(tmp_path: Path):
    rng = random.Random(0)
    for i in range(60):
        folder = Path(shutil.copytree(THREE, tmp_path / str(i)))
        file = folder / rng.choice(["hand.yaml", "hand.yaml", "hand.urdf"])
        text = file.read_text(encoding="utf-8")
        first, last = rng.choice(list(re.finditer(r"[\w.\-]+|[^\w\s]", text))).span()
        file.write_text(text[:first] + rng.choice(JUNK) + text[last:], encoding="utf-8")
        try:
            examine(folder)
        except SgnlpError as error:
            pytest.fail(f"{file}: {error}")


def test_the_command_tells_every_check_and_ends_with_0(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    assert run(["check-hand", str(coupled(tmp_path))]) == 0
    out = capfd.readouterr().out
    assert "ok     chain of b: b_slide, b_bend, a_bend  (3 joints or more" in out
    assert "look   meshes: none" in out
    assert "checks: 0 wrong, 1 to look at" in out


def test_the_command_ends_with_3_where_something_is_wrong(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    folder = changed(tmp_path, "hand.urdf", (BENT, f'{BENT}<mimic joint="b_curl"/>'))
    assert run(["check-hand", str(folder)]) == 3
    assert "wrong  links: hand.urdf: joint 'b_curl' mimics itself" in capfd.readouterr().out
    for missing in ("nothing", str(tmp_path)):
        assert run(["check-hand", missing]) == 3
        assert f"'{missing}' is no folder holding hand.yaml" in capfd.readouterr().err
    assert run(["check-hand", str(THREE), "--spheres", "none"]) == 3
    assert "unknown preset of spheres 'none'; valid: cover" in capfd.readouterr().out
    assert run(["check-hand"]) == 2


def test_the_picture_shows_the_spheres(tmp_path: Path):
    pytest.importorskip("matplotlib")
    png = tmp_path / "made" / "hand.png"
    assert run(["check-hand", str(URDF / "dlr_hit_right"), "--png", str(png)]) == 0
    assert png.read_bytes().startswith(b"\x89PNG")


@needs_a_browser
def test_the_page_draws_hand_and_spheres_without_an_error(tmp_path: Path):
    pytest.importorskip("plotly")
    page = tmp_path / "hand.html"
    ball = '<link name="base"><visual><geometry><sphere radius="0.03"/></geometry></visual></link>'
    folder = changed(tmp_path, "hand.urdf", ('<link name="base"/>', ball))
    assert run(["check-hand", str(folder), "--html", str(page)]) == 0
    layers, elements = drawn(page, tmp_path / "profile")
    assert {"hand", "collision spheres"} <= layers
    assert "upper limits" in elements


def test_limits_that_are_named_are_those_of_the_module():
    assert finding(URDF / "allegro_left", "largest effort").valid.endswith(f"{findings.MAX_EFFORT:g} N m is rare")
