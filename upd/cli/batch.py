"""What sweeps and studies show on a terminal: the plan, the tables, where the files are."""

from __future__ import annotations

import math
from collections import Counter

from rich.console import Console

from upd.batch.engine import Workers
from upd.batch.plan import SweepPlan
from upd.batch.studies import Study, StudyResult
from upd.batch.sweeps import SweepResult
from upd.cli.tables import print_table
from upd.cli.terminal import duration
from upd.labels import counted
from upd.plot.sweep_charts import is_constant
from upd.report.columns import fitting
from upd.report.tables import filled, sample_table, with_unit
from upd.results.quantities import number_title
from upd.results.sampled import sample_sentence

#: rows shown; the files hold all
_ROWS = 30
#: most different reasons of failures that are shown
_REASONS = 5
#: ending of a study's file -> what it is
_KINDS = {
    ".md": "Table",
    ".csv": "Rows",
    ".json": "Numbers",
    ".png": "Figure",
    ".html": "Page",
}


def print_sweep_plan(console: Console, plan: SweepPlan) -> None:
    """The plan in a few lines."""
    grid = " x ".join(f"{len(axis.values)} {axis.header}" for axis in plan.axes)
    if plan.sample is not None:
        grid = f"a sample of {plan.sample.count} with seed {plan.sample.seed}, and the scene itself"
    lines = [
        f"{plan.scene.title or plan.scene.name}: {counted(len(plan.places), 'point')} ({grid})"
    ]
    for one in () if plan.sample is None else plan.sample.inputs:
        lines.append(f"{one.path}: {one.given}, evenly between these limits")
    if plan.kept:
        lines.append(f"{counted(len(plan.kept), 'point')} kept from an earlier call")
    if plan.refused:
        refused = counted(len(plan.refused), "point")
        lines.append(f"{refused} not allowed by the scene: rows with their reason")
    if plan.groups:
        who, models = plan.workers, counted(len(set(plan.groups.values())), "contact model")
        text = f"{counted(len(plan.groups), 'point')} to solve, from {counted(plan.meshes, 'mesh')}"
        if plan.condensations:
            text += f", {counted(plan.condensations, 'condensation')} ({models})"
        here = f"{counted(max(who.count, 1), 'worker')}, {counted(who.threads, 'thread')} each"
        where = f"workers of {who.cluster}" if who.cluster else here
        lines.append(f"{text}; {where}, up to {plan.memory_bytes / 1e9:.2g} GB each")
    for line in lines:
        console.print(line)
    for note in plan.notes:
        console.print(note, style="dim")


def print_sweep(console: Console, result: SweepResult) -> None:
    """The table, as far as it fits, and where the rest is."""
    plan = result.plan
    places = plan.places[:_ROWS]
    columns = {axis.header: [axis.shown(p[k]) for p in places] for k, axis in enumerate(plan.axes)}
    columns["status"] = ["failed" if one.failure else "" for one in result.outcomes[: len(places)]]
    # what varies first
    for column in sorted(result.columns, key=lambda one: is_constant(one.values)):
        values = column.values[: len(places)]
        head = with_unit(number_title(column.name, column.case), column.unit)
        columns[f"# {head}"] = ["" if math.isnan(v) else f"{v:.4g}" for v in values]
    table = filled("Points", columns)
    shown = fitting(table, console.width)
    print_table(console, shown)
    points = max(len(plan.places) - _ROWS, 0)
    hidden = {"point": points, "number": len(table.columns) - len(shown.columns)}
    text = " and ".join(counted(count, what) for what, count in hidden.items() if count)
    if text:
        console.print(f"Not shown: {text}; see the table's file")
    _print_end(console, result)


def print_sample(console: Console, result: SweepResult) -> None:
    """What the sample makes of every number, and where the rest is."""
    print_table(console, sample_table(result.sampled))
    console.print(sample_sentence(result.sampled))
    _print_end(console, result)


def _print_end(console: Console, result: SweepResult) -> None:
    """Failures, warnings, files and seconds."""
    reasons = Counter(result.outcomes[k].failure for k in result.failed)
    lines = [
        f"{counted(count, 'point')} failed: {reason}"
        for reason, count in list(reasons.items())[:_REASONS]
    ]
    if len(reasons) > _REASONS:
        lines.append(f"and {len(reasons) - _REASONS} other reasons, in the table's column reason")
    warned = [outcome.warnings for outcome in result.outcomes if outcome.warnings]
    if warned:
        names = ", ".join(sorted({name for names in warned for name in names}))
        points = counted(len(warned), "point")
        lines.append(f"{points} with warnings ({names}): see the table's column warnings")
    lines += [f"{'Figure' if p.suffix == '.png' else 'File'}: {p}" for p in result.files]
    fine, total = len(result.plan.places) - len(result.failed), len(result.plan.places)
    for line in (*lines, f"{fine} of {total} points ok, {duration(result.seconds)}"):
        console.print(line)


def print_study_plan(console: Console, title: str, study: Study, workers: Workers) -> None:
    """How many points, and who solves them."""
    threads = counted(workers.threads, "thread") if workers.threads else "all threads"
    points, who = counted(len(study.points), "point"), f"one at a time with {threads}"
    if workers.cluster:
        who = f"workers of {workers.cluster}, {threads} each"
    elif workers.count > 1:
        side = counted(workers.count, "point")
        who = f"{side} at a time with {threads} each: seconds are not those of a single run"
    console.print(f"{title}: {points}, {who}")


def print_study(console: Console, result: StudyResult) -> None:
    """The study's tables, and where its files are."""
    if result.kept:
        console.print(f"{counted(len(result.kept), 'point')} kept from an earlier call")
    for table in result.report.tables:
        print_table(console, table)
    files = [f"{_KINDS.get(path.suffix, 'File')}: {path}" for path in result.files]
    fine = sum(not one.outcome.failure for one in result.solved)
    many = f"{fine} of {counted(len(result.solved), 'point')} ok"
    for line in (*files, f"{many}, {duration(result.seconds)}", *result.report.notes):
        console.print(line)
