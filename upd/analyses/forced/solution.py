"""What a forced response is made of once it is solved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from upd.analyses.base import Resolved
from upd.analyses.forced.curves import ForcedCurve, LinearCurves, SweptCurve, WholeFaces
from upd.analyses.forced.measures import CurvePeak, in_faces
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.nonlinear_modes import ModeCurve
from upd.analyses.forced.performance import Performance
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.seated.bodies import Bodies
from upd.hbm.faces.record import RecordedPeriod
from upd.mesh import IntArray
from upd.results import Case, Result
from upd.scene.forced_contact import SIDES
from upd.vary.variation import SolvedVariation

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
    peak: CurvePeak
    period: RecordedPeriod
    places: ContactPlaces
    motion: Array

    @property
    def frequency(self) -> float:
        """Hz, of the point of the sweep next to the peak."""
        return float(self.sweep.frequency[self.peak.sample])

    @property
    def case(self) -> Case:
        """What its numbers belong to."""
        return replace(self.sweep.case, peak=self.peak.number, mode=self.peak.mode)

    @property
    def off(self) -> float:
        """Of the losses of all nodes from that of the sweep at this point, over the work of the
        excitation and all losses there.
        """
        own = self.sweep.answer.energy[self.peak.sample]
        return abs(self.period.energy - float(own[2])) / max(float(np.abs(own).sum()), _TINY)


@dataclass
class ForcedSolution:
    """All that was solved, for results, checks and arrays.

    Dictionaries by the name of the contact stiffness; ``band`` and ``effects`` are numbers of peaks
    from other static states and starts of the sliders, and of their changes by inputs.
    """

    plan: ForcedPlan
    bodies: Bodies | None = None
    models: dict[str, Model] = field(default_factory=dict)
    linear: dict[str, LinearCurves] = field(default_factory=dict)
    curves: list[ForcedCurve[Any]] = field(default_factory=list)
    faces: dict[str, WholeFaces] = field(default_factory=dict)
    marched: list[MarchedPeak] = field(default_factory=list)
    band: list[Result] = field(default_factory=list)
    performances: dict[str, Performance] = field(default_factory=dict)
    nonlinear_modes: list[ModeCurve] = field(default_factory=list)
    omissions: list[Resolved] = field(default_factory=list)
    levels: list[SolvedVariation] = field(default_factory=list)
    effects: list[Result] = field(default_factory=list)

    @property
    def order(self) -> int:
        """Largest order of a matrix that the curves are read with."""
        reduced = [len(one.M) for one in self.models.values()]
        return max([*reduced, *(3 * one.of.n for one in self.faces.values())], default=0)

    def places(self, stiffness: str) -> ContactPlaces:
        """Of the contact points, or of the nodes of whole faces."""
        if stiffness in self.faces:
            of = self.faces[stiffness].of
            along, up = in_faces(of.position, of.face, of.frame)
            return ContactPlaces(of.face, along, up, of.area, np.zeros(of.n))
        model, law = self.models[stiffness], self.models[stiffness].contacts.law
        frames = [model.faces[side].frame for side in SIDES]
        along, up = in_faces(model.position, model.face, frames)
        springs = np.divide(1.0, law.k_t, out=np.zeros_like(law.k_t), where=law.k_t > 0.0)
        return ContactPlaces(model.face, along, up, law.k_n, springs)

    def marked_points(self, curve: ForcedCurve[Any]) -> list[tuple[int, str, int]]:
        """Number, mode and point of the path of the right blade's peaks.

        Number 0 and the highest point of a curve without a peak.
        """
        peaks: Sequence[CurvePeak] = curve.peaks["right"]
        if peaks:
            return [(peak.number, peak.mode, peak.sample) for peak in peaks]
        return [(0, "", int(np.abs(curve.accelerance["right"]).argmax()))]
