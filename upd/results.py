"""What a run leaves behind: one flat list of numbers, the arrays behind them, effects, checks and cost."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5netcdf
import numpy as np

from upd.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Row:
    """One number of a run. ``error`` and ``thesis_error`` are relative to ``reference``, as fractions.

    exact : whether the reference is what the number should converge to; another's measured or computed value is not.
    """

    name: str
    case: str
    value: float
    unit: str
    reference: float | None = None
    source: str = ""
    thesis_error: float | None = None
    estimated_error: float | None = None
    half_error_cost_s: float | None = None
    exact: bool = True

    @property
    def error(self) -> float | None:
        return None if self.reference is None or self.reference == 0.0 else self.value / self.reference - 1.0

    def as_dict(self) -> dict[str, Any]:
        """The row as it stands in summary.json."""
        data = asdict(self)
        out = {k: data[k] for k in ("name", "case", "value", "unit", "reference", "source")}
        out |= {"error": self.error, "thesis_error": self.thesis_error}
        return out | {k: data[k] for k in ("estimated_error", "half_error_cost_s") if data[k] is not None}


@dataclass(frozen=True)
class Check:
    """A self-check: passed when ``value <= limit``. ``fatal`` checks that fail end the run with ``remedy``; others warn."""

    name: str
    case: str
    value: float
    limit: float
    says: str
    remedy: str = ""
    fatal: bool = True

    @property
    def passed(self) -> bool:
        return bool(self.value <= self.limit)

    @property
    def verdict(self) -> str:
        return "passed" if self.passed else ("failed" if self.fatal else "warning")


@dataclass(frozen=True)
class RunResult:
    """Result of `upd.run`: ``rows`` (all numbers), ``arrays`` (case -> name -> array), effects, checks, size and cost.

    scene_text : the scene as run, TOML.
    """

    scene: str
    title: str
    status: str
    rows: tuple[Row, ...]
    effects: tuple[dict[str, Any], ...]
    checks: tuple[Check, ...]
    size: Mapping[str, Any]
    cost: Mapping[str, Any]
    arrays: Mapping[str, Mapping[str, Any]] = field(default_factory=dict, repr=False)
    folder: Path | None = None
    scene_text: str = field(default="", repr=False)

    def value(self, name: str, case: str | None = None) -> float:
        """The number ``name`` of ``case`` (the first case when None). Raises InputError when there is none."""
        for row in self.rows:
            if row.name == name and case in (None, row.case):
                return row.value
        raise InputError(f"no result {name!r} for case {case!r}; there are {sorted({r.name for r in self.rows})}")

    def summary(self) -> dict[str, Any]:
        """The content of summary.json."""
        return {
            "scene": self.scene,
            "title": self.title,
            "status": self.status,
            "effects": list(self.effects),
            "checks": [asdict(c) | {"verdict": c.verdict} for c in self.checks],
            "size": dict(self.size),
            "cost": dict(self.cost),
            "results": [r.as_dict() for r in self.rows],
        }

    def plot(self, title: str | None = None, *, case: str | None = None, ax: Axes | None = None) -> list[Axes]:
        """Draw the main curves and maps with matplotlib, and return the axes.

        title : draw the charts whose title has these words, of all cases; the first chart of every title, six at most, when None.
        case  : only of this case. ax : draw on these axes; title and case must then mean one chart.
        Raises InputError for a title or case there is not; the message lists those there are.
        """
        from upd.notebook import plot

        return plot(self, title, case, ax)

    def to_xarray(self) -> dict[str, Any]:
        """Case -> xarray.Dataset, with dimensions, coordinates and units. Raises InputError when xarray is not installed."""
        from upd.notebook import to_xarray

        return to_xarray(self)

    def __repr__(self) -> str:
        from upd.notebook import as_text

        return as_text(self)

    def _repr_html_(self) -> str:
        from upd.notebook import as_html

        return as_html(self)


def write_text(path: Path, text: str) -> None:
    """Write ``text`` whole or not at all."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as f:
            f.write(text)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def write_summary(result: RunResult, folder: Path) -> Path:
    """Write summary.json."""
    path = folder / "summary.json"
    write_text(path, json.dumps(result.summary(), indent=1, default=_plain) + "\n")
    return path


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} in a summary")


def write_netcdf(path: Path, arrays: Mapping[str, Mapping[str, Any]]) -> None:
    """Write arrays as one netCDF-4 file: a group per case; a value is an array or (dimension names, array, attributes)."""
    part = path.with_name(f".{path.name}.part")
    try:
        with h5netcdf.File(part, "w") as file:
            for case, variables in arrays.items():
                group = file.create_group(case.replace("/", " per ")) if case else file
                for name, value in variables.items():
                    dims, data, attributes = value if isinstance(value, tuple) else (None, value, {})
                    _write_variable(group, name, np.asarray(data), dims, attributes)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _write_variable(group: Any, name: str, data: np.ndarray[Any, Any], dims: Iterable[str] | None, attributes: Mapping[str, Any]) -> None:
    if data.dtype == bool:
        data = data.astype(np.int8)
    dims = tuple(dims) if dims is not None else tuple(f"{name}_{i}" for i in range(data.ndim))
    for dim, length in zip(dims, data.shape, strict=True):
        if dim not in group.dimensions:
            group.dimensions[dim] = length
    variable = group.create_variable(name, dims, data.dtype, data=data)
    for key, text in attributes.items():
        variable.attrs[key] = text


def read_netcdf(path: Path) -> dict[str, dict[str, np.ndarray[Any, Any]]]:
    """Arrays of a result.nc, group -> variable -> array."""
    with h5netcdf.File(path, "r") as file:
        out = {"": {k: v[...] for k, v in file.variables.items()}} if file.variables else {}
        return out | {g: {k: v[...] for k, v in group.variables.items()} for g, group in file.groups.items()}
