"""Splits the points above a table into clusters, joined by steps shorter than the gaps between bodies.

    DBSCAN (Ester et al. 1996) on the mean points of grid cells: a cell with enough other cells near it, and about as
    many points as they have, is a core. Cores near each other are in one cluster. Other cells near a core belong to its
    cluster.

A few flying pixels between two bodies are not cores and do not join them.
"""

import numpy as np
from scipy.ndimage import binary_closing, binary_fill_holes
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array, BoolArray, IntArray
from sgnlp.perception.sampling import grid_cells

CELL = 0.003
"""[m] Side of a grid cell: larger than a pixel at 1 m, so that near bodies do not take longer than far ones."""
LINK = 0.006
"""[m] Longest step that joins: half of a gap that no finger fits in, since noise fills the rest, and more than the
spacing of pixels at 1.5 m on a surface seen at 60 deg."""
SPARSE = 2.5
"""In a sparser cloud the longest step that joins is this many times the median distance of nearest neighbours."""
CORE = 4
"""Least number of cells near a core; a cell on a surface has a dozen, one on a body's edge half of them."""
DENSE = 0.25
"""A core has at least this share of the mean number of points of the cells near it; flying pixels have fewer."""
BODY_CELLS = 30
"""Fewest cells of a cluster that may absorb others as its parts."""
OVERLAP = 0.35
"""A cluster is part of another whose outline, seen from above, contains at least this share of it: the handle under a
lying mug, the far wall of a bowl. Bodies beside each other have less, even if a round one overhangs a low one."""
SCRAP, SCRAP_GAP = (8, 0.1), 0.02
"""A cluster with at least the first number of cells, at most this share of another cluster's, and no farther from it
than this [m], is a part that occlusion cut off from the other."""
SQUARE, CLOSED = 0.005, 3
"""[m] Side of the squares of an outline, and the half-width in squares of the gaps that are closed in it."""


def cells(points: Array, side: float) -> tuple[Array, IntArray, IntArray]:
    """The mean (c, 3) and number (c,) of the points (n, 3) in each grid cell, and the cell (n,) of each point."""
    _, cell, count = np.unique(grid_cells(points, side), return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(cell, column) for column in points.T], axis=1) / count[:, None]
    return means, count, cell


def clustered(points: Array) -> IntArray:
    """The cluster (n,) of each of the points (n, 3) in a frame with z up, -1 for none; numbers are in no order."""
    if len(points) == 0:
        return np.zeros(0, np.int64)
    means, count, cell = cells(points, CELL)
    tree = cKDTree(means)
    nearest = np.asarray(tree.query(means, k=min(2, len(means)))[0]).reshape(len(means), -1)[:, -1]
    link = max(LINK, SPARSE * float(np.median(nearest)))
    pairs = tree.query_pairs(link, output_type="ndarray")
    both = pairs.ravel()
    degree = np.bincount(both, minlength=len(means))
    around = np.bincount(both, count[pairs[:, ::-1].ravel()], minlength=len(means)) / np.maximum(degree, 1)
    core = (degree >= CORE) & (count >= DENSE * around)
    joined = pairs[core[pairs].all(axis=1)]
    graph = coo_array((np.ones(len(joined)), joined.T), (len(means), len(means)))
    number = connected_components(graph, directed=False)[1].astype(np.int64)
    number[~core] = -1
    border = pairs[core[pairs].sum(axis=1) == 1]
    flip = core[border[:, 1]]
    inner, outer = np.where(flip, border[:, 1], border[:, 0]), np.where(flip, border[:, 0], border[:, 1])
    number[outer] = number[inner]  # if there are several, the last one; the order is always the same
    return np.asarray(_whole(means, number)[cell])


def _whole(means: Array, number: IntArray) -> IntArray:
    """Join to each cluster the parts that are inside its outline, seen from above, and no higher than it.

    `means` (n, 3) are points with z up, `number` (n,) the cluster of each, negative for none.
    """
    there, count = np.unique(number[number >= 0], return_counts=True)
    order = [int(n) for n in there[np.argsort(-count, kind="stable")]]
    squares = np.floor(means[:, :2] / SQUARE).astype(np.int64)
    merged, taken = number.copy(), set[int]()
    for i, n in enumerate(order):
        mine = number == n
        if n in taken or mine.sum() < BODY_CELLS:
            continue
        low = squares[mine].min(axis=0) - CLOSED
        outline = _filled(squares[mine] - low)
        top = means[mine, 2].max() + LINK
        for part in order[i + 1 :]:
            its = number == part
            place = squares[its] - low
            at = place[((place >= 0) & (place < outline.shape)).all(axis=1)]
            inside = outline[at[:, 0], at[:, 1]].sum() / len(place)
            small = SCRAP[0] <= its.sum() <= SCRAP[1] * mine.sum() and _apart(means[its], means[mine]) <= SCRAP_GAP
            if part not in taken and (small or (inside >= OVERLAP and means[its, 2].min() <= top)):
                merged[its] = n
                taken.add(part)
    return merged


def _apart(some: Array, others: Array) -> float:
    """The least distance [m] between points (n, 3) and others (m, 3)."""
    return float(np.min(cKDTree(others).query(some)[0]))


def _filled(squares: IntArray) -> BoolArray:
    """The squares (n, 2) as a mask, its gaps and holes filled."""
    mask = np.zeros(squares.max(axis=0) + 1 + CLOSED, bool)
    mask[squares[:, 0], squares[:, 1]] = True
    return np.asarray(binary_fill_holes(binary_closing(mask, np.ones((3, 3), bool), iterations=CLOSED)))
