"""A self-check of a run, and the worst of several."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from upd.labels import check_words, listed
from upd.results.case import Case
from upd.results.number import Result, as_json, from_json
from upd.results.quantities import number_label

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
    found = [(c.name, c.case.label) for c in checks if not c.passed]
    found += [(f"{number_label(r.name)} not reached", r.case.label) for r in missing]
    cases = {name: [case for one, case in found if one == name] for name, _ in found}
    warnings = [name + listed(mine, 2, " ({})") for name, mine in cases.items()]
    return f"{WARNED}: {'; '.join(warnings)}" if warnings else OK


def outcome_of(status: str) -> str:
    """ "ok", "ok with warnings" or "failed" (a run that was stopped failed) of a run's status."""
    word = status.partition(":")[0]
    return word if word in (OK, WARNED) else FAILED


@dataclass(frozen=True)
class Check:
    """A self-check: passed when ``value <= limit``; a value that is not a number does not pass.

    ``fatal`` checks that fail end the run with ``remedy``; others warn.

    Attributes
    ----------
    quantity
        Of an effect left out: the name of the result that was solved again with the effect, of the
        same case.
    without, included
        That result without the effect and with it, at the level of the second solve.
    """

    name: str
    case: Case
    value: float
    limit: float
    says: str
    remedy: str = ""
    fatal: bool = True
    quantity: str = ""
    without: float | None = None
    included: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        return bool(self.value <= self.limit)

    @property
    def verdict(self) -> str:
        """passed, warning or failed."""
        return "passed" if self.passed else ("failed" if self.fatal else "warning")

    def as_dict(self) -> dict[str, Any]:
        """The check as it stands in summary.json."""
        given = self.case.given()
        return as_json(self, case=self.case.label, verdict=self.verdict, case_fields=given)

    @property
    def sentence(self) -> str:
        """Name, case, value and limit, and the remedy."""
        case = f" ({self.case.label})" if self.case.label else ""
        return f"{self.name}{case}: {check_words(self.as_dict())}; {self.remedy}"


def read_check(data: Mapping[str, Any]) -> Check:
    """The check that `Check.as_dict` wrote."""
    return from_json(Check, data, case=from_json(Case, data["case_fields"]))


_RANK = {"passed": 0, "warning": 1, "failed": 2}


def worst_check(checks: Iterable[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The worst of ``checks`` of one name, as they stand in summary.json.

    By verdict, then by value.
    """

    def badness(check: Mapping[str, Any]) -> tuple[int, float]:
        value = check["value"]
        return _RANK.get(check["verdict"], 2), math.inf if value is None else float(value)

    return max(checks, key=badness)


def worst_checks(checks: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """One check per name, in the order of the names: the worst of its cases."""
    names = dict.fromkeys(check["name"] for check in checks)
    return [worst_check(check for check in checks if check["name"] == name) for name in names]
