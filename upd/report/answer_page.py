"""The page of an answer of a few tables and one figure: a fit, for example."""

from __future__ import annotations

from collections.abc import Sequence

from upd.cache.sources import versions
from upd.plot.chart import Chart
from upd.report.answer_folder import FigureAnswer
from upd.report.page import Section, Verdict, page_text, versions_text
from upd.report.panels import make_panels


def answer_page(
    answer: FigureAnswer,
    charts: Sequence[Chart],
    title: str,
    outcome: tuple[str, str],
    scene: tuple[str, str],
) -> str:
    """The page as HTML that needs nothing beside it.

    Parameters
    ----------
    answer
        Verdict, tables and notes.
    charts
        Of its figures.
    title
        Of the page.
    outcome
        The word of the verdict and its kind: passed, warning or failed.
    scene
        A scene file, and a sentence of what it is.
    """
    word, kind = outcome
    text, text_is = scene
    tables = [Section(table.heading, [table], kind="grid") for table in answer.tables]
    sections = [
        *tables,
        Section("Notes", texts=answer.notes),
        Section("Figures", panels=make_panels(charts, {})),
        Section("Scene file", texts=[text_is], file=text),
    ]
    verdict = Verdict(kind, word, f"{answer.verdict}.")
    return page_text(title, sections, verdict=verdict, footer=versions_text(versions()))
