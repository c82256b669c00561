"""The page of a sweep, from its folder: the grid, figures, failures, the table, cost and the scene;
and that of a study: which level is enough, what accuracy costs, the tables.

Nothing of the folder is trusted to be whole.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from upd.labels import counted, number, sentence, unit_label
from upd.plot.chart import Chart
from upd.plot.sweep_charts import (
    Column,
    Parameter,
    is_constant,
    sample_charts,
    sweep_charts,
    told_apart,
)
from upd.report.folder import read_json
from upd.report.page import (
    Panel,
    Section,
    Verdict,
    make_panels,
    page_text,
    versions_text,
    write_page,
)
from upd.report.tables import filled, sample_table, stage_table, with_unit
from upd.results.answer_table import AnswerTable
from upd.results.quantities import number_title
from upd.results.sampled import SampledNumber

#: values of a parameter written one by one
_FEW = 8


@dataclass
class _SweepPoint:
    values: list[float | None]
    status: str
    reason: str
    warnings: list[str]
    seconds: float


@dataclass
class _SweepSample:
    seed: int
    inputs: dict[str, str]
    numbers: list[SampledNumber]


@dataclass
class SweepFolder:
    """What sweep.json must have for a page, points in the grid's order; there may be more."""

    scene: str
    title: str
    axes: Sequence[Parameter]
    followed: list[dict[str, str]]
    plan: dict[str, Any]
    cost: dict[str, Any]
    points: list[_SweepPoint]
    text: str
    sample: _SweepSample | None = None
    versions: dict[str, str] = field(default_factory=dict)
    path: Path = Path()

    @property
    def columns(self) -> list[Column]:
        """The followed numbers with their values, NaN where there is none."""
        table = np.array([point.values for point in self.points], float)
        values = table.reshape(len(self.points), len(self.followed)).T
        known = zip(self.followed, values, strict=True)
        return [Column(one["name"], one["case"], one["unit"], mine) for one, mine in known]

    @property
    def places(self) -> list[tuple[int, ...]]:
        """Place along every parameter, point by point: a grid's last one fastest, of a sample all
        together.
        """
        if self.sample is not None:
            return [(k,) * len(self.axes) for k in range(len(self.points))]
        return list(np.ndindex(*(len(p.values) for p in self.axes)))


def read_sweep(folder: Path) -> SweepFolder:
    """Read sweep.json. Raises InputError when it is missing or damaged."""
    _, found = read_json(folder / "sweep.json", SweepFolder, "sweep")
    return replace(found, path=folder, axes=told_apart(found.axes))


#: rows of the table on the page; all of them are in table.csv
MOST_ROWS = 500
#: different reasons of failures, and points named with each
_REASONS, _NAMED = 30, 8


def write_sweep_report(folder: Path) -> Path:
    """Write report.html into a sweep folder, from what lies in it. Returns its path.

    Raises InputError when ``folder`` is no sweep folder, its sweep.json is damaged, or it cannot be
    written.
    """
    sweep = read_sweep(folder)
    html = page_text(
        f"{'Sample' if sweep.sample else 'Sweep'}: {sweep.title or sweep.scene}",
        sweep_sections(sweep),
        verdict=verdict(sweep.points),
        footer=f"Sweep folder {folder.resolve().name}. {versions_text(sweep.versions)}",
    )
    return write_page(folder / "report.html", html)


def sweep_sections(sweep: SweepFolder) -> list[Section]:
    """The page of a sweep."""
    panels = sweep_panels(sweep)
    none = "The sweep left no figures: nothing varies, or no point was solved."
    scene = ["The scene of all points; the parameters above replace its entries."]
    *before, points = sweep_tables(sweep, MOST_ROWS)
    return [
        _grid(sweep),
        *(Section(table.heading, [table], kind="grid") for table in before),
        Section("Figures", panels=panels, texts=[] if panels else [none]),
        Section(points.heading, [points], kind="tall"),
        Section(
            "Cost",
            [stage_table(sweep.cost.get("stages_s", {}))],
            texts=[_costs(sweep)],
            kind="grid",
        ),
        Section("Scene file", texts=scene, file=sweep.text),
    ]


def sweep_tables(sweep: SweepFolder, most: int) -> list[AnswerTable]:
    """What a sample makes of the numbers, which points failed or warn, at last the points.

    Parameters
    ----------
    most
        Points in the last one.
    """
    numbers = sweep.sample.numbers if sweep.sample else []
    reasons = [[p.reason or "no reason given"] * (p.status != "ok") for p in sweep.points]
    return [
        sample_table(numbers),
        grouped("Failed points", sweep, reasons),
        grouped("Self-checks that warn", sweep, [p.warnings for p in sweep.points]),
        _points_table(sweep, most),
    ]


def _grid(sweep: SweepFolder) -> Section:
    """What was varied."""
    columns = {
        "parameter": [p.path for p in sweep.axes],
        "# number of values": [str(len(p.values)) for p in sweep.axes],
        "values": [_values(p) for p in sweep.axes],
    }
    points, sample = counted(len(sweep.points), "point"), sweep.sample
    text = f"{points}{': every value with every other' * (len(sweep.axes) > 1)}."
    if sample is not None:
        given = ", ".join(f"{path} = {value}" for path, value in sample.inputs.items())
        text = (
            "Drawn evenly between the limits that the half-widths give, with seed "
            f"{sample.seed} (Latin hypercube), after the scene itself: {given}; {points}."
        )
    heading, notes = "Sample" if sample else "Grid", map(sentence, sweep.plan.get("notes", []))
    return Section(heading, [filled(heading, columns)], texts=[text, *notes])


def _values(parameter: Parameter) -> str:
    """The values of a parameter with their unit, of many the first and the last."""
    shown = [parameter.shown(k) for k in range(len(parameter.values))]
    shown = shown if len(shown) <= _FEW else [*shown[:3], "...", shown[-1]]
    return f"{', '.join(shown)} {unit_label(parameter.unit)}".rstrip()


def sweep_panels(sweep: SweepFolder) -> list[Panel]:
    """The sweep's figures with the charts that show the same."""
    columns = sweep.columns
    if sweep.sample:
        charts = sample_charts(sweep.sample.numbers, [c.values for c in columns])
        return make_panels(charts, {})
    varied = [p.short for p in sweep.axes if len(p.values) > 1]
    over = f"Followed numbers over {' and '.join(varied)}"
    panels = make_panels(sweep_charts(sweep.axes, columns), {})
    return [replace(panel, heading=over) for panel in panels]


def verdict(points: Sequence[_SweepPoint]) -> Verdict:
    """How the points ended."""
    failed = sum(p.status != "ok" for p in points)
    warned = sum(bool(p.warnings) for p in points)
    if points and failed == len(points):
        text = f"None of {counted(len(points), 'point')} could be solved."
        return Verdict("failed", "Failed", text)
    text = f"{len(points) - failed} of {counted(len(points), 'point')} done"
    text += f", {failed} failed" if failed else ""
    text += f", {warned} with warnings." if warned else "."
    if failed or warned:
        return Verdict("warning", "Done in part" if failed else "Done, with warnings", text)
    return Verdict("passed", "Done", text)


def grouped(heading: str, sweep: SweepFolder, texts: Iterable[Iterable[str]]) -> AnswerTable:
    """Texts of the points, each once with the points it belongs to; the most frequent first."""
    found: dict[str, list[int]] = {}
    for k, mine in enumerate(texts):
        for text in mine:
            found.setdefault(str(text), []).append(k)
    labels = [
        ", ".join(p.with_unit(j) for p, j in zip(sweep.axes, place, strict=True))
        for place in sweep.places
    ]
    ranked = sorted(found.items(), key=lambda item: -len(item[1]))[:_REASONS]
    columns = {
        "reason": [text for text, _ in ranked],
        "# points": [str(len(where)) for _, where in ranked],
        "which": [
            "; ".join(labels[k] for k in where[:_NAMED])
            + (f" and {len(where) - _NAMED} more" if len(where) > _NAMED else "")
            for _, where in ranked
        ],
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
    for one in sorted(sweep.columns, key=lambda column: is_constant(column.values)):
        title, values = number_title(one.name, one.case), one.values[:most]
        if np.isnan(values).all():
            empty.append(title)
            continue
        columns[f"# {with_unit(title, one.unit)}"] = [
            "" if np.isnan(v) else number(float(v)) for v in values
        ]
    columns |= {
        "# time, s": [f"{p.seconds:.2f}" for p in points],
        "status": ["ok" if p.status == "ok" else "failed" for p in points],
        "reason or warnings": [
            ", ".join(p.warnings) if p.status == "ok" else p.reason for p in points
        ],
    }
    n = len(sweep.points)
    notes = [f"Without a value at every point: {'; '.join(empty)}."] * bool(empty)
    notes += [f"The first {len(points)} of {n} points."] * (len(points) < n)
    notes.append(
        "table.csv in the sweep folder holds all points with all digits, sweep.nc the same as "
        "arrays with named axes. A number without a unit is a ratio or a count."
    )
    return filled("Table", columns, " ".join(notes))


def _costs(sweep: SweepFolder) -> str:
    """Seconds of the points, memory."""
    seconds = [p.seconds for p in sweep.points] or [0.0]
    total, memory = math.fsum(seconds), sweep.cost.get("peak_rss_mb")
    text = (
        f"{total / len(seconds):.2f} s per point ({min(seconds):.2f} to {max(seconds):.2f} s), "
        f"{total:.1f} s for all points together"
    )
    return f"{text}." if memory is None else f"{text}, {memory:.0f} MB of memory at most."


# ---------------------------------------------------------------- a study


def write_study_report(
    folder: Path,
    title: str,
    failed: int,
    notes: Sequence[str],
    tables: Iterable[AnswerTable],
    charts: Iterable[Chart],
) -> Path:
    """Write report.html into a study folder; returns its path.

    Parameters
    ----------
    failed
        Points without an answer.
    notes
        Sentences the page opens with, as which level is enough.

    Raises
    ------
    InputError
        When it cannot be written.
    """
    text = " ".join([*([f"{counted(failed, 'point')} failed."] if failed else []), *notes])
    verdict = Verdict(*("warning", "Done in part") if failed else ("passed", "Done"), text)
    sections = [Section("Figures", panels=make_panels(charts, {}))]
    for one in tables:
        columns = dict(zip(one.columns, zip(*one.rows, strict=True), strict=False))
        table = filled(one.heading, columns)
        sections.append(Section(one.heading, [table], kind="tall", folded=len(sections) > 1))
    return write_page(folder / "report.html", page_text(title, sections, verdict=verdict))
