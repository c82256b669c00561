"""Several run folders -> one page.

Numbers side by side, the same charts overlaid, the lines in which the scenes differ.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from upd.errors import InputError
from upd.plot.chart import Axis, Chart, Entry
from upd.plot.style import COLOURS, colour_range
from upd.report.folder import RunFolder, read_run
from upd.report.page import render, save, stages, verdict
from upd.report.panels import charts_of, make_panels


@dataclass(frozen=True)
class Line:
    """A number of several runs: one value per run, None where a run has none."""

    name: str
    case: str
    unit: str
    values: tuple[float | None, ...]
    reference: float | None
    source: str

    @property
    def spread(self) -> float | None:
        """Largest difference from the first run, as a fraction."""
        first = self.values[0]
        if not first or any(v is None for v in self.values):
            return None
        return max((v / first - 1.0 for v in self.values[1:] if v is not None), key=abs)


def write_comparison(folders: Sequence[str | Path], path: str | Path) -> Path:
    """Write the page that compares the runs in ``folders`` to ``path``. Raises InputError."""
    target = Path(path)
    if len(folders) < 2:
        raise InputError("a comparison needs two runs or more: give their folders")
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{target}: a comparison is a page; give a name that ends in .html")
    runs = [read_run(Path(folder)) for folder in folders]
    names = run_names(runs)
    charts = overlaid([charts_of(run).charts(run.arrays, run.summary) for run in runs], names)
    save(target, render("compare.html.j2", make_panels(charts, {}), [], context(runs, names)))
    return target


def run_names(runs: Sequence[RunFolder]) -> list[str]:
    """Names of the run folders, with as much of their paths as tells them apart."""
    paths = [run.path.resolve() for run in runs]
    if len(set(paths)) < len(paths):
        raise InputError("a folder is duplicated; to fix it: give each folder once")
    depth = 1
    while len({p.parts[-depth:] for p in paths}) < len(paths):
        depth += 1
    return [str(Path(*p.parts[-depth:])) for p in paths]


def context(runs: Sequence[RunFolder], names: Sequence[str]) -> dict[str, Any]:
    """What the template shows beside the figures."""
    headlines = [
        row for run in runs for row in charts_of(run).headline(list(run.summary["results"]))
    ]
    main = dict.fromkeys((row["name"], row["case"]) for row in headlines)
    lines = numbers([run.summary["results"] for run in runs])
    return {
        "title": "Comparison of " + (", ".join(names[:-1]) + " and " + names[-1]),
        "names": names,
        "colours": [COLOURS[k % len(COLOURS)] for k in range(len(names))],
        "titles": [run.summary["title"] or run.summary["scene"] for run in runs],
        "verdicts": [verdict(run) for run in runs],
        "headline": [line for line in lines if (line.name, line.case) in main],
        "lines": [line for line in lines if (line.name, line.case) not in main],
        "costs": costs([run.summary["cost"] for run in runs]),
        "sizes": [sum(run.summary["size"].get("n_dof", {}).values()) for run in runs],
        "scenes": marked([run.scene for run in runs]),
        "differences": differences([run.summary["scene_file"] for run in runs]),
    }


def numbers(results: Sequence[Sequence[Entry]]) -> list[Line]:
    """Numbers of all runs, in the order of the first that has them."""
    tables = [{(r["name"], r["case"]): r for r in rows} for rows in results]
    keys = dict.fromkeys(key for table in tables for key in table)
    out = []
    for name, case in keys:
        mine = [table.get((name, case)) for table in tables]
        any_row = next(row for row in mine if row is not None)
        references = {row["reference"] for row in mine if row is not None}
        reference = references.pop() if len(references) == 1 else None
        values = tuple(
            None if row is None or row["value"] is None else float(row["value"]) for row in mine
        )
        out.append(
            Line(
                name,
                case,
                any_row["unit"],
                values,
                reference,
                any_row["source"] if reference is not None else "",
            )
        )
    return out


def overlaid(runs: Sequence[Sequence[Chart]], names: Sequence[str]) -> list[Chart]:
    """The same chart of every run in one, a colour per run.

    Maps and pies, which cannot lie on each other, become cases of one place.
    """
    charts = [(k, chart) for k, mine in enumerate(runs) for chart in mine]
    out: list[Chart] = []
    for key in dict.fromkeys((c.title, c.case) for _, c in charts):
        mine = [(k, c) for k, c in charts if (c.title, c.case) == key]
        if any(_fills(c) for _, c in mine):
            out += [
                replace(c, title=f"{c.title}: {names[k]}", heading=c.title, figure=c.title)
                for k, c in _alike(mine)
            ]
        else:
            out.append(_together(mine, names))
    return out


def _fills(chart: Chart) -> bool:
    """Whether a chart fills its place, so that another cannot lie on it."""
    return bool(
        chart.maps or chart.pies or chart.scatters or any(area.state for area in chart.areas)
    )


def _alike(mine: Sequence[tuple[int, Chart]]) -> Iterator[tuple[int, Chart]]:
    """Charts of several runs with the ends of one colour scale."""
    low, top = colour_range([m for _, c in mine for m in c.maps if not m.states])
    least, most = colour_range([s for _, c in mine for s in c.scatters])
    for k, c in mine:
        maps = tuple(m if m.states else replace(m, low=low, top=top) for m in c.maps)
        yield (
            k,
            replace(
                c,
                maps=maps,
                scatters=tuple(
                    replace(s, axis=replace(s.axis, low=least, high=most)) for s in c.scatters
                ),
            ),
        )


def _together(mine: Sequence[tuple[int, Chart]], names: Sequence[str]) -> Chart:
    """Charts of several runs as one.

    Every run has one colour, its curves, marks and areas share it; limits are drawn once.
    """
    first = mine[0][1]
    return replace(
        first,
        figure=first.title,
        x=_axis([c.x for _, c in mine]),
        y=_axis([c.y for _, c in mine]),
        detail=first.detail if all(c.detail == first.detail for _, c in mine) else "",
        traces=tuple(
            replace(t, label=f"{names[k]}: {t.label}", entry=names[k], colour=k, closed=False)
            for k, c in mine
            for t in c.traces
        ),
        marks=tuple(replace(m, colour=k, closed=False) for k, c in mine for m in c.marks),
        areas=tuple(
            replace(a, label=f"{names[k]}: {a.label}", colour=k) for k, c in mine for a in c.areas
        ),
        bands=tuple(dict.fromkeys(band for _, c in mine for band in c.bands)),
        bars=tuple(
            replace(b, cases=tuple(f"{names[k]}: {case}" for case in b.cases))
            for k, c in mine
            for b in c.bars
        ),
    )


def _axis(axes: Sequence[Axis]) -> Axis:
    """The first axis with ends beyond those of all."""
    lows, highs = (
        [a.low for a in axes if a.low is not None],
        [a.high for a in axes if a.high is not None],
    )
    low, high = (
        min(lows) if len(lows) == len(axes) else None,
        max(highs) if len(highs) == len(axes) else None,
    )
    return replace(axes[0], low=low, high=high)


def costs(tables: Sequence[Mapping[str, Any]]) -> list[tuple[str, list[float | None]]]:
    """Seconds of every stage, per run."""
    per_run = [{s["name"]: float(s["seconds"]) for s in stages(table)} for table in tables]
    names = dict.fromkeys(name for table in per_run for name in table)
    return [(name, [table.get(name) for table in per_run]) for name in names]


def marked(texts: Sequence[str]) -> list[list[tuple[str, bool]]]:
    """Lines of every scene file, each with whether it differs from the first scene (in the first:
    from any other).
    """
    lines = [text.splitlines() for text in texts]
    out = []
    for k, mine in enumerate(lines):
        others = lines[1:] if k == 0 else lines[:1]
        same = set(range(len(mine)))
        for other in others:
            blocks = difflib.SequenceMatcher(
                None, mine, other, autojunk=False
            ).get_matching_blocks()
            same &= {i for block in blocks for i in range(block.a, block.a + block.size)}
        out.append([(line, i not in same) for i, line in enumerate(mine)])
    return out


def differences(scenes: Sequence[Mapping[str, Any]]) -> list[tuple[str, list[str]]]:
    """Entries of the scene files that are not the same in all runs.

    Path and the value of every run.
    """
    flat = [_flat(scene) for scene in scenes]
    paths = dict.fromkeys(path for entries in flat for path in entries)
    found = [(path, [entries.get(path, "–") for entries in flat]) for path in paths]
    return [(path, values) for path, values in found if len(set(values)) > 1]


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    out: dict[str, str] = {}
    for key, value in table.items():
        path = f"{prefix}{key}"
        out |= _flat(value, f"{path}.") if isinstance(value, Mapping) else {path: _plain(value)}
    return out


def _plain(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)
