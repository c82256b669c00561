"""A body held in the weighted mean of a surface: uniform stress, dense algebra, balance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from upd.errors import InputError
from upd.fem import Material, box_mesh, rigid_body_modes, stiffness, traction_weights
from upd.linalg.select import has_pardiso
from upd.mesh import FloatArray, IntArray, Mesh
from upd.reduction import condense_held_in_mean
from upd.reduction.mean_held import motions_left

STEEL = Material(200e3, 0.3)
SOLVERS = [
    pytest.param(
        "pardiso", marks=pytest.mark.skipif(not has_pardiso(), reason="MKL is not installed")
    ),
    "superlu",
    "amg",
]
#: relative, of a few hundred dofs on a support of three points
ROUNDING = 1e-10


def bar(n_node: int = 8) -> tuple[Mesh, FloatArray]:
    """A bar of 3 x 2 x 5 mm along z, uneven elements, and the weights of its lower end."""
    mesh = box_mesh([0, 0.7, 2, 3], [0, 1.3, 2], [0, 1, 2.5, 3.1, 5], n_node)
    return mesh, traction_weights(mesh.points, mesh.faces["z0"])


def z_of(nodes: IntArray) -> IntArray:
    return 3 * np.asarray(nodes) + 2


@pytest.mark.parametrize(("element", "n_node"), [("hex8i", 8), ("hex20", 20), ("hex27", 27)])
def test_a_bar_held_in_the_mean_of_its_end_is_in_uniform_tension(element: str, n_node: int) -> None:
    """F L / (E A): no support keeps the end from contracting, as holding its nodes would."""
    mesh, weights = bar(n_node)
    K = stiffness(mesh, STEEL, element)
    top, area = mesh.nodes["z1"], 6.0
    pull = traction_weights(mesh.points, mesh.faces["z1"])[top]
    found = condense_held_in_mean(
        K, z_of(top), np.repeat(weights, 3), rigid_body_modes(mesh.points), solver="superlu"
    )
    u = found.compliance() @ (pull * 600.0 / area)
    exact = 600.0 * 5.0 / (STEEL.E * area)
    assert u == pytest.approx(np.full(len(top), exact), rel=ROUNDING)
    whole = found.recover(u).reshape(-1, 3)
    assert whole[:, 2] == pytest.approx(exact / 5.0 * mesh.points[:, 2], abs=ROUNDING * exact)
    assert whole[:, 0] == pytest.approx(
        -STEEL.nu * exact / 5.0 * (mesh.points[:, 0] - 1.5), abs=ROUNDING * exact
    )


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("mirror", [False, True], ids=["whole", "mirrored"])
def test_it_solves_the_system_with_multipliers(solver: str, mirror: bool) -> None:
    """[K W; W' 0] (u, a) = (f, 0), dense; with a mirror plane only the motions it leaves."""
    mesh, weights = bar()
    cut = 3 * mesh.nodes["x0"] if mirror else np.zeros(0, np.int64)
    free = np.setdiff1d(np.arange(3 * mesh.n_node), cut)
    K = csr_array(stiffness(mesh, STEEL, "hex8i"))[free][:, free]
    R = motions_left(rigid_body_modes(mesh.points), cut)[free]
    assert R.shape[1] == (3 if mirror else 6)
    w = np.repeat(weights, 3)[free]
    kept = np.searchsorted(free, z_of(mesh.nodes["z1"]))
    found = condense_held_in_mean(K, kept, w, R, solver=solver, layout=free)
    W = w[:, None] * R
    m, n = R.shape[1], len(free)
    f = np.zeros((n + m, len(kept)))
    f[kept, np.arange(len(kept))] = 1.0
    u = np.linalg.solve(np.block([[K.toarray(), W], [W.T, np.zeros((m, m))]]), f)[:n]
    size = np.abs(u).max()
    # conjugate gradients stop at a residual of 1e-10
    tolerance = 1e-7 if solver == "amg" else ROUNDING
    np.testing.assert_allclose(found.compliance(), u[kept], atol=tolerance * size)
    np.testing.assert_allclose(found.recover(u[kept]), u, atol=tolerance * size)
    assert np.array_equal(found.compliance(), found.compliance().T)
    # the reaction is a linear traction over the set, which balances force and moments
    reaction, on = K @ found.recover(found.compliance()) - f[:n], w != 0.0
    size = np.abs(reaction).max()
    assert np.abs(reaction[~on]).max() < tolerance * size
    a = np.linalg.lstsq(W, reaction, rcond=None)[0]
    np.testing.assert_allclose(W @ a, reaction, atol=tolerance * size)
    np.testing.assert_allclose(R[on].T @ reaction[on], -(R.T @ f[:n]), atol=tolerance * size)


def test_weights_that_do_not_hold_are_refused() -> None:
    """Nodes on one line, about which the body turns without a mean."""
    mesh, weights = bar()
    line = (mesh.points[:, 0] == 0.0) & (mesh.points[:, 2] == 0.0)
    K, dofs, R = (
        stiffness(mesh, STEEL, "hex8i"),
        z_of(mesh.nodes["z1"]),
        rigid_body_modes(mesh.points),
    )
    w = np.repeat(np.where(line, weights, 0.0), 3)
    with pytest.raises(InputError, match=r"weights do not hold .* To fix it: give three nodes"):
        condense_held_in_mean(K, dofs, w, R, solver="superlu")
    with pytest.raises(InputError, match="weights have the shape"):
        condense_held_in_mean(K, dofs, np.repeat(weights, 3)[:, None], R, solver="superlu")
