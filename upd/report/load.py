"""A run folder read back as the result it was written from."""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path

from upd.plot.chart import Entry
from upd.report.folder import read_run
from upd.report.notebook import RunResult
from upd.results import Case, Check, read_result

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
        results=tuple(read_result(entry, _case(entry)) for entry in summary["results"]),
        effects=tuple(dict(effect) for effect in summary["effects"]),
        checks=tuple(_check(entry) for entry in summary["checks"]),
        size=summary["size"],
        cost=summary["cost"],
        # A file has no slash in the name of a group.
        arrays={name.replace(" per ", "/"): group for name, group in run.arrays.items()},
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
