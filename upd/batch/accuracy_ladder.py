"""The ladder of accuracies a scene is asked for: what it reached, by its own estimate and, where
there is a closed form, in truth, over seconds and memory.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from upd.analyses import analysis_of
from upd.analyses.flat import accuracy as flat
from upd.analyses.hertz import accuracy as hertz
from upd.batch.curves import ConvergenceCurve, closed_form
from upd.batch.ladder import (
    Key,
    Levels,
    SolvedPoint,
    Study,
    StudyMaker,
    StudyPoint,
    StudyReport,
    TextTable,
    markdown_report,
    matching,
    told,
)
from upd.cache.files import write_text
from upd.errors import InputError
from upd.labels import number_label
from upd.plot.matplotlib import write_sheets
from upd.plot.work_precision import work_precision_charts
from upd.scene import Scene

#: analysis -> numbers an accuracy is asked of, and the usual ones in per cent: 3 % takes 7 GB on
#: the ready sphere, 2 % 24 GB
_ASKED: Mapping[str, tuple[tuple[str, ...], tuple[float, ...]]] = {
    "hertz": (hertz.GOVERNING, (40.0, 10.0, 3.0)),
    "flat": (flat.GOVERNING, (20.0, 10.0, 5.0)),
}
#: names of the two curves of a number
ESTIMATED, TRUE = "estimated", "against the closed form"


@dataclass(frozen=True)
class AccuracyStudy:
    """Runs that choose their mesh by an accuracy, and what each of them reached.

    Attributes
    ----------
    names
        Of the numbers that are followed, as shell patterns.
    """

    title: str
    points: tuple[StudyPoint, ...]
    names: tuple[str, ...]

    def present(self, solved: Sequence[SolvedPoint]) -> StudyReport:
        """What every accuracy costs, then the error of every number as estimated and in truth."""
        tables = (_cost_table(solved), *_reached_tables(solved, self._keys(solved)))
        return StudyReport(tables, any(_estimates(one) for one in solved), _NOTES)

    def write(self, folder: Path, solved: Sequence[SolvedPoint]) -> list[Path]:
        """study.md, study.json and work_precision.png."""
        curves = [asdict(c) for c in accuracy_curves(solved, self._keys(solved))]
        table, data = folder / "study.md", folder / "study.json"
        content = {
            "title": self.title,
            "points": [one.as_dict() for one in solved],
            "curves": curves,
            "notes": list(_NOTES),
        }
        write_text(data, json.dumps(content, indent=1) + "\n")
        write_text(table, markdown_report(self.title, self.present(solved), _NOTES))
        return [table, data, *write_sheets(work_precision_charts(curves), folder)]

    def _keys(self, solved: Sequence[SolvedPoint]) -> list[Key]:
        """Followed numbers whose error was estimated on a level."""
        known = {key for one in solved for key in _estimates(one)}
        return [key for key in matching(solved, self.names) if key in known]


_NOTES = (
    "estimated: what the run says of itself, a bound; true: against the closed form, where a "
    "number has one",
    "the accuracy is asked of these numbers alone; where one mesh reaches two accuracies, both "
    "levels are that mesh",
)


def accuracy_study(scene: Scene, vary: str, levels: Levels = None) -> Study:
    """The scene at one accuracy after the other.

    Parameters
    ----------
    vary
        "accuracy".
    levels
        Errors in per cent; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none.
    """
    names, usual = _ASKED[analysis_of(scene).name]
    wanted = sorted(set(levels or usual), reverse=True)
    if levels is not None and (len(wanted) < 2 or not all(0.0 < p < 100.0 for p in wanted)):
        raise InputError(
            f"--levels {told(levels)}: give at least two different errors in per cent, between 0 "
            "and 100, for example --levels 5 2 1"
        )
    points = tuple(
        StudyPoint(
            "accuracy",
            f"{p:g} %",
            (("accuracy", p / 100.0),),
            p / 100.0,
            estimates=True,
        )
        for p in wanted
    )
    title = f"{scene.title or scene.name}: what accuracy costs, accuracy"
    return AccuracyStudy(title, points, names)


def accuracy_curves(solved: Sequence[SolvedPoint], keys: Sequence[Key]) -> list[ConvergenceCurve]:
    """Estimated error of every number over the cost of a level, and the true one beside it."""
    good = [one for one in solved if not one.outcome.failure]
    curves = []
    for key in keys:
        kinds = {ESTIMATED: map(_estimates, good), TRUE: map(_true, good)}
        for curve, found in kinds.items():
            mine = [(one, at[key]) for one, at in zip(good, found, strict=True) if key in at]
            if mine:
                curves.append(_curve(curve, key, mine))
    return curves


def _curve(curve: str, key: Key, mine: Sequence[tuple[SolvedPoint, float]]) -> ConvergenceCurve:
    points = [one for one, _ in mine]
    return ConvergenceCurve(
        curve=curve,
        name=key[0],
        case=key[1].label,
        labels=tuple(one.point.label for one in points),
        h=tuple(one.point.h for one in points),
        error=tuple(error for _, error in mine),
        seconds=tuple(one.outcome.seconds for one in points),
        memory_mb=tuple(one.outcome.memory_mb for one in points),
        reference=points[-1].values.get(key, math.nan),
        against="",
    )


def _estimates(one: SolvedPoint) -> dict[Key, float]:
    """Estimated errors of the point's numbers."""
    return {(r.name, r.case): r.estimated for r in one.outcome.results if r.estimated is not None}


def _cost_table(solved: Sequence[SolvedPoint]) -> TextTable:
    heads = ("wanted", "dofs", "seconds", "peak MB", "note")
    rows = tuple(
        (
            one.point.label,
            f"{one.outcome.n_dof}",
            f"{one.outcome.seconds:.2f}",
            f"{one.outcome.memory_mb:.0f}",
            one.outcome.failure,
        )
        for one in solved
    )
    return TextTable("What every accuracy costs", heads, "rrrrl", rows)


def _reached_tables(solved: Sequence[SolvedPoint], keys: Sequence[Key]) -> list[TextTable]:
    """A table for the estimated errors and one for the true ones, a column per wanted accuracy."""
    heads = ("number", "case", *(one.point.label for one in solved))
    found = []
    for title, of in (("Estimated error", _estimates), ("True error", _true)):
        errors = [of(one) for one in solved]
        rows = tuple(
            (number_label(key[0]), key[1].label, *(_percent(at.get(key)) for at in errors))
            for key in keys
            if any(key in at for at in errors)
        )
        width = max((len(row[0]) for row in rows), default=0)
        if rows:
            found.append(TextTable(title, heads, "ll" + "r" * len(solved), rows, width))
    return found


def _true(one: SolvedPoint) -> dict[Key, float]:
    """Errors against closed forms; of a raw number, on the same finite bodies."""
    found = {key: closed_form(key, [one]) for key in one.values}
    return {
        key: one.values[key] / float(exact[0]) - 1.0
        for key, exact in found.items()
        if exact is not None
    }


def _percent(error: float | None) -> str:
    return "" if error is None else f"{100.0 * abs(error):.2g} %"


LADDERS: Mapping[str, StudyMaker] = {"accuracy": accuracy_study}
