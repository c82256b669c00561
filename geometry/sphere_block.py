"""Half-sphere on a block, all hexahedra.

A fine core under the square contact patch of each body, five frusta of hexahedra around it.
Contact plane z = 0. Block: abs(x), abs(y) <= block / 2, -block <= z <= 0. Half-sphere: lowest
point at the origin, centre (0, 0, R), flat face z = R. Only the quarter x, y >= 0 is meshed; half
and full models are its mirror images, so they are symmetric to the last bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from geometry.blocks import (
    Blocks,
    choice,
    count_for,
    field_faults,
    graded,
    in_mm,
    ratio,
    ratio_for,
    require,
    session,
    whole,
)
from geometry.blocks.hexahedron import Grid, flipped, mirrored
from upd.mesh import FloatArray, IntArray, Mesh

#: closed form the geometry has: a sphere of the parameter `radius` on a plane
CLOSED_FORM = "sphere on plane"
#: body -> names of the node sets distant_... that may be held and loaded
DISTANT = {"sphere": (), "block": ()}

#: largest distance of a patch corner from the axis, relative to the sphere's radius
_STEEPEST = 0.6


@dataclass(frozen=True)
class SphereBlock:
    """The half-sphere on the block.

    Parameters
    ----------
    radius : float
        Of the half-sphere, mm.
    block : float
        Edge of the cube, mm.
    patch : float
        Edge of the square potential contact patch, mm.
    divisions : int
        Elements along the patch edge, even. Cost: contact nodes grow with the square, the time of a
        run faster.
    growth : float
        Largest ratio of neighbouring element sizes away from the patch. Cost: nearer to 1, more
        elements.
    core_depth : float
        Depth of the fine core, relative to the patch edge. Cost: deeper, more elements.
    element_nodes : {8, 20, 27}
        Nodes per hexahedron. Cost: 20 and 27 take four to eight times the dofs of 8.
    symmetry : {"full", "half", "quarter"}
        "half" is y >= 0, "quarter" x, y >= 0. Cost: each mirror plane halves the dofs.

    Raises
    ------
    InputError
        With all errors, one per line.
    """

    radius: float = in_mm(5.0)
    block: float = in_mm(10.0)
    patch: float = in_mm(1.0)
    divisions: int = whole(40, 2, even=True, why="the symmetry planes need nodes on them")
    growth: float = ratio(1.4, 1.05, 2.0)
    core_depth: float = ratio(0.4)
    element_nodes: int = choice(8, 8, 20, 27)
    symmetry: Literal["full", "half", "quarter"] = choice("full", "full", "half", "quarter")

    def __post_init__(self) -> None:
        require(field_faults(self))
        require(_misfits(self))

    @property
    def size(self) -> float:
        """Edge of the squares of the patch lattice, mm."""
        return self.patch / self.divisions

    @property
    def depth(self) -> float:
        """Depth of the core on the axis, mm."""
        return self.core_depth * self.patch


def _misfits(p: SphereBlock) -> list[str]:
    """Errors of the lengths against each other."""
    problems = []
    largest = _STEEPEST * math.sqrt(2.0) * p.radius
    if p.patch > largest:
        problems.append(
            f"patch: {p.patch:g} mm is too large for the sphere; at most {largest:g} mm"
        )
    if p.patch > 0.8 * p.block:
        problems.append(
            f"patch: {p.patch:g} mm is too large for the block; at most {0.8 * p.block:g} mm"
        )
    deepest = 0.8 * min(p.radius, p.block)
    if p.depth > deepest:
        problems.append(
            f"core_depth: {p.core_depth:g} patches, {p.depth:g} mm, reach through a body; "
            f"at most {deepest / p.patch:g}"
        )
    corner = sagitta(p.patch / math.sqrt(2.0), p.radius) if p.patch <= largest else 0.0
    if p.depth < 1.5 * corner:
        problems.append(
            f"core_depth: {p.core_depth:g} patches are too shallow for a patch this "
            f"curved; at least {1.5 * corner / p.patch:g}"
        )
    return problems


def sagitta(distance: float | FloatArray, radius: float) -> float | FloatArray:
    """Height of the sphere over its tangent plane; this form does not cancel near the axis.

    Parameters
    ----------
    distance : float or ndarray
        From the axis, mm.
    radius : float
        mm.

    Returns
    -------
    float or ndarray
        mm.
    """
    squared = np.square(distance)
    height: float | FloatArray = squared / (radius + np.sqrt(radius**2 - squared))
    return height


@dataclass(frozen=True)
class _Frame:
    """Corners, arcs and element counts of one body's quarter, z pointing into the body.

    Corners are name -> x, y, z: A patch, B core's far side, C rim of the contact surface, D far
    face; the digits are the signs of x and y.
    """

    corners: dict[str, tuple[float, float, float]]
    round_surface: bool
    layers: int
    layer_ratio: float
    radial: int


def _block_frame(p: SphereBlock) -> _Frame:
    a, b = p.patch / 2.0, p.block / 2.0
    return _frame(p, 0.0, a, {"C": (b, b, 0.0), "D": (b, b, p.block)}, b - a, round_surface=False)


def _sphere_frame(p: SphereBlock) -> _Frame:
    a, r = p.patch / 2.0, p.radius
    # the square in the flat face: clear of the rim, no smaller than the patch demands
    inner = 0.4 * r + 0.3 * a
    diagonal = r / math.sqrt(2.0)
    return _frame(
        p,
        r,
        a,
        {"C": (r, diagonal, r), "D": (inner, inner, r)},
        r * (math.pi / 2.0 - math.asin(a / r)),
        round_surface=True,
    )


def _frame(
    p: SphereBlock,
    radius: float,
    a: float,
    outer: dict[str, tuple[float, float, float]],
    surface_length: float,
    *,
    round_surface: bool,
) -> _Frame:
    def base(x: float, y: float) -> float:
        return float(sagitta(math.hypot(x, y), radius)) if round_surface else 0.0

    corners = {}
    for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)):
        corners[f"A{i}{j}"] = (a * i, a * j, base(a * i, a * j))
        corners[f"B{i}{j}"] = (a * i, a * j, p.depth)
        for letter, (straight, diagonal, z) in outer.items():
            reach = diagonal if i and j else straight
            corners[f"{letter}{i}{j}"] = (reach * i, reach * j, z)
    layers, radial = _counts(p, surface_length)
    return _Frame(corners, round_surface, layers, ratio_for(p.depth, p.size, layers), radial)


def _counts(p: SphereBlock, surface_length: float) -> tuple[int, int]:
    """Elements over the core's depth and from the patch edge to the rim."""
    return count_for(p.depth, p.size, p.growth), count_for(surface_length, p.size, p.growth)


def build(params: SphereBlock) -> dict[str, Mesh]:
    """Meshes of the bodies "sphere" and "block".

    Node sets: contact (lattice order: x slowest, y fastest; the same x, y in both bodies), distant
    (sphere z = R, block z = -block), axis (x = y = 0, from the contact inwards), plane_x and
    plane_y where the model is cut. Faces: contact, distant.

    Parameters
    ----------
    params : SphereBlock

    Returns
    -------
    dict of str to Mesh
        Coordinates in mm.

    Raises
    ------
    MeshError
        When gmsh fails.
    """
    sphere = _ordered(_whole(_quarter(params, _sphere_frame(params), "sphere"), params))
    block = _ordered(
        flipped(_whole(_quarter(params, _block_frame(params), "block"), params), axis=2)
    )
    return {"sphere": sphere, "block": block}


def _whole(mesh: Mesh, params: SphereBlock) -> Mesh:
    for axis in {"quarter": (), "half": (0,), "full": (0, 1)}[params.symmetry]:
        mesh = mirrored(mesh, axis)
    return mesh


def _ordered(mesh: Mesh) -> Mesh:
    """The same mesh with its node sets in the order promised by `build`."""
    contact, axis = mesh.nodes["contact"], mesh.nodes["axis"]
    x, y, _ = mesh.points[contact].T
    depth = np.abs(mesh.points[axis, 2])
    nodes = {**mesh.nodes, "contact": contact[np.lexsort((y, x))], "axis": axis[np.argsort(depth)]}
    return Mesh(mesh.points, mesh.hexes, mesh.faces, nodes)


def _quarter(params: SphereBlock, frame: _Frame, name: str) -> Mesh:
    """Quarter x, y >= 0 of one body, z pointing into the body."""
    with session(name) as gmsh:
        blocks = Blocks(gmsh)
        _define(blocks, params, frame)
        points, grids = blocks.mesh(params.element_nodes)
    points = _bent(points, grids, params, frame)
    plane_x = np.concatenate([grids[b].layer(0, 0).ravel() for b in ("core", "side_y", "cap")])
    plane_y = np.concatenate([grids[b].layer(1, 0).ravel() for b in ("core", "side_x", "cap")])
    plane_x, plane_y = _present(plane_x), _present(plane_y)
    points[plane_x, 0] = 0.0
    points[plane_y, 1] = 0.0
    far = {"block": ("cap",), "sphere": ("cap", "side_x", "side_y")}[name]
    sides = {"cap": (2, 1), "side_x": (0, 1), "side_y": (1, 1)}
    distant = np.vstack([grids[b].faces(*sides[b]) for b in far])
    points[distant, 2] = frame.corners["D00"][2]
    return Mesh(
        points=points,
        hexes=np.vstack([grid.hexes() for grid in grids.values()]),
        faces={"contact": grids["core"].faces(2, 0), "distant": distant},
        nodes={
            "contact": _present(grids["core"].layer(2, 0)),
            "distant": np.unique(distant),
            "axis": np.intersect1d(plane_x, plane_y),
            "plane_x": plane_x,
            "plane_y": plane_y,
        },
    )


def _present(nodes: IntArray) -> IntArray:
    return np.unique(nodes[nodes >= 0])


def _define(blocks: Blocks, p: SphereBlock, frame: _Frame) -> None:
    """Corners, edges and the four blocks of a quarter: core, side_x, side_y, cap."""
    at = {name: np.array(position) for name, position in frame.corners.items()}
    for name, position in at.items():
        if name != "C00":
            blocks.point(name, position)
    centre = None
    if frame.round_surface:
        centre = "centre"
        blocks.point(centre, (0.0, 0.0, p.radius))
    half = p.divisions // 2
    for letter in "ABD":
        for start, end in (("00", "10"), ("01", "11"), ("00", "01"), ("10", "11")):
            blocks.curve(letter + start, letter + end, half)
    for start in ("10", "01"):
        blocks.curve(f"C{start}", "C11", half, centre=centre)
    for column in ("00", "10", "11", "01"):
        blocks.curve(f"A{column}", f"B{column}", frame.layers, ratio=frame.layer_ratio)
        # towards the far face the elements start as thick as the core's last layer
        first = p.size * frame.layer_ratio ** (frame.layers - 1)
        length = float(np.linalg.norm(at[f"D{column}"] - at[f"B{column}"]))
        blocks.curve(
            f"B{column}", f"D{column}", frame.radial, ratio=ratio_for(length, first, frame.radial)
        )
        if column == "00":
            continue
        blocks.curve(f"C{column}", f"D{column}", frame.layers, ratio=frame.layer_ratio)
        length = float(np.linalg.norm(at[f"C{column}"] - at[f"A{column}"])) * (
            math.pi / math.sqrt(8.0) if frame.round_surface else 1.0
        )
        blocks.curve(
            f"A{column}",
            f"C{column}",
            frame.radial,
            ratio=ratio_for(length, p.size, frame.radial),
            centre=centre,
        )
    blocks.volume("core", ["A00", "A10", "A11", "A01", "B00", "B10", "B11", "B01"])
    blocks.volume("side_x", ["A10", "C10", "C11", "A11", "B10", "D10", "D11", "B11"])
    blocks.volume("side_y", ["A01", "A11", "C11", "C01", "B01", "B11", "D11", "D01"])
    blocks.volume("cap", ["B00", "B10", "B11", "B01", "D00", "D10", "D11", "D01"])


def _bent(points: FloatArray, grids: dict[str, Grid], p: SphereBlock, frame: _Frame) -> FloatArray:
    """Contact surface moved onto the exact lattice and the exact sphere.

    The shift fades linearly with depth through core and sides.
    """
    step = grids["core"].step
    level = graded(frame.layers, frame.layer_ratio)
    if step == 2:
        level = np.sort(np.concatenate([level, (level[1:] + level[:-1]) / 2.0]))
    shift = _surface(points, grids, p, frame) - points
    out = points.copy()
    for name in ("core", "side_x", "side_y"):
        nodes = grids[name].nodes
        base = np.broadcast_to(grids[name].layer(2, 0)[:, :, None], nodes.shape)
        fade = np.broadcast_to(1.0 - level, nodes.shape)
        # every node stands over one of the surface: a 20-node element lacks the same columns on
        # every level
        known = nodes >= 0
        out[nodes[known]] = points[nodes[known]] + fade[known][:, None] * shift[base[known]]
    return out


def _surface(
    points: FloatArray, grids: dict[str, Grid], p: SphereBlock, frame: _Frame
) -> FloatArray:
    """Points with those of the contact surface where they belong.

    The patch on its lattice, the rest on the sphere or on z = 0.
    """
    patch = grids["core"].layer(2, 0)
    line = np.arange(patch.shape[0]) * (p.size / grids["core"].step)
    x, y = np.meshgrid(line, line, indexing="ij")
    z = sagitta(np.hypot(x, y), p.radius) if frame.round_surface else np.zeros_like(x)
    out = points.copy()
    out[patch[patch >= 0]] = np.stack([x, y, z], axis=-1)[patch >= 0]
    for radial_axis, name in enumerate(("side_x", "side_y")):
        rings = np.moveaxis(grids[name].layer(2, 0), radial_axis, 0)
        outside = rings >= 0
        outside[0] = False
        near = _on_surface(points[np.where(rings >= 0, rings, rings[0, 0])], p, frame)
        # the patch edge moves sideways to its lattice: spread that over all rings, else the first
        # one is crushed
        fade = np.linspace(1.0, 0.0, len(rings))[:, None, None]
        moved = _on_surface(near + fade * (out[rings[0]] - near[0]), p, frame)
        out[rings[outside]] = moved[outside]
    return out


def _on_surface(points: FloatArray, p: SphereBlock, frame: _Frame) -> FloatArray:
    """Points (..., 3) carried to the contact surface.

    Along the radius onto the sphere, or down to z = 0.
    """
    if not frame.round_surface:
        flat: FloatArray = points * np.array([1.0, 1.0, 0.0])
        return flat
    centre = np.array([0.0, 0.0, p.radius])
    arm = points - centre
    on_sphere: FloatArray = centre + arm * (p.radius / np.linalg.norm(arm, axis=-1, keepdims=True))
    return on_sphere


def count(params: SphereBlock) -> dict[str, dict[str, int]]:
    """Exact numbers of nodes and elements of each body, without meshing.

    Parameters
    ----------
    params : SphereBlock

    Returns
    -------
    dict of str to dict
        Body -> "nodes", "hexes" and "contact" (nodes).
    """
    frames = {"sphere": _sphere_frame(params), "block": _block_frame(params)}
    return {name: _count(params, frame.layers, frame.radial) for name, frame in frames.items()}


def _count(p: SphereBlock, layers: int, radial: int) -> dict[str, int]:
    nx = p.divisions if p.symmetry != "quarter" else p.divisions // 2
    ny = p.divisions if p.symmetry == "full" else p.divisions // 2
    # elements along that part of the patch edge under the side blocks; it closes on itself in
    # the full model only
    rim = {"full": 2 * (nx + ny), "half": nx + 2 * ny, "quarter": nx + ny}[p.symmetry]
    cut = {"full": 0, "half": nx, "quarter": nx + ny}[p.symmetry]
    ends = {"full": 0, "half": 2, "quarter": 2}[p.symmetry]
    hexes = nx * ny * (layers + radial) + rim * layers * radial
    r = 1 if p.element_nodes == 8 else 2
    patch = (r * nx + 1) * (r * ny + 1)
    edge = r * rim + (1 if p.symmetry != "full" else 0)
    nodes = (r * layers + 1) * (patch + r * radial * edge) + r * radial * (patch - edge)
    if p.element_nodes == 20:
        boundary = (
            2 * nx * ny + rim * (radial + layers) + cut * (layers + radial) + ends * layers * radial
        )
        nodes -= (6 * hexes + boundary) // 2 + hexes
        patch -= nx * ny
    return {"nodes": nodes, "hexes": hexes, "contact": patch}
