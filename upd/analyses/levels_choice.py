"""The cheapest combination of levels over several sources of error that reaches a wanted accuracy.

A run has sources of error, each with levels from cheap to dear. What a source leaves on another
level is predicted from what it leaves on the present one; the errors of all sources add. Rounds of
solving and predicting only ever raise levels, so they end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from itertools import product

import numpy as np

from upd.errors import InputError
from upd.results import Case, ErrorPart, Result

Key = tuple[str, Case]
#: level of every knob, 0 the cheapest
Levels = tuple[int, ...]
#: the fastest that an error is seen to fall, as a power of what was expected of it; and the slowest
#: when it does so once, which may show as much of the two estimates as of the error
_FASTEST, _SLOWEST_ONCE = 1.5, 0.5


@dataclass(frozen=True)
class Knob:
    """What sets the level of one or more sources of error.

    Attributes
    ----------
    sources
        Of the errors it lowers, as `upd.results.ErrorPart` names them.
    name
        In words, with what it sets: "modes kept (reduction.modes)".
    labels
        Of its levels, cheap to dear.
    falls
        Expected error of each level over that of the first, falling from 1: what the method
        reaches where all goes well, so that no level is given up that might do.
    """

    sources: tuple[str, ...]
    name: str
    labels: tuple[str, ...]
    falls: tuple[float, ...]

    def __post_init__(self) -> None:
        assert len(self.labels) == len(self.falls)


@dataclass(frozen=True)
class Round:
    """One round: the levels, and for every wanted number the error of every source over the
    accuracy that is wanted of the number; NaN where it was not found. Wanted numbers that the round
    withholds, and why.
    """

    levels: Levels
    shares: Mapping[Key, Mapping[str, float]]
    withheld: Mapping[Key, str] = field(default_factory=dict)

    @property
    def miss(self) -> tuple[float, Key | None]:
        """The largest sum of a number over its accuracy, and the number."""
        sums = {key: math.fsum(parts.values()) for key, parts in self.shares.items()}
        if not sums:
            return math.inf, None
        worst = max(sums, key=lambda key: sums[key] if math.isfinite(sums[key]) else math.inf)
        return (sums[worst] if math.isfinite(sums[worst]) else math.inf), worst

    def without(self, keys: Collection[Key]) -> Round:
        """The round without some of its numbers."""
        left = {k: v for k, v in self.shares.items() if k not in keys}
        return Round(self.levels, left, self.withheld)


def shares_of(
    estimates: Mapping[Key, Sequence[ErrorPart]], wanted: Mapping[str, float]
) -> dict[Key, dict[str, float]]:
    """Errors of the wanted numbers by source, over what is wanted of them.

    Parameters
    ----------
    estimates
        Parts of the errors of a run's numbers.
    wanted
        Name of a number, as a shell pattern -> largest relative error; of several patterns the
        first counts.
    """
    out: dict[Key, dict[str, float]] = {}
    for key, parts in estimates.items():
        target = next((w for name, w in wanted.items() if fnmatchcase(key[0], name)), None)
        if target is not None and parts:
            mine: dict[str, float] = {}
            for part in parts:
                mine[part.source] = mine.get(part.source, 0.0) + part.error / target
            out[key] = mine
    return out


def withheld_of(results: Iterable[Result], wanted: Collection[str]) -> dict[Key, str]:
    """Numbers with a wanted name (shell patterns) that a run withholds -> each and why."""
    return {
        (one.name, one.case): f"{one.name} {one.case.label}: {one.withheld}"
        for one in results
        if one.withheld and any(fnmatchcase(one.name, name) for name in wanted)
    }


def require_named(wanted: Collection[str], results: Iterable[Result]) -> None:
    """Raise InputError for names (shell patterns) that no number of the run has."""
    names = list(dict.fromkeys(r.name for r in results))
    missing = [n for n in wanted if not any(fnmatchcase(name, n) for name in names)]
    if missing:
        raise InputError(
            f"accuracy: {', '.join(missing)}: this run has no number of that name; it has "
            f"{', '.join(names)}"
        )


@dataclass
class LevelForecast:
    """What the levels are expected to leave, learnt round by round.

    Attributes
    ----------
    knobs
        Of the run.
    powers
        Knob -> power of its expected fall that the rounds have shown; 1 before.
    """

    knobs: Sequence[Knob]
    powers: dict[int, float] = field(default_factory=dict)
    _slow: set[int] = field(default_factory=set)
    _tried: set[int] = field(default_factory=set)

    def learn(self, before: Round, after: Round) -> None:
        """Take from two rounds how fast the errors of the knobs raised between them fall."""
        for k, knob in enumerate(self.knobs):
            a, b = before.levels[k], after.levels[k]
            if a == b:
                continue
            changes = []
            for key in before.shares.keys() & after.shares.keys():
                first, last = (_of(r.shares[key], knob) for r in (before, after))
                if first > 0.0 and last > 0.0:
                    changes.append((max(first, last), math.log(last / first)))
            if changes:
                # the number that it matters most to
                _, change = max(changes)
                power = change / math.log(knob.falls[b] / knob.falls[a])
                least = 0.0 if k in self._slow else _SLOWEST_ONCE
                self.powers[k] = min(max(power, least), _FASTEST)
                if power < _SLOWEST_ONCE:
                    self._slow.add(k)

    def _falls(self, now: Round, levels: Levels) -> dict[str, float]:
        """Source -> expected error on other levels over that on the present ones."""
        return {
            source: (knob.falls[new] / knob.falls[old]) ** self.powers.get(k, 1.0)
            for k, (knob, old, new) in enumerate(zip(self.knobs, now.levels, levels, strict=True))
            for source in knob.sources
        }

    def shares(self, now: Round, levels: Levels) -> dict[Key, float]:
        """Sum of every number's errors over its accuracy, on other levels."""
        factor = self._falls(now, levels)
        return {
            key: math.fsum(error * factor.get(source, 1.0) for source, error in parts.items())
            for key, parts in now.shares.items()
        }

    def reaches(self, now: Round, levels: Levels) -> bool:
        """Whether all numbers are expected to be reached."""
        found = self.shares(now, levels).values()
        return all(total <= 1.0 for total in found)

    def cheapest(self, now: Round, seconds: Callable[[Levels], float]) -> Levels | None:
        """The cheapest levels, none below the present ones, that are expected to reach all.

        Parameters
        ----------
        now
            The last round.
        seconds
            Levels -> predicted seconds, which rise with every level; inf where the machine cannot.

        Returns
        -------
        tuple of int or None
            None where no levels reach all.
        """
        ranges = [
            range(at, len(knob.labels)) for at, knob in zip(now.levels, self.knobs, strict=True)
        ]
        good = [levels for levels in product(*ranges) if self.reaches(now, levels)]
        priced = {levels: seconds(levels) for levels in _lowest(good)}
        best = min(priced, key=lambda one: priced[one], default=None)
        return best if best is not None and math.isfinite(priced[best]) else None

    def alike(self, now: Round) -> Levels | None:
        """The lowest levels, the same number for all knobs, that reach all."""
        most = max(len(knob.labels) for knob in self.knobs)
        for k in range(most):
            levels = tuple(min(k, len(knob.labels) - 1) for knob in self.knobs)
            if self.reaches(now, levels):
                return levels
        return None

    def obstacle(self, now: Round) -> str:
        """What keeps the number farthest from its accuracy there, in words."""
        top = tuple(len(knob.labels) - 1 for knob in self.knobs)
        left = self.shares(now, top)
        worst = max(left, key=lambda key: left[key] if math.isfinite(left[key]) else math.inf)
        parts = now.shares[worst]
        lost = [source for source, error in parts.items() if not math.isfinite(error)]
        name = f"{worst[0]} {worst[1].label}".rstrip()
        if lost:
            return f"{name}: no estimate of what {', '.join(lost)} leave"
        return f"{name}: most of it by {self._largest(now, worst)}"

    def _largest(self, now: Round, key: Key) -> str:
        """The source expected to leave most of a number on the highest levels."""
        factor = self._falls(now, tuple(len(knob.labels) - 1 for knob in self.knobs))
        parts = now.shares[key]
        return max(parts, key=lambda one: parts[one] * factor.get(one, 1.0))

    def one_more(
        self, now: Round, lost: Iterable[Key], levels: Levels, seconds: Callable[[Levels], float]
    ) -> Levels | None:
        """One level more of what keeps numbers out of reach, where that has not fallen as expected.

        Estimates of errors without an order rise and fall from level to level, so that two of them
        do not tell the next: each knob is raised by one once, before its numbers are given up.

        Parameters
        ----------
        now
            The last round.
        lost
            Numbers that no levels are expected to reach.
        levels
            Those to go on with for the others.
        seconds
            As of `cheapest`.

        Returns
        -------
        tuple of int or None
            None where there is nothing left to try.
        """
        tried = list(levels)
        for key in lost:
            if not all(map(math.isfinite, now.shares[key].values())):
                continue
            source = self._largest(now, key)
            for k, knob in enumerate(self.knobs):
                more = now.levels[k] + 1
                if source not in knob.sources or k in self._tried:
                    continue
                if self.powers.get(k, 1.0) >= 1.0:
                    continue
                one = (*tried[:k], max(tried[k], more), *tried[k + 1 :])
                if more < len(knob.labels) and math.isfinite(seconds(one)):
                    tried = list(one)
                    self._tried.add(k)
        return tuple(tried) if tuple(tried) != tuple(levels) else None


def _of(parts: Mapping[str, float], knob: Knob) -> float:
    found = [parts[source] for source in knob.sources if source in parts]
    return math.fsum(found) if found else math.nan


def _lowest(levels: Iterable[Levels]) -> Iterator[Levels]:
    """Those of a set of levels of which no other lies below: the cheapest is one of them."""
    left = np.array(sorted(levels, key=sum))
    while len(left):
        first = left[0]
        yield tuple(int(n) for n in first)
        left = left[np.any(left < first, axis=1)]
