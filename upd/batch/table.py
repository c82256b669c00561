"""The numbers of a sweep as columns: one row per point, the same number in the same column."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.batch.plan import Place
from upd.errors import InputError
from upd.plot.sweep_charts import Column, Parameter
from upd.report.notebook import as_csv
from upd.results import Case, Result, shared_label
from upd.vary.outcome import Outcome

Array = NDArray[np.float64]

#: Columns when nothing is named and nothing usual is found.
_FEW = 12


def check_follow(outcome: Outcome, follow: Sequence[str]) -> None:
    """Raise InputError when a followed name is none of a solved point's numbers."""
    known = list(dict.fromkeys(result.name for result in outcome.results))
    strange = [one for one in follow if not any(fnmatchcase(name, one) for name in known)]
    if strange:
        raise InputError(
            f"--follow {', '.join(strange)}: no such number; there are {', '.join(known)}"
        )


def make_columns(outcomes: Sequence[Outcome], follow: Sequence[str]) -> list[Column]:
    """Columns of the numbers whose names match ``follow`` (shell patterns), in the order of the
    results.

    A column holds one number of one case, whatever the order in which a point lists it. Where the
    parameters set an attribute of the cases (F=50 N, F=80 N), it is written as *: one value at
    every point, or the k-th smallest of as many values at every point.
    """
    names = list(dict.fromkeys(one.name for outcome in outcomes for one in outcome.results))
    chosen = [name for name in names if any(fnmatchcase(name, one) for one in follow)]
    columns = [column for name in chosen or names for column in _columns(name, outcomes)]
    return columns if chosen else columns[:_FEW]


def reasons(outcomes: Sequence[Outcome], columns: Sequence[Column]) -> list[str]:
    """Why every point failed or lacks the numbers it has no value of; "" where all are there."""
    out = []
    for k, outcome in enumerate(outcomes):
        found: dict[str, list[str]] = {}
        for column in columns:
            if column.missing and column.missing[k]:
                found.setdefault(column.missing[k], []).append(column.title)
        lacks = [f"{', '.join(titles)}: {reason}" for reason, titles in found.items()]
        out.append(outcome.failure or "; ".join(lacks))
    return out


#: attributes of a case that a parameter of the sweep may set: numbers, of which a point may have
#: several, and words; all others say which number it is
_NUMBERS = ("load", "ratio", "force_ratio", "frequency", "part")
_WORDS = ("stiffness", "body", "direction", "friction", "arrangement")
_Key = tuple[tuple[str, Any], ...]


def _columns(name: str, outcomes: Sequence[Outcome]) -> list[Column]:
    found = [[one for one in outcome.results if one.name == name] for outcome in outcomes]
    ranks = _set_by_parameters([[one.case for one in mine] for mine in found])
    rows: dict[_Key, dict[int, Result]] = {}
    for k, mine in enumerate(found):
        places = {field: of_points[k] for field, of_points in ranks.items()}
        for one in mine:
            rows.setdefault(_key(one.case, places), {})[k] = one
    joined = _with_known_modes(rows)
    # one value at every point: the label does not need it
    single = [field for field, places in ranks.items() if max(map(len, places)) == 1]
    made = [_column(name, key, mine, outcomes, single) for key, mine in joined.items()]
    titles, seen_titles, out = Counter(c.case for c in made), Counter[str](), []
    for column in made:
        seen_titles[column.case] += 1
        double = titles[column.case] > 1
        case = f"{column.case} #{seen_titles[column.case]}" if double else column.case
        out.append(replace(column, case=case))
    return out


def _set_by_parameters(cases: Sequence[Sequence[Case]]) -> dict[str, list[dict[Any, int]]]:
    """Attributes that the parameters set: attribute -> for every point, value -> place in order."""
    out = {}
    for field in (*_NUMBERS, *_WORDS):
        values = [{c.given()[field] for c in mine if field in c.given()} for mine in cases]
        some = [one for one in values if one]
        counts = {len(one) for one in some}
        moved = len({frozenset(one) for one in some}) > 1
        if moved and len(counts) == 1 and (field in _NUMBERS or counts == {1}):
            out[field] = [{v: k for k, v in enumerate(sorted(one))} for one in values]
    return out


def _key(case: Case, places: Mapping[str, Mapping[Any, int]]) -> _Key:
    """What identifies a number among those of its name."""
    given = case.given()
    for field, place in places.items():
        if field in given:
            given[field] = ("place", place[given[field]])
    return tuple(sorted(given.items()))


def _with_known_modes(
    rows: Mapping[_Key, Mapping[int, Result]],
) -> dict[_Key, dict[int, Result]]:
    """Rows of every column: a withheld peak of no known mode is that of the mode which others
    have.
    """
    out = {key: dict(mine) for key, mine in rows.items()}
    for key, mine in rows.items():
        alike = [k for k in rows if k != key and _without(k, "mode") == key]
        if alike and all(one.withheld for one in mine.values()):
            del out[key]
            for other in alike:
                out[other] = {**mine, **out[other]}
    return out


def _without(key: _Key, *fields: str) -> _Key:
    return tuple(pair for pair in key if pair[0] not in fields)


def _column(
    name: str,
    key: _Key,
    rows: Mapping[int, Result],
    outcomes: Sequence[Outcome],
    varying: Sequence[str],
) -> Column:
    cases = [one.case for one in rows.values()]
    cases = [case for case in cases if case.mode] or cases
    known = {k: one for k, one in rows.items() if not one.withheld}
    missing = [
        _why(rows.get(k), key, outcome.results) if outcome.results and k not in known else ""
        for k, outcome in enumerate(outcomes)
    ]
    return Column(
        name,
        shared_label(cases, varying),
        next(iter(rows.values())).unit,
        np.array([known[k].value if k in known else np.nan for k in range(len(outcomes))]),
        tuple(missing),
        next((one.inputs for _, one in sorted(rows.items()) if one.inputs), ()),
    )


#: attributes that tell numbers of one curve apart
_WITHIN = ("mode", "peak", "side")


def _why(one: Result | None, key: _Key, results: Sequence[Result]) -> str:
    """Why a point has no value: its number's reason, or that of another which its curve lacks."""
    if one is not None:
        return one.withheld
    cases = [other.case.given() for other in results]
    fields = [field for field, value in key if isinstance(value, tuple)]
    there = {field: {given[field] for given in cases if field in given} for field in fields}
    places = {f: {value: k for k, value in enumerate(sorted(mine))} for f, mine in there.items()}
    mine = _without(key, *_WITHIN)
    for other in results:
        if other.withheld and _without(_key(other.case, places), *_WITHIN) == mine:
            return other.withheld
    return "not among the numbers of this point"


def csv_text(
    axes: Sequence[Parameter],
    places: Sequence[Place],
    outcomes: Sequence[Outcome],
    columns: Sequence[Column],
) -> str:
    """The table as CSV: parameters, followed numbers with all their digits, status, reason,
    warnings, seconds.

    The reason is why a point failed, or why it lacks a number.
    """
    heads = [*(axis.header for axis in axes), *(column.header for column in columns)]
    rows: list[list[Any]] = [[*heads, "status", "reason", "warnings", "seconds"]]
    why = reasons(outcomes, columns)
    for number, (place, outcome) in enumerate(zip(places, outcomes, strict=True)):
        numbers = [float(column.values[number]) for column in columns]
        rows.append(
            [
                *(axis.column[k] for axis, k in zip(axes, place, strict=True)),
                *("" if np.isnan(v) else repr(v) for v in numbers),
                "failed" if outcome.failure else "ok",
                why[number],
                "; ".join(outcome.warnings),
                f"{outcome.seconds:.3f}",
            ]
        )
    return as_csv(rows)
