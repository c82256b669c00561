"""Do the contact nodes of two bodies face each other one to one?"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from upd.errors import MeshError
from upd.mesh import FloatArray, Mesh

#: largest offset of two paired nodes along the contact, relative to the contact's extent: rounding
#: of coordinates, far below any element
_OFFSET = 1e-9


def check_pairs(meshes: Mapping[str, Mesh]) -> None:
    """Raise MeshError unless node sets named contact...

    That two bodies share are bijections whose k-th nodes lie on one normal.

    The normal is that of the flatter of the two sets; the gap along it may be anything.
    """
    for (name_1, one), (name_2, two) in combinations(meshes.items(), 2):
        for key in sorted(set(one.nodes) & set(two.nodes)):
            if key.startswith("contact"):
                _check(f"{name_1} and {name_2}, node set {key!r}", one, two, key)


def _check(place: str, one: Mesh, two: Mesh, key: str) -> None:
    sets = one.nodes[key], two.nodes[key]
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
    points = one.points[sets[0]], two.points[sets[1]]
    extent = max(float(np.ptp(p, axis=0).max()) for p in points)
    gap = points[0] - points[1]
    normal = _normal(points[0], points[1])
    offset = np.linalg.norm(gap - np.outer(gap @ normal, normal), axis=1)
    worst = int(offset.argmax())
    if offset[worst] > _OFFSET * extent:
        x, y, z = points[0][worst]
        raise MeshError(
            f"{place}: pair {worst} at ({x:.6g}, {y:.6g}, {z:.6g}) mm is "
            f"{offset[worst]:.3g} mm out of line; "
            "order both sets alike and copy the lattice of one surface to the other"
        )


def _normal(one: FloatArray, two: FloatArray) -> FloatArray:
    """Unit normal of the best plane through the flatter of two sets of points (n, 3)."""
    fits = [np.linalg.svd(p - p.mean(axis=0), full_matrices=False) for p in (one, two)]
    flatter = min(fits, key=lambda fit: float(fit[1][-1]))
    normal: FloatArray = flatter[2][-1]
    return normal
