"""Symmetric damper, a prism of trapezoidal section, with one leg on a platform: all hexahedra.

In contact axes. Dimensions by default are a reconstruction, not a drawing. The contact plane is
z = 0, the damper above it, the platform below; x runs along the damper, y up the slope of the
face, and the origin is the centre of the contact patch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from geometry.blocks import (
    DamperSizes,
    Size,
    choice,
    count_for,
    field_faults,
    in_degrees,
    in_mm,
    prism,
    ratio,
    ratio_for,
    require,
    whole,
)
from geometry.blocks.extruded import Interval, Layout, Lines, Part
from geometry.blocks.strips import band_weights
from upd.mesh import FloatArray, IntArray, Mesh

__all__ = [
    "ANALYSIS",
    "TIP",
    "WedgePlatform",
    "build",
    "centroid",
    "count",
    "damper_sizes",
    "inclination",
    "placement",
]

#: what this geometry is for
ANALYSIS = "flat contact"
#: body -> names of the node sets distant_... that may be held and loaded
DISTANT = {
    "damper": ("bands", "base", "wires", "opposite_leg", "point"),
    "platform": ("opposite", "sides"),
}
#: body -> sets with weights, which hold it in the mean
WEIGHTED = {"damper": ("distant", "distant_bands", "distant_wires")}
#: tip of the right platform in rig axes, mm; the leg's top end lies there
TIP = (3.0, 0.0, 77.75)


@dataclass(frozen=True)
class WedgePlatform:
    """The wedge on its platform.

    Parameters
    ----------
    angle : float
        Between base and legs, degrees.
    base, height : float
        Of the damper's section, mm; its top is base - 2 height / tan(angle) wide.
    length : float
        Of the damper, along x, mm.
    patch_length : float
        Of the contact along the slope, mm.
    patch_width : float, optional
        Of the contact along x, about the damper's middle, mm; None: as long as the damper.
    patch_offset : float
        From the leg's top end down to the patch, mm.
    divisions : int
        Elements of the patch along the slope. Cost: contact nodes grow in proportion, the time of a
        run faster.
    divisions_long : int
        Elements of the patch along x, even. Cost: as of divisions.
    margin : float
        Of the platform block around the patch, on all four sides, mm.
    thickness : float
        Of the platform block, mm.
    band : float
        Width of the two bands of the set distant_bands, mm, exact on every mesh. Their centres are
        a quarter of the contact's width from the middle.
    wire_position : float
        abs(x) of the two wires on the base, mm.
    wire_width : float
        Width of the bands under them, mm, exact on every mesh.
    first_layer : float
        Thickness of the elements at the contact, relative to the patch lattice. Cost: thinner, more
        elements.
    growth : float
        Largest ratio of neighbouring element sizes away from the patch. Cost: nearer to 1, more
        elements.
    element_nodes : {8, 20, 27}
        Nodes per hexahedron. Cost: 20 and 27 take four to eight times the dofs of 8.
    symmetry : {"full", "half"}
        "half" is x >= 0. Cost: half the dofs.

    Raises
    ------
    InputError
        With all errors, one per line.
    """

    angle: float = in_degrees(45.0, 20.0, 80.0)
    base: float = in_mm(30.0)
    height: float = in_mm(12.0)
    length: float = in_mm(42.5)
    patch_length: float = in_mm(15.0)
    patch_width: float | None = in_mm(None)
    patch_offset: float = in_mm(1.5)
    divisions: int = whole(12)
    divisions_long: int = whole(34, 2, even=True, why="the symmetry plane needs nodes on it")
    margin: float = in_mm(15.0)
    thickness: float = in_mm(40.0)
    band: float = in_mm(10.0)
    wire_position: float = in_mm(17.0)
    wire_width: float = in_mm(2.0)
    first_layer: float = ratio(0.5, 0.05, 4.0)
    growth: float = ratio(1.2, 1.05, 2.0)
    element_nodes: int = choice(8, 8, 20, 27)
    symmetry: Literal["full", "half"] = choice("full", "full", "half")

    def __post_init__(self) -> None:
        require(field_faults(self))
        require(_misfits(self))

    @property
    def top_flat(self) -> float:
        """Width of the damper's top, mm."""
        return self.base - 2.0 * self.height / math.tan(math.radians(self.angle))

    @property
    def leg(self) -> float:
        """Length of a leg, mm."""
        return self.height / math.sin(math.radians(self.angle))

    @property
    def width(self) -> float:
        """Of the contact along x, mm."""
        return self.length if self.patch_width is None else self.patch_width

    @property
    def spacing(self) -> float:
        """Of the contact lattice along x, mm."""
        return self.width / self.divisions_long

    @property
    def first(self) -> float:
        """Thickness of the elements at the contact, mm."""
        return self.first_layer * min(self.patch_length / self.divisions, self.spacing)


def _misfits(p: WedgePlatform) -> list[str]:
    """Errors of the lengths against each other."""
    problems = []
    if p.top_flat <= 0.01 * p.base:
        least = 2.0 * p.height / math.tan(math.radians(p.angle)) / 0.99
        problems.append(
            f"base: {p.base:g} mm leaves no top over legs this high and flat; more than "
            f"{least:.6g} mm, or a smaller height"
        )
    shortest = 0.02 * p.patch_length / max(p.divisions, 1)
    if p.patch_offset < shortest:
        problems.append(
            f"patch_offset: {p.patch_offset:g} mm is too thin for a row of elements; at "
            f"least {shortest:.3g} mm"
        )
    if p.leg - p.patch_offset - p.patch_length < shortest:
        most = p.leg - p.patch_offset - shortest
        problems.append(
            f"patch_length: {p.patch_length:g} mm from {p.patch_offset:g} mm below the top "
            f"leave the leg; less than {most:.6g} mm"
        )
    strip = 0.02 * p.spacing
    if p.width != p.length and (p.length - p.width) / 2.0 < strip:
        problems.append(
            f"patch_width: {p.width:g} mm leaves no row of elements beside it on the damper of "
            f"{p.length:g} mm; less than {p.length - 2.0 * strip:.6g} mm, or as long as the damper"
        )
    if p.band > p.width / 2.0:
        problems.append(
            f"band: {p.band:g} mm is wider than half the contact; at most {p.width / 2.0:g} mm"
        )
    if p.wire_position + p.wire_width / 2.0 > p.length / 2.0:
        problems.append(
            f"wire_position: {p.wire_position:g} mm is not on the damper; at most "
            f"{(p.length - p.wire_width) / 2.0:g} mm"
        )
    return problems


def section_corners(p: WedgePlatform) -> dict[str, tuple[float, float]]:
    """(y, z) in mm of the damper's corners.

    The contact leg from low to high, the other leg likewise.
    """
    across = np.array([math.cos(math.radians(p.angle)), math.sin(math.radians(p.angle))])
    high = np.array([p.patch_length / 2.0 + p.patch_offset, 0.0])
    low = high - [p.leg, 0.0]
    found = {
        "low": low,
        "other_low": low + p.base * across,
        "other_high": high + p.top_flat * across,
        "high": high,
    }
    return {name: (float(y), float(z)) for name, (y, z) in found.items()}


def _lines(p: WedgePlatform, *, platform: bool) -> Lines:
    """Middle and edge of the contact, then the damper's end or the platform's side."""
    names, positions = ["middle", "edge"], [0.0, p.width / 2.0]
    intervals = [Interval(p.divisions_long // 2)]
    beyond = p.margin if platform else (p.length - p.width) / 2.0
    if beyond > 0.0:
        names.append("end")
        positions.append(p.width / 2.0 + p.margin if platform else p.length / 2.0)
        intervals.append(prism.growing(beyond, p.spacing, p.growth))
    return prism.lines_along_x(names, positions, intervals)


def _damper_layout(p: WedgePlatform) -> Layout:
    """One family of lines from leg to leg.

    The leg is cut at the ends of the patch, the other leg in proportion.
    """
    at = {name: np.array(place) for name, place in section_corners(p).items()}
    size = p.patch_length / p.divisions
    y = [at["low"][0], -p.patch_length / 2.0, p.patch_length / 2.0, at["high"][0]]
    layout = Layout(_lines(p, platform=False))
    for k, place in enumerate(y):
        share = (place - y[0]) / p.leg
        layout.corners[f"leg{k}"] = prism.corner(place, 0.0)
        layout.corners[f"other{k}"] = prism.corner(
            *((1.0 - share) * at["other_low"] + share * at["other_high"])
        )
    rows = [
        prism.backwards(prism.growing(y[1] - y[0], size, p.growth)),
        Interval(p.divisions),
        prism.growing(y[3] - y[2], size, p.growth),
    ]
    names = [[f"{leg}{k}" for k in range(4)] for leg in ("leg", "other")]
    layout.parts = [Part("damper", names, [_across(p)], rows, layout.lines.names)]
    return layout


def _across(p: WedgePlatform) -> Interval:
    """Elements from leg to leg: as many as the base needs, graded for the width at half height."""
    first = p.first / math.sin(math.radians(p.angle))
    count = count_for(p.base, first, p.growth)
    return Interval(count, ratio_for((p.base + p.top_flat) / 2.0, first, count))


def _platform_layout(p: WedgePlatform) -> Layout:
    half = p.patch_length / 2.0
    outside = prism.growing(p.margin, p.patch_length / p.divisions, p.growth)
    rows = [prism.backwards(outside), Interval(p.divisions), outside]
    y = [-half - p.margin, -half, half, half + p.margin]
    return prism.block_layout(
        _lines(p, platform=True),
        y,
        rows,
        p.thickness,
        prism.growing(p.thickness, p.first, p.growth),
    )


def build(params: WedgePlatform) -> dict[str, Mesh]:
    """Meshes of the bodies "damper" (z >= 0) and "platform" (z <= 0).

    Node sets of both: contact (sorted by x, then y; the same coordinates in both bodies), distant,
    plane_x where the model is cut. Damper: distant_bands (two bands of the base, at abs(x) = width
    / 4 of the contact), distant_base, distant_wires (two bands of the base under the wires),
    distant_opposite_leg, distant_point (the node of the base nearest to its centre); distant is
    distant_bands. Platform: distant_opposite (z = -thickness), distant_sides (its four sides);
    distant is distant_opposite. Bands have weights, the integrals of the shape functions over their
    exact width: evenly loaded, held in the mean. Faces: contact, base and opposite_leg, or contact
    and opposite.

    Parameters
    ----------
    params : WedgePlatform

    Returns
    -------
    dict of str to Mesh
        Coordinates in mm.

    Raises
    ------
    MeshError
        When gmsh fails.
    """
    return {"damper": _damper(params), "platform": _block(params)}


def _damper(p: WedgePlatform) -> Mesh:
    layout = _damper_layout(p)
    points, grids = prism.mesh_half(layout, "damper", p.element_nodes)
    faces = {
        "contact": prism.side(layout, grids, "damper", "z", 0, rows=(1,), lines=("middle",)),
        "base": prism.side(layout, grids, "damper", "y", 0),
        "opposite_leg": prism.side(layout, grids, "damper", "z", 1),
    }
    points[np.unique(prism.side(layout, grids, "damper", "z", 0)), 2] = 0.0
    contact = np.unique(faces["contact"])
    points[contact, 1] = prism.nearest(
        points[contact, 1], prism.centred(p.patch_length, p.divisions, p.element_nodes)
    )
    mesh = prism.whole(points, grids, faces, p.symmetry)
    loaded = band_weights(mesh, mesh.faces["base"], p.width / 4.0, p.band)
    bands = {
        "distant": loaded,
        "distant_bands": loaded,
        "distant_wires": band_weights(mesh, mesh.faces["base"], p.wire_position, p.wire_width),
    }
    sets = _damper_sets(p, mesh) | {name: nodes for name, (nodes, _) in bands.items()}
    weights = {name: own for name, (_, own) in bands.items()}
    return prism.with_sets(mesh, sets, p.symmetry, weights)


def _damper_sets(p: WedgePlatform, mesh: Mesh) -> dict[str, IntArray]:
    """Sets whose nodes are held one by one."""
    base = prism.surface(mesh, "base")
    corners = section_corners(p)
    middle = np.array([0.0, *np.add(corners["low"], corners["other_low"]) / 2.0])
    nearest = np.linalg.norm(mesh.points[base] - middle, axis=1).argmin()
    return {
        "contact": prism.surface(mesh, "contact"),
        "distant_base": base,
        "distant_opposite_leg": prism.surface(mesh, "opposite_leg"),
        "distant_point": base[nearest : nearest + 1],
    }


def _block(p: WedgePlatform) -> Mesh:
    slope = prism.centred(p.patch_length, p.divisions, p.element_nodes)
    return prism.block_mesh(
        _platform_layout(p), slope, (1,), ("middle",), p.element_nodes, p.symmetry
    )


def count(params: WedgePlatform) -> dict[str, dict[str, int]]:
    """Exact numbers of nodes and elements of each body, without meshing.

    Parameters
    ----------
    params : WedgePlatform

    Returns
    -------
    dict of str to dict
        Body -> "nodes", "hexes" and "contact" (nodes).
    """
    nx = params.divisions_long if params.symmetry == "full" else params.divisions_long // 2
    contact = prism.lattice_nodes(nx, params.divisions, params.element_nodes)
    layouts = {"damper": _damper_layout(params), "platform": _platform_layout(params)}
    return {
        name: prism.count_body(layout, contact, params.element_nodes, params.symmetry)
        for name, layout in layouts.items()
    }


def inclination(params: WedgePlatform) -> tuple[float, float]:
    """Angles of the damper's left and right contact face to the horizontal, degrees."""
    return params.angle, params.angle


def placement(params: WedgePlatform, tip: Sequence[float] = TIP) -> tuple[FloatArray, FloatArray]:
    """Origin and directions of the contact axes in rig axes, for the contact on the right platform.

    Rig: x across the blades, y along the damper, z up. The local y points up the slope towards the
    tip, z from the platform into the damper (down, to the left), and x = y x z along -y of the rig.

    Parameters
    ----------
    params : WedgePlatform
    tip : (3,) sequence of float
        Where the leg's top end meets the platform's tip, mm.

    Returns
    -------
    origin : (3,) ndarray
        mm.
    axes : (3, 3) ndarray
        Unit vectors, row by row.
    """
    axes = prism.inclined_axes(params.angle)
    return np.asarray(tip, dtype=np.float64) - (
        params.patch_offset + params.patch_length / 2.0
    ) * axes[1], axes


def centroid(params: WedgePlatform) -> FloatArray:
    """Centroid of the whole damper in contact axes, (3,) in mm."""
    _, (y, z) = prism.polygon([*section_corners(params).values()][::-1])
    return np.array([0.0, y, z])


def damper_sizes(params: WedgePlatform) -> DamperSizes:
    """The damper and its contact in the words that recipes share."""
    p = params
    area, _ = prism.polygon([*section_corners(p).values()][::-1])
    return DamperSizes(
        "wedge",
        area * p.length,
        {
            "angle of the contact face to the base": Size(p.angle, "deg", "angle"),
            "base of the damper": Size(p.base, "mm", "base"),
            "height of the damper": Size(p.height, "mm", "height"),
            "length of the damper": Size(p.length, "mm", "length"),
            "contact along the slope": Size(p.patch_length, "mm", "patch_length"),
            "contact along the damper": Size(p.width, "mm", "patch_width"),
            "contact below the upper end of its leg": Size(p.patch_offset, "mm", "patch_offset"),
        },
    )
