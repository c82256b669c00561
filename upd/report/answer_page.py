"""The page of an answer of a few tables and one figure: a fit, for example."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from upd.cache.sources import versions
from upd.plot.chart import Chart
from upd.report.answer_folder import FigureAnswer
from upd.report.page import render
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
    page: Mapping[str, object] = {
        "title": title,
        "word": word,
        "kind": kind,
        "says": f"{answer.verdict}.",
        "tables": answer.tables,
        "notes": answer.notes,
        "text": text,
        "text_is": text_is,
    }
    panels = make_panels(charts, {})
    context: Mapping[str, object] = {"page": page, "title": title, "versions": versions()}
    return render("answer.html.j2", panels, [], context)
