"""The page of a study: which level is enough, what accuracy costs, the tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from upd.plot.chart import Chart
from upd.report.page import Section, Verdict, page_text, write_page
from upd.report.panels import make_panels
from upd.report.tables import filled
from upd.results.answer_table import AnswerTable
from upd.vary.tables import TextTable


def write_study_report(
    folder: Path,
    title: str,
    failed: int,
    notes: Sequence[str],
    tables: Iterable[TextTable],
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
    found = [_table(one) for one in tables]
    sections = [Section(one.heading, [one], kind="tall") for one in found]
    sections.insert(1, Section("Figures", panels=panels))
    return write_page(folder / "report.html", page_text(title, sections, verdict=verdict))


def _table(table: TextTable) -> AnswerTable:
    """Its columns but those of many words, which study.md has."""
    cells = list(zip(*table.rows, strict=True)) or [()] * len(table.columns)
    columns = {
        ("# " if letter == "r" else "") + head.replace("\n", " "): mine
        for head, letter, mine in zip(table.columns, table.align, cells, strict=True)
        if head not in table.spare
    }
    return filled(table.title, columns)
