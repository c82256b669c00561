"""Convergence study: what accuracy costs, as tables, study.json and a work-precision figure."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from upd.batch.curves import ConvergenceCurve
from upd.batch.ladder import SolvedPoint, StudyPoint, StudyReport, TextTable, markdown_table
from upd.cache.files import write_text
from upd.labels import number_label, percent
from upd.plot.matplotlib import write_sheets
from upd.plot.work_precision import work_precision_charts


@dataclass(frozen=True)
class ConvergenceStudy:
    """Ladders, and what is shown of them.

    Attributes
    ----------
    curves
        Makes the curves of the solved points.
    more
        Makes a table to be shown before the others.
    notes
        What the levels set in the scene.
    """

    title: str
    points: tuple[StudyPoint, ...]
    curves: Callable[[Sequence[SolvedPoint]], list[ConvergenceCurve]]
    more: Callable[[Sequence[SolvedPoint]], TextTable] | None = None
    notes: tuple[str, ...] = ()

    def present(self, solved: Sequence[SolvedPoint]) -> StudyReport:
        """The points and what they cost.

        The error of every followed number on its finest level, its rate, the error estimated there,
        and that of the coarsest level.
        """
        curves = self.curves(solved)
        before = () if self.more is None else (self.more(solved),)
        tables = (*before, _points_table(solved), _error_table(curves))
        return StudyReport(tables, bool(curves), self.notes)

    def write(self, folder: Path, solved: Sequence[SolvedPoint]) -> list[Path]:
        """study.md, study.json and work_precision.png."""
        curves = self.curves(solved)
        table, data = folder / "study.md", folder / "study.json"
        content: dict[str, Any] = {
            "title": self.title,
            "points": [one.as_dict() for one in solved],
            "curves": [asdict(c) for c in curves],
            "notes": list(self.notes),
        }
        write_text(data, json.dumps(content, indent=1) + "\n")
        told = "".join(f"\n- {note}\n" for note in self.notes)
        write_text(table, markdown(self.title, solved, curves) + told)
        # A number that no level moves has no error to draw.
        moved = {(c.name, c.case) for c in curves if any(c.error)}
        charts = work_precision_charts(
            [c for c in content["curves"] if (c["name"], c["case"]) in moved]
        )
        return [table, data, *write_sheets(charts, folder)]


def _points_table(solved: Sequence[SolvedPoint]) -> TextTable:
    heads = ("curve", "level", "dofs", "seconds", "peak MB", "note")
    return TextTable("Points", heads, "llrrrl", tuple(map(_point_cells, solved)))


def _point_cells(one: SolvedPoint) -> tuple[str, ...]:
    o = one.outcome
    return (
        one.point.curve,
        one.point.label,
        f"{o.n_dof}",
        f"{o.seconds:.2f}",
        f"{o.memory_mb:.0f}",
        o.failure,
    )


def _error_table(curves: Sequence[ConvergenceCurve]) -> TextTable:
    heads = (
        "number",
        "case",
        "curve",
        "finest",
        "order",
        "estimated",
        "coarsest",
        "thesis",
        "against",
        "verdict",
    )
    # what a narrow terminal leaves out first stands last among the numbers
    rows = tuple(
        (
            number_label(c.name),
            c.case,
            c.curve,
            percent(c.error[-1]),
            rate_text(c.order),
            _estimated(c),
            percent(c.error[0]),
            percent(c.thesis_error),
            c.against,
            c.verdict,
        )
        for c in curves
    )
    # The name of a number is not broken, however narrow the terminal.
    width = max((len(row[0]) for row in rows), default=0)
    return TextTable("Error", heads, "lllrrrrrll", rows, width, ("against", "verdict"))


def rate_text(order: float) -> str:
    """The fitted order, or that there is none."""
    return f"{order:.1f}" if np.isfinite(order) else "no clear order"


def _short(labels: Sequence[str]) -> list[str]:
    """The first number of every level's label, where that tells them apart; else the labels."""
    numbers = [re.findall(r"(?<!\S)\d[\d.]*(?!\S)", label)[:1] for label in labels]
    told = [found[0] for found in numbers if found]
    return told if len(set(told)) == len(labels) else list(labels)


def _estimated(curve: ConvergenceCurve) -> str:
    """Error of the finest level as the levels alone tell it."""
    found = curve.estimate
    return "" if found is None or not np.isfinite(found.error) else f"{100 * found.error:.2g} %"


def markdown(title: str, solved: Sequence[SolvedPoint], curves: Sequence[ConvergenceCurve]) -> str:
    """The study as Markdown: points, then error and rate of every followed number."""
    points = markdown_table(
        ("curve", "level", "dofs", "seconds", "peak MB", "note"),
        "llrrrl",
        map(_point_cells, solved),
    )
    heads = (
        "number",
        "case",
        "curve",
        "order",
        "error on each level",
        "estimated on the finest",
        "against",
        "thesis",
        "verdict",
    )
    rows = []
    for c in curves:
        errors = ", ".join(
            f"{label}: {100 * e:+.2f} %" for label, e in zip(_short(c.labels), c.error, strict=True)
        )
        printed = "" if c.thesis_error is None else f"{100 * c.thesis_error:+.1f} %"
        rows.append(
            (
                c.name,
                c.case,
                c.curve,
                rate_text(c.order),
                errors,
                _estimated(c),
                c.against,
                printed,
                c.verdict,
            )
        )
    return (
        "\n".join([f"# {title}", "", *points, "", *markdown_table(heads, "lllrlrlrl", rows)]) + "\n"
    )
