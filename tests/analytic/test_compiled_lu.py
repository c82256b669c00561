"""LU, inverse and solutions of the compiled loops, against numpy's."""

from __future__ import annotations

import numpy as np

from upd.linalg.compiled_lu import PIVOT, factor_columns, invert_columns, solve_columns


def test_solutions_and_inverse_where_rows_are_exchanged() -> None:
    """The first pivot of the matrix is zero."""
    rng = np.random.default_rng(3)
    A, b = rng.normal(size=(40, 40)), rng.normal(size=(40, 3))
    A[0, 0] = 0.0
    factors, pivots = A.ravel(order="F"), np.empty(40, PIVOT)
    assert factor_columns(factors, pivots)
    assert (pivots != np.arange(1, 41)).any()
    x = b.copy()
    solve_columns(factors, pivots, x)
    np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-9)
    assert invert_columns(factors, pivots)
    np.testing.assert_allclose(factors.reshape(A.shape, order="F"), np.linalg.inv(A), rtol=1e-8)


def test_a_singular_matrix_is_told() -> None:
    A, pivots = np.ones((3, 3)), np.empty(3, PIVOT)
    assert not factor_columns(A.ravel(order="F"), pivots)
    assert not factor_columns(np.full(9, np.nan), pivots)
