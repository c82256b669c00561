"""Multigrid where it is hard: what it says of its error holds, or it says that it failed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pyamg.aggregation.aggregate import standard_aggregation
from scipy.sparse import bsr_matrix, csr_array, diags_array, kron

from upd.errors import ConvergenceError, InputError
from upd.fem import Material, box_mesh, rigid_body_modes, stiffness
from upd.linalg import amg_solve, factorise, multigrid
from upd.linalg.conjugate import conjugate_gradients
from upd.linalg.multigrid import MultigridSolver
from upd.linalg.nodes import aggregates, near_neighbours


def clamped(
    aspect: float = 1.0, nu: float = 0.3, n: int = 10, element: str = "hex8i"
) -> tuple[csr_array, Any, Any]:
    """A block whose elements are `aspect` times as wide as high, held at its bottom."""
    side = np.arange(float(n)) * aspect
    mesh = box_mesh(side, side, np.arange(float(n)))
    free = np.setdiff1d(
        np.arange(3 * mesh.n_node), (3 * mesh.nodes["z0"][:, None] + np.arange(3)).ravel()
    )
    K = csr_array(stiffness(mesh, Material(2e5, nu), element)[free][:, free])
    return K, rigid_body_modes(mesh.points)[free], free


@pytest.mark.parametrize(
    ("aspect", "nu", "most"),
    [(1.0, 0.3, 40), (100.0, 0.3, 2000), (0.1, 0.3, 300), (1.0, 0.499, 300), (10.0, 0.499, 3000)],
)
def test_the_bound_of_the_error_holds(aspect: float, nu: float, most: int) -> None:
    K, modes, free = clamped(aspect, nu)
    rng = np.random.default_rng(3)
    solver = MultigridSolver(K, modes, layout=free)
    exact_solve = factorise(K, solver="superlu")
    for rhs in (rng.standard_normal(K.shape[0]), np.eye(K.shape[0])[-1]):
        (found,) = solver.many(rhs[:, None], 1e-6)
        exact = exact_solve(rhs)
        e = found.x - exact
        true, size = np.sqrt(e @ (K @ e)), np.sqrt(exact @ rhs)
        assert 0 < found.iterations <= most
        assert found.error <= 1e-6 * size * (1.0 + 1e-6)
        # the reference's own rounding is a thousandth of what is asked
        assert true <= found.error + 1e-9 * size


def test_cycle_is_symmetric_and_no_step_too_long() -> None:
    K, modes, free = clamped(aspect=0.1)
    solver = MultigridSolver(K, modes, layout=free)
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((2, K.shape[0]))
    Mx, My = solver.precondition(x), solver.precondition(y)
    scale = np.sqrt((x @ Mx) * (y @ My))
    assert abs(y @ Mx - x @ My) < 1e-5 * scale
    for _ in range(40):
        x = solver.precondition(K @ x)
        x /= np.sqrt(x @ (K @ x))
    assert x @ (K @ solver.precondition(K @ x)) < 1.0 + 1e-4


@pytest.mark.parametrize("with_modes", [True, False])
def test_levels_visited_twice_keep_the_cycle_symmetric_and_positive(
    monkeypatch: pytest.MonkeyPatch, with_modes: bool
) -> None:
    """I - M K of all dofs, the second of three levels twice: without modes by lines there too."""
    monkeypatch.setattr(multigrid, "COARSEST", 3)
    K, modes, free = clamped(n=8)
    modes = modes if with_modes else None
    solver = MultigridSolver(K, modes, layout=free)
    assert len(solver.cycle.sizes) == 3
    lowest = []
    root = np.linalg.cholesky(K.toarray())
    for visited_twice in (1, multigrid.MOST_LEVELS):
        monkeypatch.setattr(multigrid, "TWICE", visited_twice)
        M = np.column_stack([solver.precondition(e) for e in np.eye(K.shape[0])])
        assert np.abs(M - M.T).max() < 1e-5 * np.abs(M).max()
        eigenvalues = np.linalg.eigvalsh(root.T @ (0.5 * (M + M.T)) @ root)
        assert eigenvalues[-1] < 1.0 + 1e-4
        lowest.append(eigenvalues[0])
    assert lowest[0] > 1.2 * lowest[1] > 0.0


def test_iterations_hardly_grow_with_the_mesh() -> None:
    counts = []
    for n in (11, 19):
        K, modes, free = clamped(n=n)
        counts.append(amg_solve(K, np.ones(K.shape[0]), modes, layout=free).iterations)
    assert counts[1] <= 1.6 * counts[0]


def graded(n: int) -> tuple[csr_array, Any, Any, Any]:
    """A quarter block fine near one corner: planes of symmetry, elements stretched up to 1.5^n."""
    lines = np.concatenate([np.linspace(0.0, 0.9, n), 1.0 * 1.5 ** np.arange(n // 2)])
    mesh = box_mesh(lines, lines, -lines[::-1])
    held = [3 * mesh.nodes["x0"], 3 * mesh.nodes["y0"] + 1, 3 * mesh.nodes["z0"] + 2]
    free = np.setdiff1d(np.arange(3 * mesh.n_node), np.concatenate(held))
    K = csr_array(stiffness(mesh, Material(2e5, 0.3), "hex8i")[free][:, free])
    return K, rigid_body_modes(mesh.points)[free], free, mesh.points


def test_only_near_neighbours_are_joined_where_the_mesh_is_stretched() -> None:
    K, modes, free, points = graded(8)
    load = np.zeros(K.shape[0])
    load[-1] = 1.0
    near = amg_solve(K, load, modes, layout=free, points=points)
    everyone = amg_solve(K, load, modes, layout=free)
    assert np.abs(near.x - everyone.x).max() < 1e-8 * np.abs(near.x).max()
    assert near.iterations < 0.75 * everyone.iterations


def test_near_neighbours_are_those_of_either_side() -> None:
    x = np.array([0.0, 1.0, 5.0, 20.0])
    A = bsr_matrix(np.kron(np.ones((4, 4)), np.eye(3)), blocksize=(3, 3))
    points = np.column_stack([x, np.zeros(4), np.zeros(4)])
    # 5 is 4 from 1, the nearest of both: 0 - 5 is farther than 4, but near as 5 sees it
    expected = np.array([[1, 1, 1, 0], [1, 1, 1, 0], [1, 1, 1, 1], [0, 0, 1, 1]], float)
    expected[0, 3] = expected[3, 0] = expected[1, 3] = expected[3, 1] = 1.0  # 20 has 15 as nearest
    np.testing.assert_array_equal(near_neighbours(A, points).toarray(), expected)
    points[3] = np.nan
    np.testing.assert_array_equal(near_neighbours(A, points).toarray()[3], np.ones(4))
    # 3.54 steps apart couplings fall to the 0.08 of the first
    x = np.array([0.0, 1.0, 4.55, 5.55])
    found = near_neighbours(A, np.column_stack([x, x * 0.0, x * 0.0])).toarray()
    np.testing.assert_array_equal(found, np.kron(np.eye(2), np.ones((2, 2))))


def test_rows_that_are_left_over_are_not_joined_to_far_ones() -> None:
    """Six rows of nodes 3.2 steps apart: two and three are joined, and the last."""
    row, n = 30, 6
    beside = diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(row, row))
    across = diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(n, n))
    pattern = kron(across, beside).toarray()
    pattern = np.pad(pattern, (0, 1))  # and a node by itself, which is not joined
    pattern[-1, -1] = 1.0
    A = bsr_matrix(np.kron(pattern, np.eye(3)), blocksize=(3, 3))
    y, x = np.divmod(np.arange(row * n), row)
    points = np.column_stack([x, 3.2 * y, 0.0 * x])
    near = near_neighbours(A, np.vstack([points, [[0.0, 0.0, 9.0]]]))
    joined = aggregates(A, near, np.vstack([points, [[0.0, 0.0, 9.0]]]))
    np.testing.assert_array_equal(joined.sum(axis=1).ravel(), [[*np.ones(row * n), 0.0]])
    depth = [len(np.unique(y[one.indices])) for one in joined.T.tocsr()]
    assert min(depth) >= 1 and max(depth) == 3
    usual = standard_aggregation(near)[0].T.tocsr()
    assert max(len(np.unique(y[one.indices])) for one in usual) == 4


def test_points_that_are_not_those_of_the_layout() -> None:
    K, modes, free = clamped(n=4)
    with pytest.raises(InputError, match=r"give x, y, z of all nodes that the layout"):
        amg_solve(K, np.ones(K.shape[0]), modes, layout=free, points=np.zeros((5, 3)))


def test_what_rounding_hides_is_refused() -> None:
    # A needle a hundred times as high as wide: its bending is 1e8 times softer than its stretch.
    K, modes, free = clamped(aspect=0.01)
    with pytest.raises(ConvergenceError, match=r"after \d+ iterations with a relative error"):
        amg_solve(K, np.ones(K.shape[0]), modes, layout=free)


def test_floating_body_is_refused() -> None:
    mesh = box_mesh(*(np.arange(5.0) for _ in range(3)))
    K = csr_array(stiffness(mesh, Material(2e5, 0.3), "hex8i"))
    load = np.zeros(K.shape[0])
    load[2] = 1.0
    with pytest.raises(ConvergenceError, match="floats"):
        amg_solve(K, load, rigid_body_modes(mesh.points))


def test_conjugate_gradients_tell_why_they_stop() -> None:
    rng = np.random.default_rng(0)
    d = np.logspace(0.0, 12.0, 400)

    def run(A: Any, **more: Any) -> Any:
        settings = {"accuracy": 1e-12, "max_iterations": 5000, **more}
        return conjugate_gradients(
            lambda x: A * x, lambda r: r.copy(), rng.standard_normal(400), **settings
        )

    with pytest.raises(ConvergenceError, match="after 50 iterations"):
        run(d, max_iterations=50)
    with pytest.raises(ConvergenceError, match=r"stalls|rounding holds"):
        run(d)
    with pytest.raises(ConvergenceError, match="not positive definite"):
        run(np.where(np.arange(400) == 7, -1.0, 1.0 + 1e-13 * d))


def test_columns_side_by_side() -> None:
    """Dependent columns, a column of zeros, sizes twelve powers of ten apart."""
    K, modes, free = clamped(aspect=3.0)
    solver = MultigridSolver(K, modes, layout=free)
    rng = np.random.default_rng(7)
    B = rng.standard_normal((K.shape[0], 11))
    B[:, 1] = B[:, 0]
    B[:, 2] = B[:, 0] + 1e-9 * B[:, 3]
    B[:, 4] = 0.0
    B[:, 5] *= 1e-12
    exact_solve = factorise(K, solver="superlu")
    for rhs, found in zip(B.T, solver.many(B, 1e-9), strict=True):
        exact = exact_solve(rhs)
        e = found.x - exact
        size = np.sqrt(max(exact @ rhs, 0.0))
        assert found.error <= 1e-9 * size
        assert np.sqrt(e @ (K @ e)) <= found.error + 1e-12 * size


@pytest.mark.parametrize("accuracy", [1e-2, 1e-4])
def test_the_bound_holds_where_it_is_rough(accuracy: float) -> None:
    K, modes, free = clamped(aspect=0.3)
    solver = MultigridSolver(K, modes, layout=free)
    B = np.random.default_rng(8).standard_normal((K.shape[0], 5))
    exact = factorise(K, solver="superlu")(B)
    for rhs, found, x in zip(B.T, solver.many(B, accuracy), exact.T, strict=True):
        e = found.x - x
        assert (
            1e-3 * found.error <= np.sqrt(e @ (K @ e)) <= found.error <= accuracy * (x @ rhs) ** 0.5
        )
