"""Figures of a study folder: error against seconds and against memory."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from upd.errors import InputError
from upd.labels import words
from upd.plot.chart import Axis, Chart, Trace
from upd.report.panels import Panel, make_panels

_COSTS = (("seconds", Axis("seconds", "s", log=True)), ("memory_mb", Axis("peak memory", "MB", log=True)))


def study_panels(folder: Path) -> list[Panel]:
    """The work-precision figure of a study. Raises InputError when ``folder`` is no study folder."""
    try:
        curves = json.loads((folder / "study.json").read_text("utf-8"))["curves"]
        charts = [chart for group in _together(curves) for chart in _charts(group)]
    except FileNotFoundError:
        raise InputError(f"{folder}: is no study folder (it has no study.json); give the folder `upd study` wrote") from None
    except (OSError, ValueError, KeyError, TypeError) as fault:
        raise InputError(f"{folder / 'study.json'}: cannot be read ({fault}); run the study again") from None
    figure = folder / "work_precision.png"
    return make_panels(charts, {"work_precision": figure} if figure.exists() else {})


def _together(curves: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """Curves of one number of one case."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for c in curves:
        groups.setdefault((c["name"], c["case"]), []).append(c)
    return list(groups.values())


def _charts(group: list[dict[str, Any]]) -> list[Chart]:
    first = group[0]
    out = []
    for key, axis in _COSTS:
        traces = [Trace(c["curve"], np.array(c[key], float), 100.0 * np.abs(c["error"]), "both", k) for k, c in enumerate(group)]
        ordinate = Axis(f"|error| against {first['against']}", "%", log=True)
        case = f"{words(first['name'])}, {first['case']}"
        out.append(Chart(f"What accuracy costs: {axis.name}", axis, ordinate, tuple(traces), case=case, figure="work_precision"))
    return out
