"""Do the contact nodes of two bodies face each other one to one?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from upd.errors import MeshError
from upd.mesh import FloatArray, IntArray, Mesh

#: largest offset of two paired nodes along the contact, relative to the contact's extent: rounding
#: of coordinates, far below any element
OUT_OF_LINE = 1e-9
#: digits of coordinates that a file rounds; more are as good as all
_DIGITS = range(6, 10)
#: depth of a surface, relative to its extent, from which it is no face along one direction
_WRAPS = 0.1


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
