"""Natural frequencies against chains of masses, a rod whose discrete spectrum has a closed form,
and dense algebra.
"""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array, diags_array

from upd.errors import ConvergenceError, InputError
from upd.fem import Material, box_mesh, mass, stiffness
from upd.linalg import Eigenproblem, eigen, modes
from upd.linalg.eigen_checks import finished
from upd.linalg.lanczos import block_lanczos
from upd.linalg.select import has_pardiso

EPS = np.finfo(float).eps
SOLVERS = [
    "dense",
    "superlu",
    pytest.param(
        "pardiso", marks=pytest.mark.skipif(not has_pardiso(), reason="MKL is not installed")
    ),
]


def chain(n, free=False):
    """n equal masses of 1e-3 t and springs of 100 N/mm between them.

    Both ends on springs, or free. K, M, frequencies in Hz.
    """
    main = np.full(n, 200.0)
    if free:
        main[[0, -1]] = 100.0
    K = diags_array(
        [np.full(n - 1, -100.0), main, np.full(n - 1, -100.0)], offsets=[-1, 0, 1]
    ).tocsr()
    j = np.arange(n)
    phase = j * np.pi / n if free else (j + 1) * np.pi / (n + 1)
    return (
        csr_array(K),
        csr_array(1e-3 * diags_array(np.ones(n))),
        2.0 * np.sqrt(100.0 / 1e-3) * np.sin(phase / 2) / (2 * np.pi),
    )


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("n", [40, 900])
def test_chain_of_masses(solver, n):
    K, M, exact = chain(n)
    found = modes(K, M, count=7, solver=solver)
    # A relative eps of K's norm is absolute in the eigenvalue, 4 sin^2 of its phase.
    np.testing.assert_allclose(
        found.eigenvalue, (2 * np.pi * exact[:7]) ** 2, rtol=0, atol=20 * EPS * np.sqrt(n) * 4e5
    )
    assert found.shapes.shape == (n, 7)
    np.testing.assert_allclose(
        found.shapes.T @ (M @ found.shapes), np.eye(7), atol=100 * EPS * np.sqrt(n)
    )
    assert found.orthogonality <= 100 * EPS * np.sqrt(n)
    assert (found.residual < 1e-6).all()
    assert found.n_rigid == 0
    assert found.status == 0
    # A sine with j half waves, of unit modal mass.
    j, k = np.arange(1, 8), np.arange(1, n + 1)
    sine = np.sqrt(2.0 / (1e-3 * (n + 1))) * np.sin(np.outer(k, j) * np.pi / (n + 1))
    # The shapes turn by the residual over the gap to the next eigenvalue.
    agreement = np.abs(np.einsum("kj,kj->j", sine, 1e-3 * found.shapes))
    np.testing.assert_allclose(agreement, 1.0, atol=1e-10)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("n", [40, 900])
def test_free_chain_has_one_motion_of_exactly_zero_frequency(solver, n):
    K, M, exact = chain(n, free=True)
    found = modes(K, M, count=6, solver=solver)
    assert found.n_rigid == 1
    assert found.frequency[0] == 0.0
    np.testing.assert_allclose(
        found.eigenvalue[1:],
        (2 * np.pi * exact[1:6]) ** 2,
        rtol=0,
        atol=20 * EPS * np.sqrt(n) * 4e5,
    )
    np.testing.assert_allclose(found.shapes[:, 0], 1.0 / np.sqrt(1e-3 * n), rtol=1e-9)
    assert found.sigma < 0.0


@pytest.mark.parametrize("solver", SOLVERS)
def test_all_below_a_frequency_and_no_more(solver):
    K, M, exact = chain(700)
    limit = 0.5 * (exact[29] + exact[30])
    found = modes(K, M, below_hz=limit, solver=solver)
    assert len(found.frequency) == 30
    assert len(modes(K, M, below_hz=limit, count=4, solver=solver).frequency) == 4
    few = modes(K, M, below_hz=0.5 * exact[0], solver=solver)
    assert few.frequency.shape == (0,)
    assert few.shapes.shape == (700, 0)


def test_more_modes_than_a_mesh_describes_are_refused():
    """As with a density in a wrong unit: the run ended never."""
    K, M, exact = chain(3000)
    with pytest.raises(InputError, match=r"3000 modes of 3000 dofs lie below.*units of density"):
        modes(K, M, below_hz=2.0 * exact[-1], solver="superlu")


@pytest.mark.parametrize("solver", ["superlu", "pardiso"])
def test_many_modes_below_a_frequency_are_all_found(solver):
    K, M, exact = chain(3000)
    limit = 0.5 * (exact[119] + exact[120])
    assert len(modes(K, M, below_hz=limit, solver=solver).frequency) == 120


def rod(n=120):
    """A bar of n hexahedra whose lateral dofs are fixed, one end clamped, nu = 0.

    K, M and its exact discrete frequencies.
    """
    length, c = 200.0, np.sqrt(200e3 / 7.8e-9)
    mesh = box_mesh(np.linspace(0, length, n + 1), [0, 3.0], [0, 4.0])
    steel = Material(200e3, 0.0)
    free = np.setdiff1d(3 * np.arange(mesh.n_node), 3 * mesh.nodes["x0"])
    K, M = (
        csr_array(A[free][:, free]) for A in (stiffness(mesh, steel, "hex8"), mass(mesh, steel))
    )
    # Linear elements with consistent mass (T. J. R. Hughes, The Finite Element Method, 9.1.2).
    h = length / n
    kh = (2 * np.arange(1, n + 1) - 1) * np.pi / (2 * n)
    return K, M, c / h * np.sqrt(6 * (1 - np.cos(kh)) / (2 + np.cos(kh))) / (2 * np.pi)


def test_bar_has_the_frequencies_of_its_own_discretisation():
    K, M, exact = rod()
    found = modes(K, M, count=5, solver="superlu")
    np.testing.assert_allclose(found.frequency, exact[:5], rtol=1e-9)


def test_shift_of_ones_own_and_a_wrong_one():
    K, M, exact = chain(900)
    first = (2 * np.pi * exact[0]) ** 2
    for sigma in (0.5 * first, -first, -100 * first):
        found = modes(K, M, count=5, sigma=sigma, solver="superlu")
        np.testing.assert_allclose(found.frequency, exact[:5], rtol=1e-7)
        assert found.sigma == sigma
    with pytest.raises(ConvergenceError, match="not positive definite"):
        modes(K, M, count=5, sigma=2.0 * first, solver="superlu")
    free, M, _ = chain(900, free=True)
    for solver in ("superlu", "dense"):
        # The trap: the factor of a singular K gives modes that look converged.
        with pytest.raises(ConvergenceError, match="floats"):
            modes(free, M, count=5, sigma=0.0, solver=solver)


def test_factor_is_kept_between_questions():
    K, M, exact = chain(900)
    problem = Eigenproblem(K, M, solver="superlu")
    first = problem.modes(count=3)
    again = problem.modes(count=12)
    np.testing.assert_allclose(again.frequency[:3], first.frequency, rtol=1e-9)
    np.testing.assert_allclose(again.frequency, exact[:12], rtol=1e-7)


def test_displacements_take_the_factor_of_the_modes():
    K, M, exact = chain(900)
    loads = np.random.default_rng(1).standard_normal((900, 2))
    problem = Eigenproblem(K, M, sigma=0.0, solver="superlu")
    np.testing.assert_allclose(K @ problem.displacements(loads), loads, atol=1e-9)
    np.testing.assert_allclose(problem.modes(count=3).frequency, exact[:3], rtol=1e-7)
    with pytest.raises(InputError, match="displacements take the factor of K"):
        Eigenproblem(K, M, sigma=-1.0, solver="superlu").displacements(loads)


@pytest.mark.parametrize("alone", [True, False])
def test_modes_are_counted_with_one_factor_where_it_is_alone(alone, monkeypatch):
    """A second factor beside the first, or in its place."""
    K, M, exact = chain(900)
    problem = Eigenproblem(K, M, sigma=0.0, solver="superlu", alone=alone)
    made, kept = [], []
    factorise, counted = eigen.factorise, eigen.count_modes

    def remembered(*arguments, **named):
        factor = factorise(*arguments, **named)
        made.append(weakref.ref(factor))
        return factor

    def seen(*arguments):
        gc.collect()
        kept.append(sum(one() is not None for one in made))
        return counted(*arguments)

    monkeypatch.setattr(eigen, "factorise", remembered)
    monkeypatch.setattr(eigen, "count_modes", seen)
    np.testing.assert_allclose(problem.modes(count=3).frequency, exact[:3], rtol=1e-7)
    assert kept == [0 if alone else 1]


def test_many_modes_and_all_of_them():
    K, M, exact = chain(60)
    np.testing.assert_allclose(modes(K, M, count=60).frequency, exact, rtol=1e-9)
    K, M, exact = chain(560)
    found = modes(K, M, count=559, solver="superlu")
    np.testing.assert_allclose(found.frequency, exact[:559], rtol=1e-6)


@pytest.mark.parametrize("floats", [False, True])
def test_lanczos_equals_the_dense_spectrum_on_a_solid(floats):
    mesh = box_mesh(np.linspace(0, 60, 13), np.linspace(0, 25, 6), np.linspace(0, 18, 5))
    steel = Material(200e3, 0.3)
    K, M = stiffness(mesh, steel), mass(mesh, steel)
    dofs = np.arange(3 * mesh.n_node)
    if not floats:
        dofs = np.setdiff1d(dofs, (3 * mesh.nodes["x0"][:, None] + np.arange(3)).ravel())
    K, M = csr_array(K[dofs][:, dofs]), csr_array(M[dofs][:, dofs])
    count = 9
    direct = modes(K, M, count=count, solver="superlu")
    assert direct.n_rigid == (6 if floats else 0)
    theta = eigh(
        K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=[direct.n_rigid, count - 1]
    )
    np.testing.assert_allclose(direct.eigenvalue[direct.n_rigid :], theta, rtol=1e-8)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "count, below_hz"),
        ({"count": 0}, "at least one"),
        ({"count": 41}, "40 dofs with mass"),
        ({"below_hz": -1.0}, "positive frequency"),
        ({"count": 2, "residual_limit": 2.0}, "residual_limit"),
        ({"count": 2, "solver": "qr"}, "Unknown solver"),
        ({"count": 2, "sigma": np.nan}, "finite shift"),
        ({"count": 2, "solver": "amg"}, 'no factor.*"pardiso" or "superlu"'),
        ({"count": 2, "solver": "lobpcg"}, "Unknown solver.*pardiso, superlu"),
    ],
)
def test_bad_arguments(arguments, message):
    K, M, _ = chain(40)
    with pytest.raises(InputError, match=message):
        modes(K, M, **arguments)


def test_bad_matrices():
    K, M, _ = chain(40)
    skew = M.copy().tolil()
    skew[0, 1] = 1e-3
    with pytest.raises(InputError, match="not symmetric"):
        modes(K, csr_array(skew), count=2)
    with pytest.raises(InputError, match="on the same dofs"):
        modes(K, M[:10][:, :10], count=2)
    with pytest.raises(InputError, match="no mass"):
        modes(K, 0.0 * M, count=2)
    with pytest.raises(InputError, match="not finite"):
        modes(K, np.nan * M, count=2)


def test_a_residual_beyond_the_limit_is_refused_with_what_there_is():
    K, M, _ = rod(200)
    found = modes(K, M, count=4, solver="superlu")
    wrong = replace(found, residual=found.residual + np.array([0, 0, 1e-3, 0]))
    with pytest.raises(
        ConvergenceError, match=r"1 of 4 did not converge, the first number 2"
    ) as caught:
        finished(csr_array(K), csr_array(M), wrong, 4, 1e-6, 0.0)
    assert caught.value.partial.status == 2
    assert caught.value.partial.frequency.shape == (4,)
    askew = replace(found, shapes=found.shapes + 1e-6 * found.shapes[:, [0]])
    with pytest.raises(ConvergenceError, match="M-orthogonality"):
        finished(csr_array(K), csr_array(M), askew, 4, 1e-6, 0.0)
    # Modes beyond those that are kept do not count.
    last = found.shapes + 1e-6 * found.shapes[:, [0]] * np.array([0, 0, 0, 1])
    assert (
        finished(
            csr_array(K), csr_array(M), replace(found, shapes=last), 3, 1e-6, 0.0
        ).orthogonality
        < 1e-12
    )


def test_block_lanczos_ends_in_an_invariant_space_and_tells_when_it_gives_up():
    A = np.diag(np.concatenate([[5.0, 5.0, 5.0, 2.0], np.zeros(56)]))
    unit = csr_array(np.eye(60))
    start = np.random.default_rng(0).standard_normal((60, 4))
    # Three distinct eigenvalues: the space of a block of four is all there is to find after three
    # blocks.
    found = block_lanczos(lambda x: A @ x, unit, start, 10, 1e-12)
    assert found.converged
    assert found.blocks <= 4
    np.testing.assert_allclose(found.theta[:4], [5, 5, 5, 2], rtol=1e-12)
    crowded = np.diag(1.0 + np.arange(60) / 1e6)
    assert not block_lanczos(lambda x: crowded @ x, unit, start, 3, 1e-12, max_blocks=2).converged


def test_block_lanczos_restarts():
    """A spectrum too crowded for one stretch of the basis."""
    n = 400
    value = np.linspace(0.0, 1.0, n) ** 0.5
    found = block_lanczos(
        lambda x: value[:, None] * x,
        csr_array(np.eye(n)),
        np.random.default_rng(0).standard_normal((n, 3)),
        5,
        1e-8,
    )
    assert found.converged
    assert found.blocks > (3 * 5 + 9) // 3
    # The square of the residual.
    np.testing.assert_allclose(found.theta, np.sort(value)[::-1][:5], rtol=1e-12)
    np.testing.assert_allclose(found.X.T @ found.X, np.eye(5), atol=1e-12)
