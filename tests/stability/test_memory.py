"""Memory beside the factors, and runs that do not fit."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from upd.analyses import make_plan
from upd.analyses.base import refuse_oversize
from upd.errors import InputError
from upd.fem import Material, box_mesh, mass, stiffness
from upd.linalg import factorise, modes, select
from upd.linalg.common import checked_matrix, submatrix
from upd.linalg.select import has_pardiso
from upd.reduction import condense
from upd.scene import load_scene

STEEL = Material(200e3, 0.3, 7.8e-9)
READY = ("hertz", "symmetric", "asymmetric", "rig", "symmetric-response", "asymmetric-response")


def nbytes(A):
    return A.data.nbytes + A.indices.nbytes + A.indptr.nbytes


@pytest.fixture(scope="module")
def block():
    """K, K and M without clamped dofs, free dofs, dofs of a patch."""
    mesh = box_mesh(*(np.linspace(0.0, 10.0, 17),) * 3)
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
    refuse_oversize(make_plan(load_scene(name)))


@pytest.mark.parametrize("parts", [0.5, 0.9])
def test_what_does_not_fit_is_refused(monkeypatch, parts):
    plan = make_plan(load_scene("hertz"))
    monkeypatch.setattr(select, "memory_left", lambda: parts * plan.memory_bytes)
    with pytest.raises(InputError, match="use a coarser mesh"):
        refuse_oversize(plan)
    refuse_oversize(replace(plan, memory_bytes=0.99 * parts * plan.memory_bytes))


def test_a_rig_takes_fewer_workers_before_it_is_refused(monkeypatch):
    monkeypatch.setattr(select, "threads", lambda: 4)
    plan = make_plan(load_scene("rig"))
    assert plan.workers == 4
    monkeypatch.setattr(select, "memory_left", lambda: 0.6 * plan.memory_bytes)
    fewer = make_plan(load_scene("rig"))
    assert 1 <= fewer.workers < 4
    refuse_oversize(fewer)
