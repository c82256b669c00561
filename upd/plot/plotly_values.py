"""Values and words as plotly takes them."""

from __future__ import annotations

import base64
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Axis, Chart


def pack(values: NDArray[Any]) -> dict[str, str]:
    """An array as plotly reads it from base64: single precision, or the smallest integers."""
    if values.dtype.kind in "iu":
        kind = (
            "u1"
            if values.size == 0 or values.max() < 256
            else "u2"
            if values.max() < 65536
            else "u4"
        )
        values = values.astype(f"<{kind}")
    else:
        kind, values = "f4", values.astype("<f4")
    out = {
        "dtype": kind,
        "bdata": base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii"),
    }
    return out | ({"shape": ",".join(map(str, values.shape))} if values.ndim > 1 else {})


def numbers(values: Any) -> dict[str, str]:
    """Values of any kind as `pack` writes them, in single precision."""
    return pack(np.asarray(values, float))


def unit(axis: Axis) -> str:
    """An axis's unit behind a value inside a template."""
    return f" {template(axis.unit)}" if axis.unit else ""


def template(text: str) -> str:
    """Text inside a template, where % and braces have a meaning."""
    return escape(text).replace("%", "&#37;").replace("{", "&#123;")


def hover(chart: Chart, value: str = "", name: str = "") -> str:
    """Template of what the pointer tells: both coordinates, a value, a name."""
    x, y = (template(a.name.partition(",")[0]) for a in (chart.x, chart.y))
    first = f"{x}: " + ("%{x}" if chart.x.ticks else f"%{{x:.4g}}{unit(chart.x)}")
    return f"{first}<br>{y}: %{{y:.4g}}{unit(chart.y)}{value}<extra>{template(name)}</extra>"
