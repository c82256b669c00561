"""Terminal tables of plans and results, for rich consoles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from upd.analyses.base import Plan, fitting, memory_limit
from upd.cli.progress import counted
from upd.linalg.select import PRODUCTS
from upd.report.answer import TITLE
from upd.report.columns import TextColumn, fitted
from upd.report.notebook import RunResult
from upd.results import FAILED, OK, WARNED

#: mood of a line -> how it looks
_STYLES = {OK: "green", WARNED: "yellow", FAILED: "red", TITLE: "bold"}
#: characters a table needs between two columns, and at its sides
_GAP, _SIDES = 3, 4


def print_result(console: Console, result: RunResult, *, full: bool = False) -> None:
    """Print the answer of a run; with all numbers, checks and sources of errors when ``full``."""
    for line in result.answer(console.width, full=full):
        # a path longer than the terminal is wide stays one line, to be copied
        console.print(Text(line.text, style=_STYLES.get(line.mood, "")), soft_wrap=True)


def print_table(
    console: Console,
    columns: Sequence[TextColumn],
    *,
    title: str = "",
    named: bool = True,
) -> list[TextColumn]:
    """Print a table as wide as the console, at most; returns the columns that did not fit.

    Columns that do not fit are left out and named below it; no number is cut.

    Parameters
    ----------
    named
        Name the columns left out.
    """
    kept, left_out = fitted(columns, console.width - _SIDES, gap=_GAP)
    table = Table(title=escape(title) or None, title_justify="left", title_style="bold")
    for column in kept:
        table.add_column(
            escape(column.head),
            justify="right" if column.right else "left",
            no_wrap=not column.folds,
            min_width=None if column.folds else column.width,
            overflow="fold",
        )
    for row in zip(*(column.cells for column in kept), strict=True):
        table.add_row(*map(Text, row))
    console.print(table)
    if left_out and named:
        names = ", ".join(column.head.replace("\n", " ") for column in left_out)
        console.print(Text(f"not shown at this width: {names}", style="dim"))
    return left_out


def _ways_table(plan: Plan[Any]) -> Table:
    """What each way to see the bodies of a contact is predicted to cost, over all tasks."""
    table = Table(
        "way",
        "set with",
        "s",
        "GB",
        "for",
        title="Ways to see the bodies (one thread, all bodies and families of loads)",
        title_justify="left",
    )
    # each task lists its ways in one order: the condensing one, then those by products
    for ways in zip(*plan.ways.values(), strict=True):
        products = ways[0].name.startswith(PRODUCTS)
        names = list(dict.fromkeys(way.name.removeprefix(PRODUCTS) for way in ways))
        word = "products by factor" if products else "condensed"
        what = (
            "products by multigrid"
            if products and names == ["amg"]
            else f"{word} ({', '.join(names)})"
        )
        by = [
            task
            for task, way in zip(plan.ways, ways, strict=True)
            if plan.solver[task].partition(":")[0] == way.name
        ]
        if by:
            what += " (taken)" if len(by) == len(ways) else f" (taken for {', '.join(by)})"
        table.add_row(
            Text(what),
            f'solver.route = "{"products" if products else "condensed"}"'
            + (f', solver.name = "{names[0]}"' if len(names) == 1 else ""),
            f"{sum(way.cost.seconds for way in ways):.2g}",
            f"{sum(way.cost.bytes for way in ways) / 1e9:.2g}",
            ", ".join(dict.fromkeys(way.why for way in ways)) if products else "",
        )
    return table


def print_plan(console: Console, plan: Plan[Any]) -> None:
    """Print what a plan simulates, leaves out, and is predicted to cost."""
    table = Table(
        "effect",
        "simulated",
        "why",
        "check after the solve",
        title=escape(plan.scene.title or plan.scene.name),
        title_justify="left",
        title_style="bold",
    )
    for e in plan.effects:
        table.add_row(e.name, e.word, e.why, e.check)
    console.print(table)
    table = Table(
        "body",
        "hexahedra",
        "nodes",
        "dofs",
        "contact nodes",
        "linear solver",
        title=f"Size ({plan.symmetry} model)",
        title_justify="left",
    )
    for body, count in plan.size.items():
        solvers = "\n".join(
            f"{k.split(', ', 1)[1]}: {v}"
            for k, v in plan.solver.items()
            if k.startswith(f"{body}, ")
        )
        table.add_row(
            body,
            f"{count['hexes']}",
            f"{count['nodes']}",
            f"{3 * count['nodes']}",
            f"{count['contact']}",
            solvers,
        )
    console.print(table)
    if plan.ways:
        console.print(_ways_table(plan))
    parts = [
        f"{seconds:.2g} s ({100.0 * seconds / plan.seconds:.0f} %) for {what}"
        for seconds, what in (
            (plan.estimate_seconds, 'error estimates (accuracy = "unknown" saves them)'),
            (
                plan.input_seconds,
                f"the bands by {counted(len(plan.scene.uncertain), 'uncertain input')}",
            ),
        )
        if seconds > 0.0
    ]
    part = f", of them {' and '.join(parts)}" if parts else ""
    console.print(
        f"Predicted: {plan.seconds:.0f} s{part}, {plan.memory_bytes / 1e9:.1f} GB. "
        "Nothing was solved."
    )
    limit = memory_limit(plan.scene)
    if plan.memory_bytes > limit:
        console.print(
            f"That is more than the {limit / 1e9:.1f} GB of memory that a run may take here"
            f"{fitting(plan, limit)}: upd run refuses it. Use a coarser mesh, or fewer loads.",
            style="bold",
        )
