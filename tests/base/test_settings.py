"""Presets, their variants, and what settings refuse."""

from dataclasses import fields, replace
from fractions import Fraction

import numpy as np
import pytest

from sgnlp.base.checked import Checked
from sgnlp.base.errors import InputError
from sgnlp.base.presets import PAPER, PRESETS, ROBUST, VARIANTS, preset
from sgnlp.base.settings import Contact, Settings
from sgnlp.base.surface_settings import GpisSettings
from sgnlp.simulation.settings import SimulationSettings


def changed(before: object, after: object, prefix: str = "") -> set[str]:
    """The names of the settings that differ."""
    names: set[str] = set()
    for f in fields(before):
        a, b = getattr(before, f.name), getattr(after, f.name)
        names |= (
            changed(a, b, f"{f.name}.")
            if hasattr(a, "__dataclass_fields__")
            else {prefix + f.name}
            if a != b
            else set()
        )
    return names


CLOSURE = ("contact.metric", "rank_by", "weights.uncer", "solver.expect_infeasible")
CHANGES = {
    "bilevel-high": {*CLOSURE, "limits.gain_fixed"},
    "bilevel-low": {*CLOSURE, "limits.gain_fixed"},
    "bilevel-heuristic": {*CLOSURE, "contact.heuristic"},
    "uncertainty": {"weights.uncer", "smoothing.deviation"},
    "no-uncertainty": {"weights.uncer"},
    "no-pregrasp": {"contact.c", "closing.planned", "limits.place_error"},
    "no-contact": {"closing.planned", "limits.place_error"},
    "no-pad": {"contact.pad"},
    "printed-equilibrium": {"contact.equilibrium"},
    "lift": {"weights.pose"},
}


SAME = {
    "robust": {"no-uncertainty": {"weights.uncer"}},
    "paper": {
        "no-pregrasp": {"closing.planned", "limits.place_error"},
        "no-contact": {"closing.planned", "limits.place_error"},
        **{name: {"weights.uncer"} for name in ("uncertainty", "bilevel-high", "bilevel-low", "bilevel-heuristic")},
    },
}
"""What a preset has already as a variant sets it: `robust` no E_uncer, `paper` nothing of the hand at contact."""


@pytest.mark.parametrize("base", ["robust", "paper"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_variant_changes_what_it_is_about_and_nothing_else(variant, base):
    found = changed(preset(base), preset(f"{base}+{variant}"))
    assert found == CHANGES[variant] - SAME[base].get(variant, set())


def test_a_variant_alone_is_one_of_the_robust_preset_and_variants_add_up():
    assert preset("no-pregrasp") == preset("robust+no-pregrasp") == PRESETS["no-pregrasp"] != ROBUST
    both = preset("paper+no-pregrasp+no-uncertainty")
    assert changed(PAPER, both) == {"contact.c", "weights.uncer"}
    assert (both.contact.c, both.weights.uncer) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nope", "unknown preset 'nope'; valid: bilevel-heuristic, .*paper"),
        ("paper+nope", "unknown variant of a preset 'nope'; valid: bilevel-heuristic, .*printed-equilibrium"),
        ("paper+robust", "unknown variant of a preset 'robust'"),
        ("paper+", "unknown variant of a preset ''"),
        ("", "unknown preset ''"),
    ],
)
def test_an_unknown_preset_or_variant_names_the_valid_ones(name, message):
    with pytest.raises(InputError, match=message):
        preset(name)


@pytest.mark.parametrize("field", ["displacement", "rotation"])
@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_each_number_of_a_vector_must_be_finite(field, number):
    with pytest.raises(InputError, match=rf"--contact.{field} must be a finite number, not {number}"):
        replace(Contact(), **{field: (0.0, number, 0.0)})


@pytest.mark.parametrize(
    ("kind", "field", "value", "said"),
    [
        (Contact, "mass", "0.3", "--contact.mass must be a number, not '0.3'"),
        (Contact, "mass", [0.3], r"--contact.mass must be a number, not \(0.3,\)"),
        (Contact, "mass", None, "--contact.mass must be a number, not None"),
        (Contact, "mass", Fraction(1, 2), r"--contact.mass must be a number, not Fraction\(1, 2\)"),
        (Contact, "friction", True, "--contact.friction must be a number, not True"),
        (Contact, "samples", 10.0, "--contact.samples must be a whole number, not 10.0"),
        (Contact, "pad", 1, "--contact.pad must be True or False, not 1"),
        (Contact, "displacement", 0.01, "--contact.displacement must be a tuple of 3, each part a number, not 0.01"),
        (Contact, "rotation", (0.0, 1.0), "--contact.rotation must be a tuple of 3"),
        (Contact, "rotation", (0.0, 1.0, "2"), "--contact.rotation must be a tuple of 3"),
        (GpisSettings, "kernel", None, "--gpis.kernel must be a text, not None"),
        (Settings, "contact", {"mass": 0.3}, "--contact must be of Contact, not {'mass': 0.3}"),
        (Settings, "rank_by", ["margin"], "unknown value of --rank-by"),
    ],
)
def test_a_setting_of_another_kind_is_refused_with_its_name_its_value_and_what_is_valid(kind, field, value, said):
    with pytest.raises(InputError, match=said):
        kind(**{field: value})


def test_whole_numbers_numpys_numbers_and_lists_of_json_are_taken_as_plain_ones():
    rotation = [np.float32(0), np.int64(0), 1]
    made = Contact(mass=np.float32(0.5), samples=np.int64(7), friction=1, rotation=rotation, displacement=np.zeros(3))
    assert made == Contact(mass=0.5, samples=7, friction=1.0, rotation=(0.0, 0.0, 1.0), displacement=(0.0, 0.0, 0.0))
    assert {type(made.mass), type(made.samples), type(made.displacement)} == {float, int, tuple}
    assert [type(part) for part in made.rotation] == [float, int, int]  # JSON takes no numbers of numpy
    single = Contact(mass=np.float32(0.1), displacement=np.array([0.1, 0, 1e-9], np.float32))
    assert (single.mass, single.displacement) == (0.1, (0.1, 0.0, 1e-9))  # as they are written


@pytest.mark.parametrize(
    ("section", "field", "value", "valid"),
    [
        ("limits", "table_margin", -1.0, "between -0.05 and 0.5, not -1"),
        ("limits", "object_margin", 2.0, "between -0.05 and 0.5, not 2"),
        ("closing", "margin", 3.0, "between -0.05 and 0.5, not 3"),
        ("contact", "friction", 50.0, "positive and at most 5, not 50"),
        ("contact", "mass", 1000.0, "between 0 and 100, not 1000"),
        ("contact", "displacement", (0.0, 0.0, 10.0), "between -1 and 1, not 10"),
        ("limits", "gain_max", 1e9, r"between 1 and 100000, not 1e\+09"),
        ("weights", "gain", 1e9, r"between 0 and 1e\+07, not 1e\+09"),
        ("motion", "speed", 100.0, "positive and at most 5, not 100"),
        ("gpis", "surface_noise", 5.0, "positive and at most 1, not 5"),
        ("free_space", "reserve", 6.0, "between 0 and 0.5, not 6"),
    ],
)
def test_a_number_that_its_quantity_cannot_have_is_refused_with_its_range(section, field, value, valid):
    name = f"--{section}.{field}".replace("_", "-")
    with pytest.raises(InputError, match=f"^{name} must be {valid}$"):
        replace(getattr(Settings(), section), **{field: value})


def test_every_number_of_the_settings_has_a_range():
    for section in fields(Settings):
        part = getattr(Settings(), section.name)
        for field in fields(part) if isinstance(part, Checked) else ():
            number = type(getattr(part, field.name)) in (int, float)
            assert not number or type(part).interval(field.name), f"{section.name}.{field.name}"


def test_the_ranges_of_masses_and_frictions_are_those_of_the_simulation():
    for given, valid in (
        ({"mass": 1000.0}, "positive and at most 100"),
        ({"friction": 50.0}, "positive and at most 5"),
    ):
        with pytest.raises(InputError, match=valid):
            SimulationSettings(**given)
