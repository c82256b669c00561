"""Charts of arrays nobody wrote charts for.

What shares an axis becomes curves, what lies on x and y becomes a map.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.plot.chart import Arrays, Axis, Chart, Entry, Group, Map, Trace, label_of
from upd.plot.common import magnitude

#: variables that are an axis when they are there
_ABSCISSAE = ("frequency", "displacement", "approach", "time", "amplitude")
_MOST_HEADLINES = 8


def headline(rows: list[Entry]) -> list[Entry]:
    """Numbers with a reference first, in the order of the run."""
    with_reference = [r for r in rows if r["reference"] is not None]
    return (with_reference + [r for r in rows if r["reference"] is None])[:_MOST_HEADLINES]


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Curves and maps of every group, by case."""
    del summary
    return [
        chart
        for name, group in arrays.items()
        for chart in (*_maps(name, group), *_curves(name, group))
    ]


def _maps(name: str, group: Group) -> list[Chart]:
    if not {"x", "y"} <= set(group):
        return []
    x, y = group["x"], group["y"]
    fields = {k: v for k, v in group.items() if v.dims == (*x.dims, *y.dims)}
    axes = Axis("x", x.units), Axis("y", y.units)
    return [
        Chart(
            _words(k),
            *axes,
            (),
            (Map(x.data, y.data, np.asarray(v.data, float), Axis(_words(k), v.units)),),
            label_of(name),
            equal=True,
        )
        for k, v in fields.items()
    ]


def _curves(name: str, group: Group) -> list[Chart]:
    along = next((group[k] for k in _ABSCISSAE if k in group and group[k].data.ndim == 1), None)
    if along is None:
        return []
    key = next(k for k in _ABSCISSAE if k in group)
    complex_pair = (*along.dims, "part")
    found = {
        k: v
        for k, v in group.items()
        if k != key and v.dims in (along.dims, complex_pair) and v.data.dtype.kind in "fiu"
    }
    out = []
    for k, v in found.items():
        z = v.dims == complex_pair
        y = magnitude(v) if z else np.asarray(v.data, float)
        # A response spans decades.
        ordinate = Axis(_words(k), v.units, log=z and bool(y.max() > 0.0))
        out.append(
            Chart(
                _words(k),
                Axis(_words(key), along.units),
                ordinate,
                (Trace(label_of(name), along.data, y),),
                case=label_of(name),
            )
        )
    return out


def _words(name: str) -> str:
    return name.replace("_", " ")
