"""Arrays that every contact of two bodies leaves in result.nc."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.loading import LoadPath
from upd.results import ArrayGroup

Array = NDArray[np.float64]
Variables = dict[str, Any]
XY = ("x", "y")


def scalar(value: float, units: str, **attributes: str) -> tuple[tuple[str, ...], Array, dict[str, str]]:
    """A number as a variable without dimensions."""
    return (), np.asarray(float(value)), {"units": units, **attributes}


def lattice(x: Array, y: Array) -> Variables:
    """Lattice lines in mm."""
    return {"x": (("x",), x, {"units": "mm"}), "y": (("y",), y, {"units": "mm"})}


def normal_fields(pressure: Array, force: Array, gap: Array, closed: NDArray[np.bool_]) -> Variables:
    """Fields under a normal load, (n_x, n_y) in MPa, N and mm."""
    return {
        "pressure": (XY, pressure, {"units": "MPa"}),
        "normal_force": (XY, force, {"units": "N"}),
        "gap": (XY, gap, {"units": "mm"}),
        "contact": (XY, closed, {"flag_meanings": "open contact"}),
    }


def tangential_fields(traction: Array, slip: Array, stick: NDArray[np.bool_]) -> Variables:
    """Fields under a tangential load, (n_x, n_y) or (n_x, n_y, n_direction) in MPa and mm."""
    dims = (*XY, "direction") if traction.ndim == 3 else XY
    return {
        "traction": (dims, traction, {"units": "MPa"}),
        "slip": (dims, slip, {"units": "mm"}),
        "stick": (XY, stick, {"flag_meanings": "slip_or_open stick"}),
    }


def path_group(path: LoadPath) -> tuple[str, ArrayGroup]:
    """Name and variables of a tangential path."""
    content = "cycle" if path.cycle else "path"
    variables = {
        "displacement": (("step",), path.displacement, {"units": "mm"}),
        "tangential_force": (("step",), path.load, {"units": "N"}),
    }
    return f"{content} {path.case.label}", ArrayGroup(variables, content=content, case=path.case)


def curve_group(approach: Iterable[float], force: Iterable[float]) -> ArrayGroup:
    """The force-approach curve in mm and N."""
    variables = {
        "approach": (("point",), np.array(list(approach)), {"units": "mm"}),
        "normal_force": (("point",), np.array(list(force)), {"units": "N"}),
    }
    return ArrayGroup(variables, content="force-approach")
