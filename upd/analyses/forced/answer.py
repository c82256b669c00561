"""The answer of a forced response: what an engineer would say of it, as tables.

From the numbers of a run as they stand in its summary, so that a run folder is answered alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

from upd.labels import plus_minus
from upd.plot.chart import Entry
from upd.results import quantities as q
from upd.results.answer_table import AnswerTable
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
#: numbers of the faces, one for each
_FACES = ("static_N", "static_T")
#: inputs that are shown
_INPUTS = 3
#: changes that weigh alike: an accuracy of frequency and of height that an engineer asks for
_WEIGHTS = {q.FREQUENCY_CHANGE: 1.5, q.ACCELERANCE_CHANGE: 10.0}
#: end of an input, which number it changes, and by how many per cent
_Change = tuple[str, Quantity, float]
Fields = Mapping[str, Any]


def _fields(entry: Entry) -> Fields:
    return entry.get("case_fields", {}) or {}


def headline(results: Sequence[Entry]) -> list[Entry]:
    """Peaks free and of the curve of the lowest F_C/F_E on which something slips, its reduction and
    loss, the best F_C/F_E, the stuck frequencies, the static forces of both faces.
    """
    slipping = {_curve_of(one) for one in results if one["name"] == "contact_slip" and one["value"]}

    def order(entry: Entry) -> tuple[bool, float]:
        stiffness, ratio = _curve_of(entry)
        return ratio is not None and (stiffness, ratio) not in slipping, float(ratio or 0.0)

    first: dict[tuple[str, str, str], Entry] = {}
    for entry in sorted(results, key=order):
        kind = _fields(entry).get("kind", "")
        side = _fields(entry).get("side", "") if entry["name"] in _FACES else ""
        # The peaks of the stuck curve are the stuck frequencies.
        if kind != "stuck":
            first.setdefault((entry["name"], kind, side), entry)
    ranked = [
        (key[1] != "free", rank, key)
        for key in first
        for rank, one in enumerate(MAIN)
        if fnmatchcase(key[0], one)
    ]
    return [first[key] for *_, key in sorted(ranked)]


def _curve_of(entry: Entry) -> tuple[Any, Any]:
    """Stiffness and F_C/F_E of a number; F_C/F_E is None for what belongs to no curve."""
    return _fields(entry).get("stiffness"), _fields(entry).get("force_ratio")


def answer(results: Sequence[Entry]) -> list[AnswerTable]:
    """Static state, peaks, the best damper, what the answer depends on most."""
    reached = [one for one in results if one["value"] is not None]
    tables = [
        _static(reached),
        _peaks(reached, results),
        _best(reached),
        _modes(reached),
        _inputs(reached),
    ]
    return [table for table in tables if table is not None]


# -- tables ----------------------------------------------------------------------------------------


def _table(
    title: str, rows: Sequence[Any], note: str, *columns: tuple[str, Callable[[Any], str]]
) -> AnswerTable | None:
    """A table of columns, heads and what makes their cells of a row; None without rows."""
    cells = tuple(tuple(cell(row) for _, cell in columns) for row in rows)
    return AnswerTable(title, tuple(head for head, _ in columns), cells, note) if rows else None


def _static(results: Sequence[Entry]) -> AnswerTable | None:
    """N and T of both faces, and whether the damper hangs."""
    forces = [e for e in results if e["name"] == _FACES[0] and _fields(e).get("side")]
    mine = [e for e in forces if _curve_of(e) == _curve_of(forces[0])]
    state = str(_fields(mine[0]).get("choice", "")) if mine else ""
    empty = [_fields(e)["side"] for e in mine if e["value"] == 0.0]
    note = f'Static state: "{state}".'
    if empty:
        note += (
            f" The {' and '.join(empty)} face carries nothing: the damper hangs on the other by "
            "friction."
        )
    elif state == "frictionless":
        note += " No mean friction: near what vibration leaves."
    return _table(
        "Static state",
        mine,
        note,
        ("face", lambda e: str(_fields(e)["side"])),
        ("#N, N", lambda e: f"{e['value']:.1f}"),
        ("#T, N", lambda e: _text("{:.1f}", _of(results, _FACES[1], _fields(e)))),
    )


def _peaks(results: Sequence[Entry], every: Sequence[Entry]) -> AnswerTable | None:
    """One row for every F_C/F_E and mode of the right blade."""
    found = [e for e in results if _is(e, q.PEAK_FREQUENCY) and _fields(e).get("kind") != "stuck"]
    several = len({_fields(e).get("stiffness") for e in found}) > 1
    heights = [e for e in results if _is(e, q.PEAK_ACCELERANCE)]
    free = max((e["value"] for e in heights if _fields(e).get("kind") == "free"), default=math.nan)
    rows = [
        (e, height)
        for e in sorted(found, key=_order)
        for height in heights
        if (height["name"], _fields(height)) == (_named(e, q.PEAK_ACCELERANCE), _fields(e))
    ]

    def against(height: Entry) -> str:
        change = 100.0 * (height["value"] / free - 1.0)
        shown = _fields(height).get("kind") != "free" and math.isfinite(change)
        return f"{change:+.0f} %" if shown else ""

    def moves(e: Entry, quantity: Quantity) -> str:
        peak = {**_fields(e), "peak": int(quantity_of(e["name"])[1])}
        return _text("{:.0f} %", _of(results, quantity.name, peak))

    def reaches(e: Entry) -> str:
        fold, up = (
            _of(results, _named(e, one), _fields(e))
            for one in (q.SWEEP_UP_ACCELERANCE, q.SWEEP_UP_FREQUENCY)
        )
        return "" if fold is None or up is None else f"{_height(fold)} at {up['value']:.1f}"

    lost = [e for e in every if e["value"] is None and _is(e, q.PEAK_FREQUENCY)]
    note = "Right blade; shares of all contact points and of the cycle."
    if lost:
        note += f" {len(lost)} peaks were not reached: see the notes."
    swept = [("# a sweep up reaches", lambda row: reaches(row[0]))]
    return _table(
        "Peaks",
        rows,
        note,
        ("F_C/F_E", lambda row: _case(row[0], several)),
        ("mode", lambda row: _mode(row[0])),
        ("# Hz", lambda row: f"{row[0]['value']:.1f}"),
        ("# ±", lambda row: _bound(row[0])),
        ("# (m/s²)/N", lambda row: _height(row[1])),
        ("# ±", lambda row: _bound(row[1])),
        ("# against free", lambda row: against(row[1])),
        ("# slips", lambda row: moves(row[0], q.CONTACT_SLIP)),
        ("# opens", lambda row: moves(row[0], q.CONTACT_LIFT)),
        ("# measured Hz", lambda row: _text("{:g}", row[0], "reference")),
        *(swept if any(reaches(e) for e, _ in rows) else ()),
    )


def _case(e: Entry, several: bool) -> str:
    """F_C/F_E or kind of a peak, with what tells it from others."""
    fields = _fields(e)
    ratio, choice = fields.get("force_ratio"), fields.get("choice")
    case = f"{ratio:g}" if ratio is not None else fields.get("kind", "")
    case = f"{fields.get('stiffness')}, {case}" if several else case
    return f"{case}, {choice}" if choice else case


def _mode(e: Entry) -> str:
    fields = _fields(e)
    alone = "one blade" if fields.get("kind") == "free" else f"peak {quantity_of(e['name'])[1]}"
    return fields.get("mode") or alone


def _named(e: Entry, quantity: Quantity) -> str:
    """Name of another number of the same peak."""
    return quantity.named(quantity_of(e["name"])[1])


def _text(words: str, entry: Entry | None, key: str = "value") -> str:
    """A value of a number; "" where there is none."""
    return "" if entry is None or entry.get(key) is None else words.format(entry[key])


def _is(entry: Entry, quantity: Quantity) -> bool:
    return quantity_of(entry["name"])[0] == quantity


def _order(entry: Entry) -> tuple[Any, ...]:
    fields = _fields(entry)
    ratio = fields.get("force_ratio")
    first = fields.get("kind") != "free"
    return first, str(fields.get("stiffness")), -(ratio or math.inf), entry["name"]


def _of(results: Sequence[Entry], name: str, like: Fields) -> Entry | None:
    """A number of the same case."""
    wanted = {k: v for k, v in like.items() if v not in (None, "")}
    return next((e for e in results if e["name"] == name and dict(_fields(e)) == wanted), None)


def _bound(entry: Entry) -> str:
    return plus_minus(entry).removeprefix("±")


def _height(entry: Entry) -> str:
    value = entry["value"]
    return f"{value:.0f}" if value >= 100.0 else f"{value:.1f}"


def _best(results: Sequence[Entry]) -> AnswerTable | None:
    """The best damper."""
    found = {quantity_of(e["name"])[0]: e for e in results}
    rows = [found] if q.BEST_RATIO in found and q.BEST_PEAK in found else []
    peak, inside = found.get(q.BEST_PEAK), found.get(q.BEST_INSIDE)
    end = inside is not None and not inside["value"]
    how = "still falls at this end of the curve" if end else "is lowest here"
    down = found.get(q.BEST_REDUCTION)
    fields = _fields(peak) if peak else {}
    where = (f"{fields.get('blade')} blade", str(fields.get("mode", "")))
    return _table(
        "Best F_C/F_E",
        rows,
        f"The highest peak of both blades and all modes {how}.",
        ("#F_C/F_E", lambda found: f"{found[q.BEST_RATIO]['value']:.3g}"),
        ("#highest peak, (m/s²)/N", lambda found: _height(found[q.BEST_PEAK])),
        ("# ±", lambda found: _bound(found[q.BEST_PEAK])),
        ("# against free", lambda _: "" if down is None else f"{-down['value']:+.0f} %"),
        ("where", lambda _: ", ".join(filter(None, where))),
        ("#with half of F_C", lambda found: _text("{:+.0f} %", found.get(q.HALF_OF_BEST))),
        ("#with twice F_C", lambda found: _text("{:+.0f} %", found.get(q.TWICE_THE_BEST))),
    )


def _modes(results: Sequence[Entry]) -> AnswerTable | None:
    """The largest damping of every mode, where it is, and the F_C that puts a vibration there."""
    rows = [e for e in results if _is(e, q.LARGEST_DAMPING)]

    def at(quantity: Quantity, words: str) -> Callable[[Entry], str]:
        return lambda e: _text(words, _of(results, quantity.name, _fields(e)))

    acceleration = at(q.DAMPING_ACCELERATION, "{:.3g}")
    note = "Right accelerometer. F_C of the last column times an amplitude damps that one most."
    if not all(acceleration(e) for e in rows):
        note += " Without amplitude: the damping still rises where the path ends."
    return _table(
        "Damping over amplitude",
        rows,
        note,
        ("mode", lambda e: ", ".join(filter(None, (_fields(e)["mode"], _fields(e).get("choice"))))),
        ("#largest damping", lambda e: f"{e['value']:.2f} %"),
        ("#at m/s²", acceleration),
        ("#Hz", at(q.DAMPING_FREQUENCY, "{:.1f}")),
        ("#against stuck", at(q.DAMPING_SHIFT, "{:+.1f} %")),
        ("#F_C per m/s², N", at(q.FORCE_FOR_DAMPING, "{:.3g}")),
    )


# -- inputs ----------------------------------------------------------------------------------------


def _inputs(results: Sequence[Entry]) -> AnswerTable | None:
    """The inputs that change the peaks most, beside the numerical error."""
    changes: dict[str, list[_Change]] = {}
    ratios = []
    for e in results:
        if (quantity := quantity_of(e["name"])[0]) in _WEIGHTS:
            name, _, end = str(_fields(e)["choice"]).partition(": ")
            changes.setdefault(name, []).append((end, quantity, e["value"]))
            ratios.append(float(_fields(e)["force_ratio"]))
    if not changes:
        return None
    ranked = sorted(
        changes.items(),
        key=lambda pair: -max(abs(value) / _WEIGHTS[of] for _, of, value in pair[1]),
    )
    rows: list[tuple[str, ...]] = [
        (
            name,
            " or ".join(dict.fromkeys(end for end, *_ in changes)),
            _span(changes, q.FREQUENCY_CHANGE, 1),
            _span(changes, q.ACCELERANCE_CHANGE, 0),
        )
        for name, changes in ranked[:_INPUTS]
    ]
    rows += list(_numerical(results))
    others = ", ".join(name for name, _ in ranked[_INPUTS:])
    note = f"Changes of the right blade's peaks at F_C/F_E {min(ratios):g}."
    if others:
        note += f" Less than these: {others}."
    heads = ("input", "changed to", "#frequency", "#height")
    return AnswerTable("What the answer depends on most", heads, tuple(rows), note)


def _span(found: Sequence[_Change], quantity: Quantity, digits: int) -> str:
    values = [value for _, of, value in found if of == quantity]
    if not values:
        return ""
    low, high = min(values), max(values)
    if len(values) == 1 or low == high:
        return f"{low:+.{digits}f} %"
    return f"{low:+.{digits}f} to {high:+.{digits}f} %"


def _numerical(results: Sequence[Entry]) -> Iterator[tuple[str, ...]]:
    """The largest estimated errors of peaks with friction."""
    worst = []
    for quantity in (q.PEAK_FREQUENCY, q.PEAK_ACCELERANCE):
        errors = [
            e["estimated_error"]
            for e in results
            if _is(e, quantity)
            and _fields(e).get("force_ratio") is not None
            and e.get("estimated_error") is not None
        ]
        worst.append(f"±{100.0 * max(errors):.1f} %" if errors else "")
    if any(worst):
        yield ("numerical error", "largest bound", *worst)
