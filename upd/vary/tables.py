"""Tables of a study, for a terminal and for study.md: points and their cost, errors, numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
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

#: of a solved point: its place, its cost, and why it failed
_POINTS: tuple[TableColumn, ...] = (
    ("curve", lambda one: str(one.point.source)),
    ("level", lambda one: str(one.point.label)),
    ("# seconds", lambda one: f"{one.outcome.seconds:.2f}"),
    ("# dofs", lambda one: f"{one.outcome.n_dof}"),
    ("# peak MB", lambda one: f"{one.outcome.memory_mb:.0f}"),
    ("note", lambda one: str(one.outcome.failure)),
)


def points_table(
    solved: Sequence[SolvedPoint],
    keys: Sequence[Key] = (),
    errors: Mapping[tuple[str, str], float] | None = None,
) -> AnswerTable:
    """The points, what they have of the numbers `keys`, and what they cost.

    Parameters
    ----------
    errors
        Curve and level -> error of the first number there.
    """

    def text(key: Key, one: SolvedPoint) -> str:
        return f"{one.values[key]:.5g}" if key in one.values else ""

    def difference(one: SolvedPoint) -> str:
        return percent((errors or {}).get((one.point.source, one.point.label)))

    numbers: list[TableColumn] = [
        (f"# {_head(name, case.label)}", partial(text, (name, case))) for name, case in keys
    ]
    more = [("# difference", difference)] if errors else []
    # what a narrow terminal leaves out first stands last
    columns = (*_POINTS[:2], *numbers[:1], *more, *_POINTS[2:5], *numbers[1:], _POINTS[5])
    return make_table("Levels", columns, solved)


def _head(name: str, case: str) -> str:
    """Label of a number, its case and unit, one below the other."""
    unit = quantity_of(name)[0].unit
    parts = number_label(name), case, f"[{unit_label(unit)}]" if unit else ""
    return "\n".join(filter(None, parts))


def convergence_tables(
    solved: Sequence[SolvedPoint], curves: Sequence[ConvergenceCurve]
) -> tuple[AnswerTable, AnswerTable]:
    """The points with their main numbers and cost, then the curves: the error of every followed
    number on its finest level, its rate, the error estimated there, and those of the other levels.
    """
    last = {c.name: c.case for c in curves}
    keys = [
        next(k for one in solved for k in one.values if (k[0], k[1].label) == main)
        for main in list(last.items())[:_MAIN]
    ]
    errors = make_table(
        "Error",
        (
            ("number", lambda c: number_label(c.name)),
            ("case", lambda c: str(c.case)),
            ("curve", lambda c: str(c.curve)),
            ("# finest", lambda c: percent(c.error[-1])),
            ("# order", lambda c: f"{c.order:.1f}" if np.isfinite(c.order) else ""),
            ("# estimated", _estimated),
            ("# thesis", lambda c: percent(c.thesis_error)),
            ("against", lambda c: str(c.against)),
            ("verdict", lambda c: str(c.verdict)),
            ("error on each level", _levels_text),
        ),
        curves,
        spare=("against", "verdict", "error on each level"),
    )
    at = {
        (c.curve, label): error
        for c in _main(curves)
        for label, error in zip(c.labels, c.error, strict=True)
    }
    return points_table(solved, keys, at), errors


def _main(curves: Sequence[ConvergenceCurve]) -> list[ConvergenceCurve]:
    """Of the first number, in its last case."""
    mine = [c for c in curves if c.name == curves[0].name]
    return [c for c in mine if c.case == mine[-1].case]


def enough(curves: Sequence[ConvergenceCurve]) -> tuple[str, ...]:
    """The cheapest levels of all curves with which the first number stays within 1 % and 0.1 %, and
    its order of convergence.

    A level within the limit by chance, before finer ones beyond it, is not enough.
    """
    if not curves:
        return ()
    mine, at = _main(curves), dict[str, float]()
    for limit in _WANTED:
        levels = [
            (c.seconds[k], f"{c.curve} " * (len(mine) > 1) + c.labels[k], c.error[k])
            for c in mine
            if (k := _first_within(c, limit)) < len(c.error)
        ]
        for seconds, level, error in sorted(levels)[:1]:
            at[f"{level} is enough for {{}}: {100 * abs(error):.2g} % in {seconds:.2g} s"] = limit
    found = [text.format(f"{100 * limit:g} %") for text, limit in at.items()]
    least = min(abs(c.error[-1]) for c in mine)
    none = f"no level stays within 1 %, the finest has {100 * least:.2g} %"
    what = f"{number_label(mine[0].name)} {mine[0].case}".strip()
    orders = [f"{c.curve} {c.order:.1f}" for c in mine if np.isfinite(c.order)]
    text = f"{what} against {mine[0].against}: {'; '.join(found) or none}. Order of convergence: "
    return (f"{text[:1].upper()}{text[1:]}{', '.join(orders) or 'none is clear'}.",)


def _first_within(curve: ConvergenceCurve, limit: float) -> int:
    """The first level from which on all stay within the limit; their number where none does."""
    within = np.abs(curve.error[::-1]) <= limit
    return len(within) - int(np.argmin(np.append(within, False)))


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


def _levels_text(c: ConvergenceCurve) -> str:
    return ", ".join(f"{label}: {percent(e)}" for label, e in zip(c.labels, c.error, strict=True))


def _estimated(curve: ConvergenceCurve) -> str:
    """Error of the finest level as the levels alone tell it."""
    found = curve.estimate
    return "" if found is None or not np.isfinite(found.error) else f"{100 * found.error:.2g} %"
