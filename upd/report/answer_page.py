"""The page of an answer of a few tables and one figure: a fit, for example."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from upd.cache.sources import versions
from upd.plot.chart import Chart
from upd.report.page import render
from upd.report.panels import make_panels
from upd.results.answer_table import AnswerTable


@dataclass(frozen=True)
class AnswerPage:
    """What stands on a page.

    Attributes
    ----------
    title : str
    kind : {"passed", "warning", "failed"}
        Of the verdict.
    word, says : str
        The verdict: its word and a sentence.
    tables : tuple of AnswerTable
    notes : tuple of str
        Sentences below the tables.
    figures : str
        Heading of the charts.
    text : str
        The scene file.
    text_says : str
        What that is.
    """

    title: str
    kind: str
    word: str
    says: str
    tables: tuple[AnswerTable, ...]
    notes: tuple[str, ...]
    figures: str
    text: str
    text_says: str = "The scene with the fitted values."


def answer_page(page: AnswerPage, charts: Sequence[Chart]) -> str:
    """The page as HTML that needs nothing beside it.

    Parameters
    ----------
    page
        What stands on it.
    charts
        Of its figures.
    """
    panels = make_panels(charts, {})
    context: Mapping[str, object] = {"page": page, "title": page.title, "versions": versions()}
    return render("answer.html.j2", panels, [], context)
