"""Several run folders -> one page: numbers side by side, the same charts overlaid, the entries in
which the scenes differ.
"""

from __future__ import annotations

import os
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from upd.errors import InputError
from upd.labels import number, percent, shown, unit_label
from upd.plot.chart import Chart, Entry
from upd.plot.style import colour_range
from upd.report.folder import RunFolder, read_run
from upd.report.page import Section, make_panels, page_text, write_page
from upd.report.run_page import verdict
from upd.report.tables import analysis_charts, filled, main_numbers
from upd.results.answer_table import AnswerTable
from upd.results.quantities import number_label
from upd.scene.read import leaves


def write_comparison(folders: Sequence[str | Path], path: str | Path) -> Path:
    """Write the page that compares the runs in ``folders`` to ``path``. Raises InputError."""
    target = Path(path)
    if len(folders) < 2:
        raise InputError("a comparison needs two runs or more: give their folders")
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{target}: a comparison is a page; give a name that ends in .html")
    runs = [read_run(Path(folder)) for folder in folders]
    names = run_names(runs)
    title = f"Comparison of {', '.join(names[:-1])} and {names[-1]}"
    return write_page(target, page_text(title, comparison_sections(runs, names)))


def run_names(runs: Sequence[RunFolder]) -> list[str]:
    """Names of the run folders, from the folder that holds them all."""
    paths = [run.path.resolve() for run in runs]
    if len(set(paths)) < len(paths):
        raise InputError("a folder is duplicated; to fix it: give each folder once")
    common = os.path.commonpath(paths)
    return [str(path.relative_to(common)) for path in paths]


def comparison_sections(runs: Sequence[RunFolder], names: Sequence[str]) -> list[Section]:
    """The page of several runs."""
    results = [run.summary["results"] for run in runs]
    charts = overlaid([analysis_charts(run.arrays, run.summary) for run in runs], names)
    scenes = [run.summary["scene_file"] for run in runs]
    differ = differences(scenes)
    main = {
        (entry["name"], entry["case"])
        for run, rows in zip(runs, results, strict=True)
        for entry in main_numbers(run.summary["size"], rows)
    }
    first, others = numbers(results, names, main)
    about = "Every run has one colour; points and lines are those of its own page."
    return [
        Section(
            "Main numbers",
            [first],
            texts=["A number without a unit is a ratio or a count."],
            kind="grid",
        ),
        Section("Runs", [_runs_table(runs, names)]),
        Section(
            "In what the scenes differ",
            [AnswerTable("In what the scenes differ", ("entry", *names), differ)],
            texts=[] if differ else ["In nothing."],
            kind="grid",
        ),
        Section("Figures", panels=make_panels(charts, {}), texts=[about]),
        Section("All other numbers", [others], kind="grid"),
        *(
            Section(f"Scene file of {name}", file=run.scene)
            for name, run in zip(names, runs, strict=True)
        ),
    ]


def _runs_table(runs: Sequence[RunFolder], names: Sequence[str]) -> AnswerTable:
    verdicts = [verdict(run.summary) for run in runs]
    sizes = [sum(run.summary["size"].get("n_dof", {}).values()) for run in runs]
    columns = {
        "run": names,
        "scene": [run.summary["title"] or run.summary["scene"] for run in runs],
        "verdict": [f"{mark.word}. {mark.text}" for mark in verdicts],
        "# degrees of freedom": [str(size) for size in sizes],
        "# seconds": [f"{run.summary['cost']['total_s']:.1f}" for run in runs],
    }
    return filled("Runs", columns)


def numbers(
    results: Sequence[Sequence[Entry]], names: Sequence[str], main: Container[tuple[str, str]]
) -> tuple[AnswerTable, AnswerTable]:
    """Numbers of all runs side by side, in the order of the first run that has them: the main ones
    (name and case), and all others.
    """
    tables = [{(r["name"], r["case"]): r for r in rows} for rows in results]
    keys = list(dict.fromkeys(key for table in tables for key in table))
    return (
        _side_by_side("Main numbers", [key for key in keys if key in main], tables, names),
        _side_by_side("All other numbers", [key for key in keys if key not in main], tables, names),
    )


def _side_by_side(
    heading: str,
    keys: Sequence[tuple[str, str]],
    tables: Sequence[Mapping[tuple[str, str], Entry]],
    names: Sequence[str],
) -> AnswerTable:
    found = [[table.get(key) for table in tables] for key in keys]
    references = [{row["reference"] for row in rows if row is not None} for rows in found]
    known = [next(row for row in rows if row is not None) for rows in found]
    # runs of other loads have another reference
    shared = [
        row if len(values) == 1 else {**row, "reference": None}
        for row, values in zip(known, references, strict=True)
    ]
    columns = {
        "number": [number_label(name) for name, _ in keys],
        "case": [case for _, case in keys],
        **{
            f"# {name}": ["" if (row := rows[k]) is None else shown(row) for rows in found]
            for k, name in enumerate(names)
        },
        f"# largest difference from {names[0]}": [percent(_spread(rows)) for rows in found],
        "# reference": [number(row["reference"], unit_label(row["unit"])) for row in shared],
        "source": [row["source"] if row["reference"] is not None else "" for row in shared],
    }
    return filled(heading, columns)


def _spread(rows: Sequence[Entry | None]) -> float | None:
    """Largest difference from the first run, as a fraction."""
    values = [None if row is None else row["value"] for row in rows]
    first = values[0]
    if not first or any(v is None for v in values):
        return None
    return float(max((v / first - 1.0 for v in values[1:]), key=abs))


def overlaid(runs: Sequence[Sequence[Chart]], names: Sequence[str]) -> list[Chart]:
    """The same chart of every run in one, a colour per run.

    Maps, which cannot lie on each other, become cases of one place.
    """
    charts = [(k, chart) for k, mine in enumerate(runs) for chart in mine]
    out: list[Chart] = []
    for key in dict.fromkeys((c.title, c.case) for _, c in charts):
        mine = [(k, c) for k, c in charts if (c.title, c.case) == key]
        # another cannot lie on what fills its place
        if any(c.maps or c.scatters or any(area.state for area in c.areas) for _, c in mine):
            out += [
                replace(c, title=f"{c.title}: {names[k]}", heading=c.title, figure=c.title)
                for k, c in _alike(mine)
            ]
        else:
            out.append(_together(mine, names))
    return out


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
        x=first.x
        if all(c.x == first.x for _, c in mine)
        else replace(first.x, low=None, high=None),
        y=first.y
        if all(c.y == first.y for _, c in mine)
        else replace(first.y, low=None, high=None),
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
    )


def differences(scenes: Sequence[Mapping[str, Any]]) -> tuple[tuple[str, ...], ...]:
    """Entries of the scene files that are not the same in all runs: path and the value of every
    run.
    """
    flat = [{path: str(value) for path, value in leaves("", scene)} for scene in scenes]
    paths = dict.fromkeys(path for entries in flat for path in entries)
    rows = ((path, *(entries.get(path, "–") for entries in flat)) for path in paths)
    return tuple(row for row in rows if len(set(row[1:])) > 1)
