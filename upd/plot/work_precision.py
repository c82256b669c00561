"""What accuracy costs: the charts of a study, error against seconds and against memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from upd.plot.chart import Array, Axis, Band, Chart, Mark, Trace
from upd.results.quantities import number_label

_COSTS = (
    ("seconds", Axis("seconds", log=True)),
    ("memory_mb", Axis("peak memory", "MB", log=True)),
)
#: numbers on the sheet, each with its last case
_NUMBERS = 3
#: decades that the name of a level takes above its point
_WORDS = 0.3
#: what cases of curves with friction have in their label
_FRICTION = "F_C/F_E"


def work_precision_charts(curves: Sequence[Mapping[str, Any]]) -> list[Chart]:
    """Error over cost of every number of every case, a curve per element and solver, the printed
    value's error as a line.

    Parameters
    ----------
    curves
        As study.json holds them: ``curve`` (its label), ``name`` and ``case`` of the number,
        ``error`` (n,) as fractions of what stands in ``against``, ``seconds`` (n,), ``memory_mb``
        (n,), ``order`` (None or nan where there is none) and ``thesis_error`` (a fraction or None).
        ``h`` (n,) and ``estimate``, where there is one, show the estimated error of the finest
        level as an open point; ``labels`` (n,) name the levels of a curve that is alone.

    Returns
    -------
    list of Chart
        For each number and case that has an error: the errors in per cent over seconds and over
        memory. The first three numbers over seconds, with their last case (the largest load), come
        first and are on the sheet ``work_precision``; of a forced response, those with friction.
    """
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for curve in curves:
        groups.setdefault((str(curve["name"]), str(curve["case"])), []).append(curve)
    # a number that no level moves has no error to show
    groups = {
        key: group
        for key, group in groups.items()
        if any(np.any(np.abs(np.array(c["error"], float)) > 0.0) for c in group)
    }
    # of a forced response the curves with friction are what is studied
    friction = [key for key in groups if _FRICTION in key[1]]
    last = {name: (name, case) for name, case in friction or groups}
    shown = list(last.values())[:_NUMBERS]
    return [
        _chart(group, cost, axis, sheet=key in shown and cost == "seconds", columns=_NUMBERS)
        for key, group in sorted(groups.items(), key=lambda item: item[0] not in shown)
        for cost, axis in _COSTS
    ]


def _around(axis: Axis, values: Sequence[Array], room: float = 0.0) -> Axis:
    """The axis over whole decades, so that few points do not look far apart; ``room`` decades at
    least above the highest, for words.
    """
    logs = np.log10(np.concatenate(values))
    low, high = np.floor(logs.min()), np.ceil(logs.max() + room)
    return replace(axis, low=10.0**low, high=10.0 ** max(high, low + 1.0))


def _chart(
    group: Sequence[Mapping[str, Any]],
    cost: str,
    axis: Axis,
    *,
    sheet: bool,
    columns: int,
) -> Chart:
    """Errors of a number and case over a cost."""
    first, alone = group[0], len(group) == 1
    heading, traces, marks, bands = "What accuracy costs", [], [], []
    for k, c in enumerate(_by_cost(one, cost) for one in group):
        spent, size = np.array(c[cost], float), 100.0 * np.abs(np.array(c["error"], float))
        at = size > 0.0
        traces.append(Trace(_label(c, alone=alone), spent[at], size[at], "both", k))
        if "labels" in c and alone:
            named = zip(spent[at], size[at], np.array(c["labels"])[at], strict=True)
            marks += [Mark(x, y, str(text), k) for x, y, text in named]
        traces += _estimated(c, spent, k)
    printed = 100.0 * abs(first.get("thesis_error") or 0.0)
    if printed:
        bands.append(Band(f"thesis ({printed:.1f} %)", "y", printed, printed, dashed=True))
    heights = [t.y for t in traces] + [np.array([printed])] * (printed > 0.0)
    return Chart(
        f"{heading}: {axis.name}",
        _around(axis, [np.array(c[cost], float) for c in group]),
        _around(Axis("|error|", "%", log=True), heights, _WORDS),
        tuple(trace for trace in traces if len(trace.x)),
        case=f"{number_label(str(first['name']))}, {first['case']}",
        figure="work_precision",
        marks=tuple(marks),
        bands=tuple(bands),
        detail="" if alone else _reference(group),
        sheet=sheet,
        columns=columns,
        size=(4.6, 3.5),
        heading=heading,
    )


def _by_cost(curve: Mapping[str, Any], cost: str) -> dict[str, Any]:
    """The curve with its levels from the cheapest to the dearest."""
    order = np.argsort(np.array(curve[cost], float), kind="stable")
    levels = ("labels", "h", "error", "seconds", "memory_mb")
    return dict(curve) | {k: [curve[k][i] for i in order] for k in levels if k in curve}


def _reference(group: Sequence[Mapping[str, Any]]) -> str:
    """What the errors of a chart are taken against, in words."""
    known = {str(c["against"]) for c in group}
    if len(known) > 1:
        return "each against its own reference"
    return f"against {known.pop()}" if any(known) else ""


def _estimated(curve: Mapping[str, Any], spent: Array, colour: int) -> list[Trace]:
    """The estimated error of the finest level, where there is one."""
    error = (curve.get("estimate") or {}).get("error")
    if error is None or not np.isfinite(error) or not error > 0.0:
        return []
    at = int(np.argmin(np.array(curve["h"], float)))
    words = "estimated, finest level"
    y = np.array([100.0 * error])
    return [Trace(words, spent[at : at + 1], y, "open points", colour, entry=words)]


def _label(curve: Mapping[str, Any], *, alone: bool) -> str:
    """The curve with its fitted order, when it has one, and what a curve that is alone is taken
    against.
    """
    order, text = curve.get("order"), str(curve["curve"])
    if order is not None and np.isfinite(order):
        text += f" (order {order:.1f})"
    return text + f", against {curve['against']}" * (alone and bool(curve["against"]))
