"""Is a mesh whole, and does it name the sets an analysis needs? For recipes of the user's own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from upd.errors import OwnMeshError
from upd.mesh.boundary import boundary_quads
from upd.mesh.hexmesh import EDGES, FACE_SIZE, Mesh
from upd.mesh.pairing import rounding

#: set -> what it is for
PURPOSE = {
    "contact": "the surface that touches the other body",
    "distant": "the nodes that are held and loaded",
    "plane_x": "the mirror plane x = 0",
    "plane_y": "the mirror plane y = 0",
}


def check_mesh(name: str, mesh: Mesh) -> None:
    """Raise OwnMeshError, with all problems, unless arrays have their shapes, numbers are finite
    and every node is there.
    """
    problems = _point_problems(mesh.points)
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


def _point_problems(points: Any) -> list[str]:
    if np.ndim(points) != 2 or np.shape(points)[1] != 3:
        return [f"points have the shape {np.shape(points)}; give (n, 3), in mm"]
    bad = np.flatnonzero(~np.isfinite(np.asarray(points, dtype=float)).all(axis=1))
    return (
        [
            f"{len(bad)} of {len(points)} points are not finite, node {bad[0]} first; to "
            "fix it: correct the recipe's coordinates"
        ]
        if len(bad)
        else []
    )


def _unmerged(mesh: Mesh) -> list[str]:
    """Whether parts of the body lie at the same places without being joined."""
    points = mesh.points[np.unique(boundary_quads(mesh))]
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
        raise OwnMeshError(
            f"recipe {recipe!r}: {_how_to_name(recipe)}\n"
            + "\n".join(f"  {problem}" for problem in problems)
        )


def _how_to_name(recipe: str) -> str:
    """Where the sets of a recipe or of a mesh file get their names."""
    ending = recipe.lower().rpartition(".")[2]
    if ending == "inp":
        return "name these nodes in the file, *NSET, NSET=BODY_SET (faces follow from the nodes)"
    if ending == "msh":
        return "name these physical surfaces BODY_SET in gmsh and write the file again"
    return "name these sets in build()"
