"""Smoothing by lines: which nodes are on one, what a sweep does, and what it is worth."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import bsr_array, csr_array

from upd.fem import Material, box_mesh, rigid_body_modes, stiffness
from upd.linalg import amg_solve
from upd.linalg.smoothers import Smoother, find_cross_lines, find_lines, in_order


def plate(
    lengths: tuple[float, float, float], n: int = 6
) -> tuple[bsr_array, csr_array, np.ndarray, np.ndarray]:
    """A block of n^3 nodes with elements of these sides, held at its face x = 0: K with unit
    blocks for the held nodes, K without them, free dofs, points.
    """
    mesh = box_mesh(*(np.arange(float(n)) * side for side in lengths))
    held = (3 * mesh.nodes["x0"][:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(3 * mesh.n_node), held)
    K = csr_array(stiffness(mesh, Material(2e5, 0.3), "hex8i"))
    keep = np.zeros(3 * mesh.n_node)
    keep[free] = 1.0
    whole = K.multiply(keep[:, None]).multiply(keep).tolil()
    whole.setdiag(np.where(keep > 0.0, K.diagonal(), K.diagonal().mean()))
    blocks = bsr_array(whole.tocsr().tobsr(blocksize=(3, 3)))
    return blocks, csr_array(K[free][:, free]), free, mesh.points


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_lines_follow_the_long_edges(axis: int) -> None:
    lengths = [1.0, 1.0, 1.0]
    lengths[axis] = 5.0
    A, _, _, points = plate((lengths[0], lengths[1], lengths[2]))
    order, starts = find_lines(A)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(points)))
    others = np.setdiff1d(np.arange(3), axis)
    longest = 0
    for first, end in pairwise(starts):
        on = points[order[first:end]]
        assert (np.ptp(on[:, others], axis=0) == 0.0).all()
        np.testing.assert_allclose(np.abs(np.diff(on[:, axis])), 5.0)
        longest = max(longest, end - first)
    # held nodes couple with nothing
    assert longest == (5 if axis == 0 else 6)
    assert len(starts) - 1 == (36 + 36 if axis == 0 else 30 + 36)


def test_cubes_have_no_lines() -> None:
    A, *_ = plate((1.0, 1.0, 1.0))
    _, starts = find_lines(A)
    assert len(starts) - 1 == 6**3


def test_a_line_is_tridiagonal_where_links_go_round() -> None:
    # a ring of eight nodes that couple with the two beside, and two of them across
    A = 4.0 * np.eye(8) + sum(
        np.eye(8)[[i]].T @ np.eye(8)[[(i + 1) % 8]] + np.eye(8)[[(i + 1) % 8]].T @ np.eye(8)[[i]]
        for i in range(8)
    )
    A[0, 4] = A[4, 0] = 0.1
    order, starts = find_lines(bsr_array(np.kron(A, np.eye(3)), blocksize=(3, 3)))
    np.testing.assert_array_equal(np.sort(order), np.arange(8))
    assert len(starts) - 1 > 1
    for first, end in pairwise(starts):
        on = order[first:end]
        assert not np.triu(A[np.ix_(on, on)], 2).any()


def test_rows_in_another_order() -> None:
    """One row is coupled with all, as of a node of a rigid set."""
    rng = np.random.default_rng(1)
    n = 40
    on = rng.random((n, n)) < 0.1
    on[0] = True
    M = np.kron(on | on.T | np.eye(n, dtype=bool), np.ones((3, 3)))
    half = rng.standard_normal(M.shape)
    M *= half + half.T
    A = bsr_array(csr_array(M).tobsr(blocksize=(3, 3)))
    order = rng.permutation(n)
    found = in_order(A, order, order)
    for first, end in pairwise(found.indptr):
        assert (np.diff(found.indices[first:end]) > 0).all()
    dofs = (3 * order[:, None] + np.arange(3)).ravel()
    np.testing.assert_array_equal(found.toarray(), M[np.ix_(dofs, dofs)].astype(np.float32))


def test_cross_lines_follow_the_other_long_edges() -> None:
    """Of a plate's two long directions lines follow one where they can, cross lines the other."""
    A, _, free, points = plate((6.0, 5.0, 1.0))
    order, starts = find_lines(A)
    line = np.empty(len(order), int)
    line[order] = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    nodes, begins = find_cross_lines(A, order, starts)
    assert len(np.unique(nodes)) == len(nodes)
    blocks = A.toarray().reshape(6**3, 3, 6**3, 3).any(axis=(1, 3))
    for first, end in pairwise(begins):
        on = nodes[first:end]
        assert end - first >= 2 and len(np.unique(line[on])) == end - first
        assert np.ptp(points[on, 2]) == 0.0
        assert not np.triu(blocks[np.ix_(on, on)], 2).any()
    # of the nodes that are not held
    assert len(nodes) > 0.8 * len(free) / 3
    needles, *_ = plate((1.0, 1.0, 5.0))
    none, begins = find_cross_lines(needles, *find_lines(needles))
    assert len(none) == 0 and begins.tolist() == [0]


def lower_of(M: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Of a matrix the blocks whose column's place is not after the row's."""
    return np.where(places[:, None] >= places, M, 0.0)


@pytest.mark.parametrize("sides", [(5.0, 1.0, 0.5), (6.0, 5.0, 1.0)])
def test_sweeps_are_those_of_the_block_matrix(sides: tuple[float, float, float]) -> None:
    A, *_ = plate(sides, n=4)
    smoother = Smoother(A)
    order = smoother.order
    assert order is not None
    M = A.toarray()[np.ix_(order, order)]
    nodes, starts = find_lines(A)
    lower = lower_of(M, np.repeat(np.arange(len(starts) - 1), 3 * np.diff(starts)))
    cross, begins = find_cross_lines(A, nodes, starts)
    assert len(cross) > 0
    on = np.concatenate([3 * np.flatnonzero(nodes == node)[0] + np.arange(3) for node in cross])
    across = lower_of(M[np.ix_(on, on)], np.repeat(np.arange(len(begins) - 1), 3 * np.diff(begins)))
    rng = np.random.default_rng(0)
    for _ in range(3):
        b = rng.standard_normal(len(M)).astype(np.float32)
        wanted = np.linalg.solve(lower, b)
        wanted[on] += np.linalg.solve(across, (b - M @ wanted)[on])
        found, rest = smoother.first(b)
        assert np.abs(found - wanted).max() < 1e-4 * np.abs(wanted).max()
        assert np.abs(rest - (b - M @ wanted)).max() < 1e-4 * np.abs(b).max()
        smoother.last(b, found)
        back = wanted.copy()
        back[on] += np.linalg.solve(across.T, (b - M @ back)[on])
        back += np.linalg.solve(lower.T, b - M @ back)
        assert np.abs(found - back).max() < 1e-4 * np.abs(back).max()
        left = b - M @ back
        assert np.abs(smoother.residual(b, found) - left).max() < 1e-4 * np.abs(b).max()


def test_sweeps_node_by_node_are_those_of_the_block_matrix() -> None:
    rng = np.random.default_rng(2)
    half = rng.standard_normal((60, 60))
    M = half @ half.T + 60.0 * np.eye(60)
    M[:12, 30:] = M[30:, :12] = 0.0
    smoother = Smoother(bsr_array(csr_array(M).tobsr(blocksize=(6, 6))))
    lower = lower_of(M, np.repeat(np.arange(10), 6))
    for _ in range(3):
        b = rng.standard_normal(60).astype(np.float32)
        wanted = np.linalg.solve(lower, b)
        found, rest = smoother.first(b)
        np.testing.assert_allclose(found, wanted, atol=1e-5 * np.abs(wanted).max())
        np.testing.assert_allclose(rest, b - M @ wanted, atol=1e-5 * np.abs(b).max())
        smoother.last(b, found)
        back = wanted + np.linalg.solve(lower.T, b - M @ wanted)
        np.testing.assert_allclose(found, back, atol=1e-5 * np.abs(back).max())
        np.testing.assert_allclose(smoother.residual(b, found), b - M @ back, atol=1e-4)


def test_stretched_elements_take_few_iterations(monkeypatch: pytest.MonkeyPatch) -> None:
    _, K, free, points = plate((1.0, 1.0, 30.0), n=10)
    modes, load = rigid_body_modes(points)[free], np.ones(K.shape[0])
    with_lines = amg_solve(K, load, modes, layout=free, points=points)
    monkeypatch.setattr("upd.linalg.smoothers.STRONG", np.inf)
    without = amg_solve(K, load, modes, layout=free, points=points)
    assert np.abs(with_lines.x - without.x).max() < 1e-7 * np.abs(without.x).max()
    assert with_lines.iterations < 0.8 * without.iterations


def test_plates_take_fewer_iterations_by_cross_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Elements that are long two ways."""
    _, K, free, points = plate((6.0, 5.0, 1.0), n=12)
    modes = rigid_body_modes(points)[free]
    load = np.random.default_rng(4).standard_normal(K.shape[0])
    with_them = amg_solve(K, load, modes, layout=free, points=points)
    none = np.zeros(0, int), np.zeros(1, int)
    monkeypatch.setattr("upd.linalg.smoothers.find_cross_lines", lambda *_: none)
    without = amg_solve(K, load, modes, layout=free, points=points)
    assert np.abs(with_them.x - without.x).max() < 1e-7 * np.abs(without.x).max()
    assert with_them.iterations < 0.9 * without.iterations
