"""What a sweep leaves: table.csv, sweep.nc with named axes, sweep.json; then the figures.

Each file is written whole or not at all.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from upd.batch.grid import GridAxis, values_at
from upd.batch.plan import SweepPlan
from upd.batch.point import Outcome
from upd.batch.sample import Sample
from upd.batch.store import PointStore
from upd.batch.table import Column, csv_text, reasons
from upd.cache.files import write_text
from upd.cache.sources import versions
from upd.plot.matplotlib import write_sheets
from upd.plot.sample_charts import sample_charts
from upd.plot.sweep_charts import figure_names, sweep_charts
from upd.results import write_netcdf
from upd.results.sampled import SampledNumber


def write_outputs(
    store: PointStore,
    plan: SweepPlan,
    outcomes: Sequence[Outcome],
    columns: Sequence[Column],
    sampled: Sequence[SampledNumber] | None,
    seconds: float,
) -> list[Path]:
    """Write the numbers; returns the paths, the table first.

    The figures of an earlier call, which may have followed other numbers, are removed.
    Raises OSError when the disk does not take it.
    """
    folder = store.folder
    earlier = _earlier(folder)
    table = folder / "table.csv"
    write_text(table, csv_text(plan.axes, plan.places, outcomes, columns))
    arrays = folder / "sweep.nc"
    write_netcdf(arrays, {"": _arrays(plan, outcomes, columns)})
    data = folder / "sweep.json"
    write_text(
        data,
        json.dumps(
            _summary(store, plan, outcomes, columns, sampled, seconds), indent=1, allow_nan=False
        )
        + "\n",
    )
    _remove_figures(folder, earlier)
    if sampled is None:
        return [table, arrays, data]
    compared = folder / "sample.csv"
    write_text(compared, sample_text(sampled))
    return [compared, table, arrays, data]


def sample_text(sampled: Sequence[SampledNumber]) -> str:
    """What a sample makes of every number as CSV, with all digits."""
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n").writerow
    write([field.name for field in fields(SampledNumber)])
    for one in sampled:
        write(["" if value is None else value for value in one.as_dict().values()])
    return out.getvalue()


def draw(
    folder: Path,
    axes: Sequence[GridAxis],
    columns: Sequence[Column],
    sampled: Sequence[SampledNumber] | None = None,
) -> list[Path]:
    """Write the figures into ``folder``, of a grid or of a sample; earlier ones are removed.

    Returns their paths.
    """
    _remove_figures(folder, ((column.name, column.case) for column in columns))
    if sampled is not None:
        values = [column.values for column in columns]
        return write_sheets(sample_charts(sampled, values), folder)
    return write_sheets(sweep_charts(axes, columns), folder)


def _remove_figures(folder: Path, followed: Iterable[tuple[str, str]]) -> None:
    """Remove the figures a sweep of these numbers has; other pictures there are the user's."""
    for name in figure_names(followed):
        (folder / f"{name}.png").unlink(missing_ok=True)


def _earlier(folder: Path) -> list[tuple[str, str]]:
    """Name and case of the numbers that an earlier call followed."""
    try:
        followed = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))["followed"]
        return [(str(one["name"]), str(one["case"])) for one in followed]
    except (OSError, ValueError, TypeError, KeyError):
        return []


def dimension(axis: GridAxis, axes: Sequence[GridAxis]) -> str:
    """Short name of an axis.

    The last word of its path, or the whole path when that would not be its own.
    """
    last = [other.path.rpartition(".")[2] for other in axes]
    own = axis.path.rpartition(".")[2]
    return (
        own
        if last.count(own) == 1 and own not in ("status", "seconds")
        else axis.path.replace(".", "_")
    )


def _arrays(
    plan: SweepPlan, outcomes: Sequence[Outcome], columns: Sequence[Column]
) -> dict[str, Any]:
    axes = plan.axes
    names = tuple(dimension(axis, axes) for axis in axes)
    if plan.sample is None:
        shape, dims = tuple(len(axis.values) for axis in axes), names
    else:
        shape, dims = (len(plan.places),), ("point",)
    out: dict[str, Any] = {}
    for name, axis in zip(names, axes, strict=True):
        notes = {"long_name": axis.path, **({"units": axis.unit} if axis.unit else {})}
        along = (name,) if plan.sample is None else dims
        out[name] = (along, *_coordinate(axis, notes))
    for column in columns:
        notes = {"long_name": column.title, "units": column.unit or "1"}
        out[_free(column.variable, out)] = (dims, column.values.reshape(shape), notes)
    failed = np.array([bool(outcome.failure) for outcome in outcomes], np.int8).reshape(shape)
    out["status"] = (
        dims,
        failed,
        {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "ok failed"},
    )
    out["seconds"] = (
        dims,
        np.array([outcome.seconds for outcome in outcomes]).reshape(shape),
        {"units": "s"},
    )
    return out


def _coordinate(axis: GridAxis, notes: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """Numbers as they are; words as numbers with their meanings (CF conventions, flag_values and
    flag_meanings).
    """
    if axis.numbers is not None:
        return np.array(axis.numbers, float), notes
    codes = np.arange(len(axis.values), dtype=np.int32)
    words = [str(value).replace(" ", "_") for value in axis.values]
    return codes, notes | {"flag_values": codes, "flag_meanings": " ".join(words)}


def _free(name: str, taken: dict[str, Any]) -> str:
    k, candidate = 1, name
    while candidate in taken or candidate in ("status", "seconds"):
        k += 1
        candidate = f"{name}_{k}"
    return candidate


def _summary(
    store: PointStore,
    plan: SweepPlan,
    outcomes: Sequence[Outcome],
    columns: Sequence[Column],
    sampled: Sequence[SampledNumber] | None,
    seconds: float,
) -> dict[str, Any]:
    sample = {} if plan.sample is None else {"sample": _sample(plan.sample, sampled or ())}
    return sample | {
        "scene": plan.scene.name,
        "title": plan.scene.title,
        "version": versions()["upd"],
        "versions": versions(),
        "axes": [{"path": a.path, "unit": a.unit, "values": list(a.values)} for a in plan.axes],
        "followed": [{"name": c.name, "case": c.case, "unit": c.unit} for c in columns],
        "plan": {
            "points": len(plan.places),
            "kept": len(plan.kept),
            "refused": len(plan.refused),
            "meshes": plan.meshes,
            "condensations": plan.condensations,
            "workers": plan.workers.cluster or plan.workers.count,
            "threads": plan.workers.threads,
            "notes": list(plan.notes),
        },
        "cost": _cost(outcomes, seconds),
        "points": [
            _point(store, plan, number, outcome, columns, reason)
            for number, (outcome, reason) in enumerate(
                zip(outcomes, reasons(outcomes, columns), strict=True)
            )
        ],
        "text": plan.scene.text,
    }


def _sample(sample: Sample, sampled: Sequence[SampledNumber]) -> dict[str, Any]:
    """The draw, and what it makes of the numbers."""
    return sample.as_dict() | {"numbers": [one.as_dict() for one in sampled]}


def _cost(outcomes: Sequence[Outcome], seconds: float) -> dict[str, Any]:
    stages: dict[str, float] = {}
    shared: dict[str, int] = {}
    for outcome in outcomes:
        for name, took in outcome.stages.items():
            stages[name] = stages.get(name, 0.0) + took
        for name, count in outcome.shared.items():
            shared[name] = shared.get(name, 0) + count
    return {
        "this_call_s": round(seconds, 3),
        "points_s": round(math.fsum(outcome.seconds for outcome in outcomes), 3),
        "stages_s": {name: round(took, 3) for name, took in stages.items()},
        "shared": shared,
        "peak_rss_mb": max((outcome.memory_mb for outcome in outcomes), default=0.0),
    }


def _point(
    store: PointStore,
    plan: SweepPlan,
    number: int,
    outcome: Outcome,
    columns: Sequence[Column],
    reason: str,
) -> dict[str, Any]:
    values = [float(column.values[number]) for column in columns]
    return {
        "set": dict(plan.tasks[number].settings) or values_at(plan.axes, plan.places[number]),
        "values": [None if math.isnan(v) else v for v in values],
        "status": "failed" if outcome.failure else "ok",
        "reason": reason,
        "warnings": list(outcome.warnings),
        "seconds": round(outcome.seconds, 3),
        "file": store.path(plan.tasks[number]).relative_to(store.folder).as_posix()
        if outcome.final and number not in plan.refused
        else "",
    }
