"""Curves of a forced response: linear limits, with friction by harmonic balance or by sweeps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Generic, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced.measures import ComplexArray, CurvePeak, StuckMode
from upd.analyses.forced.model import Array
from upd.analyses.forced.statics import StaticState
from upd.analyses.seated.interface import Interface
from upd.hbm import FrequencyResponse
from upd.hbm.faces.balance import InterfaceResponse
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.hbm.faces.sweep import SteppedSine
from upd.results import Case
from upd.scene.forced_contact import Side


@dataclass(frozen=True)
class LinearCurves:
    """Linear limits of one contact stiffness.

    Attributes
    ----------
    frequency
        (n,) Hz.
    free, stuck
        Side -> (n,) accelerance of the blade in (m/s2)/N, without the damper and with all points
        closed and sticking.
    modes
        Stuck natural frequencies.
    free_peaks, stuck_peaks
        Side -> numbered peaks of the curves within the sweep, between its points and whatever these
        are: free ones by frequency, stuck ones by their modes.
    """

    frequency: Array
    free: Mapping[Side, ComplexArray]
    stuck: Mapping[Side, ComplexArray]
    modes: list[StuckMode]
    free_peaks: Mapping[Side, list[CurvePeak]]
    stuck_peaks: Mapping[Side, list[CurvePeak]]


class Top(NamedTuple):
    """The very top of a peak on the path by harmonic balance, between its points.

    Attributes
    ----------
    frequency, height
        Hz and (m/s2)/N.
    x
        (n_unknown,) unknowns there.
    slips
        Whether a contact point slips or opens.
    """

    frequency: float
    height: float
    x: Array
    slips: bool


#: in place of a sample: the top between the samples of a path
AT_TOP = -1


@dataclass(frozen=True)
class TimeCheck:
    """What time integration makes of a peak: it starts from the motion by harmonic balance.

    Attributes
    ----------
    blade, number, mode
        Of the peak.
    frequency, balance, integrated
        Of the highest motion that stays: Hz, and its height by harmonic balance and by time
        integration, (m/s2)/N; nan where none was found.
    sample
        Its place on the path; `AT_TOP` where it is the top of the peak itself.
    step, apart
        Relative change of height and of frequency between it and the next motion towards the top,
        which leaves or is lower; 0 at the top.
    """

    blade: Side
    number: int
    mode: str
    frequency: float
    balance: float
    integrated: float
    sample: int
    step: float = 0.0
    apart: float = 0.0

    @property
    def stays(self) -> bool:
        """Whether a motion that stays was found."""
        return math.isfinite(self.integrated)

    @property
    def at_top(self) -> bool:
        """Whether the top of the peak itself stays."""
        return self.sample == AT_TOP

    @property
    def difference(self) -> float:
        """Of the time integration from harmonic balance, relative; infinite where nothing stays."""
        return abs(self.integrated / self.balance - 1.0) if self.stays else float("inf")


class Fold(NamedTuple):
    """Where a slow sweep jumps: the end of a branch, and the highest it reaches after the jump.

    Attributes
    ----------
    frequency
        Hz.
    up
        Whether the frequency rises.
    before, reached
        Heights of the right blade at the end of the branch and after the jump, (m/s2)/N.
    at
        Hz, where that is.
    """

    frequency: float
    up: bool
    before: float
    reached: float
    at: float


#: harmonic balance of points or of whole faces, or a sweep
Answer = TypeVar("Answer", FrequencyResponse, InterfaceResponse, SteppedSine)
#: ways along which a curve is swept; "" by harmonic balance
Way = Literal["", "up", "down"]


@dataclass(frozen=True)
class ForcedCurve(Generic[Answer]):
    """One curve with friction, whichever way it was found.

    Attributes
    ----------
    stiffness
        Name of the contact stiffness.
    ratio
        F_C/F_E.
    force
        F_E, N.
    accelerance
        Side -> (n,) of the blade in the lowest harmonic excited, (m/s2)/N.
    more
        Other harmonics that are excited -> the same in these.
    peaks
        Side -> peaks by the numbers of their modes: what is reported.
    answer
        The path in frequency, or the steady motions of a sweep in their order.
    seconds
        It took.
    way
        Of a sweep.
    tops
        Blade and number of a peak -> its top by harmonic balance.
    checked
        Peaks on which a point slips or opens, by time integration.
    folds
        Along the path.
    """

    stiffness: str
    ratio: float
    force: float
    accelerance: Mapping[Side, ComplexArray]
    more: Mapping[int, Mapping[Side, ComplexArray]]
    peaks: Mapping[Side, tuple[CurvePeak, ...]]
    answer: Answer
    seconds: float
    way: Way = ""
    tops: Mapping[tuple[Side, int], Top] = field(default_factory=dict)
    checked: tuple[TimeCheck, ...] = ()
    folds: tuple[Fold, ...] = ()

    @property
    def case(self) -> Case:
        """What its numbers and arrays belong to."""
        choice = f"sweep {self.way}" if self.way else ""
        return Case(stiffness=self.stiffness, force_ratio=self.ratio, choice=choice)

    @property
    def frequency(self) -> Array:
        """(n,) Hz along the curve."""
        return self.answer.frequency

    @property
    def empty(self) -> bool:
        """Whether not one point was found."""
        return not len(self.frequency)

    @property
    def stopped(self) -> str:
        """Why peaks may be missing: how far a curve that ended early came; "" of a whole one."""
        name = self.case.choice or "path"
        if self.answer.status in ("stopped", "step limit"):
            if self.empty:
                return f"the {name} found no point"
            last = self.frequency[-1] if self.way else self.frequency.max()
            return f"the {name} stopped at {last:.4g} Hz"
        missed = ", ".join(f"{f:.4g}" for f in getattr(self.answer, "missed", ()))
        return f"the {name} has no motion at {missed} Hz" if missed else ""

    def stayed(self, side: Side, number: int) -> TimeCheck | None:
        """The highest motion that stays, where the top of a peak leaves; None where it stays."""
        mine = (c for c in self.checked if (c.blade, c.number) == (side, number))
        return next((c for c in mine if c.stays and not c.at_top), None)

    @property
    def rising(self) -> NDArray[np.bool_]:
        """(n,) whether the frequency rises along the path: between two folds, where it falls, the
        motion is unstable.
        """
        return rising(self.frequency)


#: a curve of contact points, and of whole faces, by harmonic balance; a sweep
PointCurve = ForcedCurve[FrequencyResponse]
FacesCurve = ForcedCurve[InterfaceResponse]
SweptCurve = ForcedCurve[SteppedSine]


def rising(frequency: Array) -> NDArray[np.bool_]:
    """(n,) whether the frequency rises along a path.

    The sign of the step is that of the Jacobian's determinant, which changes at a fold.

    Parameters
    ----------
    frequency
        (n,) along the path.

    References
    ----------
    R. Seydel, Practical Bifurcation and Stability Analysis (2010), ch. 4.
    """
    if len(frequency) < 2:
        return np.ones(len(frequency), bool)
    steps = np.diff(frequency) > 0.0
    return np.concatenate([steps[:1], steps[1:] & steps[:-1], steps[-1:]])


@dataclass(frozen=True)
class WholeFaces:
    """Both faces node by node.

    Attributes
    ----------
    of
        The contact: places, areas, frames of its nodes.
    march
        Its outputs are the tips of the left and the right blade along x, then the coordinates of
        the blades' lowest modes.
    start
        At rest under F_C.
    state
        Forces of both faces there.
    """

    of: Interface
    march: InterfaceModel
    start: InterfaceState
    state: StaticState
