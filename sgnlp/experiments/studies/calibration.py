"""The calibration study: how close is the implicit surface to the truth, and do its intervals have their coverage?

The metric distance d = μ/|∇μ|, with its deviation σ_d = σ/|∇μ|, is compared with the true signed distance d*: at points
of the true surface that a fingertip can touch, and at the centre of a pad that touches there. The normal is compared
with the true one. The surface is fitted to the cloud alone, and with free space, with each kernel, with a sum of a
smooth and a short one, and without a guess of the hidden side.

An interval of level q is ± Φ⁻¹((1 + q)/2) σ_d; it is calibrated if a share q of the errors lies inside. The factor on
σ_d that comes nearest to this is fitted on the tuning half and judged on the other. The errors are kept as quantiles,
so that other intervals can be tried later.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError
from sgnlp.base.surface_settings import FreeSpace
from sgnlp.experiments.frames import Frame, Lines, Tables
from sgnlp.experiments.studies.study import Setup, Study, over_views
from sgnlp.experiments.studies.trials import HALVES
from sgnlp.perception.observation import Observation, load
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.truth import signed_distance, surface_samples
from sgnlp.show.plots import Panel, Series
from sgnlp.surface.gpis import Gpis, fit
from sgnlp.surface.kernel import Kernel, Radial
from sgnlp.surface.kernels import KERNELS, Matern52, ThinPlate, named
from sgnlp.surface.training import training_set

LEVELS = (0.5, 0.9, 0.95)
QUANTILES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
"""Shares of the errors at which |z| is kept, z = error/σ."""
FACTORS = np.geomspace(0.02, 20, 301)  # where the factor s is looked for, in steps of 2 %
SAMPLES = 1000  # points drawn on each true surface, of which those out of reach are left out
PAD = 0.012  # radius of a fingertip's pad [m]
OFFSETS = (0.0, PAD)  # queries: points of the surface moved along the normal by this [m]
CLEAR = 0.99  # A pad is clear of the rest of the object if its centre is this share of its radius away from all of it
SEEN = 0.005
"""A point of the surface nearer than this to a measured one is seen [m]: the paper's noise of a measured point."""
SIDES = ("seen", "unseen")
SHORT_LENGTH, SHORT_DEVIATION = 0.06, 0.01
"""R and σ0 of the short kernel in the sum [m]: details of some centimetres, a tenth of the smooth one's deviation."""


class Sum(Kernel):
    """The sum of a thin plate and a short Matérn 5/2 for details."""

    prior_mean_from_settings = True

    def radial(self, r: Any) -> Radial:
        """The sum of both, in every function."""
        smooth = ThinPlate(self.support_radius, self.amplitude).radial(r)
        short = Matern52(SHORT_LENGTH, SHORT_DEVIATION).radial(r)
        a, b, c, d = (x + y for x, y in zip(smooth, short, strict=True))
        return a, b, c, d


SURFACES: dict[str, tuple[str, bool, bool]] = {
    "cloud alone": ("thin_plate", False, False),
    **{f"free space, {name.replace('_', ' ')}": (name, True, True) for name in KERNELS},
    "free space, thin plate + short": ("sum", True, True),
    "free space without symmetry": ("thin_plate", True, False),
}
"""Each surface with its kernel, whether free space is used, and whether the hidden side is guessed by symmetry; the
second is that of `robust`."""
AS_SET = "free space, thin plate"


@dataclass(frozen=True)
class Row:
    """A side of an object. Bias, error and sigma are means of d - d*, |d - d*| and σ_d; angle of that of the normals.

    `angle_deg` is measured only on the surface, NaN off it; `z` is for `kept_coverage`.
    """

    object: str
    views: str
    half: str
    surface: str
    side: str
    offset_mm: float
    points: int
    within50: float
    within90: float
    within95: float
    bias_mm: float
    error_mm: float
    sigma_mm: float
    angle_deg: float
    z: str


@dataclass(frozen=True)
class Truth:
    """Points of a surface (Q, 3) [m] that a fingertip can touch, with outward normals (Q, 3).

    `queries` (O, Q, 3) are off them by each offset, with the true `distances` (O, Q) [m] there.
    """

    points: Array
    normals: Array
    queries: Array
    distances: Array


def truth(observation: Observation, rng: np.random.Generator) -> Truth:
    """Points where a pad can be: clear of the table, and of the object except at the point.

    Raises `InputError`: the problem does not bring its true surface along.
    """
    if observation.mesh_vertices is None or observation.mesh_faces is None:
        raise InputError(f"'{observation.name}' comes without its true surface, 'mesh_vertices' and 'mesh_faces'")
    mesh = Mesh(observation.mesh_vertices, observation.mesh_faces)
    points, normals = surface_samples(mesh, SAMPLES, rng)
    centres = points + PAD * normals
    touched = signed_distance(mesh, centres) > CLEAR * PAD
    touched &= centres[:, 2] > observation.table_height + PAD
    queries = np.stack([points + offset * normals for offset in OFFSETS])[:, touched]
    return Truth(points[touched], normals[touched], queries, np.stack([signed_distance(mesh, Q) for Q in queries]))


def rows_of(setup: Setup, file: Path, views: list[str]) -> list[Row]:
    """Every surface of an object as some cameras see it."""
    observation = load(file, views=views)
    known = truth(observation, np.random.default_rng(setup.seed))
    seen = cdist(known.points, observation.points).min(axis=1) < SEEN
    rows = []
    for name, (kernel, used, symmetry) in SURFACES.items():
        free_space = setup.settings.free_space if used else FreeSpace()
        free_space = free_space if symmetry else replace(free_space, symmetry_points=0)
        kind = Sum if kernel == "sum" else named(kernel)
        gpis = fit(training_set(observation, setup.settings.gpis, setup.seed, kind, free_space))
        key = (observation.name, " ".join(views), HALVES.get(observation.half, ""), name)
        rows += [Row(*key, *values) for values in _sides(gpis, known, seen)]
    return rows


def _sides(gpis: Gpis, known: Truth, seen: BoolArray) -> Iterator[tuple[Any, ...]]:
    """The rest of a row for each offset, and each side that has points."""
    cosines = (gpis.normal(known.points) * known.normals).sum(axis=1)
    angles = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
    for offset, queries, distances in zip(OFFSETS, known.queries, known.distances, strict=True):
        errors, deviations = gpis.distance(queries) - distances, gpis.distance_deviation(queries)
        for side, there in zip(SIDES, (seen, ~seen), strict=True):
            if there.any():
                e, s = errors[there], deviations[there]
                means = (round(1e3 * float(values.mean()), 3) for values in (e, np.abs(e), s))
                within = (round(coverage(e, s, level), 4) for level in LEVELS)
                angle = round(float(angles[there].mean()), 2) if offset == 0 else nan
                yield side, 1e3 * offset, len(e), *within, *means, angle, quantiles(e, s)


def half_width(level: float) -> float:
    """Φ⁻¹((1 + level)/2), half the interval of a level in deviations."""
    return NormalDist().inv_cdf((1 + level) / 2)


def coverage(errors: Array, deviations: Array, level: float) -> float:
    """Share of errors (Q,) inside their intervals."""
    return float((np.abs(errors) <= half_width(level) * deviations).mean())


def quantiles(errors: Array, deviations: Array) -> str:
    """The `QUANTILES` of |z|, as a text of three digits each."""
    return " ".join(f"{z:.3g}" for z in np.quantile(np.abs(errors) / deviations, QUANTILES))


def kept_coverage(texts: Sequence[str], points: Sequence[int], level: float, factors: float | Array = 1.0) -> Array:
    """Coverage over all points of several `quantiles`, of intervals widened by each factor s; to 1 % or so."""
    widths = half_width(level) * np.atleast_1d(factors)
    kept = [np.interp(widths, np.array(text.split(), float), QUANTILES, left=0.0) for text in texts]
    return np.average(kept, axis=0, weights=points)


def factor(groups: Sequence[tuple[Sequence[str], Sequence[int]]]) -> float:
    """The s that brings the coverage of every group, at all `LEVELS`, nearest to the levels in the mean square.

    A group is the `quantiles` and the numbers of points of several sets of errors.
    """
    misses = [(kept_coverage(*group, level, FACTORS) - level) ** 2 for group in groups for level in LEVELS]
    return float(FACTORS[np.mean(misses, axis=0).argmin()])


def mean(rows: Frame, field: str) -> float:
    """Mean of a field over all points."""
    return float(np.average(rows[field], weights=rows.points))


def fitted(rows: Frame) -> float:
    """The factor that serves every side and offset alike."""
    return factor([(group.z, group.points) for _, group in rows.groupby(["side", "offset_mm"])])


def coverage_table(rows: Frame, offset: float = 0.0) -> Lines:
    """Coverage and error at an offset [m]: a line for each surface, number of cameras and side."""
    found, lines = rows[rows.offset_mm == 1e3 * offset], []
    cameras, surfaces = found.views.str.split().str.len(), found.surface.map(list(SURFACES).index)
    for (surface, count, side), group in found.groupby([surfaces, cameras, found.side]):
        lines.append(
            {"surface": list(SURFACES)[surface], "cameras": str(count), "side": str(side)}
            | {"points": str(group.points.sum())}
            | {f"within {100 * q:.0f} %": f"{100 * mean(group, f'within{100 * q:.0f}'):.0f}" for q in LEVELS}
            | {f"{name} [mm]": f"{mean(group, f'{name}_mm'):.1f}" for name in ("bias", "error", "sigma")}
            | ({"angle [deg]": f"{mean(group, 'angle_deg'):.0f}"} if offset == 0 else {})
        )
    return lines


def factor_table(rows: Frame) -> Lines:
    """For each surface the factor fitted on the tuning half, and what it does on the other.

    Beside it stand the factors fitted on each side alone, and on the other half. Width is half the 90 % interval with
    the factor, on the mean.
    """
    halves = [rows[rows.half == half] for half in HALVES.values()]
    return [
        _factor_line(*(half[half.surface == surface] for half in halves))
        for surface in SURFACES
        if all((half.surface == surface).any() for half in halves)
    ]


def _factor_line(tuned: Frame, judged: Frame) -> dict[str, str]:
    """The line of a surface: rows of both halves."""
    s = fitted(tuned)
    sides = {side: judged[judged.side == side] for side in SIDES}
    line = {"surface": str(tuned.surface.iloc[0]), "factor": f"{s:.2f}"}
    line["seen / unseen"] = " / ".join(f"{fitted(tuned[tuned.side == side]):.2f}" for side in SIDES)
    line["other half's"] = f"{fitted(judged):.2f}"
    for side, there in sides.items():
        shares = (100 * float(kept_coverage(there.z, there.points, level, s)[0]) for level in LEVELS)
        line[f"{side}: within 50, 90, 95 %"] = ", ".join(f"{share:.0f}" for share in shares)
    line["error [mm]"] = " / ".join(f"{mean(there, 'error_mm'):.1f}" for there in sides.values())
    widths = (s * half_width(0.9) * mean(there, "sigma_mm") for there in sides.values())
    return line | {"width [mm]": " / ".join(f"{width:.1f}" for width in widths)}


def tables(rows: Frame) -> Tables:
    """Coverage on each half, on the surface and off it, and the factors that would mend it."""
    found: Tables = {}
    for half in rows.half.unique():
        name = f"{half} half" if half else "all objects"
        found[f"Coverage and error on the surface, {name}"] = coverage_table(rows[rows.half == half])
        found[f"Coverage and error {1e3 * PAD:.0f} mm outside, {name}"] = coverage_table(rows[rows.half == half], PAD)
    if lines := factor_table(rows):
        found["Factor on the deviation, fitted on the tuning half and judged on the held-out half"] = lines
    return found


def panels(rows: Frame) -> list[Panel]:
    """Coverage over level for each side and offset on the held-out half, if there is one: a line for each surface."""
    judged = rows[rows.half == HALVES["held_out"]]
    shown, levels = [], [q for q in QUANTILES if 0 < q < 1]
    for (side, offset), group in (judged if len(judged) else rows).groupby(["side", "offset_mm"]):
        series = []
        for surface in SURFACES:
            own = group[group.surface == surface]
            if len(own):
                shares = [100 * float(kept_coverage(own.z, own.points, level)[0]) for level in levels]
                series.append(Series(surface, [100 * q for q in levels], shares))
        title = f"{side}, {offset:.0f} mm outside" if offset else f"{side}, on the surface"
        shown.append(Panel(title, "level [%]", "within [%]", tuple(series), diagonal=True, y_range=(0, 102)))
    return shown


def facts(setup: Setup) -> dict[str, Any]:
    """Seed, settings of the surface, and how clouds are cleaned."""
    every = setup.facts()
    every["settings"]["gpis"].pop("kernel")
    kept = {name: every["settings"][name] for name in ("gpis", "free_space")}
    return {"seed": setup.seed, **kept, "cleaning": every["cleaning"]}


STUDY = Study(
    question="how near is the surface to the truth, and do its intervals hold as much of it as they promise?",
    row=Row,
    cases=partial(over_views, rows_of),
    tables=tables,
    panels=panels,
    caption=(
        "Share of the true surface within intervals of a level, on the held-out half; "
        "on the grey diagonal an interval holds what it promises."
    ),
    facts=facts,
)
