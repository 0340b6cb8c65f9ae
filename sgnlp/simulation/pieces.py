"""Convex pieces of a body: MuJoCo collides convex hulls, so a mesh that is not convex is decomposed (CoACD)."""

from contextlib import suppress
from pathlib import Path

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError, SgnlpError
from sgnlp.base.toolchain import cache_folder
from sgnlp.planning import results
from sgnlp.simulation.body import Body

CONVEX_SHARE = 0.995
"""A body that fills this share of its hull counts as convex; a round can of 64 sides fills 1."""
SEED = 0


def pieces(body: Body, error: float) -> list[Array]:
    """Vertices (v, 3) [m] of convex pieces whose union is the body up to a concavity of `error` [m].

    A body that is convex is one piece. The others are decomposed once and cached for the user.
    """
    from scipy.spatial import ConvexHull

    hull = ConvexHull(body.vertices)
    if body.volume > CONVEX_SHARE * hull.volume:
        return [body.vertices[hull.vertices]]
    file = cache_folder() / f"pieces-{body.digest[:24]}-{error:g}.npz"
    found = _load(file)
    if not found:
        found = _decompose(body, error)
        _save(file, found)
    return found


def _load(file: Path) -> list[Array]:
    """The pieces in a file; none if it is missing or damaged."""
    try:
        with np.load(file, allow_pickle=False) as data:
            return [data[name] for name in data]
    except Exception:  # a damaged archive can raise almost anything
        return []


def _decompose(body: Body, error: float) -> list[Array]:
    try:
        import coacd
    except ImportError:
        raise InputError(
            f"'{body.name}' is not convex; to cut it: pip install 'sgnlp[sim]', CoACD is missing"
        ) from None
    coacd.set_log_level("error")
    mesh = coacd.Mesh(body.vertices, body.faces)
    parts = coacd.run_coacd(mesh, threshold=error, real_metric=True, preprocess_mode="off", seed=SEED)
    return [np.asarray(vertices, float) for vertices, _ in parts]


def _save(file: Path, parts: list[Array]) -> None:
    """Write the file, unless the cache cannot be written."""
    with suppress(SgnlpError):
        results.write_bytes(file, results.npz({f"{i:03d}": part for i, part in enumerate(parts)}))
