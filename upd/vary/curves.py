"""Convergence curves: a number along its ladder, with its rate, its limit, and the cost of every
level; tables of them, for a terminal and for study.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.labels import percent, unit_label
from upd.plot.answer_table import AnswerTable
from upd.results.quantities import number_label, quantity_of
from upd.vary.orders import ErrorEstimate, change_order, estimate_error, extrapolate, fit_rate
from upd.vary.outcome import SolvedPoint, matching, without_failed
from upd.vary.variation import Key

Array = NDArray[np.float64]

#: order of change below which a number does not converge: a logarithm has 0, the edge of a
#: punch less
_CONVERGES = 0.2
#: kinds of the linear curves of a response, whose peaks are the stuck and free frequencies
_LINEAR = ("free", "stuck")
#: names of the two curves of a number of `accuracy_curves`
ESTIMATED, TRUE = "estimated", "against the closed form"
#: spread in % of the last three levels up to which a number without a clear order counts as settled
_SETTLED = 5.0


@dataclass(frozen=True)
class ConvergenceCurve:
    """One number of one case along one ladder.

    Attributes
    ----------
    error
        (n,), fractions of ``reference``.
    against
        What the reference is.
    order
        The fitted rate; nan where the levels show none.
    thesis_error
        Relative error of a printed value.
    change
        Order at which the number still changes, `upd.vary.orders.change_order`.
    estimate
        Error of the finest level as the levels alone tell it; None for levels that are no sizes and
        where there is no limit.
    """

    curve: str
    name: str
    case: str
    labels: tuple[str, ...]
    h: tuple[float, ...]
    error: tuple[float, ...]
    seconds: tuple[float, ...]
    memory_mb: tuple[float, ...]
    reference: float
    against: str
    order: float = float("nan")
    thesis_error: float | None = None
    change: float = float("nan")
    estimate: ErrorEstimate | None = None

    @property
    def verdict(self) -> str:
        """Whether the number converges under refinement, in words."""
        if len(self.error) < 3:
            return "too few levels"
        if "no limit" in self.against:
            return f"grows like h^{self.change:.2f}: no limit"
        if np.isfinite(self.order) and np.isfinite(self.change) and self.change >= _CONVERGES:
            return f"converges, order {self.change:.1f}"
        last = [1.0 + e for e in self.error[-3:]]
        spread = 100.0 * (max(last) / min(last) - 1.0) if min(last) > 0.0 else float("inf")
        return (
            f"no clear order, {'settled' if spread <= _SETTLED else 'not settled'}: last three "
            f"within {spread:.2g} %"
        )


def make_curves(solved: Iterable[SolvedPoint], names: Iterable[str]) -> list[ConvergenceCurve]:
    """Curves of the numbers whose names match ``names`` (shell patterns).

    Failed points are omitted.
    """
    good, curves = without_failed(solved), []
    for key in matching(good, names):
        ladders: dict[str, list[SolvedPoint]] = {}
        for one in _with(good, key):
            ladders.setdefault(one.point.source, []).append(one)
        for curve, points in ladders.items():
            most = max(p.outcome.n_dof for p in points)
            others = (them for name, them in ladders.items() if name != curve)
            finest = (min(them, key=lambda p: p.point.size) for them in others)
            finer = max(
                (one for one in finest if one.outcome.n_dof > most),
                key=lambda p: p.outcome.n_dof,
                default=None,
            )
            # What ends in zero has no relative error.
            if points[-1].values[key]:
                curves.append(_curve(key, points, finer))
    return curves


def _with(points: Iterable[SolvedPoint], key: Key) -> list[SolvedPoint]:
    """The points that have the number."""
    return [one for one in points if np.isfinite(one.values.get(key, np.nan))]


def closed_form(key: Key, points: Sequence[SolvedPoint]) -> Array | None:
    """Closed form of the number on every level, (n,), or None.

    That of a raw number is the half-space's plus the finite bodies' share, which is solved on the
    level itself. None too where the number is zero on a level: its error tells no closed form.
    """
    quantity, _ = quantity_of(key[0])
    if not quantity.same_bodies:
        if not all(p.errors.get(key, -1.0) > -1.0 for p in points):
            return None
        return np.array([p.values[key] / (1.0 + p.errors[key]) for p in points])
    contact = (quantity.full, key[1])
    if not all(p.errors.get(contact, -1.0) > -1.0 for p in points):
        return None
    return np.array(
        [
            p.values[key] - p.values[contact] * (1.0 - 1.0 / (1.0 + p.errors[contact]))
            for p in points
        ]
    )


def _curve(key: Key, points: Sequence[SolvedPoint], finer: SolvedPoint | None) -> ConvergenceCurve:
    """The curve of one ladder.

    Parameters
    ----------
    finer
        The finest level of another ladder, where that has more dofs than any level of this one.
    """
    values = np.array([p.values[key] for p in points])
    h = [p.point.size for p in points]
    own = extrapolate(h, values) if len(set(h)) >= 3 else None
    change, closed = change_order(h, values), closed_form(key, points)
    # An approach and a frequency have a limit, whatever few coarse levels show.
    same = quantity_of(key[0])[0].same_bodies
    no_limit = closed is None and not same and change < _CONVERGES
    clear = True
    if closed is not None:
        reference, against = closed, "reference, same bodies" if same else "reference"
    elif no_limit:
        reference, against, clear = values[-1:], "finest level, no limit", False
    elif finer is not None:
        reference = np.array([finer.values[key]])
        against = f"finer level, {finer.point.source} {finer.point.label}"
    elif own is not None and change >= _CONVERGES:
        reference, against = np.array(own[:1]), "its own extrapolation"
    else:
        clear = len(h) < 3
        reference = values[[np.argmin(h)]]
        against = "finest level" if clear else "finest level, no clear order"
    error = values / reference - 1.0
    # An error that changes sign on the way scatters.
    clear = clear and len(set(np.sign(error[error != 0.0]))) < 2
    return make_curve(
        points[0].point.source,
        key,
        points,
        error,
        float(reference[-1]),
        against,
        order=fit_rate(h, error) if clear else float("nan"),
        thesis_error=next((p.printed_errors[key] for p in points if key in p.printed_errors), None),
        change=change,
        estimate=None if no_limit else _estimate(h, values),
    )


def _estimate(h: Sequence[float], values: Array) -> ErrorEstimate | None:
    """None of choices that are no levels, which have one size."""
    return estimate_error(h, values) if len(set(h)) == len(h) else None


def finest_curves(solved: Iterable[SolvedPoint], names: Iterable[str]) -> list[ConvergenceCurve]:
    """Curves of ladders whose levels are no sizes: every number against that of the finest level.

    A number the finest level does not have, a second peak for example, has nothing to be compared
    with; what the variation does not touch has no error to show. Linear curves of a response have
    none either. Neither have load steps a closed form: that has no part of the mesh's error.
    """
    good = without_failed(solved)
    curves = []
    for key in with_friction(matching(good, names)):
        mine = _with(good, key)
        if len(mine) < 2 or mine[-1] is not good[-1]:
            continue
        values = np.array([p.values[key] for p in mine])
        reference = float(values[-1])
        error = values / reference - 1.0 if reference else np.zeros(0)
        if error.any():
            estimate = _estimate([p.point.size for p in mine], values)
            order = float("nan") if estimate is None else estimate.order
            shown = {"order": order, "change": order, "estimate": estimate}
            source = mine[-1].point.source
            curves.append(make_curve(source, key, mine, error, reference, "finest level", **shown))
    return curves


def with_friction(keys: Iterable[Key]) -> list[Key]:
    """Numbers of the curve with friction, and what the model gives."""
    return [(name, case) for name, case in keys if case.kind not in _LINEAR]


def true_errors(one: SolvedPoint) -> dict[Key, float]:
    """Errors against closed forms; of a raw number, on the same finite bodies."""
    found = {key: closed_form(key, [one]) for key in one.values}
    return {
        key: one.values[key] / float(exact[0]) - 1.0
        for key, exact in found.items()
        if exact is not None
    }


def make_curve(
    curve: str,
    key: Key,
    points: Sequence[SolvedPoint],
    error: Iterable[float],
    reference: float,
    against: str,
    **more: Any,
) -> ConvergenceCurve:
    """The curve of a number over points, with what they cost."""
    name, case = key
    return ConvergenceCurve(
        curve,
        name,
        case.label,
        tuple(p.point.label for p in points),
        tuple(p.point.size for p in points),
        tuple(map(float, error)),
        tuple(p.outcome.seconds for p in points),
        tuple(p.outcome.memory_mb for p in points),
        reference,
        against,
        **more,
    )


# -- tables of a study -----------------------------------------------------------------------------


#: head, with # before that of numbers, and what makes the cell of a row
TableColumn = tuple[str, Callable[[Any], str]]


def make_table(title: str, columns: Sequence[TableColumn], rows: Iterable[Any]) -> AnswerTable:
    """A table of rows of any kind."""
    heads, cells = zip(*columns, strict=True)
    made = tuple(tuple(cell(row) for cell in cells) for row in rows)
    return AnswerTable(title, heads, made)


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

    numbers: list[TableColumn] = []
    for name, case in keys:
        # label, case and unit, one below the other
        unit = quantity_of(name)[0].unit
        parts = number_label(name), case.label, f"[{unit_label(unit)}]" if unit else ""
        head = "\n".join(filter(None, parts))
        numbers.append((f"# {head}", partial(text, (name, case))))
    known, more = errors or {}, list[TableColumn]()
    if known:
        at = attrgetter("point.source", "point.label")
        more.append(("# difference", lambda one: percent(known.get(at(one)))))
    # what a narrow terminal leaves out first stands last
    columns = (*_POINTS[:2], *numbers[:1], *more, *_POINTS[2:5], *numbers[1:], _POINTS[5])
    return make_table("Levels", columns, solved)


def convergence_tables(
    solved: Sequence[SolvedPoint], curves: Sequence[ConvergenceCurve]
) -> tuple[AnswerTable, AnswerTable]:
    """The points with their main numbers and cost, then the curves: the error of every followed
    number on its finest level, its rate, and the error estimated there.
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
        ),
        curves,
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
        levels = []
        for c in mine:
            # the first level from which on all stay within the limit
            within = np.append(np.abs(c.error[::-1]) <= limit, False)
            k = len(c.error) - int(np.argmin(within))
            if k < len(c.error):
                name = f"{c.curve} " * (len(mine) > 1) + c.labels[k]
                levels.append((c.seconds[k], name, c.error[k]))
        for seconds, level, error in sorted(levels)[:1]:
            at[f"{level} is enough for {{}}: {100 * abs(error):.2g} % in {seconds:.2g} s"] = limit
    found = [text.format(f"{100 * limit:g} %") for text, limit in at.items()]
    least = min(abs(c.error[-1]) for c in mine)
    none = f"no level stays within 1 %, the finest has {100 * least:.2g} %"
    what = f"{number_label(mine[0].name)} {mine[0].case}".strip()
    orders = [f"{c.curve} {c.order:.1f}" for c in mine if np.isfinite(c.order)]
    text = f"{what} against {mine[0].against}: {'; '.join(found) or none}. Order of convergence: "
    return (f"{text[:1].upper()}{text[1:]}{', '.join(orders) or 'none is clear'}.",)


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


def _estimated(curve: ConvergenceCurve) -> str:
    """Error of the finest level as the levels alone tell it."""
    found = curve.estimate
    return "" if found is None or not np.isfinite(found.error) else f"{100 * found.error:.2g} %"
