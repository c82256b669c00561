"""The answer of a forced response: what an engineer would say of it, as tables.

From the numbers of a run as they stand in its summary, so that a run folder is answered alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

from upd.labels import percent_of
from upd.plot.chart import Entry
from upd.results import Case, Result
from upd.results import quantities as q
from upd.results.answer_table import AnswerTable
from upd.results.number import read_result
from upd.results.quantities import Quantity, quantity_of

#: the numbers that matter, most important first (shell patterns), in tables of sweeps and studies
MAIN = (
    "peak_?_frequency",
    "peak_?_accelerance",
    "reduction_of_free_peak",
    "friction_energy",
    "best_ratio",
    "best_peak",
    "stuck_in_phase",
    "stuck_out_of_phase",
    "static_N",
    "static_T",
    "fitted_damping",
    "computed_peak_frequency",
    "frac",
    "magnitude_correlation",
)
#: inputs that are shown
_INPUTS = 3
#: changes that weigh alike: an accuracy of frequency and of height that an engineer asks for
_WEIGHTS = {q.FREQUENCY_CHANGE: 1.5, q.ACCELERANCE_CHANGE: 10.0}
#: numbers that were reached, by name and case
Known = Mapping[tuple[str, Case], Result]


def headline(results: Sequence[Entry]) -> list[Entry]:
    """Peaks free and of the curve of the lowest F_C/F_E, which slips most, its reduction and loss,
    the best F_C/F_E, the stuck frequencies, the static forces of both faces.
    """
    first: dict[tuple[bool, int, str, str], Entry] = {}
    cases = [(Case(**one["case_fields"]), one) for one in results]
    for case, entry in sorted(cases, key=lambda pair: pair[0].force_ratio or 0.0):
        rank = next((k for k, one in enumerate(MAIN) if fnmatchcase(entry["name"], one)), None)
        side = case.side if entry["name"] in (q.STATIC_N.name, q.STATIC_T.name) else ""
        # The peaks of the stuck curve are the stuck frequencies.
        if rank is not None and case.kind != "stuck":
            first.setdefault((case.kind != "free", rank, entry["name"], side), entry)
    return [first[key] for key in sorted(first)]


def answer(results: Sequence[Entry]) -> list[AnswerTable]:
    """Static state, peaks, the best damper, what the answer depends on most."""
    numbers = [read_result(one) for one in results]
    known = {(one.name, one.case): one for one in numbers if math.isfinite(one.value)}
    lost = [one for one in numbers if one.withheld and _is(one, q.PEAK_FREQUENCY)]
    tables = [_static(known), _peaks(known, len(lost)), _best(known), _modes(known), _inputs(known)]
    return [table for table in tables if table.rows]


# -- tables ----------------------------------------------------------------------------------------


def _table(
    title: str, rows: Sequence[Any], note: str, *columns: tuple[str, Callable[[Any], str]]
) -> AnswerTable:
    """A table of columns, heads and what makes their cells of a row."""
    cells = tuple(tuple(cell(row) for _, cell in columns) for row in rows)
    return AnswerTable(title, tuple(head for head, _ in columns), cells, note)


def _is(one: Result, *quantities: Quantity) -> bool:
    return quantity_of(one.name)[0] in quantities


def _beside(known: Known, one: Result, quantity: Quantity, **case: Any) -> Result | None:
    """Another number of the same mode and case, which may say more."""
    return known.get((quantity.named(quantity_of(one.name)[1]), replace(one.case, **case)))


def _text(words: str, one: Result | None) -> str:
    """A value in words; "" where there is none."""
    return "" if one is None else words.format(one.value)


def _bound(one: Result) -> str:
    return "" if one.estimated_error is None else percent_of(one.estimated_error)


def _height(one: Result) -> str:
    return f"{one.value:.0f}" if one.value >= 100.0 else f"{one.value:.1f}"


def _together(*words: str) -> str:
    return ", ".join(filter(None, words))


def _static(known: Known) -> AnswerTable:
    """N and T of both faces."""
    forces = [one for one in known.values() if _is(one, q.STATIC_N)]
    mine = [one for one in forces if one.case.stiffness == forces[0].case.stiffness]
    state = mine[0].case.choice if mine else ""
    return _table(
        "Static state",
        mine,
        f'Static state: "{state}".',
        ("face", lambda N: N.case.side),
        ("#N, N", lambda N: f"{N.value:.1f}"),
        ("#T, N", lambda N: _text("{:.1f}", _beside(known, N, q.STATIC_T))),
    )


def _peaks(known: Known, lost: int) -> AnswerTable:
    """One row for every F_C/F_E and mode of the right blade: frequency and height."""
    found = [f for f in known.values() if _is(f, q.PEAK_FREQUENCY) and f.case.kind != "stuck"]
    several = len({f.case.stiffness for f in found}) > 1
    rows = [(f, _beside(known, f, q.PEAK_ACCELERANCE)) for f in sorted(found, key=_order)]
    rows = [(f, height) for f, height in rows if height is not None]
    free = max((h.value for f, h in rows if h and f.case.kind == "free"), default=math.nan)

    def case(f: Result) -> str:
        ratio = f.case.force_ratio
        kind = f.case.kind if ratio is None else f"{ratio:g}"
        return _together(f.case.stiffness if several else "", kind, f.case.choice)

    def mode(f: Result) -> str:
        alone = "one blade" if f.case.kind == "free" else f"peak {quantity_of(f.name)[1]}"
        return f.case.mode or alone

    def against(height: Result) -> str:
        change = 100.0 * (height.value / free - 1.0)
        shown = height.case.kind != "free" and math.isfinite(change)
        return f"{change:+.0f} %" if shown else ""

    def moves(f: Result, quantity: Quantity) -> str:
        return _text("{:.0f} %", _beside(known, f, quantity, peak=int(quantity_of(f.name)[1])))

    def reaches(f: Result) -> str:
        fold, up = (
            _beside(known, f, one) for one in (q.SWEEP_UP_ACCELERANCE, q.SWEEP_UP_FREQUENCY)
        )
        return f"{_height(fold)} at {up.value:.1f}" if fold and up else ""

    note = "Right blade; shares of all contact points and of the cycle."
    if lost:
        note += f" {lost} peaks were not reached: see the notes."
    swept = [("# a sweep up reaches", lambda row: reaches(row[0]))]
    return _table(
        "Peaks",
        rows,
        note,
        ("F_C/F_E", lambda row: case(row[0])),
        ("mode", lambda row: mode(row[0])),
        ("# Hz", lambda row: f"{row[0].value:.1f}"),
        ("# ±", lambda row: _bound(row[0])),
        ("# (m/s²)/N", lambda row: _height(row[1])),
        ("# ±", lambda row: _bound(row[1])),
        ("# against free", lambda row: against(row[1])),
        ("# slips", lambda row: moves(row[0], q.CONTACT_SLIP)),
        ("# opens", lambda row: moves(row[0], q.CONTACT_LIFT)),
        ("# measured Hz", lambda row: f"{row[0].reference:g}" if row[0].reference else ""),
        *(swept if any(reaches(f) for f, _ in rows) else ()),
    )


def _order(f: Result) -> tuple[Any, ...]:
    case = f.case
    return case.kind != "free", case.stiffness, -(case.force_ratio or math.inf), f.name


def _best(known: Known) -> AnswerTable:
    """The best damper."""
    found = {quantity_of(one.name)[0]: one for one in known.values()}
    rows = [found[q.BEST_PEAK]] if {q.BEST_RATIO, q.BEST_PEAK} <= set(found) else []
    inside, down = found.get(q.BEST_INSIDE), found.get(q.BEST_REDUCTION)
    end = inside is not None and not inside.value
    how = "still falls at this end of the curve" if end else "is lowest here"
    return _table(
        "Best F_C/F_E",
        rows,
        f"The highest peak of both blades and all modes {how}.",
        ("#F_C/F_E", lambda _: f"{found[q.BEST_RATIO].value:.3g}"),
        ("#highest peak, (m/s²)/N", _height),
        ("# ±", _bound),
        ("# against free", lambda _: "" if down is None else f"{-down.value:+.0f} %"),
        ("where", lambda peak: _together(f"{peak.case.blade} blade", peak.case.mode)),
        ("#with half of F_C", lambda _: _text("{:+.0f} %", found.get(q.HALF_OF_BEST))),
        ("#with twice F_C", lambda _: _text("{:+.0f} %", found.get(q.TWICE_THE_BEST))),
    )


def _modes(known: Known) -> AnswerTable:
    """The largest damping of every mode, where it is, and the F_C that puts a vibration there."""
    rows = [one for one in known.values() if _is(one, q.LARGEST_DAMPING)]

    def at(quantity: Quantity, words: str) -> Callable[[Result], str]:
        return lambda one: _text(words, _beside(known, one, quantity))

    acceleration = at(q.DAMPING_ACCELERATION, "{:.3g}")
    note = "Right accelerometer. F_C of the last column times an amplitude damps that one most."
    if not all(acceleration(one) for one in rows):
        note += " Without amplitude: the damping still rises where the path ends."
    return _table(
        "Damping over amplitude",
        rows,
        note,
        ("mode", lambda one: _together(one.case.mode, one.case.choice)),
        ("#largest damping", lambda one: f"{one.value:.2f} %"),
        ("#at m/s²", acceleration),
        ("#Hz", at(q.DAMPING_FREQUENCY, "{:.1f}")),
        ("#against stuck", at(q.DAMPING_SHIFT, "{:+.1f} %")),
        ("#F_C per m/s², N", at(q.FORCE_FOR_DAMPING, "{:.3g}")),
    )


# -- inputs ----------------------------------------------------------------------------------------


def _inputs(known: Known) -> AnswerTable:
    """The inputs that change the peaks most."""
    changes: dict[str, list[Result]] = {}
    for one in known.values():
        if _is(one, *_WEIGHTS):
            changes.setdefault(one.case.choice.partition(": ")[0], []).append(one)
    ranked = sorted(
        changes.items(),
        key=lambda pair: (
            -max(abs(one.value) / _WEIGHTS[quantity_of(one.name)[0]] for one in pair[1])
        ),
    )
    rows = [
        (
            name,
            " or ".join(dict.fromkeys(one.case.choice.partition(": ")[2] for one in mine)),
            _span(mine, q.FREQUENCY_CHANGE, 1),
            _span(mine, q.ACCELERANCE_CHANGE, 0),
        )
        for name, mine in ranked[:_INPUTS]
    ]
    ratios = (one.case.force_ratio or 0.0 for mine in changes.values() for one in mine)
    note = f"Changes of the right blade's peaks at F_C/F_E {min(ratios, default=0.0):g}."
    if others := ", ".join(name for name, _ in ranked[_INPUTS:]):
        note += f" Less than these: {others}."
    heads = ("input", "changed to", "#frequency", "#height")
    return AnswerTable("What the answer depends on most", heads, tuple(rows), note)


def _span(changes: Sequence[Result], quantity: Quantity, digits: int) -> str:
    values = [one.value for one in changes if _is(one, quantity)]
    ends = [f"{end:+.{digits}f}" for end in sorted({min(values), max(values)})] if values else []
    return f"{' to '.join(ends)} %" if ends else ""
