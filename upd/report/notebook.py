"""The result of a run, and how it shows itself in a notebook.

Text, table, figure of the main curves, xarray.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upd.errors import ConvergenceError, InputError, did_you_mean
from upd.plot.chart import Chart
from upd.report.answer import AnswerLine, answer, opened
from upd.report.columns import text_width
from upd.report.folder import read_run
from upd.report.tables import analysis_charts
from upd.results import Arrays, Case, Check, Result
from upd.results.check import outcome_of, read_check
from upd.results.number import read_result
from upd.results.quantities import number_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: charts of the figure nobody chose
_MOST_CHARTS = 6


@dataclass(frozen=True)
class RunResult:
    """Result of `upd.run`: ``results`` (all numbers), ``arrays`` (case -> name -> array), effects,
    checks, size and cost.

    Attributes
    ----------
    scene_text
        The scene as run, TOML.
    faults
        What went wrong with the pictures of the run folder, a line each.
    """

    scene: str
    title: str
    status: str
    results: tuple[Result, ...]
    effects: tuple[dict[str, Any], ...]
    checks: tuple[Check, ...]
    size: Mapping[str, Any]
    cost: Mapping[str, Any] = field(default_factory=dict)
    arrays: Arrays = field(default_factory=dict, repr=False)
    folder: Path | None = None
    scene_text: str = field(default="", repr=False)
    faults: tuple[str, ...] = ()

    @property
    def rows(self) -> tuple[Result, ...]:
        """`results` under the name that scripts know."""
        return self.results

    @property
    def outcome(self) -> str:
        """ "ok", "ok with warnings" or "failed"; `status` names the reasons."""
        return outcome_of(self.status)

    def value(self, name: str, case: str | Case | None = None) -> float:
        """The number ``name`` of ``case``, its label or itself (the only one when None).

        The mode at the end of a peak's case may be left out.

        Raises
        ------
        InputError
            When there is none, or several and no case.
        ConvergenceError
            When it was not reached, with the reason.
        """
        mine = [r for r in self.results if r.name == name]
        rows = [r for r in mine if case is None or r.case.matches(case)]
        if not mine:
            raise _unknown("result", name, sorted({r.name for r in self.results}))
        if not rows:
            raise _unknown(f"result {name!r} for case", str(case), [str(r.case) for r in mine])
        row = rows[0]
        if case is None and len(rows) > 1:
            cases = ", ".join(f'"{r.case}"' for r in rows)
            raise InputError(f'{name} has several cases: write value("{name}", case) with {cases}')
        if row.withheld:
            raise ConvergenceError(
                f"{number_title(name, str(row.case))}: not reached, {row.withheld}"
            )
        return row.value

    def summary(self) -> dict[str, Any]:
        """The content of summary.json."""
        return {
            "scene": self.scene,
            "title": self.title,
            "status": self.status,
            "effects": list(self.effects),
            "checks": [c.as_dict() for c in self.checks],
            "size": dict(self.size),
            "cost": dict(self.cost),
            "results": [r.as_dict() for r in self.results],
        }

    def plot(
        self, title: str | None = None, *, case: str | None = None, ax: Axes | None = None
    ) -> list[Axes]:
        """Draw the main curves and maps with matplotlib, and return the axes.

        Parameters
        ----------
        title
            Draw the charts whose title has these words, of all cases; the first chart of every
            title, six at most, when None.
        case
            Only of this case.
        ax
            Draw on these axes; title and case must then mean one chart.

        Raises
        ------
        InputError
            For a title or case there is not; the message lists those there are.
        """
        from upd.plot.matplotlib import draw, draw_all

        chosen = _chosen(charts(self), title, case)
        if ax is None:
            return draw_all(chosen)
        if len(chosen) > 1:
            raise InputError(f"plot: ax takes one of {len(chosen)} charts; give title and case")
        return [draw(chosen[0], ax)]

    def table(self) -> str:
        """Its answer as the terminal prints it with --full: all numbers with the bounds of their
        errors, effects, checks, sources of errors, cost.
        """
        return "\n".join(text for text, _ in self.answer(text_width(), full=True))

    def to_xarray(self) -> dict[str, Any]:
        """Case -> xarray.Dataset, with dimensions, coordinates and units; needs xarray."""
        import xarray

        return {
            case: xarray.Dataset(
                {name: (v.dims, v.data, dict(v.attributes)) for name, v in group.items()},
                attrs={"case": case},
            )
            for case, group in self.arrays.items()
        }

    def answer(self, width: int, *, full: bool = False) -> list[AnswerLine]:
        """Its answer as the terminal prints it, in lines of ``width`` characters; with all numbers,
        checks and sources of errors when ``full``.
        """
        return answer(self.summary(), width, self.folder, self.faults, full=full)

    def __repr__(self) -> str:
        return opened("\n".join(text for text, _ in self.answer(text_width())))

    __str__ = __repr__


def charts(result: RunResult) -> list[Chart]:
    """All charts of the run, the most important first."""
    summary = result.summary() | {"scene_file": tomllib.loads(result.scene_text)}
    return analysis_charts(result.arrays, summary)


def _chosen(found: list[Chart], title: str | None, case: str | None) -> list[Chart]:
    """Charts of the title and the case; the first of every title when neither is given."""
    if not found:
        raise InputError("plot: the run left no arrays to draw; its numbers are in .results")
    if title is None and case is None:
        return list({chart.title: chart for chart in reversed(found)}.values())[::-1][:_MOST_CHARTS]
    mine = [c for c in found if (title or "").casefold() in c.title.casefold()]
    if not mine:
        raise _unknown("chart", str(title), [c.title for c in found])
    if case is None:
        return mine[:_MOST_CHARTS]
    if cases := [c for c in mine if c.case == case]:
        return cases
    raise _unknown("chart of the case", case, [c.case for c in mine if c.case])


def _unknown(what: str, word: str, known: Iterable[str]) -> InputError:
    """The error of a name that none has: the nearest, or all that there are."""
    names = list(dict.fromkeys(known))
    near = did_you_mean(word, names, f"there are {', '.join(names) or 'none'}")
    return InputError(f"no {what} {word!r}{near}")


# -- read back from its folder --------------------------------------------------------------------


def load(folder: str | Path) -> RunResult:
    """The result of a finished run, from its folder.

    It answers as the one `upd.run` returned: numbers, checks, cost, arrays, charts.

    Parameters
    ----------
    folder
        Run folder, as `upd run` or ``upd.run(..., out=folder)`` left it.

    Returns
    -------
    RunResult

    Raises
    ------
    InputError
        When it is no run folder, or its summary or its arrays are damaged.
    """
    run = read_run(Path(folder), whole=True)
    summary = run.summary
    return RunResult(
        **{key: summary[key] for key in ("scene", "title", "status", "size", "cost")},
        results=tuple(map(read_result, summary["results"])),
        effects=tuple(summary["effects"]),
        checks=tuple(map(read_check, summary["checks"])),
        # A file has no slash in the name of a group.
        arrays={name.replace(" per ", "/"): group for name, group in run.arrays.items()},
        folder=run.path,
        scene_text=run.scene,
    )
