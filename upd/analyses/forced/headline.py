"""Which numbers of a forced response stand first."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from fnmatch import fnmatchcase
from typing import Any

from upd.plot.chart import Entry

#: the numbers that matter, most important first (shell patterns): terminal, page, notebook, tables
#: of sweeps and studies
HEADLINE = (
    "peak_?_frequency",
    "peak_?_accelerance",
    "reduction_of_free_peak",
    "friction_energy",
    "optimum_ratio",
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


def headline(results: Sequence[Entry]) -> list[Entry]:
    """Peaks free and of the curve of the lowest F_C/F_E on which something slips, its reduction and
    loss, the optimum, the stuck frequencies, the static forces of both faces.
    """
    slipping = {
        _curve_of(one) for one in results if one["name"] == "share_slip" and (one["value"] or 0) > 0
    }
    first: dict[tuple[str, str, str], Entry] = {}
    # those of a curve on which all sticks stand behind
    for entry in sorted(results, key=lambda one: _stands_behind(one, slipping)):
        kind = entry.get("case_fields", {}).get("kind", "")
        side = entry["case"].rpartition(", ")[2] if entry["name"] in _FACES else ""
        # The peaks of the stuck curve are the stuck frequencies.
        if kind != "stuck":
            first.setdefault((entry["name"], kind, side), entry)
    ranked = [
        (rank, key)
        for key in first
        for rank, one in enumerate(HEADLINE)
        if fnmatchcase(key[0], one)
    ]
    return [
        first[key] for _, key in sorted(ranked, key=lambda pair: (pair[1][1] != "free", pair[0]))
    ]


def _curve_of(entry: Entry) -> tuple[Any, Any]:
    """Stiffness and F_C/F_E of a number; F_C/F_E is None for what belongs to no curve."""
    fields = entry.get("case_fields", {})
    return fields.get("stiffness"), fields.get("force_ratio")


def _stands_behind(entry: Entry, slipping: Collection[tuple[Any, Any]]) -> tuple[bool, float]:
    curve = _curve_of(entry)
    if curve[1] is None:
        return False, 0.0
    return curve not in slipping, float(curve[1])
