"""A picture of the meshes of a recipe: all bodies drawn apart, and their contact faces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch as LegendPatch
from numpy.typing import NDArray

from upd.mesh import IntArray, Mesh
from upd.mesh.hexmesh import boundary_quads, outward_area
from upd.plot.modes import frame_axes, shaded_sides, view_axes
from upd.plot.sheet import Drawing, draw_sheet
from upd.plot.style import COLOURS

#: white mixed to the colours of the bodies, so that the lines of the mesh show
_PALE = 0.45
_CONTACT = "#f0b400"
#: gap between bodies drawn apart, as a part of the smaller one's height
_APART = 0.5
#: what is shown around the contact, as a part of its size
_AROUND = 0.25
_AZIMUTH, _ELEVATION, _STEEP = -60.0, 22.0, 38.0
#: width in points and opacity of the lines of the mesh: of whole bodies, and near a contact
_FAR_LINES, _NEAR_LINES = (0.15, 0.45), (0.35, 0.8)


def draw_meshes(meshes: Mapping[str, Mesh], title: str = "") -> Figure:
    """Surfaces of the bodies with the lines of their elements, the contact faces in a colour.

    First all bodies, drawn apart where one lies on others; then the contact faces that look up, and
    those that look down as one sees them from below, each with what lies near them.
    """
    drawings: list[Drawing] = [partial(_draw, meshes=_apart(meshes), title=title, lines=_FAR_LINES)]
    for up, side in ((True, "from above"), (False, "from below")):
        seen = {name: mesh for name, mesh in meshes.items() if _looks(mesh) == up}
        if seen:
            drawings.append(
                partial(
                    _draw,
                    meshes=seen,
                    title=f"contact of {' and '.join(seen)}, {side}",
                    lines=_NEAR_LINES,
                    elevation=_STEEP if up else -_STEEP,
                    among=list(meshes),
                )
            )
    return draw_sheet(drawings, 3, size=(5.4, 5.2))


def _looks(mesh: Mesh) -> bool | None:
    """Whether the contact faces on the body's surface look up; None when it has none."""
    outer = _keys(boundary_quads(mesh))
    found = [
        faces[np.isin(_keys(faces[:, :4]), outer)]
        for name, faces in mesh.faces.items()
        if is_contact(name)
    ]
    faces = np.vstack(found) if found else np.empty((0, 4), np.int64)
    return bool(outward_area(mesh, faces, "picture")[2] > 0.0) if len(faces) else None


def _keys(quads: IntArray) -> NDArray[np.void]:
    """One value per quadrilateral, the same whichever corner comes first, (n,)."""
    corners = np.ascontiguousarray(np.sort(quads, axis=1))
    return corners.view(np.dtype((np.void, corners.dtype.itemsize * 4))).ravel()


def _contact_nodes(mesh: Mesh) -> IntArray:
    found = [mesh.faces[name].ravel() for name in mesh.faces if is_contact(name)]
    return np.unique(np.concatenate(found)) if found else np.empty(0, np.int64)


def is_contact(name: str) -> bool:
    """Whether a set of faces or nodes touches another body."""
    return name == "contact" or name.startswith("contact_") or name.endswith("patch")


def _apart(meshes: Mapping[str, Mesh]) -> dict[str, Mesh]:
    """The bodies moved along z off those they touch: the first of two up, a third one down."""
    if len(meshes) not in (2, 3) or not all(len(_contact_nodes(m)) for m in meshes.values()):
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


def _draw(
    ax: Axes,
    *,
    meshes: Mapping[str, Mesh],
    title: str,
    lines: tuple[float, float],
    elevation: float = _ELEVATION,
    among: Sequence[str] | None = None,
) -> None:
    """The bodies on axes; of those ``among`` others only what lies near their contact."""
    axes = view_axes(_AZIMUTH, elevation)
    first, points, quads, colours, contact = 0, [], [], [], []
    shades = {name: _shade(k) for k, name in enumerate(among or meshes)}
    for name, mesh in meshes.items():
        sides, touching = boundary_quads(mesh), np.zeros(mesh.n_node, dtype=bool)
        touching[_contact_nodes(mesh)] = True
        on: NDArray[np.bool_] = np.all(touching[sides], axis=1)
        points.append(mesh.points)
        quads.append(sides + first)
        contact.append(np.unique(sides[on]) + first)
        colours.append(np.where(on[:, None], to_rgb(_CONTACT), shades[name]))
        first += mesh.n_node
    every, shown = np.vstack(points), np.vstack(quads)
    surface = shaded_sides(every, shown, np.vstack(colours), axes)
    surface.set(linewidths=lines[0], edgecolors=(0.1, 0.1, 0.1, lines[1]))
    ax.add_collection(surface)
    touched = np.concatenate(contact)
    flat = every @ axes[:2].T
    framed = flat[touched] if among else flat[np.unique(shown)]
    margin = (_AROUND if among else 0.02) * float(np.ptp(framed, axis=0).max())
    frame_axes(ax, framed, margin, title)
    if not among:
        _legend(ax, shades, contact=len(touched) > 0)


def _shade(k: int) -> tuple[float, float, float]:
    r, g, b = (_PALE + (1.0 - _PALE) * part for part in to_rgb(COLOURS[k % len(COLOURS)]))
    return r, g, b


def _legend(ax: Axes, shades: Mapping[str, tuple[float, float, float]], *, contact: bool) -> None:
    handles = [LegendPatch(color=to_hex(shade), label=name) for name, shade in shades.items()]
    if contact:
        handles.append(LegendPatch(color=_CONTACT, label="contact faces"))
    ax.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4, frameon=False
    )
