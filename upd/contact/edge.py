"""Area of a contact of any shape, its edge located between the nodes.

At a smooth edge the pressure falls like the root of the distance s to it and the gap opens with
its power 3/2, with one factor B along both (plane strain across the edge):

    p = B sqrt(s)  inside,      g = (4 B / 3 E*) s^(3/2)  outside.

Between a node in contact and an open neighbour, c h apart across the edge (c the cosine between the
line between them and the edge's normal), B follows from both distances together,

    p^2 / B^2 + (3 E* g / 4 B)^(2/3) = c h,

and p^2 / B^2 / (c h) is the share of the line inside the contact. The edge is a chord in each
quadrilateral it crosses, which gives its normal. Where the contact reaches the rim of the patch
the face ends, and the area with it: a face wholly in contact has its own area exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_NEWTON = 60


@dataclass(frozen=True)
class LocatedArea:
    """Area of a contact.

    Attributes
    ----------
    area : float
        mm2.
    resolution : float
        Half the area of the quadrilaterals that the edge crosses [mm2]: the area lies this far from
        the middle of what the nodes leave possible, at most. Zero for a face wholly in contact.
    """

    area: float
    resolution: float


def located_area(
    points: Array,
    quads: NDArray[np.int64],
    pressure: Array,
    gap: Array,
    contact: BoolArray,
    modulus: float,
) -> LocatedArea:
    """Area of the contact on quadrilaterals between nodes.

    Second order in the spacing for smooth edges; where a face ends or steps between two nodes, the
    resolution is all that is known.

    Parameters
    ----------
    points : (n, 2) ndarray
        Nodes [mm].
    quads : (m, 4) ndarray of int
        Corners of the quadrilaterals, around each.
    pressure, gap : (n,) ndarray
        At the nodes, loaded [MPa, mm].
    contact : (n,) ndarray of bool
        Nodes in contact.
    modulus : float
        Contact modulus E* [MPa].

    Returns
    -------
    LocatedArea

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), section 4.2(c): the cylinder's pressure and gap, taken
    near the edge.
    """
    closed = contact[quads].sum(axis=1)
    px, py = np.moveaxis(points[quads], 2, 0)
    cell = 0.5 * np.abs((px * np.roll(py, -1, 1) - py * np.roll(px, -1, 1)).sum(axis=1))
    cut = (closed > 0) & (closed < 4)
    crossed = quads[cut]
    whole = float(cell[closed == 4].sum())
    if not len(crossed):
        return LocatedArea(whole, 0.0)
    inside, opening = pressure**2, np.cbrt(0.75 * modulus * np.maximum(gap, 0.0)) ** 2
    lines = _Lines(points, inside, opening, contact)
    # The first pass takes the lines between nodes for normals, the second has the normals.
    normals = _cut(lines, crossed)[1]
    areas, _ = _cut(_Lines(points, inside, opening, contact, normals), crossed)
    return LocatedArea(whole + areas, 0.5 * float(cell[cut].sum()))


@dataclass(frozen=True)
class _Lines:
    """Lines between nodes in contact and open ones; the squared pressure and the opening to
    the power 2/3 at the nodes, both as a length but for B.
    """

    points: Array
    inside: Array
    opening: Array
    contact: BoolArray
    cosine: dict[tuple[int, int], float] | None = None

    def crossing(self, a: int, b: int) -> Array:
        """(2,) where the edge crosses the line from ``a``, in contact, to ``b``, open."""
        line = self.points[b] - self.points[a]
        cosine = 1.0 if self.cosine is None else self.cosine.get(_key(a, b), 1.0)
        length = cosine * float(np.hypot(*line))
        return self.points[a] + line * _share(  # type: ignore[no-any-return]
            float(self.inside[a]), float(self.opening[b]), max(length, np.finfo(float).tiny)
        )


def _key(a: int, b: int) -> tuple[int, int]:
    return (a, b) if a < b else (b, a)


def _share(inside: float, opening: float, length: float) -> float:
    """inside u^3 / length with inside u^3 + opening u = length, u = B^(-2/3): rising, one root."""
    if inside == 0.0:
        return 0.0
    if opening == 0.0:
        return 1.0
    # Both bounds are above the root, from where Newton falls to it on a convex function.
    u = min(float(np.cbrt(length / inside)), length / opening)
    for _ in range(_NEWTON):
        step = (inside * u**3 + opening * u - length) / (3.0 * inside * u**2 + opening)
        u -= step
        if step <= np.finfo(float).eps * u:
            break
    return inside * u**3 / length


def _cut(lines: _Lines, crossed: NDArray[np.int64]) -> tuple[float, dict[tuple[int, int], float]]:
    """Area in contact of the quadrilaterals that the edge crosses, and line -> cosine between it
    and the normal of the chords that end on it.
    """
    area = 0.0
    found: dict[tuple[int, int], list[float]] = {}
    for ring in crossed.tolist():
        corners, ends = [], []
        for k, node in enumerate(ring):
            after = ring[(k + 1) % 4]
            if lines.contact[node]:
                corners.append(lines.points[node])
            if lines.contact[node] != lines.contact[after]:
                pair = (node, after) if lines.contact[node] else (after, node)
                corners.append(lines.crossing(*pair))
                ends.append((_key(node, after), corners[-1]))
        px, py = np.array(corners).T
        area += 0.5 * abs(float(px @ np.roll(py, -1) - py @ np.roll(px, -1)))
        if len(ends) == 2:
            chord = ends[1][1] - ends[0][1]
            size = float(np.hypot(*chord))
            for key, _ in ends if size > 0.0 else ():
                line = lines.points[key[1]] - lines.points[key[0]]
                across = abs(float(line[0] * chord[1] - line[1] * chord[0]))
                found.setdefault(key, []).append(across / (size * float(np.hypot(*line))))
    return area, {key: float(np.mean(c)) for key, c in found.items()}
