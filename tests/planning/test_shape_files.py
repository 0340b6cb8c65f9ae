"""Shapes in YAML files: what each entry means, and which files are refused."""

import numpy as np
import pytest
from scenes import observation

from sgnlp.base.errors import InputError
from sgnlp.perception.shape import Shape
from sgnlp.planning.shape_files import load_shapes, painted
from sgnlp.planning.surroundings import NOWHERE, Surroundings

SHAPES = """
- {name: crate, box: [0.2, 0.4, 0.1], position: [0.3, 0, 0.05], euler_deg: [0, 0, 90]}
- {sphere: 0.04, position: [0.1, 0.2, 0.04]}
- {cylinder: {radius: 0.03, height: 0.2}, position: [0, 0.15, 0.1]}
- {half_space: {normal: [1, 0, 0]}, position: [-0.3, 0, 0]}
- {points: marked.npz, radius: 0.01}
"""


@pytest.fixture
def folder(tmp_path):
    np.savez(tmp_path / "marked.npz", points=np.array([[0.5, 0.0, 0.0], [0.5, 0.1, 0.0]]))
    (tmp_path / "shapes.yaml").write_text(SHAPES)
    return tmp_path


def test_each_kind_of_shape_is_read_where_it_stands(folder):
    crate, ball, tube, half, *marks = load_shapes(folder / "shapes.yaml")
    at = np.array([[0.51, 0.0, 0.05], [0.1, 0.2, 0.1], [0.0, 0.2, 0.1], [-0.2, 5.0, 1.0], [0.5, 0.0, 0.03]])
    found = [s.distance(p[None])[0] for s, p in zip((crate, ball, tube, half, marks[0]), at, strict=True)]
    np.testing.assert_allclose(found, [0.01, 0.02, 0.02, 0.1, 0.02], atol=1e-9)
    assert [s.name for s in (crate, ball, tube, half, *marks)] == [
        "crate", "sphere", "cylinder", "half-space", "points", "points"
    ]  # fmt: skip


def test_a_file_of_one_shape_needs_no_list(folder):
    (folder / "one.yaml").write_text("{box: [1, 1, 1], position: [0, 0, 0]}")
    assert len(load_shapes(folder / "one.yaml")) == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("- {box: [1, 1, 1], position: [0, 0, 0], euler_deg: [0, 0, -1.57]}", "must be degrees, not -1.57, .*: -90?"),
        ("", "the file must be a list|holds no shape"),
        ("- {box: [1, 1, 1]}", "shape 1: the key 'position' is missing"),
        ("- {box: [1, 1], position: [0, 0, 0]}", "box of shape 1 must be 3 finite numbers"),
        ("- {box: [1, 1, -1], position: [0, 0, 0]}", "the size of 'box' must be three positive"),
        (
            "- {position: [0, 0, 0]}",
            "shape 1 must have one of box, sphere, cylinder, half_space, points; it has 'position'",
        ),
        ("- {box: [1, 1, 1], sphere: 1, position: [0, 0, 0]}", "it has 'box' and 'sphere'"),
        ("- {sphere: 0.1, position: [0, 0, 0], colour: red}", "unknown key in shape 1 'colour'"),
        ("- {sphere: -0.1, position: [0, 0, 0]}", "sphere of shape 1 must be positive"),
        ("- {cylinder: {radius: 0.1}, position: [0, 0, 0]}", "the key 'height' is missing"),
        ("- {boxx: [1, 1, 1], colour: red}", "one of box, .*; it has 'boxx' and 'colour'"),
        ("- {points: none.npz}", "none.npz' is not an npz with an array 'points' .*: there is no such file"),
        ("- [1, 2]", "shape 1 must be a mapping"),
        ("- {sphere: 1, position: [0, 0, 1], position: [0, 0, 2]}", "the key 'position' is there twice"),
        ("box: [", "is not YAML"),
        ("- {{sphere: 0.04}, position: [0.2, 0, 0.1]}", "is not YAML: .* unhashable key"),
        (f"- {{sphere: 1{'0' * 400}, position: [0, 0, 0]}}", "sphere of shape 1 must be a finite number"),
        ("- {sphere: 0.1, position: [0.2]}", "position of shape 1 must be 3 finite numbers"),
        ("- {sphere: 0.1, position: 0.2}", "position of shape 1 must be 3 finite numbers, not 0.2"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path, text, said):
    file = tmp_path / "wrong.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=said) as error:
        load_shapes(file)
    assert str(error.value).startswith(f"{file}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda data: b"", "is not an npz"),
        (lambda data: data[:2], "is not an npz"),
        (lambda data: data[: len(data) // 2], "is not an npz"),
        (lambda data: data.replace(b"\x00\x00\xe0?", b"\x00\x00\xe0>", 1), "cannot be read"),
        (lambda data: b"0.1 0.2 0.3\n", "is not an npz"),
    ],
)
def test_a_damaged_file_of_points_is_refused_in_one_line(folder, damage, said):
    whole = (folder / "marked.npz").read_bytes()
    (folder / "marked.npz").write_bytes(damage(whole))
    assert (folder / "marked.npz").read_bytes() != whole
    with pytest.raises(InputError, match=rf"shape 5: '.*marked.npz' {said}") as error:
        load_shapes(folder / "shapes.yaml")
    assert "\n" not in str(error.value)
    assert "pickle" not in str(error.value)


@pytest.mark.parametrize("points", [np.array([None]), np.array(["a"]), None])
def test_points_that_are_no_numbers_are_refused_without_a_word_on_pickles(folder, points):
    np.savez(folder / "marked.npz", **({"other": np.zeros(3)} if points is None else {"points": points}))
    with pytest.raises(InputError, match=r"holds objects|'points' must be an array|with an array 'points'") as error:
        load_shapes(folder / "shapes.yaml")
    assert "pickle" not in str(error.value)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        load_shapes(tmp_path / "none.yaml")


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.zeros(3), np.full((2, 3), np.nan), np.zeros((6000, 3))])
def test_marked_points_must_be_some_points(points):
    with pytest.raises(
        InputError, match=r"must be (1 to 5000 finite points|an array of real numbers of shape \(N, 3\))"
    ):
        painted(points, 0.01)


def test_surroundings_are_the_same_after_json(folder):
    import json

    shapes = load_shapes(folder / "shapes.yaml")
    told = json.loads(json.dumps(Surroundings(shapes, shapes[:1], shapes[1:2]).plain()))
    back = Surroundings.restored(told)
    P = np.random.default_rng(0).uniform(-1, 1, (30, 3))
    for before, after in zip(shapes, back.obstacles, strict=True):
        np.testing.assert_array_equal(before.distance(P), after.distance(P))
        assert before.name == after.name
    assert (len(back.avoid), len(back.touch)) == (1, 1)
    assert Surroundings.restored({}).plain() == NOWHERE.plain()


def around(**kinds) -> None:
    Surroundings(**kinds).check(observation())


@pytest.mark.parametrize(
    ("kinds", "said"),
    [
        ({"obstacles": (Shape.box([0, 0, 0.04], [0.1, 0.1, 0.1], name="crate"),)}, "'crate' holds .* points; is it in"),
        ({"obstacles": (Shape.box([110, 0, 60], [60, 200, 120], name="crate"),)}, "more than 10 m .*; is it in metres"),
        ({"avoid": (Shape.sphere([0, 0, 0.04], 0.3),)}, "--avoid leaves nothing of the object to touch"),
        ({"avoid": (Shape.sphere([0.8, 0, 0.04], 0.05),)}, "'sphere' of --avoid is 0.7. m from the object; is it in"),
        ({"touch": (Shape.sphere([0.3, 0, 0.04], 0.05),)}, "--touch leaves nothing of the object to touch"),
    ],
)
def test_surroundings_that_cannot_be_meant_so_are_refused(kinds, said):
    with pytest.raises(InputError, match=said):
        around(**kinds)


def test_surroundings_beside_the_object_and_regions_on_it_are_taken():
    beside, half = Shape.box([0.1, 0, 0.05], [0.06, 0.2, 0.1]), Shape.half_space([0, 0, 0.04], [0, 0, 1])
    wall = Shape.half_space([-0.2, 0, 0], [1, 0, 0])
    around(obstacles=(beside, wall), avoid=(half,), touch=(half,))
