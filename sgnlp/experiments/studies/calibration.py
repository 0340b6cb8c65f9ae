"""The calibration study: do the intervals of the implicit surface hold as much of the truth as they promise?

At points of the true surface that a fingertip can touch, and at the centre of the pad that touches there, the metric
distance d = μ/|∇μ| with its deviation σ_d = σ/|∇μ| against the true signed distance d*. Kernels, their length and the
noise of a measured point are varied, and a factor on σ_d is fitted on half of the objects and judged on the others.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from sgnlp.base.errors import InputError
from sgnlp.experiments.studies.coverage import (
    LEVELS,
    QUANTILES,
    coverage,
    factor,
    half_width,
    kept_coverage,
    quantiles,
)
from sgnlp.experiments.studies.study import Lines, Setup, Study, Tables, body, over_views
from sgnlp.perception.observation import Observation, load
from sgnlp.perception.synthetic.meshes import Mesh
from sgnlp.perception.synthetic.truth import signed_distance, surface_samples
from sgnlp.show.plots import Panel, Series
from sgnlp.surface.gpis import Gpis, fit
from sgnlp.surface.kernels import KERNELS
from sgnlp.surface.training import training_set

Array = NDArray[np.float64]

SAMPLES = 1000
"""Points drawn on each true surface, of which those out of reach are left out."""
PAD = 0.012
"""Radius of a fingertip's pad [m]."""
OFFSETS = (0.0, PAD)
"""Queries: points of the surface moved along the normal by this [m]."""
CLEAR = 0.99
"""A pad is clear of the rest of the object if its centre is this share of its radius away from all of it."""
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
    """Points where a pad can be: clear of the table and of all the object but the point.

    Raises:
        InputError: the problem does not bring its true surface along.
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


def halves(rows: Sequence[Row]) -> tuple[list[str], list[str]]:
    """Every other body in the order of their names, and the others; the poses NAME_0, NAME_1 … are one body's."""
    bodies = sorted({body(row.object) for row in rows})
    return bodies[::2], bodies[1::2]


def as_set(rows: Sequence[Row]) -> list[Row]:
    """The rows of the length and noise as they are set."""
    noise = max(row.noise_mm for row in rows)
    return [row for row in rows if (row.noise_mm, row.length) == (noise, 1.0)]


def groups(rows: Sequence[Row]) -> list[list[Row]]:
    """The rows of each side and offset: what a factor is to serve alike."""
    found: dict[tuple[str, float], list[Row]] = {}
    for row in rows:
        found.setdefault((row.side, row.offset_mm), []).append(row)
    return [found[key] for key in sorted(found)]


def mean(rows: Sequence[Row], field: str) -> float:
    """Mean of a field over all points."""
    return float(np.average([getattr(row, field) for row in rows], weights=[row.points for row in rows]))


def kept(rows: Sequence[Row]) -> tuple[list[str], list[int]]:
    """The quantiles of rows, and the points that each stands for."""
    return [row.z for row in rows], [row.points for row in rows]


def coverage_table(rows: Sequence[Row]) -> Lines:
    """Coverage and error as things are set: a line for each kernel, number of cameras, side and offset."""
    lines = []
    for kernel, count in product(KERNELS, sorted({len(row.views.split()) for row in rows})):
        for group in groups([row for row in as_set(rows) if (row.kernel, len(row.views.split())) == (kernel, count)]):
            lines.append(
                {"kernel": kernel, "cameras": str(count), "side": group[0].side}
                | {"offset [mm]": f"{group[0].offset_mm:.0f}", "points": str(sum(row.points for row in group))}
                | {f"within {100 * q:.0f} %": f"{100 * mean(group, f'within{100 * q:.0f}'):.0f}" for q in LEVELS}
                | {f"{name} [mm]": f"{mean(group, f'{name}_mm'):.1f}" for name in ("bias", "error", "sigma")}
            )
    return lines


def factor_table(rows: Sequence[Row]) -> Lines:
    """For each kernel, noise and length the factor fitted on one half, and what it does on the other.

    Beside it the factors that each side alone would have, and the other half. Width is half the 90 % interval with the
    factor, on the mean. `best` marks the least error of a kernel on the fitting half, the mean over sides and offsets.
    """
    fitted, judged = halves(rows)
    lines = []
    for kernel in KERNELS:
        variants = dict.fromkeys((row.noise_mm, row.length) for row in rows if row.kernel == kernel)
        chosen = [[row for row in rows if (row.kernel, row.noise_mm, row.length) == (kernel, *v)] for v in variants]
        tuned = [[row for row in variant if body(row.object) in fitted] for variant in chosen]
        other = [[row for row in variant if body(row.object) in judged] for variant in chosen]
        errors = [np.mean([mean(group, "error_mm") for group in groups(half)]) for half in tuned]
        for half, rest, error in zip(tuned, other, errors, strict=True):
            lines.append(_factor_line(half, rest) | {"best": "yes" if error == min(errors) else ""})
    return lines


def _factor_line(tuned: Sequence[Row], judged: Sequence[Row]) -> dict[str, str]:
    """The line of a kernel, noise and length: rows of both halves."""
    s = factor([kept(group) for group in groups(tuned)])
    sides = [[row for row in judged if row.side == side] for side in SIDES]
    own = [factor([kept(g) for g in groups([row for row in tuned if row.side == side])]) for side in SIDES]
    line = {"kernel": tuned[0].kernel, "noise [mm]": f"{tuned[0].noise_mm:g}", "length": f"{tuned[0].length:g}"}
    line |= {"factor": f"{s:.2f}", "seen / unseen": " / ".join(f"{f:.2f}" for f in own)}
    line["other half's"] = f"{factor([kept(group) for group in groups(judged)]):.2f}"
    for side, there in zip(SIDES, sides, strict=True):
        shares = (float(kept_coverage(*kept(there), level, s)[0]) for level in LEVELS)
        line[f"{side}: within 50, 90, 95 %"] = ", ".join(f"{100 * share:.0f}" for share in shares)
    line["error [mm]"] = " / ".join(f"{mean(there, 'error_mm'):.1f}" for there in sides)
    widths = [s * half_width(0.9) * mean(there, "sigma_mm") for there in sides]
    return line | {"width [mm]": " / ".join(f"{width:.1f}" for width in widths)}


def tables(rows: Sequence[Row]) -> Tables:
    """Coverage as things are set, and the factors where there are objects for both halves."""
    found = {"Coverage and error as set": coverage_table(rows)}
    fitted, judged = halves(rows)
    if judged:
        names = f"fitted on {', '.join(fitted)}; judged on {', '.join(judged)}"
        found[f"Factor on the deviation, {names}"] = factor_table(rows)
    return found


LABELS = {name: name.replace("_", " ") for name in KERNELS} | {"matern32": "Matérn 3/2", "matern52": "Matérn 5/2"}
"""Names of the kernels in the figure."""


def panels(rows: Sequence[Row]) -> list[Panel]:
    """Coverage over level for each side and offset, as things are set: a line for each kernel."""
    levels = [q for q in QUANTILES if 0 < q < 1]
    shown = []
    for group in groups(as_set(rows)):
        side, offset = group[0].side, group[0].offset_mm
        series = tuple(
            Series(LABELS.get(kernel, kernel), [100 * q for q in levels], [_share(group, kernel, q) for q in levels])
            for kernel in KERNELS
        )
        title = f"{side}, {offset:.0f} mm outside" if offset else f"{side}, on the surface"
        shown.append(Panel(title, "level [%]", "within [%]", series, diagonal=True, y_range=(0, 102)))
    return shown


def _share(rows: Sequence[Row], kernel: str, level: float) -> float:
    return 100 * float(kept_coverage(*kept([row for row in rows if row.kernel == kernel]), level)[0])


def facts(setup: Setup) -> dict[str, Any]:
    """Seed, settings of the surface, and how clouds are cleaned."""
    gpis = {name: value for name, value in asdict(setup.settings.gpis).items() if name != "kernel"}
    return {"seed": setup.seed, "gpis": gpis, "cleaning": setup.facts()["cleaning"]}


STUDY = Study(
    question="do the intervals of the implicit surface hold as much of the truth as they promise?",
    row=Row,
    cases=partial(over_views, rows_of),
    tables=tables,
    panels=panels,
    caption=(
        "Share of the true surface within intervals of a level, by kernel as set, on the objects that no factor "
        "was fitted on; on the grey diagonal an interval holds what it promises."
    ),
    facts=facts,
)
