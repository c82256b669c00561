"""Whole nodes for multigrid: blocks of three dofs each, where supports took single dofs out too.

Which of them may be joined: smoothing levels an error along the short edges of stretched elements
and leaves it along the long ones, where the coarse level has to see it. So only neighbours about as
near as the nearest are joined there. Entries of K do not tell, as those of 8-node hexahedra at long
edges are no smaller.

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

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import bsr_matrix, csr_array, csr_matrix

from upd.errors import InputError
from upd.linalg.common import EPS, FloatArray, IntArray
from upd.linalg.symmetric import Matrix, whole

#: entries above this share of the root of the product of the diagonals are strong, on the first
#: level that this decides: the one below near neighbours
STRONG = 0.08
#: neighbours that are farther than so many times the nearest one are not joined: couplings fall
#: with the square of the stretch, to `STRONG` there
FAR = STRONG**-0.5
#: neighbours up to so many times the nearest one are close: couplings fall to a quarter there, see
#: [3]_
CLOSE = 2.0


def padded(
    K: Matrix, modes: FloatArray | None, place: IntArray, n_padded: int, *, whole_blocks: bool
) -> tuple[Any, FloatArray | None]:
    """K and its modes on whole blocks of 3 dofs per node.

    Aggregation must join whole nodes, but supports take single dofs out. A missing dof comes back
    as a row of its own with a stiffness of the size of the others and no part in the modes: it
    couples with nothing, so the answer is unchanged and the blocks are whole.

    Parameters
    ----------
    K : (n, n) Symmetric or csr_array
        N/mm.
    modes : (n, m) ndarray or None
    place, n_padded
        From `places`.
    whole_blocks : bool
        Whether `place` came from a layout.

    Returns
    -------
    bsr_matrix or csr_matrix, (n_padded, m) ndarray or None
    """
    n = K.shape[0]
    B = None
    if modes is not None:
        B = np.zeros((n_padded, modes.shape[1]))
        B[place] = modes
        if not whole_blocks and n % 3 == 0 and modes.shape[1] >= 3:
            # Three dofs per node in order, if each dof moves in the translation of its own
            # component only.
            T = modes[:, :3].reshape(-1, 3, 3)
            off = T[:, ~np.eye(3, dtype=bool)]
            whole_blocks = bool((np.abs(off) <= np.sqrt(EPS) * np.abs(T).max()).all())
    if not (n_padded % 3 == 0 and whole_blocks):
        return csr_matrix(whole(K)).tobsr(blocksize=(1, 1)), B
    A = csr_array(whole(K))
    order = np.argsort(place, kind="stable")
    if not np.array_equal(order, np.arange(n)):
        A = csr_array(A[order][:, order])
    rising = place[order]
    ends = np.zeros(n_padded + 1, A.indptr.dtype)
    ends[rising + 1] = np.diff(A.indptr)
    columns = rising.astype(A.indices.dtype)[A.indices]
    shape = (n_padded, n_padded)
    found = csr_matrix((A.data, columns, np.cumsum(ends, dtype=ends.dtype)), shape=shape)
    blocks = found.tobsr(blocksize=(3, 3))
    blocks.sort_indices()
    missing = np.setdiff1d(np.arange(n_padded), rising)
    nodes = np.repeat(np.arange(n_padded // 3), np.diff(blocks.indptr))
    on = np.flatnonzero(blocks.indices == nodes)
    blocks.data[on[missing // 3], missing % 3, missing % 3] = float(np.median(K.diagonal()))
    return blocks, B


def positions(points: ArrayLike, n: int, layout: ArrayLike | None) -> FloatArray:
    """Positions of the blocks that `places` numbers; nan for dofs of rigid sets.

    Parameters
    ----------
    points : (n_node, 3) array_like
        mm.
    n : int
        Dofs.
    layout : (n,) array_like of int or None
        As for `MultigridSolver`.

    Returns
    -------
    (m, 3) ndarray

    Raises
    ------
    InputError
        For points that are not those of the layout.
    """
    at = np.asarray(points, np.float64)
    numbers = np.arange(n) if layout is None else np.asarray(layout)
    nodes = np.unique(numbers[numbers >= 0] // 3)
    if at.ndim != 2 or at.shape[1] != 3 or len(at) <= nodes.max(initial=-1):
        raise InputError(
            f"The points have the shape {at.shape}: give x, y, z of all nodes that the layout "
            f"counts, ({nodes.max(initial=-1) + 1}, 3)."
        )
    found = np.full((places(n, layout)[1] // 3, 3), np.nan)
    found[: len(nodes)] = at[nodes]
    return found


def places(n: int, layout: ArrayLike | None) -> tuple[IntArray, int]:
    """Where each dof goes among whole blocks of three per node, and how many places there are.

    Parameters
    ----------
    n : int
        Dofs.
    layout : (n,) array_like of int or None
        As for `MultigridSolver`.

    Returns
    -------
    (n,) ndarray of int, int

    Raises
    ------
    InputError
        For a layout that is none.
    """
    if layout is None:
        return np.arange(n), n
    numbers = np.asarray(layout)
    if numbers.shape != (n,) or not np.issubdtype(numbers.dtype, np.integer) or numbers.min() < -1:
        raise InputError(
            f"The layout is one whole number 3 * node + component per dof of K ({n}), -1 "
            f"in a rigid set; got {numbers.shape}."
        )
    nodal = numbers >= 0
    if len(np.unique(numbers[nodal])) != nodal.sum():
        raise InputError("The layout has a duplicated dof: number dofs 3 * node + component.")
    nodes = np.unique(numbers[nodal] // 3)
    place = np.empty(n, np.int64)
    place[nodal] = 3 * np.searchsorted(nodes, numbers[nodal] // 3) + numbers[nodal] % 3
    others = int((~nodal).sum())
    place[~nodal] = 3 * len(nodes) + np.arange(others)
    return place, 3 * (len(nodes) + -(-others // 3))


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
