"""Sector of a bladed disk: disk, shank, platform with inclined undersides, blade; all hexahedra.

The axis of rotation is z, blades are numbered counter-clockwise about it. The sector lies between
its low face and its high face, which is the low one turned by 2 pi/N, and is symmetric to the x
axis but for the stagger. A wedge damper spans the gap to the next sector below both platforms: its
patches are contact_right on this sector's high end and contact_left on the next one's low end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from geometry.blocks import (
    Grid,
    choice,
    field_faults,
    in_degrees,
    in_mm,
    ratio,
    require,
    whole,
)
from upd.mesh import FloatArray, IntArray, Mesh

#: what this geometry is for
ANALYSIS = "bladed disk"
#: columns of the disk beside the platform's end
_GAP = 1


@dataclass(frozen=True)
class BladedSector:
    """One of N sectors.

    Parameters
    ----------
    n_sectors : int
        Number of blades N.
    bore, rim : float
        Inner radius, clamped, and outer radius of the disk, mm.
    bore_width : float
        Axial width of the disk at its bore, mm; it changes linearly to the chord at the rim.
    chord : float
        Axial width of rim, shank, platform and blade, mm.
    shank_length : float
        From the rim to the underside of the platform, mm.
    platform_thickness : float
        Beside the shank, mm.
    face_angle : float
        Of the platform's undersides to the circumference, degrees; they rise to the gap.
    half_gap : float
        Half the gap between neighbouring platforms, along the circumference, mm.
    blade_length : float
        From the platform to the tip, mm.
    blade_thickness : float
        Of shank and blade root, along the circumference, mm.
    taper : float
        Thickness of the tip over that of the root.
    stagger : float
        Angle of the blade's chord to the axis at the platform, degrees; the whole sector and its
        faces follow it.
    disk_layers, shank_layers, platform_layers, blade_layers : int
        Elements along the radius. Cost: dofs in proportion.
    overhang_columns, blade_columns : int
        Elements along the circumference: of the platform on either side, the patch being all but
        the first, and of shank and blade. Cost: as of layers, contact points too.
    axial : int
        Elements along the axis. Cost: as of columns.
    element_nodes : {8, 20, 27}
        Nodes per hexahedron. Cost: 20 and 27 take four to eight times the dofs of 8.

    Raises
    ------
    InputError
        With all errors, one per line.
    """

    n_sectors: int = whole(24, 3)
    bore: float = in_mm(60.0)
    rim: float = in_mm(140.0)
    bore_width: float = in_mm(40.0)
    chord: float = in_mm(30.0)
    shank_length: float = in_mm(18.0)
    platform_thickness: float = in_mm(10.0)
    face_angle: float = in_degrees(25.0, 0.0, 60.0)
    half_gap: float = in_mm(0.75)
    blade_length: float = in_mm(110.0)
    blade_thickness: float = in_mm(7.0)
    taper: float = ratio(0.5, 0.1, 1.0)
    stagger: float = in_degrees(25.0, -60.0, 60.0)
    disk_layers: int = whole(12)
    shank_layers: int = whole(3)
    platform_layers: int = whole(2)
    blade_layers: int = whole(16)
    overhang_columns: int = whole(3, 2)
    blade_columns: int = whole(2)
    axial: int = whole(6)
    element_nodes: int = choice(20, 8, 20, 27)

    def __post_init__(self) -> None:
        require(field_faults(self))
        require(_misfits(self))

    @property
    def pitch(self) -> float:
        """Angle of the sector, rad."""
        return 2.0 * math.pi / self.n_sectors

    @property
    def radii(self) -> tuple[float, float, float, float, float]:
        """Bore, rim, underside of the platform beside the shank, its top, tip of the blade, mm."""
        under = self.rim + self.shank_length
        top = under + self.platform_thickness
        return self.bore, self.rim, under, top, top + self.blade_length

    @property
    def overhang(self) -> float:
        """Circumferential length of a platform beside its shank, at its underside, mm."""
        return 0.5 * (self.radii[2] * self.pitch - self.blade_thickness) - self.half_gap

    @property
    def rise(self) -> float:
        """By which the underside is higher at its end than beside the shank, mm."""
        return self.overhang * math.tan(math.radians(self.face_angle))


def _misfits(p: BladedSector) -> list[str]:
    """Errors of the lengths against each other."""
    problems = []
    if p.bore >= p.rim:
        problems.append(f"bore: {p.bore:g} mm is no less than the rim's {p.rim:g} mm")
    room = p.rim * p.pitch - 2.0 * p.half_gap
    if p.blade_thickness > 0.8 * room:
        problems.append(
            f"blade_thickness: {p.blade_thickness:g} mm leaves no platform between "
            f"{p.n_sectors} blades; at most {0.8 * room:g} mm"
        )
    elif p.rise > 0.8 * p.platform_thickness:
        most = math.degrees(math.atan(0.8 * p.platform_thickness / p.overhang))
        problems.append(
            f"face_angle: {p.face_angle:g} deg rises through the platform; at most {most:g} deg"
        )
    return problems


def build(params: BladedSector) -> dict[str, Mesh]:
    """Mesh of the body "sector".

    Node sets: low and high (each node of high is one of low, turned), clamped (the bore),
    contact_left and contact_right (corners of the elements of the patches, in the same order), tip
    (of the blade, on its trailing edge), blade_tip (the whole tip).

    Parameters
    ----------
    params : BladedSector

    Returns
    -------
    dict of str to Mesh
        Coordinates in mm.
    """
    p, step = params, 1 if params.element_nodes == 8 else 2
    columns = np.cumsum([0, _GAP, p.overhang_columns, p.blade_columns, p.overhang_columns, _GAP])
    layers = np.cumsum([0, p.disk_layers, p.shank_layers, p.platform_layers, p.blade_layers])
    shape = (step * layers[-1] + 1, step * columns[-1] + 1, step * p.axial + 1)
    lattice = Grid(np.arange(math.prod(shape)).reshape(shape), p.element_nodes)
    layer, column, _ = np.indices((layers[-1], columns[-1], p.axial)).reshape(3, -1)
    blade = (column >= columns[2]) & (column < columns[3])
    platform = (layer >= layers[2]) & (layer < layers[3])
    beside = (column >= columns[1]) & (column < columns[4])
    used, hexes = np.unique(
        lattice.hexes()[(layer < layers[1]) | blade | (platform & beside)], return_inverse=True
    )
    hexes = hexes.reshape(-1, p.element_nodes).astype(np.int64)
    i, j, k = (index / step for index in np.unravel_index(used, shape))
    points = _points(p, (i, j, 2.0 * k / p.axial - 1.0), layers, columns)
    corner = np.isin(np.arange(len(used)), hexes[:, :8])
    under = corner & (i == layers[2])
    nodes = {
        "low": np.flatnonzero(j == 0),
        "high": np.flatnonzero(j == columns[-1]),
        "clamped": np.flatnonzero(i == 0),
        "contact_left": np.flatnonzero(under & (j >= columns[1]) & (j < columns[2])),
        "contact_right": np.flatnonzero(under & (j > columns[3]) & (j <= columns[4])),
        "tip": np.flatnonzero((i == layers[-1]) & (j == columns[2]) & (k == p.axial)),
        "blade_tip": np.flatnonzero(i == layers[-1]),
    }
    # from the shank to the gap on both ends
    left = nodes["contact_left"]
    nodes["contact_left"] = left[np.lexsort((k[left], -j[left]))]
    right = nodes["contact_right"]
    nodes["contact_right"] = right[np.lexsort((k[right], j[right]))]
    return {"sector": Mesh(points, hexes, {}, nodes)}


def _points(
    p: BladedSector, at: tuple[FloatArray, FloatArray, FloatArray], layers: IntArray, ends: IntArray
) -> FloatArray:
    """(n, 3) places in mm of lattice nodes: layer, column, and axial place from -1 to 1."""
    i, j, k = at
    r = np.interp(i, layers, p.radii)
    width = np.interp(r, [p.bore, p.rim], [p.bore_width, p.chord])
    # from the blade to the face, or to the platform's end
    side = np.maximum(np.maximum(j - ends[3], ends[2] - j), 0.0)
    # the underside rises to the gap; the platform's top stays
    up = np.clip((layers[3] - i) / p.platform_layers, 0.0, 1.0) * (i >= layers[2])
    r = r + up * p.rise * side / p.overhang_columns
    thickness = p.blade_thickness * np.interp(r, p.radii[3:], [1.0, p.taper])
    # the blade's sides are parallel to its middle, the disk's columns follow radii
    half = 0.5 * thickness / np.maximum(r, p.rim)
    in_disk = half + (0.5 * p.pitch - half) * side / (ends[1] + p.overhang_columns)
    on_platform = half + (0.5 * p.pitch - p.half_gap / r - half) * side / p.overhang_columns
    outside = np.where(i <= layers[1], in_disk, on_platform)
    middle = 0.5 * (ends[2] + ends[3])
    inside = half * (j - middle) / (ends[3] - middle)
    angle = np.where(side > 0.0, np.sign(j - middle) * outside, inside)
    z = 0.5 * width * k
    angle = angle + z * math.tan(math.radians(p.stagger)) / p.radii[2]
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])


def count(params: BladedSector) -> dict[str, dict[str, int]]:
    """Exact numbers of nodes and elements, from the lattice itself.

    Parameters
    ----------
    params : BladedSector

    Returns
    -------
    dict of str to dict
        Body -> "nodes", "hexes" and "contact" (nodes of one patch).
    """
    mesh = build(params)["sector"]
    contact = len(mesh.nodes["contact_left"])
    return {"sector": {"nodes": mesh.n_node, "hexes": mesh.n_hex, "contact": contact}}
