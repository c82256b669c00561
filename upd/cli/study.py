"""What a study shows on a terminal: what will run, then its tables."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape

from upd.batch.engine import Workers
from upd.batch.studies import Study, StudyResult
from upd.cli.progress import counted, duration
from upd.cli.tables import print_table
from upd.report.columns import TextColumn
from upd.vary.tables import TextTable

#: characters to which a column of words may be folded
_WORDS = 16
#: ending of a file -> what it is
_KINDS = {".md": "Table", ".csv": "Rows", ".json": "Numbers", ".png": "Figure"}


def print_study_plan(console: Console, title: str, study: Study, workers: Workers) -> None:
    """How many points, and who solves them."""
    if not study.points:
        console.print(escape(f"{title}: from one set of modes, no other runs"))
        return
    threads = counted(workers.threads, "thread") if workers.threads else "all threads"
    if workers.cluster:
        who = f"workers of {workers.cluster}, {threads} each"
    elif workers.count > 1:
        who = (
            f"{counted(workers.count, 'point')} at a time with {threads} each: seconds are not "
            "those of a single run"
        )
    else:
        who = f"one at a time with {threads}"
    console.print(escape(f"{title}: {counted(len(study.points), 'point')}, {who}"))


def print_study(console: Console, result: StudyResult) -> None:
    """The study's tables, and where its files are."""
    if result.kept:
        console.print(f"{counted(len(result.kept), 'point')} kept from an earlier call")
    for table in result.report.tables:
        print_table(console, _columns(table), title=table.title)
    for note in result.report.notes:
        console.print(escape(note))
    for path in result.files:
        console.print(escape(f"{_KINDS.get(path.suffix, 'File')}: {path}"))
    fine = sum(not one.outcome.failure for one in result.solved)
    many = f"{fine} of {counted(len(result.solved), 'point')} ok, " if result.solved else ""
    console.print(f"{many}{duration(result.seconds)}")


def _columns(table: TextTable) -> list[TextColumn]:
    """The columns of a study's table; the last numbers are left out where it is too wide."""
    cells = list(zip(*table.rows, strict=True)) or [()] * len(table.columns)
    words = "r" in table.align
    return [
        TextColumn(
            head,
            tuple(mine),
            right=letter == "r",
            rank=0 if words and letter == "l" and head not in table.spare else k,
            folds=_WORDS if letter == "l" else 0,
        )
        for k, (head, letter, mine) in enumerate(
            zip(table.columns, table.align, cells, strict=True)
        )
    ]
