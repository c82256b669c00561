"""What sweeps and studies show on a terminal: the plan, the tables, where the files are."""

from __future__ import annotations

from rich.console import Console

from upd.batch.engine import Workers
from upd.batch.plan import SweepPlan
from upd.batch.studies import Study, StudyResult
from upd.batch.sweeps import SweepResult
from upd.cli.tables import print_table
from upd.cli.terminal import duration
from upd.labels import counted
from upd.report.sweep_page import read_sweep, sweep_tables

#: rows shown; the files hold all
_ROWS = 30
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
    """The tables of its page, as far as they fit, and where the rest is."""
    for table in sweep_tables(read_sweep(result.folder), _ROWS):
        print_table(console, table, cut=True)
    for path in result.files:
        console.print(f"{'Figure' if path.suffix == '.png' else 'File'}: {path}")
    fine, total = len(result.plan.places) - len(result.failed), len(result.plan.places)
    console.print(f"{fine} of {total} points ok, {duration(result.seconds)}")


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
