"""What accuracy costs: the charts of a study, error against seconds and against memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from upd.labels import number_label
from upd.plot.chart import Array, Axis, Band, Chart, Mark, Trace

_COSTS = (
    ("seconds", Axis("seconds", log=True)),
    ("memory_mb", Axis("peak memory", "MB", log=True)),
)
#: numbers on the sheet, each with its first and its last case
_NUMBERS = 4


def work_precision_charts(curves: Sequence[Mapping[str, Any]]) -> list[Chart]:
    """Error over cost of every number of every case, a curve per element and solver, the printed
    value's error as a line.

    Parameters
    ----------
    curves
        As study.json holds them: ``curve`` (its label), ``name`` and ``case`` of the number,
        ``error`` (n,) as fractions of what stands in ``against``, ``seconds`` (n,), ``memory_mb``
        (n,), ``order`` (None or nan where there is none) and ``thesis_error`` (a fraction or None).

    Returns
    -------
    list of Chart
        For each number and case that has an error: the errors in per cent over seconds and over
        memory. The first four numbers, with their first and last case (smallest and largest load),
        stand on the sheet ``work_precision``.
    """
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for curve in curves:
        groups.setdefault((str(curve["name"]), str(curve["case"])), []).append(curve)
    # A number that no level moves has no error to show.
    groups = {
        key: group
        for key, group in groups.items()
        if any(np.any(np.abs(np.array(c["error"], float)) > 0.0) for c in group)
    }
    shown = _shown(list(groups))
    # Seconds and memory of both cases side by side, where every number has two.
    columns = 4 if len(shown) == 2 * len({name for name, _ in shown}) else 2
    return [
        _chart(group, cost, axis, key in shown, columns)
        for key, group in groups.items()
        for cost, axis in _COSTS
    ]


def change_charts(curves: Sequence[Mapping[str, Any]]) -> list[Chart]:
    """Change of every number from the finest level over seconds: a curve for each way to it, every
    level with its name, the seconds of the finest level as a line.

    Parameters
    ----------
    curves
        As for `work_precision_charts`; ``labels`` (n,) names the levels and ``against`` the finest
        one, whose change is 0 on the curve that has it.

    Returns
    -------
    list of Chart
        One for each number that a level changes, all on the sheet ``work_precision``.
    """
    ways = list(dict.fromkeys(str(c["curve"]) for c in curves))
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for curve in curves:
        groups.setdefault((str(curve["name"]), str(curve["case"])), []).append(curve)
    return [
        _change_chart(group, ways)
        for group in groups.values()
        if any(any(c["error"]) for c in group)
    ]


def _around(axis: Axis, values: Sequence[Array]) -> Axis:
    """The axis over whole decades, so that few points do not look far apart."""
    logs = np.log10(np.concatenate(values))
    low, high = np.floor(logs.min()), np.ceil(logs.max())
    return replace(axis, low=10.0**low, high=10.0 ** max(high, low + 1.0))


def _change_chart(group: Sequence[Mapping[str, Any]], ways: Sequence[str]) -> Chart:
    traces, marks, lines = [], [], []
    for c in group:
        colour = ways.index(str(c["curve"]))
        size, seconds = 100.0 * np.abs(np.array(c["error"], float)), np.array(c["seconds"], float)
        at = size > 0.0
        if at.any():
            traces.append(Trace(str(c["curve"]), seconds[at], size[at], "both", colour))
        if len(size) > 1:
            marks += [
                Mark(x, y, str(label), colour)
                for x, y, label in zip(
                    seconds[at], size[at], np.array(c["labels"])[at], strict=True
                )
            ]
        # of the finest level
        lines += [
            Band(str(c["against"]), "x", x, x, colour, dashed=True)
            for x in map(float, seconds[~at])
        ]
    first = group[0]
    return Chart(
        f"Change from {first['against']}",
        _around(Axis("seconds", log=True), [np.array(c["seconds"], float) for c in group]),
        _around(Axis("|change|", "%", log=True), [t.y for t in traces]),
        tuple(traces),
        marks=tuple(marks),
        bands=tuple(lines),
        case=f"{number_label(str(first['name']))}, {first['case']}",
        figure="work_precision",
        heading=f"Change from {first['against']}",
        columns=2,
        size=(4.6, 3.5),
    )


def _shown(keys: Sequence[tuple[str, str]]) -> set[tuple[str, str]]:
    """Numbers and cases on the sheet."""
    out = set()
    for name in list(dict.fromkeys(name for name, _ in keys))[:_NUMBERS]:
        mine = [key for key in keys if key[0] == name]
        out |= {mine[0], mine[-1]}
    return out


def _chart(
    group: Sequence[Mapping[str, Any]], cost: str, axis: Axis, sheet: bool, columns: int
) -> Chart:
    first = group[0]
    # In the order of the study, coarse to fine.
    traces = tuple(
        Trace(
            _label(c),
            np.array(c[cost], float),
            100.0 * np.abs(np.array(c["error"], float)),
            "both",
            k,
        )
        for k, c in enumerate(group)
    )
    printed = first.get("thesis_error")
    percent = 100.0 * abs(printed) if printed else 0.0
    return Chart(
        f"What accuracy costs: {axis.name}",
        axis,
        Axis(f"|error| against {first['against']}", "%", log=True),
        traces,
        bands=(Band(f"thesis ({percent:.1f} %)", "y", percent, percent, dashed=True),)
        if percent
        else (),
        case=f"{number_label(str(first['name']))}, {first['case']}",
        figure="work_precision",
        heading="What accuracy costs",
        sheet=sheet,
        columns=columns,
        size=(4.6, 3.5),
    )


def _label(curve: Mapping[str, Any]) -> str:
    """The curve with its fitted order, when it has one."""
    order = curve.get("order")
    return (
        f"{curve['curve']} (order {order:.1f})"
        if order is not None and np.isfinite(order)
        else str(curve["curve"])
    )
