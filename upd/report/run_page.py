"""One run folder -> report.html: numbers, figures, errors, checks, cost and the scene file."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from upd.labels import sentence
from upd.plot.surface import read_surface
from upd.report.answer import checked
from upd.report.folder import RunFolder, read_run
from upd.report.page import Section, Verdict, make_panels, page_text, write_page
from upd.report.tables import (
    all_numbers,
    analysis_charts,
    answer_tables,
    budget_table,
    checks_table,
    effects_table,
    filled,
    main_numbers,
    stage_table,
    warnings,
)
from upd.results.answer_table import AnswerTable
from upd.results.check import FAILED, WARNED, outcome_of

log = logging.getLogger("upd.report")

#: records of the solvers, whose faults are among the checks, and of all modules of this package
_SOLVER, _OURS = "upd.hbm", "upd."


def write_run_report(folder: Path) -> Path:
    """Write report.html into a run folder, from what lies in it. Returns its path.

    Raises InputError when ``folder`` is no run folder or cannot be written.
    """
    run = read_run(folder)
    surfaces = run_surfaces(run)
    html = page_text(
        run.summary["title"] or run.summary["scene"],
        run_sections(run, surfaces),
        verdict=verdict(run.summary),
        footer=run.origin,
        surfaces=surfaces,
    )
    return write_page(run.path / "report.html", html)


def run_sections(run: RunFolder, surfaces: Sequence[dict[str, Any]]) -> list[Section]:
    """The page of one run."""
    summary, entries = run.summary, run.summary["results"]
    size, cost = summary["size"], summary["cost"]
    panels = make_panels(analysis_charts(run.arrays, summary), run.figures)
    tables = answer_tables(size, entries)
    known = any(entry.get("estimated_error") is not None for entry in entries)
    about = [
        "Estimated errors (±) bound what mesh and methods leave in a number; the error budget "
        "shows their sources."
        if known
        else "No errors were estimated.",
        "A number without a unit is a ratio or a count.",
    ]
    figures = Section(
        "Figures",
        panels=panels,
        texts=[] if panels or surfaces else ["The run left no figures."],
        surfaces=bool(surfaces),
    )
    total = f"{cost['total_s']:.1f} s in all, {cost['peak_rss_mb']:.0f} MB of memory at most."
    return [
        Section("Main numbers", tables, texts=about if tables else ["The run left no numbers."]),
        Section("Warnings", notes=page_warnings(run)),
        figures,
        Section("Error budget", [budget_table(main_numbers(size, entries))]),
        Section(
            "What was simulated, what was left out",
            [effects_table(summary["effects"]), checks_table(summary["checks"])],
        ),
        Section(
            "Cost and mesh",
            [stage_table(cost.get("stages", {})), _mesh_table(size)],
            texts=[total],
            kind="grid",
        ),
        Section("All numbers", all_numbers(entries), each_folded=True, kind="grid"),
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
    facts = [f"{size['symmetry']} model"] * bool(size.get("symmetry"))
    facts += [f"{size['n_pairs']} contact pairs"] * bool(size.get("n_pairs"))
    return filled("Mesh", columns, f"{', '.join(facts)}.".capitalize() if facts else "")


def verdict(summary: Mapping[str, Any]) -> Verdict:
    """How a run ended, with its self-checks."""
    status = str(summary["status"])
    if (outcome := outcome_of(status)) == FAILED:
        return Verdict("failed", "Failed", status.removeprefix("failed: "))
    text = f"{checked(summary)}."
    if outcome == WARNED:
        return Verdict("warning", "Done, with warnings", text)
    return Verdict("passed", "Passed", text)


def page_warnings(run: RunFolder) -> list[str]:
    """What a run warns of, the warnings of its log that are no check's, and the files that could
    not be read; each once.
    """
    checks, status = run.summary["checks"], run.summary["status"]
    found = warnings(checks, run.summary["results"])
    for line in run.log:
        level, where, text = line["level"], line["where"], line["text"]
        known = text == status or (checks and where.startswith(_SOLVER))
        if level in ("WARNING", "ERROR", "CRITICAL") and not known:
            found.append(sentence(text, "") if where.startswith(_OURS) else f"{where}: {text}")
    return list(dict.fromkeys([*found, *run.missing]))


def run_surfaces(run: RunFolder) -> list[dict[str, Any]]:
    """Surfaces of the run's VTU files: fields of a contact, else modes, else the bare mesh."""
    contact = [f for f in (run.path / "fields.vtu", run.path / "mesh.vtu") if f.exists()][:1]
    files = contact or sorted(
        run.path.glob("modes_*.vtu"), key=lambda f: ("glued" not in f.stem, "asymmetric" in f.stem)
    )
    out = []
    for file in files:
        label = file.stem.removeprefix("modes_").replace("_", ", ")
        try:
            out.append(read_surface(file, _bodies(run, file.stem), label))
        except (OSError, ValueError, KeyError) as problem:
            log.warning("%s: no three-dimensional view (%s)", file.name, problem)
    return out


def _bodies(run: RunFolder, stem: str) -> list[str]:
    """Bodies in the order of their numbers in the file."""
    counts = run.summary["size"].get("n_dof", {})
    names = list(dict.fromkeys(key.partition(",")[0] for key in counts))
    if "glued" in stem:
        return [n for n in names if n not in ("left", "right")] or names
    return names
