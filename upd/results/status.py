"""How a run ended, and what it warns of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from upd.labels import number_label
from upd.results.check import Check
from upd.results.number import Result

OK, WARNED, FAILED = "ok", "ok with warnings", "failed"


def status_of(checks: Sequence[Check], results: Sequence[Result]) -> str:
    """How a run that was solved ended.

    Returns
    -------
    str
        "ok": every check passed and every number was reached. "ok with warnings: ..." names what
        warns and the numbers withheld. "failed: ..." when a fatal check failed, or when no number
        was reached.
    """
    fatal = [c for c in checks if not c.passed and c.fatal]
    if fatal:
        return f"{FAILED}: " + "; ".join(c.sentence for c in fatal)
    missing = [r for r in results if r.withheld]
    if missing and len(missing) == len(results):
        return f"{FAILED}: no number was reached; {missing[0].withheld}"
    told = warnings_of(checks, results)
    return f"{WARNED}: " + "; ".join(told) if told else OK


def with_fault(status: str, fault: str) -> str:
    """A status that also tells what went wrong with the pictures of a run."""
    return f"{WARNED}: {fault}" if status == OK else f"{status}; {fault}"


def warned(
    checks: Sequence[Check], results: Sequence[Result]
) -> dict[str, tuple[list[Check] | list[Result], list[str]]]:
    """What did not pass and what was not reached: name -> the checks or numbers, their cases."""
    found: dict[str, list[Any]] = {}
    for check in checks:
        if not check.passed:
            found.setdefault(check.name, []).append(check)
    for one in results:
        if one.withheld:
            found.setdefault(f"{number_label(one.name)} not reached", []).append(one)
    return {
        name: (mine, list(dict.fromkeys(one.case.label for one in mine)))
        for name, mine in found.items()
    }


def warnings_of(checks: Sequence[Check], results: Sequence[Result]) -> list[str]:
    """What did not pass and what was not reached, one sentence per name with its cases."""
    return [_named(name, labels) for name, (_, labels) in warned(checks, results).items()]


def _named(name: str, labels: Sequence[str]) -> str:
    """A name with its cases."""
    return name + (f" ({_some(labels)})" if any(labels) else "")


def _some(labels: Sequence[str], most: int = 2) -> str:
    """The first labels, and how many more there are."""
    shown = "; ".join(label for label in labels[:most] if label)
    return shown + (f"; and {len(labels) - most} more" if len(labels) > most else "")


def outcome_of(status: str) -> str:
    """ "ok", "ok with warnings" or "failed" (a run that was stopped failed) of a run's status."""
    word = status.partition(":")[0]
    return word if word in (OK, WARNED) else FAILED
