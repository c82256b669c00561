"""Pictures of vibration: mode shapes as figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from numpy.typing import NDArray

from upd.errors import InputError
from upd.mesh import FloatArray, IntArray, Mesh
from upd.mesh.hexmesh import boundary_quads
from upd.plot.sheet import own_axes

#: largest displacement drawn, as a part of the diagonal of the box around all bodies
SCALE = 0.08
#: degrees by which two faces turn where the outline has a line
OUTLINE_ANGLE = 30.0

_STILL = (0.83, 0.83, 0.83)
_OUTLINE = "#8a8a8a"
# white mixed to the colours, so that their dark end keeps its shades
_PALE = 0.12
# rounding of the product of two unit vectors: a side seen from its edge is not drawn
_EDGE_ON = 16.0 * np.finfo(np.float64).eps
# part of a colour that does not depend on the light
_AMBIENT = 0.65


def draw_mode(
    meshes: Mapping[str, Mesh],
    shapes: Mapping[str, FloatArray],
    ax: Axes | None = None,
    *,
    title: str = "",
    view: tuple[float, float] = (-60.0, 20.0),
) -> Axes:
    """Deformed surface of the bodies, coloured by displacement, over the outline at rest.

    Parallel projection.

    Parameters
    ----------
    shapes
        Body -> (n_node, 3) real displacements in any unit; all are drawn to one scale, the
        largest at 8 % of the bodies' size. Bodies without one stay at rest, in grey.
    view
        Azimuth and elevation of the viewer in degrees, about z.

    Raises
    ------
    InputError
        (all problems at once) when there is no body, for an unknown body, a wrong shape, complex
        or non-finite numbers.
    """
    motion = _checked(meshes, shapes)
    ax = own_axes(ax)
    axes = view_axes(*view)
    points, u, faces, moving = _together(meshes, motion)
    length, size = np.linalg.norm(u, axis=1), _size(points)
    # nothing moves: any divisor will do
    largest = float(length.max()) or 1.0
    level = length[faces].mean(axis=1) / largest
    colours = np.where(
        moving[:, None], _PALE + (1.0 - _PALE) * colormaps["viridis"](level)[:, :3], _STILL
    )
    ax.add_collection(_outline(points, faces, axes), autolim=False)
    ax.add_collection(
        shaded_sides(points + SCALE * size / largest * u, faces, colours, axes), autolim=False
    )
    # around all points at rest: pictures side by side have one scale
    frame_axes(ax, points @ axes[:2].T, SCALE * size, title)
    return ax


def _checked(meshes: Mapping[str, Mesh], shapes: Mapping[str, Any]) -> dict[str, FloatArray]:
    """The shapes as arrays."""
    problems = [] if meshes else ["there is no body: give at least one mesh"]
    motion: dict[str, FloatArray] = {}
    for name, shape in shapes.items():
        if name not in meshes:
            problems.append(
                f"there is no body {name!r}: the bodies are {', '.join(meshes) or 'none'}"
            )
            continue
        problem = _shape_problem(shape, meshes[name])
        if problem:
            problems.append(f"{name}: {problem}")
        else:
            motion[name] = np.asarray(shape, dtype=np.float64)
    if problems:
        raise InputError("Mode shape: " + "; ".join(problems) + ".")
    return motion


def _together(
    meshes: Mapping[str, Mesh], motion: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray, IntArray, NDArray[np.bool_]]:
    """Points and displacements (n, 3) of all bodies, their boundary (n_face, 4), and which of its
    sides have a shape.
    """
    points = np.vstack([mesh.points for mesh in meshes.values()])
    u = np.vstack([motion.get(name, np.zeros((mesh.n_node, 3))) for name, mesh in meshes.items()])
    first = np.concatenate([[0], np.cumsum([mesh.n_node for mesh in meshes.values()])])
    quads = [
        boundary_quads(mesh) + start for mesh, start in zip(meshes.values(), first, strict=False)
    ]
    moving = np.repeat([name in motion for name in meshes], [len(q) for q in quads])
    return points, u, np.vstack(quads), moving


def _shape_problem(shape: Any, mesh: Mesh) -> str:
    given = np.asarray(shape)
    if given.shape != (mesh.n_node, 3):
        return f"the shape is {given.shape}, give ({mesh.n_node}, 3), one row per node"
    if given.dtype.kind not in "iuf":
        return (
            f"the shape is {given.dtype}, give real numbers (of a complex mode the real part "
            "at one phase)"
        )
    if not np.isfinite(given).all():
        return "the shape has entries that are not finite"
    return ""


def _size(points: FloatArray) -> float:
    """Diagonal of the box around the points, mm."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def view_axes(azimuth: float, elevation: float) -> FloatArray:
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


def shaded_sides(
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
    sharp = np.sum(total**2, axis=1) < 2.0 + 2.0 * np.cos(np.radians(OUTLINE_ANGLE))
    seen = np.bincount(which, n[owner] @ axes[2] > _EDGE_ON, len(edges)) > 0
    drawn = edges[(sharp | (count != 2)) & seen]
    lines = (points @ axes[:2].T)[np.stack([drawn // len(points), drawn % len(points)], axis=1)]
    return LineCollection(list(lines), colors=_OUTLINE, linewidths=0.6, zorder=1)


def frame_axes(ax: Axes, flat: FloatArray, margin: float, title: str) -> None:
    """Limits around points (n, 2) of a picture, without axes."""
    low, high = flat.min(axis=0) - margin, flat.max(axis=0) + margin
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    ax.set_title(title, fontsize=11)
    ax.set_aspect("equal")
    ax.set_axis_off()
