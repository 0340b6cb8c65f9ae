"""The compiled jets: the same numbers as NumPy's, the same bits every time, and NumPy where there is no compiler."""

import numpy as np
import pytest
from scenes import SMALL, posed, sphere_points, surface

from sgnlp.base import c_library, toolchain
from sgnlp.program.formulations import formulation
from sgnlp.program.nlp import build
from sgnlp.program.oracle import Surface
from sgnlp.surface import native
from sgnlp.surface.gpis import MEAN_JET, VARIANCE_JET


def both_steps(jets, Z, uncertain):
    """Jets of the mean (Q, 20) and the variance (uncertain, 10) in two steps."""
    Z = np.asfortranarray(Z)
    mean, variance = np.full((len(Z), MEAN_JET), np.nan), np.full((uncertain, VARIANCE_JET), np.nan)
    jets.values(Z, mean, variance)
    jets.derivatives(Z, mean, variance)
    return mean, variance


def test_a_points_jet_does_not_depend_on_its_neighbours_and_is_the_same_every_time(library):
    gpis = surface()
    jets, Z = native.NativeJets(library, gpis, 30), gpis.centre + 0.05 * sphere_points(30, 2)
    mean, variance = both_steps(jets, Z, 30)
    for _ in range(2):
        again = both_steps(jets, Z[::-1], 30)
        np.testing.assert_array_equal(again[0][::-1], mean)
        np.testing.assert_array_equal(again[1][::-1], variance)


def test_without_variance_points_the_mean_is_the_same(library):
    gpis = surface()
    jets, Z = native.NativeJets(library, gpis, 0), gpis.centre + 0.05 * sphere_points(9, 3)
    mean, variance = both_steps(jets, Z, 0)
    assert variance.shape == (0, 10)
    np.testing.assert_allclose(mean, gpis.mean_jet(Z), rtol=1e-8, atol=1e-8)


def test_values_taken_elsewhere_without_variance_do_not_disturb_the_derivatives(library):
    gpis = surface()
    jets, Z = native.NativeJets(library, gpis, 30), np.asfortranarray(gpis.centre + 0.05 * sphere_points(30, 2))
    expected = both_steps(jets, Z, 30)
    found = np.zeros((30, MEAN_JET)), np.zeros((30, VARIANCE_JET))
    jets.values(Z, *found)
    jets.values(Z + 0.01, np.zeros((30, MEAN_JET)), np.zeros((0, VARIANCE_JET)))
    jets.derivatives(Z, *found)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.fixture
def no_library():
    """The library forgotten before the test, and again after it."""
    c_library.attempt.cache_clear()
    yield
    c_library.attempt.cache_clear()


def test_without_a_compiler_the_surface_is_numpys(no_library, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    assert native.LIBRARY.load() is None
    nlp = build(posed(SMALL).hand, posed(SMALL).structure(formulation("penalty")))
    layout = nlp.layout
    jets = Surface(surface(), layout, nlp.jets)
    Z = surface().centre + 0.05 * sphere_points(layout.points - layout.m, 0)
    jets.update(Z, np.full(layout.m, 0.012), np.empty((0, 3)), complete=True)
    assert all(np.isfinite(block).all() and block.any() for block in jets.jets[:-1])


def test_a_compiler_that_fails_leaves_nothing_in_the_cache(no_library, monkeypatch, tmp_path):
    fake = tmp_path / "cc"
    fake.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    fake.chmod(0o755)
    monkeypatch.setenv("CC", str(fake))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert native.LIBRARY.load() is None
    assert not [path for path in (tmp_path / "cache").rglob("*") if path.is_file()]


def test_a_build_is_kept_and_found_again(library, no_library, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert native.LIBRARY.load() is not None
    (built,) = tmp_path.rglob("*.so")
    before = built.stat().st_mtime_ns
    c_library.attempt.cache_clear()
    assert native.LIBRARY.load() is not None
    assert built.stat().st_mtime_ns == before
    assert list(built.parent.iterdir()) == [built]


def test_a_damaged_library_is_built_again_and_never_loaded(library, no_library, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert native.LIBRARY.load() is not None
    (built,) = tmp_path.rglob("*.so")
    good = built.read_bytes()
    for damaged in (good[: len(good) // 2], b"", b"x" * len(good), good[:-1]):
        built.unlink()  # not in place: this process has it loaded
        built.write_bytes(damaged)
        c_library.attempt.cache_clear()
        assert native.LIBRARY.load() is not None
        assert toolchain.note_of(built) == b""


def test_why_there_is_no_library_is_told_with_what_to_do(no_library, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("CC", "no-such-compiler")
    assert native.LIBRARY.fault().startswith("no C compiler: $CC is 'no-such-compiler'")
    assert "unset CC" in native.LIBRARY.fault()
