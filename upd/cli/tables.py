"""Terminal tables of plans and results, for rich consoles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from upd.analyses.base import Plan, fitting, memory_limit
from upd.cli.progress import counted
from upd.labels import check_number, effect_word, number, percent, plus_minus, shown
from upd.linalg.select import PRODUCTS
from upd.report.answer import TITLE, AnswerLine, answer
from upd.report.columns import TextColumn, fitted, folded_head
from upd.report.notebook import RunResult
from upd.results import FAILED, OK, WARNED, Result, worst_checks
from upd.results.quantities import number_label

#: mood of a line -> how it looks
_STYLES = {OK: "green", WARNED: "yellow", FAILED: "red", TITLE: "bold"}
_VERDICTS = {"passed": "green", "warning": "yellow", "failed": "red"}
#: characters a table needs between two columns, and at its sides
_GAP, _SIDES = 3, 4
#: characters to which a column of words may be folded
_WORDS = 12


def print_result(console: Console, result: RunResult, *, full: bool = False) -> None:
    """Print the answer of a run; everything between its verdict and its end when ``full``."""
    told = answer(result, console.width)
    _print_lines(console, told.verdict)
    if told.has_tables or not full:
        _print_lines(console, told.numbers)
    if full:
        _print_all(console, result)
    _print_lines(console, told.end)


def _print_lines(console: Console, lines: Sequence[AnswerLine]) -> None:
    for line in lines:
        # a path longer than the terminal is wide stays one line, to be copied
        console.print(Text(line.text, style=_STYLES.get(line.mood, "")), soft_wrap=True)


def _print_all(console: Console, result: RunResult) -> None:
    """Numbers case by case, what was left out, checks, size and stages."""
    cases: dict[str, list[Result]] = {}
    for row in result.results:
        cases.setdefault(row.case.label, []).append(row)
    for group in _alike(cases):
        if len(group) == 1:
            print_table(console, _numbers(cases[group[0]]), title=group[0])
        else:
            print_table(console, _side_by_side({case: cases[case] for case in group}))
    print_table(console, _effects(result.effects), title="What was simulated")
    _print_checks(console, result)
    cost = result.cost
    stages = ", ".join(f"{k} {v:.1f} s" for k, v in cost["stages"].items())
    sizes = ", ".join(f"{body} {n} dofs" for body, n in result.size["n_dof"].items())
    pairs = (
        "" if result.size.get("n_pairs") is None else f"{result.size['n_pairs']} contact pairs; "
    )
    console.print(f"Size: {sizes}; {pairs}symmetry {result.size['symmetry']}")
    console.print(f"Stages: {stages}")


def print_table(
    console: Console,
    columns: Sequence[TextColumn],
    *,
    title: str = "",
    styles: Mapping[str, str] | None = None,
    told: bool = True,
) -> list[TextColumn]:
    """Print a table as wide as the console, at most; returns the columns that did not fit.

    Columns that do not fit are left out and named below it; no number is cut.

    Parameters
    ----------
    styles
        Cell -> its style.
    told
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
        table.add_row(*(Text(cell, style=(styles or {}).get(cell, "")) for cell in row))
    console.print(table)
    if left_out and told:
        names = ", ".join(column.head.replace("\n", " ") for column in left_out)
        console.print(Text(f"not shown at this width: {names}", style="dim"))
    return left_out


def _alike(cases: dict[str, list[Result]]) -> list[list[str]]:
    """Neighbouring cases with the same numbers and no references: one table shows them."""

    def kind(case: str) -> tuple[str, ...]:
        plain = len(cases[case]) > 1 and all(
            r.reference is None and not r.withheld for r in cases[case]
        )
        return tuple(r.name for r in cases[case]) if plain else (case,)

    return [list(group) for _, group in groupby(cases, key=kind)]


def _side_by_side(cases: dict[str, list[Result]]) -> list[TextColumn]:
    """A row per case, a column per number; the last numbers are the first to go."""
    first = next(iter(cases.values()))
    columns = [TextColumn("case", tuple(cases))]
    for k, r in enumerate(first):
        head = number_label(r.name) + (f", {r.unit}" if r.unit else "")
        entries = [rows[k].as_dict() for rows in cases.values()]
        cells = tuple(f"{shown(e, unit=False)} {plus_minus(e)}".rstrip() for e in entries)
        columns.append(TextColumn(folded_head(head), cells, right=True, rank=k))
    return columns


def _numbers(rows: Sequence[Result]) -> list[TextColumn]:
    """A row per number."""
    entries = [r.as_dict() for r in rows]
    costs = (r.half_words for r in rows)
    return [
        TextColumn("number", tuple(number_label(r.name) for r in rows), folds=2 * _WORDS),
        TextColumn("value", tuple(map(shown, entries)), right=True),
        TextColumn("error", tuple(map(plus_minus, entries)), right=True, rank=1),
        TextColumn("reference", tuple(number(r.reference) for r in rows), right=True, rank=3),
        TextColumn("difference", tuple(percent(r.error) for r in rows), right=True, rank=2),
        TextColumn("thesis", tuple(percent(r.printed_error) for r in rows), right=True, rank=4),
        TextColumn("half of it costs", tuple(costs), right=True, rank=5),
        TextColumn("source", tuple(r.withheld or r.source for r in rows), rank=6, folds=_WORDS),
    ]


def _effects(effects: tuple[dict[str, object], ...]) -> list[TextColumn]:
    return [
        TextColumn("effect", tuple(str(e["name"]) for e in effects), folds=_WORDS),
        TextColumn("simulated", tuple(effect_word(e) for e in effects)),
        TextColumn("why", tuple(str(e["why"]) for e in effects), folds=_WORDS),
        TextColumn("check", tuple(str(e.get("verdict", "")) for e in effects), folds=_WORDS),
    ]


def _print_checks(console: Console, result: RunResult) -> None:
    worst = worst_checks(c.as_dict() for c in result.checks)
    columns = [
        TextColumn(
            "self-check", tuple(f"{c['name']}: {c['says']}" for c in worst), folds=2 * _WORDS
        ),
        TextColumn("worst case", tuple(c["case"] for c in worst), rank=1, folds=_WORDS),
        TextColumn("value", tuple(check_number(c, "value") for c in worst), right=True),
        TextColumn("limit", tuple(check_number(c, "limit") for c in worst), right=True),
        TextColumn("verdict", tuple(c["verdict"] for c in worst)),
    ]
    print_table(console, columns, title="Self-checks", styles=_VERDICTS)
    for c in result.checks:
        if not c.passed:
            console.print(
                Text(f"{c.verdict} {c.name} {c.case}: {c.remedy}", style=_VERDICTS[c.verdict])
            )


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
