"""What a page warns of, each fault once with all its cases, in the words of the scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from upd.labels import check_words
from upd.plot.chart import Entry
from upd.report.folder import LogLine, RunFolder
from upd.results import worst_check
from upd.results.quantities import number_label

#: records of the solvers, whose faults stand in the checks
_SOLVER = "upd.hbm"
#: records whose sender tells a reader nothing
_OURS = "upd."


def warnings(run: RunFolder) -> list[str]:
    """Sentences of a run: checks that did not pass with their remedies, numbers that were not
    reached, warnings of the log, files that could not be read.
    """
    checks = list(run.summary["checks"])
    told = [*_checks(checks), *_missing(run.summary["results"])]
    told += _logged(run.log, str(run.summary["status"]), has_checks=bool(checks))
    return list(dict.fromkeys([*told, *run.missing]))


def _checks(checks: Iterable[Mapping[str, Any]]) -> list[str]:
    """One sentence per name and remedy; in it, what the check says once with all its cases."""
    groups: dict[tuple[str, str], dict[str, list[Mapping[str, Any]]]] = {}
    for c in checks:
        if c["verdict"] != "passed":
            mine = groups.setdefault((c["name"], str(c.get("remedy") or "")), {})
            mine.setdefault(f"{c['says']}{c['limit']}", []).append(c)
    out = []
    for (name, remedy), parts in groups.items():
        said = [_part(mine) for mine in parts.values()]
        if len(said) == 1:
            words, cases = said[0]
            text = f"{name}{_in_brackets(cases)}: {words}"
        else:
            text = f"{name}: " + "; ".join(f"{words}{_in_brackets(cases)}" for words, cases in said)
        out.append(f"{text}. {_sentence(remedy)}".strip())
    return out


def _part(checks: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """What checks that say the same say in the worst case, and their cases, the worst first."""
    words = check_words(worst_check(checks))
    here = [c["case"] for c in checks if check_words(c) == words]
    others = [c["case"] for c in checks if check_words(c) != words]
    cases = "; ".join(dict.fromkeys(case for case in here if case))
    more = "; ".join(dict.fromkeys(case for case in others if case))
    return words, f"{cases}; less in {more}" if cases and more else cases or more


def _missing(results: Iterable[Entry]) -> list[str]:
    """Numbers that were not reached: one sentence per case and reason."""
    groups: dict[tuple[str, str], list[str]] = {}
    for r in results:
        if r.get("withheld"):
            groups.setdefault((r["case"], r["withheld"]), []).append(number_label(r["name"]))
    out = []
    for (case, reason), found in groups.items():
        names = list(dict.fromkeys(found))
        listed = ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else names[0]
        was = "was" if len(names) == 1 else "were"
        out.append(f"{listed}{_in_brackets(case)} {was} not reached: {reason}.")
    return out


def _logged(log: Iterable[LogLine], status: str, *, has_checks: bool) -> list[str]:
    """Warnings of the log that stand nowhere else."""
    # How the run failed stands in the verdict already.
    told = [
        line
        for line in log
        if line.level in ("WARNING", "ERROR", "CRITICAL")
        and line.text != status
        and not (has_checks and line.where.startswith(_SOLVER))
    ]
    return [
        _capital(line.text) if line.where.startswith(_OURS) else f"{line.where}: {line.text}"
        for line in told
    ]


def _in_brackets(cases: str) -> str:
    return f" ({cases})" if cases else ""


def _sentence(text: str) -> str:
    return f"{_capital(text)}." if text else ""


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
