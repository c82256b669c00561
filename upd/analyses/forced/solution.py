"""What a forced response is made of once it is solved.

Curves, linear limits, peaks followed again, performance curves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np

from upd.analyses.base import Resolved
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.march_modes import stuck_peaks_of
from upd.analyses.forced.measures import ComplexArray, PathPeak, StuckMode, path_maxima
from upd.analyses.forced.mode_peaks import (
    ModePeak,
    first_harmonic,
    in_quadrature,
    mode_shapes,
    numbered,
    stuck_motion,
)
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.statics import StaticState
from upd.analyses.seated.bodies import Bodies
from upd.analyses.seated.interface import Interface
from upd.hbm import FrequencyResponse
from upd.hbm.interface_balance import InterfaceResponse
from upd.hbm.interface_march import InterfaceModel, InterfaceState
from upd.hbm.interface_record import RecordedPeriod
from upd.hbm.march import SteadyState
from upd.hbm.refined_sweep import RefinedSweep
from upd.mesh import IntArray
from upd.results import Case
from upd.scene.forced import SIDES, Side

#: modes up to so many times the highest frequency of a sweep are told in it
CANDIDATES = 2.0
_TINY = float(np.finfo(float).tiny)


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
        Side -> peaks of the curves within the sweep, between its points and whatever these are.
    """

    frequency: Array
    free: Mapping[Side, ComplexArray]
    stuck: Mapping[Side, ComplexArray]
    modes: list[StuckMode]
    free_peaks: Mapping[Side, list[PathPeak]]
    stuck_peaks: Mapping[Side, list[PathPeak]]


@dataclass(frozen=True)
class ForcedCurve:
    """One curve with friction.

    Attributes
    ----------
    stiffness
        Name of the contact stiffness.
    ratio
        F_C/F_E.
    force
        F_E, N.
    answer
        The path in frequency.
    accelerance
        Side -> (n,) of the blade along the path, (m/s2)/N.
    seconds
        It took.
    reversed
        Followed from the highest frequency downwards.
    """

    stiffness: str
    ratio: float
    force: float
    answer: FrequencyResponse
    accelerance: Mapping[Side, ComplexArray]
    seconds: float
    reversed: bool = False

    @property
    def case(self) -> Case:
        """What its numbers and arrays belong to."""
        return Case(stiffness=self.stiffness, force_ratio=self.ratio, reversed=self.reversed)

    @property
    def frequency(self) -> Array:
        """(n,) Hz along the path."""
        return self.answer.frequency

    @property
    def empty(self) -> bool:
        """Whether not one point was found."""
        return not len(self.answer.frequency)

    @property
    def stopped(self) -> bool:
        """Whether the path ended before the end of the sweep."""
        return not self.answer.arrived

    @property
    def where(self) -> str:
        """How far a path that stopped came, in words."""
        if self.empty:
            return "the path found no point"
        f = self.answer.frequency
        end = f.min() if self.reversed else f.max()
        return f"the path {'downwards ' * self.reversed}stopped at {end:.4g} Hz"


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


@dataclass(frozen=True)
class FacesCurve:
    """One curve of whole faces by harmonic balance, from the static state at rising frequency.

    Attributes
    ----------
    stiffness
        Name of the contact.
    ratio
        F_C/F_E.
    force
        F_E, N.
    answer
        The motions along the curve.
    accelerance
        Side -> (k,) of the blade, (m/s2)/N.
    peaks
        Side -> peaks by the numbers of their modes.
    """

    stiffness: str
    ratio: float
    force: float
    answer: InterfaceResponse
    accelerance: Mapping[Side, ComplexArray]
    peaks: Mapping[Side, tuple[ModePeak, ...]]
    reversed: ClassVar[bool] = False

    @property
    def case(self) -> Case:
        """What its numbers and arrays belong to."""
        return Case(stiffness=self.stiffness, force_ratio=self.ratio)

    def accelerance_in(self, harmonic: int, blade: Side) -> ComplexArray:
        """(k,) of a blade in a harmonic of the excitation, (m/s2)/N of F_E."""
        moved = self.answer.amplitude[:, harmonic, SIDES.index(blade)]
        scale = -((2.0 * np.pi * harmonic * self.frequency) ** 2) * 1e-3 / self.force
        return np.asarray(scale * moved)

    @property
    def seconds(self) -> float:
        """It took."""
        return self.answer.seconds

    @property
    def frequency(self) -> Array:
        """(k,) Hz along the curve."""
        return self.answer.frequency

    @property
    def empty(self) -> bool:
        """Whether not one point was found."""
        return not len(self.answer.frequency)

    @property
    def stopped(self) -> bool:
        """Whether motions are missing at frequencies asked for."""
        return not self.answer.arrived or bool(self.answer.missed)

    @property
    def where(self) -> str:
        """How far it came, in words."""
        if self.empty:
            return "the path found no point"
        if self.answer.arrived:
            at = ", ".join(f"{f:.4g}" for f in self.answer.missed)
            return f"the path has no motion at {at} Hz"
        return f"the path stopped at {self.answer.frequency[-1]:.4g} Hz"


#: ways along which a curve is marched
Way = Literal["up", "down"]


@dataclass(frozen=True)
class SweptCurve:
    """Steady motions by time march, at one frequency after the other.

    Attributes
    ----------
    stiffness
        Name of the contact stiffness.
    ratio
        F_C/F_E.
    force
        F_E, N.
    way
        Rising or falling frequency.
    found
        The motions in the order marched.
    accelerance
        Side -> (k,) of the blade, (m/s2)/N.
    peaks
        Side -> peaks by the numbers of their modes.
    choice
        The static state it began from where it is not the run's.
    """

    stiffness: str
    ratio: float
    force: float
    way: Way
    found: RefinedSweep
    accelerance: Mapping[Side, ComplexArray]
    peaks: Mapping[Side, tuple[ModePeak, ...]]
    choice: str = ""

    @property
    def case(self) -> Case:
        """What its numbers and arrays belong to."""
        words = f"{self.choice}{', ' * bool(self.choice)}sweep {self.way}"
        return Case(stiffness=self.stiffness, force_ratio=self.ratio, choice=words)

    @property
    def frequency(self) -> Array:
        """(k,) Hz in the order marched."""
        return self.found.frequency

    def accelerance_in(self, harmonic: int, place: int, blade: int) -> ComplexArray:
        """(k,) of a blade in another harmonic that is excited, (m/s2)/N of F_E.

        Parameters
        ----------
        harmonic, place
            Its number, and its place among those excited.
        blade
            Place of the blade among the outputs.
        """
        moved = self.found.harmonics[:, place, blade]
        return -((2.0 * np.pi * harmonic * self.frequency) ** 2) * 1e-3 / self.force * moved

    @property
    def stopped(self) -> bool:
        """Whether the sweep ended before its last frequency."""
        return self.found.status == "stopped"

    @property
    def where(self) -> str:
        """How far a sweep that stopped came, in words."""
        at = f"at {self.frequency[-1]:.4g} Hz" if len(self.frequency) else "at its first frequency"
        return f"the sweep {self.way} stopped {at}"


@dataclass(frozen=True)
class ContactPlaces:
    """Contact points or nodes of both faces: face (n,) as an index into SIDES; place (n,) along the
    damper and up the slope, mm; weight (n,) in means over a face; compliance (n,) of the tangential
    springs, mm/N, 0 without.
    """

    face: IntArray
    along: Array
    up: Array
    weight: Array
    compliance: Array


@dataclass(frozen=True)
class MarchedPeak:
    """The last period of a sweep at one of its peaks, node by node.

    Attributes
    ----------
    sweep, peak
        The peak and the sweep that has it.
    period
        What the contact does.
    places
        Of its nodes.
    motion
        (N, 6) of the damper from its rest, mm and rad.
    """

    sweep: SweptCurve
    peak: ModePeak
    period: RecordedPeriod
    places: ContactPlaces
    motion: Array

    @property
    def frequency(self) -> float:
        """Hz, of the point of the sweep next to the peak."""
        return float(self.sweep.frequency[self.peak.sample])

    @property
    def case(self) -> Case:
        """What its numbers belong to: the curve's peak."""
        peak, mode = self.peak.number, self.peak.mode
        return replace(self.sweep.case, peak=peak, mode=mode, choice="")

    @property
    def off(self) -> float:
        """Of the losses of all nodes from that of the sweep at this point, over the work of the
        excitation and all losses there.
        """
        told = self.sweep.found.energy[self.peak.sample]
        return abs(self.period.energy - float(told[2])) / max(float(np.abs(told).sum()), _TINY)


@dataclass(frozen=True)
class Confirmation:
    """A peak of a curve marched on from its own motion, residual slips included.

    The curve and its peak; accelerance of the right blade at the point of the path next to it by
    the balance, and where the march settles, (m/s2)/N; whether it settled.
    """

    curve: ForcedCurve | FacesCurve
    peak: ModePeak
    height: float
    marched: float
    settled: bool

    @property
    def difference(self) -> float:
        """Of the march from the balance, relative; infinite where it did not settle."""
        return abs(self.marched / self.height - 1.0) if self.settled else float("inf")


@dataclass(frozen=True)
class TimeMarch:
    """A point of a curve by time integration.

    Frequency in Hz, accelerance (m/s2)/N by harmonic balance, and the steady state.
    """

    curve: ForcedCurve
    frequency: float
    height: float
    steady: SteadyState

    @property
    def verifies(self) -> bool:
        """Whether the march found a period: nothing else can be compared with an answer."""
        return self.steady.status == "periodic"

    def accelerance(self, model: Model) -> float:
        """Accelerance of the right blade by the time integration, (m/s2)/N."""
        k = model.excitation.lowest
        amplitude = self.steady.amplitude(model.row("right"), self.curve.answer.harmonics.place(k))
        return float(1e-3 * (2 * np.pi * k * self.frequency) ** 2 * amplitude / self.curve.force)


@dataclass(frozen=True)
class PeakAgain:
    """A peak followed again with one choice changed.

    Attributes
    ----------
    choice
        Start of the sliders, or the highest harmonic.
    frequency, height
        Hz and (m/s2)/N; NaN when not found.
    truncation
        Largest contact motion by harmonics left out, relative.
    """

    choice: str
    frequency: float
    height: float
    truncation: float
    status: str
    seconds: float

    @property
    def found(self) -> bool:
        """Whether the peak lies in the band around it."""
        return bool(np.isfinite(self.height))


#: the choice of a band that is the run itself
AS_RUN = "as run"


@dataclass(frozen=True)
class BandCurve:
    """A curve followed or swept with another static state or start of the sliders.

    The choice in words, the curve, and the right blade's peaks by the numbers of their modes.
    """

    choice: str
    curve: ForcedCurve | SweptCurve
    peaks: tuple[ModePeak, ...]


@dataclass(frozen=True)
class CurveBand:
    """A curve as run and with every other static state and start, the first as run."""

    curve: ForcedCurve
    curves: tuple[BandCurve, ...]

    def peaks(self, number: int) -> dict[str, ModePeak]:
        """A peak by its number, of every choice that has it."""
        return {one.choice: p for one in self.curves for p in one.peaks if p.number == number}

    @property
    def numbers(self) -> list[int]:
        """Numbers of all peaks, rising."""
        return sorted({p.number for one in self.curves for p in one.peaks})


@dataclass(frozen=True)
class Branch:
    """One peak over F_C/F_E: ratio (n,) rising.

    Frequency (n,) Hz; height (n,) (m/s2)/N; lift (n,) share open; the mode in words; the lower of
    the heights on both sweeps (n,), the height itself where the peak is one.
    """

    name: str
    ratio: Array
    frequency: Array
    height: Array
    lift: Array
    complete: bool
    message: str
    mode: str = ""
    low: Array | None = None

    @property
    def least(self) -> Array:
        """(n,) lower height of both sweeps."""
        return self.height if self.low is None else self.low


@dataclass(frozen=True)
class Performance:
    """The peaks over F_C/F_E, and the linear limits.

    Free (small ratios) and stuck (large ones) peak in (m/s2)/N. Where points move, the highest
    point of the sweeps up and down: ratio rising, frequency in Hz, height on the higher and on the
    lower sweep, (4, n); and the sweeps.
    """

    branches: tuple[Branch, ...]
    free_peak: float
    stuck_peak: float
    swept: Array = field(default_factory=lambda: np.zeros((4, 0)))
    sweeps: tuple[SweptCurve, ...] = ()

    @property
    def optimum(self) -> tuple[float, float, float] | None:
        """Ratio, frequency in Hz and height of the lowest highest peak.

        None when it lies at an end of what was reached.
        """
        best = self._best
        if best is None:
            return None
        ratio, frequency, height = self.highest[:3, best]
        return float(ratio), float(frequency), float(height)

    @property
    def _best(self) -> int | None:
        height = self.highest[2]
        best = int(height.argmin()) if len(height) else 0
        return best if 0 < best < len(height) - 1 else None

    @property
    def optimum_between(self) -> tuple[float, float]:
        """F_C/F_E between which the optimum lies: the next on the curve, and beyond them all at
        which the lower sweep is below the least height of the higher one.
        """
        ratio, _, height, low = self.highest
        best = self._best
        assert best is not None
        may = np.flatnonzero(low <= height[best])
        return float(ratio[min(may[0], best - 1)]), float(ratio[max(may[-1], best + 1)])

    @property
    def optimum_heights(self) -> tuple[float, float]:
        """Height at the optimum on the lower and on the higher sweep."""
        best = self._best
        assert best is not None
        return float(self.highest[3, best]), float(self.highest[2, best])

    @property
    def highest(self) -> Array:
        """(4, n): ratio, frequency in Hz, height of the highest peak, and that on the lower sweep,
        at every ratio that all branches reach, and at every ratio that was swept.
        """
        told = self._followed()
        if not self.swept.shape[1]:
            return told
        return np.hstack([self.swept, told[:, told[0] > self.swept[0, -1]]])

    def _followed(self) -> Array:
        full = [b for b in self.branches if len(b.ratio)]
        if not full:
            return np.zeros((4, 0))
        low, high = max(b.ratio[0] for b in full), min(b.ratio[-1] for b in full)
        ratio = np.unique(np.concatenate([b.ratio for b in full]))
        ratio = ratio[(ratio >= low) & (ratio <= high)]
        at = np.log(ratio)
        heights = np.array([np.interp(at, np.log(b.ratio), b.height) for b in full])
        frequencies = np.array([np.interp(at, np.log(b.ratio), b.frequency) for b in full])
        top = heights.argmax(axis=0) if len(ratio) else np.zeros(0, np.int64)
        every = np.arange(len(ratio))
        height = heights[top, every]
        return np.array([ratio, frequencies[top, every], height, height])


@dataclass
class ForcedSolution:
    """All that was solved, for results, checks and arrays.

    Dictionaries by the name of the contact stiffness.
    """

    plan: ForcedPlan
    bodies: Bodies | None = None
    models: dict[str, Model] = field(default_factory=dict)
    linear: dict[str, LinearCurves] = field(default_factory=dict)
    curves: list[ForcedCurve] = field(default_factory=list)
    marches: list[TimeMarch] = field(default_factory=list)
    faces: dict[str, WholeFaces] = field(default_factory=dict)
    balanced: list[FacesCurve] = field(default_factory=list)
    sweeps: list[SweptCurve] = field(default_factory=list)
    marched: list[MarchedPeak] = field(default_factory=list)
    confirmations: list[Confirmation] = field(default_factory=list)
    spreads: dict[str, list[PeakAgain]] = field(default_factory=dict)
    harmonics: dict[str, list[PeakAgain]] = field(default_factory=dict)
    bands: list[CurveBand] = field(default_factory=list)
    performances: dict[str, Performance] = field(default_factory=dict)
    omissions: list[Resolved] = field(default_factory=list)

    @property
    def paths(self) -> list[ForcedCurve | FacesCurve]:
        """All curves by harmonic balance."""
        return [*self.curves, *self.balanced]

    def stuck_peaks(self, stiffness: str, blade: Side = "right") -> list[ModePeak]:
        """Peaks of the stuck curve within the sweep: what a whole curve is asked for."""
        linear = self.linear.get(stiffness)
        if linear is None:
            return []
        if stiffness in self.faces:
            return stuck_peaks_of(
                self.faces[stiffness].march,
                linear.stuck_peaks[blade],
                CANDIDATES * self.plan.scene.excitation.stop,
                excitation_of(self.plan.scene.excitation),
            )
        return tell_stuck_peaks(
            self.models[stiffness], linear.stuck_peaks[blade], self.plan.scene.excitation.stop
        )

    def numbered_peaks(
        self, curve: ForcedCurve | FacesCurve, blade: Side = "right"
    ) -> list[ModePeak]:
        """A blade's peaks of a path, by the numbers of their modes."""
        if isinstance(curve, FacesCurve):
            return list(curve.peaks[blade])
        maxima = path_maxima(curve.answer.frequency, np.abs(curve.accelerance[blade]))
        if not maxima:
            return []
        modes = mode_shapes(
            self.models[curve.stiffness], CANDIDATES * self.plan.scene.excitation.stop
        )
        motion = first_harmonic(curve.answer, np.array([one.sample for one in maxima]))
        if curve.stopped:
            # Where a path turns round it has a maximum that is no resonance.
            on = in_quadrature(self.models[curve.stiffness], motion)
            maxima, motion = [one for one, keep in zip(maxima, on, strict=True) if keep], motion[on]
        return numbered(modes, maxima, motion)

    def marked_points(self, curve: ForcedCurve | FacesCurve) -> list[tuple[int, str, int]]:
        """Number, mode and point of the path of the right blade's peaks.

        Number 0 and the highest point of a curve without a peak.
        """
        peaks = self.numbered_peaks(curve)
        if peaks:
            return [(peak.number, peak.mode, peak.sample) for peak in peaks]
        return [(0, "", int(np.abs(curve.accelerance["right"]).argmax()))]


def tell_stuck_peaks(model: Model, peaks: Sequence[PathPeak], stop: float) -> list[ModePeak]:
    """Peaks of a stuck curve by the numbers of their modes.

    Parameters
    ----------
    stop
        End of the sweep, Hz.
    """
    if not peaks:
        return []
    motion = stuck_motion(model, np.array([one.frequency for one in peaks]))
    return numbered(mode_shapes(model, CANDIDATES * stop), peaks, motion)
