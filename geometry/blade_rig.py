"""Two blades (shank, platform, core) on clamped bases, with or without the damper between them.

All hexahedra. Dimensions by default are a reconstruction, not a drawing: tuned so that the
default mesh shows the natural frequencies published for the rig (free 294.88, 295.19, 783.88,
784.94 Hz; damper glued 446.60, 463.92, 783.97, 1030.10 Hz; steel, E = 200 GPa, 7800 kg/m3).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from geometry.blade_rig_damper import damper_sizes
from geometry.blade_rig_layout import (
    SIDES,
    BladePatch,
    Side,
    bilinear,
    blade,
    blade_patch,
    damper,
    damper_patch,
    y_lines,
)
from geometry.blade_rig_params import BladeRig, rounded
from geometry.blocks import Blocks, session
from geometry.blocks.extruded import Cell, Layout, Part
from geometry.blocks.hexahedron import Grid, mirrored
from upd.mesh import FloatArray, IntArray, Mesh

__all__ = [
    "ANALYSIS",
    "OTHER_ANALYSES",
    "REGIONS",
    "BladeRig",
    "build",
    "count",
    "damper_sizes",
    "regions",
]

#: what this geometry is for
ANALYSIS = "rig"
#: what it is for as well, when the scene asks for it
OTHER_ANALYSES = ("forced response", "seated damper")
#: parts of the body "rig" by region number
REGIONS = ("left", "right", "damper")

#: side of the base that is held -> (axis, ends)
_HELD = {"y_faces": (1, (1,)), "x_faces": (0, (0, 1)), "bottom": (2, (0,))}


def build(params: BladeRig) -> dict[str, Mesh]:
    """Meshes of the blades and the damper.

    Bodies "left" and "right", and "damper" when it is free; or the one body "rig" when it is glued.
    Node sets of a blade: clamped, patch (lattice order: y slowest, then up the slope), force,
    accelerometer (one node each, at y = 0 on the core's outer face), stem (all but the platform's
    sides, with the nodes where these join it), plane_y when half. Faces:
    clamped, patch (outward; in "rig" those of the platforms). A free damper has left_patch and
    right_patch, whose k-th nodes and coordinates are those of the blades' patches. In "rig" the
    names are left_patch, right_force and so on; clamped is the union, and the sets left, right,
    damper hold all nodes of these parts (see `regions`).

    Parameters
    ----------
    params : BladeRig

    Returns
    -------
    dict of str to Mesh
        Coordinates in mm.

    Raises
    ------
    MeshError
        When gmsh fails.
    """
    params = rounded(params)
    if params.damper == "glued":
        return {"rig": _mesh(params, "rig", _layout(params, SIDES, "glued"), SIDES)}
    meshes: dict[str, Mesh] = {
        side: _mesh(params, side, _layout(params, (side,)), (side,)) for side in SIDES
    }
    if params.damper == "free":
        meshes["damper"] = _mesh(params, "damper", _damper_alone(params), ())
    return meshes


def regions(mesh: Mesh) -> IntArray:
    """Region number (see `REGIONS`) of every hexahedron of the body "rig".

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    (n_hex,) array of int
    """
    number = np.full(mesh.n_hex, -1, dtype=np.int64)
    for k, name in enumerate(REGIONS):
        inside = np.zeros(mesh.n_node, dtype=bool)
        inside[mesh.nodes[name]] = True
        number[inside[mesh.hexes].all(axis=1)] = k
    return number


def count(params: BladeRig) -> dict[str, dict[str, int]]:
    """Exact numbers of nodes and elements of each body, without meshing.

    Parameters
    ----------
    params : BladeRig

    Returns
    -------
    dict of str to dict
        Body -> "nodes", "hexes" and "contact" (nodes of its patches).
    """
    params = rounded(params)
    if params.damper == "glued":
        return {"rig": _count(params, _layout(params, SIDES, "glued"), SIDES)}
    counts: dict[str, dict[str, int]] = {
        side: _count(params, _layout(params, (side,)), (side,)) for side in SIDES
    }
    if params.damper == "free":
        patches = sum(counts[side]["contact"] for side in SIDES)
        counts["damper"] = {**_count(params, _damper_alone(params), ()), "contact": patches}
    return counts


def _layout(p: BladeRig, sides: Iterable[Side], with_damper: str = "none") -> Layout:
    layout = Layout(y_lines(p))
    for side in sides:
        blade(p, layout, side)
    if with_damper != "none":
        damper(p, layout, glued=with_damper == "glued")
    return layout


def _damper_alone(p: BladeRig) -> Layout:
    layout = _layout(p, SIDES, "free")
    return Layout(
        layout.lines,
        layout.corners,
        [part for part in layout.parts if part.name.startswith("damper")],
    )


def _count(p: BladeRig, layout: Layout, sides: Iterable[Side]) -> dict[str, int]:
    nodes, hexes = layout.count(p.element_nodes, mirrored=p.symmetry == "full")
    return {
        "nodes": nodes,
        "hexes": hexes,
        "contact": sum(_patch_nodes(p, layout, blade_patch(p, layout, side)) for side in sides),
    }


def _patch_nodes(p: BladeRig, layout: Layout, patch: BladePatch) -> int:
    """Nodes of one patch: a lattice, its line y = 0 counted once; pads are two lattices."""
    r = 1 if p.element_nodes == 8 else 2
    cells = list(_cells(layout, patch))
    along = layout.divisions(*cells[0])[2 - patch.axis]
    ny = sum(layout.divisions(*cell)[1] for cell in cells)
    half = (r * along + 1) * (r * ny + 1) - (along * ny if p.element_nodes == 20 else 0)
    if p.symmetry == "half":
        return half
    return 2 * half - (r * along + 1 if patch.line == "y0" else 0)


def _cells(layout: Layout, patch: BladePatch) -> Iterator[tuple[Part, Cell]]:
    """Blocks of a patch, in the order of y."""
    part = next(q for q in layout.parts if q.name == patch.part)
    for k in range(part.lines.index(patch.line), part.lines.index(patch.last)):
        yield part, (patch.column, patch.row, k)


def _mesh(p: BladeRig, name: str, layout: Layout, sides: tuple[Side, ...]) -> Mesh:
    """One body: the half y >= 0 from gmsh, its sets, then its mirror image."""
    with session(name) as gmsh:
        blocks = Blocks(gmsh)
        layout.define(blocks)
        points, grids = blocks.mesh(p.element_nodes)
    prefix = {side: "" if name == side else f"{side}_" for side in SIDES}
    where = {f"{prefix[side]}patch": blade_patch(p, layout, side) for side in sides}
    if name == "damper":
        where = {f"{side}_patch": damper_patch(p, side) for side in SIDES}
    faces: dict[str, IntArray] = {}
    nodes: dict[str, IntArray] = {}
    for key, patch in where.items():
        _straighten(points, layout, grids, patch)
        faces[key] = np.vstack(
            [
                _grid(grids, part, cell).faces(patch.axis, patch.end)
                for part, cell in _cells(layout, patch)
            ]
        )
    for side in sides:
        faces[f"{prefix[side]}clamped"] = _held(p, layout, grids, side)
        nodes |= {f"{prefix[side]}{key}": found for key, found in _probes(grids, side).items()}
        nodes[f"{prefix[side]}stem"] = _stem(layout, grids, side)
    nodes |= {key: np.unique(found) for key, found in faces.items()}
    if name == "rig":
        faces["clamped"] = np.vstack([faces[f"{side}_clamped"] for side in SIDES])
        nodes |= {"clamped": np.unique(faces["clamped"]), **_parts(grids)}
    nodes["plane_y"] = _plane(layout, grids)
    points[nodes["plane_y"], 1] = 0.0
    mesh = Mesh(points, np.vstack([grid.hexes() for grid in grids.values()]), faces, nodes)
    return _ordered(mirrored(mesh, 1) if p.symmetry == "full" else mesh)


def _grid(grids: Mapping[str, Grid], part: Part, cell: Cell) -> Grid:
    return grids["/".join(map(str, (part.name, *cell)))]


def _straighten(
    points: FloatArray, layout: Layout, grids: Mapping[str, Grid], patch: BladePatch
) -> None:
    """Nodes of a patch moved onto the exact lattice (by rounding only).

    So every body has the same coordinates there.
    """
    for part, (i, j, k) in _cells(layout, patch):
        c = part.corners
        ends = (
            [c[i + patch.end][j], c[i + patch.end][j + 1]]
            if patch.axis == 0
            else [c[i][j + patch.end], c[i + 1][j + patch.end]]
        )
        # from the lower end upwards, whichever way the part runs
        lines = (part.lines[k], part.lines[k + 1])
        layer = _grid(grids, part, (i, j, k)).layer(patch.axis, patch.end)
        layer = layer.T if patch.axis == 0 else layer
        if layout.corners[ends[0]].z > layout.corners[ends[1]].z:
            ends, layer = ends[::-1], layer[::-1]
        corners = np.array([[layout.position(end, line) for line in lines] for end in ends])
        known = layer >= 0
        points[layer[known]] = bilinear(corners, layer.shape)[known]


def _held(p: BladeRig, layout: Layout, grids: Mapping[str, Grid], side: Side) -> IntArray:
    axis, ends = _HELD[p.clamped]
    base = next(part for part in layout.parts if part.name == f"{side}.base")
    found = []
    for end in ends:
        outermost = (
            (len(base.columns) - 1, len(base.lines) - 2, len(base.rows) - 1)[axis] if end else 0
        )
        place = (0, 2, 1)[axis]
        found += [
            _grid(grids, base, cell).faces(axis, end)
            for cell in base.cells()
            if cell[place] == outermost
        ]
    return np.vstack(found)


def _probes(grids: Mapping[str, Grid], side: Side) -> dict[str, IntArray]:
    """The nodes at the force and the accelerometer.

    Ends of the core's first two rows, at y = 0 on the outer face.
    """
    outer = 0 if side == "left" else -1
    rows = {"force": 0, "accelerometer": 1}
    return {
        key: grids[f"{side}.core/0/{row}/0"].nodes[outer, 0, -1].reshape(1)
        for key, row in rows.items()
    }


def _stem(layout: Layout, grids: Mapping[str, Grid], side: Side) -> IntArray:
    """All nodes of a blade but those of its platform's sides beyond shank and core."""
    platform = next(part for part in layout.parts if part.name == f"{side}.platform")
    # the platform's column between shank and core starts at their left side
    middle = [column[0].split(":")[1] for column in platform.corners].index("l")
    found = [
        _grid(grids, part, cell).nodes.ravel()
        for part in layout.parts
        if part.name.startswith(f"{side}.")
        for cell in part.cells()
        if part is not platform or cell[0] == middle
    ]
    nodes = np.unique(np.concatenate(found))
    return nodes[nodes >= 0]


def _parts(grids: Mapping[str, Grid]) -> dict[str, IntArray]:
    found = {}
    for name in REGIONS:
        nodes = np.unique(
            np.concatenate(
                [grid.nodes.ravel() for key, grid in grids.items() if key.startswith(f"{name}.")]
            )
        )
        found[name] = nodes[nodes >= 0]
    return found


def _plane(layout: Layout, grids: Mapping[str, Grid]) -> IntArray:
    sides = [
        _grid(grids, part, cell).layer(1, 0)
        for part in layout.parts
        for cell in part.cells()
        if part.lines[cell[2]] == "y0"
    ]
    nodes = np.unique(np.concatenate([side.ravel() for side in sides]))
    return nodes[nodes >= 0]


def _ordered(mesh: Mesh) -> Mesh:
    """The same mesh with its patch nodes in the order promised by `build`."""
    nodes = dict(mesh.nodes)
    for key in nodes:
        if key.endswith("patch"):
            _, y, z = mesh.points[nodes[key]].T
            nodes[key] = nodes[key][np.lexsort((z, y))]
    return Mesh(mesh.points, mesh.hexes, mesh.faces, nodes)
