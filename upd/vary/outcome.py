"""What a point of a batch gave: its numbers, seconds and memory, or the reason it failed."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Any

from upd.results import Case, InputPart, read_input_part
from upd.vary.variation import Key, Variation


@dataclass(frozen=True)
class PointResult:
    """One number of a point.

    Attributes
    ----------
    value
        None where the number is not finite.
    error
        Relative difference from the number's reference.
    printed_error
        That of a published value.
    exact
        Whether the reference is what the number should converge to.
    withheld
        Why the number was not reached.
    estimated
        Estimated relative error.
    inputs
        What the inputs known within limits do to it.
    """

    name: str
    case: Case
    unit: str
    value: float | None
    error: float | None = None
    printed_error: float | None = None
    exact: bool = True
    withheld: str = ""
    estimated: float | None = None
    inputs: tuple[InputPart, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """The number for JSON: ``case`` in words, its attributes under ``case_fields``.

        What is not given is omitted.
        """
        given = {
            f.name: value for f in fields(self) if (value := getattr(self, f.name)) != f.default
        }
        return {
            **given,
            "case": self.case.label,
            "case_fields": self.case.given(),
            **({"inputs": [part.as_dict() for part in self.inputs]} if self.inputs else {}),
        }


@dataclass(frozen=True)
class Outcome:
    """What a point gave, or the reason it failed.

    Attributes
    ----------
    results
        All numbers of the run.
    failure
        Why it failed; "" when it did not.
    final
        Whether the same would come out again; other failures (killed, no memory) are tried again by
        the next call.
    seconds, stages
        Of the run, by its own clock: without the start of the process and its imports.
    memory_mb
        Largest resident memory during the run.
    n_dof
        Degrees of freedom of all bodies.
    warnings
        Names of the self-checks that did not pass.
    shared
        What was taken from where, see `upd.cache.shared.Store`.
    where
        "host:process".
    """

    results: tuple[PointResult, ...] = ()
    failure: str = ""
    final: bool = True
    seconds: float = 0.0
    memory_mb: float = 0.0
    stages: Mapping[str, float] = field(default_factory=dict)
    n_dof: int = 0
    warnings: tuple[str, ...] = ()
    shared: Mapping[str, int] = field(default_factory=dict)
    where: str = ""

    def text(self) -> str:
        """The outcome as JSON."""
        data = {f.name: getattr(self, f.name) for f in fields(self)}
        return json.dumps(
            data | {"results": [r.as_dict() for r in self.results]}, indent=1, allow_nan=False
        )


def read_outcome(text: str) -> Outcome:
    """The outcome in a JSON text.

    Raises
    ------
    ValueError, TypeError, KeyError
        For any other text.
    """
    data = json.loads(text)
    return Outcome(
        **(
            data
            | {
                "results": tuple(map(_read_result, data["results"])),
                "warnings": tuple(data["warnings"]),
            }
        )
    )


def _read_result(data: Mapping[str, Any]) -> PointResult:
    given = {**data}
    case = Case(**given.pop("case_fields"))
    inputs = tuple(map(read_input_part, given.get("inputs", ())))
    return PointResult(**(given | {"case": case, "inputs": inputs}))


@dataclass(frozen=True)
class SolvedPoint:
    """A point of a study and what it gave."""

    point: Variation
    outcome: Outcome

    @property
    def name(self) -> str:
        """The point with its ladder."""
        return f"{self.point.source}, {self.point.label}"

    @cached_property
    def values(self) -> dict[Key, float]:
        """Its numbers; nan where one is not finite."""
        return {(r.name, r.case): math.nan for r in self.outcome.results} | self._given("value")

    @cached_property
    def errors(self) -> dict[Key, float]:
        """Relative differences from what the numbers should converge to, where that is known."""
        exact = {(r.name, r.case) for r in self.outcome.results if r.exact}
        return {key: error for key, error in self._given("error").items() if key in exact}

    @cached_property
    def printed_errors(self) -> dict[Key, float]:
        """Those of published values."""
        return self._given("printed_error")

    @cached_property
    def estimates(self) -> dict[Key, float]:
        """Relative errors as the run estimates them."""
        return self._given("estimated")

    def _given(self, field: str) -> dict[Key, float]:
        found = ((r, getattr(r, field)) for r in self.outcome.results)
        return {(r.name, r.case): value for r, value in found if value is not None}

    def as_dict(self) -> dict[str, Any]:
        """The point for study.json."""
        named = {"values": self.values, "errors": self.errors, "thesis": self.printed_errors}
        kept = ("stages", "seconds", "memory_mb", "n_dof", "failure")
        return {
            "curve": self.point.source,
            "label": self.point.label,
            "h": self.point.size,
            **{
                kind: {f"{name}|{case.label}": v for (name, case), v in found.items()}
                for kind, found in named.items()
            },
            **{name: getattr(self.outcome, name) for name in kept},
        }


def without_failed(solved: Iterable[SolvedPoint]) -> list[SolvedPoint]:
    """The points that did not fail."""
    return [one for one in solved if not one.outcome.failure]


def matching(solved: Iterable[SolvedPoint], patterns: Iterable[str]) -> list[Key]:
    """Numbers of the points whose names match, pattern by pattern in the order of the results."""
    keys = list(dict.fromkeys(key for one in solved for key in one.values))
    return list(
        dict.fromkeys(key for pattern in patterns for key in keys if fnmatchcase(key[0], pattern))
    )
