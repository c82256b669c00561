"""A picture of a surface for those who have no script: parallel projection, the farthest faces
first.
"""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np

from upd.mesh import FloatArray
from upd.plot.surface import SCALE, Field, Surface, SurfaceBody, offsets

#: what is shown around the contact, as a part of its size
_AROUND = 0.75
_STILL = 0.82
# The viewer the page's script begins with: the quarter of a model shows its contact to the corner.
_AZIMUTH, _ELEVATION = -118.0, 25.0


def picture(surface: Surface) -> bytes:
    """The first field on the bodies drawn apart, as PNG; of a pressure only what lies near it."""
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    from upd.plot.modes import frame_axes, shaded_sides, view_axes
    from upd.plot.sheet import draw_sheet

    shown = near_contact(surface)
    first = shown.fields[0] if shown.fields else None
    shift, axes = offsets(shown), view_axes(_AZIMUTH, _ELEVATION)
    begin = np.cumsum([0, *(len(body.points) for body in shown.bodies)])
    points = np.vstack([_moved(shown, first, k) + shift[k] for k in range(len(shown.bodies))])
    colours = np.vstack([_colours(body, first, k) for k, body in enumerate(shown.bodies)])
    sides = np.vstack(
        [b.triangles[:, [0, 1, 2, 2]] + n for b, n in zip(shown.bodies, begin, strict=False)]
    )

    def draw(ax: Axes) -> None:
        faces = shaded_sides(points, sides, colours, axes)
        faces.set_edgecolor("face")
        ax.add_collection(faces)
        title = first.label if first else surface.label
        frame_axes(ax, (points @ axes[:2].T)[np.unique(sides)], 0.0, title)
        if first is not None:
            scale = ScalarMappable(Normalize(0.0, first.top), "viridis")
            label = f"{first.quantity}, {first.unit or 'of the largest'}"
            ax.figure.colorbar(scale, ax=ax, label=label, shrink=0.7)

    out = io.BytesIO()
    draw_sheet([draw], 1, (6.4, 4.8), 110).savefig(out, format="png")
    return out.getvalue()


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
