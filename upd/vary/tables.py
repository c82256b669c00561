"""Tables of a study, for a terminal and for study.md: points and their cost, errors, numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from upd.labels import percent, unit_label
from upd.results.answer_table import AnswerTable
from upd.results.quantities import number_label, quantity_of
from upd.vary.curves import ConvergenceCurve
from upd.vary.outcome import SolvedPoint
from upd.vary.variation import Key

#: head, with # before that of numbers, and what makes the cell of a row
TableColumn = tuple[str, Callable[[Any], str]]


def make_table(
    title: str, columns: Sequence[TableColumn], rows: Iterable[Any], spare: tuple[str, ...] = ()
) -> AnswerTable:
    """A table of rows of any kind."""
    heads, cells = zip(*columns, strict=True)
    made = tuple(tuple(cell(row) for cell in cells) for row in rows)
    return AnswerTable(title, heads, made, spare=spare)


def markdown_table(table: AnswerTable) -> list[str]:
    """Lines of a table in Markdown, its columns as wide as their widest cell."""
    rows = [tuple(head.lstrip("# ").replace("\n", " ") for head in table.columns), *table.rows]
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    signs = [">" if head.startswith("#") else "<" for head in table.columns]
    marks = ("-" * (n + 1) + "-:"[sign == ">"] for n, sign in zip(widths, signs, strict=True))
    lines = [f"| {' | '.join(map('{:{}{}}'.format, row, signs, widths))} |" for row in rows]
    return [lines[0], f"|{'|'.join(marks)}|", *lines[1:]]


#: numbers beside the cost of a level, and errors for which one is sought
_MAIN, _WANTED = 3, (0.01, 0.001)

_POINTS: tuple[TableColumn, ...] = (
    ("curve", lambda one: str(one.point.source)),
    ("level", lambda one: str(one.point.label)),
    ("# dofs", lambda one: f"{one.outcome.n_dof}"),
    ("# seconds", lambda one: f"{one.outcome.seconds:.2f}"),
    ("# peak MB", lambda one: f"{one.outcome.memory_mb:.0f}"),
    ("note", lambda one: str(one.outcome.failure)),
)


def points_table(solved: Sequence[SolvedPoint], keys: Sequence[Key] = ()) -> AnswerTable:
    """The points, what they have of the numbers `keys`, and what they cost."""

    def text(key: Key, one: SolvedPoint) -> str:
        return f"{one.values[key]:.5g}" if key in one.values else ""

    numbers: list[TableColumn] = [
        (f"# {_head(name, case.label)}", partial(text, (name, case))) for name, case in keys
    ]
    # what a narrow terminal leaves out first stands last
    curve, level, dofs, seconds, memory, note = _POINTS
    columns = (curve, level, *numbers[:1], seconds, *numbers[1:], dofs, memory, note)
    return make_table("Points", columns, solved)


def _head(name: str, case: str) -> str:
    """Label of a number, its case and unit, one below the other."""
    unit = quantity_of(name)[0].unit
    return "\n".join(
        filter(None, (number_label(name), case, f"[{unit_label(unit)}]" if unit else ""))
    )


def convergence_tables(
    solved: Sequence[SolvedPoint], curves: Sequence[ConvergenceCurve]
) -> tuple[AnswerTable, AnswerTable]:
    """The points with their main numbers and cost, then the curves: the error of every followed
    number on its finest level, its rate, the error estimated there, and those of the other levels.
    """
    main = dict.fromkeys(c.name for c in curves)
    last = {c.name: c.case for c in curves}
    keys = [
        next(k for one in solved for k in one.values if k[0] == name and k[1].label == last[name])
        for name in list(main)[:_MAIN]
    ]
    errors = make_table(
        "Error",
        (
            ("number", lambda c: number_label(c.name)),
            ("case", lambda c: str(c.case)),
            ("curve", lambda c: str(c.curve)),
            ("# finest", lambda c: percent(c.error[-1])),
            ("# order", lambda c: _rate_text(c.order)),
            ("# estimated", _estimated),
            # what a narrow terminal leaves out first stands last
            ("# coarsest", lambda c: percent(c.error[0])),
            ("# thesis", lambda c: percent(c.thesis_error)),
            ("against", lambda c: str(c.against)),
            ("verdict", lambda c: str(c.verdict)),
            ("error on each level", _levels_text),
        ),
        curves,
        spare=("against", "verdict", "error on each level"),
    )
    return points_table(solved, keys), errors


def enough(curves: Sequence[ConvergenceCurve]) -> list[str]:
    """The cheapest levels with which the first number stays within 1 % and 0.1 %, in a sentence.

    A level within the limit by chance, before finer ones beyond it, is not enough.
    """
    if not curves:
        return []
    last = [c for c in curves if c.name == curves[0].name][-1]
    size, at = np.abs(last.error), {}
    for limit in _WANTED:
        at[len(size) - int(np.argmin(np.append(size[::-1] <= limit, False)))] = limit
    found = [
        f"{last.labels[k]} is enough for {100 * limit:g} %: {100 * size[k]:.2g} % in "
        f"{last.seconds[k]:.2g} s"
        for k, limit in at.items()
        if k < len(size)
    ]
    if not found:
        found = [
            f"no level stays within {100 * _WANTED[0]:g} %, the finest has {100 * size[-1]:.2g} %"
        ]
    what = f"{number_label(last.name)} {last.case}".strip()
    what = what[:1].upper() + what[1:]
    return [f"{what} against {last.against}: {'; '.join(found)}."]


def level_table(
    title: str,
    keys: Sequence[Key],
    solved: Sequence[SolvedPoint],
    text: Callable[[SolvedPoint, Key], str],
) -> AnswerTable:
    """A row for every number, with what each level has of it."""
    levels = ((f"# {one.point.label}", partial(text, one)) for one in solved)
    return make_table(
        title,
        (
            ("number", lambda key: number_label(key[0])),
            ("case", lambda key: str(key[1].label)),
            *levels,
        ),
        keys,
    )


def _rate_text(order: float) -> str:
    """The fitted order, empty where there is none."""
    return f"{order:.1f}" if np.isfinite(order) else ""


def _levels_text(c: ConvergenceCurve) -> str:
    return ", ".join(
        f"{label}: {percent(e)}" for label, e in zip(_short(c.labels), c.error, strict=True)
    )


def _short(labels: Sequence[str]) -> list[str]:
    """The first number of every level's label, where it differs on every level; else the labels."""
    numbers = [re.findall(r"(?<!\S)\d[\d.]*(?!\S)", label)[:1] for label in labels]
    firsts = [found[0] for found in numbers if found]
    return firsts if len(set(firsts)) == len(labels) else list(labels)


def _estimated(curve: ConvergenceCurve) -> str:
    """Error of the finest level as the levels alone tell it."""
    found = curve.estimate
    return "" if found is None or not np.isfinite(found.error) else f"{100 * found.error:.2g} %"
