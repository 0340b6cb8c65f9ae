"""The violated rows of a nonlinear program, by name and in physical units."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.program.nlp import Nlp


@dataclass(frozen=True)
class Violation:
    """A row with a `value` beyond its `limit`, both in `unit`; `size` is the violation in the scale of the row."""

    name: str
    value: float
    limit: float
    unit: str
    size: float


def violations(
    nlp: Nlp, rows: Callable[[Array], Array], x: Array, g_bounds: tuple[Array, Array], tolerance: float
) -> tuple[Violation, ...]:
    """The rows that are more than `tolerance` outside their scaled bounds (ng,) at x (nx,), the worst first.

    `rows` gives g (ng,) at x; in an elastic program they are taken without slacks.
    """
    g = rows(nlp.structure.formulation.strict(nlp, x))
    owners = [c for c, size in zip(nlp.constraints, nlp.row_sizes, strict=True) for _ in range(size)]
    limits = np.clip(g, *g_bounds)
    found = []
    for i in np.flatnonzero(~(np.abs(g - limits) <= tolerance)):
        value, limit = (owners[i].reading(owners[i].scale * float(row)) for row in (g[i], limits[i]))
        found.append(Violation(nlp.row_names[i], value, limit, owners[i].symbol, float(abs(g[i] - limits[i]))))
    return tuple(sorted(found, key=lambda v: -v.size))
