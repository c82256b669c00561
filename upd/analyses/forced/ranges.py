"""Peaks that are no single number: what the sweeps and the balance tell of each.

A peak is one number where the sweeps up and down agree on it, and is the balance's where that
agrees with them. Elsewhere it is a range: between its frequencies and heights on both sweeps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from upd.analyses.forced.curves import SweptCurve, Way
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.solution import ForcedSolution
from upd.scene.forced_contact import Side

#: differences of height and of frequency up to which two peaks are one: a few times those of the
#: steps of a sweep and of the tolerance to which it settles
HEIGHT, FREQUENCY = 1e-2, 1e-3
#: of a curve that was not marched
NO_RANGES: Mapping[int, PeakRange] = MappingProxyType({})


@dataclass(frozen=True)
class PeakRange:
    """A peak as the sweeps tell it.

    Attributes
    ----------
    number, mode
        Of the peak.
    found
        The peak of every sweep that has it, the highest first.
    single
        Whether they are one.
    balance
        What the balance says of it, None where it has none.
    agrees
        Whether the balance's is one with them.
    why
        Why it is a range, or whose number it is; "" where all agree.
    """

    number: int
    mode: str
    found: tuple[ModePeak, ...]
    single: bool
    balance: ModePeak | None
    agrees: bool
    why: str

    def ends(self, kind: str) -> tuple[float, float]:
        """Least and largest frequency in Hz, or height in (m/s2)/N, of the sweeps."""
        values = [getattr(one, kind) for one in self.found]
        return min(values), max(values)


def peak_ranges(
    solution: ForcedSolution, name: str, ratio: float, blade: Side = "right"
) -> dict[int, PeakRange]:
    """Peaks of the sweeps of one stiffness and F_C/F_E by their numbers."""
    sweeps = sweeps_of(solution, name, ratio)
    balance = {
        one.number: one
        for curve in solution.paths
        if (curve.stiffness, curve.ratio) == (name, ratio)
        for one in solution.numbered_peaks(curve, blade)
    }
    numbers = sorted({one.number for s in sweeps for one in s.peaks[blade]})
    return {k: _range(k, sweeps, balance.get(k), blade) for k in numbers}


def sweeps_of(solution: ForcedSolution, name: str, ratio: float) -> list[SweptCurve]:
    """Sweeps of one stiffness and F_C/F_E from the run's own static state."""
    return [s for s in solution.sweeps if (s.stiffness, s.ratio, s.choice) == (name, ratio, "")]


def alike(a: ModePeak, b: ModePeak) -> bool:
    """Whether two peaks are one."""
    near = abs(a.frequency / b.frequency - 1.0) <= FREQUENCY
    return near and alike_heights([a.height, b.height])


def alike_heights(heights: Sequence[float]) -> bool:
    """Whether heights are those of one peak."""
    return max(heights) <= (1.0 + HEIGHT) * min(heights)


def _range(
    number: int, sweeps: list[SweptCurve], balance: ModePeak | None, blade: Side
) -> PeakRange:
    told = {
        s.way: next((one for one in s.peaks[blade] if one.number == number), None) for s in sweeps
    }
    found = sorted((one for one in told.values() if one is not None), key=lambda one: -one.height)
    single = len(found) == len(sweeps) and all(alike(one, found[0]) for one in found)
    agrees = balance is not None and single and all(alike(balance, one) for one in found)
    return PeakRange(
        number,
        found[0].mode,
        tuple(found),
        single,
        balance,
        agrees,
        "" if agrees else _why(told, balance, single),
    )


def _why(told: Mapping[Way, ModePeak | None], balance: ModePeak | None, single: bool) -> str:
    by_balance = (
        f"; harmonic balance {balance.height:.4g} at {balance.frequency:.5g} Hz"
        if balance is not None
        else ""
    )
    if single:
        return f"time march, up and down alike{by_balance}"
    words = [
        f"sweep {way} {one.height:.4g} at {one.frequency:.5g} Hz" if one else f"sweep {way} none"
        for way, one in told.items()
    ]
    return f"not unique: {', '.join(words)}{by_balance}"
