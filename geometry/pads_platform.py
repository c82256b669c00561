"""Asymmetric damper, a prism with two raised pads on one face, on a platform: all hexahedra.

In contact axes; the section is a quadrilateral. Dimensions by default are a reconstruction, not a
drawing. The contact plane z = 0 is the pads' top, the damper above it (its padded face at
z = step), the platform below; x runs along the damper, y up the slope of the face, and the origin
lies midway between the pads.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
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
    "TOP",
    "PadsPlatform",
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
DISTANT = {"damper": ("wires", "bottom"), "platform": ("opposite", "sides")}
#: body -> sets with weights, which hold it in the mean
WEIGHTED = {"damper": ("distant", "distant_wires")}
#: upper end of the damper's vertical face (between angle_a and angle_b) in rig axes, mm
TOP = (-1.5, 0.0, 73.171)


@dataclass(frozen=True)
class PadsPlatform:
    """The damper with two pads on its platform.

    Parameters
    ----------
    angle_a, angle_b : float
        At the upper and the lower end of the vertical face, degrees; the padded face starts at the
        upper one.
    ab : float
        Height of the vertical face, mm.
    cut : float
        Horizontal extent of the section, cut off parallel to the vertical face, mm.
    pad_width : float
        Of a pad, along x, mm.
    pad_length : float
        Of a pad, along the slope, mm.
    step : float
        Height of the pads above the face, mm.
    pad_gap : float
        Between the pads, mm; the damper is 2 pad_width + pad_gap long.
    pad_centre : float
        Horizontal distance of the pads' centre from the vertical face, measured on their top, mm.
    pad_offset : float
        By which the left pad (x < 0) is lower than the right one, mm; only with symmetry "full".
    divisions : int
        Elements of a pad along the slope. Cost: contact nodes grow in proportion, the time of a run
        faster.
    divisions_long : int
        Elements of a pad along x. Cost: as of divisions.
    margin : float
        Of the platform block around both pads, on all four sides, mm.
    thickness : float
        Of the platform block, mm.
    wire_position : float
        abs(x) of the two wires on the bottom face, mm.
    wire_width : float
        Width of the bands under them, mm, exact on every mesh.
    first_layer : float
        Thickness of the elements at the contact, relative to the pad lattice. Cost: thinner, more
        elements.
    bottom_layer : float, optional
        Thickness of the damper's elements at its bottom, where wires press, relative to the pad
        lattice; None: as sizes grow from the pads on. Cost: thinner, more elements.
    growth : float
        Largest ratio of neighbouring element sizes away from the pads and, with a bottom_layer, the
        bottom (half-way, where both meet, it may be more). Cost: nearer to 1, more elements.
    element_nodes : {8, 20, 27}
        Nodes per hexahedron. Cost: 20 and 27 take four to eight times the dofs of 8.
    symmetry : {"full", "half"}
        "half" is x >= 0, the right pad. Cost: half the dofs.

    Raises
    ------
    InputError
        With all errors, one per line.
    """

    angle_a: float = in_degrees(60.0, 20.0, 85.0)
    angle_b: float = in_degrees(95.0, 60.0, 120.0)
    ab: float = in_mm(12.0)
    cut: float = in_mm(17.5)
    pad_width: float = in_mm(18.0)
    pad_length: float = in_mm(8.0)
    step: float = in_mm(1.0)
    pad_gap: float = in_mm(6.5)
    pad_centre: float = in_mm(7.129)
    pad_offset: float = in_mm(0.0, least=0.0)
    divisions: int = whole(16)
    divisions_long: int = whole(36)
    margin: float = in_mm(10.0)
    thickness: float = in_mm(20.0)
    wire_position: float = in_mm(12.25)
    wire_width: float = in_mm(2.0)
    first_layer: float = ratio(1.0, 0.05, 4.0)
    bottom_layer: float | None = ratio(None, 0.05, 4.0)
    growth: float = ratio(1.3, 1.05, 2.0)
    element_nodes: int = choice(8, 8, 20, 27)
    symmetry: Literal["full", "half"] = choice("full", "full", "half")

    def __post_init__(self) -> None:
        require(field_faults(self))
        require(_misfits(self))

    @property
    def length(self) -> float:
        """Length of the damper, mm."""
        return 2.0 * self.pad_width + self.pad_gap

    @property
    def slope(self) -> float:
        """Angle of the padded face to the horizontal, degrees."""
        return 90.0 - self.angle_a

    @property
    def spacing(self) -> float:
        """The smaller of the pad lattice's, mm."""
        return min(self.pad_length / self.divisions, self.pad_width / self.divisions_long)

    @property
    def first(self) -> float:
        """Thickness of the elements at the contact, mm."""
        return self.first_layer * self.spacing

    @property
    def along(self) -> float:
        """From the vertical face along the padded one to the foot of the pads' centre, mm."""
        slope = math.radians(self.slope)
        return (self.pad_centre - self.step * math.sin(slope)) / math.cos(slope)

    @property
    def face(self) -> float:
        """Length of the padded face, mm."""
        return self.cut / math.cos(math.radians(self.slope))

    @property
    def taper(self) -> float:
        """Height the section loses per mm from the vertical face."""
        return math.tan(math.radians(self.slope)) - math.tan(math.radians(self.angle_b - 90.0))


def _misfits(p: PadsPlatform) -> list[str]:
    """Errors of the lengths against each other."""
    problems = _section_faults(p)
    if p.pad_offset > 0.5 * p.step:
        problems.append(
            f"pad_offset: {p.pad_offset:g} mm is outside 0 ... {0.5 * p.step:g} mm, half "
            "of the step"
        )
    if p.pad_offset != 0.0 and p.symmetry == "half":
        problems.append(
            'pad_offset: pads of unequal height have no mirror plane; set symmetry to "full"'
        )
    if p.wire_position + p.wire_width / 2.0 > p.length / 2.0:
        problems.append(
            f"wire_position: {p.wire_position:g} mm is not on the damper; at most "
            f"{(p.length - p.wire_width) / 2.0:g} mm"
        )
    return problems


def _section_faults(p: PadsPlatform) -> list[str]:
    problems = []
    if p.ab - p.cut * p.taper <= 0.05 * p.ab:
        problems.append(
            f"cut: {p.cut:g} mm leaves no height at the far end; less than "
            f"{0.95 * p.ab / p.taper:.6g} mm, or a larger ab"
        )
    low, high = _pad_centre_range(p)
    if low > high:
        problems.append(
            f"pad_length: {p.pad_length:g} mm does not fit on the padded face, "
            f"{p.face:.6g} mm long; shorten it or enlarge cut"
        )
    elif not low <= p.pad_centre <= high:
        problems.append(
            f"pad_centre: {p.pad_centre:g} mm puts the pads beyond their face; {low:.6g} "
            f"... {high:.6g} mm"
        )
    return problems


def _pad_centre_range(p: PadsPlatform) -> tuple[float, float]:
    """Least and largest pad_centre (mm) that leave a row of elements on either side of the pads."""
    slope = math.radians(p.slope)
    margin = p.pad_length * (0.5 + 0.02 / max(p.divisions, 1))
    shift = p.step * math.sin(slope)
    return margin * math.cos(slope) + shift, (p.face - margin) * math.cos(slope) + shift


def section_corners(p: PadsPlatform) -> dict[str, tuple[float, float]]:
    """(y, z) in mm of the section's corners without pads.

    Top and bottom of the vertical face, then of the cut.
    """
    axes = prism.inclined_axes(p.slope)[1:][:, [0, 2]]
    top = np.array([p.along, p.step])
    drop = p.cut * math.tan(math.radians(p.angle_b - 90.0))
    rig = {"top": (0.0, 0.0), "bottom": (0.0, -p.ab), "cut_bottom": (p.cut, -p.ab - drop)}
    found = {name: top + axes @ np.array(place) for name, place in rig.items()}
    found["cut_top"] = np.array([p.along - p.face, p.step])
    return {name: (float(y), float(z)) for name, (y, z) in found.items()}


def _lines(p: PadsPlatform, *, platform: bool) -> Lines:
    """Middle of the gap, inner and outer edge of the right pad, and the platform's side."""
    size = p.pad_width / p.divisions_long
    names, positions = ["middle", "inner", "outer"], [0.0, p.pad_gap / 2.0, p.length / 2.0]
    intervals = [
        prism.backwards(prism.growing(p.pad_gap / 2.0, size, p.growth)),
        Interval(p.divisions_long),
    ]
    if platform:
        names.append("outside")
        positions.append(p.length / 2.0 + p.margin)
        intervals.append(prism.growing(p.margin, size, p.growth))
    return prism.lines_along_x(names, positions, intervals)


def _damper_layout(p: PadsPlatform) -> Layout:
    """The section between the padded face and the bottom; below it the pad.

    Its lines are parallel to the vertical face.
    """
    at = {name: np.array(place) for name, place in section_corners(p).items()}
    size, half = p.pad_length / p.divisions, p.pad_length / 2.0
    y = [at["cut_top"][0], -half, half, at["top"][0]]
    layout = Layout(_lines(p, platform=False))
    for k, place in enumerate(y):
        share = (place - y[0]) / p.face
        layout.corners[f"face{k}"] = prism.corner(place, p.step)
        layout.corners[f"bottom{k}"] = prism.corner(
            *((1.0 - share) * at["cut_bottom"] + share * at["bottom"])
        )
    for k in (1, 2):
        layout.corners[f"pad{k}"] = prism.corner(y[k], 0.0)
    rows = [
        prism.backwards(prism.growing(y[1] - y[0], size, p.growth)),
        Interval(p.divisions),
        prism.growing(y[3] - y[2], size, p.growth),
    ]
    sides = ["face", "bottom"]
    if p.bottom_layer is not None:
        sides.insert(1, "middle")
        for k in range(4):
            face, bottom = layout.corners[f"face{k}"], layout.corners[f"bottom{k}"]
            middle = prism.corner((face.z + bottom.z) / 2.0, (face.x + bottom.x) / 2.0)
            layout.corners[f"middle{k}"] = middle
    names = [[f"{side}{k}" for k in range(4)] for side in sides]
    pad = [[f"{side}{k}" for k in (1, 2)] for side in ("pad", "face")]
    layers = prism.growing(p.step, p.first, p.growth)
    layout.parts = [
        Part("damper", names, _across(p, layers), rows, layout.lines.names),
        Part("pad", pad, [layers], [rows[1]], ("inner", "outer")),
    ]
    return layout


def _across(p: PadsPlatform, layers: Interval) -> list[Interval]:
    """Elements from the padded face to the bottom, going on from the pad's last; with a
    bottom_layer those from the face to half of the height and from there on.

    Graded for the height above the pads' centre.
    """
    # along the lines, which are vertical
    last = (
        p.step
        * layers.ratio ** (layers.count - 1)
        / float(np.sum(layers.ratio ** np.arange(layers.count)))
    )
    cosine = math.cos(math.radians(p.slope))
    highest = max(p.ab, p.ab - p.cut * p.taper)
    centre = p.ab - p.taper * p.along * cosine

    def grown(first: float, share: float) -> Interval:
        count = count_for(share * highest, first, p.growth)
        return Interval(count, ratio_for(share * centre, first, count))

    if p.bottom_layer is None:
        return [grown(last / cosine, 1.0)]
    return [
        grown(last / cosine, 0.5),
        prism.backwards(grown(p.bottom_layer * p.spacing, 0.5)),
    ]


def _platform_layout(p: PadsPlatform) -> Layout:
    half = p.pad_length / 2.0
    outside = prism.growing(p.margin, p.pad_length / p.divisions, p.growth)
    rows = [prism.backwards(outside), Interval(p.divisions), outside]
    y = [-half - p.margin, -half, half, half + p.margin]
    return prism.block_layout(
        _lines(p, platform=True),
        y,
        rows,
        p.thickness,
        prism.growing(p.thickness, p.first, p.growth),
    )


def build(params: PadsPlatform) -> dict[str, Mesh]:
    """Meshes of the bodies "damper" (z >= 0) and "platform" (z <= 0).

    Node sets of both: contact_left (x < 0, full model only) and contact_right, each sorted by x,
    then by y, with the same x and y in both bodies; contact, the left pad's then the right one's;
    distant; plane_x where the model is cut. Damper: distant_bottom (the bottom face), distant_wires
    (two bands of it under the wires); distant is distant_wires. Platform: distant_opposite (z =
    -thickness), distant_sides (its four sides); distant is distant_opposite. The bands have
    weights, the integrals of the shape functions over their exact width: evenly loaded, held in the
    mean. Faces: contact and bottom, or contact, opposite and sides.

    Parameters
    ----------
    params : PadsPlatform

    Returns
    -------
    dict of str to Mesh
        Coordinates in mm.

    Raises
    ------
    MeshError
        When gmsh fails.
    """
    slope = prism.centred(params.pad_length, params.divisions, params.element_nodes)
    block = prism.block_mesh(
        _platform_layout(params), slope, (1,), ("inner",), params.element_nodes, params.symmetry
    )
    return {
        "damper": _damper(params, slope),
        "platform": replace(block, nodes={**block.nodes, **_contact(block)}),
    }


def _damper(p: PadsPlatform, slope: FloatArray) -> Mesh:
    layout = _damper_layout(p)
    points, grids = prism.mesh_half(layout, "damper", p.element_nodes)
    faces = {
        "contact": prism.side(layout, grids, "pad", "z", 0),
        "bottom": prism.side(layout, grids, "damper", "z", 1),
    }
    contact = np.unique(faces["contact"])
    points[contact, 1] = prism.nearest(points[contact, 1], slope)
    points[contact, 2] = 0.0
    points[np.unique(prism.side(layout, grids, "damper", "z", 0)), 2] = p.step
    mesh = prism.whole(points, grids, faces, p.symmetry)
    mesh = mesh.with_points(_lowered(mesh.points, p))
    wires, weights = band_weights(mesh, mesh.faces["bottom"], p.wire_position, p.wire_width)
    sets = {
        **_contact(mesh),
        "distant": wires,
        "distant_wires": wires,
        "distant_bottom": prism.surface(mesh, "bottom"),
    }
    held = {"distant": weights, "distant_wires": weights}
    return prism.with_sets(mesh, sets, p.symmetry, held)


def _contact(mesh: Mesh) -> dict[str, IntArray]:
    """The contact sets; sorted by x, the left pad comes first by itself."""
    contact = prism.surface(mesh, "contact")
    x = mesh.points[contact, 0]
    pads = {"contact_left": contact[x < 0.0], "contact_right": contact[x > 0.0]}
    return {"contact": contact, **{name: nodes for name, nodes in pads.items() if len(nodes)}}


def _lowered(points: FloatArray, p: PadsPlatform) -> FloatArray:
    """Points with the left pad's top shortened by pad_offset, fading linearly over the step."""
    if p.pad_offset == 0.0:
        return points
    fade = np.where(points[:, 0] < 0.0, np.clip(1.0 - points[:, 2] / p.step, 0.0, 1.0), 0.0)
    lowered: FloatArray = points + p.pad_offset * fade[:, None] * np.array([0.0, 0.0, 1.0])
    return lowered


def count(params: PadsPlatform) -> dict[str, dict[str, int]]:
    """Exact numbers of nodes and elements of each body, without meshing.

    Parameters
    ----------
    params : PadsPlatform

    Returns
    -------
    dict of str to dict
        Body -> "nodes", "hexes" and "contact" (nodes).
    """
    pads = 2 if params.symmetry == "full" else 1
    contact = pads * prism.lattice_nodes(
        params.divisions_long, params.divisions, params.element_nodes
    )
    layouts = {"damper": _damper_layout(params), "platform": _platform_layout(params)}
    return {
        name: prism.count_body(layout, contact, params.element_nodes, params.symmetry)
        for name, layout in layouts.items()
    }


def inclination(params: PadsPlatform) -> tuple[float, float]:
    """Angles of the damper's left (vertical) and right (padded) face to the horizontal, degrees."""
    return 90.0, params.slope


def placement(params: PadsPlatform, top: Sequence[float] = TOP) -> tuple[FloatArray, FloatArray]:
    """Origin and directions of the contact axes in rig axes, for the pads on the right platform.

    Rig: x across the blades, y along the damper, z up. The local y points up the slope towards the
    platform's tip, z from the platform into the damper (down, to the left), and x = y x z along -y
    of the rig.

    Parameters
    ----------
    params : PadsPlatform
    top : (3,) sequence of float
        Upper end of the damper's vertical face, mm.

    Returns
    -------
    origin : (3,) ndarray
        mm.
    axes : (3, 3) ndarray
        Unit vectors, row by row.
    """
    axes = prism.inclined_axes(params.slope)
    return np.asarray(top, dtype=np.float64) - params.along * axes[1] - params.step * axes[2], axes


def centroid(params: PadsPlatform) -> FloatArray:
    """Centroid of the whole damper, its pads included, in contact axes, (3,) in mm."""
    corners = section_corners(params)
    area, middle = prism.polygon(
        [corners[name] for name in ("top", "bottom", "cut_bottom", "cut_top")]
    )
    volumes = np.array([area * params.length, *_pad_volumes(params)])
    heights = np.array([0.0, params.pad_offset])
    x = params.pad_gap / 2.0 + params.pad_width / 2.0
    centres = np.array(
        [
            [0.0, *middle],
            *(
                [side * x, 0.0, (params.step + h) / 2.0]
                for side, h in zip((1.0, -1.0), heights, strict=True)
            ),
        ]
    )
    mean: FloatArray = volumes @ centres / volumes.sum()
    return mean


def _pad_volumes(p: PadsPlatform) -> tuple[float, float]:
    """Volumes of the right and the left pad, mm3."""
    area = p.pad_width * p.pad_length
    return area * p.step, area * (p.step - p.pad_offset)


def damper_sizes(params: PadsPlatform) -> DamperSizes:
    """The damper and its contact in the words that recipes share."""
    p, corners = params, section_corners(params)
    area, _ = prism.polygon([corners[name] for name in ("top", "bottom", "cut_bottom", "cut_top")])
    return DamperSizes(
        "pads",
        area * p.length + sum(_pad_volumes(p)),
        {
            "angle of the padded face to the horizontal": Size(p.slope, "deg", "90 - angle_a"),
            "angle of vertical face and bottom": Size(p.angle_b, "deg", "angle_b"),
            "height of the vertical face": Size(p.ab, "mm", "ab"),
            "extent from the vertical face": Size(p.cut, "mm", "cut"),
            "length of the damper": Size(p.length, "mm", "2 pad_width + pad_gap"),
            "pad along the slope": Size(p.pad_length, "mm", "pad_length"),
            "pad along the damper": Size(p.pad_width, "mm", "pad_width"),
            "gap between the pads": Size(p.pad_gap, "mm", "pad_gap"),
            "height of the pads": Size(p.step, "mm", "step"),
            "middle of the pads from the vertical face": Size(p.pad_centre, "mm", "pad_centre"),
            "height of one pad below the other": Size(p.pad_offset, "mm", "pad_offset"),
        },
    )
