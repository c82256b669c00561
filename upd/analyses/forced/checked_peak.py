"""The peak that checks of a response solve again: where most slips."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import Protocol

from upd.analyses.base import Resolved
from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.solution import ForcedSolution


class FoundPeak(Protocol):
    """A peak that was looked for: Hz, (m/s2)/N."""

    @property
    def frequency(self) -> float:
        """Hz."""

    @property
    def height(self) -> float:
        """(m/s2)/N."""

    @property
    def found(self) -> bool:
        """Whether it was."""


def highest_peaks(
    solution: ForcedSolution, names: Collection[str] | None = None
) -> Iterator[tuple[ForcedCurve, ModePeak]]:
    """Curves that have a peak, the lowest F_C/F_E first, each with its highest.

    Parameters
    ----------
    solution
        With its curves.
    names
        Of the contact stiffnesses; all when None.
    """
    for curve in sorted(solution.curves, key=lambda c: (c.ratio, c.stopped)):
        if names is None or curve.stiffness in names:
            found = solution.numbered_peaks(curve)
            if found:
                yield curve, max(found, key=lambda one: one.height)


def peak_changes(
    check: str,
    curve: ForcedCurve,
    peak: ModePeak,
    base: FoundPeak,
    again: FoundPeak,
    remedy: str,
    note: str = "",
    lost: str = "",
) -> list[Resolved]:
    """What a check shows of a peak: changes of its height and of its frequency.

    Parameters
    ----------
    check
        Its name.
    curve, peak
        The peak of the run.
    base, again
        The peak as the check finds it, unchanged and changed.
    remedy, note
        Of the check.
    lost
        Why it was not found again.
    """
    case, name = replace(curve.case, mode=peak.mode), f"peak_{peak.number}"
    if not again.found:
        remedy = f"{remedy}; the peak was not found again" + (f" ({lost})" if lost else "")
    return [
        Resolved(check, f"{name}_{kind}", case, before, after, unit, remedy, note)
        for kind, unit, before, after in (
            ("accelerance", "(m/s2)/N", base.height, again.height),
            ("frequency", "Hz", base.frequency, again.frequency),
        )
    ]
