"""Elements keep their rank, their invariances and their honesty about bad input."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from upd.errors import InputError, MeshError
from upd.fem import ELEMENTS, Material, box_mesh, mass, stiffness
from upd.fem.elements import VTK_NODES
from upd.mesh import Mesh

STEEL = Material(200e3, 0.3)
#: those that may stand alone
FULL = tuple(name for name in ELEMENTS if name != "hex20r")


def nodes_per_hex(element: str) -> int:
    return int(element[3:].rstrip("i"))


def one_hex(n_node: int, size: float) -> Mesh:
    """One hexahedron whose nodes are moved at random by up to `size`."""
    shift = np.random.default_rng(5).uniform(-size, size, (n_node, 3))
    return Mesh(VTK_NODES[:n_node] + shift, np.arange(n_node)[None])


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.499])
@pytest.mark.parametrize("size", [0.0, 0.1])
@pytest.mark.parametrize("element", FULL)
def test_one_hexahedron_has_six_modes_without_energy_and_no_more(
    element: str, size: float, nu: float
) -> None:
    mesh = one_hex(nodes_per_hex(element), size)
    values = np.linalg.eigvalsh(stiffness(mesh, Material(1.0, nu), element).toarray())
    assert np.abs(values[:6]).max() < 1e-13 * values[-1]
    # The softest mode that strains is far above rounding: no hourglass.
    assert values[6] > 1e-3


def test_reduced_integration_has_six_modes_without_energy_in_neighbours_of_two_directions() -> None:
    mesh = box_mesh([0, 1, 2.2, 3], [0, 1, 1.8], [0, 0.7], 20)
    points = mesh.points + np.random.default_rng(5).uniform(-0.05, 0.05, mesh.points.shape)
    K = stiffness(mesh.with_points(points), Material(1.0, 0.3), "hex20r").toarray()
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() < 1e-13 * values[-1] and values[6] > 1e-5
    # softer than full integration in every motion, with the same mass
    difference = stiffness(mesh, STEEL, "hex20") - stiffness(mesh, STEEL, "hex20r")
    harder = np.linalg.eigvalsh(difference.toarray())
    assert harder[0] > -1e-13 * harder[-1]
    assert abs(mass(mesh, STEEL, "hex20r") - mass(mesh, STEEL, "hex20")).max() == 0.0


def test_reduced_integration_refuses_a_row_of_single_hexahedra() -> None:
    with pytest.raises(MeshError, match=r"^3 hexahedra have neighbours in one direction"):
        stiffness(box_mesh([0, 1, 2, 3], [0, 1], [0, 1], 20), STEEL, "hex20r")
    # one that sticks out of a block
    block = box_mesh([0, 1, 2, 3], [0, 1, 2], [0, 1], 20)
    tip = block.points[block.hexes[:, :8]].min(axis=1)
    used, hexes = np.unique(block.hexes[(tip[:, 0] < 2) | (tip[:, 1] < 1)], return_inverse=True)
    tee = Mesh(block.points[used], hexes.reshape(-1, 20))
    with pytest.raises(MeshError, match=r"^1 hexahedra have neighbours in one direction"):
        stiffness(tee, STEEL, "hex20r")


@pytest.mark.parametrize("element", FULL)
def test_mass_is_positive_definite(element: str) -> None:
    values = np.linalg.eigvalsh(
        mass(one_hex(nodes_per_hex(element), 0.1), STEEL, element).toarray()
    )
    assert values[0] > 1e-6 * values[-1]


def test_incompatible_modes_only_soften() -> None:
    mesh = one_hex(8, 0.1)
    difference = stiffness(mesh, STEEL, "hex8") - stiffness(mesh, STEEL, "hex8i")
    values = np.linalg.eigvalsh(difference.toarray())
    assert values[0] > -1e-12 * values[-1]


@pytest.mark.parametrize("element", FULL)
def test_rotation_and_translation_of_the_body_rotate_K(element: str) -> None:
    mesh = one_hex(nodes_per_hex(element), 0.1)
    R = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix()
    turned = mesh.with_points(mesh.points @ R.T + [3.0, -2.0, 1.0])
    Q = np.kron(np.eye(mesh.n_node), R)
    K = stiffness(mesh, STEEL, element).toarray()
    difference = stiffness(turned, STEEL, element).toarray() - Q @ K @ Q.T
    assert np.abs(difference).max() < 1e-13 * np.abs(K).max()


@pytest.mark.parametrize("element", FULL)
def test_the_unit_of_length_only_scales_K_and_M(element: str) -> None:
    """K grows with s and M with s^3 when lengths grow by s and E, rho stay; mm to m is s = 1e-3."""
    mesh, s = one_hex(nodes_per_hex(element), 0.1), 1e-3
    scaled = mesh.with_points(s * mesh.points)
    for make, power in ((stiffness, 1), (mass, 3)):
        A = make(mesh, STEEL, element).toarray()
        assert (
            np.abs(make(scaled, STEEL, element).toarray() - s**power * A).max()
            < 1e-13 * s**power * np.abs(A).max()
        )


@pytest.mark.parametrize("element", FULL)
def test_inverted_hexahedra_are_counted_and_the_worst_is_named(element: str) -> None:
    mesh = box_mesh(np.arange(4.0), [0, 1], [0, 1], nodes_per_hex(element))
    hexes = mesh.hexes.copy()
    # Top and bottom ring exchanged: a mirror image, all determinants negative.
    mirror = np.array(
        [
            np.flatnonzero((p * [1, 1, -1] + [0, 0, 1] == VTK_NODES).all(axis=1))[0]
            for p in VTK_NODES[: hexes.shape[1]]
        ]
    )
    hexes[1] = hexes[1][mirror]
    bad = Mesh(mesh.points, hexes)
    for make in (stiffness, mass):
        with pytest.raises(
            MeshError,
            match=r"1 of 3 hexahedra are inverted .*worst: hexahedron 1, scaled Jacobian "
            r"-1,.*VTK order",
        ):
            make(bad, STEEL, element)


def test_a_collapsed_hexahedron_is_refused() -> None:
    mesh = box_mesh([0, 1, 2], [0, 1], [0, 1])
    with pytest.raises(MeshError, match="2 of 2 hexahedra are inverted or collapsed"):
        stiffness(mesh.with_points(mesh.points * [1, 1, 0]), STEEL)


def test_thin_hexahedra_are_not_mistaken_for_collapsed_ones() -> None:
    mesh = box_mesh([0, 1, 2], [0, 1e-6], [0, 1e6])
    assert np.isfinite(stiffness(mesh, STEEL).data).all()


def test_wrong_arguments_are_refused_with_the_remedy() -> None:
    mesh = box_mesh([0, 1, 2], [0, 1], [0, 1])
    for kwargs, words in (
        ({"element": "tet10"}, "use one of hex8, hex8i, hex20, hex20r, hex27"),
        ({"element": "hex20"}, "needs 20 nodes per hexahedron, the mesh has 8: use hex8 or hex8i"),
        ({"material": (STEEL, STEEL)}, "2 materials are given without regions"),
        ({"regions": np.array([0, 1])}, "first: number 1 at hexahedron 1, 1 materials given"),
        ({"regions": np.zeros(3, int)}, "give 2 integers"),
        ({"regions": np.zeros(2)}, "type float64"),
    ):
        with pytest.raises(InputError, match=words):
            stiffness(mesh, **({"material": STEEL} | kwargs))  # type: ignore[arg-type]


def test_node_numbers_that_do_not_fit_are_refused() -> None:
    mesh = box_mesh([0, 1, 2], [0, 1], [0, 1])
    with pytest.raises(
        MeshError, match=r"1 of 13 nodes belong to no hexahedron \(first: node 12\)"
    ):
        stiffness(mesh.with_points(np.vstack([mesh.points, [9.0, 9.0, 9.0]])), STEEL)
    with pytest.raises(MeshError, match="name nodes 0 to 11, the mesh has nodes 0 to 10"):
        stiffness(mesh.with_points(mesh.points[:-1]), STEEL)
    with pytest.raises(MeshError, match="no hexahedra"):
        mass(Mesh(mesh.points, mesh.hexes[:0]), STEEL)


def test_material_lists_every_fault() -> None:
    with pytest.raises(InputError, match=r"E = -1.*nu = 0\.5.*rho = nan"):
        Material(-1.0, 0.5, float("nan"))


def test_material_moduli() -> None:
    assert STEEL.mu == STEEL.G == pytest.approx(200e3 / 2.6)
    # Bulk modulus lam + 2/3 mu = E / (3 (1 - 2 nu))
    assert STEEL.lam + 2 / 3 * STEEL.mu == pytest.approx(200e3 / (3 * 0.4))
    assert Material(1.0, 0.0).lam == 0.0


def test_box_mesh_refuses_what_it_cannot_mesh() -> None:
    with pytest.raises(InputError, match="8, 20 or 27"):
        box_mesh([0, 1], [0, 1], [0, 1], 10)
    with pytest.raises(InputError, match="increasing"):
        box_mesh([0, 1], [0, 1, 1], [0, 1])
