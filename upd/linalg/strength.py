"""Which nodes of a stretched mesh multigrid may join.

Smoothing levels an error along the short edges of stretched elements and leaves it along the long
ones, where the coarse level has to see it: only neighbours about as near as the nearest may be
joined there. Entries of K do not tell, as those of 8-node hexahedra at long edges are no smaller.

References
----------
.. [1] M. W. Gee, C. M. Siefert, J. J. Hu, R. S. Tuminaro, M. G. Sala, ML 5.0 Smoothed Aggregation
   User's Guide, SAND2006-2649, section 6.4 (dropping by the distance of nodes).
.. [2] P. Vanek, J. Mandel, M. Brezina, Computing 56 (1996) 179, eq. (13), the threshold of 0.08,
   halved from level to level.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from upd.linalg.common import FloatArray

#: entries above this share of the root of the product of the diagonals are strong, on the finest
#: level
STRONG = 0.08
#: neighbours that are farther than so many times the nearest one are not joined: couplings fall
#: with the square of the stretch, to 0.06 there, and entries below `STRONG` are usually dropped
FAR = 4.0


def near_neighbours(A: bsr_matrix, points: FloatArray) -> csr_matrix:
    """Neighbours in the graph of A that are near each other.

    Parameters
    ----------
    A : (b n, b n) bsr_matrix
        Blocks of nodes, symmetric, with its diagonal.
    points : (n, 3) ndarray
        Positions of the nodes, mm; nan for what has none, which keeps all its neighbours.

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
    near = ~(squares > FAR**2 * np.fmax(nearest[rows], nearest[A.indices]))
    kept = np.concatenate([[0], np.cumsum(near)])[A.indptr]
    return csr_matrix(
        (np.ones(int(near.sum())), A.indices[near], kept.astype(A.indptr.dtype)), shape=(n, n)
    )
