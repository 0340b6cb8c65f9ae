"""What stands on a table, parted into clusters: points that are joined by steps shorter than the gaps between bodies.

    DBSCAN (Ester et al. 1996) on the means of the points in the cells of a grid: a cell with enough others near it,
    and about as many points as they have, is a core, cores near each other are of one cluster, and what is near a core
    belongs to it.

A few flying pixels between two bodies are no core and do not join them.
"""

import numpy as np
from scipy.ndimage import binary_closing, binary_fill_holes
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sgnlp.base.arrays import Array, BoolArray, IntArray
from sgnlp.perception.sampling import grid_cells

CELL = 0.003
"""[m] Side of a cell of the grid: larger than a pixel at 1 m, so that near bodies take no longer than far ones."""
LINK = 0.006
"""[m] Steps that join: half the gap between two bodies that no finger fits in, as noise takes the rest of it, and more
than that of pixels at 1.5 m on a surface seen at 60 deg."""
SPARSE = 2.5
"""Of a cloud that is sparser, steps that join are so many times the distance to the nearest neighbour."""
CORE = 4
"""Cells near one that make it a core; one on a surface has a dozen, one on a body's edge half of them."""
DENSE = 0.25
"""A core has at least this share of the points that the cells near it have on average: flying pixels have not."""
BODY_CELLS = 30
"""Fewest cells of a cluster that others may be parts of."""
OVERLAP = 0.35
"""A part is of the cluster whose outline, seen from above, has this share of it: the handle under a lying mug, the far
wall of a bowl. Bodies beside each other have less, where a round one reaches over a low one."""
SCRAP, SCRAP_GAP = (8, 0.1), 0.02
"""A cluster of at least so many cells, and at most this share of another one's, no farther from it than this [m], is a
part of it that it hides from the rest."""
SQUARE, CLOSED = 0.005, 3
"""[m] Side of the squares of an outline, and how many of them a gap in it may be wide on either side."""


def cells(points: Array, side: float) -> tuple[Array, IntArray, IntArray]:
    """The means (c, 3) of the points (n, 3) in each cell of a grid, their numbers (c,), and the cell (n,) of each."""
    _, cell, count = np.unique(grid_cells(points, side), return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(cell, column) for column in points.T], axis=1) / count[:, None]
    return means, count, cell


def clustered(points: Array) -> IntArray:
    """The cluster (n,) of each of the points (n, 3) in a frame with z up, -1 of none; in no order."""
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
    number[outer] = number[inner]  # the last of several, always the same one
    return np.asarray(_whole(means, number)[cell])


def _whole(means: Array, number: IntArray) -> IntArray:
    """Clusters with those parts joined to them that are in their outline, seen from above, and no higher than they.

    `means` (n, 3) are points with z up, `number` (n,) the cluster of each, negative of none.
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
