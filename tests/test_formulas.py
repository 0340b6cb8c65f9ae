"""Formulas of the documentation: a name of several letters is one element, set upright and close."""

import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

pytest.importorskip("latex2mathml")
sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))

from formulas import mathml

NAMES = ("argmin", "tr", "det", "log", "diag", "softmax", "adj", "sign")


def elements(tex: str, display: str = "inline") -> list[tuple[str, str]]:
    """Tag and text of each element of a formula that has a text."""
    return [(e.tag.rpartition("}")[2], e.text) for e in ET.fromstring(mathml(tex, display)).iter() if e.text]


@pytest.mark.parametrize(
    "tex",
    [
        r"\operatorname{arg\,min}_R f",
        r"\operatorname*{arg\;min}_R f",
        r"\operatorname{argmin}_R f",
        r"\arg\min_R f",
        r"\arg\,\min_R f",
    ],
)
def test_argmin_is_one_element_however_it_is_written(tex):
    assert [text for tag, text in elements(tex) if tag in {"mi", "mo"}] == ["argmin", "R", "f"]


@pytest.mark.parametrize(
    "tex", [r"\mathrm{NAME}(B)", r"\operatorname{NAME}(B)", r"2\,\mathrm{NAME}\, B", r"\mathrm{ NAME }B"]
)
@pytest.mark.parametrize("name", NAMES)
def test_a_name_is_one_element_and_upright(tex, name):
    formula = mathml(tex.replace("NAME", name), "inline")
    assert [text for _, text in elements(tex.replace("NAME", name))].count(name) == 1
    assert "mathvariant" not in formula  # a name of one letter needs it, one of several does not


def test_a_subscript_of_letters_is_one_element_and_units_are_several():
    assert ("mi", "des") in elements(r"f_\mathrm{des}")
    assert [text for _, text in elements(r"\mathrm{N\,m}")] == ["N", "m"]


def test_what_a_name_is_applied_to_stands_a_thin_space_behind_it_and_a_bracket_does_not():
    assert mathml(r"\log x", "inline").count("<mspace") == 1
    assert mathml(r"\log(x)", "inline").count("<mspace") == 0
    assert mathml(r"\lambda\det B", "inline").count("<mspace") == 2


def test_what_is_minimised_over_stands_below_in_a_formula_of_its_own():
    assert "<munder>" in mathml(r"\operatorname{arg\,min}_R f", "block")
    assert "<munder>" not in mathml(r"\operatorname{arg\,min}_R f", "inline")
