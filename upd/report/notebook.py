"""The result of a run: text, table, figure of the main curves, xarray; PNG figures and CSV curves
of its folder.
"""

from __future__ import annotations

import csv
import io
import logging
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from upd.cache.files import write_text
from upd.errors import ConvergenceError, InputError, UpdError, did_you_mean
from upd.labels import file_name
from upd.mesh import recipes
from upd.plot.chart import Chart
from upd.report.answer import AnswerLine, answer, opened
from upd.report.columns import text_width
from upd.report.folder import read_run
from upd.report.tables import analysis_charts
from upd.results import Arrays, Case, Check, Group, Result, Variable
from upd.results.check import outcome_of, read_check
from upd.results.number import read_result
from upd.results.quantities import number_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

log = logging.getLogger(__name__)

#: dimension of a pair of real and imaginary part
_PART = "part"
#: dimensions whose tables stand among the numbers of summary.json
_PEAKS = "peak"
#: dimensions of a map on a face
_PLACES = ("x", "y")
#: dimension along which each entry of another dimension is a curve of its own
_SAMPLE = "sample"

Column = tuple[str, NDArray[np.generic]]
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


# -- files of its folder: figures, and curves as CSV for other programs ----------------------------


def write_figures(result: RunResult, folder: Path) -> list[Path]:
    """Draw the charts of a run as PNG, those of one figure on one sheet, and the recipe's sections
    with their dimensions, unless its meshes cannot be made.

    Charts that lie there already stay. Returns what was written.
    """
    # matplotlib takes a while to import
    from upd.plot.drawing import draw_sections
    from upd.plot.matplotlib import write_png, write_sheets

    written = write_sheets(charts(result), folder, keep=True)
    recipe = str(tomllib.loads(result.scene_text)["geometry"]["recipe"])
    try:
        meshes, views = recipes.drawing(recipe, result.size["mesh"])
    except UpdError as problem:
        log.info("no drawing of the geometry: %s", problem)
        return written
    return written + write_png(draw_sections(meshes, views), folder / "dimensions.png")


def write_curves(arrays: Arrays, folder: Path) -> list[Path]:
    """Write every curve of the arrays to ``folder``/curves, a file per group and dimension.

    Columns are the variables that run along one dimension, with their unit in the header:
    ``frequency [Hz]``; a complex one has its real and imaginary part and its amplitude. Maps over x
    and y have a row for every place.

    Parameters
    ----------
    arrays
        Group -> name -> `Variable`, as they stand in result.nc.
    folder
        Run folder.

    Returns
    -------
    list of Path
        The files, in the order of the groups.

    Raises
    ------
    OSError
        As the file system does.
    """
    files: list[Path] = []
    for name, group in arrays.items():
        begin = file_name(name.replace("/", " per ") or "run")
        for k, (dimension, columns) in enumerate(dict(_tables(group)).items()):
            stem = begin + (f"-{file_name(dimension)}" if k else "")
            path = folder / "curves" / f"{stem}.csv"
            path.parent.mkdir(exist_ok=True)
            write_text(
                path, as_csv(zip(*([head, *data.tolist()] for head, data in columns), strict=True))
            )
            files.append(path)
    return files


def as_csv(rows: Iterable[Iterable[Any]]) -> str:
    """Rows as CSV; what is not known is empty."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def _tables(group: Group) -> Iterator[tuple[str, list[Column]]]:
    """Dimension -> its columns, where there is something to draw over something else."""
    for dimension in dict.fromkeys(d for v in group.values() for d in v.dims):
        along = ((name, v, _along(v, dimension)) for name, v in group.items())
        columns = [one for mine in along for one in _columns(*mine)]
        several = len(columns) > 1 and len(columns[0][1]) > 1
        if several and not dimension.startswith(_PEAKS):
            yield dimension, columns
    maps = {name: v for name, v in group.items() if v.dims[:2] == _PLACES}
    if maps and all(axis in group for axis in _PLACES):
        lines = np.meshgrid(*(group[axis].data for axis in _PLACES), indexing="ij")
        places = zip(_PLACES, lines, strict=True)
        columns = [one for x, line in places for one in _columns(x, group[x], {"": line})]
        for name, v in maps.items():
            # a column for each of its components
            parts = v.data.reshape(lines[0].size, -1).T
            several = len(parts) > 1
            columns += _columns(name, v, {f" {k}" * several: p for k, p in enumerate(parts, 1)})
        yield "map", columns


def _along(variable: Variable, dimension: str) -> dict[str, NDArray[np.generic]]:
    """What of a variable runs along a dimension, by what its name is followed by."""
    data, dims = variable.data, variable.dims
    if dims == (dimension,):
        return {"": data}
    if dims == (dimension, _PART):
        return {" real": data[:, 0], " imaginary": data[:, 1], " amplitude": np.hypot(*data.T)}
    if dimension == _SAMPLE and len(dims) == 2 and dims[1] == dimension:
        return {f" {dims[0]} {k}": row for k, row in enumerate(data, 1)}
    return {}


def _columns(
    name: str, variable: Variable, parts: Mapping[str, NDArray[np.generic]]
) -> list[Column]:
    """Name with unit, and values of every part of a variable."""
    unit = f" [{variable.units}]" if variable.units else ""
    return [(f"{name}{part}{unit}", data.ravel()) for part, data in parts.items()]
