"""Modes counted by the inertia of a factor: against spectra known in closed form, and answers from
which a mode was taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import block_diag, csr_array, diags_array

from upd.analyses.modal.results import no_mode_missed
from upd.linalg import Eigenproblem, inertia, modes
from upd.linalg.pardiso import signed_pardiso
from upd.linalg.select import has_pardiso
from upd.linalg.superlu import signed_superlu
from upd.results import NO_CASE

SOLVERS = [
    pytest.param(
        "pardiso", marks=pytest.mark.skipif(not has_pardiso(), reason="MKL is not installed")
    ),
    "superlu",
]
SIGNED = {"pardiso": signed_pardiso, "superlu": signed_superlu}
N = 700


def chain(n=N, factor=1.0):
    """K, M and eigenvalues of n unit masses between unit springs, both ends held."""
    off = np.full(n - 1, -factor)
    K = csr_array(diags_array([off, np.full(n, 2.0 * factor), off], offsets=[-1, 0, 1]))
    phase = np.arange(1, n + 1) * np.pi / (n + 1)
    return K, csr_array(diags_array(np.ones(n))), factor * 4.0 * np.sin(phase / 2) ** 2


def nearly_double():
    """Two chains whose eigenvalues differ by 1e-7."""
    K, M, _ = chain()
    return (
        csr_array(block_diag([K, (1.0 + 1e-7) * K], format="csr")),
        csr_array(block_diag([M, M], format="csr")),
    )


def without(found, j):
    rest = np.delete(np.arange(len(found.frequency)), j)
    return replace(found, frequency=found.frequency[rest], shapes=found.shapes[:, rest])


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("below", [0, 1, 5, 300, N])
def test_inertia_of_a_chain(solver, below):
    K, M, exact = chain()
    ends = np.concatenate([[0.5 * exact[0]], 0.5 * (exact[1:] + exact[:-1]), [5.0]])
    negative, solve = SIGNED[solver](csr_array(K - ends[below] * M))
    assert negative == below
    x = np.linspace(-1.0, 1.0, N)
    np.testing.assert_allclose(solve(K @ x - ends[below] * (M @ x)), x, atol=1e-8)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_mode_taken_away_is_missed(solver):
    K, M, _ = chain()
    found = modes(K, M, count=8, solver=solver)
    assert found.missed == 0
    assert "by the inertia" in found.shown
    for j in range(6):
        count = inertia.count_modes(K, M, without(found, j), 5, 0.0, solver)
        assert count.missed(without(found, j)) == 1
    assert inertia.count_modes(K, M, found, 5, 0.0, solver).missed(found) == 0


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("j", [0, 1, 4, 5])
def test_one_of_a_nearly_double_pair_is_missed(solver, j):
    K, M = nearly_double()
    found = modes(K, M, count=10, solver=solver)
    assert found.missed == 0
    rest = without(found, j)
    # Six wanted: the cut lies inside a pair when one before it is gone.
    assert inertia.count_modes(K, M, rest, 6, 0.0, solver).missed(rest) == 1


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_shift_on_an_eigenvalue_is_no_proof(solver, monkeypatch):
    K, M, _ = chain()
    found = modes(K, M, count=8, solver=solver)
    monkeypatch.setattr(inertia, "_PLACES", (0.0,))
    assert inertia.count_modes(K, M, found, 5, 0.0, solver) is None
    # Nor one on an eigenvalue that was not found.
    gone = without(found, 6)
    exact = found.eigenvalue[6]
    low, high = found.eigenvalue[5], found.eigenvalue[7]
    monkeypatch.setattr(inertia, "_PLACES", ((exact - low) / (high - low),))
    assert inertia.count_modes(K, M, gone, 6, 0.0, solver) is None
    monkeypatch.setattr(inertia, "_PLACES", ((exact - low) / (high - low), 0.75))
    assert inertia.count_modes(K, M, gone, 6, 0.0, solver).sigma > low


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_run_that_loses_a_mode_is_mended_or_told(solver, monkeypatch):
    K, M = nearly_double()
    own = Eigenproblem.some_modes
    monkeypatch.setattr(Eigenproblem, "some_modes", lambda *a: without(own(*a), 3))
    mended = modes(K, M, count=6, solver=solver)
    assert mended.status == 0
    np.testing.assert_allclose(mended.eigenvalue[3], (1 + 1e-7) * mended.eigenvalue[2], rtol=1e-10)
    assert no_mode_missed(NO_CASE, [("x", mended)]).passed
    monkeypatch.setattr(Eigenproblem, "_more", lambda self, inverse, found, *a: found)
    told = modes(K, M, count=6, solver=solver)
    assert (told.status, told.missed) == (1, 1)
    check = no_mode_missed(NO_CASE, [("x", mended), ("y", told)])
    assert not check.passed
    assert check.value == 1
    assert "inertia" in check.says


def test_all_modes_below_a_limit_are_counted_above_the_limit():
    """A shift between the last mode found and the limit would not see one missed between them."""
    K, M, exact = chain()
    limit = 0.9 * exact[5] + 0.1 * exact[4]
    below = np.sqrt(limit) / (2 * np.pi)
    found = modes(K, M, below_hz=below, solver="superlu")
    assert len(found.frequency) == 5
    counted = float(found.shown.split("below ")[1].split(" Hz")[0])
    assert counted > below


def test_without_a_count_the_search_is_named(monkeypatch):
    monkeypatch.setattr("upd.linalg.eigen.count_modes", lambda *a: None)
    K, M = nearly_double()
    found = modes(K, M, count=6, solver="superlu")
    assert found.status == 0
    assert "search" in found.shown
    assert "search" in no_mode_missed(NO_CASE, [("rig", found)]).says
    assert modes(np.diag([1.0, 2.0]), np.eye(2), count=1).shown == "all modes of dense matrices"
