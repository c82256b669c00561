"""What warns, one sentence each: what it does to the numbers in the worst case, and the remedy."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from upd.labels import check_words
from upd.plot.chart import Entry
from upd.results import worst_checks
from upd.results.quantities import number_label

#: notes that stand beside an answer; what matters less is told elsewhere
MOST_NOTES = 3


def short_notes(checks: Iterable[Mapping[str, Any]], results: Iterable[Entry]) -> list[str]:
    """One sentence for every name of the checks that did not pass, in its worst case, and for every
    reason why numbers were not reached.

    Parameters
    ----------
    checks, results
        As they stand in summary.json.
    """
    told = []
    for check in worst_checks(c for c in checks if c["verdict"] != "passed"):
        remedy = f"; {check['remedy']}" if check["remedy"] else ""
        told.append(f"{check['name']}{_of(check['case'])}: {check_words(check)}{remedy}")
    lost: dict[str, list[Entry]] = {}
    for entry in results:
        if entry.get("withheld"):
            lost.setdefault(entry["withheld"], []).append(entry)
    for reason, mine in lost.items():
        more = f" and {len(mine) - 1} more" if len(mine) > 1 else ""
        first = f"{number_label(mine[0]['name'])}{_of(mine[0]['case'])}"
        told.append(f"{first}{more} not reached: {reason}")
    return [_sentence(one) for one in told]


def _of(case: str) -> str:
    return f" ({case})" if case else ""


def _sentence(text: str) -> str:
    """One sentence of several: a symbol that begins one keeps its letters."""
    joined = re.sub(r"\. ([A-Z])(?=[a-z]|\s)", lambda found: f"; {found[1].lower()}", text)
    return f"{joined[:1].upper()}{joined[1:].rstrip('.')}."
