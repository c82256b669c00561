"""The page of a sweep, from its folder: the grid, figures, failures, the table, cost and the scene.

Nothing of the folder is trusted to be whole.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from upd.labels import counted, listed, number, sentence, unit_label
from upd.plot import sweep_charts as charts
from upd.plot.answer_table import AnswerTable
from upd.report.folder import read_json
from upd.report.page import Section, Verdict, page_text, versions_text, write_page
from upd.report.tables import filled, sample_table, stage_table, with_unit
from upd.results.number import from_json
from upd.results.quantities import number_title
from upd.results.sampled import SampledNumber

#: kind of values -> keys of sweep.json
_KEYS = {str: "scene title text", list: "axes followed points", dict: "plan cost"}
#: values of a parameter written one by one
_FEW = 8
#: rows of the table on the page; all of them are in table.csv
MOST_ROWS = 500
#: different reasons of failures, and points named with each
_REASONS, _NAMED = 30, 8


@dataclass(frozen=True)
class SweepFolder:
    """A sweep folder: the content of sweep.json, its parameters, and its points in the grid's order
    with values, status, reason, warnings and seconds.
    """

    data: Mapping[str, Any]
    axes: tuple[charts.Parameter, ...]
    points: list[dict[str, Any]]

    @property
    def columns(self) -> list[charts.Column]:
        """The followed numbers with their values, NaN where there is none."""
        table = np.array([point["values"] for point in self.points], float)
        values = table.reshape(len(self.points), len(self.data["followed"])).T
        known = zip(self.data["followed"], values, strict=True)
        return [charts.Column(one["name"], one["case"], one["unit"], mine) for one, mine in known]

    @property
    def sampled(self) -> list[SampledNumber]:
        """What a sample makes of the numbers; nothing of a grid."""
        found = self.data.get("sample", {}).get("numbers", ())
        return [from_json(SampledNumber, one) for one in found]

    @property
    def places(self) -> list[tuple[int, ...]]:
        """Place along every parameter, point by point: a grid's last one fastest, of a sample all
        together.
        """
        if "sample" in self.data:
            return [(k,) * len(self.axes) for k in range(len(self.points))]
        return list(np.ndindex(*(len(p.values) for p in self.axes)))


def read_sweep(folder: Path) -> SweepFolder:
    """Read sweep.json. Raises InputError when it is missing or damaged."""
    found = read_json(folder / "sweep.json", _KEYS, "sweep")
    axes = [charts.Parameter(one["path"], tuple(one["values"])) for one in found["axes"]]
    return SweepFolder(found, charts.told_apart(axes), found["points"])


def write_sweep_report(folder: Path) -> Path:
    """Write report.html into a sweep folder, from what lies in it. Returns its path.

    Raises InputError when ``folder`` is no sweep folder, its sweep.json is damaged, or it cannot be
    written.
    """
    sweep = read_sweep(folder)
    data, kind = sweep.data, "Sample" if sweep.sampled else "Sweep"
    html = page_text(
        f"{kind}: {data['title'] or data['scene']}",
        sweep_sections(sweep),
        verdict=verdict(sweep.points),
        footer=f"Sweep folder {folder.resolve().name}. {versions_text(data.get('versions', {}))}",
    )
    return write_page(folder / "report.html", html)


def sweep_sections(sweep: SweepFolder) -> list[Section]:
    """The page of a sweep."""
    if sweep.sampled:
        drawn = charts.sample_charts(sweep.sampled, [c.values for c in sweep.columns])
    else:
        varied = [p.short for p in sweep.axes if len(p.values) > 1]
        over = f"Followed numbers over {' and '.join(varied)}"
        drawn = [replace(c, heading=over) for c in charts.sweep_charts(sweep.axes, sweep.columns)]
    cost = sweep.data["cost"]
    seconds = [p["seconds"] for p in sweep.points] or [0.0]
    total, memory = math.fsum(seconds), cost.get("peak_rss_mb", 0.0)
    each = f"{total / len(seconds):.2f} s per point ({min(seconds):.2f} to {max(seconds):.2f} s)"
    costs = f"{each}, {total:.1f} s for all together, {memory:.0f} MB of memory at most."
    none = "The sweep left no figures: nothing varies, or no point was solved."
    scene = "The scene of all points; the parameters above replace its entries."
    *before, points = (Section(one.heading, [one]) for one in sweep_tables(sweep, MOST_ROWS))
    return [
        _grid(sweep),
        *before,
        Section("Figures", charts=drawn, texts=[none] * (not drawn)),
        points,
        Section("Cost", [stage_table(cost.get("stages_s", {}))], texts=[costs]),
        Section("Scene file", texts=[scene], file=sweep.data["text"]),
    ]


def sweep_tables(sweep: SweepFolder, most: int) -> list[AnswerTable]:
    """What a sample makes of the numbers, which points failed or warn, at last the points.

    Parameters
    ----------
    most
        Points in the last one.
    """
    reasons = [[p["reason"] or "no reason given"] * (p["status"] != "ok") for p in sweep.points]
    return [
        sample_table(sweep.sampled),
        grouped("Failed points", sweep, reasons),
        grouped("Self-checks that warn", sweep, [p["warnings"] for p in sweep.points]),
        _points_table(sweep, most),
    ]


def _grid(sweep: SweepFolder) -> Section:
    """What was varied."""
    values = []
    for parameter in sweep.axes:
        shown = [parameter.shown(k) for k in range(len(parameter.values))]
        # of many the first and the last
        shown = shown if len(shown) <= _FEW else [*shown[:3], "...", shown[-1]]
        values.append(f"{', '.join(shown)} {unit_label(parameter.unit)}".rstrip())
    columns = {"parameter": [p.path for p in sweep.axes], "values": values}
    points, heading = counted(len(sweep.points), "point"), "Grid"
    text = f"{points}{': every value with every other' * (len(sweep.axes) > 1)}."
    if sample := sweep.data.get("sample"):
        heading = "Sample"
        given = ", ".join(f"{path} = {value}" for path, value in sample["inputs"].items())
        text = (
            "Drawn evenly between the limits that the half-widths give, with seed "
            f"{sample['seed']} (Latin hypercube), after the scene itself: {given}; {points}."
        )
    notes = map(sentence, sweep.data["plan"].get("notes", []))
    return Section(heading, [filled(heading, columns)], texts=[text, *notes])


def verdict(points: Sequence[Mapping[str, Any]]) -> Verdict:
    """How the points ended."""
    failed = sum(p["status"] != "ok" for p in points)
    warned = sum(bool(p["warnings"]) for p in points)
    counts = [f"{len(points) - failed} of {counted(len(points), 'point')} done"]
    counts += [f"{failed} failed"] * bool(failed) + [f"{warned} with warnings"] * bool(warned)
    kind, word = ("warning", "Done, with warnings") if warned else ("passed", "Done")
    if failed:
        every = failed == len(points)
        kind, word = ("failed", "Failed") if every else ("warning", "Done in part")
    return kind, word, f"{', '.join(counts)}."


def grouped(heading: str, sweep: SweepFolder, texts: Iterable[Iterable[str]]) -> AnswerTable:
    """Texts of the points, each once with the points it belongs to; the most frequent first."""
    found: dict[str, list[str]] = {}
    for place, mine in zip(sweep.places, texts, strict=True):
        label = ", ".join(p.with_unit(k) for p, k in zip(sweep.axes, place, strict=True))
        for text in mine:
            found.setdefault(text, []).append(label)
    ranked = sorted(found.items(), key=lambda item: -len(item[1]))[:_REASONS]
    columns = {
        "reason": [text for text, _ in ranked],
        "# points": [str(len(where)) for _, where in ranked],
        "which": [listed(where, _NAMED) for _, where in ranked],
    }
    return filled(heading, columns)


def _points_table(sweep: SweepFolder, most: int) -> AnswerTable:
    """A row for each of the first points, the numbers that vary first; those without a value have
    no column.
    """
    points, places = sweep.points[:most], sweep.places[:most]
    columns = {
        f"# {with_unit(p.short, p.unit)}": [p.shown(place[k]) for place in places]
        for k, p in enumerate(sweep.axes)
    }
    empty = []
    for one in sorted(sweep.columns, key=lambda column: charts.is_constant(column.values)):
        title, values = number_title(one.name, one.case), one.values[:most]
        if np.isnan(values).all():
            empty.append(title)
        columns[f"# {with_unit(title, one.unit)}"] = [
            "" if np.isnan(v) else number(float(v)) for v in values
        ]
    columns |= {
        "# time, s": [f"{p['seconds']:.2f}" for p in points],
        "status": [p["status"] for p in points],
        "reason or warnings": [
            ", ".join(filter(None, [p["reason"], *p["warnings"]])) for p in points
        ],
    }
    notes = [f"Without a value at every point: {'; '.join(empty)}."] * bool(empty)
    notes += [f"The first {most} of {len(sweep.points)} points."] * (len(sweep.points) > most)
    notes.append(
        "table.csv in the sweep folder holds all points with all digits, sweep.nc the same as "
        "arrays with named axes. A number without a unit is a ratio or a count."
    )
    return filled("Table", columns, " ".join(notes))
