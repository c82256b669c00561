"""Terminal tables of plans and results, for rich consoles."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich.console import Console
from rich.text import Text

from upd.analyses.base import Plan, fitting
from upd.analyses.cost import memory_limit
from upd.labels import counted
from upd.plot.answer_table import AnswerTable
from upd.report.answer import TITLE, AnswerLine, table_lines
from upd.results.check import FAILED, OK, WARNED

#: mood of a line -> how it looks
_STYLES = {OK: "green", WARNED: "yellow", FAILED: "red", TITLE: "bold"}


def print_lines(console: Console, lines: Iterable[AnswerLine]) -> None:
    """Print an answer, each line as its mood looks."""
    for text, mood in lines:
        # a path longer than the terminal is wide stays one line, to be copied
        console.print(Text(text, style=_STYLES.get(mood, "")), soft_wrap=True)


def print_table(console: Console, table: AnswerTable, *, cut: bool = False) -> None:
    """Print a table with its heading and its note, as wide as the console; where it may be ``cut``,
    without the last columns that find no room.
    """
    print_lines(console, table_lines(table, console.width, cut=cut))


def print_plan(console: Console, plan: Plan[Any]) -> None:
    """Print what a plan simulates, leaves out, and is predicted to cost."""
    effects = tuple((e.name, e.word, e.why, e.check) for e in plan.effects)
    title = plan.scene.title or plan.scene.name
    heads = ("effect", "simulated", "why", "check after the solve")
    print_table(console, AnswerTable(title, heads, effects))
    sizes = tuple(
        (
            body,
            *(f"{n}" for n in (n["hexes"], n["nodes"], 3 * n["nodes"], n["contact"])),
            "; ".join(
                f"{task.removeprefix(f'{body}, ')}: {solver}"
                for task, solver in plan.solver.items()
                if task.startswith(f"{body}, ")
            ),
        )
        for body, n in plan.size.items()
    )
    title = f"Size ({plan.symmetry} model)"
    counts = ("#hexahedra", "#nodes", "#dofs", "#contact nodes")
    print_table(console, AnswerTable(title, ("body", *counts, "linear solver"), sizes))
    inputs = f"the bands by {counted(len(plan.scene.uncertain), 'uncertain input')}"
    parts = " and ".join(
        f"{seconds:.2g} s ({100.0 * seconds / plan.seconds:.0f} %) for {what}"
        for seconds, what in (
            (plan.estimate_seconds, 'error estimates (accuracy = "unknown" saves them)'),
            (plan.input_seconds, inputs),
        )
        if seconds > 0.0
    )
    console.print(
        f"Predicted: {plan.seconds:.0f} s{f', of them {parts}' if parts else ''}, "
        f"{plan.memory_bytes / 1e9:.1f} GB. Nothing was solved."
    )
    limit = memory_limit(plan.scene)
    if plan.memory_bytes > limit:
        console.print(
            f"That is more than the {limit / 1e9:.1f} GB of memory that a run may take here"
            f"{fitting(plan, limit)}: upd run refuses it. Use a coarser mesh, or fewer loads.",
            style="bold",
        )
