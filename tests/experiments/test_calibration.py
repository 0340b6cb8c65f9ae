"""Calibration: coverage of Gaussian errors as nominal, factors that are found again, and the study on a known body."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import observation

from sgnlp.base.errors import InputError
from sgnlp.base.presets import ROBUST
from sgnlp.experiments.frames import frame
from sgnlp.experiments.studies import calibration
from sgnlp.experiments.studies.calibration import (
    AS_SET,
    LEVELS,
    PAD,
    SURFACES,
    Row,
    Sum,
    Truth,
    coverage,
    factor,
    factor_table,
    half_width,
    kept_coverage,
    panels,
    quantiles,
    tables,
    truth,
)
from sgnlp.surface.gpis import fit
from sgnlp.surface.kernel import check
from sgnlp.surface.kernels import ThinPlate
from sgnlp.surface.training import training_set


def gaussian(scale: float, count: int = 20_000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Errors of a process that understates its deviations by a factor, and those deviations."""
    rng = np.random.default_rng(seed)
    deviations = rng.uniform(0.5, 4, count)
    return scale * deviations * rng.normal(size=count), deviations


def row(side: str = "seen", name: str = "mug", scale: float = 1.0, **change: object) -> Row:
    errors, deviations = gaussian(scale)
    within = [coverage(errors, deviations, level) for level in LEVELS]
    means = (errors.mean(), np.abs(errors).mean(), deviations.mean())
    kept = quantiles(errors, deviations)
    made = Row(name, "0", "tuning", AS_SET, side, 0.0, len(errors), *within, *means, 7.0, kept)
    return replace(made, **change)


@pytest.mark.parametrize("level", LEVELS)
def test_the_coverage_of_gaussian_errors_is_the_level(level):
    assert coverage(*gaussian(1.0), level) == pytest.approx(level, abs=0.01)
    assert coverage(*gaussian(2.0), level) < level - 0.1
    assert coverage(*gaussian(0.5), level) > level + 0.04


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("s", [0.5, 1.0, 2.0])
def test_quantiles_keep_the_coverage_of_intervals_of_any_width(level, s):
    errors, deviations = gaussian(1.0)
    kept = kept_coverage([quantiles(errors, deviations)], [1], level, s)[0]
    assert kept == pytest.approx(coverage(errors, s * deviations, level), abs=0.015)


def test_half_widths_are_those_of_the_normal_distribution():
    assert [half_width(level) for level in LEVELS] == pytest.approx([0.67449, 1.64485, 1.95996], abs=1e-5)


@pytest.mark.parametrize("scale", [0.2, 1.0, 5.0])
def test_the_factor_is_what_the_deviations_lack(scale):
    assert factor([([quantiles(*gaussian(scale))], [1])]) == pytest.approx(scale, rel=0.03)


def test_sets_count_by_their_points_and_groups_alike():
    wide, narrow = quantiles(*gaussian(0.5)), quantiles(*gaussian(2.0))
    assert kept_coverage([wide, narrow], [3, 1], 0.5)[0] == pytest.approx(0.75 * 0.823 + 0.25 * 0.264, abs=0.02)
    assert factor([([wide], [1]), ([narrow], [1000])]) == pytest.approx(factor([([wide], [7]), ([narrow], [1])]))


def test_only_what_a_fingertip_can_touch_is_asked_about(monkeypatch):
    pytest.importorskip("open3d")
    corners = np.array([[x, y, z] for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.1)])
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])
    box = replace(observation(), mesh_vertices=corners, mesh_faces=faces, table_height=0.0)
    known = truth(box, np.random.default_rng(0))
    assert known.points[:, 2].min() > PAD  # not the bottom, nor the walls just above the table
    assert len(known.points) == pytest.approx(1000 * (1 + 4 * 0.88) / 6, rel=0.05)
    assert known.distances[0] == pytest.approx(0, abs=1e-6)
    assert known.distances[1] == pytest.approx(PAD, abs=1e-6)
    with pytest.raises(InputError, match="comes without its true surface"):
        truth(observation(), np.random.default_rng(0))


def test_errors_are_measured_from_the_truth_on_each_side():
    gpis = fit(training_set(observation(), ROBUST.gpis, 0))
    points = observation().points[:40]
    known = Truth(
        points, gpis.normal(points), np.stack([points, points]), np.array([[0.001], [0.0]]) + np.zeros((2, 40))
    )
    seen = np.arange(40) < 30
    rows = list(calibration._sides(gpis, known, seen))
    assert [(side, offset, count) for side, offset, count, *_ in rows] == [
        *(("seen", 0.0, 30), ("unseen", 0.0, 10), ("seen", 12.0, 30), ("unseen", 12.0, 10))
    ]
    biases = [values[6] for values in rows]
    assert biases[0] == pytest.approx(biases[2] - 1.0, abs=2e-3)  # d - d*, in mm
    assert rows[0][7] >= abs(rows[0][6])
    assert rows[0][9] == pytest.approx(0, abs=0.3)  # degrees between the normals, up to the rounding of |∇μ| at 0
    assert np.isnan(rows[2][9])
    turned = replace(known, normals=-known.normals)
    assert next(calibration._sides(gpis, turned, seen))[9] == pytest.approx(180, abs=0.3)
    assert len(list(calibration._sides(gpis, known, np.ones(40, bool)))) == 2


def test_a_factor_fitted_on_one_half_is_judged_on_the_other():
    rows = [row(side, "a", 0.5, half=half) for side in ("seen", "unseen") for half in ("tuning", "held out")]
    (line,) = factor_table(frame(rows))
    assert float(line["factor"]) == pytest.approx(0.5, abs=0.02)
    assert [float(share) for share in line["seen: within 50, 90, 95 %"].split(", ")] == pytest.approx(
        [50, 90, 95], abs=2
    )
    scales = (("tuning", 0.5), ("held out", 1.0))
    rows = [row(side, "a", scale, half=half) for side in ("seen", "unseen") for half, scale in scales]
    (line,) = factor_table(frame(rows))
    assert float(line["factor"]) == pytest.approx(0.5, abs=0.02)  # of the tuning half, whatever the other is
    assert float(line["other half's"]) == pytest.approx(1, abs=0.03)
    assert [float(share) for share in line["unseen: within 50, 90, 95 %"].split(", ")] == pytest.approx(
        [26, 59, 67], abs=2
    )


def test_the_tables_need_both_halves_for_a_factor_and_the_figure_shows_each_side():
    rows = [row(side, surface=surface) for side in ("seen", "unseen") for surface in list(SURFACES)[:2]]
    found = tables(frame(rows))
    assert list(found) == [
        "Coverage and error on the surface, tuning half",
        "Coverage and error 12 mm outside, tuning half",
    ]
    lines, outside = found.values()
    assert outside == []
    assert [line["surface"] for line in lines] == [name for name in list(SURFACES)[:2] for _ in range(2)]
    assert [line["within 50 %"] for line in lines] == ["50"] * 4
    assert [line["angle [deg]"] for line in lines] == ["7"] * 4
    assert [panel.title for panel in panels(frame(rows))] == ["seen, on the surface", "unseen, on the surface"]
    assert panels(frame(rows))[0].series[0].y[5] == pytest.approx(50, abs=1)
    assert [series.label for series in panels(frame(rows))[0].series] == list(SURFACES)[:2]
    both = tables(frame([*rows, *(replace(r, half="held out") for r in rows)]))
    assert len(list(both.values())[-1]) == 2


def test_the_figure_is_of_the_held_out_half_where_there_is_one():
    rows = [row("seen", scale=scale, half=half) for half, scale in (("tuning", 1.0), ("held out", 3.0))]
    (panel,) = panels(frame(rows))
    assert panel.series[0].y[5] < 30


def test_the_sum_of_two_kernels_is_a_kernel():
    check(Sum(0.4, 0.1))
    a, b = ThinPlate(0.4, 0.1).radial(np.array([0.02]))[0], Sum(0.4, 0.1).radial(np.array([0.02]))[0]
    assert a < b < a + 0.01**2
