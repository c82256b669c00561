"""The page of a sweep, from its folder: the grid, figures, failures, the table, cost and the scene;
and that of a study: which level is enough, what accuracy costs, the tables.

Nothing of the folder is trusted to be whole.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from upd.labels import number, unit_label
from upd.plot.chart import Array, Chart
from upd.plot.sweep_charts import FIGURES, Followed, sample_charts, sweep_charts
from upd.report.folder import damaged_file, is_png, read_json
from upd.report.page import (
    Panel,
    Section,
    Verdict,
    make_panels,
    page_text,
    versions_text,
    write_page,
)
from upd.report.tables import SAMPLE_HEADING, filled, sample_table, stage_table, with_unit
from upd.results.answer_table import AnswerTable
from upd.results.quantities import number_title
from upd.results.sampled import SampledNumber, sample_sentence

#: values of a parameter written one by one
_FEW = 8


@dataclass(frozen=True)
class Parameter:
    """One parameter of the grid.

    Its path, unit, values as the scene takes them, and as numbers (None when they are words).
    """

    path: str
    unit: str
    values: tuple[Any, ...]
    numbers: tuple[float, ...] | None

    @property
    def short(self) -> str:
        """Last word of the path."""
        return self.path.rpartition(".")[2].replace("_", " ")

    @property
    def text(self) -> str:
        """The values with their unit."""
        shown = [self.shown(k) for k in range(len(self.values))]
        unit = f" {unit_label(self.unit)}" if self.unit else ""
        if len(shown) <= _FEW:
            return ", ".join(shown) + unit
        if self.numbers is None:
            return f"{', '.join(shown[:_FEW])} and {len(shown) - _FEW} more"
        return f"{len(shown)} values from {min(self.numbers):.5g} to {max(self.numbers):.5g}{unit}"

    def shown(self, k: int) -> str:
        """Value `k` without the unit."""
        return str(self.values[k]) if self.numbers is None else f"{self.numbers[k]:.6g}"


@dataclass(frozen=True)
class SweepFolder:
    """Content of a sweep folder.

    Table: values (points, followed numbers), nan where there is none; points in the grid's order.
    """

    path: Path
    data: Mapping[str, Any]
    parameters: tuple[Parameter, ...]
    table: Array
    figures: Mapping[str, Path]

    @property
    def name(self) -> str:
        return self.path.resolve().name

    @property
    def places(self) -> list[tuple[int, ...]]:
        """Place along every parameter, point by point: a grid's last one fastest, of a sample all
        together.
        """
        if self.is_sample:
            return [(k,) * len(self.parameters) for k in range(len(self.data["points"]))]
        return list(np.ndindex(*(len(p.values) for p in self.parameters)))

    @property
    def is_sample(self) -> bool:
        """Whether its points are drawn from limits and no grid."""
        return "sample" in self.data

    @property
    def sampled(self) -> list[SampledNumber]:
        """What a sample makes of the followed numbers; empty for a grid."""
        found = self.data["sample"]["numbers"] if self.is_sample else []
        return [SampledNumber(**one) for one in found]


@dataclass
class _SweepAxis:
    path: str
    unit: str
    values: list[Any]


@dataclass
class _SweepFollowed:
    name: str
    case: str
    unit: str


@dataclass
class _SweepPoint:
    values: list[float | None]
    status: str
    reason: str
    warnings: list[Any]
    seconds: float


@dataclass
class _SweepCost:
    this_call_s: float | None = None
    peak_rss_mb: float | None = None
    stages_s: dict[str, float | None] = field(default_factory=dict)


@dataclass
class _SweepSample:
    seed: int
    inputs: dict[str, Any]
    numbers: list[SampledNumber]


@dataclass
class _Sweep:
    """What sweep.json must have for a page."""

    scene: str
    title: str
    axes: list[_SweepAxis]
    followed: list[_SweepFollowed]
    plan: dict[str, Any]
    cost: _SweepCost
    points: list[_SweepPoint]
    text: str
    sample: _SweepSample | None = None


def read_sweep(folder: Path) -> SweepFolder:
    """Read sweep.json and find the figures. Raises InputError when it is missing or damaged."""
    path = folder / "sweep.json"
    data = read_json(path, _Sweep, "sweep")
    counts, m = [len(axis["values"]) for axis in data["axes"]], len(data["followed"])
    n = min(counts, default=0) if "sample" in data else math.prod(counts)
    damaged = ["points"] * (
        len(data["points"]) != n or any(len(p["values"]) != m for p in data["points"])
    )
    damaged += ["sample"] * ("sample" in data and len(data["sample"]["numbers"]) != m)
    if damaged:
        raise damaged_file(path, damaged, "sweep")
    parameters = tuple(_parameter(axis) for axis in data["axes"])
    table = np.array([point["values"] for point in data["points"]], float).reshape(n, m)
    files = {name: folder / f"{name}.png" for name in FIGURES}
    figures = {name: file for name, file in files.items() if is_png(file)}
    return SweepFolder(folder, data, parameters, table, figures)


def _parameter(axis: Mapping[str, Any]) -> Parameter:
    values, unit = tuple(axis["values"]), axis["unit"]
    try:
        # "350 N" with the unit N; true and false are words.
        numbers = (
            None
            if any(isinstance(v, bool) for v in values)
            else tuple(float(str(v).removesuffix(unit)) for v in values)
        )
    except ValueError:
        numbers = None
    return Parameter(axis["path"], unit, values, numbers)


#: rows of the table on the page; all of them are in table.csv
MOST_ROWS = 500
#: different reasons of failures, and points named with each
_REASONS, _NAMED = 30, 8
_WARN = "Self-checks that warn"


def write_sweep_report(folder: Path) -> Path:
    """Write report.html into a sweep folder, from what lies in it. Returns its path.

    Raises InputError when ``folder`` is no sweep folder, its sweep.json is damaged, or it cannot be
    written.
    """
    sweep = read_sweep(folder)
    data = sweep.data
    versions = data.get("versions") or {"upd": data.get("version", "")}
    html = page_text(
        f"{'Sample' if sweep.is_sample else 'Sweep'}: {data['title'] or data['scene']}",
        sweep_sections(sweep),
        verdict=verdict(data["points"]),
        footer=f"Sweep folder {sweep.name}. {versions_text(versions)}",
    )
    return write_page(sweep.path / "report.html", html)


def sweep_sections(sweep: SweepFolder) -> list[Section]:
    """The page of a sweep."""
    data, points = sweep.data, sweep.data["points"]
    reasons = [[p["reason"] or "no reason given"] * (p["status"] != "ok") for p in points]
    panels = sweep_panels(sweep)
    return [
        _grid(sweep),
        Section(
            SAMPLE_HEADING,
            [sample_table(sweep.sampled)],
            texts=[f"{sample_sentence(sweep.sampled)} sample.csv has all digits."]
            if sweep.sampled
            else [],
            kind="grid",
        ),
        Section("Failed points", [grouped("Failed points", sweep, reasons)]),
        Section(_WARN, [grouped(_WARN, sweep, [p["warnings"] for p in points])]),
        Section(
            "Figures",
            panels=panels,
            texts=[]
            if panels
            else ["The sweep left no figures: nothing varies, or no point was solved."],
        ),
        Section("Table", [_points_table(sweep)], kind="tall"),
        Section(
            "Cost", [stage_table(data["cost"].get("stages_s", {}))], texts=_costs(data), kind="grid"
        ),
        Section(
            "Scene file",
            texts=["The scene of all points; the parameters above replace its entries."],
            file=data["text"],
        ),
    ]


def _grid(sweep: SweepFolder) -> Section:
    """What was varied."""
    columns = {
        "parameter": [p.path for p in sweep.parameters],
        "# number of values": [str(len(p.values)) for p in sweep.parameters],
        "values": [p.text for p in sweep.parameters],
    }
    points = _counted(len(sweep.data["points"]))
    if not sweep.is_sample:
        every = "Every value with every other: " if len(sweep.parameters) > 1 else ""
        return Section("Grid", [filled("Grid", columns)], texts=[f"{every}{points}."])
    sample = sweep.data["sample"]
    given = ", ".join(f"{path} = {value}" for path, value in sample["inputs"].items())
    text = (
        "Drawn evenly between the limits that the half-widths give, with seed "
        f"{sample['seed']} (Latin hypercube), after the scene itself: {given}; {points}."
    )
    return Section("Sample", [filled("Sample", columns)], texts=[text])


def sweep_panels(sweep: SweepFolder) -> list[Panel]:
    """The sweep's figures with the charts that show the same."""
    if sweep.is_sample:
        return make_panels(sample_charts(sweep.sampled, list(sweep.table.T)), sweep.figures)
    numbers = followed(sweep)
    varied = [p.short for p in sweep.parameters if len(p.values) > 1]
    over = f"Followed numbers over {' and '.join(varied)}"
    panels = make_panels(sweep_charts(sweep.parameters, numbers), sweep.figures)
    return [replace(panel, heading=over) for panel in panels]


def followed(sweep: SweepFolder) -> list[Followed]:
    """The followed numbers with their values over the grid."""
    columns = zip(sweep.data["followed"], sweep.table.T, strict=True)
    return [Followed(c["name"], c["case"], c["unit"], values) for c, values in columns]


def verdict(points: Sequence[Mapping[str, Any]]) -> Verdict:
    """How the points ended."""
    failed = sum(p["status"] != "ok" for p in points)
    warned = sum(bool(p["warnings"]) for p in points)
    if points and failed == len(points):
        text = f"None of {_counted(len(points))} could be solved."
        return Verdict("failed", "Failed", text)
    text = f"{len(points) - failed} of {_counted(len(points))} done"
    text += f", {failed} failed" if failed else ""
    text += f", {warned} with warnings." if warned else "."
    if failed or warned:
        return Verdict("warning", "Done in part" if failed else "Done, with warnings", text)
    return Verdict("passed", "Done", text)


def _counted(n: int) -> str:
    return f"{n} point{'' if n == 1 else 's'}"


def grouped(heading: str, sweep: SweepFolder, texts: Iterable[Iterable[str]]) -> AnswerTable:
    """Texts of the points, each once with the points it belongs to; the most frequent first."""
    found: dict[str, list[int]] = {}
    for k, mine in enumerate(texts):
        for text in mine:
            found.setdefault(str(text), []).append(k)
    ranked = sorted(found.items(), key=lambda item: -len(item[1]))[:_REASONS]
    columns = {
        "reason": [text for text, _ in ranked],
        "# points": [str(len(where)) for _, where in ranked],
        "which": [
            "; ".join(_label(sweep, k) for k in where[:_NAMED])
            + (f" and {len(where) - _NAMED} more" if len(where) > _NAMED else "")
            for _, where in ranked
        ],
    }
    return filled(heading, columns)


def _label(sweep: SweepFolder, k: int) -> str:
    return ", ".join(
        f"{p.short} {p.shown(j)} {unit_label(p.unit)}".strip()
        for p, j in zip(sweep.parameters, sweep.places[k], strict=True)
    )


def _points_table(sweep: SweepFolder) -> AnswerTable:
    """A row per point; numbers without a value at any point have no column."""
    points, places = sweep.data["points"][:MOST_ROWS], sweep.places[:MOST_ROWS]
    columns = {
        f"# {with_unit(p.short, p.unit)}": [p.shown(place[k]) for place in places]
        for k, p in enumerate(sweep.parameters)
    }
    empty = []
    for one, values in zip(sweep.data["followed"], sweep.table[: len(points)].T, strict=True):
        title = number_title(one["name"], one["case"])
        if np.isnan(values).all():
            empty.append(title)
            continue
        columns[f"# {with_unit(title, one['unit'])}"] = [
            "" if np.isnan(v) else number(float(v)) for v in values
        ]
    columns |= {
        "# time, s": [f"{float(p['seconds']):.2f}" for p in points],
        "status": ["ok" if p["status"] == "ok" else "failed" for p in points],
        "reason or warnings": [
            ", ".join(map(str, p["warnings"])) if p["status"] == "ok" else p["reason"]
            for p in points
        ],
    }
    n = len(sweep.data["points"])
    notes = [f"Without a value at every point: {'; '.join(empty)}."] * bool(empty)
    notes += [f"The first {len(points)} of {n} points."] * (len(points) < n)
    notes.append(
        "table.csv in the sweep folder holds all points with all digits, sweep.nc the same as "
        "arrays with named axes. A number without a unit is a ratio or a count."
    )
    return filled("Table", columns, " ".join(notes))


def _costs(data: Mapping[str, Any]) -> list[str]:
    """Seconds of the points and of the last call, memory, workers."""
    seconds = [float(p["seconds"]) for p in data["points"]] or [0.0]
    total, cost, plan = math.fsum(seconds), data["cost"], data["plan"]
    text = (
        f"{total / len(seconds):.2f} s per point ({min(seconds):.2f} to {max(seconds):.2f} s), "
        f"{total:.1f} s for all points together"
    )
    if (memory := cost.get("peak_rss_mb")) is not None:
        text += f", {memory:.0f} MB of memory at most"
    if (call := cost.get("this_call_s")) is not None:
        workers, kept = plan.get("workers", 0), plan.get("kept", 0)
        where = f"the cluster {workers}" if isinstance(workers, str) else f"processes: {workers}"
        text += f". Last call: {call:.1f} s; {where}; threads of each: {plan.get('threads', 1)}"
        text += f"; points kept from earlier calls: {kept}" if kept else ""
    return [f"{text}.", *(f"{note[:1].upper()}{note[1:]}." for note in plan.get("notes", []))]


# ---------------------------------------------------------------- a study


def write_study_report(
    folder: Path,
    title: str,
    failed: int,
    notes: Sequence[str],
    tables: Iterable[AnswerTable],
    charts: Iterable[Chart],
    figures: Iterable[Path],
) -> Path:
    """Write report.html into a study folder; returns its path.

    Parameters
    ----------
    failed
        Points without an answer.
    notes
        Sentences the page opens with, as which level is enough.
    charts, figures
        What is drawn, and the PNG files that show the same.

    Raises
    ------
    InputError
        When it cannot be written.
    """
    text = " ".join([*([f"{failed} point{'s' * (failed != 1)} failed."] if failed else []), *notes])
    verdict = Verdict(*("warning", "Done in part") if failed else ("passed", "Done"), text)
    panels = make_panels(charts, {path.stem: path for path in figures})
    sections = [Section("Figures", panels=panels)]
    for one in map(_shown, tables):
        sections.append(Section(one.heading, [one], kind="tall", folded=len(sections) > 1))
    return write_page(folder / "report.html", page_text(title, sections, verdict=verdict))


def _shown(table: AnswerTable) -> AnswerTable:
    """Its columns but those of many words, which study.md has."""
    cells = list(zip(*table.rows, strict=True)) or [()] * len(table.columns)
    columns = {
        head.replace("\n", " "): mine
        for head, mine in zip(table.columns, cells, strict=True)
        if head not in table.spare
    }
    return filled(table.heading, columns)
