"""Charts that several analyses have alike.

Maps of pressure and contact state, circles, magnitudes of complex variables.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import STATES, Array, Axis, Map, Trace
from upd.results import Arrays, Case, Group, Variable
from upd.results.number import from_json

UM = 1e3


def with_content(arrays: Arrays, *contents: str) -> list[Group]:
    """The groups that hold ``contents``, in the order of the file."""
    return [group for group in arrays.values() if group.attributes.get("content") in contents]


def case_of(group: Group) -> Case:
    """The case a group belongs to, from its attributes."""
    return from_json(Case, group.attributes)


def scalar(group: Group, name: str) -> float | None:
    """The value of a variable without dimensions, or None when the group lacks it."""
    found = group.get(name)
    return None if found is None else float(found.data)


def lattice(group: Group, scale: float) -> tuple[Array, Array]:
    """Lattice lines of a group, in mm times ``scale``."""
    return np.asarray(group["x"].data) * scale, np.asarray(group["y"].data) * scale


def pressure_map(group: Group, scale: float, *, top: float | None = None) -> Map:
    """Contact pressure; nothing where the contact is open.

    ``top``: end of the colours, above which only the edge is.
    """
    x, y = lattice(group, scale)
    p = np.asarray(group["pressure"].data)
    return Map(
        x,
        y,
        np.where(group["normal_force"].data > 0.0, p, np.nan),
        Axis("pressure", group["pressure"].units),
        top=top,
    )


def state_map(tangential: Group, closed: NDArray[np.bool_], scale: float) -> Map:
    """Open, slipping and sticking nodes: 0, 1, 2."""
    x, y = lattice(tangential, scale)
    stick = np.asarray(tangential["stick"].data) > 0
    return Map(x, y, np.where(closed, np.where(stick, 2.0, 1.0), 0.0), Axis("state"), STATES)


def cut(m: Map, half_x: float, half_y: float) -> Map:
    """The part of a map around its origin."""
    i, j = np.abs(m.x) <= half_x, np.abs(m.y) <= half_y
    return Map(m.x[i], m.y[j], m.z[np.ix_(i, j)], m.value, m.states, m.top)


def circle(radius: float, label: str, *, dashed: bool = False) -> Trace:
    """A circle about the origin."""
    t = np.linspace(0.0, 2.0 * np.pi, 121)
    return Trace(
        label, radius * np.cos(t), radius * np.sin(t), "dashed" if dashed else "line", outline=True
    )


def frequency_of(group: Group) -> Array:
    """Hz, along a curve."""
    return np.asarray(group["frequency"].data, float)


def magnitude(variable: Variable) -> Array:
    """|z| of a variable whose last dimension holds real and imaginary part.

    The absolute value of a real one.
    """
    z = np.asarray(variable.data)
    is_pair = (
        variable.dims
        and z.shape[-1] == 2
        and variable.dims[-1] in ("part", "complex", "real_imaginary", "component")
    )
    return np.asarray(np.hypot(z[..., 0], z[..., 1]) if is_pair else np.abs(z))
