"""Sections through meshes, and the dimensions that belong on a drawing of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from upd.mesh.hexmesh import EDGES, FloatArray, IntArray, Mesh, boundary_faces

#: distance by which the plane of a section is moved off lattice planes, relative to the meshes
_BESIDE = 1e-5
Point = tuple[float, float]


@dataclass(frozen=True)
class Length:
    """A length between two points of a section, mm.

    Attributes
    ----------
    name
        The parameter.
    start, end
        In the view's axes.
    along
        Direction it is measured in.
    offset
        From the points to the line it is written on, mm, to the left of ``along``; negative to
        its right.
    beyond
        End beyond which its name stands when there is no room between them.
    """

    name: str
    start: Point
    end: Point
    along: Point
    offset: float
    beyond: Literal["start", "end"] = "end"

    @property
    def value(self) -> float:
        """The length as the points have it."""
        return abs(float(np.dot(np.subtract(self.end, self.start), self.along)))


@dataclass(frozen=True)
class Opening:
    """An angle at a point of a section, degrees.

    Attributes
    ----------
    name
        The parameter.
    vertex, one, two
        In the view's axes; less than 180 degrees from ``one`` to ``two``.
    label_at
        Where its name stands, inches from the vertex; beside the arc when None.
    """

    name: str
    vertex: Point
    one: Point
    two: Point
    label_at: Point | None = None

    @property
    def value(self) -> float:
        """The angle as the points have it."""
        (a, b), (c, d) = np.subtract([self.one, self.two], self.vertex)
        return abs(float(np.degrees(np.arctan2(a * d - b * c, a * c + b * d))))


@dataclass(frozen=True)
class SectionView:
    """A plane section with dimensions.

    Attributes
    ----------
    title
    origin
        A point of the plane, mm.
    axes
        Numbers of the two coordinates it shows, to the right and up.
    marks
        What is written on it.
    strips
        Name, start and end of parts of a side that a set of nodes takes.
    window
        Least and largest coordinates shown; all of the section when None.
    """

    title: str
    origin: tuple[float, float, float]
    axes: tuple[int, int]
    marks: Sequence[Length | Opening]
    strips: Sequence[tuple[str, Point, Point]] = ()
    window: tuple[Point, Point] | None = None


#: a body in a section: polygons (n, 2) of the elements that the plane cuts, and pieces (m, 2, 2) of
#: its boundary, mm
CutBody = tuple[list[FloatArray], FloatArray]


def plain_views(meshes: Mapping[str, Mesh]) -> list[SectionView]:
    """Sections through the middle of meshes whose recipe has none, with their extents."""
    every = np.vstack([mesh.points for mesh in meshes.values()])
    low, high = every.min(axis=0), every.max(axis=0)
    middle = [float(v) for v in (low + high) / 2.0]
    room = 0.1 * float((high - low).max())
    views = []
    for across in (0, 1):
        left, right = float(low[across]), float(high[across])
        bottom, top = float(low[2]), float(high[2])
        marks = [
            Length("xy"[across], (left, bottom), (right, bottom), (1.0, 0.0), -room),
            Length("z", (right, bottom), (right, top), (0.0, 1.0), -room),
        ]
        title = f"section through the middle, along {'xy'[across]}"
        place = (middle[0], middle[1], middle[2])
        views.append(SectionView(title, place, (across, 2), marks))
    return views


def cut(meshes: Mapping[str, Mesh], view: SectionView) -> dict[str, CutBody]:
    """Each body as the view's plane cuts it; one that it misses is empty.

    Parameters
    ----------
    meshes
        By the names of their bodies.
    view
        Its plane is moved by 1e-5 of the meshes' extent, off their planes of nodes.
    """
    normal = 3 - sum(view.axes)
    extent = max(float(np.ptp(mesh.points, axis=0).max()) for mesh in meshes.values())
    level = view.origin[normal] + _BESIDE * extent
    return {name: _cut(mesh, view.axes, normal, level) for name, mesh in meshes.items()}


def _cut(mesh: Mesh, axes: tuple[int, int], normal: int, level: float) -> CutBody:
    height = mesh.points[:, normal] - level
    flat = mesh.points[:, axes]
    hexes = mesh.hexes[:, :8]
    above = height[hexes] > 0.0
    cells = []
    for nodes in hexes[above.any(axis=1) & ~above.all(axis=1)]:
        ends = nodes[EDGES]
        found = _crossings(flat, height, ends[(height[ends] > 0.0).sum(axis=1) == 1])
        middle = found - found.mean(axis=0)
        cells.append(found[np.argsort(np.arctan2(middle[:, 1], middle[:, 0]))])
    # Pieces in which the plane meets the sides of the boundary: a flat side is met in two of its
    # edges or in none.
    quads = boundary_faces(mesh)[:, :4]
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2)
    crossed = (height[edges] > 0.0).sum(axis=2) == 1
    two = crossed.sum(axis=1) == 2
    ends = edges[two][crossed[two]]
    return cells, _crossings(flat, height, ends).reshape(-1, 2, 2)


def _crossings(flat: FloatArray, height: FloatArray, ends: IntArray) -> FloatArray:
    """Where edges, (n, 2) nodes, meet the plane, (n, 2)."""
    a, b = ends.T
    share = height[a] / (height[a] - height[b])
    found: FloatArray = flat[a] + share[:, None] * (flat[b] - flat[a])
    return found
