"""Files of a run folder: PNG figures of its charts, and its curves as CSV for other programs."""

from __future__ import annotations

import csv
import io
import logging
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.cache.files import write_text
from upd.errors import UpdError
from upd.labels import file_name
from upd.mesh import recipes
from upd.report.notebook import RunResult, charts
from upd.results import Arrays, Group, Variable

log = logging.getLogger(__name__)

#: folder of the files in a run folder
FOLDER = "curves"
#: dimension of a pair of real and imaginary part
_PART = "part"
#: dimensions whose tables stand among the numbers of summary.json
_PEAKS = "peak"
#: dimensions of a map on a face
_PLACES = ("x", "y")
#: dimension along which each entry of another dimension is a curve of its own
_SAMPLE = "sample"

Column = tuple[str, NDArray[np.generic]]


def write_figures(result: RunResult, folder: Path) -> list[Path]:
    """Draw the charts of a run as PNG, those of one figure on one sheet.

    Figures that lie there already stay. Returns what was written.
    """
    # matplotlib takes a while to import
    from upd.plot.matplotlib import write_sheets

    written = write_sheets(charts(result), folder, keep=True)
    return written + write_dimensions(result, folder / "dimensions.png")


def write_dimensions(result: RunResult, path: Path) -> list[Path]:
    """Draw the recipe's sections with their dimensions, unless its meshes cannot be made."""
    recipe = str(tomllib.loads(result.scene_text)["geometry"]["recipe"])
    try:
        meshes, views = recipes.drawing(recipe, result.size["mesh"])
    except UpdError as problem:
        log.info("no drawing of the geometry: %s", problem)
        return []
    # matplotlib takes a while to import
    from upd.plot.drawing import draw_sections
    from upd.plot.matplotlib import write_png

    return write_png(draw_sections(meshes, views), path)


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
            path = folder / FOLDER / f"{stem}.csv"
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
        columns = [one for name, v in group.items() for one in _columns(name, v, dimension)]
        several = len(columns) > 1 and len(columns[0][1]) > 1
        if several and not dimension.startswith(_PEAKS):
            yield dimension, columns
    maps = {name: v for name, v in group.items() if v.dims[:2] == _PLACES}
    if maps and all(axis in group for axis in _PLACES):
        lines = np.meshgrid(*(group[axis].data for axis in _PLACES), indexing="ij")
        columns = [
            _column(axis, group[axis], line) for axis, line in zip(_PLACES, lines, strict=True)
        ]
        for name, v in maps.items():
            # a column for each of its components
            parts = v.data.reshape(lines[0].size, -1).T
            columns += _numbered(name, v, parts) if len(parts) > 1 else [_column(name, v, parts)]
        yield "map", columns


def _columns(name: str, variable: Variable, dimension: str) -> Iterator[Column]:
    data, dims = variable.data, variable.dims
    if dims == (dimension,):
        yield _column(name, variable, data)
    elif dims == (dimension, _PART):
        kinds = {"real": data[:, 0], "imaginary": data[:, 1], "amplitude": np.hypot(*data.T)}
        yield from (_column(f"{name} {kind}", variable, one) for kind, one in kinds.items())
    elif dimension == _SAMPLE and len(dims) == 2 and dims[1] == dimension:
        yield from _numbered(f"{name} {dims[0]}", variable, data)


def _column(name: str, variable: Variable, data: NDArray[np.generic]) -> Column:
    """Name with unit, and values of a column."""
    return f"{name} [{variable.units}]" if variable.units else name, data.ravel()


def _numbered(name: str, variable: Variable, rows: NDArray[np.generic]) -> list[Column]:
    return [_column(f"{name} {k}", variable, row) for k, row in enumerate(rows, 1)]
