"""Pages of runs: report.html of one, with numbers, figures, errors, checks, cost, scene file; of
several, numbers side by side, the same charts overlaid, entries in which the scenes differ.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from upd.cache.folders import plain_name
from upd.errors import InputError
from upd.labels import number, percent, sentence, shown
from upd.plot.answer_table import AnswerTable
from upd.plot.chart import Chart, Entry
from upd.plot.style import colour_range
from upd.plot.surface import read_surface
from upd.report import tables
from upd.report.answer import checked
from upd.report.folder import RunFolder, read_run
from upd.report.page import Section, Verdict, page_text, write_page
from upd.results.check import FAILED, WARNED, outcome_of
from upd.results.quantities import number_label
from upd.scene.read import leaves

log = logging.getLogger("upd.report")

#: how the line of the log with the packages begins
_VERSIONS = "versions: "
#: below tables of numbers
UNITS = "A number without a unit is a ratio or a count."


def write_run_report(folder: Path) -> Path:
    """Write report.html into a run folder, from what lies in it. Returns its path.

    Raises InputError when ``folder`` is no run folder or cannot be written.
    """
    run = read_run(folder)
    title = run.summary["title"] or run.summary["scene"]
    started = f", run on {run.log[0]['time'].partition(',')[0]}" if run.log else ""
    found = (line["text"] for line in run.log if line["text"].startswith(_VERSIONS))
    footer = f"Run folder {plain_name(run.path)}{started}. {sentence(next(found, ''))}".rstrip()
    html = page_text(title, run_sections(run), verdict=verdict(run.summary), footer=footer)
    return write_page(run.path / "report.html", html)


def run_sections(run: RunFolder) -> list[Section]:
    """The page of one run."""
    summary, entries = run.summary, run.summary["results"]
    size, cost = summary["size"], summary["cost"]
    charts, surfaces = tables.analysis_charts(run.arrays, summary), run_surfaces(run)
    estimated = any(entry.get("estimated_error") is not None for entry in entries)
    errors = "Errors (±) bound what mesh and methods leave in a number: see the error budget."
    about = [errors if estimated else "No errors were estimated.", UNITS]
    main = tables.answer_tables(size, entries)
    no_figures = ["The run left no figures."] * (not (charts or run.figures or surfaces))
    total = f"{cost['total_s']:.1f} s in all, {cost['peak_rss_mb']:.0f} MB of memory at most."
    return [
        Section("Main numbers", main, texts=about if main else ["The run left no numbers."]),
        Section("Warnings", notes=page_warnings(run)),
        Section(
            "Figures", charts=charts, pictures=run.figures, surfaces=surfaces, texts=no_figures
        ),
        Section("Error budget", [tables.budget_table(tables.main_numbers(size, entries))]),
        Section(
            "What was simulated, what was left out",
            [tables.effects_table(summary["effects"]), tables.checks_table(summary["checks"])],
        ),
        Section(
            "Cost and mesh",
            [tables.stage_table(cost.get("stages", {})), _mesh_table(size)],
            texts=[total],
        ),
        Section("All numbers", tables.all_numbers(entries), each_folded=True),
        Section(
            "Scene file",
            texts=["Save as scene.toml and run upd run scene.toml."],
            file=run.scene,
        ),
    ]


def _mesh_table(size: Mapping[str, Any]) -> AnswerTable:
    """Elements and degrees of freedom of the bodies."""
    dofs = size.get("n_dof", {})
    columns = {
        "body": list(dofs),
        "# hexahedra": [str(size.get("n_hex", {}).get(body, "")) for body in dofs],
        "# degrees of freedom": [str(count) for count in dofs.values()],
    }
    pairs = f"{size['n_pairs']} contact pairs." if size.get("n_pairs") else ""
    return tables.filled(f"Mesh, {size.get('symmetry', 'whole')} model", columns, pairs)


def verdict(summary: Mapping[str, Any]) -> Verdict:
    """How a run ended, with its self-checks."""
    status = str(summary["status"])
    if (outcome := outcome_of(status)) == FAILED:
        return "failed", "Failed", status.removeprefix("failed: ")
    kind, word = ("warning", "Done, with warnings") if outcome == WARNED else ("passed", "Passed")
    return kind, word, f"{checked(summary)}."


def page_warnings(run: RunFolder) -> list[str]:
    """What a run warns of, the warnings of its log that are no check's, and the files that could
    not be read; each once.
    """
    summary = run.summary
    found = tables.warnings(summary["checks"], summary["results"])
    for line in run.log:
        # faults of the solvers are among the checks
        known = bool(summary["checks"]) and line["where"].startswith("upd.hbm")
        known |= line["text"] == summary["status"]
        if line["level"] in ("WARNING", "ERROR", "CRITICAL") and not known:
            found.append(sentence(line["text"], ""))
    return list(dict.fromkeys([*found, *run.missing]))


def run_surfaces(run: RunFolder) -> list[dict[str, Any]]:
    """Surfaces of the run's VTU files: fields of a contact, else modes, else the bare mesh."""
    contact = [f for f in (run.path / "fields.vtu", run.path / "mesh.vtu") if f.exists()][:1]
    files = contact or sorted(
        run.path.glob("modes_*.vtu"), key=lambda f: ("glued" not in f.stem, "asymmetric" in f.stem)
    )
    # in the order of their numbers in the files
    counts = run.summary["size"].get("n_dof", {})
    bodies = list(dict.fromkeys(key.partition(",")[0] for key in counts))
    glued = [name for name in bodies if name not in ("left", "right")] or bodies
    out = []
    for file in files:
        label = file.stem.removeprefix("modes_").replace("_", ", ")
        try:
            out.append(read_surface(file, glued if "glued" in file.stem else bodies, label))
        except (OSError, ValueError, KeyError) as problem:
            log.warning("%s: no three-dimensional view (%s)", file.name, problem)
    return out


# ---------------------------------------------------------------- several runs


def write_comparison(folders: Sequence[str | Path], path: str | Path) -> Path:
    """Write one page that shows several runs side by side to ``path`` (.html); returns it.

    Raises InputError when a folder is no run, there are fewer than two, or the place cannot be
    written.
    """
    target = Path(path)
    if any((Path(folder) / "sweep.json").is_file() for folder in folders):
        raise InputError("a comparison is of runs: give each sweep's folder by itself")
    if len(folders) < 2:
        raise InputError("a comparison needs two runs or more: give their folders")
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{target}: a comparison is a page; give a name that ends in .html")
    runs = [read_run(Path(folder)) for folder in folders]
    paths = [run.path.resolve() for run in runs]
    if len(set(paths)) < len(paths):
        raise InputError("a folder is duplicated; to fix it: give each folder once")
    # from the folder that holds them all
    common = os.path.commonpath(paths)
    names = [str(path.relative_to(common)) for path in paths]
    title = f"Comparison of {', '.join(names[:-1])} and {names[-1]}"
    return write_page(target, page_text(title, comparison_sections(runs, names)))


def comparison_sections(runs: Sequence[RunFolder], names: Sequence[str]) -> list[Section]:
    """The page of several runs."""
    charts = overlaid([tables.analysis_charts(run.arrays, run.summary) for run in runs], names)
    differ = differences([run.summary["scene_file"] for run in runs])
    results = [run.summary["results"] for run in runs]
    main = {
        (entry["name"], entry["case"])
        for run in runs
        for entry in tables.main_numbers(run.summary["size"], run.summary["results"])
    }
    first, others = numbers(results, names, main)
    about = "Every run has one colour; points and lines are those of its own page."
    heading = "In what the scenes differ"
    table = AnswerTable(heading, ("entry", *names), differ)
    verdicts = [verdict(run.summary) for run in runs]
    columns = {
        "run": names,
        "scene": [run.summary["title"] or run.summary["scene"] for run in runs],
        "verdict": [f"{word}. {text}" for _, word, text in verdicts],
        "# seconds": [f"{run.summary['cost']['total_s']:.1f}" for run in runs],
    }
    return [
        Section("Main numbers", [first], texts=[UNITS]),
        Section("Runs", [tables.filled("Runs", columns)]),
        Section(heading, [table], texts=["In nothing."] * (not differ)),
        Section("Figures", charts=charts, texts=[about]),
        Section("All other numbers", [others]),
    ]


def numbers(
    results: Sequence[Sequence[Entry]], names: Sequence[str], main: Container[tuple[str, str]]
) -> list[AnswerTable]:
    """Numbers of all runs side by side, in the order of the first run that has them: the main ones
    (name and case), and all others.
    """
    known = [{(r["name"], r["case"]): r for r in rows} for rows in results]
    keys = list(dict.fromkeys(key for rows in known for key in rows))
    parts = {
        "Main numbers": [key for key in keys if key in main],
        "All other numbers": [key for key in keys if key not in main],
    }
    out = []
    for heading, mine in parts.items():
        found = [[rows.get(key) for rows in known] for key in mine]
        given = [{(row["reference"], row["source"]) for row in rows if row} for rows in found]
        # runs of other loads have another reference
        references = [next(iter(one)) if len(one) == 1 else (None, "") for one in given]
        columns = {
            "number": [number_label(name) for name, _ in mine],
            "case": [case for _, case in mine],
            **{
                f"# {name}": ["" if (row := rows[k]) is None else shown(row) for rows in found]
                for k, name in enumerate(names)
            },
            f"# largest difference from {names[0]}": [percent(_spread(rows)) for rows in found],
            "# reference": [number(value) for value, _ in references],
            "source": [source if value is not None else "" for value, source in references],
        }
        out.append(tables.filled(heading, columns))
    return out


def _spread(rows: Sequence[Entry | None]) -> float | None:
    """Largest difference from the first run, as a fraction."""
    first, *others = [None if row is None else row["value"] for row in rows]
    if not first or None in others:
        return None
    return float(max((value / first - 1.0 for value in others), key=abs))


def overlaid(runs: Sequence[Sequence[Chart]], names: Sequence[str]) -> list[Chart]:
    """The same chart of every run in one, a colour per run.

    Maps, which cannot lie on each other, become cases of one place, with one colour scale.
    """
    alike: dict[tuple[str, str], list[tuple[int, Chart]]] = {}
    for k, mine in enumerate(runs):
        for c in mine:
            alike.setdefault((c.title, c.case), []).append((k, c))
    out: list[Chart] = []
    for group in alike.values():
        charts = [c for _, c in group]
        low, top = colour_range([m for c in charts for m in c.maps if not m.states])
        least, most = colour_range([s for c in charts for s in c.scatters])
        # another cannot lie on what fills its place
        if not any(c.maps or c.scatters or any(area.state for area in c.areas) for c in charts):
            out.append(_together(group, names))
            continue
        for k, c in group:
            maps = tuple(m if m.states else replace(m, low=low, top=top) for m in c.maps)
            dots = tuple(replace(s, axis=replace(s.axis, low=least, high=most)) for s in c.scatters)
            one = replace(c, title=f"{c.title}: {names[k]}", heading=c.title, figure=c.title)
            out.append(replace(one, maps=maps, scatters=dots))
    return out


def _together(group: Sequence[tuple[int, Chart]], names: Sequence[str]) -> Chart:
    """Charts of several runs as one.

    Every run has one colour, its curves, marks and areas share it; limits are drawn once.
    """
    first, axes = group[0][1], dict[str, Any]()
    for name in ("x", "y"):
        one, *others = (getattr(c, name) for _, c in group)
        same = all(other == one for other in others)
        axes[name] = one if same else replace(one, low=None, high=None)
    return replace(
        first,
        figure=first.title,
        **axes,
        detail="",
        traces=tuple(
            replace(t, label=f"{names[k]}: {t.label}", entry=names[k], colour=k, closed=False)
            for k, c in group
            for t in c.traces
        ),
        marks=tuple(replace(m, colour=k, closed=False) for k, c in group for m in c.marks),
        areas=tuple(
            replace(a, label=f"{names[k]}: {a.label}", colour=k) for k, c in group for a in c.areas
        ),
        bands=tuple(dict.fromkeys(band for _, c in group for band in c.bands)),
    )


def differences(scenes: Sequence[Mapping[str, Any]]) -> tuple[tuple[str, ...], ...]:
    """Entries of the scene files that are not the same in all runs: path and the value of every
    run.
    """
    flat = [{path: str(value) for path, value in leaves("", scene)} for scene in scenes]
    paths = dict.fromkeys(path for entries in flat for path in entries)
    rows = ((path, *(entries.get(path, "–") for entries in flat)) for path in paths)
    return tuple(row for row in rows if len(set(row[1:])) > 1)
