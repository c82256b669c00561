"""Area of a contact of any shape, its edge located between the nodes of a lattice.

At a smooth edge the pressure falls like the root of the distance s to it and the gap opens with
its power 3/2, with one factor B along both (plane strain across the edge):

    p = B sqrt(s)  inside,      g = (4 B / 3 E*) s^(3/2)  outside.

Between a node in contact and an open neighbour, c h apart across the edge (c the cosine between the
lattice line and the edge's normal), B follows from both distances together,

    p^2 / B^2 + (3 E* g / 4 B)^(2/3) = c h,

and p^2 / B^2 / (c h) is the share of the line inside the contact. The edge is a chord in each
quadrilateral it crosses, which gives its normal. Where the contact reaches the rim of the lattice
the face ends, and the area with it: a face wholly in contact has its own area exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: places of the corners of a quadrilateral of the lattice, around it
_RING = ((0, 0), (1, 0), (1, 1), (0, 1))
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
        the middle of what the lattice leaves possible, at most. Zero for a face wholly in contact.
    """

    area: float
    resolution: float


def located_area(
    x: Array, y: Array, pressure: Array, gap: Array, contact: BoolArray, modulus: float
) -> LocatedArea:
    """Area of the contact on a lattice of nodes.

    Second order in the spacing for smooth edges; where a face ends or steps between two nodes, the
    resolution is all that is known.

    Parameters
    ----------
    x, y : (nx,) and (ny,) ndarray
        Lattice lines [mm].
    pressure, gap : (nx, ny) ndarray
        At the nodes, loaded [MPa, mm].
    contact : (nx, ny) ndarray of bool
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
    closed = sum((contact[i : i + len(x) - 1, j : j + len(y) - 1] * 1 for i, j in _RING), 0)
    cell = np.outer(np.diff(x), np.diff(y))
    crossed = np.argwhere((closed > 0) & (closed < 4))
    whole = float(cell[closed == 4].sum())
    if not len(crossed):
        return LocatedArea(whole, 0.0)
    inside, opening = pressure**2, np.cbrt(0.75 * modulus * np.maximum(gap, 0.0)) ** 2
    lines = _Lines(x, y, inside, opening, contact)
    # The first pass takes the lattice lines for normals, the second has the normals.
    normals = _cut(lines, crossed)[1]
    areas, _ = _cut(_Lines(x, y, inside, opening, contact, normals), crossed)
    return LocatedArea(whole + areas, 0.5 * float(cell[tuple(crossed.T)].sum()))


Node = tuple[int, int]


@dataclass(frozen=True)
class _Lines:
    """Lattice lines between nodes in contact and open ones; the squared pressure and the opening to
    the power 2/3 at the nodes, both as a length but for B.
    """

    x: Array
    y: Array
    inside: Array
    opening: Array
    contact: BoolArray
    cosine: dict[tuple[Node, Node], float] | None = None

    def at(self, node: Node) -> Array:
        """(2,) place of a node, mm."""
        return np.array([self.x[node[0]], self.y[node[1]]])

    def crossing(self, a: Node, b: Node) -> Array:
        """(2,) where the edge crosses the line from ``a``, in contact, to ``b``, open."""
        line = self.at(b) - self.at(a)
        cosine = 1.0 if self.cosine is None else self.cosine.get(_key(a, b), 1.0)
        length = cosine * float(np.abs(line).sum())
        return self.at(a) + line * _share(
            float(self.inside[a]), float(self.opening[b]), max(length, np.finfo(float).tiny)
        )


def _key(a: Node, b: Node) -> tuple[Node, Node]:
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


def _cut(lines: _Lines, crossed: NDArray[np.int64]) -> tuple[float, dict[tuple[Node, Node], float]]:
    """Area in contact of the quadrilaterals that the edge crosses, and line -> cosine between it
    and the normal of the chords that end on it.
    """
    area = 0.0
    found: dict[tuple[Node, Node], list[float]] = {}
    for i, j in crossed.tolist():
        ring = [(i + di, j + dj) for di, dj in _RING]
        corners, ends = [], []
        for k, node in enumerate(ring):
            after = ring[(k + 1) % 4]
            if lines.contact[node]:
                corners.append(lines.at(node))
            if lines.contact[node] != lines.contact[after]:
                pair = (node, after) if lines.contact[node] else (after, node)
                corners.append(lines.crossing(*pair))
                ends.append((_key(node, after), k % 2, corners[-1]))
        px, py = np.array(corners).T
        area += 0.5 * abs(float(px @ np.roll(py, -1) - py @ np.roll(px, -1)))
        if len(ends) == 2:
            chord = ends[1][2] - ends[0][2]
            size = float(np.hypot(*chord))
            for key, along, _ in ends if size > 0.0 else ():
                # The normal's part along x is the chord's along y.
                found.setdefault(key, []).append(abs(float(chord[1 - along])) / size)
    return area, {key: float(np.mean(c)) for key, c in found.items()}
