"""Several sweep folders -> one page and one table: the same points side by side."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upd.cache.files import whole_file
from upd.errors import InputError
from upd.plot.style import COLOURS
from upd.report.compare import distinct_names, overlaid
from upd.report.page import render, save
from upd.report.panels import make_panels
from upd.report.sweep_folder import SweepFolder, read_sweep
from upd.report.sweep_page import sweep_folder_charts, verdict

#: rows of a number's table on the page; all of them are in the CSV file
_MOST_ROWS = 200
#: how every table of a comparison begins
_HEAD = ("number", "case", "unit")

Point = tuple[str, ...]


@dataclass(frozen=True)
class Row:
    """A number at one point of the grids.

    Attributes
    ----------
    point
        Values of the parameters.
    values
        One per sweep, None where it has none.
    why
        One per sweep: why there is none.
    """

    point: Point
    values: tuple[float | None, ...]
    why: tuple[str, ...]

    @property
    def spread(self) -> float | None:
        """Largest difference from the first sweep, as a fraction."""
        first, *others = self.values
        known = [v / first - 1.0 for v in others if v is not None] if first else []
        return max(known, key=abs) if known else None


@dataclass(frozen=True)
class Number:
    """A followed number of several sweeps."""

    name: str
    case: str
    unit: str
    rows: tuple[Row, ...]


def write_sweep_comparison(folders: Sequence[str | Path], path: str | Path) -> Path:
    """Write the page that compares the sweeps in ``folders``, and its table as .csv beside it.

    Points are the same where their parameters have the same values; differences are those from the
    first sweep.

    Raises
    ------
    InputError
        For fewer than two folders, a folder that is no sweep, sweeps over different parameters, or
        a name that does not end in .html.
    """
    target = Path(path)
    if len(folders) < 2:
        raise InputError("a comparison needs two sweeps or more: give their folders")
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{target}: a comparison is a page; give a name that ends in .html")
    sweeps = [read_sweep(Path(folder)) for folder in folders]
    names = distinct_names([sweep.path for sweep in sweeps])
    _same_parameters(sweeps, names)
    _refuse_foreign(target.with_suffix(".csv"))
    numbers = compared(sweeps)
    charts = overlaid([sweep_folder_charts(s) for s in sweeps], names)
    save(
        target,
        render(
            "compare_sweeps.html.j2", make_panels(charts, {}), [], _context(sweeps, names, numbers)
        ),
    )
    _write_table(target.with_suffix(".csv"), sweeps, names, numbers)
    return target


def _refuse_foreign(table: Path) -> None:
    """Raise InputError when the table's place holds a file that no comparison wrote."""
    try:
        with table.open(encoding="utf-8", errors="replace") as file:
            ours = file.readline().startswith(",".join(_HEAD))
    except OSError:
        # Missing, or told by whoever writes it.
        return
    if not ours:
        raise InputError(
            f"{table}: stands where the comparison's table goes and is none; give the page another "
            "name with --out"
        )


def _same_parameters(sweeps: Sequence[SweepFolder], names: Sequence[str]) -> None:
    paths = [{p.path for p in sweep.parameters} for sweep in sweeps]
    if any(mine != paths[0] for mine in paths):
        told = "; ".join(
            f"{name}: {', '.join(sorted(mine)) or 'none'}"
            for name, mine in zip(names, paths, strict=True)
        )
        raise InputError(
            f"the sweeps vary different parameters ({told}); to fix it: compare sweeps over the "
            "same ones"
        )


def _points(sweep: SweepFolder, order: Sequence[str]) -> list[Point]:
    """Values of the parameters of every point, in the order of the first sweep's parameters."""
    place = {p.path: k for k, p in enumerate(sweep.parameters)}
    points = []
    for index in sweep.places:
        shown = (sweep.parameters[place[path]].shown(index[place[path]]) for path in order)
        points.append(tuple(shown))
    return points


def compared(sweeps: Sequence[SweepFolder]) -> list[Number]:
    """The followed numbers of all sweeps, in the order of the first that has them."""
    order = [p.path for p in sweeps[0].parameters]
    places = [{point: k for k, point in enumerate(_points(s, order))} for s in sweeps]
    points = list(dict.fromkeys(point for mine in places for point in mine))
    columns = [
        {(c["name"], c["case"]): j for j, c in enumerate(sweep.data["followed"])}
        for sweep in sweeps
    ]
    units = {(c["name"], c["case"]): c["unit"] for s in sweeps for c in s.data["followed"]}
    out = []
    for key in dict.fromkeys(key for mine in columns for key in mine):
        rows = []
        for point in points:
            cells = [
                _cell(sweep, places[k].get(point), columns[k].get(key))
                for k, sweep in enumerate(sweeps)
            ]
            rows.append(Row(point, tuple(v for v, _ in cells), tuple(why for _, why in cells)))
        out.append(Number(*key, units[key], tuple(rows)))
    return out


def _cell(sweep: SweepFolder, place: int | None, column: int | None) -> tuple[float | None, str]:
    """Value of a number at a point, or why there is none."""
    if place is None:
        return None, "no such point"
    if column is None:
        return None, "not followed"
    value = float(sweep.table[place, column])
    if not math.isnan(value):
        return value, ""
    return None, str(sweep.data["points"][place]["reason"] or "none")


def _context(
    sweeps: Sequence[SweepFolder], names: Sequence[str], numbers: Sequence[Number]
) -> Mapping[str, Any]:
    return {
        "title": "Comparison of the sweeps " + ", ".join(names[:-1]) + f" and {names[-1]}",
        "names": names,
        "colours": [COLOURS[k % len(COLOURS)] for k in range(len(names))],
        "titles": [s.data["title"] or s.data["scene"] for s in sweeps],
        "verdicts": [verdict(s.data["points"]) for s in sweeps],
        "grids": ["; ".join(f"{p.short} {p.told}" for p in s.parameters) for s in sweeps],
        "parameters": sweeps[0].parameters,
        "numbers": numbers,
        "most": _MOST_ROWS,
    }


def _write_table(
    path: Path, sweeps: Sequence[SweepFolder], names: Sequence[str], numbers: Sequence[Number]
) -> None:
    """A line per number and point, with every digit."""
    head = [p.path + (f" [{p.unit}]" if p.unit else "") for p in sweeps[0].parameters]
    try:
        with (
            whole_file(path) as temporary,
            temporary.open("w", encoding="utf-8", newline="") as file,
        ):
            writer = csv.writer(file)
            writer.writerow([*_HEAD, *head, *names, "largest difference"])
            for one in numbers:
                for row in one.rows:
                    values = ["" if v is None else v for v in row.values]
                    spread = "" if row.spread is None else row.spread
                    writer.writerow([one.name, one.case, one.unit, *row.point, *values, spread])
    except OSError as problem:
        raise InputError(
            f"{path}: cannot be written ({problem.strerror or problem}); choose another --out"
        ) from None
