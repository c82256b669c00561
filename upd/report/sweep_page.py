"""One sweep folder -> report.html: the grid, the table, figures, failures, cost and the scene on one page that needs nothing beside it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from upd.labels import file_name, unit_words, words
from upd.plot.chart import Axis, Chart, Trace
from upd.report.page import render, save, stages
from upd.report.panels import Panel, make_panels
from upd.report.sweep_folder import Parameter, SweepFolder, read_sweep

#: rows of the table on the page; all of them are in table.csv
MOST_ROWS = 500
#: different reasons of failures, and points named with each
_REASONS, _NAMED = 30, 8
#: curves in one chart: more are not told apart
_CURVES = 8


def write_sweep_report(folder: str | Path) -> Path:
    """Write report.html into a sweep folder, from what lies in it. Returns its path.

    Raises InputError when ``folder`` is no sweep folder, its sweep.json is damaged, or it cannot be written.
    """
    sweep = read_sweep(Path(folder))
    path = sweep.path / "report.html"
    save(path, render("sweep.html.j2", sweep_panels(sweep), [], sweep_context(sweep)))
    return path


def sweep_panels(sweep: SweepFolder) -> list[Panel]:
    """The sweep's figures; those over one or two parameters as charts too."""
    varied = [p for p in sweep.parameters if len(p.values) > 1]
    numeric = [p for p in varied if p.numbers is not None]
    charts = sweep_charts(sweep, varied, max(numeric, key=lambda p: len(p.values))) if numeric and len(varied) <= 2 else []
    over = f"Followed numbers over {' and '.join(p.short for p in varied)}"
    headings = {"sweep": over} | {f"sweep-{_variable(c)}": _title(c) for c in sweep.data["followed"]}
    return [replace(panel, heading=headings.get(panel.name, over)) for panel in make_panels(charts, sweep.figures)]


def sweep_charts(sweep: SweepFolder, varied: list[Parameter], x: Parameter) -> list[Chart]:
    """One chart per followed number over ``x``: curves are its cases, or the values of the other parameter when there is one."""
    others = [p for p in varied if p is not x]
    if any(len(p.values) > _CURVES for p in others):
        return []
    order = np.argsort(np.array(x.numbers, float))
    along = np.array(x.numbers, float)[order]
    # (cases..., other, x): parameters with one value fall away.
    grid = np.moveaxis(sweep.table.reshape(*sweep.shape, -1), sweep.parameters.index(x), -2).reshape(-1, len(along), sweep.table.shape[1])
    abscissa = Axis(x.short, unit_words(x.unit))
    charts = []
    for k, column in enumerate(sweep.data["followed"]):
        curves = grid[:, order, k]
        if not np.isfinite(curves).any():
            continue
        labels = [f"{p.short} {p.shown(j)} {p.unit}".strip() for p in others for j in range(len(p.values))] or [_title(column)]
        # Ends without a value would only stretch the axis; gaps between values stay.
        solved = np.flatnonzero(np.isfinite(curves).any(axis=0))
        span = slice(solved[0], solved[-1] + 1)
        drawn = [(j, label, y[span]) for j, (label, y) in enumerate(zip(labels, curves, strict=True)) if np.isfinite(y).any()]
        traces = tuple(Trace(label, along[span], y, "both", j) for j, label, y in drawn)
        ordinate = Axis(words(column["name"]), unit_words(column["unit"]))
        charts.append(Chart(words(column["name"]), abscissa, ordinate, traces, case=column["case"], figure="sweep"))
    return charts


def _title(column: Mapping[str, Any]) -> str:
    return words(column["name"]) + (f" ({column['case']})" if column["case"] else "")


def _variable(column: Mapping[str, Any]) -> str:
    return file_name(f"{column['name']} ({column['case']})" if column["case"] else column["name"])


def sweep_context(sweep: SweepFolder) -> dict[str, Any]:
    """What the template shows beside the figures."""
    data, points = sweep.data, sweep.data["points"]
    return {
        "sweep": sweep,
        "title": f"Sweep: {data['title'] or data['scene']}",
        "verdict": verdict(points),
        "reasons": grouped(sweep, ((p["reason"] or "no reason given",) if p["status"] != "ok" else () for p in points)),
        "warnings": grouped(sweep, (p["warnings"] for p in points)),
        "columns": [{"title": _title(c), "unit": c["unit"]} for c in data["followed"]],
        "rows": [_row(sweep, k) for k in range(min(len(points), MOST_ROWS))],
        "n_points": len(points),
        "cost": cost(data),
        "stages": stages({"stages": data["cost"].get("stages_s", {})}),
        "notes": data["plan"].get("notes", []),
        "versions": data.get("versions") or {"upd": data.get("version", "")},
    }


def verdict(points: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Class of the mark, its word, and a sentence."""
    failed, told = sum(p["status"] != "ok" for p in points), sum(bool(p["warnings"]) for p in points)
    says = f"{len(points) - failed} of {_counted(len(points))} done"
    says += f", {failed} failed" if failed else ""
    says += f", {told} with warnings." if told else "."
    if points and failed == len(points):
        return {"kind": "failed", "word": "Failed", "says": f"None of {_counted(len(points))} could be solved."}
    if failed:
        return {"kind": "warning", "word": "Done in part", "says": says}
    return {"kind": "warning" if told else "passed", "word": "Done, with warnings" if told else "Done", "says": says}


def _counted(n: int) -> str:
    return f"{n} point{'' if n == 1 else 's'}"


def grouped(sweep: SweepFolder, texts: Iterable[Iterable[str]]) -> list[dict[str, Any]]:
    """Texts of the points, each once with the points it belongs to; the most frequent first."""
    found: dict[str, list[int]] = {}
    for k, mine in enumerate(texts):
        for text in mine:
            found.setdefault(str(text), []).append(k)
    ranked = sorted(found.items(), key=lambda item: -len(item[1]))[:_REASONS]
    return [
        {
            "text": text,
            "count": _counted(len(where)),
            "points": "; ".join(_label(sweep, k) for k in where[:_NAMED]),
            "more": max(len(where) - _NAMED, 0),
        }
        for text, where in ranked
    ]


def _label(sweep: SweepFolder, k: int) -> str:
    index = np.unravel_index(k, sweep.shape)
    return ", ".join(f"{p.short} {p.shown(int(j))} {unit_words(p.unit)}".strip() for p, j in zip(sweep.parameters, index, strict=True))


def _row(sweep: SweepFolder, k: int) -> dict[str, Any]:
    point, index = sweep.data["points"][k], np.unravel_index(k, sweep.shape)
    return {
        "parameters": [p.shown(int(j)) for p, j in zip(sweep.parameters, index, strict=True)],
        "numbers": point["values"],
        "failed": point["status"] != "ok",
        "says": point["reason"] if point["status"] != "ok" else ", ".join(map(str, point["warnings"])),
        "seconds": float(point["seconds"]),
    }


def cost(data: Mapping[str, Any]) -> dict[str, Any]:
    """Seconds of the points and of the last call, memory, workers."""
    seconds = [float(p["seconds"]) for p in data["points"]] or [0.0]
    workers = data["plan"].get("workers", 0)
    return {
        "total": math.fsum(seconds),
        "mean": math.fsum(seconds) / len(seconds),
        "least": min(seconds),
        "most": max(seconds),
        "call": data["cost"].get("this_call_s"),
        "memory": data["cost"].get("peak_rss_mb"),
        "kept": data["plan"].get("kept", 0),
        "where": _where(workers),
        "threads": data["plan"].get("threads", 1),
    }


def _where(workers: Any) -> str:
    if isinstance(workers, str):
        return f"the cluster {workers}"
    return f"{workers} process{'' if workers == 1 else 'es'}" if workers else "one process"
