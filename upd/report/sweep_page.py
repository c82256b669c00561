"""One sweep folder -> report.html.

The grid, the table, figures, failures, cost and the scene on one page that needs nothing beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from upd.labels import percent_of, unit_label
from upd.plot.sample_charts import sample_charts
from upd.plot.sweep_charts import Followed, sheet_name, sweep_charts
from upd.report.page import render, save, stages
from upd.report.panels import Panel, make_panels
from upd.report.sweep_folder import SweepFolder, read_sweep
from upd.results.quantities import number_label
from upd.results.sampled import SampledNumber, sample_sentence

#: rows of the table on the page; all of them are in table.csv
MOST_ROWS = 500
#: different reasons of failures, and points named with each
_REASONS, _NAMED = 30, 8


def write_sweep_report(folder: str | Path) -> Path:
    """Write report.html into a sweep folder, from what lies in it. Returns its path.

    Raises InputError when ``folder`` is no sweep folder, its sweep.json is damaged, or it cannot be
    written.
    """
    sweep = read_sweep(Path(folder))
    path = sweep.path / "report.html"
    save(path, render("sweep.html.j2", sweep_panels(sweep), [], sweep_context(sweep)))
    return path


def sweep_panels(sweep: SweepFolder) -> list[Panel]:
    """The sweep's figures with the charts that show the same."""
    if sweep.is_sample:
        return make_panels(sample_charts(sweep.sampled, list(sweep.table.T)), sweep.figures)
    numbers = followed(sweep)
    over = (
        "Followed numbers over "
        f"{' and '.join(p.short for p in sweep.parameters if len(p.values) > 1)}"
    )
    headings = {"sweep": over} | {
        sheet_name(n): _title(c) for n, c in zip(numbers, sweep.data["followed"], strict=True)
    }
    panels = make_panels(sweep_charts(sweep.parameters, numbers), sweep.figures)
    return [replace(panel, heading=headings.get(panel.name, over)) for panel in panels]


def followed(sweep: SweepFolder) -> list[Followed]:
    """The followed numbers with their values over the grid."""
    columns = zip(sweep.data["followed"], sweep.table.T, strict=True)
    return [
        Followed(column["name"], column["case"], column["unit"], values)
        for column, values in columns
    ]


def _title(column: Mapping[str, Any]) -> str:
    return number_label(column["name"]) + (f" ({column['case']})" if column["case"] else "")


def sweep_context(sweep: SweepFolder) -> dict[str, Any]:
    """What the template shows beside the figures."""
    data, points = sweep.data, sweep.data["points"]
    return {
        "sweep": sweep,
        "sampled": [_compared(one) for one in sweep.sampled],
        "resolved": all(one.resolved for one in sweep.sampled),
        "sample_says": sample_sentence(sweep.sampled),
        "title": f"{'Sample' if sweep.is_sample else 'Sweep'}: {data['title'] or data['scene']}",
        "verdict": verdict(points),
        "reasons": grouped(
            sweep,
            ((p["reason"] or "no reason given",) if p["status"] != "ok" else () for p in points),
        ),
        "warnings": grouped(sweep, (p["warnings"] for p in points)),
        "columns": [{"title": _title(c), "unit": c["unit"]} for c in data["followed"]],
        "rows": [_row(sweep, k, place) for k, place in enumerate(sweep.places[:MOST_ROWS])],
        "n_points": len(points),
        "cost": cost(data),
        "stages": stages({"stages": data["cost"].get("stages_s", {})}),
        "notes": data["plan"].get("notes", []),
        "versions": data.get("versions") or {"upd": data.get("version", "")},
    }


def _compared(one: SampledNumber) -> dict[str, Any]:
    """A row of the sample's table: the number with the first-order band and the sampled one."""
    ends = [percent_of(end) for end in (one.band_low, one.band_high) if end is not None]
    return one.as_dict() | {
        "title": number_label(one.name) + (f" ({one.case})" if one.case else ""),
        "first_order": "" if one.first_order is None else f"±{percent_of(one.first_order)}",
        "band": "" if one.band is None else f"±{percent_of(one.band)}",
        "ends": " to ".join(ends),
    }


def verdict(points: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Class of the mark, its word, and a sentence."""
    failed, told = (
        sum(p["status"] != "ok" for p in points),
        sum(bool(p["warnings"]) for p in points),
    )
    says = f"{len(points) - failed} of {_counted(len(points))} done"
    says += f", {failed} failed" if failed else ""
    says += f", {told} with warnings." if told else "."
    if points and failed == len(points):
        return {
            "kind": "failed",
            "word": "Failed",
            "says": f"None of {_counted(len(points))} could be solved.",
        }
    if failed:
        return {"kind": "warning", "word": "Done in part", "says": says}
    return {
        "kind": "warning" if told else "passed",
        "word": "Done, with warnings" if told else "Done",
        "says": says,
    }


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
    return ", ".join(
        f"{p.short} {p.shown(j)} {unit_label(p.unit)}".strip()
        for p, j in zip(sweep.parameters, sweep.places[k], strict=True)
    )


def _row(sweep: SweepFolder, k: int, place: tuple[int, ...]) -> dict[str, Any]:
    point = sweep.data["points"][k]
    return {
        "parameters": [p.shown(j) for p, j in zip(sweep.parameters, place, strict=True)],
        "numbers": point["values"],
        "failed": point["status"] != "ok",
        "says": point["reason"]
        if point["status"] != "ok"
        else ", ".join(map(str, point["warnings"])),
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
