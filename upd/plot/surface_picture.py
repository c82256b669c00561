"""A picture of a surface for those who have no script.

Parallel projection, the farthest faces first.
"""

from __future__ import annotations

import io
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from upd.mesh import FloatArray
from upd.plot.surface import SCALE, Field, Surface, SurfaceBody, offsets

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: what is shown around the contact, as a part of its size
_AROUND = 0.75
_STILL = 0.82
# The viewer the page's script begins with: the quarter of a model shows its contact to the corner.
_AZIMUTH, _ELEVATION = -118.0, 25.0


def picture(surface: Surface) -> bytes:
    """The first field on the bodies drawn apart, as PNG; of a pressure only what lies near it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    shown = near_contact(surface)
    faces, colours = _painted(shown)
    sheet = Figure(figsize=(6.4, 4.8))
    FigureCanvasAgg(sheet)
    # Fixed places: matplotlib's own layout engines draw everything twice.
    ax = sheet.add_axes((0.02, 0.02, 0.78, 0.9))
    ax.add_collection(
        PolyCollection(list(faces), facecolors=colours, edgecolors=colours, linewidths=0.2)
    )
    low, high = faces.reshape(-1, 2).min(axis=0), faces.reshape(-1, 2).max(axis=0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.set_axis_off()
    first = shown.fields[0] if shown.fields else None
    ax.set_title(first.label if first else surface.label, fontsize=10)
    if first is not None:
        _bar(sheet, first)
    out = io.BytesIO()
    sheet.savefig(out, format="png", dpi=110)
    return out.getvalue()


def _bar(sheet: Figure, first: Field) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = ScalarMappable(Normalize(0.0, first.top), "viridis")
    label = f"{first.quantity}, {first.unit or 'of the largest'}"
    sheet.colorbar(scale, cax=sheet.add_axes((0.84, 0.18, 0.025, 0.6)), label=label)


def near_contact(surface: Surface) -> Surface:
    """The faces near the pressure of the first field.

    The whole surface when that is no pressure.
    """
    first = surface.fields[0] if surface.fields else None
    if first is None or first.quantity != "pressure":
        return surface
    pressed = [
        b.points[np.nan_to_num(v) > 0.0] for b, v in zip(surface.bodies, first.values, strict=True)
    ]
    points = np.vstack(pressed)
    if len(points) == 0:
        return surface
    low, high = points.min(axis=0), points.max(axis=0)
    around = _AROUND * float((high - low).max())
    bodies = tuple(_cut(b, low - around, high + around) for b in surface.bodies)
    # No whole face lies about a contact of one node.
    return replace(surface, bodies=bodies) if any(b.triangles.size for b in bodies) else surface


def _cut(body: SurfaceBody, low: FloatArray, high: FloatArray) -> SurfaceBody:
    within = np.flatnonzero(np.logical_and(body.points >= low, body.points <= high).all(axis=1))
    return replace(body, triangles=body.triangles[np.isin(body.triangles, within).all(axis=1)])


def _painted(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Corners (n, 3, 2) and colours (n, 3) of the faces that look at the viewer, the farthest
    first.
    """
    right, up, viewer = _view(_AZIMUTH, _ELEVATION)
    first = surface.fields[0] if surface.fields else None
    faces, colours, depth = [], [], []
    for k, body in enumerate(surface.bodies):
        corners = (_moved(surface, first, k) + offsets(surface)[k])[body.triangles]
        n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(n, axis=1)
        facing = np.divide(n @ viewer, length, out=np.zeros(len(n)), where=length > 0.0)
        seen = facing > 0.0
        colours.append(_colours(body, first, k)[seen] * (0.62 + 0.38 * facing[seen, None]))
        faces.append(corners[seen] @ np.array([right, up]).T)
        depth.append(corners[seen].mean(axis=1) @ viewer)
    order = np.argsort(np.concatenate(depth), kind="stable")
    return np.concatenate(faces)[order], np.concatenate(colours)[order]


def _moved(surface: Surface, first: Field | None, k: int) -> FloatArray:
    """Points of a body: deformed where the displacement itself is shown."""
    points = surface.bodies[k].points
    if first is None or first.motion is None or first.quantity == "pressure":
        return points
    moved: FloatArray = points + SCALE * surface.size * first.motion[k]
    return moved


def _colours(body: SurfaceBody, first: Field | None, k: int) -> FloatArray:
    """Colour of every face, (n, 3); grey where there is no field or no pressure."""
    from matplotlib import colormaps

    grey = np.full((len(body.triangles), 3), _STILL)
    if first is None or np.isnan(first.values[k]).all():
        return grey
    level = np.nan_to_num(first.values[k])[body.triangles].mean(axis=1) / first.top
    coloured = np.asarray(colormaps["viridis"](np.clip(level, 0.0, 1.0)))[:, :3]
    return np.where((level > 0.0)[:, None] | (first.quantity != "pressure"), coloured, grey)


def _view(azimuth: float, elevation: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit vectors to the right, upwards and to the viewer."""
    a, e = np.radians(azimuth), np.radians(elevation)
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    up = np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])
    return right, up, np.cross(right, up)
