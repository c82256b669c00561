"""What a study is: points that change something in a scene, a report of what they gave, and
files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

from upd.analyses import analysis_of
from upd.batch.point import Outcome, PointResult, Task
from upd.errors import InputError
from upd.results import Case
from upd.scene import AnyScene
from upd.scene.quantities import UNKNOWN

#: path -> value pairs that a point sets in the scene
Settings = tuple[tuple[str, Any], ...]
#: name of a number and the case it belongs to
Key = tuple[str, Case]


@dataclass(frozen=True)
class StudyPoint:
    """One run of a study.

    Attributes
    ----------
    curve
        Name of the ladder the point belongs to.
    label
        The point in words.
    settings
        What it sets in the scene.
    h
        Size that a ladder lets go to zero: the node spacing in the patch in mm, one over a
        refinement or a number of levels.
    estimates
        Whether the point estimates its own errors. Others leave that out: the seconds are those of
        the level alone.
    """

    curve: str
    label: str
    settings: Settings
    h: float = 1.0
    estimates: bool = False

    def task(self, scene: AnyScene, threads: int, code: str) -> Task:
        """The point for a worker, that shares nothing with others.

        Its seconds and memory are shown.
        """
        settings = ({} if self.estimates else {"accuracy": UNKNOWN}) | dict(self.settings)
        return Task(scene.text, settings, threads, recipe=scene.recipe, code=code, alone=True)


@dataclass(frozen=True)
class SolvedPoint:
    """A point of a study and what it gave."""

    point: StudyPoint
    outcome: Outcome

    @cached_property
    def values(self) -> dict[Key, float]:
        """Its numbers; nan where one is not finite."""
        return {_key(r): float("nan") if r.value is None else r.value for r in self.outcome.results}

    @cached_property
    def errors(self) -> dict[Key, float]:
        """Relative differences from what the numbers should converge to, where that is known."""
        return {_key(r): r.error for r in self.outcome.results if r.error is not None and r.exact}

    @cached_property
    def printed_errors(self) -> dict[Key, float]:
        """Those of published values."""
        return {
            _key(r): r.printed_error for r in self.outcome.results if r.printed_error is not None
        }

    def as_dict(self) -> dict[str, Any]:
        """The point as it stands in study.json."""
        named = {"values": self.values, "errors": self.errors, "thesis": self.printed_errors}
        o = self.outcome
        return {
            "curve": self.point.curve,
            "label": self.point.label,
            "h": self.point.h,
            **{
                kind: {f"{name}|{case.label}": v for (name, case), v in found.items()}
                for kind, found in named.items()
            },
            "stages": dict(o.stages),
            "seconds": o.seconds,
            "memory_mb": o.memory_mb,
            "n_dof": o.n_dof,
            "failure": o.failure,
        }


def _key(result: PointResult) -> Key:
    return result.name, result.case


@dataclass(frozen=True)
class TextTable:
    """A table for a terminal.

    Cells as text, ``align`` a letter per column ("l", "r"), the first column at least ``width``
    wide. Columns of words named in ``spare`` are left out first where the terminal is narrow.
    """

    title: str
    columns: tuple[str, ...]
    align: str
    rows: tuple[tuple[str, ...], ...]
    width: int = 0
    spare: tuple[str, ...] = ()


@dataclass(frozen=True)
class StudyReport:
    """What a study shows, and whether it found anything.

    Attributes
    ----------
    notes
        Sentences below the tables.
    """

    tables: tuple[TextTable, ...]
    found: bool
    notes: tuple[str, ...] = ()


class Study(Protocol):
    """Points, and what is made of them once they are solved."""

    @property
    def points(self) -> Sequence[StudyPoint]:
        """The points, in the order they are solved in."""

    def present(self, solved: Sequence[SolvedPoint]) -> StudyReport:
        """Tables of what the points gave; those that failed are among them."""

    def write(self, folder: Path, solved: Sequence[SolvedPoint]) -> list[Path]:
        """Leave study.md and what else there is in ``folder``.

        Returns the paths, the table first.
        """


#: divisions, refinements, numbers of modes ...: the levels a user asks for; fractions where a
#: ladder takes them
Levels = tuple[float, ...] | None
#: makes the study of a scene, of one of the variations it is listed under
#: (`upd.batch.studies.STUDIES`)
StudyMaker = Callable[[Any, str, Levels], Study]


def whole_levels(levels: Levels, least: int) -> tuple[int, ...] | None:
    """The levels as whole numbers, None where none are given.

    Raises InputError unless there are two or more different ones, none below ``least``.
    """
    if levels is None:
        return None
    whole = tuple(int(n) for n in levels if float(n).is_integer() and n >= least)
    if len(set(whole)) < len(levels) or len(levels) < 2:
        raise InputError(
            f"--levels {told(levels)}: give at least two different whole numbers, {least} or more"
        )
    return whole


def refinements(levels: Levels) -> tuple[float, ...] | None:
    """Refinements of a rig, None where none are given: 0.5, which halves its counts, or whole.

    Raises InputError unless there are two or more different ones.
    """
    if levels is None:
        return None
    fine = [n for n in levels if n == 0.5 or (n >= 1 and float(n).is_integer())]
    if len(set(fine)) < len(levels) or len(levels) < 2:
        raise InputError(
            f"--levels {told(levels)}: give at least two different refinements, 0.5 (half as many "
            "elements along every edge) or whole numbers"
        )
    return tuple(float(n) for n in sorted(fine))


def told(levels: Iterable[float]) -> str:
    """Levels as the user writes them."""
    return " ".join(f"{n:g}" for n in levels)


def no_levels(levels: Levels, why: str) -> None:
    """Raise InputError when levels are given to a variation that has none."""
    if levels is not None:
        raise InputError(f"--levels: {why}; leave it out")


def followed(scene: AnyScene, *more: str) -> tuple[str, ...]:
    """Names (shell patterns) a study of the scene follows.

    Those the analysis names first, and ``more``.
    """
    return tuple(dict.fromkeys((*analysis_of(scene).headline_names, *more)))


def matching(solved: Iterable[SolvedPoint], patterns: Iterable[str]) -> list[Key]:
    """Numbers of the points whose names match, pattern by pattern in the order of the results."""
    keys = list(dict.fromkeys(key for one in solved for key in one.values))
    return list(
        dict.fromkeys(key for pattern in patterns for key in keys if fnmatchcase(key[0], pattern))
    )


def markdown_report(title: str, report: StudyReport, notes: Iterable[str]) -> str:
    """A study's tables in Markdown, each under its title, then its notes."""
    lines = [f"# {title}", ""]
    for table in report.tables:
        heads = [head.replace("\n", " ") for head in table.columns]
        lines += [f"## {table.title}", "", *markdown_table(heads, table.align, table.rows), ""]
    return "\n".join([*lines, *(f"- {note}" for note in notes)]) + "\n"


def markdown_table(columns: Sequence[str], align: str, rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table in Markdown; ``align`` has a letter per column, "l" or "r"."""
    marks = "".join("---:|" if letter == "r" else "---|" for letter in align)
    return [f"| {' | '.join(columns)} |", f"|{marks}", *(f"| {' | '.join(row)} |" for row in rows)]
