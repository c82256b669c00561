"""A run folder read back as the result it was written from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from upd.plot.chart import Arrays, Entry
from upd.report.folder import read_run
from upd.report.notebook import RunResult
from upd.results import ArrayGroup, Case, Check, Result, read_input_part, read_part

_FIELDS = frozenset(f.name for f in fields(Case))


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
        scene=summary["scene"],
        title=summary["title"],
        status=summary["status"],
        results=tuple(_result(entry) for entry in summary["results"]),
        effects=tuple(dict(effect) for effect in summary["effects"]),
        checks=tuple(_check(entry) for entry in summary["checks"]),
        size=summary["size"],
        cost=summary["cost"],
        arrays=_arrays(run.arrays),
        folder=run.path,
        scene_text=run.scene,
    )


def _case(entry: Entry) -> Case:
    """The case from its fields; of unknown fields, from its words."""
    given = entry["case_fields"]
    case = Case(**{key: value for key, value in given.items() if key in _FIELDS})
    return case if case.label == entry["case"] else Case(name=entry["case"])


def _number(value: float | None) -> float:
    """A number of summary.json, which has null for what is none."""
    return math.nan if value is None else value


def _result(entry: Entry) -> Result:
    estimates: dict[str, Any] = {
        key: entry.get(key) for key in ("estimated_error", "half_error_cost_s")
    }
    return Result(
        entry["name"],
        _case(entry),
        _number(entry["value"]),
        entry["unit"],
        entry["reference"],
        entry.get("source", ""),
        entry.get("thesis_error"),
        withheld=entry.get("withheld", ""),
        parts=tuple(read_part(part) for part in entry.get("error_parts", ())),
        inputs=tuple(read_input_part(part) for part in entry.get("input_parts", ())),
        **estimates,
    )


def _check(entry: Entry) -> Check:
    return Check(
        entry["name"],
        _case(entry),
        _number(entry["value"]),
        _number(entry["limit"]),
        entry["says"],
        entry.get("remedy", ""),
        entry.get("fatal", entry["verdict"] == "failed"),
        entry.get("quantity", ""),
        entry.get("without"),
        entry.get("included") if entry.get("quantity") is None else _number(entry["included"]),
    )


def _arrays(arrays: Arrays) -> Mapping[str, ArrayGroup]:
    """The arrays as a run holds them, under the names that their cases have."""
    out = {}
    for name, group in arrays.items():
        variables = {
            key: (v.dims, v.data, dict(v.attributes) | ({"units": v.units} if v.units else {}))
            for key, v in group.items()
        }
        # A file has no slash in the name of a group.
        mine = out[name.replace(" per ", "/")] = ArrayGroup(variables)
        mine.attributes.update(group.attributes)
    return out
