"""A scene over a grid of parameters, or a sample of its inputs: plan, points, then table, arrays
and figures.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from upd.analyses import analysis_of
from upd.batch.engine import Batch, Watcher, WorkersAsked, run_points
from upd.batch.plan import Sample, SweepPlan, plan_sweep, settings
from upd.batch.store import PointStore
from upd.batch.table import check_follow, csv_text, make_columns, reasons
from upd.cache.files import write_text
from upd.cache.sources import versions
from upd.errors import InputError, one_line
from upd.labels import file_name
from upd.plot.sweep_charts import (
    FIGURES,
    Column,
    Parameter,
    is_constant,
    sample_charts,
    sweep_charts,
)
from upd.report import write_report
from upd.report.folder import sealed
from upd.report.notebook import as_csv
from upd.results import Group, write_netcdf
from upd.results.sampled import SampledNumber, sampled_number
from upd.scene import load_scene
from upd.vary.outcome import Outcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes

log = logging.getLogger(__name__)


@dataclass(frozen=True, repr=False)
class SweepResult:
    """A finished sweep: its plan, the outcome of every point in the grid's order, the followed
    numbers, seconds of this call, files, what went wrong with its pictures, and of a sample what it
    makes of the numbers.
    """

    plan: SweepPlan
    outcomes: tuple[Outcome, ...]
    columns: tuple[Column, ...]
    seconds: float
    folder: Path
    files: tuple[Path, ...] = ()
    faults: tuple[str, ...] = ()
    sampled: tuple[SampledNumber, ...] = ()

    def __repr__(self) -> str:
        points = len(self.outcomes)
        head = f"Sweep: {points - len(self.failed)} of {points} points solved; {self.folder}"
        moved = [c for c in self.columns if not is_constant(c.values)]
        ranges = [
            f"  {c.title}: {np.nanmin(c.values):.5g} to {np.nanmax(c.values):.5g} {c.unit}".rstrip()
            for c in moved[:8]
        ]
        other = len(self.columns) - len(ranges)
        return "\n".join([head, *ranges, f"  and {other} more in table.csv"])

    def plot(self) -> list[Axes]:
        """Draw the followed numbers with matplotlib, and return the axes."""
        from upd.plot.matplotlib import draw_all

        if self.sampled:
            return draw_all(sample_charts(self.sampled, [c.values for c in self.columns]))
        return draw_all(sweep_charts(self.plan.axes, self.columns)[:6])

    @property
    def failed(self) -> list[int]:
        """Numbers of the points that failed."""
        return [k for k, outcome in enumerate(self.outcomes) if outcome.failure]

    def column(self, name: str, case: str | None = None) -> Column:
        """The followed number ``name`` of ``case`` (the first when None).

        Raises InputError when there is none.
        """
        for column in self.columns:
            if column.name == name and case in (None, column.case):
                return column
        raise InputError(
            f"no followed number {name!r} of case {case!r}; there are "
            f"{', '.join(c.title for c in self.columns)}"
        )


def sweep(
    scene: str | Path | Mapping[str, Any],
    vary: Sequence[str] = (),
    *,
    sample: int | None = None,
    seed: int | None = None,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path,
    follow: Sequence[str] = (),
    watch: Watcher | None = None,
    **who: Unpack[WorkersAsked],
) -> SweepResult:
    """Run ``scene`` over the full factorial of ``vary``, or over a sample of its uncertain inputs.

    Parameters
    ----------
    vary
        For example ["contact.friction=0.1:0.6:6", "mesh.element=hex8i,hex20"].
    sample
        Points drawn evenly from the limits that half-widths give ("0.6 +- 0.1"), in place of
        ``vary``: a check of the first-order bands, `SweepResult.sampled`.
    seed
        Of the draw; None: that of the sample in ``out``, else 0.
    out
        Folder; called again with the same one, only missing points run.
    follow
        Names of the numbers for table and figures (shell patterns).
    watch
        Called with an `upd.batch.engine.Progress`.
    who
        workers: processes (0: this process; None: as many as cores and memory allow). A script that
        has any needs ``if __name__ == "__main__":``. threads: of each process, 1 by default.
        cluster: "tcp://host:port" for Dask.

    Raises
    ------
    InputError, UpdError
        As `plan_sweep` and `run_sweep` do.

    Examples
    --------
    >>> import upd
    >>> found = upd.sweep("hertz", ["contact.friction=0.2,0.4"], out="f")  # doctest: +SKIP
    >>> found.column("max_pressure").values  # doctest: +SKIP
    """
    folder = Path(out)
    loaded = load_scene(scene, overrides)
    PointStore(folder, "sweep").check()
    plan = plan_sweep(loaded, vary, folder, sample=sample, seed=seed, **who)
    return run_sweep(plan, folder, follow=follow, watch=watch)


def run_sweep(
    plan: SweepPlan, folder: Path, *, follow: Sequence[str] = (), watch: Watcher | None = None
) -> SweepResult:
    """Solve what is missing of ``plan`` and write table.csv, sweep.nc, sweep.json, figures and
    report.html into ``folder``; of a sample sample.csv too.

    A point that fails is a row with its reason. Kill it at any moment: finished points are kept and
    not run again.

    Parameters
    ----------
    follow
        Names of numbers (shell patterns) for table and figures; the usual ones of the analysis when
        empty. points/ holds them all.

    Raises
    ------
    InputError
        Folder (also one with the results of another grid), cluster, follow.
    UpdError
        Disk full, cluster gone: what was there stays.
    """
    begin = time.perf_counter()
    store = PointStore(folder, "sweep")

    with store.sole():
        store.sole_grid(
            {
                "scene": plan.scene.name,
                "given": sha256(plan.scene.text.encode()).hexdigest(),
                "axes": [{"path": a.path, "values": list(a.values)} for a in plan.axes],
            }
            | ({} if plan.sample is None else {"sample": plan.sample.as_dict()})
        )
        solved = next((outcome for outcome in plan.kept.values() if not outcome.failure), None)
        if solved is not None:
            check_follow(solved, follow)
        known = plan.kept | plan.refused
        batch = Batch(plan.tasks, plan.workers, known, plan.label, plan.groups, plan.seconds)
        found = run_points(batch, store, check=lambda one: check_follow(one, follow), watch=watch)
        followed = follow or analysis_of(plan.scene).headline_names
        columns = tuple(make_columns(found, followed))
        sampled = () if plan.sample is None else _sampled(plan.sample, columns)
        seconds = time.perf_counter() - begin
        result = SweepResult(plan, found, columns, seconds, folder, sampled=sampled)
        with store.writing():
            files = write_outputs(store, result)
            # Of an earlier call, perhaps; other pictures there are the user's.
            for name in ("report.html", *(f"{name}.png" for name in FIGURES)):
                (folder / name).unlink(missing_ok=True)
        pictures: dict[str, Callable[[], list[Path]]] = {
            "figures": lambda: draw(folder, plan.axes, columns, sampled),
            "report.html": lambda: [write_report(folder)],
        }
        faults = []
        for what, make in pictures.items():
            # The numbers are on disk: what goes wrong with pictures is a warning.
            try:
                files += make()
            except Exception as error:
                log.exception("%s not written", what)
                faults.append(f"{what} not written ({one_line(error)})")
    return replace(result, files=tuple(files), faults=tuple(faults))


def _sampled(sample: Sample, columns: Sequence[Column]) -> tuple[SampledNumber, ...]:
    """What the sample makes of every followed number."""
    paths = [one.path for one in sample.inputs]
    return tuple(
        sampled_number(c.name, c.case, c.unit, c.values, sample.shifts, paths, c.inputs)
        for c in columns
    )


# -- what a sweep leaves: table.csv, sweep.nc with named axes, sweep.json; then the figures --------


def write_outputs(store: PointStore, result: SweepResult) -> list[Path]:
    """Write the numbers; returns the paths, the table first.

    Raises OSError when the disk does not take it.
    """
    folder, plan = store.folder, result.plan
    table, arrays, data = (folder / f"{name}" for name in ("table.csv", "sweep.nc", "sweep.json"))
    write_text(table, csv_text(plan.axes, plan.places, result.outcomes, result.columns))
    write_netcdf(arrays, {"": Group(_arrays(result))})
    write_text(data, sealed(_summary(store, result)))
    if plan.sample is None:
        return [table, arrays, data]
    compared = folder / "sample.csv"
    heads = [field.name for field in fields(SampledNumber)]
    write_text(compared, as_csv([heads, *(asdict(one).values() for one in result.sampled)]))
    return [compared, table, arrays, data]


def draw(
    folder: Path,
    axes: Sequence[Parameter],
    columns: Sequence[Column],
    sampled: Sequence[SampledNumber] = (),
) -> list[Path]:
    """Write the figures into ``folder``, of a grid or of a sample. Returns their paths."""
    # slow to import
    from upd.plot.matplotlib import write_sheets

    if sampled:
        values = [column.values for column in columns]
        return write_sheets(sample_charts(sampled, values), folder)
    return write_sheets(sweep_charts(axes, columns), folder)


def _arrays(result: SweepResult) -> dict[str, Any]:
    plan, axes = result.plan, result.plan.axes
    names = tuple(axis.short.replace(" ", "_") for axis in axes)
    if plan.sample is None:
        shape, dims = tuple(len(axis.values) for axis in axes), names
    else:
        shape, dims = (len(plan.places),), ("point",)
    out: dict[str, Any] = {}
    for name, axis in zip(names, axes, strict=True):
        notes = {"long_name": axis.path, **({"units": axis.unit} if axis.unit else {})}
        along = (name,) if plan.sample is None else dims
        if axis.numbers is None:
            # words as numbers with their meanings (CF conventions)
            codes = np.arange(len(axis.values), dtype=np.int32)
            words = " ".join(str(value).replace(" ", "_") for value in axis.values)
            out[name] = (along, codes, notes | {"flag_values": codes, "flag_meanings": words})
        else:
            out[name] = (along, np.array(axis.numbers, float), notes)
    for column in result.columns:
        notes = {"long_name": column.title, "units": column.unit or "1"}
        out[_free(file_name(column.title), out)] = (dims, column.values.reshape(shape), notes)
    failed = np.array([bool(outcome.failure) for outcome in result.outcomes], np.int8)
    flags = {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "ok failed"}
    out["status"] = (dims, failed.reshape(shape), flags)
    seconds = np.array([outcome.seconds for outcome in result.outcomes])
    out["seconds"] = (dims, seconds.reshape(shape), {"units": "s"})
    return out


def _free(name: str, taken: dict[str, Any]) -> str:
    k, candidate = 1, name
    while candidate in taken or candidate in ("status", "seconds"):
        k += 1
        candidate = f"{name}_{k}"
    return candidate


def _summary(store: PointStore, result: SweepResult) -> dict[str, Any]:
    plan, sample = result.plan, result.plan.sample
    why = reasons(result.outcomes, result.columns)
    numbers = [asdict(one) for one in result.sampled]
    drawn = {} if sample is None else {"sample": sample.as_dict() | {"numbers": numbers}}
    return drawn | {
        "scene": plan.scene.name,
        "title": plan.scene.title,
        "version": versions()["upd"],
        "versions": versions(),
        "axes": [{"path": a.path, "unit": a.unit, "values": list(a.values)} for a in plan.axes],
        "followed": [{"name": c.name, "case": c.case, "unit": c.unit} for c in result.columns],
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
        "cost": _cost(result),
        "points": [_point(store, result, number, reason) for number, reason in enumerate(why)],
        "text": plan.scene.text,
    }


def _cost(result: SweepResult) -> dict[str, Any]:
    stages: dict[str, float] = {}
    shared: dict[str, int] = {}
    for outcome in result.outcomes:
        for name, took in outcome.stages.items():
            stages[name] = stages.get(name, 0.0) + took
        for name, count in outcome.shared.items():
            shared[name] = shared.get(name, 0) + count
    return {
        "this_call_s": round(result.seconds, 3),
        "points_s": round(math.fsum(outcome.seconds for outcome in result.outcomes), 3),
        "stages_s": {name: round(took, 3) for name, took in stages.items()},
        "shared": shared,
        "peak_rss_mb": max((outcome.memory_mb for outcome in result.outcomes), default=0.0),
    }


def _point(store: PointStore, result: SweepResult, number: int, reason: str) -> dict[str, Any]:
    plan, outcome = result.plan, result.outcomes[number]
    values = [float(column.values[number]) for column in result.columns]
    kept = outcome.final and number not in plan.refused
    file = store.path(plan.tasks[number]).relative_to(store.folder).as_posix() if kept else ""
    return {
        "set": settings(plan.axes, plan.places[number]),
        "values": values,
        "status": "failed" if outcome.failure else "ok",
        "reason": reason,
        "warnings": list(outcome.warnings),
        "seconds": round(outcome.seconds, 3),
        "file": file,
    }
