"""Prisms in contact axes: layouts of the (y, z) plane extruded along x from the plane x = 0.

What the recipes of flat contacts share. `geometry.blocks.extruded` extrudes its (x, z) plane along
y. Its axes (x, y, z) are the contact axes (z, x, y): the right hand stays, so columns of a part run
along z, rows along y, and lines along x.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Literal

import numpy as np

from geometry.blocks.extruded import Corner, Interval, Layout, Lines, Part
from geometry.blocks.gmsh_session import Blocks, count_for, graded, ratio_for, session
from geometry.blocks.hexahedron import Grid, mirrored
from upd.mesh import FloatArray, IntArray, Mesh

Symmetry = Literal["full", "half"]

_KIND = "prism"
#: contact axis -> axis of a block's lattice
_AXES = {"z": 0, "x": 1, "y": 2}


def growing(length: float, first: float, growth: float) -> Interval:
    """Elements on a length with growing sizes.

    Parameters
    ----------
    length : float
        mm.
    first : float
        Largest size of the first element, mm.
    growth : float
        Largest ratio of an element to the one before.

    Returns
    -------
    Interval
    """
    count = count_for(length, first, growth)
    return Interval(count, ratio_for(length, first, count))


def backwards(interval: Interval) -> Interval:
    """The same elements met from the other end."""
    return Interval(interval.count, 1.0 / interval.ratio)


def lines_along_x(
    names: Sequence[str], positions: Sequence[float], intervals: Sequence[Interval]
) -> Lines:
    """Lines at `positions` (mm) along x, the first at x = 0."""
    return Lines(tuple(names), tuple(intervals), {_KIND: tuple(positions)})


def corner(y: float, z: float) -> Corner:
    """Corner of the layout at (y, z) in mm."""
    return Corner(x=z, z=y, kind=_KIND)


def block_layout(
    lines: Lines, y: Sequence[float], rows: Sequence[Interval], thickness: float, depth: Interval
) -> Layout:
    """Layout of a box in z <= 0.

    Parameters
    ----------
    lines : Lines
    y : sequence of float
        Positions, mm; the box lies between the first and the last.
    rows : sequence of Interval
        Between them.
    thickness : float
        mm.
    depth : Interval
        Counts from the surface z = 0 downwards.

    Returns
    -------
    Layout
    """
    layout = Layout(lines)
    layout.corners = {
        f"{k}.{level}": corner(at, z)
        for k, at in enumerate(y)
        for level, z in ((0, -thickness), (1, 0.0))
    }
    names = [[f"{k}.{level}" for k in range(len(y))] for level in (0, 1)]
    layout.parts = [Part("block", names, [backwards(depth)], list(rows), lines.names)]
    return layout


def mesh_half(layout: Layout, name: str, element_nodes: int) -> tuple[FloatArray, dict[str, Grid]]:
    """Mesh of the half x >= 0 in contact axes.

    Parameters
    ----------
    layout : Layout
    name : str
        Of the gmsh model.
    element_nodes : {8, 20, 27}

    Returns
    -------
    points : (n, 3) ndarray
        mm, with x on the exact lattice lines.
    grids : dict of str to Grid
        The blocks' lattices.

    Raises
    ------
    MeshError
        When gmsh fails.
    """
    with session(name) as gmsh:
        blocks = Blocks(gmsh)
        layout.define(blocks)
        points, grids = blocks.mesh(element_nodes)
    points = np.ascontiguousarray(points[:, [1, 2, 0]])
    lines = layout.lines
    points[:, 0] = nearest(points[:, 0], stations(lines.at[_KIND], lines.intervals, element_nodes))
    return points, grids


def stations(
    ends: Sequence[float], intervals: Iterable[Interval], element_nodes: int
) -> FloatArray:
    """Positions of all nodes along a row of intervals.

    Parameters
    ----------
    ends : sequence of float
        Of the intervals, mm.
    intervals : iterable of Interval
    element_nodes : {8, 20, 27}

    Returns
    -------
    (n,) ndarray
        mm, rising.
    """
    runs = [
        a + (b - a) * graded(n.count, n.ratio)[:-1]
        for (a, b), n in zip(pairwise(ends), intervals, strict=True)
    ]
    corners: FloatArray = np.concatenate([*runs, ends[-1:]])
    if element_nodes == 8:
        return corners
    both: FloatArray = np.sort(np.concatenate([corners, (corners[1:] + corners[:-1]) / 2.0]))
    return both


def centred(length: float, divisions: int, element_nodes: int) -> FloatArray:
    """Positions of all nodes of an even lattice, exactly opposite about 0.

    Parameters
    ----------
    length : float
        mm.
    divisions : int
    element_nodes : {8, 20, 27}

    Returns
    -------
    (n,) ndarray
        mm.
    """
    n = divisions if element_nodes == 8 else 2 * divisions
    positions: FloatArray = np.arange(-n, n + 1, 2, dtype=np.float64) * (length / (2 * n))
    return positions


def nearest(values: FloatArray, positions: FloatArray) -> FloatArray:
    """Each value replaced by the nearest of the given positions; removes gmsh's rounding.

    Parameters
    ----------
    values : (n,) ndarray
    positions : (m,) ndarray
        Rising.

    Returns
    -------
    (n,) ndarray
    """
    found: FloatArray = positions[np.searchsorted((positions[1:] + positions[:-1]) / 2.0, values)]
    return found


def side(
    layout: Layout,
    grids: Mapping[str, Grid],
    name: str,
    axis: Literal["x", "y", "z"],
    end: int,
    *,
    rows: Collection[int] | None = None,
    lines: Collection[str] | None = None,
) -> IntArray:
    """Boundary faces of a part at one end of an axis.

    Parameters
    ----------
    layout : Layout
    grids : mapping of str to Grid
    name : str
        Of the part.
    axis : {"x", "y", "z"}
    end : {0, 1}
        0 low, 1 high.
    rows, lines : collection, optional
        Only blocks of these rows, starting at these lines.

    Returns
    -------
    (n, 4 | 8 | 9) array of int
    """
    part = next(p for p in layout.parts if p.name == name)
    outermost = {"z": len(part.columns), "x": len(part.lines) - 1, "y": len(part.rows)}[axis] - 1
    found = []
    for i, j, k in part.cells():
        at = {"z": i, "x": k, "y": j}[axis]
        chosen = (rows is None or j in rows) and (lines is None or part.lines[k] in lines)
        if chosen and at == end * outermost:
            found.append(grids[f"{name}/{i}/{j}/{k}"].faces(_AXES[axis], end))
    return np.vstack(found)


def whole(
    points: FloatArray, grids: Mapping[str, Grid], faces: Mapping[str, IntArray], symmetry: Symmetry
) -> Mesh:
    """Mesh of the body with its faces: the half x >= 0, or that and its mirror image."""
    mesh = Mesh(points, np.vstack([grid.hexes() for grid in grids.values()]), dict(faces))
    return mirrored(mesh, axis=0) if symmetry == "full" else mesh


def block_mesh(
    layout: Layout,
    slope: FloatArray,
    rows: Collection[int],
    lines: Collection[str],
    element_nodes: int,
    symmetry: Symmetry,
) -> Mesh:
    """Platform of a `block_layout` with its faces and sets contact, opposite and sides.

    Parameters
    ----------
    layout : Layout
    slope : (n,) ndarray
        y of the contact nodes, rising, mm.
    rows, lines : collection
        The contact faces lie below these rows and first lines.
    element_nodes : {8, 20, 27}
    symmetry : {"full", "half"}

    Returns
    -------
    Mesh
        Faces contact, opposite and sides; sets contact, distant, distant_opposite and
        distant_sides.
    """
    points, grids = mesh_half(layout, "platform", element_nodes)
    faces = {
        "contact": side(layout, grids, "block", "z", 1, rows=rows, lines=lines),
        "opposite": side(layout, grids, "block", "z", 0),
        "sides": np.vstack(
            [side(layout, grids, "block", *place) for place in (("x", 1), ("y", 0), ("y", 1))]
        ),
    }
    points[np.unique(side(layout, grids, "block", "z", 1)), 2] = 0.0
    points[np.unique(faces["opposite"]), 2] = layout.corners["0.0"].x
    contact = np.unique(faces["contact"])
    points[contact, 1] = nearest(points[contact, 1], slope)
    mesh = whole(points, grids, faces, symmetry)
    opposite = surface(mesh, "opposite")
    sets = {
        "contact": surface(mesh, "contact"),
        "distant": opposite,
        "distant_opposite": opposite,
        "distant_sides": surface(mesh, "sides"),
    }
    return with_sets(mesh, sets, symmetry)


def with_sets(
    mesh: Mesh,
    sets: Mapping[str, IntArray],
    symmetry: Symmetry,
    weights: Mapping[str, FloatArray] | None = None,
) -> Mesh:
    """The same mesh with these node sets and their weights, and plane_x where it is cut."""
    cut = {"plane_x": np.flatnonzero(mesh.points[:, 0] == 0.0)} if symmetry == "half" else {}
    return Mesh(mesh.points, mesh.hexes, mesh.faces, {**sets, **cut}, dict(weights or {}))


def in_order(mesh: Mesh, nodes: IntArray) -> IntArray:
    """Nodes sorted by x, then by y."""
    x, y, _ = mesh.points[nodes].T
    ordered: IntArray = nodes[np.lexsort((y, x))]
    return ordered


def surface(mesh: Mesh, *faces: str) -> IntArray:
    """Nodes of these faces, each once, sorted by x, then by y."""
    return in_order(mesh, np.unique(np.concatenate([mesh.faces[name].ravel() for name in faces])))


def count_body(
    layout: Layout, contact: int, element_nodes: int, symmetry: Symmetry
) -> dict[str, int]:
    """Numbers of "nodes" and "hexes" of a body, with that of its "contact" nodes."""
    nodes, hexes = layout.count(element_nodes, mirrored=symmetry == "full")
    return {"nodes": nodes, "hexes": hexes, "contact": contact}


def lattice_nodes(nx: int, ny: int, element_nodes: int) -> int:
    """Nodes of a rectangle of nx times ny element faces."""
    r = 1 if element_nodes == 8 else 2
    return (r * nx + 1) * (r * ny + 1) - (nx * ny if element_nodes == 20 else 0)


def polygon(corners: Sequence[Sequence[float]]) -> tuple[float, FloatArray]:
    """Area and centroid of a polygon (Green's theorem).

    Parameters
    ----------
    corners : (n, 2) array_like
        mm, counter-clockwise.

    Returns
    -------
    area : float
        mm2.
    centroid : (2,) ndarray
        mm.
    """
    p = np.asarray(corners, dtype=np.float64)
    # about its first corner, so that nothing cancels far from the origin
    a = p - p[0]
    b = np.roll(a, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = float(cross.sum()) / 2.0
    centroid: FloatArray = p[0] + (cross @ (a + b)) / (6.0 * area)
    return area, centroid


def inclined_axes(slope: float) -> FloatArray:
    """Contact axes of a right-hand face in the rig's.

    y points up the slope, z down and to the left into the damper; x = y x z points along -y of the
    rig.

    Parameters
    ----------
    slope : float
        Of the face to the horizontal, degrees.

    Returns
    -------
    (3, 3) ndarray
        Unit vectors x, y, z, row by row.
    """
    c, s = math.cos(math.radians(slope)), math.sin(math.radians(slope))
    return np.array([[0.0, -1.0, 0.0], [-c, 0.0, s], [-s, 0.0, -c]])
