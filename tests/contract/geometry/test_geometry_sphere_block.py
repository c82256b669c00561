"""What every half-sphere-on-block mesh promises.

Counts, pairing, symmetry, sets, node order, volume.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from geometry.sphere_block import SphereBlock, build, count
from upd.errors import InputError
from upd.mesh import FloatArray, Mesh
from upd.mesh.checks import scaled_jacobian

EPS = np.finfo(float).eps
SMALL = {"divisions": 6, "growth": 1.8}


@pytest.fixture(scope="module")
def made() -> dict[tuple[str, int], dict[str, Mesh]]:
    return {
        (symmetry, size): build(SphereBlock(symmetry=symmetry, element_nodes=size, **SMALL))  # type: ignore[arg-type]
        for symmetry in ("full", "half", "quarter")
        for size in (8, 20, 27)
    }


ALL = list(itertools.product(("full", "half", "quarter"), (8, 20, 27)))
#: edges and faces of a hexahedron by its corners: written out from the VTK file format, not from
#: the code under test
EDGES = [
    *((k, (k + 1) % 4) for k in range(4)),
    *((k + 4, (k + 1) % 4 + 4) for k in range(4)),
    *((k, k + 4) for k in range(4)),
]
FACES = [(0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)]


@pytest.mark.parametrize(
    "changes",
    [dict(zip(("symmetry", "element_nodes"), pair, strict=True)) | SMALL for pair in ALL]
    + [
        {},
        {"divisions": 2},
        {"symmetry": "quarter", "divisions": 80},
        {"symmetry": "quarter", "patch": 1e-3, "element_nodes": 20, "divisions": 8},
    ],
)
def test_count_equals_the_built_mesh(changes: dict[str, Any]) -> None:
    params = SphereBlock(**changes)
    predicted = count(params)
    for name, mesh in build(params).items():
        assert predicted[name] == {
            "nodes": mesh.n_node,
            "hexes": mesh.n_hex,
            "contact": len(mesh.nodes["contact"]),
        }
        assert np.array_equal(np.unique(mesh.hexes), np.arange(mesh.n_node)), (
            "every node belongs to an element"
        )


def test_default_model_is_of_the_planned_size() -> None:
    size = count(SphereBlock())
    assert size["block"]["contact"] == size["sphere"]["contact"] == 41**2
    assert 7e4 < sum(body["hexes"] for body in size.values()) < 1.1e5


@pytest.mark.parametrize("key", ALL)
def test_contact_nodes_are_one_lattice_in_one_order(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    symmetry, size = key
    params = SphereBlock(**SMALL)  # type: ignore[arg-type]
    sphere, block = (made[key][name] for name in ("sphere", "block"))
    upper, lower = sphere.points[sphere.nodes["contact"]], block.points[block.nodes["contact"]]
    assert np.array_equal(upper[:, :2], lower[:, :2])
    step = params.size / (1 if size == 8 else 2)
    index = lower[:, :2] / step
    assert np.abs(index - np.round(index)).max() < 8 * EPS * params.divisions
    ij = np.round(index).astype(int)
    assert np.array_equal(np.lexsort((ij[:, 1], ij[:, 0])), np.arange(len(ij))), (
        "x slowest, y fastest"
    )
    assert len(np.unique(ij, axis=0)) == len(ij)
    n = params.divisions // 2 * (1 if size == 8 else 2)
    low = {"full": (-n, -n), "half": (-n, 0), "quarter": (0, 0)}[symmetry]
    assert tuple(ij.min(axis=0)) == low
    assert tuple(ij.max(axis=0)) == (n, n)
    # on z = 0 and on the sphere
    assert np.array_equal(lower[:, 2], np.zeros(len(lower)))
    r2 = np.sum(upper[:, :2] ** 2, axis=1)
    assert upper[:, 2] == pytest.approx(
        r2 / (params.radius + np.sqrt(params.radius**2 - r2)), rel=4 * EPS, abs=0.0
    )


@pytest.mark.parametrize("key", ALL)
def test_sets_lie_where_their_names_say(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    params = SphereBlock(**SMALL)  # type: ignore[arg-type]
    for name, mesh in made[key].items():
        far = params.radius if name == "sphere" else -params.block
        P = mesh.points
        assert np.array_equal(np.sort(mesh.nodes["distant"]), np.flatnonzero(P[:, 2] == far))
        assert np.array_equal(np.unique(mesh.faces["distant"]), np.sort(mesh.nodes["distant"]))
        assert np.array_equal(np.unique(mesh.faces["contact"]), np.sort(mesh.nodes["contact"]))
        axis = mesh.nodes["axis"]
        assert np.array_equal(np.sort(axis), np.flatnonzero((P[:, 0] == 0.0) & (P[:, 1] == 0.0)))
        assert np.all(np.diff(np.abs(P[axis, 2])) > 0.0)
        assert P[axis[0], 2] == 0.0
        assert P[axis[-1], 2] == far
        planes = {"full": (), "half": ("plane_y",), "quarter": ("plane_x", "plane_y")}[key[0]]
        assert {s for s in mesh.nodes if s.startswith("plane")} == set(planes)
        for plane in planes:
            component = "xy".index(plane[-1])
            assert np.array_equal(
                np.sort(mesh.nodes[plane]), np.flatnonzero(P[:, component] == 0.0)
            )
            assert P[:, component].min() == 0.0


@pytest.mark.parametrize("size", [8, 20, 27])
def test_full_model_is_symmetric_and_contains_the_others(
    made: dict[tuple[str, int], dict[str, Mesh]], size: int
) -> None:
    for name in ("sphere", "block"):
        full, half, quarter = (
            made[symmetry, size][name] for symmetry in ("full", "half", "quarter")
        )
        rows = {tuple(p) for p in full.points}
        assert len(rows) == full.n_node, "no node twice"
        for sign in ((-1, 1, 1), (1, -1, 1)):
            assert {tuple(p) for p in full.points * np.array(sign) + 0.0} == rows
        assert {p for p in rows if p[1] >= 0.0} == {tuple(p) for p in half.points}
        assert {p for p in rows if p[1] >= 0.0 and p[0] >= 0.0} == {
            tuple(p) for p in quarter.points
        }
        # and the elements, as sets of places
        whole = {frozenset(map(tuple, full.points[h])) for h in full.hexes}
        part = {frozenset(map(tuple, quarter.points[h])) for h in quarter.hexes}
        assert part <= whole
        assert len(whole) == 4 * len(part) == full.n_hex


@pytest.mark.parametrize("key", [k for k in ALL if k[0] != "half"])
def test_quarter_is_alike_along_x_and_y(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    for mesh in made[key].values():
        swapped = mesh.points[:, [1, 0, 2]]
        order, image = (np.lexsort(np.round(p, 7).T) for p in (mesh.points, swapped))
        # gmsh integrates the grading of arcs numerically (Mesh.LcIntegrationPrecision)
        assert np.abs(mesh.points[order] - swapped[image]).max() < 1e-9


@pytest.mark.parametrize("key", [k for k in ALL if k[1] != 8])
def test_middle_nodes_lie_in_the_middle_in_vtk_order(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    groups = [*EDGES, *FACES, tuple(range(8))][: key[1] - 8]
    block = made[key]["block"]
    P = block.points[block.hexes]
    for local, group in enumerate(groups, start=8):
        # every edge of the block is straight
        assert np.abs(P[:, local] - P[:, list(group)].mean(axis=1)).max() < 16 * EPS * 10.0
    # the sphere: no middle node is nearer to any other edge's, face's or element's mean
    sphere = made[key]["sphere"]
    P = sphere.points[sphere.hexes]
    means = np.stack([P[:, list(group)].mean(axis=1) for group in groups], axis=1)
    distance = np.linalg.norm(P[:, 8:, None, :] - means[:, None, :, :], axis=3)
    assert np.array_equal(
        distance.argmin(axis=2), np.broadcast_to(np.arange(len(groups)), distance.shape[:2])
    )


@pytest.mark.parametrize("size", [20, 27])
def test_second_order_sphere_is_curved(
    made: dict[tuple[str, int], dict[str, Mesh]], size: int
) -> None:
    mesh = made["full", size]["sphere"]
    skin = outer_nodes(mesh)
    on_flat = mesh.points[skin, 2] == 5.0
    distance = np.linalg.norm(mesh.points[skin[~on_flat]] - [0.0, 0.0, 5.0], axis=1)
    assert np.abs(distance - 5.0).max() < 8 * EPS * 5.0


def outer_nodes(mesh: Mesh) -> Any:
    """Nodes of faces that one element only owns, found without the code under test."""
    rings = np.array(FACES)
    on_face = [
        [*ring, *(8 + k for k, e in enumerate(EDGES) if set(e) <= set(ring.tolist()))]
        for ring in rings
    ]
    if mesh.hexes.shape[1] == 27:
        on_face = [[*nodes, 20 + f] for f, nodes in enumerate(on_face)]
    _, where, times = np.unique(
        np.sort(mesh.hexes[:, rings], axis=2).reshape(-1, 4),
        axis=0,
        return_index=True,
        return_counts=True,
    )
    return np.unique(
        mesh.hexes[:, np.array(on_face)].reshape(-1, len(on_face[0]))[where[times == 1]]
    )


def shape_gradients(size: int, at: FloatArray) -> FloatArray:
    """Gradients of the shape functions of 8-, 20-, 27-node hexahedra at local points (q, 3), from
    their monomials: (q, size, 3).
    """
    from geometry.blocks.hexahedron import REFERENCE

    powers = np.array(
        [
            e
            for e in itertools.product(range(3), repeat=3)
            if size == 27 or e.count(2) <= (size == 20)
        ]
    )

    def monomials(x: FloatArray, derivative: int | None = None) -> FloatArray:
        factor, exponent = np.ones(len(powers)), powers
        if derivative is not None:
            factor = powers[:, derivative].astype(float)
            exponent = np.maximum(powers - np.eye(3, dtype=int)[derivative], 0)
        values: FloatArray = factor * np.prod(x[:, None, :] ** exponent[None], axis=2)
        return values

    inverse = np.linalg.inv(monomials(REFERENCE[:size].astype(float)))
    return np.stack([monomials(at, d) @ inverse for d in range(3)], axis=2)


def jacobians(mesh: Mesh, at: FloatArray) -> FloatArray:
    gradients = shape_gradients(mesh.hexes.shape[1], at)
    determinants: FloatArray = np.linalg.det(
        np.einsum("eai,qaj->eqij", mesh.points[mesh.hexes], gradients)
    )
    return determinants


def volume(mesh: Mesh) -> float:
    x, w = np.polynomial.legendre.leggauss(4)
    at = np.array(list(itertools.product(x, repeat=3)))
    weight = np.array([np.prod(c) for c in itertools.product(w, repeat=3)])
    return float(np.sum(jacobians(mesh, at) * weight))


@pytest.mark.parametrize("key", ALL)
def test_volume_of_the_block_and_positive_jacobians(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    share = {"full": 1.0, "half": 0.5, "quarter": 0.25}[key[0]]
    assert volume(made[key]["block"]) == pytest.approx(1000.0 * share, rel=1e-12)
    nodes_and_more = np.array(list(itertools.product(np.linspace(-1.0, 1.0, 5), repeat=3)))
    for mesh in made[key].values():
        assert jacobians(mesh, nodes_and_more).min() > 0.0


def longest_arc(sphere: Mesh) -> float:
    """Longest element along the meridian y = 0, mm."""
    P = sphere.points[sphere.nodes["plane_y"]] - [0.0, 0.0, 5.0]
    on_sphere = P[np.abs(np.linalg.norm(P, axis=1) - 5.0) < 1e-9]
    return float(5.0 * np.diff(np.sort(np.arctan2(on_sphere[:, 0], -on_sphere[:, 2]))).max())


@pytest.mark.parametrize(("size", "order"), [(8, 2), (20, 4), (27, 4)])
def test_volume_of_the_sphere_converges(size: int, order: int) -> None:
    """Chords leave out O(h^2) of the volume, parabolas O(h^4), with h the longest element along the
    meridian.
    """
    exact = 2.0 / 3.0 * np.pi * 125.0
    errors, lengths = [], []
    for divisions, growth in ((4, 2.0), (8, 2.0**0.5), (16, 2.0**0.25)):
        mesh = build(
            SphereBlock(
                divisions=divisions,
                growth=growth,
                patch=4.0,
                symmetry="quarter",
                element_nodes=size,
            )
        )["sphere"]
        errors.append(abs(4.0 * volume(mesh) / exact - 1.0))
        lengths.append(longest_arc(mesh))
    rate = np.polyfit(np.log(lengths), np.log(errors), 1)[0]
    assert errors[0] < 0.1
    assert rate > order - 0.3, (errors, lengths)


@pytest.mark.parametrize("key", ALL)
def test_faces_look_outwards_and_close(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    for name, mesh in made[key].items():
        for face, sign in (("contact", -1.0), ("distant", 1.0)):
            quads = mesh.faces[face]
            assert quads.shape[1] == {8: 4, 20: 8, 27: 9}[key[1]]
            a, b, c, d = (mesh.points[quads[:, k]] for k in range(4))
            normal = np.cross(c - a, d - b)[:, 2] * (1.0 if name == "sphere" else -1.0)
            assert np.all(sign * normal > 0.0)
            if key[1] > 8:  # middle nodes follow the ring
                for k, (p, q) in enumerate(((a, b), (b, c), (c, d), (d, a))):
                    middle = mesh.points[quads[:, 4 + k]]
                    assert np.all(
                        np.linalg.norm(middle - (p + q) / 2.0, axis=1)
                        < 0.25 * np.linalg.norm(p - q, axis=1)
                    )
        a, b, c, d = (mesh.points[mesh.faces["contact"][:, k], :2] for k in range(4))
        projected = (
            0.5
            * np.abs(
                np.cross(np.pad(c - a, ((0, 0), (0, 1))), np.pad(d - b, ((0, 0), (0, 1))))[:, 2]
            ).sum()
        )
        assert projected == pytest.approx(
            {"full": 1.0, "half": 0.5, "quarter": 0.25}[key[0]], rel=1e-12
        )


def test_all_faults_come_at_once() -> None:
    with pytest.raises(InputError) as caught:
        SphereBlock(
            radius=-1.0,
            block=0.0,
            patch=float("nan"),
            divisions=7,
            element_nodes=9,
            symmetry="third",
        )  # type: ignore[arg-type]
    lines = str(caught.value).splitlines()
    assert [line.split(":")[0] for line in lines] == [
        "radius",
        "block",
        "patch",
        "divisions",
        "element_nodes",
        "symmetry",
    ]


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"patch": 5.0}, "too large for the sphere"),
        ({"patch": 3.0, "block": 3.0}, "too large for the block"),
        ({"growth": 1.0}, "growth"),
        ({"growth": 3.0}, "growth"),
        ({"core_depth": 9.0}, "reach through"),
        ({"patch": 4.0, "core_depth": 0.1}, "too shallow"),
        ({"divisions": 0}, "even number"),
        ({"divisions": 40.0}, "whole number"),
        ({"divisions": True}, "whole number"),
        ({"element_nodes": 20.0}, "whole number"),
        ({"radius": "5"}, "positive number"),
    ],
)
def test_misfits_are_refused_with_the_remedy(changes: dict[str, Any], word: str) -> None:
    with pytest.raises(InputError, match=word):
        SphereBlock(**changes)


def test_two_builds_are_the_same_to_the_bit() -> None:
    one, two = (build(SphereBlock(**SMALL)) for _ in range(2))  # type: ignore[arg-type]
    for name in one:
        assert np.array_equal(one[name].points, two[name].points)
        assert np.array_equal(one[name].hexes, two[name].hexes)


def test_default_quality() -> None:
    for mesh in build(SphereBlock(symmetry="quarter")).values():
        found = scaled_jacobian(mesh)
        assert found.min() > 0.2
        assert found.mean() > 0.8
