"""How a run ends: by its checks and by the numbers it did not reach, one rule for all analyses."""

import json
from dataclasses import replace

import pytest

from upd.analyses.base import Resolved
from upd.results import NO_CASE, Case, Check, Result
from upd.results.check import outcome_of, status_of
from upd.results.quantities import PEAK_FREQUENCY
from upd.scene.base import LeftOut

GOOD = Check("balance", NO_CASE, 0.0, 1e-9, "misfit", "report this")
WARNS = replace(GOOD, name="truncation", case=Case(force_ratio=194.0), value=1.0, fatal=False)
FATAL = replace(GOOD, value=1.0)
NUMBER = Result("peak_1_frequency", Case(force_ratio=600.0), 400.0, "Hz")
MISSING = PEAK_FREQUENCY.withheld(Case(force_ratio=194.0), "the path stopped at 330 Hz", n=2)


@pytest.mark.parametrize(
    ("checks", "results", "status", "outcome"),
    [
        ([GOOD], [NUMBER], "ok", "ok"),
        (
            [GOOD, WARNS, WARNS],
            [NUMBER],
            "ok with warnings: truncation (F_C/F_E 194)",
            "ok with warnings",
        ),
        (
            [GOOD],
            [NUMBER, MISSING],
            "ok with warnings: peak 2, frequency not reached (F_C/F_E 194)",
            "ok with warnings",
        ),
        (
            [GOOD, WARNS, FATAL],
            [NUMBER, MISSING],
            "failed: balance: misfit = 1 (limit 1e-09); report this",
            "failed",
        ),
        (
            [GOOD],
            [MISSING],
            "failed: no number was reached; the path stopped at 330 Hz",
            "failed",
        ),
        ([replace(WARNS, value=float("nan"))], [NUMBER], None, "ok with warnings"),
    ],
)
def test_status(
    checks: list[Check], results: list[Result], status: str | None, outcome: str
) -> None:
    told = status_of(checks, results)
    assert status in (None, told)
    assert outcome_of(told) == outcome


def test_stopped_run_failed() -> None:
    assert outcome_of("stopped: KeyboardInterrupt") == "failed"


def test_many_cases_are_counted() -> None:
    many = [replace(WARNS, case=Case(force_ratio=float(k))) for k in range(5)]
    told = "ok with warnings: truncation (F_C/F_E 0; F_C/F_E 1; and 3 more)"
    assert status_of(many, []) == told


def test_what_was_not_found_is_no_nan_in_the_file() -> None:
    solved = Resolved("faces", "peak_1_frequency", NO_CASE, 400.0, float("nan"), "Hz")
    check = solved.check(LeftOut())
    assert check.verdict == "warning"
    data = json.loads(json.dumps([check.as_dict(), MISSING.as_dict()], allow_nan=False))
    assert (data[0]["value"], data[0]["included"], data[1]["value"]) == (None, None, None)
    assert "a value not found" in check.says
    assert MISSING.error is None
