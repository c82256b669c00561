"""The numbers of a sweep as columns: one row per point, the same number in the same column."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from upd.analyses import analysis_of
from upd.batch.grid import GridAxis, Place
from upd.batch.point import Outcome
from upd.errors import InputError
from upd.labels import file_name
from upd.results import Case, shared_label
from upd.scene import AnyScene

Array = NDArray[np.float64]

#: Columns when nothing is named and nothing usual is found.
_FEW = 12


@dataclass(frozen=True)
class Column:
    """One followed number over all points: values (n,), NaN where there is none."""

    name: str
    case: str
    unit: str
    values: Array

    @property
    def title(self) -> str:
        """Name, and the case when there is one."""
        return f"{self.name} ({self.case})" if self.case else self.name

    @property
    def header(self) -> str:
        """Title with the unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    @property
    def variable(self) -> str:
        """A name for files."""
        return file_name(self.title)


def patterns(scene: AnyScene, follow: Sequence[str]) -> tuple[str, ...]:
    """What the user follows, or what is usual for the scene's analysis."""
    return tuple(follow) or analysis_of(scene).headline_names


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

    Cases with the same labels in all points keep them. Where labels change with the parameters
    (F=50 N, F=80 N), the k-th case of a number belongs to the k-th of the others, and what changes
    is written as *.
    """
    tables = [_by_name(outcome) for outcome in outcomes]
    names = list(dict.fromkeys(name for table in tables for name in table))
    chosen = [name for name in names if any(fnmatchcase(name, one) for one in follow)]
    columns = [column for name in chosen or names for column in _columns(name, tables)]
    return columns if chosen else columns[:_FEW]


def _by_name(outcome: Outcome) -> dict[str, list[tuple[Case, str, float]]]:
    table: dict[str, list[tuple[Case, str, float]]] = {}
    for r in outcome.results:
        table.setdefault(r.name, []).append(
            (r.case, r.unit, float("nan") if r.value is None else r.value)
        )
    return table


def _columns(
    name: str, tables: Sequence[Mapping[str, list[tuple[Case, str, float]]]]
) -> list[Column]:
    found = [table.get(name, []) for table in tables]
    some = [cases for cases in found if cases]
    count = Counter(map(len, some)).most_common(1)[0][0]
    columns = []
    for k in range(count):
        # Another number of cases (a load less, say): which is which is not known, so they stay
        # empty.
        values = np.array([cases[k][2] if len(cases) == count else np.nan for cases in found])
        alike = [cases[k][0] for cases in some if len(cases) == count]
        columns.append(
            Column(
                name,
                shared_label(alike),
                next(cases[k][1] for cases in some if len(cases) == count),
                values,
            )
        )
    titles = Counter(column.case for column in columns)
    seen: Counter[str] = Counter()
    out = []
    for column in columns:
        seen[column.case] += 1
        double = titles[column.case] > 1
        out.append(
            Column(
                name,
                f"{column.case} #{seen[column.case]}" if double else column.case,
                column.unit,
                column.values,
            )
        )
    return out


def csv_text(
    axes: Sequence[GridAxis],
    places: Sequence[Place],
    outcomes: Sequence[Outcome],
    columns: Sequence[Column],
) -> str:
    """The table as CSV: parameters, followed numbers with all their digits, status, reason,
    warnings, seconds.
    """
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n").writerow
    write(
        [
            *(axis.header for axis in axes),
            *(column.header for column in columns),
            "status",
            "reason",
            "warnings",
            "seconds",
        ]
    )
    for place, outcome in zip(places, outcomes, strict=True):
        shown = [axis.shown(k) for axis, k in zip(axes, place.index, strict=True)]
        numbers = [float(column.values[place.number]) for column in columns]
        status = "failed" if outcome.failure else "ok"
        write(
            [
                *shown,
                *("" if np.isnan(v) else repr(v) for v in numbers),
                status,
                outcome.failure,
                "; ".join(outcome.warnings),
                f"{outcome.seconds:.3f}",
            ]
        )
    return out.getvalue()
