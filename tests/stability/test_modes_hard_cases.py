"""Spectra that break eigensolvers.

Equal frequencies, floating bodies, slivers, stiff parts, massless dofs, too many modes.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import block_diag, csr_array

from upd.errors import ConvergenceError, InputError
from upd.fem import Material, box_mesh, mass, rigid_body_modes, stiffness
from upd.linalg import Eigenproblem, modes
from upd.linalg.lanczos import BLOCK
from upd.linalg.select import has_pardiso
from upd.reduction import craig_bampton

STEEL = Material(200e3, 0.3)
DIRECT = [
    "superlu",
    pytest.param(
        "pardiso", marks=pytest.mark.skipif(not has_pardiso(), reason="MKL is not installed")
    ),
]
EPS = np.finfo(float).eps


def bar(shape=(12, 3, 3), size=(80.0, 10.0, 8.0), clamped=True, material=STEEL, regions=None):
    """K, M of a box and its mesh; clamped at x0, fixed dofs taken out."""
    mesh = box_mesh(*(np.linspace(0, a, n + 1) for a, n in zip(size, shape, strict=True)))
    K, M = stiffness(mesh, material, regions=regions), mass(mesh, material, regions=regions)
    free = np.arange(3 * mesh.n_node)
    if clamped:
        free = np.setdiff1d(free, (3 * mesh.nodes["x0"][:, None] + np.arange(3)).ravel())
    return csr_array(K[free][:, free]), csr_array(M[free][:, free]), mesh


def smallest(K, M, count):
    """Smallest eigenvalues (count,) by dense algebra, of the inverse problem.

    Its rounding is relative to them, not to the largest.
    """
    theta = eigh(M.toarray(), K.toarray(), eigvals_only=True)
    return 1 / theta[::-1][:count]


def copies(A, n):
    return csr_array(block_diag([A] * n, format="csr"))


@pytest.mark.parametrize("solver", [*DIRECT, "dense"])
def test_two_equal_beams_of_a_square_section(solver):
    """Fourfold frequencies.

    Two bodies, two directions each. All are found, and their shapes are independent.
    """
    K, M, _ = bar((10, 2, 2), (80.0, 8.0, 8.0))
    one = eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=[0, 5])
    K2, M2 = copies(K, 2), copies(M, 2)
    found = modes(K2, M2, count=10, solver=solver)
    np.testing.assert_allclose(found.eigenvalue, np.repeat(one, 2)[:10], rtol=1e-9)
    assert found.status == 0
    assert found.orthogonality < 1e-12
    np.testing.assert_allclose(found.frequency[:4], found.frequency[0], rtol=1e-9)


@pytest.mark.parametrize("solver", DIRECT)
@pytest.mark.parametrize("count", [3, BLOCK + 3])
def test_more_equal_bodies_than_a_block_has_vectors(solver, count):
    """Eigenvalues of higher multiplicity than the block.

    a plain Lanczos run shows one block of them and then the next frequency.
    """
    K, M, _ = bar((6, 1, 1), (60.0, 7.0, 5.0))
    many = BLOCK + 3
    one = eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=[0, 1])
    found = modes(copies(K, many), copies(M, many), count=count, solver=solver)
    np.testing.assert_allclose(found.eigenvalue, one[0], rtol=1e-9)
    more = modes(
        copies(K, many),
        copies(M, many),
        below_hz=np.sqrt(one[0] * one[1]) ** 0.5 / (2 * np.pi),
        solver=solver,
    )
    assert len(more.frequency) == many


def test_nearly_equal_pair_is_resolved():
    """Two beams whose frequencies differ by 1e-9: each mode lives on one of them."""
    K, M, _ = bar()
    n = K.shape[0]
    K2 = csr_array(block_diag([K, (1 + 2e-9) * K], format="csr"))
    found = modes(K2, copies(M, 2), count=4, solver="superlu")
    assert found.frequency[1] / found.frequency[0] - 1 == pytest.approx(1e-9, rel=0.05)
    share = np.linalg.norm(found.shapes[:n, :2], axis=0) / np.linalg.norm(
        found.shapes[:, :2], axis=0
    )
    # The shapes turn by rounding of the eigenvalue, 1e-13 here, over the gap.
    np.testing.assert_allclose(share, [1, 0], atol=0.02)


@pytest.mark.parametrize("solver", [*DIRECT, "dense"])
def test_several_floating_bodies(solver):
    K, M, _ = bar((8, 2, 2), clamped=False)
    found = modes(copies(K, 2), copies(M, 2), count=16, solver=solver)
    assert found.n_rigid == 12
    assert (found.frequency[:12] == 0.0).all()
    elastic = eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=[6, 7])
    np.testing.assert_allclose(found.eigenvalue[12:], np.repeat(elastic, 2), rtol=1e-7)


@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (200.0, 2.0, 1.5), (1e-3, 1e-3, 2e-3)])
def test_floating_bodies_of_any_size_and_slenderness(size):
    """The guessed shift is of a compact body.

    a needle's first frequency is a thousand times lower.
    """
    K, M, mesh = bar((30, 2, 2), size, clamped=False)
    found = modes(K, M, count=9, solver="superlu")
    assert found.n_rigid == 6
    rigid = rigid_body_modes(mesh.points)
    rest = found.shapes[:, :6] - rigid @ (rigid.T @ found.shapes[:, :6])
    assert np.linalg.norm(rest) < 1e-5 * np.linalg.norm(found.shapes[:, :6])
    first = found.eigenvalue[6]
    assert -10 * first <= found.sigma <= -0.01 * first
    # The same with the shift told and with another one.
    for sigma in (-0.5 * first, -3 * first):
        np.testing.assert_allclose(
            modes(K, M, count=9, sigma=sigma, solver="superlu").frequency[6:],
            found.frequency[6:],
            rtol=1e-6,
        )


@pytest.mark.parametrize("solver", DIRECT)
def test_needle_elements(solver):
    """Hexahedra a hundred times longer than wide: against the dense spectrum."""
    K, M, _ = bar((8, 4, 4), (400.0, 2.0, 2.0))
    found = modes(K, M, count=6, solver=solver)
    exact = smallest(K, M, 6)
    # Rounding of K, eps |K|, over the eigenvalue.
    bound = 10 * EPS * abs(K).max() / (found.eigenvalue * M.diagonal().min())
    assert (np.abs(found.eigenvalue / exact - 1) <= np.maximum(bound, 1e-9)).all()
    np.testing.assert_allclose(found.frequency[::2], found.frequency[1::2], rtol=1e-4)


@pytest.mark.parametrize("solver", [*DIRECT, "dense"])
@pytest.mark.parametrize("factor", [1e4, 1e-4])
def test_a_part_ten_thousand_times_stiffer(solver, factor):
    shape = (12, 3, 3)
    regions = (np.arange(np.prod(shape)) // 9 >= 6).astype(int)
    K, M, _ = bar(shape, material=[STEEL, Material(200e3 * factor, 0.3)], regions=regions)
    found = modes(K, M, count=6, solver=solver)
    exact = smallest(K, M, 6)
    np.testing.assert_allclose(found.eigenvalue, exact, rtol=1e-6)
    assert (found.residual <= np.maximum(1e-6, found.rounding)).all()


@pytest.mark.parametrize("solver", [*DIRECT, "dense"])
def test_massless_dofs_follow_statically(solver):
    """A third of the nodes without mass: the same as condensing them out before."""
    K, M, _ = bar((8, 3, 3))
    n = K.shape[0]
    massive = np.random.default_rng(0).random(n // 3) > 1 / 3
    keep = np.repeat(massive, 3)
    lumped = np.where(keep, np.asarray(M.sum(axis=1)).ravel(), 0.0)
    found = modes(K, csr_array(np.diag(lumped)), count=7, solver=solver)
    A = K.toarray()
    S = A[np.ix_(keep, keep)] - A[np.ix_(keep, ~keep)] @ np.linalg.solve(
        A[np.ix_(~keep, ~keep)], A[np.ix_(~keep, keep)]
    )
    exact = eigh(0.5 * (S + S.T), np.diag(lumped[keep]), eigvals_only=True, subset_by_index=[0, 6])
    np.testing.assert_allclose(found.eigenvalue, exact, rtol=1e-9)
    # No force on a massless dof.
    force = (K @ found.shapes)[~keep]
    assert np.abs(force).max() <= 1e-8 * (abs(K) @ np.abs(found.shapes))[~keep].max()
    assert Eigenproblem(K, csr_array(np.diag(lumped))).n_massive == keep.sum()
    with pytest.raises(InputError, match=f"{keep.sum()} dofs with mass"):
        modes(K, csr_array(np.diag(lumped)), count=int(keep.sum()) + 1, solver=solver)


def test_every_mode_of_a_model_with_massless_dofs():
    K, M, _ = bar((3, 1, 1))
    lumped = np.asarray(M.sum(axis=1)).ravel()
    lumped[: len(lumped) // 2] = 0.0
    found = modes(K, csr_array(np.diag(lumped)), count=len(lumped) - len(lumped) // 2)
    assert found.frequency.shape == (len(lumped) - len(lumped) // 2,)
    assert np.isfinite(found.frequency).all()


def test_massless_part_that_floats_is_told():
    K, M, _ = bar((4, 1, 1), clamped=False)
    with pytest.raises(ConvergenceError, match="massless"):
        modes(
            copies(K, 2), csr_array(block_diag([M, 0 * M], format="csr")), count=3, solver="superlu"
        )


@pytest.mark.parametrize("solver", [*DIRECT, "dense", "auto"])
def test_more_modes_than_the_model_has(solver):
    K, M, _ = bar((3, 1, 1))
    n = K.shape[0]
    with pytest.raises(InputError, match=f"{n} dofs with mass"):
        modes(K, M, count=n + 1, solver=solver)
    everything = modes(K, M, count=n, solver=solver)
    assert everything.frequency.shape == (n,)
    assert modes(K, M, below_hz=1e12, solver=solver).frequency.shape == (n,)
    np.testing.assert_allclose(
        everything.eigenvalue, eigh(K.toarray(), M.toarray(), eigvals_only=True), rtol=1e-8
    )


def test_a_mass_matrix_of_lower_rank_than_it_looks():
    """Two masses tied to one coordinate: two dofs with mass, one mode."""
    K, M = np.diag([3.0, 5.0]), np.ones((2, 2))
    np.testing.assert_allclose(modes(K, M, count=1).eigenvalue, [1 / (1 / 3 + 1 / 5)])
    with pytest.raises(ConvergenceError, match="rank of M"):
        modes(K, M, count=2)


def test_an_indefinite_stiffness_is_told():
    K = np.array([[1.0, 2.0], [2.0, 1.0]])
    for sigma in (None, -10.0):
        with pytest.raises(ConvergenceError, match="not positive"):
            modes(K, np.eye(2), count=2, sigma=sigma)


def test_a_shift_of_zero_is_refused_on_every_floating_solid():
    """Rounding makes half of these singular matrices pass a Cholesky factorisation."""
    for shape in ((1, 1, 1), (2, 1, 1), (2, 2, 2), (4, 2, 1), (5, 3, 2)):
        K, M, _ = bar(shape, clamped=False)
        for solver in ("dense", "superlu"):
            with pytest.raises(ConvergenceError, match="floats"):
                modes(K, M, count=3, sigma=0.0, solver=solver)


def test_too_many_modes_for_the_memory(monkeypatch):
    K, M, _ = bar()
    monkeypatch.setattr("upd.linalg.eigen.memory_left", lambda: 1e6)
    with pytest.raises(InputError, match="GB: ask for fewer"):
        modes(K, M, count=200)


def test_one_and_two_dofs():
    found = modes(np.array([[4.0]]), np.array([[1.0]]), count=1)
    np.testing.assert_allclose(found.eigenvalue, [4.0])
    found = modes(np.array([[1.0, -1.0], [-1.0, 1.0]]), np.eye(2), count=2)
    np.testing.assert_allclose(found.eigenvalue, [0.0, 2.0], atol=1e-15)


@pytest.mark.parametrize("floats", [False, True])
def test_equal_frequencies_of_a_square_bar(floats):
    K, M, _ = bar((14, 3, 3), (80.0, 8.0, 8.0), clamped=not floats)
    direct = modes(K, M, count=12, solver="superlu")
    np.testing.assert_allclose(
        direct.frequency, modes(K, M, count=12, solver="dense").frequency, rtol=1e-8
    )
    start = 6 if floats else 0
    np.testing.assert_allclose(direct.frequency[start], direct.frequency[start + 1], rtol=1e-9)


def test_reduced_model_of_a_floating_body_with_a_stiff_part():
    shape = (10, 2, 2)
    regions = (np.arange(np.prod(shape)) // 4 >= 5).astype(int)
    K, M, mesh = bar(shape, clamped=False, material=[STEEL, Material(2e9, 0.3)], regions=regions)
    ends = np.concatenate([mesh.nodes["x0"], mesh.nodes["x1"]])
    model = craig_bampton(K, M, (3 * ends[:, None] + np.arange(3)).ravel(), n_modes=15)
    found, full = model.modes(count=9), modes(K, M, count=9)
    assert found.n_rigid == full.n_rigid == 6
    np.testing.assert_allclose(found.frequency[6:], full.frequency[6:], rtol=1e-3)
