"""What a sweep shows on a terminal: the plan and the table."""

from __future__ import annotations

import math
import re
import textwrap

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.markup import escape
from rich.text import Text

from upd.batch.output import SweepResult
from upd.batch.plan import SweepPlan
from upd.cli.progress import counted, duration
from upd.cli.tables import print_table
from upd.report.columns import TextColumn, whole_table
from upd.report.tables import sample_table
from upd.results.sampled import sample_sentence

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
    left_out = print_table(console, columns, named=False)
    hidden = len(plan.places) - _ROWS, len(left_out)
    if max(hidden) > 0:
        console.print(
            f"Not shown: {counted(max(hidden[0], 0), 'point')}, "
            f"{counted(max(hidden[1], 0), 'number')}; see the table's file"
        )
    _print_end(console, result)


def print_sample(console: Console, result: SweepResult) -> None:
    """What the sample makes of every number, and where the rest is."""
    table = sample_table(result.sampled)
    for line in (table.heading, *whole_table(table, console.width)):
        console.print(Text(line), soft_wrap=True)
    console.print(escape(sample_sentence(result.sampled)))
    _print_end(console, result)


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
    """A number of a point; the first column marks one that failed."""
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
