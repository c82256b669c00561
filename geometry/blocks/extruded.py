"""Block layouts in the (x, z) plane, extruded along y between lattice lines.

Blocks that name the same corners are glued.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product

import numpy as np

from geometry.blocks.gmsh_session import Blocks
from upd.errors import MeshError
from upd.mesh import FloatArray, IntArray

#: (column, row, line) of a block in its part
Cell = tuple[int, int, int]
Curve = tuple[tuple[str, str], tuple[str, str]]


@dataclass(frozen=True)
class Interval:
    """Elements between two neighbouring lines.

    Attributes
    ----------
    count : int
        Their number.
    ratio : float
        By which their sizes grow.
    both : bool
        From both ends to the middle.
    """

    count: int
    ratio: float = 1.0
    both: bool = False


@dataclass(frozen=True)
class Corner:
    """Corner of the layout.

    Attributes
    ----------
    x, z : float
        mm.
    kind : str
        Row of `Lines.at` its y positions come from.
    """

    x: float
    z: float
    kind: str


@dataclass(frozen=True)
class Lines:
    """Lines along y.

    Attributes
    ----------
    names : tuple of str
        In order of y.
    intervals : tuple of Interval
        Between neighbours.
    at : mapping of str to tuple of float
        Kind of corner -> positions in mm (one per name).
    """

    names: tuple[str, ...]
    intervals: tuple[Interval, ...]
    at: Mapping[str, tuple[float, ...]]

    def between(self, first: str, last: str) -> tuple[str, ...]:
        """Names from `first` to `last`, both included."""
        return self.names[self.names.index(first) : self.names.index(last) + 1]


@dataclass(frozen=True)
class Part:
    """Structured part of the layout.

    Attributes
    ----------
    name : str
    corners : sequence of sequence of str
        corners[column][row], x rising with the column and z with the row.
    columns, rows : sequence of Interval
        Between neighbouring columns and rows.
    lines : tuple of str
        The y lines it spans, in order.
    """

    name: str
    corners: Sequence[Sequence[str]]
    columns: Sequence[Interval]
    rows: Sequence[Interval]
    lines: tuple[str, ...]

    def cells(self) -> Iterator[Cell]:
        """Its blocks."""
        return product(range(len(self.columns)), range(len(self.rows)), range(len(self.lines) - 1))


@dataclass
class Layout:
    """Corners by name and the parts between them.

    Attributes
    ----------
    lines : Lines
    corners : dict of str to Corner
    parts : list of Part
    """

    lines: Lines
    corners: dict[str, Corner] = field(default_factory=dict)
    parts: list[Part] = field(default_factory=list)

    def position(self, corner: str, line: str) -> FloatArray:
        """Corner `corner` on the y line `line`, (3,) in mm."""
        c = self.corners[corner]
        return np.array([c.x, self.lines.at[c.kind][self.lines.names.index(line)], c.z])

    def ring(self, part: Part, column: int, row: int) -> tuple[str, str, str, str]:
        """Corner names of one cell, around it.

        (column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1).
        """
        c = part.corners
        return c[column][row], c[column + 1][row], c[column + 1][row + 1], c[column][row + 1]

    def curves(self) -> dict[Curve, Interval]:
        """Every edge once, with its elements.

        Raises
        ------
        MeshError
            Where two parts divide one edge differently.
        """
        found: dict[Curve, Interval] = {}
        for part in self.parts:
            for curve, interval in self._curves(part):
                there = found.get(curve, found.get((curve[1], curve[0])))
                if there is None:
                    found[curve] = interval
                elif there.count != interval.count:
                    raise MeshError(
                        f"layout, edge {curve}: {there.count} elements on one side, "
                        f"{interval.count} on the other; give both the same"
                    )
        return found

    def _curves(self, part: Part) -> Iterator[tuple[Curve, Interval]]:
        c, first = part.corners, self.lines.names.index(part.lines[0])
        for i, j, line in product(range(len(part.columns)), range(len(part.rows) + 1), part.lines):
            yield ((c[i][j], line), (c[i + 1][j], line)), part.columns[i]
        for i, j, line in product(range(len(part.columns) + 1), range(len(part.rows)), part.lines):
            yield ((c[i][j], line), (c[i][j + 1], line)), part.rows[j]
        for i, j in product(range(len(part.columns) + 1), range(len(part.rows) + 1)):
            for k, (start, end) in enumerate(pairwise(part.lines)):
                yield ((c[i][j], start), (c[i][j], end)), self.lines.intervals[first + k]

    def define(self, blocks: Blocks) -> None:
        """All points, edges and blocks.

        A block is called part/column/row/line, its axes i, j, k are x, y, z.

        Parameters
        ----------
        blocks : Blocks
        """
        curves = self.curves()
        for corner, line in sorted({end for curve in curves for end in curve}):
            blocks.point(f"{corner}@{line}", self.position(corner, line))
        for (start, end), interval in curves.items():
            first, last = "@".join(start), "@".join(end)
            blocks.curve(first, last, interval.count, ratio=interval.ratio, both=interval.both)
        for part in self.parts:
            for i, j, k in part.cells():
                a, b, c, d = self.ring(part, i, j)
                near, far = part.lines[k], part.lines[k + 1]
                names = [
                    f"{a}@{near}",
                    f"{b}@{near}",
                    f"{b}@{far}",
                    f"{a}@{far}",
                    f"{d}@{near}",
                    f"{c}@{near}",
                    f"{c}@{far}",
                    f"{d}@{far}",
                ]
                blocks.volume(f"{part.name}/{i}/{j}/{k}", names)

    def count(self, element_nodes: int, *, mirrored: bool) -> tuple[int, int]:
        """Exact numbers of nodes and of hexahedra.

        Parameters
        ----------
        element_nodes : {8, 20, 27}
        mirrored : bool
            At the first y line, else as laid out.

        Returns
        -------
        nodes, hexes : int
        """
        curves = self.curves()
        # Python's integers: a mesh too fine for any machine is still counted right, and refused by
        # its size.
        volumes = np.array(
            [self.divisions(part, cell) for part in self.parts for cell in part.cells()],
            dtype=object,
        )
        faces: dict[frozenset[tuple[str, str]], tuple[int, int]] = {}
        for part in self.parts:
            for cell in part.cells():
                faces.update(self._faces(part, *cell))
        n_hex = int(volumes.prod(axis=1).sum())
        plane = self.lines.names[0]
        whole = _nodes(
            element_nodes,
            {e for c in curves for e in c},
            [v.count for v in curves.values()],
            list(faces.values()),
            volumes,
        )
        if not mirrored:
            return whole, n_hex
        on_plane = {c: v.count for c, v in curves.items() if all(end[1] == plane for end in c)}
        flat = [n for face, n in faces.items() if all(end[1] == plane for end in face)]
        shared = _nodes(
            element_nodes,
            {e for c in on_plane for e in c},
            list(on_plane.values()),
            flat,
            np.empty((0, 3), np.int64),
        )
        return 2 * whole - shared, 2 * n_hex

    def divisions(self, part: Part, cell: Cell) -> tuple[int, int, int]:
        """Elements of one block along x, y, z."""
        i, j, k = cell
        first = self.lines.names.index(part.lines[0])
        return part.columns[i].count, self.lines.intervals[first + k].count, part.rows[j].count

    def _faces(
        self, part: Part, i: int, j: int, k: int
    ) -> Iterator[tuple[frozenset[tuple[str, str]], tuple[int, int]]]:
        nx, ny, nz = self.divisions(part, (i, j, k))
        ring, (near, far) = self.ring(part, i, j), (part.lines[k], part.lines[k + 1])
        for line in (near, far):
            yield frozenset((corner, line) for corner in ring), (nx, nz)
        for a, b, n in zip(ring, (*ring[1:], ring[0]), (nx, nz, nx, nz), strict=True):
            yield frozenset(product((a, b), (near, far))), (n, ny)


def _nodes(
    size: int,
    corners: set[tuple[str, str]],
    curves: list[int],
    faces: list[tuple[int, int]],
    volumes: IntArray,
) -> int:
    """Nodes on corners, inside edges, inside faces and inside blocks of these divisions."""
    r = 1 if size == 8 else 2
    a, b = np.array(faces, dtype=object).reshape(-1, 2).T
    i, j, k = volumes.T
    n = len(corners) + int(
        np.sum(r * np.array(curves, dtype=object) - 1) + np.sum((r * a - 1) * (r * b - 1))
    )
    n += int(np.sum((r * i - 1) * (r * j - 1) * (r * k - 1)))
    if size == 20:  # no face centres, no centres
        inner = (i - 1) * j * k + i * (j - 1) * k + i * j * (k - 1)
        n -= int(np.sum(a * b) + np.sum(inner) + np.sum(i * j * k))
    return n
