"""A study: scenes with one thing changed, and what their numbers are compared with."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from upd.analyses import analysis_of
from upd.batch.curves import ConvergenceCurve, finest_curves, make_curves
from upd.batch.study_point import Settings, SolvedPoint, StudyPoint
from upd.batch.study_tables import TextTable, convergence_tables, level_table, markdown_table
from upd.cache.files import write_text
from upd.errors import InputError
from upd.plot.chart import Chart
from upd.plot.matplotlib import write_sheets
from upd.plot.work_precision import work_precision_charts
from upd.scene import AnyScene

#: numbers the loads alone decide: no level changes them
_OF_LOADS = ("F_N", "F_T")
#: divisions, refinements, numbers of modes ...: the levels a user asks for; fractions where a
#: ladder takes them; None for the usual ones
Levels = tuple[float, ...] | None


@dataclass(frozen=True)
class StudyReport:
    """What a study shows, and whether it found anything.

    Attributes
    ----------
    notes
        Sentences below the tables.
    curves
        For study.json and the figures.
    page
        Tables of study.md, where they are not those of the terminal.
    charts
        Makes the figures from the curves as study.json holds them.
    """

    tables: tuple[TextTable, ...]
    found: bool
    notes: tuple[str, ...] = ()
    curves: tuple[ConvergenceCurve, ...] = ()
    page: tuple[TextTable, ...] = ()
    charts: Callable[[Sequence[Mapping[str, Any]]], list[Chart]] = work_precision_charts


#: makes the report of solved points of a scene
Reporter = Callable[[Any, Sequence[SolvedPoint]], StudyReport]


@dataclass(frozen=True)
class Study:
    """Points in the order they are solved in, and what is made of them once they are.

    Attributes
    ----------
    present
        Makes the report; points that failed are in it.
    """

    title: str
    points: tuple[StudyPoint, ...]
    present: Callable[[Sequence[SolvedPoint]], StudyReport]

    def write(self, folder: Path, solved: Sequence[SolvedPoint], report: StudyReport) -> list[Path]:
        """Leave study.md, study.json (of a study with points) and the figures in ``folder``.

        Returns the paths, the table first.
        """
        curves = [asdict(one) for one in report.curves]
        table, data = folder / "study.md", folder / "study.json"
        lines = [f"# {self.title}", ""]
        for part in report.page or report.tables:
            lines += [f"## {part.title}", "", *markdown_table(part), ""]
        write_text(table, "\n".join([*lines, *(f"- {note}" for note in report.notes)]) + "\n")
        if not self.points:
            return [table]
        content = {
            "title": self.title,
            "points": [one.as_dict() for one in solved],
            "curves": curves,
            "notes": list(report.notes),
        }
        write_text(data, json.dumps(content, indent=1) + "\n")
        return [table, data, *write_sheets(report.charts(curves), folder)]


def _costs(scene: AnyScene, vary: str) -> str:
    return f"what accuracy costs, {vary}"


def _nothing(scene: AnyScene) -> Iterable[str]:
    return ()


@dataclass(frozen=True)
class Ladder:
    """What is varied in a scene, and what the numbers are compared with.

    Attributes
    ----------
    points
        Scene and levels -> points, coarse to fine. Raises InputError for levels that are none.
    follow
        Numbers (shell patterns) beside those the analysis names first.
    against
        The limit each number leads to, or the finest level: where levels are no sizes.
    every_level
        Whether a table shows the numbers of every level.
    notes
        What the levels set in the scene, in sentences.
    subject
        Scene and variation -> the title without the scene's.
    report
        Makes another report than errors over what they cost.
    """

    points: Callable[[Any, Levels], Iterable[StudyPoint]]
    follow: tuple[str, ...] = ()
    against: Literal["limit", "finest"] = "limit"
    every_level: bool = False
    notes: Callable[[Any], Iterable[str]] = _nothing
    subject: Callable[[Any, str], str] = _costs
    report: Reporter | None = None

    def study(self, scene: AnyScene, vary: str, levels: Levels = None) -> Study:
        """The study of the scene. Raises InputError for levels that are none."""
        report = self.report or self._convergence
        return Study(
            f"{scene.title or scene.name}: {self.subject(scene, vary)}",
            tuple(self.points(scene, levels)),
            lambda solved: report(scene, solved),
        )

    def _convergence(self, scene: AnyScene, solved: Sequence[SolvedPoint]) -> StudyReport:
        names = [
            name
            for name in dict.fromkeys((*analysis_of(scene).headline_names, *self.follow))
            if name not in _OF_LOADS
        ]
        curves = (make_curves if self.against == "limit" else finest_curves)(solved, names)
        before = (level_table(solved, names),) if self.every_level else ()
        tables, page = convergence_tables(solved, curves)
        return StudyReport(
            (*before, *tables), bool(curves), tuple(self.notes(scene)), tuple(curves), page
        )


@dataclass(frozen=True)
class Counts:
    """Levels that are one whole number of the scene.

    Attributes
    ----------
    curve, label
        Name of the ladder; a level in words, with {} for the number.
    path
        What is set in the scene.
    usual, least
        The usual numbers; the least that can be asked for.
    base
        Scene -> what every level sets beside.
    offset
        The size of a level is 1 / (number + offset): 1 where 0 is a level.
    """

    curve: str
    label: str
    path: str
    usual: tuple[int, ...]
    least: int
    base: Callable[[Any], Settings]
    offset: int = 0

    def __call__(self, scene: AnyScene, levels: Levels) -> list[StudyPoint]:
        return [
            StudyPoint(
                self.curve,
                self.label.format(n),
                (*self.base(scene), (self.path, n)),
                1.0 / (n + self.offset),
            )
            for n in whole_levels(levels, self.least) or self.usual
        ]


def whole_levels(levels: Levels, least: int) -> tuple[int, ...] | None:
    """The levels as rising whole numbers, None where none are given.

    Raises InputError unless there are two or more different ones, none below ``least``.
    """
    if levels is None:
        return None
    whole = tuple(int(n) for n in levels if float(n).is_integer() and n >= least)
    if len(set(whole)) < len(levels) or len(levels) < 2:
        raise InputError(
            f"--levels {shown(levels)}: give at least two different whole numbers, {least} or more"
        )
    return tuple(sorted(whole))


def refinements(levels: Levels) -> tuple[float, ...] | None:
    """Refinements of a rig, None where none are given: 0.5, which halves its counts, or whole.

    Raises InputError unless there are two or more different ones.
    """
    if levels is None:
        return None
    fine = [n for n in levels if n == 0.5 or (n >= 1 and float(n).is_integer())]
    if len(set(fine)) < len(levels) or len(levels) < 2:
        raise InputError(
            f"--levels {shown(levels)}: give at least two different refinements, 0.5 (half as many "
            "elements along every edge) or whole numbers"
        )
    return tuple(float(n) for n in sorted(fine))


def shown(levels: Iterable[float]) -> str:
    """Levels as the user writes them."""
    return " ".join(f"{n:g}" for n in levels)


def no_levels(levels: Levels, why: str) -> None:
    """Raise InputError when levels are given to a variation that has none."""
    if levels is not None:
        raise InputError(f"--levels: {why}; leave it out")


def even(count: float) -> int:
    """An even number of elements, at least 4: the plane y = 0 and the core's side need lines."""
    return max(4, 2 * round(count / 2.0))
