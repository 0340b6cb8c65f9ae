"""Figures of the studies: vector and pixels, the same bytes again, greys alone."""

import re

import pytest

from sgnlp.plots import COLUMNS, Panel, Series, draw

pytest.importorskip("matplotlib")

LINES = Panel(
    "a", "x [m]", "y", (Series("one", [0, 1], [0.0, 1.0], [0.0, 0.5], [0.5, 1.5]), Series("two", [0, 1], [1, 0]))
)
BARS = Panel(
    "b", "x", "y", (Series("one", ["p", "q"], [1, 2], [0, 1], [2, 3]), Series("two", ["p", "q"], [2, 1])), bars=True
)


def test_a_figure_is_a_vector_drawing_and_a_picture():
    files = draw([LINES, BARS])
    assert files["svg"].startswith(b"<?xml")
    assert files["png"].startswith(b"\x89PNG")


def test_the_same_panels_give_the_same_drawing():
    assert draw([LINES, BARS])["svg"] == draw([LINES, BARS])["svg"]


def test_a_drawing_has_no_colour():
    colours = set(re.findall(r"(?:fill|stroke): #([0-9a-f]{6})", draw([LINES, BARS])["svg"].decode()))
    assert colours
    assert all(colour[:2] == colour[2:4] == colour[4:] for colour in colours)


def test_more_series_than_styles_are_all_drawn():
    many = tuple(Series(str(i), [0, 1], [i, i]) for i in range(8))
    assert draw([Panel("many", "x", "y", many), Panel("bars", "x", "y", many, bars=True)])


@pytest.mark.parametrize(("count", "shape"), [(4, (2, 2)), (5, (2, 3))])
def test_panels_stand_in_rows_as_even_as_can_be(count, shape):
    width, height = re.findall(rb'(?:width|height)="([\d.]+)pt"', draw([LINES] * count)["svg"])
    assert shape[1] <= COLUMNS
    one = re.findall(rb'(?:width|height)="([\d.]+)pt"', draw([LINES])["svg"])
    assert (float(height) / float(one[1]), float(width) / float(one[0])) == pytest.approx(shape)
