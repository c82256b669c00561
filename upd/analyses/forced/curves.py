"""Curves of a forced response: linear limits, with friction by harmonic balance, by time march."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from upd.analyses.forced.measures import ComplexArray, PathPeak, StuckMode
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array
from upd.analyses.forced.statics import StaticState
from upd.analyses.seated.interface import Interface
from upd.hbm import FrequencyResponse
from upd.hbm.interface_balance import InterfaceResponse
from upd.hbm.interface_state import InterfaceModel, InterfaceState
from upd.hbm.refined_sweep import RefinedSweep
from upd.results import Case
from upd.scene.forced_contact import SIDES, Side


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
class FrictionCurve:
    """What every curve with friction has, whichever way it was found.

    Attributes
    ----------
    stiffness
        Name of the contact stiffness.
    ratio
        F_C/F_E.
    force
        F_E, N.
    """

    stiffness: str
    ratio: float
    force: float

    @property
    def frequency(self) -> Array:
        """(n,) Hz along the curve."""
        raise NotImplementedError

    @property
    def empty(self) -> bool:
        """Whether not one point was found."""
        return not len(self.frequency)

    def _accelerance(self, harmonic: int, moved: ComplexArray) -> ComplexArray:
        """(n,) (m/s2)/N of F_E, from the amplitudes (n,) mm of a harmonic."""
        scale = -((2.0 * np.pi * harmonic * self.frequency) ** 2) * 1e-3 / self.force
        return np.asarray(scale * moved)


@dataclass(frozen=True)
class LeftMaximum:
    """A maximum of a path by harmonic balance that is no steady motion.

    Attributes
    ----------
    blade
        Whose maximum it is.
    peak
        What it would be.
    marched
        Where a march from it goes, (m/s2)/N of the blade.
    """

    blade: Side
    peak: ModePeak
    marched: float

    @property
    def words(self) -> str:
        """It, and where the march goes."""
        one = self.peak
        return f"{one.height:.4g} (m/s2)/N at {one.frequency:.5g} Hz for {self.marched:.4g}"


@dataclass(frozen=True)
class ForcedCurve(FrictionCurve):
    """One curve with friction.

    Attributes
    ----------
    answer
        The path in frequency.
    accelerance
        Side -> (n,) of the blade along the path, (m/s2)/N.
    seconds
        It took.
    reversed
        Followed from the highest frequency downwards.
    left
        Maxima that a march leaves, which are no peaks.
    """

    answer: FrequencyResponse
    accelerance: Mapping[Side, ComplexArray]
    seconds: float
    reversed: bool = False
    left: tuple[LeftMaximum, ...] = ()

    @property
    def left_points(self) -> frozenset[int]:
        """Points of the path at maxima that a march leaves."""
        return frozenset(one.peak.sample for one in self.left)

    @property
    def case(self) -> Case:
        """What its numbers and arrays belong to."""
        return Case(stiffness=self.stiffness, force_ratio=self.ratio, reversed=self.reversed)

    @property
    def frequency(self) -> Array:
        """(n,) Hz along the path."""
        return self.answer.frequency

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
class FacesCurve(FrictionCurve):
    """One curve of whole faces by harmonic balance, from the static state at rising frequency.

    Attributes
    ----------
    answer
        The motions along the curve.
    accelerance
        Side -> (k,) of the blade, (m/s2)/N.
    peaks
        Side -> peaks by the numbers of their modes.
    """

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
        return self._accelerance(harmonic, self.answer.amplitude[:, harmonic, SIDES.index(blade)])

    @property
    def seconds(self) -> float:
        """It took."""
        return self.answer.seconds

    @property
    def frequency(self) -> Array:
        """(k,) Hz along the curve."""
        return self.answer.frequency

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
class SweptCurve(FrictionCurve):
    """Steady motions by time march, at one frequency after the other.

    Attributes
    ----------
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
        return self._accelerance(harmonic, self.found.harmonics[:, place, blade])

    @property
    def stopped(self) -> bool:
        """Whether the sweep ended before its last frequency."""
        return self.found.status == "stopped"

    @property
    def where(self) -> str:
        """How far a sweep that stopped came, in words."""
        at = f"at {self.frequency[-1]:.4g} Hz" if len(self.frequency) else "at its first frequency"
        return f"the sweep {self.way} stopped {at}"
