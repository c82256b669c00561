"""The batched matrices equal those of scikit-fem's own forms, entry by entry."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from skfem import BilinearForm, CellBasis, ElementHex1, ElementHex2, ElementHexS2, ElementVector
from skfem.helpers import dot
from skfem.io.meshio import from_meshio
from skfem.models.elasticity import linear_elasticity

from upd.fem import Material, box_mesh, mass, stiffness
from upd.fem.elements import VTK_NODES, gauss
from upd.mesh import Mesh

STEEL, RUBBER = Material(200e3, 0.3), Material(5.0, 0.48, 1.1e-9)
CASES = {"hex8": (8, ElementHex1, 2), "hex20": (20, ElementHexS2, 3), "hex27": (27, ElementHex2, 3)}


def distorted(n_node: int, seed: int = 1) -> Mesh:
    """A 2 x 2 x 3 box whose nodes, mid-nodes included, are moved at random.

    Edges and faces are curved.
    """
    mesh = box_mesh([0, 1, 2.5], [0, 0.8, 2], [0, 1, 1.7, 3], n_node)
    shift = np.random.default_rng(seed).uniform(-0.06, 0.06, mesh.points.shape)
    return mesh.with_points(mesh.points + shift)


def stock_basis(mesh: Mesh, element: str) -> tuple[CellBasis, np.ndarray]:
    """scikit-fem's own basis, through its own VTK reader, and our dof number of each of its dofs,
    found by position.
    """
    n_node, family, n_gauss = CASES[element]
    points, hexes = mesh.points, mesh.hexes
    if n_node == 20:  # complete to 27 nodes by serendipity interpolation
        reference, serendipity = VTK_NODES[:20], ElementHexS2()
        local = cKDTree(np.asarray(ElementHexS2.doflocs)).query(reference)[1]
        phi = np.stack([serendipity.lbasis(VTK_NODES[20:].T, a)[0] * np.ones(7) for a in local])
        extra = np.einsum("eai,ak->eki", points[hexes], phi)
        hexes = np.hstack([hexes, len(points) + np.arange(7 * len(hexes)).reshape(-1, 7)])
        points = np.vstack([points, extra.reshape(-1, 3)])
        tree = cKDTree(points)
        first = np.array([min(near) for near in tree.query_ball_point(points, 1e-9)])
        used, hexes = np.unique(first[hexes], return_inverse=True)
        points, hexes = points[used], hexes.reshape(-1, 27)
    stock = from_meshio(
        meshio.Mesh(points, {"hexahedron" if n_node == 8 else "hexahedron27": hexes})
    )
    basis = CellBasis(stock, ElementVector(family()), quadrature=gauss(n_gauss, 3))
    distance, node = cKDTree(mesh.points).query(basis.doflocs.T)
    assert distance.max() < 1e-12
    component = np.empty(basis.N, dtype=int)
    for k, dofs in enumerate(basis.element_dofs):
        component[dofs] = k % 3
    return basis, 3 * node + component


def renumbered(A: csr_array, dof: np.ndarray) -> np.ndarray:
    out = np.empty(A.shape)
    out[np.ix_(dof, dof)] = A.toarray()
    return out


@pytest.mark.parametrize("element", CASES)
def test_stiffness_and_mass_equal_the_stock_forms_with_two_materials(element: str) -> None:
    mesh = distorted(CASES[element][0])
    regions = (mesh.points[mesh.hexes].mean(axis=1)[:, 2] > 1.5).astype(int)
    assert set(regions) == {0, 1}
    basis, dof = stock_basis(mesh, element)
    assert sorted(dof) == list(range(3 * mesh.n_node))
    K, M = np.zeros(2 * (3 * mesh.n_node,)), np.zeros(2 * (3 * mesh.n_node,))
    inner = BilinearForm(lambda u, v, w: dot(u, v))
    for k, material in enumerate((STEEL, RUBBER)):
        part = basis.with_elements(np.flatnonzero(regions == k))
        K += renumbered(linear_elasticity(material.lam, material.mu).assemble(part), dof)
        M += renumbered(material.rho * inner.assemble(part), dof)
    ours = (
        stiffness(mesh, (STEEL, RUBBER), element, regions).toarray(),
        mass(mesh, (STEEL, RUBBER), element, regions).toarray(),
    )
    assert np.abs(ours[0] - K).max() <= 1e-12 * np.abs(K).max()
    assert np.abs(ours[1] - M).max() <= 1e-12 * np.abs(M).max()


@pytest.mark.parametrize("element", [*CASES, "hex8i"])
def test_matrices_are_canonical_and_exactly_symmetric(element: str) -> None:
    mesh = distorted(int(element[3:].rstrip("i")))
    for A in (stiffness(mesh, STEEL, element), mass(mesh, STEEL, element)):
        assert isinstance(A, csr_array)
        assert A.has_canonical_format
        assert abs(A - A.T).max() == 0.0


def test_the_answer_does_not_depend_on_the_block_size(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = distorted(8)
    whole = stiffness(mesh, STEEL, "hex8i"), mass(mesh, STEEL)
    monkeypatch.setattr("upd.fem.assembly._BLOCK_BYTES", 1)
    for A, B in zip((stiffness(mesh, STEEL, "hex8i"), mass(mesh, STEEL)), whole, strict=True):
        assert abs(A - B).max() <= 1e-14 * abs(B).max()


@pytest.mark.parametrize("element", CASES)
def test_mass_sums_to_density_times_volume(element: str) -> None:
    mesh = box_mesh(np.linspace(0, 2, 4), [0, 1, 3], [0, 4], CASES[element][0])
    sheared = mesh.with_points(mesh.points @ np.array([[1, 0.2, 0.1], [0, 1, 0.3], [0, 0, 1]]))
    M = mass(sheared, STEEL)
    volume = 2.0 * 3.0 * 4.0
    for axis in range(3):
        u = np.zeros(M.shape[0])
        u[axis::3] = 1.0
        assert u @ M @ u == pytest.approx(STEEL.rho * volume, rel=1e-13)
    assert M.sum() == pytest.approx(3 * STEEL.rho * volume, rel=1e-13)
