"""Whole nodes for multigrid: blocks of three dofs each, where supports took single dofs out too."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import bsr_matrix, csr_array, csr_matrix

from upd.errors import InputError
from upd.linalg.blocks import count_blocks, fill_blocks
from upd.linalg.common import EPS, FloatArray, IntArray
from upd.linalg.symmetric import Matrix, Symmetric, submatrix_of, whole


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
    if not (n_padded % 3 == 0 and (whole_blocks or whole_nodes(n, modes))):
        return csr_matrix(whole(K)).tobsr(blocksize=(1, 1)), B
    order = np.argsort(place, kind="stable")
    if not np.array_equal(order, np.arange(n)):
        K = submatrix_of(csr_array(whole(K))[order][:, order].tocsr(), np.arange(n))
    U = (K if isinstance(K, Symmetric) else Symmetric.of(csr_array(K))).upper
    rising, nodes = place[order], n_padded // 3
    first = np.searchsorted(rising, 3 * np.arange(nodes + 1))
    pointers = count_blocks(U.indptr, U.indices, rising, first, nodes)
    small = np.int32 if pointers[-1] < np.iinfo(np.int32).max else np.int64
    columns, blocks = np.empty(pointers[-1], small), np.zeros((int(pointers[-1]), 3, 3))
    fill_blocks(U.indptr, U.indices, U.data, rising, first, pointers, columns, blocks)
    missing = np.setdiff1d(np.arange(n_padded), rising)
    on = np.flatnonzero(columns == np.repeat(np.arange(nodes), np.diff(pointers)))
    blocks[on[missing // 3], missing % 3, missing % 3] = float(np.median(K.diagonal()))
    shape = (n_padded, n_padded)
    return bsr_matrix((blocks, columns, pointers.astype(small)), shape=shape), B


def whole_nodes(n: int, B: FloatArray | None) -> bool:
    """Whether the first three modes show three dofs per node in order: each dof then moves in the
    translation of its own component only.

    Parameters
    ----------
    n : int
        Dofs.
    B : (n, m) ndarray or None
        Modes.

    Returns
    -------
    bool
    """
    if n % 3 or B is None or B.shape[1] < 3:
        return False
    T = B[:, :3].reshape(-1, 3, 3)
    off = T[:, ~np.eye(3, dtype=bool)]
    return bool((np.abs(off) <= np.sqrt(EPS) * np.abs(T).max()).all())


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
