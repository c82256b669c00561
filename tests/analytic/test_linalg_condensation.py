"""Condensation, factors and multigrid against dense algebra and bodies with a known stiffness."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from upd.errors import ConvergenceError, InputError
from upd.fem import Material, box_mesh, rigid_body_modes, stiffness
from upd.linalg import (
    amg_solve,
    available,
    choose,
    compliance_amg,
    factorise,
    predict,
    schur_complement,
)
from upd.linalg import select as select_module
from upd.linalg.select import has_pardiso
from upd.reduction import condense

DIRECT = [
    pytest.param(
        "pardiso", marks=pytest.mark.skipif(not has_pardiso(), reason="MKL is not installed")
    ),
    "superlu",
]
STEEL = Material(200e3, 0.3)
EPS = np.finfo(float).eps


def body(n=5, supported=True):
    """K of a 10 mm cube of n^3 hexahedra, clamped below if supported.

    Its rigid modes; dof layout; z dofs of the top.
    """
    mesh = box_mesh(*(np.linspace(0.0, 10.0, n + 1),) * 3)
    K = stiffness(mesh, STEEL, "hex8")
    fixed = (3 * mesh.nodes["z0"][:, None] + np.arange(3)).ravel() if supported else []
    free = np.setdiff1d(np.arange(3 * mesh.n_node), fixed)
    top = np.searchsorted(free, 3 * mesh.nodes["z1"] + 2)
    return csr_array(K[free][:, free]), rigid_body_modes(mesh.points)[free], free, top


def dense_schur(K, kept):
    """S, the inner dofs, and the map of kept onto inner displacements."""
    A = K.toarray()
    inner = np.setdiff1d(np.arange(len(A)), kept)
    X = np.linalg.solve(A[np.ix_(inner, inner)], A[np.ix_(inner, kept)])
    return A[np.ix_(kept, kept)] - A[np.ix_(kept, inner)] @ X, inner, -X


@pytest.mark.parametrize("solver", DIRECT)
@pytest.mark.parametrize("keep_factor", [True, False])
def test_schur_complement_and_recovery_equal_dense_ones(solver, keep_factor):
    K, _, _, top = body()
    kept = np.random.default_rng(1).permutation(top)
    S, inner, T = dense_schur(K, kept)
    found = schur_complement(K, kept, solver=solver, keep_factor=keep_factor)
    bound = len(top) * K.shape[0] * EPS
    np.testing.assert_allclose(found.S, S, atol=bound * abs(K).max())
    assert np.array_equal(found.S, found.S.T)
    u_kept = np.random.default_rng(2).standard_normal((len(kept), 3))
    u = found.recover(u_kept)
    assert np.array_equal(u[kept], u_kept)
    np.testing.assert_allclose(u[inner], T @ u_kept, atol=K.shape[0] * EPS * 100)
    np.testing.assert_allclose(found.recover(u_kept[:, 0]), u[:, 0], atol=K.shape[0] * EPS)
    np.testing.assert_allclose(
        K @ u[:, 0],
        np.where(np.isin(np.arange(K.shape[0]), kept), K @ u[:, 0], 0.0),
        atol=bound * abs(K).max(),
    )
    assert found.factor_nnz >= K.shape[0] - len(kept)
    assert found.peak_bytes > 8 * found.factor_nnz


@pytest.mark.parametrize("solver", DIRECT)
def test_all_dofs_kept_and_one(solver):
    K, _, _, top = body(2)
    order = np.random.default_rng(0).permutation(K.shape[0])
    found = condense(K, order, solver=solver)
    np.testing.assert_array_equal(found.S, K.toarray()[np.ix_(order, order)])
    u = np.arange(K.shape[0], dtype=float)
    np.testing.assert_array_equal(found.recover(u)[order], u)
    one = condense(K, top[:1], solver=solver)
    assert one.compliance()[0, 0] == pytest.approx(
        np.linalg.inv(K.toarray())[top[0], top[0]], rel=1e-10
    )
    single = condense(csr_array(np.array([[4.0]])), [0], solver=solver)
    assert single.compliance()[0, 0] == 0.25


@pytest.mark.parametrize("solver", DIRECT)
def test_dofs_that_touch_nothing(solver):
    """Free and kept dofs without neighbours, which a library may never have seen."""
    K = csr_array(np.diag(np.arange(1.0, 9.0)))
    found = schur_complement(K, [6, 0], solver=solver)
    np.testing.assert_array_equal(found.S, np.diag([7.0, 1.0]))
    np.testing.assert_array_equal(found.recover(np.array([2.0, 3.0])), [3, 0, 0, 0, 0, 0, 2, 0])


@pytest.mark.parametrize("solver", DIRECT)
def test_factor_solves(solver):
    K, _, _, _ = body(3)
    rhs = np.random.default_rng(0).standard_normal((K.shape[0], 2))
    F = factorise(K, solver=solver)
    np.testing.assert_allclose(K @ F(rhs), rhs, atol=1e-10)
    np.testing.assert_allclose(F(rhs[:, 1]), F(rhs)[:, 1], rtol=1e-10, atol=1e-18)


def test_bar_in_series():
    """Springs in a row, 1/k = 1/k1 + 1/k2 + ..., whatever the solver."""
    k = np.array([3.0, 5.0, 7.0, 2.0])
    K = np.diag(k + np.append(k[1:], 0.0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    for solver in ("auto", "superlu"):
        found = condense(csr_array(K), [3], solver=solver)
        assert found.S[0, 0] == pytest.approx(1.0 / (1.0 / k).sum(), rel=1e-14)
        np.testing.assert_allclose(
            found.recover(np.ones(1)), np.cumsum(1.0 / k) / (1.0 / k).sum(), rtol=1e-14
        )


@pytest.mark.skipif(not has_pardiso(), reason="MKL is not installed")
def test_three_solvers_agree():
    K, modes, layout, top = body()
    kept = top[::5]
    C = {
        name: condense(K, kept, solver=name, rigid_modes=modes, layout=layout)
        for name in ("pardiso", "superlu", "amg")
    }
    reference = C["superlu"].compliance()
    for name, bound in (("pardiso", 1e-12), ("amg", 1e-8)):
        np.testing.assert_allclose(
            C[name].compliance(), reference, atol=bound * abs(reference).max()
        )
        np.testing.assert_allclose(C[name].compliance() @ C[name].S, np.eye(len(kept)), atol=1e-9)
    u_kept = np.linspace(0.0, 1.0, len(kept))
    np.testing.assert_allclose(C["amg"].recover(u_kept), C["pardiso"].recover(u_kept), atol=1e-6)
    assert C["amg"].recover(np.column_stack([u_kept, u_kept])).shape == (K.shape[0], 2)
    assert [C[name].solver for name in C] == list(C)


def test_compliance_is_computed_once_and_protected():
    K, _, _, top = body(2)
    found = condense(K, top)
    C = found.compliance()
    assert found.compliance() is C
    assert np.array_equal(C, C.T)
    np.testing.assert_allclose(C @ found.S, np.eye(len(C)), atol=1e-11)
    with pytest.raises(ValueError, match="read-only"):
        C[0, 0] = 1.0


def test_multigrid_with_rigid_modes_needs_few_iterations():
    """Missing dofs (a mirror plane, an uneven support) leave the blocks of nodes whole."""
    mesh = box_mesh(*(np.linspace(0.0, 10.0, 13),) * 3)
    K = stiffness(mesh, STEEL, "hex8")
    modes = rigid_body_modes(mesh.points)
    fixed = np.concatenate(
        [
            (3 * mesh.nodes["z0"][:, None] + np.arange(3)).ravel(),
            3 * mesh.nodes["x0"],
            [3 * mesh.nodes["y1"][-1] + 1],
        ]
    )
    free = np.setdiff1d(np.arange(3 * mesh.n_node), fixed)
    A = K[free][:, free]
    rhs = np.zeros(len(free))
    rhs[-1] = 1.0
    blocks = amg_solve(A, rhs, modes[free], layout=free)
    exact = factorise(A)(rhs)
    np.testing.assert_allclose(blocks.x, exact, atol=1e-8 * abs(exact).max())
    assert blocks.iterations <= 25
    plain = amg_solve(A, rhs)
    assert plain.iterations > 1.5 * blocks.iterations
    np.testing.assert_allclose(plain.x, exact, atol=1e-8 * abs(exact).max())


def test_multigrid_finds_whole_nodes_by_itself():
    K, modes, layout, top = body(6)
    rhs = np.zeros(K.shape[0])
    rhs[top[0]] = 1.0
    T = np.zeros_like(modes)
    T[:, :3] = np.tile(np.eye(3), (K.shape[0] // 3, 1))
    T[:, 3:] = modes[:, 3:]
    assert amg_solve(K, rhs, T).iterations == amg_solve(K, rhs, T, layout=layout).iterations


def test_multigrid_with_a_rigid_set():
    """Nodes of the top move as one: three unknowns that belong to no node."""
    mesh = box_mesh(*(np.linspace(0.0, 10.0, 7),) * 3)
    top, held = (3 * mesh.nodes[name][:, None] + np.arange(3) for name in ("z1", "z0"))
    free = np.setdiff1d(np.arange(3 * mesh.n_node), np.concatenate([top, held]))
    n, rigid = len(free), len(free) + np.arange(3)
    rows, columns = (
        np.concatenate([free, *top]),
        np.concatenate([np.arange(n), *([rigid] * len(top))]),
    )
    T = csr_array((np.ones(len(rows)), (rows, columns)), shape=(3 * mesh.n_node, n + 3))
    K = csr_array(T.T @ stiffness(mesh, STEEL, "hex8") @ T)
    layout = np.append(free, np.full(3, -1))
    modes = np.zeros((n + 3, 6))
    modes[:n] = rigid_body_modes(mesh.points)[free]
    modes[rigid, [0, 1, 2]] = 1.0
    C = compliance_amg(K, rigid, modes, layout=layout).compliance()
    expected = condense(K, rigid, solver="superlu").compliance()
    np.testing.assert_allclose(C, expected, atol=1e-8 * abs(expected).max())


def test_model_of_cost():
    """Memory of a direct solver outgrows that of multigrid; more kept dofs never cost less."""
    for solver in ("pardiso", "superlu", "amg"):
        costs = [predict(214_326, k, solver) for k in (1, 1000, 5000)]
        assert costs[0].bytes < costs[1].bytes < costs[2].bytes
        assert costs[0].seconds < costs[1].seconds < costs[2].seconds
    assert predict(10**6, 1, "pardiso").bytes > 4 * predict(10**6, 1, "amg").bytes
    # One measured condensation: 247 million entries, 2.1 GB for the factor.
    assert 2e9 < predict(214_326, 1681, "pardiso").bytes < 4e9


def test_choice(monkeypatch):
    assert choose(10_000, 100, solver="superlu").why == "named by the user"
    assert choose(10**6, 10, memory_limit_bytes=5e9).name == "amg"
    assert choose(10**6, 10, memory_limit_bytes=1e6).why.startswith("needs the least memory")
    monkeypatch.setattr(select_module, "has_pardiso", lambda: False)
    chosen = choose(10_000, 100, memory_limit_bytes=1e11)
    assert chosen.name == "superlu"
    assert "pip install updampers[mkl]" in chosen.why
    assert "pip install updampers[mkl]" in available()["solver pardiso"]
    with pytest.raises(InputError, match=r"pip install updampers\[mkl\]"):
        choose(10_000, 100, solver="pardiso")
    with pytest.raises(InputError, match="Unknown solver 'mumps'"):
        choose(10_000, 100, solver="mumps")
    with pytest.raises(InputError, match="no factor"):
        schur_complement(body(2)[0], [0], solver="amg")


def test_available_names_versions():
    found = available()
    assert found["solver superlu"].startswith("scipy 1")
    assert found["BLAS of numpy"] != "unknown"
    assert int(found["threads"]) >= 1


@pytest.mark.parametrize("solver", DIRECT)
def test_floating_body_is_named(solver):
    K, modes, _, top = body(3, supported=False)
    with pytest.raises(
        ConvergenceError, match=r"translation x.*rotation about z.*hold the distant set"
    ):
        condense(K, top, solver=solver, rigid_modes=modes)
    with pytest.raises(ConvergenceError, match="floats"):
        condense(K, top, solver=solver)
    with pytest.raises(ConvergenceError, match="hold the distant set"):
        factorise(K, solver=solver)


@pytest.mark.parametrize("solver", DIRECT)
def test_free_directions_are_named_one_by_one(solver):
    """Rollers below: free in x, y and about z.

    Springs on x and y of one node leave the rotation.
    """
    mesh = box_mesh(*(np.linspace(0.0, 10.0, 4),) * 3)
    K, modes = stiffness(mesh, STEEL, "hex8"), rigid_body_modes(mesh.points)
    free = np.setdiff1d(np.arange(3 * mesh.n_node), 3 * mesh.nodes["z0"] + 2)
    kept = np.searchsorted(free, 3 * mesh.nodes["z1"] + 2)
    with pytest.raises(ConvergenceError) as caught:
        condense(K[free][:, free], kept, solver=solver, rigid_modes=modes[free])
    message = str(caught.value)
    assert all(name in message for name in ("translation x", "translation y", "rotation about z"))
    assert not any(name in message for name in ("translation z", "about x", "about y"))
    with pytest.raises(ConvergenceError, match="floats"):
        condense(K[free][:, free], kept, solver=solver)


@pytest.mark.parametrize("solver", DIRECT)
def test_body_that_only_its_kept_dofs_hold(solver):
    """S of a free body is singular but right.

    Six null motions, the rest as dense algebra has it.
    """
    K, modes, _, _ = body(2, supported=False)
    kept = np.random.default_rng(0).permutation(K.shape[0])[:30]
    S, inner, T = dense_schur(K, kept)
    found = schur_complement(K, kept, solver=solver)
    np.testing.assert_allclose(found.S, S, atol=1e-12 * abs(K).max())
    np.testing.assert_allclose(found.S @ modes[kept], 0.0, atol=1e-12 * abs(K).max())
    np.testing.assert_allclose(found.recover(modes[kept]), modes, atol=1e-11)
    np.testing.assert_allclose(found.recover(np.ones(30))[inner], T @ np.ones(30), atol=1e-11)
    with pytest.raises(ConvergenceError, match="hold the distant set"):
        condense(K, kept, solver=solver)
