"""GMRES against direct solutions and eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest

from upd.linalg.gmres import gmres

rng = np.random.default_rng(0)
N = 20
A = np.eye(N) + 0.2 * rng.normal(size=(N, N))
R = rng.normal(size=N)


@pytest.mark.parametrize("share", [1e-2, 1e-6, 1e-12])
def test_residual_is_as_small_as_asked(share: float) -> None:
    found = gmres(lambda x: A @ x, R, share, N)
    left = np.linalg.norm(R - A @ found.x) / np.linalg.norm(R)
    assert found.reached
    assert left <= share * (1 + 1e-3)
    # the last product was needed
    before = gmres(lambda x: A @ x, R, share, found.products - 1)
    assert not before.reached
    assert np.linalg.norm(R - A @ before.x) / np.linalg.norm(R) > share


def test_ritz_values_of_the_whole_space_are_the_eigenvalues() -> None:
    found = gmres(lambda x: A @ x, R, 0.0, N)
    assert found.products == N
    np.testing.assert_allclose(
        np.sort_complex(found.ritz), np.sort_complex(np.linalg.eigvals(A)), atol=1e-10
    )


def test_a_change_of_rank_two_takes_three_products() -> None:
    U = rng.normal(size=(N, 2))
    found = gmres(lambda x: x + U @ (U.T @ x), R, 1e-12, N)
    assert found.reached
    assert found.products == 3


def test_a_preconditioner_that_changes() -> None:
    calls = []

    def near(r: np.ndarray) -> np.ndarray:
        calls.append(1)
        return np.linalg.solve(A, r) * (1.0 + 0.1 * np.sin(len(calls) * np.arange(N)))

    found = gmres(lambda x: A @ x, R, 1e-10, N, near)
    assert found.reached
    assert found.products < N
    np.testing.assert_allclose(A @ found.x, R, atol=1e-9 * np.linalg.norm(R))


def test_what_cannot_be_solved_is_not_reached() -> None:
    """Nor is what is not finite."""
    P = np.diag([1.0, 1.0, 0.0])
    assert not gmres(lambda x: P @ x, np.ones(3), 1e-6, 3).reached
    assert not gmres(lambda x: np.full(3, np.nan), np.ones(3), 1e-6, 3).reached
    assert not gmres(lambda x: x, np.full(3, np.nan), 1e-6, 3).reached
    none = gmres(lambda x: x, np.zeros(3), 1e-6, 3)
    assert none.reached
    assert not none.x.any()
