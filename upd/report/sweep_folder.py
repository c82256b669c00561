"""A sweep folder as it lies on disk: sweep.json and figures.

Nothing of it is trusted to be whole.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from upd.errors import InputError
from upd.labels import unit_label
from upd.plot.chart import Array
from upd.plot.sweep_charts import figure_names
from upd.results.sampled import SampledNumber

#: values of a parameter written one by one
_FEW = 8
_PNG = b"\x89PNG\r\n\x1a\n"
_KINDS: dict[str, Any] = {
    "scene": str,
    "title": str,
    "axes": list,
    "followed": list,
    "plan": dict,
    "cost": dict,
    "points": list,
    "text": str,
}
_ENTRIES: dict[str, dict[str, Any]] = {
    "axes": {"path": str, "unit": str, "values": list},
    "followed": {"name": str, "case": str, "unit": str},
    "points": {
        "values": list,
        "status": str,
        "reason": str,
        "warnings": list,
        "seconds": (int, float),
    },
}


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
    def told(self) -> str:
        """The values in words, with their unit."""
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


def read_sweep(folder: Path) -> SweepFolder:
    """Read sweep.json and find the figures. Raises InputError when it is missing or damaged."""
    path = folder / "sweep.json"
    try:
        data = json.loads(path.read_text("utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(
            f"{folder}: is no sweep folder (it has no sweep.json); give the folder `upd "
            "sweep` wrote"
        ) from None
    except OSError as problem:
        raise InputError(
            f"{path}: cannot be read ({problem.strerror}); check its permissions"
        ) from None
    except ValueError as problem:
        raise InputError(
            f"{path}: is not JSON ({problem}); start the same sweep again, finished points are kept"
        ) from None
    problems = _faults(data)
    if problems:
        raise InputError(
            f"{path}: is damaged in {', '.join(problems)}; start the same sweep again, "
            "finished points are kept"
        )
    parameters = tuple(_parameter(axis) for axis in data["axes"])
    table = np.array(
        [[np.nan if v is None else v for v in point["values"]] for point in data["points"]], float
    )
    names = figure_names((one["name"], one["case"]) for one in data["followed"])
    files = {name: folder / f"{name}.png" for name in sorted(names)}
    figures = {name: file for name, file in files.items() if _is_png(file)}
    return SweepFolder(
        folder, data, parameters, table.reshape(len(data["points"]), len(data["followed"])), figures
    )


def _faults(data: Any) -> list[str]:
    if not isinstance(data, dict):
        return ["the whole"]
    problems = [key for key, kind in _KINDS.items() if not isinstance(data.get(key), kind)]
    problems += [
        key
        for key, kinds in _ENTRIES.items()
        if key not in problems and not all(_fits(entry, kinds) for entry in data[key])
    ]
    if not problems and not _is_cost(data["cost"]):
        problems = ["cost"]
    if problems:
        return problems
    counts, m = [len(axis["values"]) for axis in data["axes"]], len(data["followed"])
    n = math.prod(counts)
    if "sample" in data:
        if not _is_sample(data["sample"], m):
            return ["sample"]
        n = min(counts, default=0)
    whole = len(data["points"]) == n and all(
        len(p["values"]) == m and all(map(_is_value, p["values"])) for p in data["points"]
    )
    return [] if whole else ["points"]


def _fits(entry: Any, kinds: Mapping[str, Any]) -> bool:
    return isinstance(entry, dict) and all(
        isinstance(entry.get(key), kind) for key, kind in kinds.items()
    )


def _is_sample(entry: Any, followed: int) -> bool:
    if not isinstance(entry, dict) or not isinstance(entry.get("numbers"), list):
        return False
    names = {field.name for field in fields(SampledNumber)}
    return len(entry["numbers"]) == followed and all(
        isinstance(one, dict) and one.keys() == names for one in entry["numbers"]
    )


def _is_cost(entry: Mapping[str, Any]) -> bool:
    taken = entry.get("stages_s", {})
    numbers = [
        entry.get("this_call_s"),
        entry.get("peak_rss_mb"),
        *(taken.values() if isinstance(taken, dict) else ["none"]),
    ]
    return all(map(_is_value, numbers))


def _is_value(value: Any) -> bool:
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def _is_png(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(len(_PNG)) == _PNG
    except OSError:
        return False


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
