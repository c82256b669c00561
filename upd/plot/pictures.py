"""Pictures of bodies: mode shapes, meshes with their contacts.

Parallel projection, the farthest faces first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch as LegendPatch
from numpy.typing import NDArray

from upd.mesh import FloatArray, IntArray, Mesh
from upd.mesh.hexmesh import boundary_faces
from upd.plot.matplotlib import Drawing, draw_sheet
from upd.plot.style import COLOURS
from upd.plot.surface import SCALE

#: degrees by which two faces turn where the outline has a line
_OUTLINE_ANGLE = 30.0
_STILL = (0.83, 0.83, 0.83)
_OUTLINE, _CONTACT = "#8a8a8a", "#f0b400"
# rounding of the product of two unit vectors: a side seen from its edge is not drawn
_EDGE_ON = 16.0 * np.finfo(np.float64).eps
# part of a colour that does not depend on the light
_AMBIENT = 0.65
#: white mixed to colours: of displacements, whose dark end keeps its shades; of bodies, so that the
#: lines of their meshes show
_PALE, _PALE_BODY = 0.12, 0.45
#: gap between bodies drawn apart, as a part of the smaller one's height
_APART = 0.5
#: azimuth and elevation of the viewer in degrees: of modes; of meshes and near a contact
_VIEW, _AZIMUTH, _LOW, _STEEP = (-60.0, 20.0), -60.0, 22.0, 38.0
#: width in points and opacity of the lines of a mesh, and what is shown around, as a part of its
#: size: of whole bodies, and near a contact
_FAR, _NEAR = (0.15, 0.45, 0.02), (0.35, 0.8, 0.25)


# ---------------------------------------------------------------- mode shapes


def draw_mode(
    meshes: Mapping[str, Mesh],
    shapes: Mapping[str, FloatArray],
    ax: Axes,
    *,
    title: str = "",
    view: tuple[float, float] = _VIEW,
) -> Axes:
    """Deformed surface of the bodies, coloured by displacement, over the outline at rest.

    Parameters
    ----------
    shapes
        Body -> (n_node, 3) real displacements in any unit; all are drawn to one scale, the
        largest at 8 % of the bodies' size. Bodies without one stay at rest, in grey.
    view
        Azimuth and elevation of the viewer in degrees, about z.
    """
    axes = _view_axes(*view)
    points, faces, body = _together(meshes)
    u = np.vstack([shapes.get(name, np.zeros((m.n_node, 3))) for name, m in meshes.items()])
    moving = np.array([name in shapes for name in meshes])[body]
    length, size = np.linalg.norm(u, axis=1), float(np.linalg.norm(np.ptp(points, axis=0)))
    # nothing moves: any divisor will do
    largest = float(length.max()) or 1.0
    level = length[faces].mean(axis=1) / largest
    colours = np.where(
        moving[:, None], _PALE + (1.0 - _PALE) * colormaps["viridis"](level)[:, :3], _STILL
    )
    ax.add_collection(_outline(points, faces, axes), autolim=False)
    ax.add_collection(
        _shaded_sides(points + SCALE * size / largest * u, faces, colours, axes), autolim=False
    )
    # around all points at rest: pictures side by side have one scale
    _frame_axes(ax, points @ axes[:2].T, SCALE * size, title)
    return ax


def _together(meshes: Mapping[str, Mesh]) -> tuple[FloatArray, IntArray, IntArray]:
    """Points (n, 3) of all bodies, their boundary (n_face, 4), and the number of each side's body
    (n_face,).
    """
    points = np.vstack([mesh.points for mesh in meshes.values()])
    first = np.concatenate([[0], np.cumsum([mesh.n_node for mesh in meshes.values()])])
    pairs = zip(meshes.values(), first, strict=False)
    quads = [boundary_faces(mesh)[:, :4] + start for mesh, start in pairs]
    return points, np.vstack(quads), np.repeat(np.arange(len(quads)), [len(q) for q in quads])


# ---------------------------------------------------------------- meshes


def draw_meshes(meshes: Mapping[str, Mesh], title: str = "") -> Figure:
    """Surfaces of the bodies with the lines of their elements, the contact faces in a colour.

    First all bodies, drawn apart where one lies on others; then the contact faces that look up, and
    those that look down as one sees them from below, each with what lies near them.
    """
    draw = partial(_draw_bodies, among=list(meshes))
    drawings: list[Drawing] = [
        partial(draw, meshes=_apart(meshes), title=title, elevation=_LOW, near=False)
    ]
    for up, side in ((True, "from above"), (False, "from below")):
        seen = {name: mesh for name, mesh in meshes.items() if _looks(mesh) == up}
        if seen:
            about = f"contact of {' and '.join(seen)}, {side}"
            elevation = _STEEP if up else -_STEEP
            drawings.append(partial(draw, meshes=seen, title=about, elevation=elevation, near=True))
    return draw_sheet(drawings, 3, size=(5.4, 5.2))


def _looks(mesh: Mesh) -> bool | None:
    """Whether the contact on the body's surface looks up; None when it has none."""
    sides = boundary_faces(mesh)[:, :4]
    a, b, c, d = (mesh.points[sides[_touching(mesh)[sides].all(axis=1)][:, k]] for k in range(4))
    return bool(np.cross(c - a, d - b)[:, 2].sum() > 0.0) if len(a) else None


def _touching(mesh: Mesh) -> NDArray[np.bool_]:
    """Which nodes belong to faces that touch another body, (n_node,)."""
    out = np.zeros(mesh.n_node, dtype=bool)
    for name, faces in mesh.faces.items():
        if name == "contact" or name.startswith("contact_") or name.endswith("patch"):
            out[faces] = True
    return out


def _apart(meshes: Mapping[str, Mesh]) -> dict[str, Mesh]:
    """The bodies moved along z off those they touch: the first of two up, a third one down."""
    if len(meshes) not in (2, 3) or not all(_touching(m).any() for m in meshes.values()):
        return dict(meshes)
    bodies = list(meshes)
    heights = [float(np.ptp(mesh.points[:, 2])) for mesh in meshes.values()]
    if len(bodies) == 3:
        shift = {bodies[2]: -(1.0 + _APART) * heights[2]}
    elif all("contact" in mesh.nodes for mesh in meshes.values()):
        shift = {bodies[0]: (_APART + 0.5) * min(heights)}
    else:
        shift = {}
    return {
        name: mesh.with_points(mesh.points + np.array([0.0, 0.0, shift.get(name, 0.0)]))
        for name, mesh in meshes.items()
    }


def _draw_bodies(
    ax: Axes,
    *,
    meshes: Mapping[str, Mesh],
    among: Sequence[str],
    title: str,
    elevation: float,
    near: bool,
) -> None:
    """Bodies, ``among`` others: with a legend, or what lies near their contact."""
    axes = _view_axes(_AZIMUTH, elevation)
    points, sides, body = _together(meshes)
    nodes = np.concatenate([_touching(mesh) for mesh in meshes.values()])
    touched: NDArray[np.bool_] = np.all(nodes[sides], axis=1)
    shades = np.array([_shade(among.index(name)) for name in meshes])
    colours = np.where(touched[:, None], to_rgb(_CONTACT), shades[body])
    surface = _shaded_sides(points, sides, colours, axes)
    line, opacity, around = _NEAR if near else _FAR
    surface.set(linewidths=line, edgecolors=(0.1, 0.1, 0.1, opacity))
    ax.add_collection(surface)
    framed = (points @ axes[:2].T)[np.unique(sides[touched] if near else sides)]
    _frame_axes(ax, framed, around * float(np.ptp(framed, axis=0).max()), title)
    if near:
        return
    handles = [LegendPatch(color=to_hex(_shade(k)), label=name) for k, name in enumerate(meshes)]
    if touched.any():
        handles.append(LegendPatch(color=_CONTACT, label="contact faces"))
    ax.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4, frameon=False
    )


def _shade(k: int) -> tuple[float, float, float]:
    r, g, b = (_PALE_BODY + (1.0 - _PALE_BODY) * c for c in to_rgb(COLOURS[k % len(COLOURS)]))
    return r, g, b


# ---------------------------------------------------------------- the painter


def _view_axes(azimuth: float, elevation: float) -> FloatArray:
    """(3, 3) unit vectors to the right, upwards and to the viewer, as rows."""
    a, e = np.radians(azimuth), np.radians(elevation)
    right = [-np.sin(a), np.cos(a), 0.0]
    upwards = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
    return np.array([right, upwards, [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]])


def _normals(points: FloatArray, quads: IntArray) -> FloatArray:
    """Outward unit normals, (n, 3); zero where a quadrilateral has no area."""
    a, b, c, d = (points[quads[:, k]] for k in range(4))
    n = np.cross(c - a, d - b)
    length = np.linalg.norm(n, axis=1, keepdims=True)
    out: FloatArray = np.divide(n, length, out=np.zeros_like(n), where=length > 0.0)
    return out


def _shaded_sides(
    points: FloatArray, quads: IntArray, colours: NDArray[Any], axes: FloatArray
) -> PolyCollection:
    """The sides that face the viewer, the farthest first (painter's algorithm)."""
    n = _normals(points, quads)
    seen = np.flatnonzero(n @ axes[2] > _EDGE_ON)
    seen = seen[np.argsort(points[quads[seen]].mean(axis=1) @ axes[2], kind="stable")]
    # light over the viewer's left shoulder
    light = np.array([-0.45, 0.55, 0.7]) @ axes
    shade = _AMBIENT + (1.0 - _AMBIENT) * np.clip(n[seen] @ light / np.linalg.norm(light), 0.0, 1.0)
    face = colours[seen] * shade[:, None]
    return PolyCollection(
        list((points @ axes[:2].T)[quads[seen]]),
        facecolors=face,
        edgecolors=0.8 * face + 0.08,
        linewidths=0.25,
        zorder=2,
    )


def _outline(points: FloatArray, quads: IntArray, axes: FloatArray) -> LineCollection:
    """Sharp edges of sides that face the viewer."""
    n = _normals(points, quads)
    ends = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, which, count = np.unique(
        ends[:, 0] * len(points) + ends[:, 1], return_inverse=True, return_counts=True
    )
    owner = np.repeat(np.arange(len(quads)), 4)
    total = np.stack([np.bincount(which, n[owner, k], len(edges)) for k in range(3)], axis=1)
    # two unit normals that turn by an angle t have a sum of squared length 2 + 2 cos t
    sharp = np.sum(total**2, axis=1) < 2.0 + 2.0 * np.cos(np.radians(_OUTLINE_ANGLE))
    seen = np.bincount(which, n[owner] @ axes[2] > _EDGE_ON, len(edges)) > 0
    drawn = edges[(sharp | (count != 2)) & seen]
    lines = (points @ axes[:2].T)[np.stack([drawn // len(points), drawn % len(points)], axis=1)]
    return LineCollection(list(lines), colors=_OUTLINE, linewidths=0.6, zorder=1)


def _frame_axes(ax: Axes, flat: FloatArray, margin: float, title: str) -> None:
    """Limits around points (n, 2) of a picture, without axes."""
    low, high = flat.min(axis=0) - margin, flat.max(axis=0) + margin
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    ax.set_title(title, fontsize=11)
    ax.set_aspect("equal")
    ax.set_axis_off()
