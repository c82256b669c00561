"""What a point of a batch gave: its numbers, seconds and memory, or the reason it failed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Any

from upd.cache.files import json_text
from upd.results.number import Result, read_result
from upd.vary.variation import Key, Variation


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
        What was taken from where, see `upd.cache.arrays.Store`.
    where
        "host:process".
    """

    results: tuple[Result, ...] = ()
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
        results = [one.as_dict() | {"exact": one.exact} for one in self.results]
        return json_text(
            {f.name: getattr(self, f.name) for f in fields(self)} | {"results": results}
        )


def read_outcome(text: str) -> Outcome:
    """The outcome in a JSON text.

    Raises
    ------
    ValueError, TypeError, KeyError
        For any other text.
    """
    data = json.loads(text)
    results = tuple(map(read_result, data["results"]))
    return Outcome(**data | {"results": results, "warnings": tuple(data["warnings"])})


@dataclass(frozen=True)
class SolvedPoint:
    """A point of a study and what it gave."""

    point: Variation
    outcome: Outcome

    @cached_property
    def values(self) -> dict[Key, float]:
        """Its numbers; nan where one was not reached."""
        return self._given("value")

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
        return self._given("estimated_error")

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
