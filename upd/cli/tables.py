"""Terminal tables of plans and results, for rich consoles."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from upd.analyses.base import Plan
from upd.labels import check_number, effect_word, number, number_label, percent
from upd.report.notebook import RunResult
from upd.results import FAILED, OK, WARNED, Result, warnings_of, worst_checks


def print_result(console: Console, result: RunResult) -> None:
    """Print the tables of a run: numbers case by case, what was left out, checks, cost."""
    cases: dict[str, list[Result]] = {}
    for row in result.results:
        cases.setdefault(row.case.label, []).append(row)
    for group in _alike(cases):
        console.print(
            _numbers(group[0], cases[group[0]])
            if len(group) == 1
            else _side_by_side({case: cases[case] for case in group})
        )
    console.print(_effects(result.effects))
    _print_checks(console, result)
    cost = result.cost
    stages = ", ".join(f"{k} {v:.1f} s" for k, v in cost["stages"].items())
    sizes = ", ".join(f"{body} {n} dofs" for body, n in result.size["n_dof"].items())
    pairs = (
        "" if result.size.get("n_pairs") is None else f"{result.size['n_pairs']} contact pairs; "
    )
    console.print(f"Size: {sizes}; {pairs}symmetry {result.size['symmetry']}")
    console.print(f"Cost: {cost['total_s']:.1f} s, {cost['peak_rss_mb']:.0f} MB at most ({stages})")
    if result.folder is not None:
        console.print(f"Run folder: {escape(str(result.folder))}")
    _print_status(console, result)


def _print_status(console: Console, result: RunResult) -> None:
    """How the run ended, last; what warns and what was not reached, a line each."""
    colour = {OK: "green", WARNED: "yellow", FAILED: "red"}[result.outcome]
    console.print(f"[{colour}]Status: {result.outcome}[/]")
    if result.outcome == WARNED:
        for reason in warnings_of(result.checks, result.results):
            console.print(f"[{colour}]  {escape(reason)}[/]")


def _alike(cases: dict[str, list[Result]]) -> list[list[str]]:
    """Neighbouring cases with the same numbers and no references: one table shows them."""

    def kind(case: str) -> tuple[str, ...]:
        plain = len(cases[case]) > 1 and all(
            r.reference is None and r.estimated_error is None and not r.withheld
            for r in cases[case]
        )
        return tuple(r.name for r in cases[case]) if plain else (case,)

    return [list(group) for _, group in groupby(cases, key=kind)]


def _side_by_side(cases: dict[str, list[Result]]) -> Table:
    first = next(iter(cases.values()))
    table = Table("case", title_justify="left", title_style="bold")
    for r in first:
        table.add_column(number_label(r.name) + (f", {r.unit}" if r.unit else ""), justify="right")
    for case, rows in cases.items():
        table.add_row(case, *(number(r.value) for r in rows))
    return table


def _numbers(case: str, rows: list[Result]) -> Table:
    thesis = any(r.thesis_error is not None for r in rows)
    estimated = any(r.estimated_error is not None for r in rows)
    table = Table(title=case, title_justify="left", title_style="bold")
    table.add_column("number", min_width=30)
    for head in ("value", "reference", "difference"):
        table.add_column(head, justify="right")
    if thesis:
        table.add_column("thesis", justify="right")
    halved = any(r.half_error_cost_s is not None for r in rows)
    if estimated:
        table.add_column("estimated error", justify="right")
    if halved:
        table.add_column("half of it costs", justify="right")
    table.add_column("source")
    for r in rows:
        cells = [
            number_label(r.name),
            "not reached" if r.withheld else number(r.value, r.unit),
            number(r.reference),
            percent(r.error),
        ]
        if thesis:
            cells.append(percent(r.thesis_error))
        if estimated:
            cells.append("" if r.estimated_error is None else f"{100 * r.estimated_error:.2f} %")
        if halved:
            cells.append("" if r.half_error_cost_s is None else f"{r.half_error_cost_s:.1f} s")
        table.add_row(*cells, r.withheld or r.source)
    return table


def _effects(effects: tuple[dict[str, object], ...]) -> Table:
    table = Table(
        "effect",
        "simulated",
        "why",
        "check",
        title="What was simulated",
        title_justify="left",
        title_style="bold",
    )
    for e in effects:
        table.add_row(str(e["name"]), effect_word(e), str(e["why"]), str(e.get("verdict", "")))
    return table


def _print_checks(console: Console, result: RunResult) -> None:
    table = Table(
        "self-check", "worst case", title="Self-checks", title_justify="left", title_style="bold"
    )
    for head in ("value", "limit"):
        table.add_column(head, justify="right")
    table.add_column("verdict")
    colours = {"passed": "green", "warning": "yellow", "failed": "red"}
    for worst in worst_checks(c.as_dict() for c in result.checks):
        told = f"[{colours[worst['verdict']]}]{worst['verdict']}[/]"
        table.add_row(
            f"{worst['name']}: {worst['says']}",
            worst["case"],
            *(check_number(worst, key) for key in ("value", "limit")),
            told,
        )
    console.print(table)
    for c in result.checks:
        if not c.passed:
            console.print(
                f"[{'red' if c.fatal else 'yellow'}]{c.verdict}[/] {c.name} {c.case}: {c.remedy}"
            )


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
    console.print(
        f"Predicted: {plan.seconds:.0f} s, {plan.memory_bytes / 1e9:.1f} GB. Nothing was solved."
    )
