"""Memory beside the factors, and runs that do not fit."""

from __future__ import annotations

import gc
import re
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from upd.analyses import make_plan
from upd.analyses.cost import CostModel
from upd.errors import InputError
from upd.fem import Material, box_mesh, mass, stiffness
from upd.linalg import factorise, modes, select
from upd.linalg.common import checked_matrix, submatrix
from upd.linalg.select import has_pardiso
from upd.linalg.symmetric import Symmetric, combined, submatrix_of, whole
from upd.reduction import condense
from upd.scene import load_scene

STEEL = Material(200e3, 0.3, 7.8e-9)
READY = ("hertz", "symmetric", "asymmetric", "rig", "symmetric-response", "asymmetric-response")


def nbytes(A):
    return A.data.nbytes + A.indices.nbytes + A.indptr.nbytes


@pytest.fixture(scope="module")
def block():
    """K, K and M without clamped dofs, free dofs, dofs of a patch."""
    return cube(16)


def cube(divisions):
    mesh = box_mesh(*(np.linspace(0.0, 10.0, divisions + 1),) * 3)
    K, M = stiffness(mesh, STEEL), mass(mesh, STEEL)
    clamped = (3 * mesh.nodes["z0"][:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(3 * mesh.n_node), clamped)
    top = np.searchsorted(free, 3 * mesh.nodes["z1"][:20] + 2)
    return K, csr_array(K[free][:, free]), csr_array(M[free][:, free]), free, top


def peak(run):
    """Most bytes that numpy arrays took while `run` ran."""
    run()
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.skipif(not has_pardiso(), reason="SuperLU's factor is counted with its arrays")
@pytest.mark.parametrize("what", ["check", "factor", "condensation", "free"])
def test_copies_beside_the_factor(block, what):
    """PARDISO's input is two thirds of K, its factor is none of numpy's."""
    full, K, _, free, top = block
    runs = {
        "check": lambda: checked_matrix(K),
        "factor": lambda: factorise(K, solver="pardiso"),
        "condensation": lambda: condense(K, top, solver="pardiso"),
        "free": lambda: submatrix(full, free),
    }
    most = {"check": 1.0, "factor": 1.5, "condensation": 1.5, "free": 1.5}
    assert peak(runs[what]) < most[what] * nbytes(K)


@pytest.mark.skipif(not has_pardiso(), reason="SuperLU's factor is counted with its arrays")
def test_everything_beside_the_factor(block):
    """The body's own K, that of its free dofs and PARDISO's input, over the whole CSR matrix."""
    full, _, _, free, top = block
    tracemalloc.start()
    try:
        K = Symmetric.of(full)
        tracemalloc.reset_peak()
        condense(K.submatrix(free), top[::4], solver="pardiso")
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 1.5 * nbytes(full)


def test_upper_triangle_is_the_matrix(block):
    full, K, M, _, _ = block
    rng = np.random.default_rng(0)
    half, dofs = Symmetric.of(full), np.sort(rng.permutation(full.shape[0])[:300])
    x = rng.standard_normal((full.shape[0], 2))
    for y, size in ((x, 1.0), (x[:, 0], 1.0)):
        np.testing.assert_allclose(half @ y, full @ y, atol=size * 1e-13 * np.abs(full @ y).max())
    assert abs(whole(half) - full).max() == 0.0
    np.testing.assert_array_equal(half.diagonal(), full.diagonal())
    part = full[dofs][:, dofs].toarray()
    np.testing.assert_array_equal(whole(half.submatrix(dofs)).toarray(), part)
    found = whole(combined(Symmetric.of(K), -2.0, Symmetric.of(M))) - (K - 2.0 * M)
    assert abs(found).max() <= 1e-15 * abs(K).max()


@pytest.mark.parametrize("solver", ["pardiso", "superlu", "amg"])
def test_every_solver_takes_the_upper_triangle(solver):
    if solver == "pardiso" and not has_pardiso():
        pytest.skip("PARDISO is not installed")
    _, K, M, _, top = cube(8)
    R = np.random.default_rng(0).standard_normal((K.shape[0], 3))
    own, half = (condense(A, top, solver=solver, rigid_modes=R) for A in (K, Symmetric.of(K)))
    np.testing.assert_allclose(half.S, own.S, rtol=1e-9, atol=1e-9 * np.abs(own.S).max())
    if solver != "amg":
        own, half = (
            modes(*pair, count=3, solver=solver).frequency
            for pair in ((K, M), (Symmetric.of(K), Symmetric.of(M)))
        )
        np.testing.assert_allclose(half, own, rtol=1e-9)


@pytest.mark.skipif(not has_pardiso(), reason="SuperLU's factor is counted with its arrays")
def test_a_matrix_is_checked_once(block, monkeypatch):
    _, K, _, _, top = block
    seen = []
    from upd.linalg import common

    own = common.largest_skew
    monkeypatch.setattr(common, "largest_skew", lambda A: seen.append(A) or own(A))
    condense(K, top, solver="pardiso")
    assert len(seen) == 1
    # What is made of a checked matrix is not checked.
    skew = checked_matrix(K).copy()
    skew.data[1] *= 2.0
    with pytest.raises(InputError, match="not symmetric"):
        checked_matrix(skew)
    assert modes(K, block[2], count=1).status == 0


@pytest.mark.parametrize("n", [0, 1, 50])
def test_submatrix(n):
    A = csr_array(np.random.default_rng(0).random((60, 60)) * (np.arange(60) % 3 > 0))
    dofs = np.sort(np.random.default_rng(n).permutation(60)[:n])
    np.testing.assert_array_equal(submatrix(A, dofs).toarray(), A.toarray()[np.ix_(dofs, dofs)])


@pytest.mark.parametrize("name", READY)
@pytest.mark.parametrize("free", [4e9, 24e9])
def test_ready_scenes_fit(monkeypatch, name, free):
    monkeypatch.setattr(select, "memory_left", lambda: free)
    make_plan(load_scene(name)).refuse_oversize()


@pytest.mark.parametrize("parts", [0.5, 0.9])
def test_what_does_not_fit_is_refused(monkeypatch, parts):
    plan = make_plan(load_scene("hertz"))
    monkeypatch.setattr(select, "memory_left", lambda: parts * plan.memory_bytes)
    with pytest.raises(InputError, match="use a coarser mesh"):
        plan.refuse_oversize()
    replace(plan, memory_bytes=0.99 * parts * plan.memory_bytes).refuse_oversize()


def test_a_refusal_names_the_size_that_fits():
    """Modes of a rig: what is said to fit lies between meshes that do and that do not."""
    memory = {"solver.memory": "4 GB"}

    def plan(refine):
        return make_plan(load_scene("rig", {**memory, "geometry.refine": refine}))

    def dofs(made):
        return 3 * sum(count["nodes"] for count in made.size.values())

    with pytest.raises(InputError) as told:
        plan(3).refuse_oversize()
    fit = float(re.search(r"about (\S+) dofs fit", str(told.value)).group(1))
    sizes = {refine: plan(refine) for refine in (1.0, 1.2, 1.5, 2.0)}
    fitting = [dofs(one) for one in sizes.values() if one.memory_bytes <= 4e9]
    others = [dofs(one) for one in sizes.values() if one.memory_bytes > 4e9]
    assert max(fitting) / 1.1 <= fit <= 1.1 * min(others)


def test_a_contact_without_inner_displacements_lets_factors_go(monkeypatch):
    """They need them again; without, fewer bodies at once take less before a run is refused."""
    monkeypatch.setattr(select, "threads", lambda: 4)
    monkeypatch.setattr(select, "memory_left", lambda: 20e9)

    def plan(*want):
        large = {"geometry.divisions": 24, "geometry.divisions_long": 54, "left_out.solve": "no"}
        wants = {"want": ("normal", *want), "accuracy": "unknown"}
        return make_plan(load_scene("asymmetric", large | wants))

    usual, without = plan("stiffness", "fields"), plan("stiffness")
    assert usual.effect("internal displacement") and not without.effect("internal displacement")
    assert usual.workers == without.workers == 4
    monkeypatch.setattr(select, "memory_left", lambda: 0.8 * without.memory_bytes)
    kept, fewer = plan("stiffness", "fields"), plan("stiffness")
    # as many as fit
    assert 1 < fewer.workers < 4
    fewer.refuse_oversize()
    # kept factors are all there in the end
    assert kept.workers == 1 and kept.memory_bytes == usual.memory_bytes
    with pytest.raises(InputError, match="use a coarser mesh"):
        kept.refuse_oversize()


@pytest.mark.skipif(not has_pardiso(), reason="SuperLU keeps K in other parts")
def test_what_stays_of_a_condensed_body_is_what_its_plan_says():
    """K of the free dofs and the dense matrices, once the factor is let go."""
    mesh = box_mesh(*(np.linspace(0.0, 10.0, 17),) * 3)
    free = np.setdiff1d(np.arange(3 * mesh.n_node), 3 * mesh.nodes["z0"][:, None] + np.arange(3))
    kept = np.searchsorted(free, 3 * mesh.nodes["z1"] + 2)
    whole = Symmetric.of(csr_array(stiffness(mesh, STEEL, "hex8i")))
    tracemalloc.start()
    found = condense(submatrix_of(whole, free), kept, solver="pardiso", keep_factor=False)
    found.compliance()
    gc.collect()
    stays, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    cost = CostModel(load_scene("hertz", {"solver.name": "pardiso"}))
    cost.condensed("box", {"hexes": len(mesh.hexes), "nodes": mesh.n_node}, len(kept))
    assert cost.left[0] == pytest.approx(stays, rel=0.2)
    assert cost.left[0] < 0.5 * cost.jobs[0]


def test_multigrid_stays_with_a_condensed_body():
    cost = CostModel(load_scene("hertz", {"solver.name": "amg"}))
    for body in ("upper", "lower"):
        cost.condensed(body, {"hexes": 1000, "nodes": 1331}, 100)
    assert cost.in_a_row(keep=False) == cost.in_a_row(keep=True)


def test_a_rig_takes_fewer_workers_before_it_is_refused(monkeypatch):
    monkeypatch.setattr(select, "threads", lambda: 4)
    plan = make_plan(load_scene("rig"))
    assert plan.workers == 4
    monkeypatch.setattr(select, "memory_left", lambda: 0.6 * plan.memory_bytes)
    fewer = make_plan(load_scene("rig"))
    # as many as fit
    assert 1 < fewer.workers < 4
    fewer.refuse_oversize()
