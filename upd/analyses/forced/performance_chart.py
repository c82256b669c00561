"""The chart of peaks over F_C/F_E."""

from __future__ import annotations

import numpy as np

from upd.analyses.forced.array_parts import PERFORMANCE
from upd.analyses.forced.chart_parts import PER_N, SHEET
from upd.plot.chart import Arrays, Axis, Chart, Group, Style, Trace
from upd.plot.common import with_content

_STAR = 5
#: curves at most: the highest of all and of single modes
_MOST = 3


def performance_charts(arrays: Arrays) -> list[Chart]:
    """Peaks of both blades over F_C/F_E, one chart for every stiffness."""
    return [
        _chart(group) for group in with_content(arrays, PERFORMANCE) if group["ratio"].data.size
    ]


def _chart(group: Group) -> Chart:
    ratio = np.asarray(group["ratio"].data, float)
    traces = [
        Trace(
            "highest of all", ratio, np.asarray(group["highest_accelerance"].data, float), "line", 0
        )
    ]
    names = [key for key in group if key.startswith("peak_") and key.endswith("_right")]
    for name in sorted(key for key in names if "accelerance" in key):
        mode = str(group[name].attributes.get("mode", ""))
        height, colour = np.asarray(group[name].data, float), len(traces)
        found = np.isfinite(height)
        if found.sum() > 1 and len(traces) < _MOST:
            label = f"right blade, {mode}"
            traces.append(Trace(label, ratio[found], height[found], "both", colour))
    ends = np.array([ratio.min(), ratio.max()])
    styles: tuple[tuple[str, Style], ...] = (("free", "dashed"), ("stuck", "dashdot"))
    for kind, style in styles:
        limit = np.full(2, float(group[f"{kind}_peak"].data))
        traces.append(Trace(kind, ends, limit, style, closed=True))
    if "best_ratio" in group:
        best, least = (float(group[f"best_{name}"].data) for name in ("ratio", "accelerance"))
        label = f"best, F_C/F_E {best:.3g}"
        traces.append(Trace(label, np.array([best]), np.array([least]), "star", _STAR))
    axis = Axis("F_C/F_E", log=True)
    case = f"stiffness {group.attributes['stiffness']}"
    y = Axis("peak accelerance", PER_N, log=True)
    return Chart("Performance", axis, y, tuple(traces), case=case, figure="performance", **SHEET)
