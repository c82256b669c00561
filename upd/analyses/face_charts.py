"""Charts of flat faces in contact, of dampers on a platform and seated between blades, so that
neither analysis imports the other. Lengths in mm.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from upd.plot.chart import Array, Axis, Chart, Trace
from upd.plot.common import pressure_map
from upd.results import Group

#: axes and size of flat faces
FACE: dict[str, Any] = {
    "x": Axis("x, along the damper", "mm"),
    "y": Axis("y, up the slope", "mm"),
    "size": (7.2, 4.2),
}
#: percentile of the pressure where the colours end: beyond it the pressure is the edge's
TOP_PERCENTILE = 99.0


def values(group: Group, name: str, scale: float = 1.0) -> Array:
    """A variable times ``scale``."""
    return np.asarray(group[name].data, float) * scale


def face_chart(title: str, groups: list[Group], case: str, figure: str, **more: Any) -> Chart:
    """A chart of faces with their edges, lengths in mm alike; ``more`` are fields of it."""
    edges = []
    for group in groups:
        (left, right), (low, high) = (values(group, axis)[[0, -1]] for axis in "xy")
        x, y = np.array([left, right, right, left, left]), np.array([low, low, high, high, low])
        edges.append(Trace("", x, y, outline=True))
    more = FACE | {"traces": tuple(edges)} | more
    return Chart(title, case=case, figure=figure, equal=True, **more)


def face_pressure(case: str, groups: list[Group], *, sheet: bool) -> Chart:
    """Pressure of faces; the colours end where only edges go on."""
    p = np.concatenate([values(group, "pressure").ravel() for group in groups])
    top = float(np.percentile(p[p > 0.0], TOP_PERCENTILE)) if (p > 0.0).any() else None
    more: dict[str, Any] = {
        "maps": tuple(pressure_map(group, 1.0, top=top) for group in groups),
        "note": "Open nodes are white; the colours end at the 99th percentile, where only edges "
        "go on.",
        "sheet": sheet,
        "columns": 3,
        "detail": f"largest {p.max():.3g} MPa",
    }
    return face_chart("Contact pressure", groups, case, "pressure", **more)
