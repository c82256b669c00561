"""A sweep folder as it lies on disk: sweep.json and figures.

Nothing of it is trusted to be whole.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from upd.labels import unit_label
from upd.plot.chart import Array
from upd.plot.sweep_charts import figure_names
from upd.report.folder import is_png
from upd.report.schema import damaged_file, read_json
from upd.results.sampled import SampledNumber

#: values of a parameter written one by one
_FEW = 8


@dataclass(frozen=True)
class Parameter:
    """One parameter of the grid.

    Its path, unit, values as the scene takes them, and as numbers (None when they are words).
    """

    path: str
    unit: str
    values: tuple[Any, ...]
    numbers: tuple[float, ...] | None

    @property
    def short(self) -> str:
        """Last word of the path."""
        return self.path.rpartition(".")[2].replace("_", " ")

    @property
    def text(self) -> str:
        """The values with their unit."""
        shown = [self.shown(k) for k in range(len(self.values))]
        unit = f" {unit_label(self.unit)}" if self.unit else ""
        if len(shown) <= _FEW:
            return ", ".join(shown) + unit
        if self.numbers is None:
            return f"{', '.join(shown[:_FEW])} and {len(shown) - _FEW} more"
        return f"{len(shown)} values from {min(self.numbers):.5g} to {max(self.numbers):.5g}{unit}"

    def shown(self, k: int) -> str:
        """Value `k` without the unit."""
        return str(self.values[k]) if self.numbers is None else f"{self.numbers[k]:.6g}"


@dataclass(frozen=True)
class SweepFolder:
    """Content of a sweep folder.

    Table: values (points, followed numbers), nan where there is none; points in the grid's order.
    """

    path: Path
    data: Mapping[str, Any]
    parameters: tuple[Parameter, ...]
    table: Array
    figures: Mapping[str, Path]

    @property
    def name(self) -> str:
        return self.path.resolve().name

    @property
    def places(self) -> list[tuple[int, ...]]:
        """Place along every parameter, point by point: a grid's last one fastest, of a sample all
        together.
        """
        if self.is_sample:
            return [(k,) * len(self.parameters) for k in range(len(self.data["points"]))]
        return list(np.ndindex(*(len(p.values) for p in self.parameters)))

    @property
    def is_sample(self) -> bool:
        """Whether its points are drawn from limits and no grid."""
        return "sample" in self.data

    @property
    def sampled(self) -> list[SampledNumber]:
        """What a sample makes of the followed numbers; empty for a grid."""
        found = self.data["sample"]["numbers"] if self.is_sample else []
        return [SampledNumber(**one) for one in found]


@dataclass
class _SweepAxis:
    path: str
    unit: str
    values: list[Any]


@dataclass
class _SweepFollowed:
    name: str
    case: str
    unit: str


@dataclass
class _SweepPoint:
    values: list[float | None]
    status: str
    reason: str
    warnings: list[Any]
    seconds: float


@dataclass
class _SweepCost:
    this_call_s: float | None = None
    peak_rss_mb: float | None = None
    stages_s: dict[str, float | None] = field(default_factory=dict)


@dataclass
class _SweepSample:
    seed: int
    inputs: dict[str, Any]
    numbers: list[SampledNumber]


@dataclass
class _Sweep:
    """What sweep.json must have for a page."""

    scene: str
    title: str
    axes: list[_SweepAxis]
    followed: list[_SweepFollowed]
    plan: dict[str, Any]
    cost: _SweepCost
    points: list[_SweepPoint]
    text: str
    sample: _SweepSample | None = None


def read_sweep(folder: Path) -> SweepFolder:
    """Read sweep.json and find the figures. Raises InputError when it is missing or damaged."""
    path = folder / "sweep.json"
    data = read_json(path, _Sweep, "sweep")
    counts, m = [len(axis["values"]) for axis in data["axes"]], len(data["followed"])
    n = min(counts, default=0) if "sample" in data else math.prod(counts)
    damaged = ["points"] * (
        len(data["points"]) != n or any(len(p["values"]) != m for p in data["points"])
    )
    damaged += ["sample"] * ("sample" in data and len(data["sample"]["numbers"]) != m)
    if damaged:
        raise damaged_file(path, damaged, "sweep")
    parameters = tuple(_parameter(axis) for axis in data["axes"])
    table = np.array([point["values"] for point in data["points"]], float).reshape(n, m)
    names = figure_names((one["name"], one["case"]) for one in data["followed"])
    files = {name: folder / f"{name}.png" for name in sorted(names)}
    figures = {name: file for name, file in files.items() if is_png(file)}
    return SweepFolder(folder, data, parameters, table, figures)


def _parameter(axis: Mapping[str, Any]) -> Parameter:
    values, unit = tuple(axis["values"]), axis["unit"]
    try:
        # "350 N" with the unit N; true and false are words.
        numbers = (
            None
            if any(isinstance(v, bool) for v in values)
            else tuple(float(str(v).removesuffix(unit)) for v in values)
        )
    except ValueError:
        numbers = None
    return Parameter(axis["path"], unit, values, numbers)
