"""The calibration study: do the intervals of the implicit surface hold as much of the truth as they promise?

The metric distance d = μ/|∇μ|, with its deviation σ_d = σ/|∇μ|, is compared with the true signed distance d*: at points
of the true surface that a fingertip can touch, and at the centre of the pad that touches there. Kernels, their length
and the noise of a measured point are varied. A factor on σ_d is fitted on half of the objects and judged on the others.

An interval of level q is ± s Φ⁻¹((1 + q)/2) σ; it is calibrated where a share q of the errors lies inside. The errors
are kept as quantiles, so that other intervals can be tried later.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from sgnlp.base.errors import InputError
from sgnlp.experiments.frames import Frame, Lines, Tables
from sgnlp.experiments.studies.study import Setup, Study, body, over_views
from sgnlp.perception.observation import Observation, load
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.truth import signed_distance, surface_samples
from sgnlp.show.plots import Panel, Series
from sgnlp.surface.gpis import Gpis, fit
from sgnlp.surface.kernels import KERNELS
from sgnlp.surface.training import training_set

Array = NDArray[np.float64]

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
VARIANTS = ((1.0, 1.0), (0.4, 1.0), (1.0, 0.5), (1.0, 0.25), (1.0, 0.18), (1.0, 0.125))
"""Factors tried on the noise of a measured point and on the kernel's length; the first is as things are set."""


@dataclass(frozen=True)
class Row:
    """A side of an object. Bias, error and sigma are means of d - d*, |d - d*| and σ_d; z is for `kept_coverage`."""

    object: str
    views: str
    kernel: str
    noise_mm: float
    length: float
    side: str
    offset_mm: float
    points: int
    within50: float
    within90: float
    within95: float
    bias_mm: float
    error_mm: float
    sigma_mm: float
    z: str


@dataclass(frozen=True)
class Truth:
    """Points of a surface (Q, 3) [m] that a fingertip can touch; queries (O, Q, 3), true distances (O, Q) [m] there."""

    points: Array
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
    return Truth(points[touched], queries, np.stack([signed_distance(mesh, Q) for Q in queries]))


def rows_of(setup: Setup, file: Path, views: list[str]) -> list[Row]:
    """Every kernel, noise and length on an object as some cameras see it."""
    observation = load(file, views=views)
    known = truth(observation, np.random.default_rng(setup.seed))
    seen = cdist(known.points, observation.points).min(axis=1) < SEEN
    rows = []
    for kernel, (noise, length) in product(KERNELS, VARIANTS):
        if kernel == "thin_plate" and length < 1:  # its R is no length: it must span the training set
            continue
        tried = replace(setup.settings.gpis, kernel=kernel, surface_noise=noise * setup.settings.gpis.surface_noise)
        training = training_set(observation, tried, setup.seed)
        prior = training.kernel
        gpis = fit(replace(training, kernel=replace(prior, support_radius=length * prior.support_radius)))
        key = (observation.name, " ".join(views), kernel, 1e3 * tried.surface_noise, length)
        rows += [Row(*key, *values) for values in _sides(gpis, known, seen)]
    return rows


def _sides(gpis: Gpis, known: Truth, seen: NDArray[np.bool_]) -> Iterator[tuple[Any, ...]]:
    """The rest of a row for each offset, and each side that has points."""
    for offset, queries, distances in zip(OFFSETS, known.queries, known.distances, strict=True):
        errors, deviations = gpis.distance(queries) - distances, gpis.distance_deviation(queries)
        for side, there in zip(SIDES, (seen, ~seen), strict=True):
            if there.any():
                e, s = errors[there], deviations[there]
                means = (round(1e3 * float(values.mean()), 3) for values in (e, np.abs(e), s))
                within = (round(coverage(e, s, level), 4) for level in LEVELS)
                yield side, 1e3 * offset, len(e), *within, *means, quantiles(e, s)


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


def halves(rows: Frame) -> tuple[list[str], list[str]]:
    """Every other body in the order of their names, and the others; the poses NAME_0, NAME_1 … are one body's."""
    bodies = sorted(set(map(body, rows.object)))
    return bodies[::2], bodies[1::2]


def as_set(rows: Frame) -> Frame:
    """The rows of the length and noise as they are set."""
    return rows[(rows.noise_mm == rows.noise_mm.max()) & (rows.length == 1.0)]


def mean(rows: Frame, field: str) -> float:
    """Mean of a field over all points."""
    return float(np.average(rows[field], weights=rows.points))


def fitted(rows: Frame) -> float:
    """The factor that serves every side and offset alike."""
    return factor([(group.z, group.points) for _, group in rows.groupby(["side", "offset_mm"])])


def coverage_table(rows: Frame) -> Lines:
    """Coverage and error as things are set: a line for each kernel, number of cameras, side and offset."""
    found, lines = as_set(rows), []
    cameras, kernels = found.views.str.split().str.len(), found.kernel.map(list(KERNELS).index)
    for (kernel, count, side, offset), group in found.groupby([kernels, cameras, found.side, found.offset_mm]):
        lines.append(
            {"kernel": list(KERNELS)[kernel], "cameras": str(count), "side": str(side)}
            | {"offset [mm]": f"{offset:.0f}", "points": str(group.points.sum())}
            | {f"within {100 * q:.0f} %": f"{100 * mean(group, f'within{100 * q:.0f}'):.0f}" for q in LEVELS}
            | {f"{name} [mm]": f"{mean(group, f'{name}_mm'):.1f}" for name in ("bias", "error", "sigma")}
        )
    return lines


def factor_table(rows: Frame) -> Lines:
    """For each kernel, noise and length the factor fitted on one half, and what it does on the other.

    Beside it stand the factors fitted on each side alone, and on the other half. Width is half the 90 % interval with
    the factor, on the mean. `best` marks the least error of a kernel on the fitting half, the mean over sides and
    offsets.
    """
    lines = []
    tuning = rows.object.map(body).isin(halves(rows)[0])
    for kernel in KERNELS:
        variants = rows[rows.kernel == kernel].groupby(["noise_mm", "length"], sort=False)
        pairs = [(found[tuning[found.index]], found[~tuning[found.index]]) for _, found in variants]
        errors = [np.mean([mean(g, "error_mm") for _, g in half.groupby(["side", "offset_mm"])]) for half, _ in pairs]
        for pair, error in zip(pairs, errors, strict=True):
            lines.append(_factor_line(*pair) | {"best": "yes" if error == min(errors) else ""})
    return lines


def _factor_line(tuned: Frame, judged: Frame) -> dict[str, str]:
    """The line of a kernel, noise and length: rows of both halves."""
    s, first = fitted(tuned), tuned.iloc[0]
    sides = {side: judged[judged.side == side] for side in SIDES}
    line = {"kernel": first.kernel, "noise [mm]": f"{first.noise_mm:g}", "length": f"{first.length:g}"}
    line["factor"] = f"{s:.2f}"
    line["seen / unseen"] = " / ".join(f"{fitted(tuned[tuned.side == side]):.2f}" for side in SIDES)
    line["other half's"] = f"{fitted(judged):.2f}"
    for side, there in sides.items():
        shares = (100 * float(kept_coverage(there.z, there.points, level, s)[0]) for level in LEVELS)
        line[f"{side}: within 50, 90, 95 %"] = ", ".join(f"{share:.0f}" for share in shares)
    line["error [mm]"] = " / ".join(f"{mean(there, 'error_mm'):.1f}" for there in sides.values())
    widths = (s * half_width(0.9) * mean(there, "sigma_mm") for there in sides.values())
    return line | {"width [mm]": " / ".join(f"{width:.1f}" for width in widths)}


def tables(rows: Frame) -> Tables:
    """Coverage as things are set, and the factors where there are objects for both halves."""
    found = {"Coverage and error as set": coverage_table(rows)}
    tuned, judged = halves(rows)
    if judged:
        names = f"fitted on {', '.join(tuned)}; judged on {', '.join(judged)}"
        found[f"Factor on the deviation, {names}"] = factor_table(rows)
    return found


LABELS = {name: name.replace("_", " ") for name in KERNELS} | {"matern32": "Matérn 3/2", "matern52": "Matérn 5/2"}
"""Names of the kernels in the figure."""


def panels(rows: Frame) -> list[Panel]:
    """Coverage over level for each side and offset, as things are set: a line for each kernel."""
    shown, levels = [], [q for q in QUANTILES if 0 < q < 1]
    for (side, offset), group in as_set(rows).groupby(["side", "offset_mm"]):
        series = []
        for kernel in KERNELS:
            own = group[group.kernel == kernel]
            shares = [100 * float(kept_coverage(own.z, own.points, level)[0]) for level in levels]
            series.append(Series(LABELS.get(kernel, kernel), [100 * q for q in levels], shares))
        title = f"{side}, {offset:.0f} mm outside" if offset else f"{side}, on the surface"
        shown.append(Panel(title, "level [%]", "within [%]", tuple(series), diagonal=True, y_range=(0, 102)))
    return shown


def facts(setup: Setup) -> dict[str, Any]:
    """Seed, settings of the surface, and how clouds are cleaned."""
    every = setup.facts()
    every["settings"]["gpis"].pop("kernel")
    return {"seed": setup.seed, "gpis": every["settings"]["gpis"], "cleaning": every["cleaning"]}


STUDY = Study(
    question="do the intervals of the implicit surface hold as much of the truth as they promise?",
    row=Row,
    cases=partial(over_views, rows_of),
    tables=tables,
    panels=panels,
    caption=(
        "Share of the true surface within intervals of a level, by kernel as set, on all objects; "
        "on the grey diagonal an interval holds what it promises."
    ),
    facts=facts,
)
