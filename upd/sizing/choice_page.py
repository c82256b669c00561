"""The page of a chosen damper."""

from __future__ import annotations

import math

from upd.report.answer_page import AnswerPage
from upd.results.answer_table import AnswerTable
from upd.scene.written import scene_as_run
from upd.sizing.choice import GROWTHS, UNITS_OF, ChosenDamper
from upd.sizing.choice_words import (
    described,
    grid_words,
    headline,
    kind,
    notes,
    robustness,
    slopes,
    span,
)
from upd.sizing.sensitivity import sensitivities

#: how a search ends that has nothing to warn of
_FOUND = "found"


def choice_page(found: ChosenDamper) -> AnswerPage:
    """What stands on the page of a choice.

    Parameters
    ----------
    found : ChosenDamper
        Of the search.
    """
    scene, best = found.ranges.scene, found.best.best
    sure = best.status == _FOUND
    word = best.status.capitalize() if best.status != _FOUND or sure else "Found, not unique"
    deciding = tuple(
        (
            f"{math.exp(best.log_centrifugal - p.s):.4g} N",
            f"{math.exp(p.s):.4g}",
            kind(p.name),
            f"{p.frequency:.2f}",
            f"{math.exp(p.y):.4g}",
        )
        for p in best.deciding
        if p.share > 0.0
    )
    moved = tuple(
        (one.path, one.of.shown(one.value), slopes(one), *(span(one, ends) for ends in one.within))
        for one in sensitivities(found)
    )
    within = tuple(f"+{100.0 * (g - 1.0):.0f} % within" for g in GROWTHS)
    told = [*described(found), *robustness(found), *notes(found), *grid_words(found)]
    return AnswerPage(
        scene.title or scene.name,
        "passed" if sure else "warning",
        word,
        f"{headline(found)}.",
        (
            AnswerTable(
                "What decides",
                ("F_E", "#F_C/F_E", "peak", "#Hz", f"#height, {UNITS_OF['peak']}"),
                deciding,
            ),
            AnswerTable(
                "How far parameters may move",
                ("parameter", "value", "d ln(peak)/d ln(parameter)", *within),
                moved,
                "Below and above the optimum where both differ; within: the worst peak stays below "
                "so many per cent more, by whole curves at both ends and up to there, or between "
                "two that agree.",
            ),
        ),
        tuple(told),
        "Worst peaks",
        scene_as_run(scene),
        "The scene that the choice began with.",
    )
