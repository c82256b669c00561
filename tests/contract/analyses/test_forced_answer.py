"""The answer of a forced response as tables, from numbers made by hand."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from upd.analyses.forced.answer import answer, headline
from upd.plot.answer_table import AnswerTable
from upd.plot.chart import Entry
from upd.results import Case, Result
from upd.results.quantities import Quantity

OWN = Case(stiffness="own")
MODES = {1: "in phase", 2: "out of phase"}


def told(*results: Result) -> dict[str, AnswerTable]:
    """Heading -> table."""
    return {table.heading: table for table in answer([r.as_dict() for r in results])}


def peak(
    number: int,
    f: float,
    height: float,
    case: Case,
    error: float | None = None,
    measured: float | None = None,
) -> Iterator[Result]:
    at = replace(case, mode="" if case.kind == "free" else MODES[number])
    found = Result(f"peak_{number}_frequency", at, f, "Hz", measured, "a table")
    yield replace(found, estimated_error=error)
    found = Result(f"peak_{number}_accelerance", at, height, "(m/s2)/N")
    yield replace(found, estimated_error=error)


def contact(number: int, case: Case, slip: float, lift: float) -> Iterator[Result]:
    at = replace(case, mode=MODES[number], peak=number)
    yield Result("contact_slip", at, slip, "%")
    yield Result("contact_lift", at, lift, "%")


def static(state: str, left: tuple[float, float], right: tuple[float, float]) -> Iterator[Result]:
    for side, (N, T) in (("left", left), ("right", right)):
        at = replace(OWN, side=side, choice=state)
        yield Result("static_N", at, N, "N")
        yield Result("static_T", at, T, "N")


def ratio(r: float) -> Case:
    return replace(OWN, force_ratio=r)


FREE = replace(OWN, kind="free")
RUN = (
    *peak(1, 297.61, 313.2, FREE, 0.004),
    *peak(1, 404.0, 204.0, replace(OWN, kind="stuck")),
    *peak(1, 390.25, 84.6, ratio(194.0), 0.02, 440.0),
    *peak(2, 443.07, 172.9, ratio(194.0), 0.05),
    *contact(1, ratio(194.0), 15.4, 6.0),
    *contact(2, ratio(194.0), 3.0, 0.0),
    *peak(1, 403.0, 200.0, ratio(600.0)),
    *contact(1, ratio(600.0), 0.0, 0.0),
)


def test_one_row_for_every_ratio_and_mode_free_first_then_falling_force() -> None:
    table = told(*RUN)["Peaks"]
    assert [head.removeprefix("#").strip() for head in table.columns] == [
        *("F_C/F_E", "mode", "Hz", "±", "(m/s²)/N", "±", "against free", "slips", "opens"),
        "measured Hz",
    ]
    rows = [
        ("free", "one blade", "297.6", "0.4 %", "313", "0.4 %", "", "", "", ""),
        ("600", "in phase", "403.0", "", "200", "", "-36 %", "0 %", "0 %", ""),
        ("194", "in phase", "390.2", "2 %", "84.6", "2 %", "-73 %", "15 %", "6 %", "440"),
        ("194", "out of phase", "443.1", "5 %", "173", "5 %", "-45 %", "3 %", "0 %", ""),
    ]
    found = [tuple(cell.replace(".0 %", " %") for cell in row) for row in table.rows]
    assert found == rows
    assert all(len(row) == len(table.columns) for row in table.rows)


def test_every_head_of_a_number_is_marked() -> None:
    for table in told(*RUN, *static("frictionless", (1.0, 0.0), (1.0, 0.0))).values():
        for column, head in enumerate(table.columns):
            numbers = [row[column] for row in table.rows if row[column]]
            assert all(n.lstrip("+-")[0].isdigit() for n in numbers) == head.startswith("#"), head


def test_only_where_a_fold_is_a_column_tells_what_a_sweep_reaches() -> None:
    assert not any("sweep" in head for head in told(*RUN)["Peaks"].columns)
    at = replace(ratio(194.0), mode=MODES[1])
    fold = (
        Result("peak_1_sweep_up_frequency", at, 397.13, "Hz"),
        Result("peak_1_sweep_up_accelerance", at, 61.2, "(m/s2)/N"),
    )
    table = told(*RUN, *fold)["Peaks"]
    assert table.columns[-1] == "# a sweep up reaches"
    assert [row[-1] for row in table.rows] == ["", "", "61.2 at 397.1", ""]
    assert all(len(row) == len(table.columns) for row in table.rows)


def test_a_sweep_without_a_free_peak_compares_with_none() -> None:
    table = told(*(r for r in RUN if r.case.kind != "free"))["Peaks"]
    assert {row[6] for row in table.rows} == {""}


def test_several_stiffnesses_and_sweeps_have_their_names() -> None:
    other = [replace(r, case=replace(r.case, stiffness="soft")) for r in RUN]
    swept = [replace(r, case=replace(r.case, choice="sweep up")) for r in RUN if not r.case.kind]
    cases = [row[0] for row in told(*RUN, *other)["Peaks"].rows]
    assert "own, 194" in cases and "soft, 194" in cases and "soft, free" in cases
    assert "194, sweep up" in [row[0] for row in told(*swept)["Peaks"].rows]


def test_forces_of_both_faces_at_rest() -> None:
    table = told(*static("seated", (0.0, 0.0), (303.1, 175.0)))["Static state"]
    assert table.rows == (("left", "0.0", "0.0"), ("right", "303.1", "175.0"))
    assert table.note == 'Static state: "seated".'


def best(inside: float = 1.0, **left_out: Any) -> list[Result]:
    case = replace(OWN, name="performance")
    at = replace(case, mode=MODES[2], blade="left")
    numbers = {
        "best_ratio": 58.22,
        "best_peak": 61.4,
        "best_frequency": 441.0,
        "best_reduction": 80.4,
        "half_of_best_ratio": 31.0,
        "twice_the_best_ratio": 55.2,
    }
    return [Result("best_inside", case, inside, "")] + [
        Result(name, at, value, "") for name, value in numbers.items() if name not in left_out
    ]


def test_the_best_damper_with_what_a_factor_of_two_costs() -> None:
    table = told(*best())["Best F_C/F_E"]
    assert table.rows == (
        ("58.2", "61.4", "", "-80 %", "left blade, out of phase", "+31 %", "+55 %"),
    )
    assert "is lowest here" in table.note
    assert "still falls at this end" in told(*best(0.0))["Best F_C/F_E"].note
    cut = told(*best(half_of_best_ratio=True))["Best F_C/F_E"]
    assert cut.rows[0][5:] == ("", "+55 %")
    assert len(cut.rows[0]) == len(cut.columns)
    assert "Best F_C/F_E" not in told(*best(best_peak=True))


def change(name: str, end: str, mode: int, frequency: float, height: float) -> Iterator[Result]:
    at = replace(ratio(60.0), mode=MODES[mode], choice=f"{name}: {end}")
    yield Result(f"peak_{mode}_frequency_change", at, frequency, "%")
    yield Result(f"peak_{mode}_accelerance_change", at, height, "%")


CHANGES = (
    *change("friction", "mu 0.48", 1, 0.1, 12.0),
    *change("friction", "mu 0.72", 1, -0.1, -9.0),
    *change("height of the contact patch", "0.5 of its height", 1, -6.0, 3.0),
    *change("height of the contact patch", "0.5 of its height", 2, -1.0, 4.0),
    *change("modal damping", "x 0.8", 1, 0.0, 25.0),
    *change("start of the sliders", "lower", 1, 0.0, 0.1),
)


def test_inputs_are_ranked_by_what_an_engineer_asks_for() -> None:
    """1.5 % of a frequency weigh as much as 10 % of a height: 6 % before 25 % before 12 %."""
    table = told(*RUN, *CHANGES)["What the answer depends on most"]
    assert table.rows == (
        ("height of the contact patch", "0.5 of its height", "-6.0 to -1.0 %", "+3 to +4 %"),
        ("modal damping", "x 0.8", "+0.0 %", "+25 %"),
        ("friction", "mu 0.48 or mu 0.72", "-0.1 to +0.1 %", "-9 to +12 %"),
        ("numerical error", "largest bound", "±5 %", "±5 %"),
    )
    assert "at F_C/F_E 60." in table.note
    assert table.note.endswith("Less than these: start of the sliders.")
    assert told(*CHANGES)["What the answer depends on most"].rows == table.rows[:3]


def test_what_is_not_known_has_no_table() -> None:
    assert told() == {}
    assert told(Quantity("peak_1_frequency", "Hz").withheld(ratio(60.0), "lost")) == {}
    assert set(told(*RUN)) == {"Peaks"}


def test_headline_is_of_the_lowest_ratio_on_which_something_slips() -> None:
    entries: list[Entry] = [r.as_dict() for r in (*RUN, *best())]
    names = [(e["name"], e["case_fields"].get("force_ratio")) for e in headline(entries)]
    assert names[0] == ("peak_1_frequency", None), "the free one"
    assert ("peak_1_accelerance", 194.0) in names and ("best_ratio", None) in names
    assert not any(e["case_fields"].get("kind") == "stuck" for e in headline(entries))
    assert math.isfinite(sum(e["value"] for e in headline(entries)))
