"""What a forced response is made of once it is solved; its curves by time integration.

Stepped sine up and down, as in an experiment: where friction and lift-off leave several steady
motions, a curve by harmonic balance follows one path through all of them. A sweep shows what a rig
would: rising, the motion that the past below leads to; falling, the one from above. Contact states,
loops and the damper's motion at their peaks are read from the last period.

Whole faces by harmonic balance have blades in frequency, damper and contact in time, see
`upd.hbm.faces.balance`: every node with its past, as a sweep from the static state at rising
frequency.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from upd.analyses.base import Resolved
from upd.analyses.forced.curves import (
    Answer,
    FacesCurve,
    ForcedCurve,
    LinearCurves,
    SweptCurve,
    Way,
    WholeFaces,
    stuck_modes_of,
)
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.measures import (
    CANDIDATES,
    MOTIONS,
    PEAKS_ABOVE,
    CurvePeak,
    Loop,
    accelerance_of,
    in_faces,
    loop_along_main,
    losing_most,
    numbered,
    path_maxima,
)
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.performance import ModeCurve, Performance
from upd.analyses.forced.plan import (
    SAMPLES,
    ComplexArray,
    ForcedPlan,
    excitation_of,
    grid,
    time_steps,
)
from upd.analyses.seated.bodies import Bodies
from upd.hbm.faces.balance import interface_response
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.hbm.faces.sweep import RecordedPeriod, period_of_sweep, stepped_sine
from upd.linalg.parallel import threads_for
from upd.mesh import IntArray
from upd.progress import Stages
from upd.results import Case, Result
from upd.scene.forced_contact import SIDES, Side
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


# -- sweeps ----------------------------------------------------------------------------------------


#: how steady a motion has to be
TOLERANCE = 1e-3
#: periods after which a motion counts as not settled: light damping, 0.5 %, leaves 1e-3 of a
#: transient after 220, and a third of the damping after 660
MOST_PERIODS = 700


def both_ways(
    plan: ForcedPlan, name: str, ratio: float, march: InterfaceModel, start: InterfaceState
) -> list[SweptCurve]:
    """The sweep up from a state, and the one down from where that ends.

    Parameters
    ----------
    name, ratio
        Of the contact; F_C/F_E.
    march, start
        What is integrated, and where it begins.
    """
    out: list[SweptCurve] = []
    scene, excitation, frequency = plan.scene, excitation_of(plan.scene.excitation), grid(plan)
    force = scene.damper.centrifugal / ratio
    ways: tuple[tuple[Way, Array], ...] = (("up", frequency), ("down", frequency[::-1]))
    with threads_for(3 * march.n):
        for way, f in ways:
            found = stepped_sine(
                march,
                f,
                force * excitation.drive,
                start,
                samples=time_steps(scene),
                tolerance=TOLERANCE,
                most_periods=MOST_PERIODS,
                fallback=by_coulomb,
            )
            start = found.state
            moved = {k: found.harmonics[:, i] for i, k in enumerate(excitation.harmonics)}
            moved[excitation.lowest] = found.amplitude
            curve = ForcedCurve(
                name, ratio, force, {}, {}, {}, found, float(found.seconds.sum()), way
            )
            out.append(with_outputs(plan, march, curve, moved, sweep_maxima))
    return out


def with_outputs(
    plan: ForcedPlan,
    march: InterfaceModel,
    curve: ForcedCurve[Answer],
    moved: Mapping[int, ComplexArray],
    maxima: Callable[[Array, Array], list[CurvePeak]],
) -> ForcedCurve[Answer]:
    """The curve with the accelerances of both blades and their peaks.

    Parameters
    ----------
    march
        Its outputs are the tips, then the coordinates of modes.
    moved
        Harmonic that is excited -> (n, K) mm of all outputs.
    maxima
        Frequencies and heights along the curve -> its local maxima.
    """
    excitation, stop = excitation_of(plan.scene.excitation), plan.scene.excitation.stop
    modes, f = stuck_modes_of(march, CANDIDATES * stop), curve.frequency
    blades: dict[int, dict[Side, ComplexArray]] = {
        k: {s: accelerance_of(u[:, j], f, k, curve.force) for j, s in enumerate(SIDES)}
        for k, u in moved.items()
    }
    read, peaks = blades.pop(excitation.lowest), dict[Side, tuple[CurvePeak, ...]]()
    for side in SIDES:
        found = maxima(f, np.abs(read[side]))
        at = np.array([one.sample for one in found], int)
        motion = moved[excitation.lowest][at, len(SIDES) :]
        peaks[side] = tuple(numbered(modes, found, motion))
    return replace(curve, accelerance=read, more=blades, peaks=peaks)


def sweep_maxima(frequency: Array, size: Array) -> list[CurvePeak]:
    """Local maxima of a sweep, at its own points: the motion may jump between two of them.

    Parameters
    ----------
    frequency, size
        (k,) in the order of the sweep.
    """
    if len(size) < 3:
        return []
    inner = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    least = PEAKS_ABOVE * float(size.max())
    return [
        CurvePeak(float(frequency[i]), float(size[i]), int(i)) for i in inner if size[i] >= least
    ]


def balance_curve(plan: ForcedPlan, name: str, faces: WholeFaces, ratio: float) -> FacesCurve:
    """The balance from the static state along the sweep, rising.

    Parameters
    ----------
    name
        Of the contact.
    ratio
        F_C/F_E.
    """
    b, force = plan.scene.balance, plan.scene.damper.centrifugal / ratio
    excitation = excitation_of(plan.scene.excitation)
    found = interface_response(
        faces.march,
        grid(plan),
        force * excitation.drive,
        faces.start,
        harmonics=plan.scene.balance.harmonics,
        samples=SAMPLES if b.samples == "auto" else b.samples,
        fallback=by_coulomb,
    )
    moved = {k: found.amplitude[:, k] for k in excitation.harmonics}
    curve = ForcedCurve(name, ratio, force, {}, {}, {}, found, found.seconds)
    return with_outputs(plan, faces.march, curve, moved, partial(_maxima, found.jumps))


def _maxima(jumps: Sequence[int], frequency: Array, size: Array) -> list[CurvePeak]:
    """Local maxima of a curve; none is read across a jump, and a stretch may be highest where one
    ends it.
    """
    out, begin = [], 0
    for end in (*(i + 1 for i in jumps), len(size)):
        f, a = frequency[begin:end], size[begin:end]
        out += [one._replace(sample=one.sample + begin) for one in path_maxima(f, a, 0.0)]
        for i, inner, jumped in ((0, 1, begin > 0), (len(a) - 1, len(a) - 2, end < len(size))):
            if jumped and (len(a) == 1 or a[i] > a[inner]):
                out.append(CurvePeak(float(f[i]), float(a[i]), begin + i))
        begin = end
    return [one for one in out if one.height >= PEAKS_ABOVE * size.max()]


#: outputs that are read from them
WANTS = ("contact_state", "hysteresis", "damper_motion")


def march_peaks(solution: ForcedSolution, name: str, stages: Stages) -> None:
    """Add the last period of every sweep of a stiffness at every peak of the right blade."""
    if not any(solution.plan.scene.wants(one) for one in WANTS):
        return
    for sweep in (c for c in solution.curves if c.stiffness == name):
        for top in sweep.peaks["right"]:
            with stages("time march", f"{sweep.case}, peak {top.number}: its last period"):
                solution.marched.append(marched_peak(solution, sweep, top))


def marched_peak(solution: ForcedSolution, sweep: SweptCurve, peak: CurvePeak) -> MarchedPeak:
    """The last period of a sweep at one of its peaks, integrated again and kept."""
    name = sweep.stiffness
    if name in solution.faces:
        faces = solution.faces[name]
        rest, kept = faces.start.s, list(faces.of.kept)
    else:
        # springs count from the static state
        damper = solution.models[name].damper
        rest, kept = np.zeros(damper.n_dof), list(damper.kept)
    period = period_of_sweep(sweep.answer, peak.sample, by_coulomb)
    motion = np.zeros((len(period.motion), MOTIONS))
    motion[:, kept] = period.motion - rest
    return MarchedPeak(sweep, peak, period, solution.places(name), motion)


def marched_loops(one: MarchedPeak, count: int) -> list[Loop]:
    """Loops of the nodes that lose most, as `upd.analyses.forced.measures.loops`.

    The displacement is the slip and what the springs give, f_t / k_t, about its mean: the march
    counts slips from faces that carry nothing.

    Parameters
    ----------
    one
        A peak.
    count
        Loops at most.
    """
    period, out = one.period, []
    friction = one.sweep.answer.model.friction
    for p in losing_most(period.loss, count):
        traction = period.force[:, 1:, p].T
        motion = period.slip[:, :, p].T + one.places.compliance[p] * traction
        motion -= motion.mean(axis=1, keepdims=True)
        limit = friction[p] * period.force[:, 0, p]
        out.append(loop_along_main(int(p), motion, traction, limit, float(period.loss[p])))
    return out


def marched_damper(solution: ForcedSolution, one: MarchedPeak) -> tuple[Array, Array]:
    """Motion of the damper's six dofs about its rest, as
    `upd.analyses.forced.measures.damper_motion`.

    Returns
    -------
    static, amplitude
        (6,) mean, and amplitude of the lowest harmonic that is excited, mm and rad.
    """
    k, N = excitation_of(solution.plan.scene.excitation).lowest, len(one.motion)
    turn = np.exp(-2j * np.pi * k * np.arange(1, N + 1) / N)
    return one.motion.mean(axis=0), np.abs(2.0 / N * turn @ one.motion)
