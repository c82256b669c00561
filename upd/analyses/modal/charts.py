"""Charts of a modal analysis, from the run folder's arrays alone: responses of both blades."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.analyses.measured import FREE, STUCK, measured_traces
from upd.analyses.modal.output import RESPONSE
from upd.plot.chart import Axis, Chart, Mark, Trace
from upd.plot.common import frequency_of, magnitude, scalar, with_content
from upd.results import Arrays, Group

#: the blade that is excited first
_BLADES = ("right", "left")


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses of both blades."""
    del summary
    responses = with_content(arrays, RESPONSE)
    return [
        *(chart for blade in _BLADES for chart in _response(arrays, responses, blade)),
    ]


def _response(arrays: Arrays, groups: list[Group], blade: str) -> list[Chart]:
    """Accelerance of one blade, free and glued; a blade that hears nothing has no curve."""
    name = f"accelerance_{blade}"
    curves = [(k, g, magnitude(g[name])) for k, g in enumerate(groups) if name in g]
    curves = [(k, g, H) for k, g, H in curves if H.max() > 0.0]
    if not curves:
        return []
    # a glued damper is what a stuck one is to the measured curve
    colours = {STUCK if g.attributes["kind"] == "glued" else FREE: k for k, g, _ in curves}
    # lines lie over the measured points
    traces = measured_traces(arrays, blade, colours) + tuple(
        Trace(g.attributes["kind"], frequency_of(g), np.where(H > 0.0, H, np.nan), colour=k)
        for k, g, H in curves
    )
    marks = tuple(mark for k, g, _ in curves for mark in _peaks(g, blade, k))
    first = curves[0][1]
    unit = first[name].units.replace("m/s2", "m/s²")
    f = frequency_of(first)
    x = Axis("frequency", "Hz", low=float(f[0]), high=float(f[-1]))
    damping, case = scalar(first, "damping"), f"{blade} blade"
    detail = f"damping {100.0 * damping:.3g} %" if damping is not None else ""
    return [
        Chart(
            "Frequency response",
            x,
            Axis("accelerance", unit, log=True),
            traces,
            (),
            case,
            "response",
            marks=marks,
            detail=detail,
        )
    ]


def _peaks(group: Group, blade: str, colour: int) -> list[Mark]:
    names = (f"peak_frequency_{blade}", f"peak_accelerance_{blade}")
    if not set(names) <= set(group):
        return []
    pairs = zip(*(group[name].data for name in names), strict=True)
    return [
        Mark(float(f), float(height), f"{f:.2f} Hz\n{height:.3g}", colour) for f, height in pairs
    ]
