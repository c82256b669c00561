"""Layout of the two-blade rig in its (x, z) plane: blades, dampers, y lines, contact patches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from geometry.blade_rig_params import BladeRig
from geometry.blocks.extruded import Corner, Interval, Layout, Lines, Part
from upd.mesh import FloatArray

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class BladePatch:
    """Boundary side of the blocks in one column and row of a part, between two y lines.

    Attributes
    ----------
    part : str
    column, row : int
    axis, end : int
        As in `Grid.layer`.
    line, last : str
    """

    part: str
    column: int
    row: int
    axis: int
    end: int
    line: str = "y0"
    last: str = "yp"


def fine(p: BladeRig, count: float, ratio: float = 1.0) -> Interval:
    """Interval of `count` elements (at least 1) at refine = 1.

    Refined, the sizes keep their distribution. ``p.refine`` is whole, see `rounded`.
    """
    return Interval(max(1, round(count)) * int(p.refine), ratio ** (1.0 / p.refine))


def inside(p: BladeRig, count: float) -> Interval:
    """As `fine`, sizes growing from both ends to the middle."""
    found = fine(p, count, p.growth_inside)
    return Interval(found.count, found.ratio, both=True)


def y_lines(p: BladeRig) -> Lines:
    """Lines of the half y >= 0.

    y0 the middle, yg a pad's inner edge, yi the core's side, yw the edge of a patch narrower than
    the platform (unless that is yi), yp the platform's side, ys the shank's, yb the base's. On the
    undersides ("patch") they lie on the contact lattice; towards the narrower core and shank, yi
    bends from its lattice line.
    """
    half = p.platform_wy / 2.0
    start, n = (
        (0.0, p.patch_along_y // 2)
        if p.arrangement == "symmetric"
        else (p.pad_gap / 2.0, p.pad_along_y)
    )
    size = (half - start) / n
    stops = [("y0", 0.0, 0.0, 1.0)]
    if start:
        stops.append(("yg", start, start / size, 1.0))
    if _narrow_patch(p):
        stops += _narrow_stops(p, n)
    else:
        inner = _inner_line(p, start, size, n)
        stops += [("yi", start + inner * size, inner, 1.0), ("yp", half, n - inner, 1.0)]
    if p.shank_wy > p.platform_wy:
        stops.append(("ys", p.shank_wy / 2.0, (p.shank_wy / 2.0 - half) / size, 1.0))
    end = p.base_y / 2.0
    stops += [
        ("ym", (stops[-1][1] + end) / 2.0, p.base_side, p.growth),
        ("yb", end, p.base_side, 1.0 / p.growth),
    ]
    names, patch, counts, ratios = zip(*stops, strict=True)
    steps = tuple(
        fine(p, count, ratio) for count, ratio in zip(counts[1:], ratios[1:], strict=True)
    )
    at = {"patch": patch}
    for kind, width in (("core", p.core_wy), ("shank", p.shank_wy)):
        bent = width < p.platform_wy
        at[kind] = tuple(
            width / 2.0 if bent and name == "yi" else y
            for name, y in zip(names, patch, strict=True)
        )
    return Lines(names, steps, at)


def _narrow_patch(p: BladeRig) -> bool:
    return p.arrangement == "symmetric" and p.patch_across < p.platform_wy


def _sides(p: BladeRig) -> list[float]:
    """Half widths of core and shank where they are narrower than the platform, mm."""
    return [w / 2.0 for w in (p.core_wy, p.shank_wy) if w < p.platform_wy]


def _patch_edge(p: BladeRig) -> str:
    """Line where the symmetric patch ends."""
    if not _narrow_patch(p):
        return "yp"
    edge, near = p.patch_across / 2.0, p.patch_across / p.patch_along_y / 2.0
    sides = _sides(p)
    # with a side of the core or the shank within half an element, or between them, one line is both
    beside = not sides or edge + near < min(sides) or edge - near > max(sides)
    return "yw" if beside else "yi"


def _narrow_stops(p: BladeRig, n: int) -> list[tuple[str, float, float, float]]:
    """Lines from the middle to the platform's side, with a patch of n elements up to its edge."""
    half, edge = p.platform_wy / 2.0, p.patch_across / 2.0
    size, sides = edge / n, _sides(p)
    last = ("yp", half, (half - edge) / size, 1.0)
    if _patch_edge(p) == "yi":
        return [("yi", edge, n, 1.0), last]
    if sides and edge < min(sides):
        inner = float(np.mean(sides))
        return [
            ("yw", edge, n, 1.0),
            ("yi", inner, (inner - edge) / size, 1.0),
            ("yp", half, (half - inner) / size, 1.0),
        ]
    k = _inner_line(p, 0.0, size, n)
    return [("yi", k * size, k, 1.0), ("yw", edge, n - k, 1.0), last]


def _inner_line(p: BladeRig, start: float, size: float, n: int) -> int:
    """Number of the lattice line nearest to the sides of the parts narrower than the platform.

    Never the platform's own side.
    """
    narrow = _sides(p)
    wanted = float(np.mean(narrow)) if narrow else p.platform_wy / 2.0
    return min(max(round((wanted - start) / size), 1), n - 1)


@dataclass(frozen=True)
class _Wing:
    """One side of a platform: angle of the underside (radians), stops along it, its columns.

    Stops are in mm from the shank; the last is the tip.
    """

    angle: float
    stops: tuple[float, ...]
    columns: tuple[Interval, ...]


def _wing(p: BladeRig, side: Side, *, inner: bool) -> _Wing:
    front = (p.arrangement == "symmetric") == inner
    if not front and side == "left":
        return _Wing(
            0.0, (p.rear_halfwidth - p.shank_tx / 2.0,), (fine(p, p.wing_columns, p.growth),)
        )
    angle = math.radians(p.front_angle if front else p.rear_angle_right)
    tip = p.underside(front)
    if not inner:
        return _Wing(angle, (tip,), (fine(p, p.wing_columns, p.growth),))
    start, end = p.patch_span
    n = p.patch_along_slope if front else p.pad_along_slope
    size = (end - start) / n
    return _Wing(
        angle, (start, end, tip), (fine(p, start / size), fine(p, n), fine(p, (tip - end) / size))
    )


def blade(p: BladeRig, layout: Layout, side: Side) -> None:
    """Base, shank, platform and core of one blade added to `layout`.

    Corner names are side:column:row.
    """
    made = _Blade(p, layout, side)
    foot, neck = (
        made.pair("b1", 0.0, p.shank_tx, "shank"),
        made.pair("p0", p.shank_length, p.shank_tx, "shank"),
    )
    throat = made.pair("p1", p.platform_top, p.core_tx, "core")
    made.base(foot)
    made.shank(foot, neck)
    made.platform(neck, throat)
    made.core(throat)


@dataclass(frozen=True)
class _Blade:
    """One blade on its way into the layout.

    foot, neck and throat are the corners left and right where its parts meet.
    """

    p: BladeRig
    layout: Layout
    side: Side

    @property
    def sign(self) -> float:
        """Side of x = 0 of the blade."""
        return -1.0 if self.side == "left" else 1.0

    def put(self, column: str, row: str, out: float, z: float, kind: str) -> str:
        """Name of a new corner, `out` mm to the right of the blade's axis."""
        name = f"{self.side}:{column}:{row}"
        self.layout.corners[name] = Corner(self.sign * self.p.pitch / 2.0 + out, z, kind)
        return name

    def pair(self, row: str, z: float, thickness: float, kind: str) -> list[str]:
        """Corners on the left and right side of shank or core."""
        return [
            self.put(column, row, s * thickness / 2.0, z, kind)
            for column, s in (("l", -1.0), ("r", 1.0))
        ]

    def part(
        self,
        name: str,
        corners: Sequence[Sequence[str]],
        columns: list[Interval],
        heights: list[Interval],
        last: str,
    ) -> None:
        """A new part from the middle to the y line `last`; corners[column][row]."""
        self.layout.parts.append(
            Part(
                f"{self.side}.{name}",
                corners,
                columns,
                heights,
                self.layout.lines.between("y0", last),
            )
        )

    def base(self, foot: list[str]) -> None:
        p, g, low = self.p, self.p.growth, -self.p.base_height
        middle = (self.pair("b0", low, p.shank_tx, "shank"), foot)
        rows = []
        for (row, z), (left, right) in zip((("b0", low), ("b1", 0.0)), middle, strict=True):
            ends = [
                self.put(column, row, s * p.base_x / 2.0, z, "shank")
                for column, s in (("bl", -1.0), ("br", 1.0))
            ]
            rows.append([ends[0], left, right, ends[1]])
        columns = [
            fine(p, p.base_columns, 1.0 / g),
            inside(p, p.across),
            fine(p, p.base_columns, g),
        ]
        self.part("base", _columns(rows), columns, [fine(p, p.base_layers, 1.0 / g)], "yb")

    def shank(self, foot: list[str], neck: list[str]) -> None:
        p = self.p
        rows = [foot, self.pair("k", p.shank_length / 2.0, p.shank_tx, "shank"), neck]
        heights = [fine(p, p.shank_layers, p.growth), fine(p, p.shank_layers, 1.0 / p.growth)]
        last = "yi" if p.shank_wy < p.platform_wy else "yp" if p.shank_wy == p.platform_wy else "ys"
        self.part("shank", _columns(rows), [inside(p, p.across)], heights, last)

    def core(self, throat: list[str]) -> None:
        p = self.p
        force, gauge = p.platform_top + p.core_length / 2.0, p.top - p.accelerometer_depth
        rows = [
            throat,
            *(
                self.pair(row, z, p.core_tx, "core")
                for row, z in (("c1", force), ("c2", gauge), ("c3", p.top))
            ),
        ]
        end = p.accelerometer_depth * p.core_upper / (gauge - force)
        heights = [fine(p, p.core_layers, p.growth), fine(p, p.core_upper), fine(p, end)]
        self.part(
            "core",
            _columns(rows),
            [inside(p, p.across)],
            heights,
            "yi" if p.core_wy < p.platform_wy else "yp",
        )

    def platform(self, neck: list[str], throat: list[str]) -> None:
        p = self.p
        levels, heights = self._levels()
        outer, inner = self._wing(levels, inner=False), self._wing(levels, inner=True)
        left, right = (outer, inner) if self.side == "left" else (inner, outer)
        # inside, the sides of shank and core are joined by straight lines
        middle = [
            [self._between(*ends, level, share) for level, share in levels]
            for ends in zip(neck, throat, strict=True)
        ]
        corners = [*left[0][::-1], *middle, *right[0]]
        columns = [*_reversed(left[1]), inside(p, p.across), *right[1]]
        self.part("platform", corners, columns, heights, "yp")

    def _levels(self) -> tuple[list[tuple[str, float]], list[Interval]]:
        """Rows of corners (name, share of the height) and the elements between.

        One more row where a damper's face ends.
        """
        p = self.p
        if p.arrangement == "symmetric" or self.side == "right":
            return [("p0", 0.0), ("p1", 1.0)], [inside(p, p.platform_layers)]
        share = (p.left_face[1] - p.shank_length) / p.platform_height
        rows = [fine(p, p.face_along_z), fine(p, p.platform_layers * (1.0 - share))]
        return [("p0", 0.0), ("pa", share), ("p1", 1.0)], rows

    def _between(self, low: str, high: str, level: str, share: float) -> str:
        """Corner on the line between two others, or the one of them it coincides with."""
        if level in ("p0", "p1"):
            return low if level == "p0" else high
        one, two = self.layout.corners[low], self.layout.corners[high]
        name = low.replace("p0", level)
        self.layout.corners[name] = Corner(
            one.x + share * (two.x - one.x), one.z + share * (two.z - one.z), "patch"
        )
        return name

    def _wing(
        self, levels: list[tuple[str, float]], *, inner: bool
    ) -> tuple[list[list[str]], list[Interval]]:
        """Columns of corners of one side of the platform, outwards, and the elements between."""
        p, wing = self.p, _wing(self.p, self.side, inner=inner)
        out = -self.sign if inner else self.sign
        found = []
        for k, stop in enumerate(wing.stops):
            reach = out * (p.shank_tx / 2.0 + stop * math.cos(wing.angle))
            low = p.shank_length + stop * math.sin(wing.angle)
            name = f"{'i' if inner else 'o'}{k + 1}"
            height = p.platform_top - low
            found.append(
                [
                    self.put(
                        name, row, reach, low + share * height, "core" if row == "p1" else "patch"
                    )
                    for row, share in levels
                ]
            )
        return found, list(wing.columns)


def _columns(rows: list[list[str]]) -> list[tuple[str, ...]]:
    return list(zip(*rows, strict=True))


def _reversed(intervals: list[Interval]) -> list[Interval]:
    return [Interval(i.count, 1.0 / i.ratio) for i in reversed(intervals)]


def blade_patch(p: BladeRig, layout: Layout, side: Side) -> BladePatch:
    """Where the contact is on the platform of one blade."""
    part = next(q for q in layout.parts if q.name == f"{side}.platform")
    names = [column[0].split(":")[1] for column in part.corners]
    if p.arrangement == "asymmetric" and side == "left":
        return BladePatch(part.name, names.index("i1") - 1, 0, axis=0, end=1)
    column = min(names.index("i1"), names.index("i2"))
    line, last = ("y0", _patch_edge(p)) if p.arrangement == "symmetric" else ("yg", "yp")
    return BladePatch(part.name, column, 0, axis=2, end=0, line=line, last=last)


def damper(p: BladeRig, layout: Layout, *, glued: bool) -> None:
    """The damper added to `layout`, which holds both blades; glued, its corners are theirs."""
    own = {} if glued else {name: f"damper:{name}" for name in layout.corners}
    for theirs, name in own.items():
        layout.corners[name] = layout.corners[theirs]

    def shared(name: str) -> str:
        return own.get(name, name)

    if p.arrangement == "symmetric":
        left, right = ([shared(f"{side}:i{k}:p0") for k in (1, 2)] for side in SIDES)
        _wedge(p, layout, left, right)
    else:
        _triangle(
            p,
            layout,
            [shared(f"left:i1:{row}") for row in ("p0", "pa")],
            [shared(f"right:i{k}:p0") for k in (2, 1)],
        )


def damper_patch(p: BladeRig, side: Side) -> BladePatch:
    """Where the contact is on a damper that is a body of its own."""
    if p.arrangement == "symmetric":
        return BladePatch("damper.wedge", 0, 1, axis=0, end=SIDES.index(side), last=_patch_edge(p))
    return (
        BladePatch("damper.body", 0, 1, axis=0, end=0)
        if side == "left"
        else BladePatch("damper.pad", 0, 0, axis=2, end=1, line="yg")
    )


def _wedge(p: BladeRig, layout: Layout, left: list[str], right: list[str]) -> None:
    angle = math.radians(p.front_angle)
    (low, high), (start, end) = p.leg_span, p.patch_span
    columns: list[list[str]] = []
    for sign, name, legs in ((-1.0, "l", left), (1.0, "r", right)):
        ends = []
        for row, stop in (("0", low), ("3", high)):
            x = sign * (p.pitch / 2.0 - p.shank_tx / 2.0 - stop * math.cos(angle))
            layout.corners[f"damper:{name}:{row}"] = Corner(
                x, p.shank_length + stop * math.sin(angle), "patch"
            )
            ends.append(f"damper:{name}:{row}")
        columns.append([ends[0], *legs, ends[1]])
    size = (end - start) / p.patch_along_slope
    rows = [
        fine(p, (start - low) / size),
        fine(p, p.patch_along_slope),
        fine(p, (high - end) / size),
    ]
    layout.parts.append(
        Part(
            "damper.wedge",
            columns,
            [fine(p, p.damper_columns)],
            rows,
            layout.lines.between("y0", "yp"),
        )
    )


def _triangle(p: BladeRig, layout: Layout, left: list[str], pads: list[str]) -> None:
    """The asymmetric damper.

    are on the upper face.

    Parameters
    ----------
    Columns
        Left face, ends of the pads, cut.
    rows
        Below the left platform, against it. The pads.
    """
    angle, fall = (
        math.radians(p.rear_angle_right),
        math.tan(math.radians(p.damper_angle_left - 90.0)),
    )
    low, high = p.left_face
    x0 = layout.corners[left[0]].x
    share = (p.shank_length - low) / p.damper_left
    feet = [layout.corners[name].x - p.pad_step * math.sin(angle) for name in pads]
    columns: list[list[str]] = []
    for k, x in enumerate((x0, *feet, x0 + p.damper_cut)):
        bottom, top = low - (x - x0) * fall, high - (x - x0) * math.tan(angle)
        names = [f"damper:{k}:{row}" for row in range(3)]
        if k == 0:
            names[1:] = left
        for name, z in zip(names, (bottom, bottom + share * (top - bottom), top), strict=True):
            layout.corners.setdefault(name, Corner(x, z, "patch"))
        columns.append(names)
    size = p.pad_width / p.pad_along_slope
    gaps = np.diff([layout.corners[column[2]].x for column in columns]) / math.cos(angle)
    across = [fine(p, gaps[0] / size), fine(p, p.pad_along_slope), fine(p, gaps[2] / size)]
    rows = [
        fine(p, (p.shank_length - low) * p.face_along_z / (high - p.shank_length)),
        fine(p, p.face_along_z),
    ]
    lines = layout.lines
    layout.parts.append(Part("damper.body", columns, across, rows, lines.between("y0", "yp")))
    pad = [[columns[1][2], pads[0]], [columns[2][2], pads[1]]]
    layout.parts.append(
        Part(
            "damper.pad", pad, [fine(p, p.pad_along_slope)], [fine(p, 1)], lines.between("yg", "yp")
        )
    )


def bilinear(corners: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Even lattice on a quadrilateral.

    Parameters
    ----------
    corners : (2, 2, 3) ndarray
        mm, along the lattice's axes.
    shape : (n, m)
        Of the lattice.

    Returns
    -------
    (n, m, 3) ndarray
        mm.
    """
    u, v = (np.linspace(0.0, 1.0, n) for n in shape)
    along = corners[0][None] + u[:, None, None] * (corners[1] - corners[0])[None]
    lattice: FloatArray = along[:, None, 0] + v[None, :, None] * (
        along[:, None, 1] - along[:, None, 0]
    )
    return lattice
