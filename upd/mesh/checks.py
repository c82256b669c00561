"""Is a mesh whole, are its hexahedra well shaped, does it name the sets an analysis needs, and do
the contact nodes of two bodies face each other one to one?
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from upd.errors import MeshError, OwnMeshError
from upd.mesh import FloatArray, IntArray, Mesh
from upd.mesh.hexmesh import EDGES, FACE_SIZE, MIDDLES, boundary_faces

#: set -> what it is for
PURPOSE = {
    "contact": "the surface that touches the other body",
    "distant": "the nodes that are held and loaded",
    "plane_x": "the mirror plane x = 0",
    "plane_y": "the mirror plane y = 0",
}
#: ending of a mesh file -> where its sets get their names
_NAMED_IN = {
    "inp": "name these nodes in the file, *NSET, NSET=BODY_SET (faces follow from the nodes)",
    "msh": "name these physical surfaces BODY_SET in gmsh and write the file again",
}
#: largest offset of two paired nodes along the contact, relative to the contact's extent: rounding
#: of coordinates, far below any element
OUT_OF_LINE = 1e-9
#: digits of coordinates that a file rounds; more are as good as all
_DIGITS = range(6, 10)
#: depth of a surface, relative to its extent, from which it is no face along one direction
_WRAPS = 0.1
# corner -> its neighbours along the three edges, right-handed (Verdict, hex scaled Jacobian)
_NEIGHBOURS = np.array(
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]]
)
# middle node between each corner and its three neighbours
_MIDDLES = np.array(
    [[MIDDLES[frozenset((k, other))] for other in r] for k, r in enumerate(_NEIGHBOURS.tolist())]
)
# opposite faces, for the axes through the centre
_FACES = (((1, 2, 6, 5), (0, 3, 7, 4)), ((2, 3, 7, 6), (1, 0, 4, 5)), ((4, 5, 6, 7), (0, 1, 2, 3)))


def check_mesh(name: str, mesh: Mesh) -> None:
    """Raise OwnMeshError, with all problems, unless arrays have their shapes, numbers are finite
    and every node is there.
    """
    problems = []
    if np.ndim(mesh.points) != 2 or np.shape(mesh.points)[1] != 3:
        problems.append(f"points have the shape {np.shape(mesh.points)}; give (n, 3), in mm")
    elif not (finite := np.isfinite(np.asarray(mesh.points, dtype=float)).all(axis=1)).all():
        problems.append(
            f"{np.sum(~finite)} of {len(finite)} points are not finite, node {finite.argmin()} "
            "first; to fix it: correct the recipe's coordinates"
        )
    n = len(mesh.points) if np.ndim(mesh.points) else 0
    problems += _number_problems("hexes", mesh.hexes, n, tuple(FACE_SIZE))
    face_size = FACE_SIZE.get(np.shape(mesh.hexes)[-1]) if np.ndim(mesh.hexes) == 2 else None
    for key, faces in mesh.faces.items():
        problems += _number_problems(
            f"faces {key!r}", faces, n, (face_size,) if face_size else tuple(FACE_SIZE.values())
        )
    for key, nodes in mesh.nodes.items():
        problems += _number_problems(f"node set {key!r}", nodes, n, None)
    for key, weights in mesh.weights.items():
        problems += _weight_problems(key, weights, mesh.nodes.get(key))
    problems = problems or _unmerged(mesh)
    if problems:
        raise OwnMeshError("\n".join(f"{name}: {problem}" for problem in problems))


def _unmerged(mesh: Mesh) -> list[str]:
    """Whether parts of the body lie at the same places without being joined."""
    points = mesh.points[np.unique(boundary_faces(mesh)[:, :4])]
    edges = np.diff(mesh.points[mesh.hexes[:, EDGES]], axis=2)
    apart = min(rounding(points), 1e-3 * float(np.linalg.norm(edges, axis=3).min()))
    pairs = cKDTree(points).query_pairs(apart, output_type="ndarray")
    if not len(pairs):
        return []
    x, y, z = points[pairs[0, 0]]
    return [
        f"{len(pairs)} pairs of nodes lie at one place each, the first at ({x:.6g}, {y:.6g}, "
        f"{z:.6g}) mm, so that its parts are not joined; to fix it: merge coincident nodes where "
        "the mesh is made"
    ]


def _number_problems(what: str, numbers: Any, n: int, widths: tuple[int, ...] | None) -> list[str]:
    """Faults of node numbers (m, width), or (m,) when ``widths`` is None."""
    array = np.asarray(numbers)
    fits = array.ndim == 1 if widths is None else array.ndim == 2 and array.shape[1] in widths
    if not fits:
        wanted = "(m,)" if widths is None else f"(m, {' or '.join(map(str, widths))})"
        return [f"{what} has the shape {array.shape}; give node numbers {wanted}"]
    if not np.issubdtype(array.dtype, np.integer) and array.size:
        return [f"{what} holds {array.dtype} values; give whole node numbers"]
    outside = array[(array < 0) | (array >= n)]
    return (
        [f"{what} names the node {outside[0]}; there are the nodes 0 to {n - 1}"]
        if outside.size
        else []
    )


def _weight_problems(key: str, weights: Any, nodes: Any) -> list[str]:
    """Faults of the weights of a node set."""
    if nodes is None:
        return [f"weights {key!r} belong to no node set; give the set of that name or leave it out"]
    array = np.asarray(weights)
    if array.shape != np.shape(nodes):
        return [
            f"weights {key!r} have the shape {array.shape}; give one per node of the set, "
            f"{np.shape(nodes)}"
        ]
    if not np.issubdtype(array.dtype, np.number) or np.iscomplexobj(array):
        return [f"weights {key!r} hold {array.dtype} values; give areas in mm2"]
    if not np.isfinite(array).all() or not array.sum() > 0.0:
        return [f"weights {key!r} sum to {array.sum():g} mm2; give finite ones of a positive sum"]
    return []


def require_sets(
    recipe: str, meshes: Mapping[str, Mesh], needed: Iterable[str], faces: Iterable[str] = ()
) -> None:
    """Raise OwnMeshError unless every body has the node sets ``needed`` and the ``faces``.

    The message lists what was found.
    """
    problems = []
    for name, mesh in meshes.items():
        for kind, wanted, found in (("node set", needed, mesh.nodes), ("faces", faces, mesh.faces)):
            for key in wanted:
                if not len(found.get(key, ())):
                    state = "empty" if key in found else "missing"
                    message = ", ".join(f"{k} ({len(v)})" for k, v in found.items()) or "none"
                    problems.append(
                        f"{name}: {kind} {key!r}, "
                        f"{PURPOSE.get(key, 'which the analysis needs')}, is {state}; "
                        f"found: {message}"
                    )
    if problems:
        remedy = _NAMED_IN.get(recipe.lower().rpartition(".")[2], "name these sets in build()")
        raise OwnMeshError(
            f"recipe {recipe!r}: {remedy}\n" + "\n".join(f"  {problem}" for problem in problems)
        )


# -- pairs -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pairs:
    """Two node sets that face each other.

    Attributes
    ----------
    bodies, sets
        Of the one and the other side.
    count
        Number of pairs.
    offset
        Largest distance of two paired nodes along the contact, mm.
    gap
        Largest distance across it, mm.
    """

    bodies: tuple[str, str]
    sets: tuple[str, str]
    count: int
    offset: float
    gap: float


def rounding(points: FloatArray) -> float:
    """How far two nodes at one place may lie apart: by the last digit of the coordinates.

    Six digits at least; 0 where they have more than nine.
    """
    size = np.abs(points[points != 0.0])
    power = np.floor(np.log10(size))
    for digits in _DIGITS:
        scaled = size / 10.0 ** (power - digits + 1)
        if size.size and np.allclose(scaled, np.rint(scaled), rtol=1e-12, atol=0.0):
            return float(np.sqrt(3.0) * 10.0 ** (power.max() - digits + 1))
    return 0.0


def check_pairs(meshes: Mapping[str, Mesh]) -> list[Pairs]:
    """The node sets of two bodies that face each other.

    Sets named contact... that both have, and the set patch of one with NAME_patch of another, where
    NAME is the one. Raises MeshError unless they are bijections whose k-th nodes lie on one normal.

    The normal is that of the flatter of the two sets; the gap along it may be anything.
    """
    return [
        _checked(meshes, bodies, sets)
        for bodies in combinations(meshes, 2)
        for sets in _facing(meshes, bodies)
    ]


def in_pairs(meshes: Mapping[str, Mesh]) -> dict[str, Mesh]:
    """The meshes with every facing node set of a second body in the order of the first's.

    Each node of the one goes to the nearest of the other along the contact; where that is no
    bijection the order stays, and `check_pairs` reports what is wrong.
    """
    out = dict(meshes)
    for bodies in combinations(meshes, 2):
        for keys in _facing(out, bodies):
            one, two = (out[b] for b in bodies)
            first, second = one.nodes[keys[0]], two.nodes[keys[1]]
            if not len(first) or len(first) != len(second):
                continue
            points = one.points[first], two.points[second]
            normal = _normal(*points)
            along = [p - np.outer(p @ normal, normal) for p in points]
            nearest = cKDTree(along[1]).query(along[0])[1]
            if len(np.unique(nearest)) == len(second):
                out[bodies[1]] = replace(two, nodes={**two.nodes, keys[1]: second[nearest]})
    return out


def _facing(meshes: Mapping[str, Mesh], bodies: tuple[str, str]) -> Iterator[tuple[str, str]]:
    one, two = (meshes[body].nodes for body in bodies)
    for key in sorted(set(one) & set(two)):
        if key.startswith("contact"):
            yield key, key
    if "patch" in one and f"{bodies[0]}_patch" in two:
        yield "patch", f"{bodies[0]}_patch"
    if "patch" in two and f"{bodies[1]}_patch" in one:
        yield f"{bodies[1]}_patch", "patch"


def _checked(meshes: Mapping[str, Mesh], bodies: tuple[str, str], keys: tuple[str, str]) -> Pairs:
    named = repr(keys[0]) if keys[0] == keys[1] else f"{keys[0]!r} and {keys[1]!r}"
    place = f"{bodies[0]} and {bodies[1]}, node set {named}"
    sets: list[IntArray] = [meshes[b].nodes[key] for b, key in zip(bodies, keys, strict=True)]
    if len(sets[0]) != len(sets[1]):
        raise MeshError(
            f"{place}: {len(sets[0])} nodes face {len(sets[1])}; mesh both surfaces with "
            "the same lattice"
        )
    for nodes in sets:
        if len(np.unique(nodes)) != len(nodes):
            raise MeshError(
                f"{place}: a node stands in the set twice; list every contact node once"
            )
    if not len(sets[0]):
        raise MeshError(f"{place}: is empty; the recipe must name the contact nodes")
    points = [meshes[b].points[nodes] for b, nodes in zip(bodies, sets, strict=True)]
    extent = max(float(np.ptp(p, axis=0).max()) for p in points)
    between = points[0] - points[1]
    normal = _normal(points[0], points[1])
    across = between @ normal
    offset = np.linalg.norm(between - np.outer(across, normal), axis=1)
    worst = int(offset.argmax())
    if offset[worst] > max(OUT_OF_LINE * extent, sum(map(rounding, points))):
        x, y, z = points[0][worst]
        remedy = "order both sets alike and copy the lattice of one surface to the other"
        if min(float(np.ptp(p @ normal)) for p in points) > _WRAPS * extent:
            remedy = (
                "there is one pairing direction only, here ({:.2g}, {:.2g}, {:.2g}), so surfaces "
                "that wrap round each other, as in a press fit, are not paired"
            ).format(*normal + 0.0)
        raise MeshError(
            f"{place}: pair {worst} at ({x:.6g}, {y:.6g}, {z:.6g}) mm is "
            f"{offset[worst]:.3g} mm out of line; {remedy}"
        )
    return Pairs(bodies, keys, len(sets[0]), float(offset[worst]), float(np.abs(across).max()))


def _normal(one: FloatArray, two: FloatArray) -> FloatArray:
    """Unit normal of the best plane through the flatter of two sets of points (n, 3)."""
    fits = [np.linalg.svd(p - p.mean(axis=0), full_matrices=False) for p in (one, two)]
    flatter = min(fits, key=lambda fit: float(fit[1][-1]))
    normal: FloatArray = flatter[2][-1]
    return normal


# -- shape -----------------------------------------------------------------------------------------


def _determinant(axes: FloatArray) -> FloatArray:
    """Determinant of (..., 3, 3) unit row vectors; 0 where a row has no length."""
    length = np.linalg.norm(axes, axis=-1, keepdims=True)
    unit = np.divide(axes, length, out=np.zeros_like(axes), where=length > 0.0)
    determinant: FloatArray = np.einsum(
        "...i,...i->...", unit[..., 0, :], np.cross(unit[..., 1, :], unit[..., 2, :])
    )
    return determinant


def scaled_jacobian(mesh: Mesh) -> FloatArray:
    """Scaled Jacobian of every hexahedron, (n_hex,).

    Least determinant of the unit edge vectors over the 8 corners and of the unit principal axes at
    the centre; 1 for a brick, <= 0 for an inverted element (Verdict Library Reference Manual,
    SAND2007-1751, 6.16). Edges of 20- and 27-node elements are taken where they leave the corner,
    so that a bent edge counts.
    """
    corner = mesh.points[mesh.hexes[:, :8]]
    edges = corner[:, _NEIGHBOURS] - corner[:, :, None, :]
    if mesh.order == 2:
        # tangent of the quadratic edge at the corner a: 4 x_middle - x_b - 3 x_a
        edges = 4.0 * (mesh.points[mesh.hexes[:, _MIDDLES]] - corner[:, :, None, :]) - edges
    centre = np.stack(
        [corner[:, high].sum(axis=1) - corner[:, low].sum(axis=1) for high, low in _FACES], axis=1
    )
    least: FloatArray = np.minimum(_determinant(edges).min(axis=1), _determinant(centre))
    return least


def edge_ratio(mesh: Mesh) -> FloatArray:
    """Longest over shortest edge (between corners) of every hexahedron, (n_hex,)."""
    corner = mesh.points[mesh.hexes[:, :8]]
    length = np.linalg.norm(corner[:, EDGES[:, 1]] - corner[:, EDGES[:, 0]], axis=2)
    shortest = length.min(axis=1)
    ratio: FloatArray = np.divide(
        length.max(axis=1), shortest, out=np.full(len(length), np.inf), where=shortest > 0.0
    )
    return ratio
