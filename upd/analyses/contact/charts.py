"""Charts that curved and flat contacts share.

Contact states, force over approach, tangential paths.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Array, Arrays, Axis, Chart, Group, Style, Trace
from upd.plot.common import UM, case_of, with_content
from upd.results import Case

FACE_X, FACE_Y = Axis("x, along the damper", "mm"), Axis("y, up the slope", "mm")
#: size of a face
FACE_SIZE = (7.2, 4.2)
#: percentile of the pressure where the colours end: beyond it the pressure is the edge's
TOP_PERCENTILE = 99.0
APPROACH, FORCE = Axis("approach δ", "µm", low=0.0), Axis("normal force F", "N", low=0.0)


def normal_of(arrays: Arrays, group: Group) -> Group | None:
    """The fields under the normal load that a group of a tangential load belongs to, on the same
    face.
    """
    load, patch = Case(load=case_of(group).load), group.attributes.get("patch")
    return next(
        (
            g
            for g in with_content(arrays, "normal")
            if case_of(g) == load and g.attributes.get("patch") == patch
        ),
        None,
    )


def closed_nodes(group: Group) -> NDArray[np.bool_]:
    """(n_x, n_y) nodes that carry a normal force."""
    return np.asarray(group["normal_force"].data > 0.0)


def is_loaded(group: Group) -> bool:
    """Whether any node carries a normal force."""
    return bool(closed_nodes(group).any())


def values(group: Group, name: str, scale: float = 1.0) -> Array:
    """A variable times ``scale``."""
    return np.asarray(group[name].data, float) * scale


def from_zero(group: Group, name: str, scale: float = 1.0) -> Array:
    """A variable over the points of the force-approach curve, which starts unloaded."""
    found = values(group, name, scale)
    return found if values(group, "normal_force")[0] == 0.0 else np.concatenate([[0.0], found])


def path_trace(
    label: str, group: Group, colour: int, style: Style = "line", compliance: float = 0.0
) -> Trace:
    """Tangential force in N over displacement in um, less ``compliance`` (mm/N) times it."""
    T = values(group, "tangential_force")
    d = values(group, "displacement", UM) - UM * compliance * T
    return Trace(label, d, T, style, colour)


def frames(groups: list[Group]) -> tuple[Trace, ...]:
    """Edges of the faces."""
    out = []
    for group in groups:
        (left, right), (low, high) = (values(group, axis)[[0, -1]] for axis in "xy")
        x, y = np.array([left, right, right, left, left]), np.array([low, low, high, high, low])
        out.append(Trace("", x, y, outline=True))
    return tuple(out)


def face_chart(title: str, groups: list[Group], case: str, figure: str, **more: Any) -> Chart:
    """A chart of faces with their edges, lengths in mm alike; ``more`` are fields of it."""
    more = {"traces": frames(groups), "size": FACE_SIZE, **more}
    return Chart(title, FACE_X, FACE_Y, case=case, figure=figure, equal=True, **more)
