"""Peaks of a forced response on every level of a ladder, whatever the name of its contact."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from upd.analyses.forced.whole_faces import INTERFACE
from upd.batch.curves import ConvergenceCurve
from upd.batch.ladder import SolvedPoint
from upd.batch.point import PointResult

#: curve of the levels on springs
SPRINGS = "springs"
#: numbers of a peak and their unit
KINDS = {"frequency": "Hz", "accelerance": "(m/s2)/N"}
_PEAK = re.compile(rf"peak_(\d+)_({'|'.join(KINDS)})")


@dataclass(frozen=True)
class LevelNumber:
    """Frequency or height of a peak on one level.

    Attributes
    ----------
    mode
        How the blades move there.
    ends
        Least and largest value, the same where it is unique; None where it was not reached.
    why
        Why it is a range, or not reached.
    """

    mode: str
    ends: tuple[float, float] | None
    why: str

    def text(self, digits: int) -> str:
        """The number, both ends, or that one of the sweeps does not have it."""
        if self.ends is None:
            return "not reached"
        low, high = (f"{value:.{digits}g}" for value in self.ends)
        if self.ends[0] != self.ends[1]:
            return f"{low} to {high}"
        return f"{low} or none" if self.why else low

    def change(self, from_: LevelNumber) -> float | None:
        """Relative difference of the end that is farther off; None where one has none."""
        if self.ends is None or from_.ends is None:
            return None
        pairs = zip(self.ends, from_.ends, strict=True)
        return max((mine / other - 1.0 for mine, other in pairs), key=abs)


def finest(solved: Sequence[SolvedPoint]) -> SolvedPoint | None:
    """The finest mesh of both faces that was solved."""
    good = [p for p in solved if p.point.curve == INTERFACE and not p.outcome.failure]
    return min(good, key=lambda p: p.point.h, default=None)


def peak_numbers(one: SolvedPoint) -> dict[tuple[int, str], LevelNumber]:
    """(number of the peak, "frequency" or "accelerance") -> what the level says of it.

    Peaks are numbered by the mode in which the blades move, so that numbers of levels whose
    contacts have other names belong together.
    """
    out: dict[tuple[int, str], LevelNumber] = {}
    for result in one.outcome.results:
        named = _PEAK.fullmatch(result.name)
        # curves of linear limits have no F_C/F_E
        if named is None or result.case.force_ratio is None:
            continue
        key, told = (int(named[1]), named[2]), _level_number(result)
        # what one path did not reach the one from the other end may have
        if key not in out or (out[key].ends is None and told.ends is not None):
            out[key] = told
    return out


def _level_number(result: PointResult) -> LevelNumber:
    mode = result.case.mode
    if result.value is None:
        return LevelNumber(mode, None, result.withheld)
    if result.low is None or result.high is None:
        return LevelNumber(mode, (result.value, result.value), "")
    return LevelNumber(mode, (result.low, result.high), result.why)


def ladder_curves(solved: Sequence[SolvedPoint]) -> list[ConvergenceCurve]:
    """Change of every peak's numbers from the finest mesh over the seconds of a level.

    Each stiffness of the springs is a curve of one level.
    """
    fine = finest(solved)
    if fine is None:
        return []
    wanted, curves = peak_numbers(fine), []
    ladders: dict[str, list[SolvedPoint]] = {}
    for p in (p for p in solved if not p.outcome.failure):
        ladders.setdefault(level_name(p) if p.point.curve == SPRINGS else INTERFACE, []).append(p)
    for key, reference in wanted.items():
        for name, mine in ladders.items():
            told = [(p, n.change(reference)) for p in mine if (n := peak_numbers(p).get(key))]
            changes = [(p, change) for p, change in told if change is not None]
            if changes and reference.ends is not None:
                curves.append(_curve(name, key, reference, changes, level_name(fine)))
    return curves


def _curve(
    name: str,
    key: tuple[int, str],
    reference: LevelNumber,
    changes: Sequence[tuple[SolvedPoint, float]],
    fine: str,
) -> ConvergenceCurve:
    points = [p for p, _ in changes]
    assert reference.ends is not None
    return ConvergenceCurve(
        curve=name,
        name=f"peak_{key[0]}_{key[1]}",
        case=reference.mode,
        labels=tuple(p.point.label for p in points),
        h=tuple(p.point.h for p in points),
        error=tuple(change for _, change in changes),
        seconds=tuple(p.outcome.seconds for p in points),
        memory_mb=tuple(p.outcome.memory_mb for p in points),
        reference=reference.ends[1],
        against=fine,
    )


def level_name(one: SolvedPoint) -> str:
    """A level in words: its model, and its stiffness or mesh."""
    return f"{one.point.curve}, {one.point.label}"
