"""The page and the summary of a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from upd.cache.sources import versions
from upd.fitting.found import FittedInputs
from upd.fitting.words import (
    curve_words,
    ends_of,
    headline,
    interval,
    on_bound,
    target_difference,
    unknown_words,
)
from upd.report.answer_page import AnswerPage
from upd.results.answer_table import AnswerTable

#: further measurements on the page; fit.json has all that tell something
_FURTHER = 12
#: word and kind of every way a fit ends
_ENDS = {
    "found": ("Found", "passed"),
    "several": ("Several", "warning"),
    "family": ("A family", "warning"),
    "not reached": ("Not reached", "failed"),
}


def fit_page(found: FittedInputs, toml: str) -> AnswerPage:
    """What stands on the page of a fit.

    Parameters
    ----------
    found : FittedInputs
        Of the fit.
    toml : str
        The scene with the fitted values.
    """
    word, kind = _ENDS[found.status]
    title = found.source.title or found.source.name
    further = tuple(
        (
            one.name,
            " to ".join(ends_of(one.low, one.high)),
            one.unit,
            f"± {one.half_width:.2g}",
            f"{one.then:.4g}",
            f"{one.bits:.2f}",
        )
        for one in found.further[:_FURTHER]
    )
    widest = f"{found.further[0].widest:.4g}" if found.further else ""
    tables = (
        AnswerTable(
            "Inputs",
            ("input", "#scene", "#fitted", "unit", "#times scene", "fits as well from", "to"),
            tuple(_inputs(found)),
            _intervals(found),
        ),
        AnswerTable(
            "Numbers",
            ("number", "#target", "#fitted", "unit", "difference"),
            tuple(
                (
                    one.name,
                    one.shown.removesuffix(f" {one.unit}").replace(f" {one.unit}", ""),
                    f"{found.numbers[i]:.7g}",
                    one.unit,
                    target_difference(found, i),
                )
                for i, one in enumerate(found.targets)
            ),
        ),
        AnswerTable(
            "Which further measurement would tell more",
            (
                "measurement",
                "predicted today",
                "unit",
                "#assumed half-width",
                "#widest direction then, x/",
                "#bits gained",
            ),
            further,
            f"The least known direction of the inputs is known within a factor of {widest} today. "
            "The first measurement narrows it most (E-optimality); bits are those of D-optimality.",
        ),
    )
    notes = [*curve_words(found), *unknown_words(found)]
    if found.cost:
        notes.append(found.cost)
    notes.append(
        f"{found.evaluations} models solved in {found.seconds:.1f} s, "
        f"{len(found.starts)} starts; that no further set exists is not proved."
    )
    return AnswerPage(
        f"Fit: {title}",
        kind,
        word,
        _sentence(headline(found).partition(": ")[2]),
        tables,
        tuple(notes),
        "Figures",
        toml,
    )


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _inputs(found: FittedInputs) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for k, one in enumerate(found.parameters):
        factor, ends = math.exp(found.answers[0][k]), interval(found, k)
        for path, value in zip(one.paths, one.values, strict=True):
            told = ("", "")
            if ends is not None:
                told = ends_of(value * math.exp(ends[0]), value * math.exp(ends[1]))
            rows.append(
                (
                    path,
                    f"{value:.5g}",
                    f"{value * factor:.5g}{', at its bound' if on_bound(found, k) else ''}",
                    one.unit,
                    f"{factor:.5g}",
                    *told,
                )
            )
    return rows


def _intervals(found: FittedInputs) -> str:
    if not found.widths:
        return "Without half-widths of the targets there are no intervals."
    own = [one.name for k, one in enumerate(found.parameters) if found.is_traced(k)]
    kind = "By profiles" if own else "To first order"
    if 0 < len(own) < len(found.parameters):
        kind = f"To first order, of {' and '.join(own)} by the profile"
    estimated = any(one.noise.estimated for one in found.measured)
    if estimated:
        return f"{kind}, 95 % intervals."
    return f"{kind}, in the same multiple of standard deviations as the targets' half-widths."


def fit_summary(found: FittedInputs, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """What stands in summary.json: fitted inputs and numbers as results, checks, cost.

    Parameters
    ----------
    found : FittedInputs
        Of the fit.
    numbers : dict
        Of fit.json.
    """
    results = []
    for k, one in enumerate(found.parameters):
        ends = interval(found, k)
        for path, value in zip(one.paths, one.values, strict=True):
            low, high = (None, None) if ends is None else (value * math.exp(e) for e in ends)
            fitted = value * math.exp(found.answers[0][k])
            results.append(
                {"name": path, "value": fitted, "unit": one.unit, "low": low, "high": high}
            )
    for i, target in enumerate(found.targets):
        results.append(
            {
                "name": target.name,
                "value": float(found.numbers[i]),
                "unit": target.unit,
                "reference": target.value,
            }
        )
    checks = [
        {"name": "targets met", "passed": found.status != "not reached"},
        *(
            {
                "name": f"independent errors, {one.target.name}",
                "passed": one.noise.white,
                "value": one.noise.correlation,
                "limit": one.noise.limit,
            }
            for one in found.measured
        ),
    ]
    return {
        "analysis": "fit",
        "scene": found.source.name,
        "title": found.source.title,
        "status": found.status,
        "verdict": headline(found),
        "results": results,
        "checks": checks,
        "further_measurements": numbers["further_measurements"],
        "cost": {"total_s": numbers["seconds"], "models": found.evaluations},
        "versions": versions(),
    }
