"""An answer that an analysis gives as tables: whole at every width, what warns behind it."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest
from rich.console import Console

from upd.analyses.base import CHOSEN_BY_ACCURACY
from upd.analyses.contact.analysis import ANALYSES
from upd.cli.tables import print_lines
from upd.plot.answer_table import AnswerTable
from upd.report.columns import whole_table
from upd.report.notebook import RunResult
from upd.report.tables import answer_tables, warnings
from upd.results import NO_CASE, Case, Check, Result
from upd.results.check import status_of
from upd.results.quantities import Quantity, number_label

PEAKS = AnswerTable(
    "Peaks",
    (
        *("# F_C/F_E", "mode", "# frequency Hz", "# ±", "# height (m/s²)/N", "# ±"),
        *("# against free", "# slips", "# opens", "# measured", "fold"),
    ),
    tuple(
        (
            *(f"{ratio}", mode, f"{400 + ratio / 7:.2f}", "±1.2 %", f"{ratio / 3:.4g}", "±3.9 %"),
            *("-43.2 %", "15 %", "6 %", "440 Hz", "397.1 to 398.2 Hz" * (ratio == 194)),
        )
        for ratio in (2000, 600, 194, 60)
        for mode in ("in phase", "out of phase")
    ),
    "± bounds what mesh, modes, harmonics and points leave; slips and opens are shares of the "
    "contact that do so at the peak.",
)
DEPENDS = AnswerTable(
    "What the answer depends on most",
    ("what", "# moves height", "to make it smaller"),
    (
        ("static state, friction at rest", "±55 %", "measure the normal forces " * 5 + "at rest"),
        ("contact.friction", "±21 %", "measure the friction coefficient of the pair in use"),
    ),
)
BEST = AnswerTable("Best F_C/F_E", ("mode", "# F_C/F_E"), (("in phase", "58.2"),))
EMPTY = AnswerTable("Nothing", ("a",), ())


@pytest.fixture
def told(
    small_run: Callable[[str], RunResult], monkeypatch: pytest.MonkeyPatch
) -> Iterator[RunResult]:
    """A run whose analysis answers with tables."""
    tables = [PEAKS, BEST, DEPENDS, EMPTY]
    monkeypatch.setitem(
        ANALYSES,
        "hertz",
        replace(ANALYSES["hertz"], answer=lambda entries: tables if entries else []),
    )
    yield small_run("hertz")


def printed(result: RunResult, width: int, *, full: bool = False) -> list[str]:
    """The lines the terminal shows."""
    sheet = io.StringIO()
    print_lines(Console(file=sheet, width=width, highlight=False), result.answer(width, full=full))
    return sheet.getvalue().splitlines()


def words(lines: list[str]) -> list[str]:
    return " ".join(lines).split()


@pytest.mark.parametrize("width", [50, 80, 120, 200])
@pytest.mark.parametrize("table", [PEAKS, DEPENDS, BEST])
def test_a_table_is_whole_at_every_width(table: AnswerTable, width: int) -> None:
    lines = whole_table(table, width)
    assert max(map(len, lines)) <= width
    found = words(lines)
    for text in (
        *(head.lstrip("# ") for head in table.columns),
        *(c for r in table.rows for c in r),
    ):
        for word in text.split():
            assert found.count(word) >= 1, word
    for row in table.rows:
        # A row is told as often as there are blocks, its other cells once.
        assert all(sum(cell in line for line in lines) >= 1 for cell in row if len(cell) < 10)


def test_columns_without_room_stand_below_beside_the_first() -> None:
    lines = whole_table(PEAKS, 80)
    heads = [k for k, line in enumerate(lines) if line.split()[:2] == ["F_C/F_E", "mode"]]
    assert len(heads) == 2
    below = lines[heads[1] + 1 :]
    assert [line.split()[:2] for line in below[:2]] == [["2000", "in"], ["2000", "out"]]
    assert sum("397.1 to 398.2 Hz" in line for line in below) == 2
    # An error stands beside its number.
    assert all(line.count("±") in (0, 2) for line in lines[heads[0] :])
    assert len(whole_table(PEAKS, 120)) == len(PEAKS.rows) + 2


@pytest.mark.parametrize("width", [80, 120])
def test_the_terminal_shows_the_tables_and_then_what_warns(told: RunResult, width: int) -> None:
    checks = [
        Check(f"check {k}", Case(force_ratio=r), r, 1.0, "motion left out", "take more", False)
        for k in range(5)
        for r in (2.0, 3.0)
    ]
    lost = [Quantity(f"number_{k}", "Hz").withheld(NO_CASE, "the path ended") for k in range(3)]
    results = (*told.results, *lost)
    bad = replace(
        told,
        checks=tuple(checks),
        results=results,
        status=status_of(checks, results),
        faults=("x",),
    )
    lines = printed(bad, width)
    assert max(len(x) for x in lines if not x.startswith(("Run folder", "Report"))) <= width
    text = " ".join(words(lines))
    assert lines[0].startswith("hertz: ok with warnings - maximum pressure")
    for table in (PEAKS, BEST, DEPENDS):
        at = lines.index(table.heading)
        assert lines[at + 1 :][: len(shown := whole_table(table, width))] == shown
        assert table.note in text
    assert "Nothing" not in lines
    assert any(line.startswith("Self-checks: 0 of 10 passed") for line in lines)
    assert text.count("Warning: ") == 3
    assert "Warning: Check 0 (F_C/F_E 3; F_C/F_E 2): motion left out = 3 (limit 1). Take" in text
    assert lines[-1] == "Warnings besides: 4, printed by --full."
    # All numbers and all that warns beside the tables when asked.
    full = printed(bad, width, full=True)
    assert {"Peaks", "Self-checks", "What was simulated"} <= set(full)
    assert " ".join(words(full)).count("Warning: ") == 7


def test_a_run_without_warnings_ends_with_its_files(told: RunResult) -> None:
    good = replace(told, checks=(), status="ok")
    assert printed(good, 80)[-1].startswith("Run folder: ")
    assert "besides" not in " ".join(printed(good, 80))


def test_without_tables_there_are_the_main_numbers(
    told: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert answer_tables({"analysis": "another"}, []) == []
    assert answer_tables(told.size, []) == []
    entries = [row.as_dict() for row in told.results]
    assert answer_tables(told.size, entries) == [PEAKS, BEST, DEPENDS]
    monkeypatch.setitem(ANALYSES, "hertz", replace(ANALYSES["hertz"], answer=None))
    assert [t.heading for t in answer_tables(told.size, entries)][:1] == ["Main numbers"]
    monkeypatch.setitem(ANALYSES, "hertz", replace(ANALYSES["hertz"], answer=lambda _: [PEAKS]))
    with_tables = printed(told, 80)
    monkeypatch.undo()
    assert printed(told, 80) != with_tables
    assert any(line.startswith("Self-checks: ") for line in printed(told, 80))


def test_what_warns_is_named_with_its_worst_case_first() -> None:
    bad, less = (
        Check("truncation", Case(force_ratio=r), r, 1.0, "motion", "take 9", False)
        for r in (9.0, 2.0)
    )
    lost = [
        Result(name, NO_CASE, float("nan"), "Hz", withheld="the path ended").as_dict()
        for name in ("f", "g", "f")
    ]
    assert warnings([less.as_dict(), bad.as_dict()], lost) == [
        "Truncation (F_C/F_E 9; F_C/F_E 2): motion = 9 (limit 1). Take 9.",
        "F; g: not reached, the path ended.",
    ]
    assert warnings([less.as_dict(), bad.as_dict()], lost, 1) == [
        "Truncation (F_C/F_E 9; and 1 more): motion = 9 (limit 1). Take 9.",
        "F; and 1 more: not reached, the path ended.",
    ]


def test_the_levels_that_an_accuracy_chose_stand_beside_the_tables(told: RunResult) -> None:
    chosen = {
        "name": CHOSEN_BY_ACCURACY[0],
        "on": True,
        "why": "modes kept 20 of 10; rounds: two",
    }
    lines = printed(replace(told, effects=(chosen,)), 80)
    assert "Accuracy reached, modes kept 20 of 10" in lines
    assert not any("Accuracy" in line for line in printed(told, 80))


def test_why_a_number_has_no_error_is_told_below_the_table(told: RunResult) -> None:
    unknown = {"source": "mesh", "error": None, "basis": "not estimated: one level only"}
    entries = [{**row.as_dict(), "error_parts": [unknown]} for row in told.results[:2]]
    size = {"analysis": "another"}
    first = {**entries[0], "estimated_error": None}
    second = {**entries[1], "estimated_error": None}
    both = "; ".join(number_label(one["name"]) for one in entries)
    told_of = f"{both} without ±: one level only."
    assert answer_tables(size, [first, second])[0].note == told_of
    known = {**second, "estimated_error": 0.01, "error_parts": []}
    note = answer_tables(size, [first, known])[0].note
    assert note == f"{number_label(first['name'])} without ±: one level only."
    assert answer_tables(size, [{**first, "error_parts": []}])[0].note == ""


def test_the_own_error_of_closed_forms_is_told_below_the_main_numbers(told: RunResult) -> None:
    entry = {**told.results[0].as_dict(), "reference": 1.0, "source": "Hertz"}
    order = {**entry, "name": "closed_form_error", "value": 0.14, "reference": None}
    (table,) = answer_tables({"analysis": "another"}, [entry, order])
    assert table.note == "The closed forms are exact to the order (a/R)² = 0.14 %."
