"""Random sparse positive definite matrices.

Condensation equals dense algebra, in any order of the kept dofs.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array, random_array

from upd.linalg import schur_complement
from upd.linalg.select import has_pardiso
from upd.reduction import condense

DIRECT = [
    pytest.param(
        "pardiso", marks=pytest.mark.skipif(not has_pardiso(), reason="MKL is not installed")
    ),
    "superlu",
]
EPS = np.finfo(float).eps


def matrix(n, density, seed):
    """Diagonally dominant, hence definite, with a condition number of at most a few thousand."""
    rng = np.random.default_rng(seed)
    A = random_array((n, n), density=density, rng=rng, data_sampler=rng.standard_normal).toarray()
    A = A + A.T
    return A + np.diag(np.abs(A).sum(axis=1) + rng.uniform(0.1, 2.0, n))


@pytest.mark.parametrize("solver", DIRECT)
@given(
    data=st.data(),
    n=st.integers(1, 60),
    density=st.floats(0.0, 0.4),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=60, deadline=None)
def test_schur_complement(solver, data, n, density, seed):
    A = matrix(n, density, seed)
    kept = np.random.default_rng(seed).permutation(n)[
        : data.draw(st.integers(1, n), label="n_kept")
    ]
    inner = np.setdiff1d(np.arange(n), kept)
    X = np.linalg.solve(A[np.ix_(inner, inner)], A[np.ix_(inner, kept)])
    found = schur_complement(csr_array(A), kept, solver=solver)
    # Dominant matrices lose nothing to growth: the errors are of rounding in sums of n terms.
    bound = 10 * n * EPS * np.linalg.cond(A)
    np.testing.assert_allclose(
        found.S, A[np.ix_(kept, kept)] - A[np.ix_(kept, inner)] @ X, atol=bound * np.abs(A).max()
    )
    assert np.array_equal(found.S, found.S.T)
    u = np.linspace(-1.0, 1.0, len(kept))
    np.testing.assert_allclose(found.recover(u)[inner], -X @ u, atol=bound * 10)
    assert np.array_equal(found.recover(u)[kept], u)


@pytest.mark.parametrize("solver", DIRECT)
@given(
    n=st.integers(2, 40),
    density=st.floats(0.02, 0.5),
    seed=st.integers(0, 2**32 - 1),
    scale=st.floats(1e-9, 1e9),
)
@settings(max_examples=25, deadline=None)
def test_compliance_is_a_block_of_the_inverse(solver, n, density, seed, scale):
    """(K^-1)_bb is S^-1, whatever the unit of stiffness, and condensing in two steps is condensing
    in one.
    """
    A = scale * matrix(n, density, seed)
    kept = np.random.default_rng(seed).permutation(n)[: 1 + n // 2]
    found = condense(csr_array(A), kept, solver=solver)
    inverse = np.linalg.inv(A)
    bound = 10 * n * EPS * np.linalg.cond(A)
    np.testing.assert_allclose(
        found.compliance(), inverse[np.ix_(kept, kept)], atol=bound * np.abs(inverse).max()
    )
    again = condense(csr_array(found.S), [0], solver=solver)
    assert again.compliance()[0, 0] == pytest.approx(
        inverse[kept[0], kept[0]], rel=bound * np.linalg.cond(A)
    )
