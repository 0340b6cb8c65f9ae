"""Figures of the studies: vector and pixels, the same bytes again, greys alone."""

import re

import pytest

from sgnlp.show.plots import BARS as LOOKS
from sgnlp.show.plots import COLUMNS, STYLES, Panel, Series, draw

pytest.importorskip("matplotlib")

LINES = Panel(
    "a", "x [m]", "y", (Series("one", [0, 1], [0.0, 1.0], [0.0, 0.5], [0.5, 1.5]), Series("two", [0, 1], [1, 0]))
)
BARS = Panel(
    "b", "x", "y", (Series("one", ["p", "q"], [1, 2], [0, 1], [2, 3]), Series("two", ["p", "q"], [2, 1])), bars=True
)


def svg(panels: list[Panel], **options: int) -> bytes:
    """The vector drawing alone."""
    return draw(panels, suffixes=("svg",), **options)["svg"]


def test_a_figure_is_a_vector_drawing_and_a_picture():
    files = draw([LINES, BARS])
    assert files["svg"].startswith(b"<?xml")
    assert files["png"].startswith(b"\x89PNG")


def test_the_same_panels_give_the_same_drawing():
    assert svg([LINES, BARS]) == svg([LINES, BARS]) == draw([LINES, BARS])["svg"]


def test_a_drawing_has_no_colour():
    colours = set(re.findall(r"(?:fill|stroke): #([0-9a-f]{6})", svg([LINES, BARS]).decode()))
    assert colours
    assert all(colour[:2] == colour[2:4] == colour[4:] for colour in colours)


def test_more_series_than_styles_are_all_drawn():
    many = tuple(Series(str(i), [0, 1], [i, i]) for i in range(8))
    assert svg([Panel("many", "x", "y", many), Panel("bars", "x", "y", many, bars=True)])


@pytest.mark.parametrize(("count", "shape"), [(4, (2, 2)), (5, (2, 3))])
def test_panels_stand_in_rows_as_even_as_can_be(count, shape):
    width, height = re.findall(rb'(?:width|height)="([\d.]+)pt"', svg([LINES] * count))
    assert shape[1] <= COLUMNS
    one = re.findall(rb'(?:width|height)="([\d.]+)pt"', svg([LINES]))
    assert (float(height) / float(one[1]), float(width) / float(one[0])) == pytest.approx(shape)


def test_series_are_told_apart_without_their_greys():
    assert len({str(line) for _, line, _ in STYLES}) == len({marker for _, _, marker in STYLES}) == len(STYLES)
    assert len(set(LOOKS)) == len(LOOKS)
    assert max(float(grey) for grey, _, _ in STYLES) <= 0.55  # paler ones fade on paper


def test_bars_with_long_names_lie_with_the_first_at_the_top():
    names = ["a first name that is long", "a second one"]
    panel = Panel("lying", "", "success [%]", (Series("one", names, [1, 2], [0, 1], [2, 3]),), bars=True)
    assert panel.lying
    assert not BARS.lying
    drawn = svg([panel]).decode()
    places = [drawn.index(f"<!-- {text} -->") for text in (*names, "success [%]")]
    assert drawn.index("matplotlib.axis_1") < places[2] < drawn.index("matplotlib.axis_2") < places[0] < places[1]


def test_the_caption_is_kept_in_both_files():
    files = draw([LINES], "What is seen.")
    assert all(b"What is seen." in content for content in files.values())


def test_a_logarithmic_panel_has_marks_and_as_many_columns_as_asked_for():
    panel = Panel("log", "x", "y", (Series("one", [0, 1], [1e-2, 1.0]),), log=True, marks=(0.5,))
    drawn = [svg([panel] * 2, columns=n) for n in (1, 2)]
    widths = [re.findall(rb'width="([\d.]+)pt"', one)[0] for one in drawn]
    assert float(widths[1]) == pytest.approx(2 * float(widths[0]))
    assert b"10^{-2}" in drawn[0]
