"""What a sweep shows on a terminal: the plan and the table."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.markup import escape

from upd.batch.output import SweepResult
from upd.batch.plan import SweepPlan
from upd.cli.progress import counted, duration
from upd.cli.tables import print_table
from upd.labels import number, percent_of
from upd.report.columns import TextColumn
from upd.results.quantities import number_label
from upd.results.sampled import SampledNumber, sample_sentence

#: Rows shown, and characters of a line of a head; the files hold all.
_ROWS, _WIDTH = 30, 14


def print_sweep_plan(console: Console, plan: SweepPlan) -> None:
    """The plan in a few lines."""
    grid = " x ".join(f"{len(axis.values)} {axis.header}" for axis in plan.axes)
    if plan.sample is not None:
        grid = f"a sample of {plan.sample.count} with seed {plan.sample.seed}, and the scene itself"
    console.print(
        escape(
            f"{plan.scene.title or plan.scene.name}: {counted(len(plan.places), 'point')} ({grid})"
        )
    )
    for one in () if plan.sample is None else plan.sample.inputs:
        console.print(escape(f"{one.path}: {one.given}, evenly between these limits"))
    if plan.kept:
        console.print(f"{counted(len(plan.kept), 'point')} kept from an earlier call")
    if plan.refused:
        console.print(
            f"{counted(len(plan.refused), 'point')} not allowed by the scene: rows with "
            "their reason"
        )
    if plan.groups:
        models = len(set(plan.groups.values()))
        contact = (
            f", {counted(plan.condensations, 'condensation')} ({counted(models, 'contact model')})"
            if plan.condensations
            else ""
        )
        who = plan.workers
        here = f"{counted(max(who.count, 1), 'worker')}, {counted(who.threads, 'thread')} each"
        where = f"workers of {who.cluster}" if who.cluster else here
        memory = f"up to {plan.memory_bytes / 1e9:.2g} GB each"
        console.print(
            f"{counted(len(plan.groups), 'point')} to solve, from "
            f"{counted(plan.meshes, 'mesh')}{contact}; {where}, {memory}"
        )
    for note in plan.notes:
        console.print(f"[dim]{escape(note)}[/dim]")


def print_sweep(console: Console, result: SweepResult) -> None:
    """The table, as far as it fits, and where the rest is."""
    plan = result.plan
    places = plan.places[:_ROWS]
    columns = [
        TextColumn(
            _head(axis.path.rpartition(".")[2], "", axis.unit),
            tuple(_plain(axis.shown(place[k])) for place in places),
        )
        for k, axis in enumerate(plan.axes)
    ]
    for k, column in enumerate(result.columns):
        values = (_shown(result, number, column.values, k) for number in range(len(places)))
        head = _head(column.name, column.case, column.unit)
        columns.append(TextColumn(head, tuple(values), right=True, rank=k))
    left_out = print_table(console, columns, told=False)
    hidden = len(plan.places) - _ROWS, len(left_out)
    if max(hidden) > 0:
        console.print(
            f"Not shown: {counted(max(hidden[0], 0), 'point')}, "
            f"{counted(max(hidden[1], 0), 'number')}; see the table's file"
        )
    _print_end(console, result)


def print_sample(console: Console, result: SweepResult) -> None:
    """What the sample makes of every number, and where the rest is."""
    rows = result.sampled
    columns = [
        TextColumn("number", tuple(number_label(one.name) for one in rows), folds=_WIDTH),
        TextColumn("case", tuple(one.case for one in rows), rank=1, folds=_WIDTH),
        _numbers("as given", rows, lambda one: number(one.nominal)),
        _numbers("first\norder", rows, lambda one: _band(one.first_order)),
        _numbers("sample", rows, _sample_band),
        _numbers("mean", rows, lambda one: number(one.mean), 3),
        _numbers("standard\ndeviation", rows, lambda one: number(one.deviation), 4),
        _numbers(_span(rows), rows, _middle, 2),
        TextColumn("unit", tuple(one.unit for one in rows)),
        TextColumn("compared", tuple(one.verdict for one in rows), folds=2 * _WIDTH),
    ]
    print_table(console, columns, title="Bands by the inputs, to first order and sampled")
    console.print(escape(sample_sentence(rows)))
    _print_end(console, result)


def _numbers(
    head: str, rows: Sequence[SampledNumber], text: Callable[[SampledNumber], str], rank: int = 0
) -> TextColumn:
    return TextColumn(head, tuple(map(text, rows)), right=True, rank=rank)


def _band(band: float | None) -> str:
    return "" if band is None else f"±{percent_of(band)}"


def _sample_band(one: SampledNumber) -> str:
    """The sample's band and its sampling error."""
    if one.band_low is None or one.band_high is None:
        return _band(one.band)
    return f"{_band(one.band)} ({100.0 * one.band_low:.2g} to {100.0 * one.band_high:.2g})"


def _span(rows: Sequence[SampledNumber]) -> str:
    """What the ends of a sample are."""
    return "middle\n95 %" if all(one.resolved for one in rows) else "least to\nlargest"


def _middle(one: SampledNumber) -> str:
    return "" if one.low is None else f"{number(one.low)} to {number(one.high)}"


def _print_end(console: Console, result: SweepResult) -> None:
    """Failures, warnings, files and seconds."""
    plan = result.plan
    _print_failures(console, result)
    warned = sorted({name for outcome in result.outcomes for name in outcome.warnings})
    if warned:
        count = sum(bool(outcome.warnings) for outcome in result.outcomes)
        console.print(
            escape(
                f"{counted(count, 'point')} with warnings ({', '.join(warned)}): see the "
                "table's column warnings"
            )
        )
    for path in result.files:
        console.print(escape(f"{'Figure' if path.suffix == '.png' else 'File'}: {path}"))
    fine = len(plan.places) - len(result.failed)
    console.print(f"{fine} of {len(plan.places)} points ok, {duration(result.seconds)}")


def _print_failures(console: Console, result: SweepResult) -> None:
    reasons: dict[str, int] = {}
    for k in result.failed:
        reasons[result.outcomes[k].failure] = reasons.get(result.outcomes[k].failure, 0) + 1
    for reason, count in list(reasons.items())[:5]:
        console.print(escape(f"{counted(count, 'point')} failed: {reason}"))
    if len(reasons) > 5:
        console.print(f"and {len(reasons) - 5} other reasons, in the table's column reason")


def _shown(result: SweepResult, place: int, values: NDArray[np.float64], column: int) -> str:
    """A number of a point; the first column says that it failed."""
    if result.outcomes[place].failure:
        return "" if column else "failed"
    value = float(values[place])
    return "" if math.isnan(value) else f"{value:.4g}"


def _head(name: str, case: str, unit: str) -> str:
    lines = (_broken(name), *textwrap.wrap(case, _WIDTH), unit and f"[{unit}]")
    return "\n".join(part for part in lines if part)


def _broken(name: str) -> str:
    """A long name on lines that end at its underscores."""
    lines = [""]
    for piece in re.findall(r"[^_]*_|[^_]+", name):
        if lines[-1] and len(lines[-1]) + len(piece) > _WIDTH - 2:
            lines.append("")
        lines[-1] += piece
    return "\n".join(lines)


def _plain(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"
