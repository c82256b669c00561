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
from upd.results.quantities import quantity_of
from upd.results.quantity import Quantity

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
    slipping = {
        _curve_of(one) for one in results if one["name"] == "contact_slip" and (one["value"] or 0)
    }
    first: dict[tuple[str, str, str], Entry] = {}
    for entry in sorted(results, key=lambda one: _rank_of(one, slipping)):
        kind = _fields(entry).get("kind", "")
        side = _fields(entry).get("side", "") if entry["name"] in _FACES else ""
        # The peaks of the stuck curve are the stuck frequencies.
        if kind != "stuck":
            first.setdefault((entry["name"], kind, side), entry)
    ranked = [
        (rank, key) for key in first for rank, one in enumerate(MAIN) if fnmatchcase(key[0], one)
    ]
    return [
        first[key] for _, key in sorted(ranked, key=lambda pair: (pair[1][1] != "free", pair[0]))
    ]


def _curve_of(entry: Entry) -> tuple[Any, Any]:
    """Stiffness and F_C/F_E of a number; F_C/F_E is None for what belongs to no curve."""
    return _fields(entry).get("stiffness"), _fields(entry).get("force_ratio")


def _rank_of(entry: Entry, slipping: set[tuple[Any, Any]]) -> tuple[bool, float]:
    curve = _curve_of(entry)
    if curve[1] is None:
        return False, 0.0
    return curve not in slipping, float(curve[1])


def answer(results: Sequence[Entry]) -> list[AnswerTable]:
    """Static state, peaks, the best damper, what the answer depends on most."""
    reached = [one for one in results if one["value"] is not None]
    tables = [_static(reached), _peaks(reached, results), _best(reached), _inputs(reached)]
    return [table for table in tables if table is not None]


def _several(results: Sequence[Entry]) -> bool:
    """Whether the run has more than one contact stiffness."""
    return len({_fields(e).get("stiffness") for e in results if _fields(e).get("stiffness")}) > 1


# -- static state ----------------------------------------------------------------------------------


def _static(results: Sequence[Entry]) -> AnswerTable | None:
    """N and T of both faces, and whether the damper hangs."""
    N, T = (
        {
            (_fields(e).get("stiffness"), _fields(e)["side"]): e
            for e in results
            if e["name"] == name and _fields(e).get("side")
        }
        for name in _FACES
    )
    if not N:
        return None
    stiffness = next(iter(N))[0]
    mine = {side: (N[at], T[at]) for at in N if at[0] == stiffness for side in (at[1],)}
    state = str(_fields(next(iter(mine.values()))[0]).get("choice", ""))
    rows = tuple((side, f"{n['value']:.1f}", f"{t['value']:.1f}") for side, (n, t) in mine.items())
    empty = [side for side, (n, _) in mine.items() if n["value"] == 0.0]
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
    at = {(e["name"], _key(e)): e for e in results}
    several, rows = _several(found), list[tuple[str, ...]]()
    free = max(
        (
            e["value"]
            for e in results
            if _is(e, q.PEAK_ACCELERANCE) and _fields(e).get("kind") == "free"
        ),
        default=math.nan,
    )
    folds = False
    for e in sorted(found, key=lambda one: _order(one)):
        fields, number = _fields(e), quantity_of(e["name"])[1]
        height = at.get((q.PEAK_ACCELERANCE.named(number), _key(e)))
        if height is None:
            continue
        ratio, kind = fields.get("force_ratio"), fields.get("kind", "")
        case = "free" if kind == "free" else f"{ratio:g}" if ratio is not None else kind
        if several:
            case = f"{fields.get('stiffness')}, {case}"
        if fields.get("choice"):
            case += f", {fields['choice']}"
        peak = {**fields, "peak": int(number)}
        moved = [_of(results, one.name, peak) for one in (q.CONTACT_SLIP, q.CONTACT_LIFT)]
        fold = _of(results, q.SWEEP_UP_ACCELERANCE.named(number), fields)
        up = _of(results, q.SWEEP_UP_FREQUENCY.named(number), fields)
        folds |= fold is not None
        reference = e.get("reference")
        rows.append(
            (
                case,
                fields.get("mode") or ("one blade" if kind == "free" else f"peak {number}"),
                f"{e['value']:.1f}",
                _bound(e),
                _height(height["value"]),
                _bound(height),
                ""
                if kind == "free" or not math.isfinite(free)
                else f"{100.0 * (height['value'] / free - 1.0):+.0f} %",
                *("" if one is None else f"{one['value']:.0f} %" for one in moved),
                f"{reference:g}" if reference is not None else "",
                ""
                if fold is None or up is None
                else f"{_height(fold['value'])} at {up['value']:.1f}",
            )
        )
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
    if not folds:
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    lost = [e for e in every if e["value"] is None and _is(e, q.PEAK_FREQUENCY)]
    note = "Right blade; shares of all contact points and of the cycle."
    if lost:
        note += f" {len(lost)} peaks were not reached: see the notes."
    return AnswerTable("Peaks", heads, tuple(rows), note)


def _is(entry: Entry, quantity: Quantity) -> bool:
    return quantity_of(entry["name"])[0] == quantity


def _key(entry: Entry) -> tuple[Any, ...]:
    """What tells a peak apart from others."""
    fields = _fields(entry)
    return tuple(fields.get(n) for n in ("stiffness", "kind", "force_ratio", "mode", "choice"))


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
