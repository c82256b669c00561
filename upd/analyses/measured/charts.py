"""Measured curves over the computed ones, and damping fitted to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.measured.compare import MEASURED_CURVE
from upd.plot.chart import Array, Axis, Chart, Trace
from upd.plot.common import case_of, frequency_of, magnitude, with_content
from upd.results import Arrays, Case, Group

_BLADES = ("right", "left")
_PER_N = "(m/s²)/N"
#: points of a measured curve that are drawn: so many that they touch would hide the computed one
_DRAWN = 100


def measured_traces(arrays: Arrays, blade: str, colours: Mapping[Any, int]) -> tuple[Trace, ...]:
    """The measured curves of a blade as open points.

    Parameters
    ----------
    arrays
        Of the run.
    blade
        "right" or "left".
    colours
        Of the computed curves by their F_C/F_E, of linear limits by their kind; a measured curve
        beside none of them has one of its own.
    """
    out, spare = [], 1 + max(colours.values(), default=-1)
    for group in _of_blade(arrays, blade):
        case = case_of(group)
        colour = colours.get(case.kind if case.force_ratio is None else case.force_ratio)
        if colour is None:
            colour, spare = spare, spare + 1
        out.append(_points(group, blade, colour))
    return tuple(out)


def damping_charts(arrays: Arrays) -> list[Chart]:
    """Every measured free curve with the modes fitted to it."""
    out = []
    for group in with_content(arrays, MEASURED_CURVE):
        blade = case_of(group).blade
        if "fitted" not in group or blade not in _BLADES:
            continue
        f = frequency_of(group)
        out.append(
            Chart(
                "Damping fitted to the measured curve",
                Axis("frequency", "Hz", low=float(f[0]), high=float(f[-1])),
                Axis("accelerance", _PER_N, log=True),
                (
                    _points(group, blade, 0),
                    Trace("modes fitted", f, magnitude(group["fitted"]), "line", 1),
                ),
                case=f"{case_of(group).name}, {blade} blade",
                figure="damping",
                columns=2,
                size=(6.4, 4.4),
            )
        )
    return out


def _of_blade(arrays: Arrays, blade: str) -> list[Group]:
    return [
        group for group in with_content(arrays, MEASURED_CURVE) if f"accelerance_{blade}" in group
    ]


def _points(group: Group, blade: str, colour: int) -> Trace:
    f, H = frequency_of(group), magnitude(group[f"accelerance_{blade}"])
    case = case_of(group)
    words = Case(kind=case.kind, force_ratio=case.force_ratio).label
    on = _spread(f, H)
    some = f", {len(on)} of {len(f)} points" if len(on) < len(f) else ""
    return Trace(f"measured, {words}{some}", f[on], H[on], "open points", colour)


def _spread(f: Array, H: Array) -> NDArray[np.int64]:
    """Points (k,) that are as far from each other along the drawn curve, by frequency and the
    logarithm of the height; all where they are few.
    """
    if len(f) <= _DRAWN:
        return np.arange(len(f))
    y = np.log(np.maximum(H, np.finfo(float).tiny))
    # without noise: the path through means of as many points as are drawn
    width = max(len(f) // _DRAWN, 1)
    y = np.pad(y, (width // 2, width - 1 - width // 2), mode="edge")
    y = np.convolve(y, np.full(width, 1.0 / width), mode="valid")
    steps = np.hypot(
        np.diff(f) / np.ptp(f), np.diff(y) / max(float(np.ptp(y)), np.finfo(float).tiny)
    )
    along = np.concatenate([[0.0], np.cumsum(steps)])
    on = np.searchsorted(along, np.linspace(0.0, along[-1], _DRAWN))
    return np.unique(np.append(np.minimum(on, len(f) - 1), int(H.argmax())))
