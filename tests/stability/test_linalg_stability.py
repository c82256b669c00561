"""Bad matrices are refused, hard ones survive, memory comes back."""

from __future__ import annotations

import gc
import logging
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import block_diag, csr_array, lil_array

from upd.errors import ConvergenceError, InputError
from upd.fem import Material, box_mesh, stiffness
from upd.linalg import amg_solve, compliance_amg, factorise, schur_complement
from upd.linalg.select import has_pardiso
from upd.reduction import condense

needs_pardiso = pytest.mark.skipif(not has_pardiso(), reason="MKL is not installed")
DIRECT = [pytest.param("pardiso", marks=needs_pardiso), "superlu"]
ALL = [*DIRECT, "amg"]


def chain(k):
    """K of springs k in a row, the first to the ground."""
    k = np.asarray(k, dtype=float)
    return csr_array(np.diag(k + np.append(k[1:], 0.0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1))


def spoiled(row, column, value):
    K = lil_array(chain([2.0, 3.0, 4.0]))
    K[row, column] = value
    return csr_array(K)


@pytest.mark.parametrize("solver", ALL)
@pytest.mark.parametrize(
    ("K", "words"),
    [
        (spoiled(1, 1, np.nan), "not finite, the first in row 1"),
        (spoiled(2, 1, np.inf), "not finite, the first in row 2"),
        (spoiled(0, 2, 1e-9), r"not symmetric.*\(0, 2\)"),
        (csr_array(np.ones((2, 3))), r"square.*\(2, 3\)"),
        (csr_array((0, 0)), "square"),
        (csr_array(np.diag([1.0, 0.0, 2.0])), "Dof 1 has no positive stiffness"),
        (csr_array(np.diag([1.0, 2.0, -2.0])), "Dof 2 has no positive stiffness"),
        (csr_array(np.diag([1.0, 2.0, 2.0j])), "complex"),
        ("K", "square"),
    ],
)
def test_bad_matrices_are_refused(solver, K, words):
    with pytest.raises(InputError, match=words):
        condense(K, [0], solver=solver)


@pytest.mark.parametrize(
    ("kept", "words"),
    [
        ([], "at least one"),
        ([0, 3], "run from 0 to 3"),
        ([-1], "run from -1"),
        ([1, 1], "is duplicated"),
        ([0.5], "float64"),
        ([[0]], "dimension"),
        (np.array([True, False, True]), "mask"),
    ],
)
def test_bad_dofs_are_refused(kept, words):
    for run in (condense, schur_complement):
        with pytest.raises(InputError, match=words):
            run(chain([2.0, 3.0, 4.0]), kept)


@pytest.mark.parametrize("solver", DIRECT)
def test_bad_vectors_are_refused(solver):
    found = schur_complement(chain(np.ones(5)), [4, 0], solver=solver)
    with pytest.raises(InputError, match=r"shape \(3,\)"):
        found.recover(np.ones(3))
    with pytest.raises(InputError, match="not finite"):
        found.recover(np.array([1.0, np.nan]))
    with pytest.raises(InputError, match=r"shape \(4,\)"):
        factorise(chain(np.ones(5)), solver=solver)(np.ones(4))
    assert found.recover(np.zeros((2, 0))).shape == (5, 0)


@pytest.mark.parametrize("solver", ALL)
def test_the_caller_keeps_his_matrix(solver):
    """Unsorted and doubled entries are summed in a copy.

    a matrix of another format or type is fine.
    """
    rows, columns = [1, 0, 0, 1, 1], [1, 1, 0, 0, 1]
    K = csr_array((np.array([1.0, -1.0, 2.0, -1.0, 2.0]), (rows, columns)), shape=(2, 2))
    doubled = csr_array(
        (np.array([-1.0, 2.0, 2.0, -1.0, 1.0]), np.array([1, 0, 1, 0, 1]), np.array([0, 2, 5])),
        shape=(2, 2),
    )
    before = doubled.data.copy(), doubled.indices.copy()
    for A in (
        K,
        doubled,
        doubled.tocsc(),
        doubled.tocoo(),
        K.astype(np.int64),
        np.array([[2.0, -1.0], [-1.0, 3.0]]),
    ):
        assert condense(A, [1], solver=solver).compliance()[0, 0] == pytest.approx(0.4, rel=1e-12)
    np.testing.assert_array_equal(doubled.data, before[0])
    np.testing.assert_array_equal(doubled.indices, before[1])


@pytest.mark.parametrize("solver", DIRECT)
@pytest.mark.parametrize("ratio", [1e-12, 1e-6, 1e6, 1e12])
def test_stiffness_ratio(solver, ratio):
    """Springs of 1 and of `ratio` in turn, tied to the ground at both ends.

    Compliances against the closed form, row by row.
    """
    k = np.where(np.arange(12) % 4 < 2, 1.0, ratio)
    kept = np.array([11, 5, 2])
    found = condense(chain(k), kept, solver=solver)
    # Compliance of a chain at (i, j) is that of the springs up to the nearer of both.
    exact = np.cumsum(1.0 / k)[np.minimum.outer(kept, kept)]
    # Cholesky of a chain loses at most the digits that the stiffest neighbour takes from the
    # softest spring.
    digits = np.finfo(float).eps * 20 * max(ratio, 1.0 / ratio)
    np.testing.assert_allclose(found.compliance(), exact, rtol=digits)


@pytest.mark.parametrize("solver", DIRECT)
def test_stiff_block_on_a_soft_one(solver):
    """Two cubes a million million times apart in stiffness, the soft one on the clamped stiff one.

    The answer of the soft one alone.
    """
    mesh = box_mesh([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], np.arange(5.0))
    stiff = mesh.points[mesh.hexes].mean(axis=1)[:, 2] < 2.0
    materials = [Material(200e3, 0.3), Material(200e15, 0.3)]
    top = 3 * mesh.nodes["z1"] + 2

    def compliance(K, fixed):
        free = np.setdiff1d(np.arange(3 * mesh.n_node), (3 * fixed[:, None] + np.arange(3)).ravel())
        return condense(K[free][:, free], np.searchsorted(free, top), solver=solver).compliance()

    both = compliance(
        stiffness(mesh, materials, "hex8", regions=stiff.astype(np.int64)), mesh.nodes["z0"]
    )
    soft = compliance(
        stiffness(mesh, materials[0], "hex8"), np.flatnonzero(mesh.points[:, 2] <= 2.0)
    )
    # The stiff block gives way by 1e-12 of the soft one; at the interface rounding of its
    # stiffness, 1e-16 x 1e12, is no spring of its own.
    np.testing.assert_allclose(both, soft, rtol=1e-10, atol=1e-10 * soft.max())


@pytest.mark.parametrize("solver", DIRECT)
def test_floating_part_and_mechanism(solver):
    """A part that touches nothing, with kept dofs on the other one.

    And a zero spring inside a chain.
    """
    loose = csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]]))
    K = csr_array(block_diag([chain(np.ones(4)), loose]))
    modes = np.ones((6, 1))
    with pytest.raises(
        ConvergenceError, match=r"a loose part of 2 dofs, the first 4, is free in rigid mode 0"
    ):
        condense(K, [1], solver=solver, rigid_modes=modes)
    with pytest.raises(ConvergenceError, match="a part of the body floats"):
        condense(K, [1], solver=solver)
    with pytest.raises(ConvergenceError, match="a part of the body floats"):
        condense(chain([1.0, 1.0, 0.0, 1.0, 1.0]), [1], solver=solver)
    # Held by a kept dof, the loose part has a Schur complement, zero: it is a mechanism for
    # condense, not for schur_complement.
    S = schur_complement(K, [1, 5], solver=solver).S
    assert abs(S[1]).max() <= 1e-15
    assert S[0, 0] == pytest.approx(0.5, rel=1e-14)


@pytest.mark.parametrize("solver", DIRECT)
def test_indefinite_is_refused(solver):
    K = csr_array(np.array([[1.0, 3.0, 0.0], [3.0, 1.0, 1.0], [0.0, 1.0, 4.0]]))
    with pytest.raises(ConvergenceError, match="not positive definite"):
        condense(K, [2], solver=solver)
    with pytest.raises(ConvergenceError, match="floats"):
        condense(K, [0], solver=solver)


def test_multigrid_that_cannot_converge():
    K = chain(np.ones(3000))
    with pytest.raises(ConvergenceError, match="after 2 iterations"):
        amg_solve(K, np.eye(3000)[0], max_iterations=2)
    with pytest.raises(ConvergenceError, match="hold the distant set"):
        compliance_amg(csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]])), [0])
    assert amg_solve(K, np.zeros(3000)).iterations == 0


def test_multigrid_arguments():
    K = chain(np.ones(6))
    for keywords, words in (
        ({"near_null_space": np.ones((5, 6))}, r"shape \(5, 6\)"),
        ({"near_null_space": np.ones(6)}, r"give \(6, 6\)"),
        ({"layout": np.arange(5)}, "whole number"),
        ({"layout": np.zeros(6, int)}, "duplicated dof"),
        ({"rhs": np.ones((6, 2))}, "once per load case"),
    ):
        with pytest.raises(InputError, match=words):
            amg_solve(K, **{"rhs": np.ones(6), **keywords})


def test_the_log_says_which_solver_ran(caplog):
    with caplog.at_level(logging.INFO, logger="upd.linalg"):
        condense(chain(np.ones(50)), [49], solver="superlu")
        amg_solve(chain(np.ones(50)), np.ones(50))
    assert "superlu: 50 dofs onto 1" in caplog.text
    assert "amg: 50 dofs, Converged" in caplog.text


#: Fresh memory is filled with large numbers instead of the zeros it mostly has; read by glibc.
POISON = {"MALLOC_PERTURB_": "170", "MKL_DISABLE_FAST_MM": "1"}
STAR = """
import numpy as np
from scipy.sparse import csr_array
from upd.linalg import schur_pardiso
for n in (2, 3, 9, 50):
    for kept in ([0], list(range(n - 1)), list(range(n))):
        K = np.diag(np.arange(2.0, n + 2.0))
        K[0, 1:] = K[1:, 0] = -1.0 / n
        inner = np.setdiff1d(np.arange(n), kept)
        X = np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, kept)])
        found = schur_pardiso(csr_array(K), kept)
        S = K[np.ix_(kept, kept)] - K[np.ix_(kept, inner)] @ X
        np.testing.assert_allclose(found.S, S, rtol=1e-14, atol=1e-14)
        u = np.linspace(1.0, 2.0, len(kept))
        np.testing.assert_allclose(found.recover(u)[inner], -X @ u, rtol=1e-14)
print("through")
"""


@needs_pardiso
def test_inner_dofs_without_a_coupling_among_themselves():
    """A star of dofs around kept ones, K_ii diagonal: PARDISO's analysis reads memory that it never
    wrote, and with luck nothing happens. In a process of its own, without the luck.
    """
    done = subprocess.run(
        [sys.executable, "-c", STAR], env={**os.environ, **POISON}, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (0, "through\n"), done.stderr


@needs_pardiso
@pytest.mark.skipif(sys.platform != "linux", reason="resident memory is read from /proc")
def test_memory_comes_back():
    """Factors of some MB each, some failing and some made by the recovery, leave nothing behind."""
    mesh = box_mesh(*(np.linspace(0.0, 10.0, 11),) * 3)
    K = stiffness(mesh, Material(200e3, 0.3), "hex8")
    free = np.setdiff1d(
        np.arange(3 * mesh.n_node), (3 * mesh.nodes["z0"][:, None] + np.arange(3)).ravel()
    )
    held, loose = K[free][:, free], K
    kept = np.searchsorted(free, 3 * mesh.nodes["z1"] + 2)

    def resident():
        gc.collect()
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

    def one(j):
        found = condense(held, kept, solver="pardiso", keep_factor=bool(j % 2))
        found.recover(np.ones(len(kept)))
        if j % 5 == 0:
            with pytest.raises(ConvergenceError):
                condense(loose, kept, solver="pardiso")
        return found

    size = one(0).peak_bytes
    one(1)
    before = resident()
    for j in range(12):
        one(j)
    assert resident() - before < 2 * size
