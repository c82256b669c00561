"""The answer of a forced response: what an engineer would say of it, as tables.

From the numbers of a run as they stand in its summary, so that a run folder is answered alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
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


# -- static state ----------------------------------------------------------------------------------


def _static(results: Sequence[Entry]) -> AnswerTable | None:
    """N and T of both faces, and whether the damper hangs."""
    forces = [e for e in results if e["name"] in _FACES and _fields(e).get("side")]
    mine = {
        _fields(e)["side"]: e
        for e in forces
        if e["name"] == _FACES[0] and _fields(e).get("stiffness") == _fields(forces[0])["stiffness"]
    }
    if not mine:
        return None
    T = {side: _of(results, _FACES[1], _fields(n)) for side, n in mine.items()}
    state = str(_fields(next(iter(mine.values()))).get("choice", ""))
    rows = tuple(
        (side, f"{n['value']:.1f}", "" if t is None else f"{t['value']:.1f}")
        for (side, n), t in zip(mine.items(), T.values(), strict=True)
    )
    empty = [side for side, n in mine.items() if n["value"] == 0.0]
    note = f'Static state: "{state}".'
    if empty:
        note += (
            f" The {' and '.join(empty)} face carries nothing: the damper hangs on the other by "
            "friction."
        )
    elif state == "frictionless":
        note += " No mean friction: near what vibration leaves."
    return AnswerTable("Static state", ("face", "#N, N", "#T, N"), rows, note)


# -- peaks -----------------------------------------------------------------------------------------


def _peaks(results: Sequence[Entry], every: Sequence[Entry]) -> AnswerTable | None:
    """One row for every F_C/F_E and mode of the right blade."""
    found = [e for e in results if _is(e, q.PEAK_FREQUENCY) and _fields(e).get("kind") != "stuck"]
    if not found:
        return None
    several = len({_fields(e).get("stiffness") for e in found}) > 1
    heights = [e for e in results if _is(e, q.PEAK_ACCELERANCE)]
    free = [e["value"] for e in heights if _fields(e).get("kind") == "free"]
    rows = [
        _peak_row(results, e, height, several, max(free, default=math.nan))
        for e in sorted(found, key=_order)
        for height in heights
        if (height["name"], _fields(height)) == (_height_name(e), _fields(e))
    ]
    heads: tuple[str, ...] = (
        "F_C/F_E",
        "mode",
        "# Hz",
        "# ±",
        "# (m/s²)/N",
        "# ±",
        "# against free",
        "# slips",
        "# opens",
        "# measured Hz",
        "# a sweep up reaches",
    )
    if not any(row[-1] for row in rows):
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    lost = [e for e in every if e["value"] is None and _is(e, q.PEAK_FREQUENCY)]
    note = "Right blade; shares of all contact points and of the cycle."
    if lost:
        note += f" {len(lost)} peaks were not reached: see the notes."
    return AnswerTable("Peaks", heads, tuple(rows), note)


def _peak_row(
    results: Sequence[Entry], e: Entry, height: Entry, several: bool, free: float
) -> tuple[str, ...]:
    """Cells of a peak from its frequency and height; ``free``: of the highest free peak."""
    fields, number = _fields(e), quantity_of(e["name"])[1]
    ratio, kind = fields.get("force_ratio"), fields.get("kind", "")
    case = f"{ratio:g}" if ratio is not None else kind
    if several:
        case = f"{fields.get('stiffness')}, {case}"
    if fields.get("choice"):
        case += f", {fields['choice']}"
    peak = {**fields, "peak": int(number)}
    moved = [_of(results, one.name, peak) for one in (q.CONTACT_SLIP, q.CONTACT_LIFT)]
    fold = _of(results, q.SWEEP_UP_ACCELERANCE.named(number), fields)
    up = _of(results, q.SWEEP_UP_FREQUENCY.named(number), fields)
    against = 100.0 * (height["value"] / free - 1.0)
    reference = e.get("reference")
    return (
        case,
        fields.get("mode") or ("one blade" if kind == "free" else f"peak {number}"),
        f"{e['value']:.1f}",
        _bound(e),
        _height(height["value"]),
        _bound(height),
        f"{against:+.0f} %" if kind != "free" and math.isfinite(against) else "",
        *("" if one is None else f"{one['value']:.0f} %" for one in moved),
        f"{reference:g}" if reference is not None else "",
        "" if fold is None or up is None else f"{_height(fold['value'])} at {up['value']:.1f}",
    )


def _height_name(entry: Entry) -> str:
    """Name of the height of a peak of which this is the frequency."""
    return q.PEAK_ACCELERANCE.named(quantity_of(entry["name"])[1])


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


def _height(value: float) -> str:
    return f"{value:.0f}" if value >= 100.0 else f"{value:.1f}"


# -- the best damper -------------------------------------------------------------------------------


def _best(results: Sequence[Entry]) -> AnswerTable | None:
    found = {quantity_of(e["name"])[0]: e for e in results}
    if q.BEST_RATIO not in found or q.BEST_PEAK not in found:
        return None
    ratio, peak = found[q.BEST_RATIO], found[q.BEST_PEAK]
    fields = _fields(peak)
    down = found.get(q.BEST_REDUCTION)
    row = (
        f"{ratio['value']:.3g}",
        f"{_height(peak['value'])}",
        _bound(peak),
        "" if down is None else f"{-down['value']:+.0f} %",
        ", ".join(filter(None, (f"{fields.get('blade')} blade", str(fields.get("mode", ""))))),
        *(
            f"{found[one]['value']:+.0f} %" if one in found else ""
            for one in (q.HALF_OF_BEST, q.TWICE_THE_BEST)
        ),
    )
    heads = (
        "#F_C/F_E",
        "#highest peak, (m/s²)/N",
        "# ±",
        "# against free",
        "where",
        "#with half of F_C",
        "#with twice F_C",
    )
    note = "The highest peak of both blades and all modes is lowest here."
    inside = found.get(q.BEST_INSIDE)
    if inside is not None and not inside["value"]:
        note = "The highest peak of both blades and all modes still falls at this end of the curve."
    return AnswerTable("Best F_C/F_E", heads, (row,), note)


# -- damping over amplitude ------------------------------------------------------------------------


_DAMPED = {
    q.DAMPING_ACCELERATION: "{:.3g}",
    q.DAMPING_FREQUENCY: "{:.1f}",
    q.DAMPING_SHIFT: "{:+.1f} %",
    q.FORCE_FOR_DAMPING: "{:.3g}",
}


def _modes(results: Sequence[Entry]) -> AnswerTable | None:
    """The largest damping of every mode, where it is, and the F_C that puts a vibration there."""
    rows = []
    for e in (one for one in results if _is(one, q.LARGEST_DAMPING)):
        rest = {one: _of(results, one.name, _fields(e)) for one in _DAMPED}
        cells = (
            _DAMPED[one].format(found["value"]) if found else "" for one, found in rest.items()
        )
        mode = ", ".join(filter(None, (_fields(e)["mode"], _fields(e).get("choice"))))
        rows.append((mode, f"{e['value']:.2f} %", *cells))
    if not rows:
        return None
    heads = ("mode", "#largest damping", "#at m/s²", "#Hz", "#against stuck", "#F_C per m/s², N")
    note = "Right accelerometer. F_C of the last column times an amplitude damps that one most."
    if any("" in row for row in rows):
        note += " Without amplitude: the damping still rises where the path ends."
    return AnswerTable("Damping over amplitude", heads, tuple(rows), note)


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
    ranked = sorted(changes.items(), key=lambda pair: -_weight(pair[1]))
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


def _weight(found: Sequence[_Change]) -> float:
    return max(abs(value) / _WEIGHTS[quantity] for _, quantity, value in found)


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
