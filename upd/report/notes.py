"""What a run warns of: one sentence for every check that did not pass, with its remedy, and for
every reason why numbers were not reached.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from upd.labels import check_words, number_label
from upd.plot.chart import Entry
from upd.results import worst_check

#: notes beside an answer; what matters less is folded, or counted
MOST_NOTES = 3


def warnings(
    checks: Iterable[Mapping[str, Any]], results: Iterable[Entry], most: int | None = None
) -> list[str]:
    """The sentences: a check in its worst case, which is named first.

    Parameters
    ----------
    checks, results
        As they stand in summary.json.
    most
        Cases and numbers that are named in each; all of them when None.
    """
    failed: dict[str, list[Mapping[str, Any]]] = {}
    for check in checks:
        if check["verdict"] != "passed":
            failed.setdefault(check["name"], []).append(check)
    lost: dict[str, list[Entry]] = {}
    for entry in results:
        if entry.get("withheld"):
            lost.setdefault(entry["withheld"], []).append(entry)
    out = []
    for name, mine in failed.items():
        worst = worst_check(mine)
        cases = _in_brackets(_listed([worst["case"], *(c["case"] for c in mine)], most))
        remedy = f". {_capital(worst['remedy'])}" if worst.get("remedy") else ""
        out.append(_capital(f"{name}{cases}: {check_words(worst)}{remedy}."))
    for reason, numbers in lost.items():
        names = _listed([number_label(entry["name"]) for entry in numbers], most)
        cases = _in_brackets(_listed([entry["case"] for entry in numbers], most))
        out.append(_capital(f"{names}{cases}: not reached, {reason}."))
    return out


def _listed(items: Iterable[str], most: int | None) -> str:
    """Items, each once."""
    found = [item for item in dict.fromkeys(items) if item]
    more = [f"and {len(found) - most} more"] if most and len(found) > most else []
    return "; ".join([*found[:most], *more])


def _in_brackets(text: str) -> str:
    return f" ({text})" if text else ""


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
