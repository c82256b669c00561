"""What a forced response is made of once it is solved.

Marched peaks, peaks confirmed and followed again, bands, and all of it together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from upd.analyses.base import Resolved
from upd.analyses.forced.curves import FacesCurve, ForcedCurve, LinearCurves, SweptCurve, WholeFaces
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.level_values import ForcedLevels
from upd.analyses.forced.march_modes import stuck_peaks_of
from upd.analyses.forced.measures import PathPeak
from upd.analyses.forced.mode_peaks import (
    CANDIDATES,
    ModePeak,
    mode_shapes,
    numbered,
    numbered_peaks,
    stuck_motion,
)
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.performance_curve import Performance
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.seated.bodies import Bodies
from upd.hbm.interface_record import RecordedPeriod
from upd.hbm.march import SteadyState
from upd.mesh import IntArray
from upd.results import Case
from upd.scene.forced_contact import Side

_TINY = float(np.finfo(float).tiny)


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
    levels: ForcedLevels = field(default_factory=ForcedLevels)

    @property
    def order(self) -> int:
        """Largest order of a matrix that the curves are read with."""
        reduced = [len(one.M) for one in self.models.values()]
        return max([*reduced, *(3 * one.of.n for one in self.faces.values())], default=0)

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
        return numbered_peaks(
            self.models[curve.stiffness],
            curve.answer,
            np.abs(curve.accelerance[blade]),
            self.plan.scene.excitation.stop,
            curve.left_points,
        )

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
