"""What a choice of damper found: its optimum over the ranges, the nominal one, and how both were
found.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from upd.sizing.least_worst import LowestWorst
from upd.sizing.margins import Reach
from upd.sizing.ranges import Ranges
from upd.sizing.rig_peaks import RigPeaks
from upd.sizing.worst_peak import WorstPeak

#: what is minimised: peaks per newton of F_E, accelerations
Objective = Literal["peak", "acceleration"]
UNITS_OF: dict[Objective, str] = {"peak": "(m/s2)/N", "acceleration": "m/s2"}
#: growths of the worst peak up to which parameters may move
GROWTHS = (1.05, 1.10)


@dataclass(frozen=True)
class Tried:
    """One place of what is chosen beside F_C.

    Attributes
    ----------
    values : tuple of float
        In the units inside; empty where nothing else is chosen.
    rigs : tuple of (tuple of float, RigPeaks)
        Values of the uncertain inputs -> their rig.
    worst, best : WorstPeak, LowestWorst
        Worst peaks over all ranges, and where they are least.
    plain, nominal : WorstPeak, LowestWorst
        The same of the scene's own values.
    ends : (float, float)
        F_C [N] between which it is sought.
    """

    values: tuple[float, ...]
    rigs: tuple[tuple[tuple[float, ...], RigPeaks], ...]
    worst: WorstPeak
    best: LowestWorst
    plain: WorstPeak
    nominal: LowestWorst
    ends: tuple[float, float]


def best_of(tried: Iterable[Tried]) -> Tried:
    """The robust optimum."""
    return min(tried, key=lambda one: one.best.log_worst)


def nominal_of(tried: Iterable[Tried]) -> Tried:
    """The nominal optimum."""
    return min(tried, key=lambda one: one.nominal.log_worst)


def is_along(values: Sequence[float], others: Sequence[float], k: int) -> bool:
    """Whether values are the same but for one of them.

    Parameters
    ----------
    values, others
        Of the same inputs.
    k
        Number of that one.
    """
    return all(
        math.isclose(a, b) for i, (a, b) in enumerate(zip(values, others, strict=True)) if i != k
    )


@dataclass(frozen=True)
class ChosenDamper:
    """The damper with the lowest worst peak, and what is known beside it.

    Attributes
    ----------
    ranges : Ranges
        As asked for.
    objective : {"peak", "acceleration"}
        What is least.
    stiffness : str
        Name of the contact stiffness.
    tried : tuple of Tried
        All places of what is chosen beside F_C, in their order.
    refused : tuple of str
        Values that were not solved, with the reason.
    seconds : float
        Of this call.
    reaches : mapping
        Name of a parameter -> how far it may move down and up from the robust optimum, for each of
        `GROWTHS`: what sets F_C, and the ends of the range of F_E.
    robust_at_nominal : float
        Peak of the robust optimum with the scene's own values; nan where it is not known.
    nominal_at_worst : float
        Worst peak of the nominal optimum over all ranges; nan where it is not known.
    settled : (bool, bool)
        Whether both are known to the step of a jump; else they are the highest of whole curves,
        with jumps between that may hide a higher one.
    """

    ranges: Ranges
    objective: Objective
    stiffness: str
    tried: tuple[Tried, ...]
    refused: tuple[str, ...]
    seconds: float
    reaches: Mapping[str, tuple[tuple[Reach, Reach], ...]]
    robust_at_nominal: float
    nominal_at_worst: float
    settled: tuple[bool, bool]

    @property
    def best(self) -> Tried:
        """The robust optimum."""
        return best_of(self.tried)

    def along(self, k: int) -> list[tuple[float, Tried]]:
        """Values of one of the inputs chosen beside F_C and what was tried there, all others as at
        the robust optimum, rising.

        Parameters
        ----------
        k
            Its number among them.
        """
        found = [(t.values[k], t) for t in self.tried if is_along(t.values, self.best.values, k)]
        return sorted(found, key=lambda pair: pair[0])

    @property
    def plain(self) -> Tried:
        """The nominal optimum."""
        return nominal_of(self.tried)

    @property
    def centrifugal(self) -> float:
        """F_C of the robust optimum [N]."""
        return math.exp(self.best.best.log_centrifugal)

    @property
    def worst(self) -> float:
        """Its worst peak."""
        return math.exp(self.best.best.log_worst)

    @property
    def nominal_centrifugal(self) -> float:
        """F_C of the nominal optimum [N]."""
        return math.exp(self.plain.nominal.log_centrifugal)

    @property
    def nominal_peak(self) -> float:
        """Its peak with the scene's own values."""
        return math.exp(self.plain.nominal.log_worst)

    @property
    def curves(self) -> int:
        """Whole curves that were solved in this call."""
        return sum(rig.curves for one in self.tried for _, rig in one.rigs)

    @property
    def resumed(self) -> int:
        """Points kept of earlier calls."""
        return sum(rig.peaks.resumed for one in self.tried for _, rig in one.rigs)

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """F_C/F_E of the optimum between which no whole curve with peaks is known."""
        c, f = self.best.best.log_centrifugal, self.best.worst.f
        out = []
        for low, high in (pair for one in self.best.worst.peaks for pair in one.holes):
            ends = max(low, c - f[1]), min(high, c - f[0])
            if ends[0] < ends[1]:
                out.append((math.exp(ends[0]), math.exp(ends[1])))
        return list(dict.fromkeys(out))

    @property
    def unreached(self) -> tuple[float, ...]:
        """F_C/F_E whose highest peak was sought in vain, rising."""
        lost = {math.exp(s) for one in self.best.worst.peaks for s in one.failed}
        return tuple(sorted(lost))
