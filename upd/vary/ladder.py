"""A convergence study: levels of a scene with one thing changed, and what their numbers show."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from upd.errors import InputError
from upd.plot.answer_table import AnswerTable
from upd.vary.curves import (
    ESTIMATED,
    TRUE,
    ConvergenceCurve,
    convergence_tables,
    enough,
    finest_curves,
    level_table,
    make_curve,
    make_curves,
    points_table,
    true_errors,
    with_friction,
)
from upd.vary.outcome import SolvedPoint, matching, without_failed
from upd.vary.variation import Key, Overrides, Variation

#: divisions, refinements, numbers of modes ...: the levels a user asks for; None: the usual ones
Asked = tuple[float, ...] | None


@dataclass(frozen=True)
class StudyReport:
    """What a study shows, and whether it found anything.

    Attributes
    ----------
    notes
        Sentences below the tables.
    curves
        For study.json and the figures.
    details
        Further tables, of study.md and the page.
    """

    tables: tuple[AnswerTable, ...]
    found: bool
    notes: tuple[str, ...] = ()
    curves: tuple[ConvergenceCurve, ...] = ()
    details: tuple[AnswerTable, ...] = ()


#: scene, solved points, names of the numbers to follow -> the report
Reporter = Callable[[Any, Sequence[SolvedPoint], Sequence[str]], StudyReport]


def convergence_report(
    scene: object, solved: Sequence[SolvedPoint], names: Sequence[str], *, finest: bool = False
) -> StudyReport:
    """Errors against what each number converges to.

    Parameters
    ----------
    finest
        Whether the levels are no sizes: then changes from the last one, below the numbers of all.
    """
    del scene
    keys = with_friction(matching(solved, names))

    def text(one: SolvedPoint, key: Key) -> str:
        failed = "failed" * bool(one.outcome.failure)
        return f"{one.values[key]:.5g}" if key in one.values else failed

    before = [level_table("Numbers of every level", keys, solved, text)] if finest else []
    curves = (finest_curves if finest else make_curves)(solved, names)
    levels, errors = convergence_tables(solved, curves)
    notes = enough(curves)
    return StudyReport((*before, levels), bool(curves), notes, tuple(curves), details=(errors,))


finest_report = partial(convergence_report, finest=True)


def accuracy_report(
    scene: object, solved: Sequence[SolvedPoint], names: Sequence[str]
) -> StudyReport:
    """What every accuracy costs, then the error of every number as estimated and in truth."""
    del scene
    known = {key for one in solved for key in one.estimates}
    keys = [key for key in matching(solved, names) if key in known]
    tables, curves, good = [points_table(solved)], list[ConvergenceCurve](), without_failed(solved)
    kinds: dict[str, tuple[str, Callable[[SolvedPoint], Mapping[Key, float]]]] = {
        ESTIMATED: ("Estimated error", lambda one: one.estimates),
        TRUE: ("True error", true_errors),
    }
    for kind, (title, errors) in kinds.items():

        def text(one: SolvedPoint, key: Key, errors: Any = errors) -> str:
            return f"{100.0 * abs(errors(one)[key]):.2g} %" if key in errors(one) else ""

        rows = [key for key in keys if any(key in errors(one) for one in good)]
        tables += [level_table(title, rows, solved, text)] * bool(rows)
        for key in rows:
            mine = [one for one in good if key in errors(one)]
            found = [errors(one)[key] for one in mine]
            curves.append(make_curve(kind, key, mine, found, mine[-1].values[key], ""))
    return StudyReport(tuple(tables), bool(known), (), tuple(curves))


@dataclass(frozen=True)
class Ladder:
    """What is varied in a scene, and the report of its numbers.

    Attributes
    ----------
    variations
        Scene and levels -> variations, coarse to fine; their source is the curve they belong to.
        Raises InputError for levels that are none.
    follow
        Numbers (shell patterns) beside those the analysis names first.
    report
        Makes the report.
    notes
        What the levels set in the scene, in sentences.
    title
        Scene and variation -> the title without the scene's.
    applies
        Whether it changes a number of the scene.
    """

    variations: Callable[[Any, Asked], Iterable[Variation]]
    follow: tuple[str, ...] = ()
    report: Reporter = convergence_report
    notes: Callable[[Any], Iterable[str]] = lambda scene: ()
    title: Callable[[Any, str], str] = lambda scene, vary: f"what accuracy costs, {vary}"
    applies: Callable[[Any], bool] = lambda scene: True


def counts(
    source: str,
    label: str,
    path: str,
    usual: Sequence[int],
    least: int,
    base: Overrides | Callable[[Any], Overrides],
    offset: int = 0,
) -> Callable[[Any, Asked], list[Variation]]:
    """Levels that are one whole number of the scene.

    Parameters
    ----------
    label
        A level in words, with {} for the number.
    path
        What is set in the scene.
    usual, least
        The usual numbers; the least that can be asked for.
    base
        What every level sets beside, or scene -> that.
    offset
        The size of a level is 1 / (number + offset): 1 where 0 is a level.
    """

    def variations(scene: Any, asked: Asked) -> list[Variation]:
        fixed = base(scene) if callable(base) else base
        return [
            Variation(source, label.format(n), (*fixed, (path, n)), 1.0 / (n + offset))
            for n in whole_levels(asked, least) or usual
        ]

    return variations


def chosen_levels(
    asked: Sequence[float], allowed: Callable[[float], bool], words: str, least: int = 2
) -> list[float]:
    """The levels that a user asks for, rising.

    Raises InputError unless ``least`` different ones or more are given, all of them ``allowed``.
    """
    good = sorted({n for n in asked if allowed(n)})
    if len(good) < max(least, len(asked)):
        shown, few = " ".join(f"{n:g}" for n in asked), "at least two " * (least > 1)
        raise InputError(f"--levels {shown}: give {few}different {words}")
    return good


def whole_levels(asked: Asked, least: int, what: str = "whole numbers", step: int = 1) -> list[int]:
    """The levels as whole numbers, rising; empty where none are given. Raises InputError."""
    if asked is None:
        return []
    good = chosen_levels(
        asked,
        lambda n: math.isfinite(n) and n >= least and n % step == 0,
        f"{what}, {least} or more",
    )
    return [int(n) for n in good]


def refinements(asked: Asked) -> list[float]:
    """Refinements of a rig: 0.5, which halves its counts, or whole. Raises InputError."""
    if asked is None:
        return []
    return [
        float(n)
        for n in chosen_levels(
            asked,
            lambda n: n == 0.5 or (n >= 1 and float(n).is_integer()),
            "refinements, 0.5 (half as many elements along every edge) or whole numbers",
        )
    ]


def no_levels(asked: Asked, why: str) -> None:
    """Raise InputError when levels are given to a variation that has none."""
    if asked is not None:
        raise InputError(f"--levels: {why}; leave it out")


def even(count: float) -> int:
    """An even number of elements, at least 4: the plane y = 0 and the core's side need lines."""
    return max(4, 2 * round(count / 2.0))
