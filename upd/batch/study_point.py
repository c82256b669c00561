"""A point of a study: what it changes in the scene, and what came out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Any

from upd.batch.point import Outcome, PointResult, Task
from upd.results import Case
from upd.scene import AnyScene
from upd.scene.quantities import UNKNOWN

#: path -> value pairs that a point sets in the scene
Settings = tuple[tuple[str, Any], ...]
#: name of a number and the case it belongs to
Key = tuple[str, Case]


@dataclass(frozen=True)
class StudyPoint:
    """One run of a study.

    Attributes
    ----------
    curve
        Name of the ladder the point belongs to.
    label
        The point in words.
    settings
        What it sets in the scene.
    h
        Size that goes to zero along a ladder: the node spacing in the patch in mm, one over a
        refinement or a number of levels.
    estimates
        Whether the point estimates its own errors. Others leave that out: the seconds are those of
        the level alone.
    """

    curve: str
    label: str
    settings: Settings
    h: float = 1.0
    estimates: bool = False

    def task(self, scene: AnyScene, threads: int, code: str) -> Task:
        """The point for a worker. It shares nothing with others: its seconds and memory count."""
        settings = ({} if self.estimates else {"accuracy": UNKNOWN}) | dict(self.settings)
        return Task(scene.text, settings, threads, recipe=scene.recipe, code=code, alone=True)


@dataclass(frozen=True)
class SolvedPoint:
    """A point of a study and what it gave."""

    point: StudyPoint
    outcome: Outcome

    @property
    def name(self) -> str:
        """The point with its ladder."""
        return f"{self.point.curve}, {self.point.label}"

    @cached_property
    def values(self) -> dict[Key, float]:
        """Its numbers; nan where one is not finite."""
        return {_key(r): float("nan") if r.value is None else r.value for r in self.outcome.results}

    @cached_property
    def errors(self) -> dict[Key, float]:
        """Relative differences from what the numbers should converge to, where that is known."""
        return {_key(r): r.error for r in self.outcome.results if r.error is not None and r.exact}

    @cached_property
    def printed_errors(self) -> dict[Key, float]:
        """Those of published values."""
        return {
            _key(r): r.printed_error for r in self.outcome.results if r.printed_error is not None
        }

    @cached_property
    def estimates(self) -> dict[Key, float]:
        """Relative errors as the run estimates them."""
        return {_key(r): r.estimated for r in self.outcome.results if r.estimated is not None}

    def as_dict(self) -> dict[str, Any]:
        """The point as it stands in study.json."""
        named = {"values": self.values, "errors": self.errors, "thesis": self.printed_errors}
        o = self.outcome
        return {
            "curve": self.point.curve,
            "label": self.point.label,
            "h": self.point.h,
            **{
                kind: {f"{name}|{case.label}": v for (name, case), v in found.items()}
                for kind, found in named.items()
            },
            "stages": dict(o.stages),
            "seconds": o.seconds,
            "memory_mb": o.memory_mb,
            "n_dof": o.n_dof,
            "failure": o.failure,
        }


def _key(result: PointResult) -> Key:
    return result.name, result.case


def solved_alone(solved: Iterable[SolvedPoint]) -> list[SolvedPoint]:
    """The points that did not fail."""
    return [one for one in solved if not one.outcome.failure]


def matching(solved: Iterable[SolvedPoint], patterns: Iterable[str]) -> list[Key]:
    """Numbers of the points whose names match, pattern by pattern in the order of the results."""
    keys = list(dict.fromkeys(key for one in solved for key in one.values))
    return list(
        dict.fromkeys(key for pattern in patterns for key in keys if fnmatchcase(key[0], pattern))
    )
