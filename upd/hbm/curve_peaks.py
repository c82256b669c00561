r"""Peaks of whole response curves as functions of F_C/F_E, solved where they are asked for.

With every gap closed at rest, static and dynamic loads scaled by s scale the answer by s: peaks per
newton of F_E depend on r = F_C/F_E alone, and one curve serves every pair of forces. At a peak with
the factor q on the dynamic loads, r = r_1/q with r_1 that of the problem as given,

    d ln(h/q) / d ln r = 1 - d ln h / d ln q,

from the exact derivative of the peak (`upd.hbm.peak_sensitivity`).

A peak that is followed from one r to the next may leave the curve that runs from the lowest to the
highest frequency: where a loop of it closes, its solutions go on as a closed curve beside it, which
no sweep of the frequency reaches. Peaks are therefore taken from the whole curve at every r.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError
from upd.hbm.balance import Balance
from upd.hbm.parameter_change import ParameterChange
from upd.hbm.peak_sensitivity import peak_derivatives
from upd.hbm.peaks import climb

FloatArray = NDArray[np.float64]
#: difference of ln(F_C/F_E) that is none
ROUNDING = 1e-12


class SeenPeak(NamedTuple):
    """A peak of a whole curve: its name, frequency [Hz], height per unit of F_E, the frequencies
    [Hz] between which its top must lie, and the unknowns and the frequency of a point near it.
    """

    name: str
    frequency: float
    height: float
    between: tuple[float, float]
    x: FloatArray
    at: float


#: F_C/F_E -> the peaks of the whole curve; None where it was not followed through
Search = Callable[[float], Sequence[SeenPeak] | None]


@dataclass(frozen=True)
class PeakPoint:
    """A peak at one F_C/F_E.

    Attributes
    ----------
    frequency : float
        [Hz]
    log_height : float
        ln of the height per unit of F_E.
    slope : float
        Its derivative by ln(F_C/F_E); nan where it was not found.
    by : (n,) ndarray
        Its derivatives by the parameters; nan where they were not found.
    """

    frequency: float
    log_height: float
    slope: float
    by: FloatArray


class CurvePeaks:
    """Peaks of |row @ q| w^power per unit of F_E, over F_C/F_E.

    Parameters
    ----------
    balance : Balance
        Homogeneous: no gaps at rest.
    row : (n_dof,) array_like
        Weighs the displacements.
    ratio : float
        F_C/F_E of the balance as given.
    search : callable
        The whole curve at one F_C/F_E.
    unit : float
        Height per w^power mm of the balance as given: 1/F_E, and factors of units.
    harmonic : int, optional
        Its number; the lowest above 0 by default.
    power : float
        Of the angular frequency: 2 for accelerations.
    changes : sequence of ParameterChange
        One for the logarithm of each parameter, at the same F_C and F_E.
    kept : callable, optional
        Called after every curve.

    Attributes
    ----------
    points : dict
        ln(F_C/F_E) -> name of a peak -> point; empty where the curve has none.
    failed : set of float
        ln(F_C/F_E) whose curve was not followed through.
    """

    def __init__(
        self,
        balance: Balance,
        row: ArrayLike,
        ratio: float,
        search: Search,
        *,
        unit: float = 1.0,
        harmonic: int | None = None,
        power: float = 2.0,
        changes: Sequence[ParameterChange] = (),
        kept: Callable[[], None] | None = None,
    ) -> None:
        self.balance, self.row, self.ratio = balance, np.asarray(row, float), ratio
        self.unit, self.harmonic, self.power = unit, harmonic, power
        self.changes, self.kept, self._search = tuple(changes), kept, search
        self.points: dict[float, dict[str, PeakPoint]] = {}
        self.failed: set[float] = set()

    @property
    def solved(self) -> int:
        """Peaks that are known."""
        return sum(map(len, self.points.values()))

    def at(self, log_ratio: float) -> dict[str, PeakPoint]:
        """The peaks of the whole curve at this ln(F_C/F_E): name -> point; none where the curve was
        not followed through.
        """
        s = float(log_ratio)
        near = min([*self.points, *self.failed], key=lambda t: abs(t - s), default=math.inf)
        # rounding makes no other place
        s = near if abs(near - s) <= ROUNDING else s
        if s not in self.points and s not in self.failed:
            found = self._search(math.exp(s))
            if found is None:
                self.failed.add(s)
            else:
                self.points[s] = {one.name: self._point(s, one) for one in found}
            if self.kept is not None:
                self.kept()
        return self.points.get(s, {})

    def _point(self, s: float, seen: SeenPeak) -> PeakPoint:
        """The top next to a point of the curve with its derivatives; the point as it was seen where
        there is none.
        """
        factor = self.ratio / math.exp(s)
        b = self.balance.with_loads(1.0, factor)
        none = np.full(len(self.changes), math.nan)
        top = climb(b, self.row, seen.x, seen.at, harmonic=self.harmonic, power=self.power)
        low, high = seen.between
        if not (top.found and low <= top.frequency <= high):
            return PeakPoint(seen.frequency, math.log(seen.height), math.nan, none)
        number = int(b.harmonics.dynamic[b.harmonics.place(self.harmonic)])
        omega = 2.0 * np.pi * number * top.frequency
        height = math.log(self.unit * omega**self.power * top.amplitude / factor)
        try:
            found = peak_derivatives(
                b,
                self.row,
                top.x,
                top.frequency,
                [ParameterChange(dynamic=b.dynamic), *self.changes],
                harmonic=self.harmonic,
                power=self.power,
            )
        except ConvergenceError:
            return PeakPoint(top.frequency, height, math.nan, none)
        relative = found.by_height / found.height
        return PeakPoint(top.frequency, height, float(1.0 - relative[0]), relative[1:])
