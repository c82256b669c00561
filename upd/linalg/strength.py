"""Which nodes of a stretched mesh multigrid may join.

Smoothing levels an error along the short edges of stretched elements and leaves it along the long
ones, where the coarse level has to see it: only neighbours about as near as the nearest may be
joined there. Entries of K do not tell, as those of 8-node hexahedra at long edges are no smaller.

An aggregate is a node and its near neighbours, all free before. That leaves nodes over, which would
go to any aggregate beside them. Where a whole row of nodes remains, a fourth row comes into
aggregates of three so, at up to `FAR` times the step along the row: sweeps hardly see a
displacement of that row against the others, at the share of 1 / FAR^2 of the diagonal, and one
aggregate of all four does not have it. So nodes that are left over go to an aggregate only by a
`CLOSE` neighbour in it, and else are joined among themselves.

References
----------
.. [1] M. W. Gee, C. M. Siefert, J. J. Hu, R. S. Tuminaro, M. G. Sala, ML 5.0 Smoothed Aggregation
   User's Guide, SAND2006-2649, section 6.4 (dropping by the distance of nodes).
.. [2] P. Vanek, J. Mandel, M. Brezina, Computing 56 (1996) 179, eq. (13), the threshold of 0.08,
   halved from level to level; algorithm 2 (aggregates and the remaining nodes).
.. [3] U. Trottenberg, C. Oosterlee, A. Schueller, Multigrid (2001), section A.7.1.1: couplings are
   strong above a quarter of the strongest.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from upd.linalg.common import FloatArray, IntArray

#: entries above this share of the root of the product of the diagonals are strong, on the first
#: level that this decides: the one below near neighbours
STRONG = 0.08
#: neighbours that are farther than so many times the nearest one are not joined: couplings fall
#: with the square of the stretch, to `STRONG` there
FAR = STRONG**-0.5
#: neighbours up to so many times the nearest one are close: couplings fall to a quarter there, see
#: [3]_
CLOSE = 2.0


def aggregates(A: bsr_matrix, near: csr_matrix, points: FloatArray) -> csr_matrix:
    """Which nodes are joined to one of the next level.

    Parameters
    ----------
    A : (b n, b n) bsr_matrix
        Blocks of nodes, symmetric, with its diagonal.
    near : (n, n) csr_matrix
        What may be joined, see `near_neighbours`.
    points : (n, 3) ndarray
        Positions of the nodes, mm; nan for what has none.

    Returns
    -------
    (n, m) csr_matrix
        Ones where a node is in an aggregate; a node with no near neighbour is in none.
    """
    from pyamg.aggregation.aggregate import standard_aggregation

    made, roots = standard_aggregation(near)
    found = _numbers(made)
    middle = np.zeros(len(points), bool)
    middle[roots] = True
    rows = np.repeat(np.arange(len(points)), np.diff(near.indptr))
    first = np.zeros(len(points), bool)
    first[rows[middle[near.indices] & (found[rows] == found[near.indices])]] = True
    alone = found < 0
    found[~first] = -1
    close = near_neighbours(A, points, CLOSE)
    rows = np.repeat(np.arange(len(points)), np.diff(close.indptr))
    taken = ~first[rows] & first[close.indices] & ~alone[rows]
    found[rows[taken]] = found[close.indices[taken]]
    left = np.flatnonzero((found < 0) & ~alone)
    if len(left):
        others = _numbers(standard_aggregation(near[left][:, left].tocsr())[0])
        single = others < 0
        others[single] = others.max() + 1 + np.arange(single.sum())
        found[left] = found.max() + 1 + others
    inside = np.flatnonzero(~alone)
    numbers, which = np.unique(found[inside], return_inverse=True)
    return csr_matrix(
        (np.ones(len(inside), np.int8), (inside, which)), shape=(len(points), len(numbers))
    )


def _numbers(joined: csr_matrix) -> IntArray:
    """Aggregate of each node, -1 for none."""
    found = np.full(joined.shape[0], -1, np.int64)
    found[np.diff(joined.indptr) > 0] = joined.indices
    return found


def near_neighbours(A: bsr_matrix, points: FloatArray, far: float = FAR) -> csr_matrix:
    """Neighbours in the graph of A that are near each other.

    Parameters
    ----------
    A : (b n, b n) bsr_matrix
        Blocks of nodes, symmetric, with its diagonal.
    points : (n, 3) ndarray
        Positions of the nodes, mm; nan for what has none, which keeps all its neighbours.
    far : float
        Near is up to so many times the nearest one's distance, seen from either.

    Returns
    -------
    (n, n) csr_matrix
        Ones where a node is near another as seen from either, and on the diagonal.
    """
    n = len(A.indptr) - 1
    rows = np.repeat(np.arange(n, dtype=A.indices.dtype), np.diff(A.indptr))
    squares = np.zeros(len(rows))
    for x in points.T:
        squares += (x[rows] - x[A.indices]) ** 2
    others = np.where(rows == A.indices, np.inf, squares)
    nearest = np.fmin.reduceat(others, A.indptr[:-1])
    near = ~(squares > far**2 * np.fmax(nearest[rows], nearest[A.indices]))
    kept = np.concatenate([[0], np.cumsum(near)])[A.indptr]
    return csr_matrix(
        (np.ones(int(near.sum())), A.indices[near], kept.astype(A.indptr.dtype)), shape=(n, n)
    )
