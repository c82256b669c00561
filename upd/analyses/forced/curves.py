"""Curves of a forced response: linear limits, with friction by harmonic balance or by sweeps.

Peaks of the limits, free and with every point stuck, of contact points and of whole faces, are
sought around their own modes: they do not depend on the frequencies asked for.

A sweep is a stepped sine up and down, as in an experiment: where friction and lift-off leave
several steady motions, a curve by harmonic balance follows one path through all of them. A sweep
shows what a rig would: rising, the motion that the past below leads to; falling, that from above.

Whole faces by harmonic balance have blades in frequency, damper and contact in time, see
`upd.hbm.faces.balance`: every node with its past, as a sweep from the static state at rising
frequency.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Generic, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar

from upd.analyses.forced import measures
from upd.analyses.forced.interface_model import WholeFaces, by_coulomb
from upd.analyses.forced.measures import Array, ComplexArray, ModeShapes, StuckMode
from upd.analyses.forced.model import Model, balance_of
from upd.analyses.forced.plan import Excitation, ForcedPlan, excitation_of, grid, time_steps
from upd.analyses.measured import CurvePeak
from upd.hbm import FrequencyResponse
from upd.hbm.faces.balance import InterfaceResponse, interface_response
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.hbm.faces.sweep import RecordedPeriod, SteppedSine, stepped_sine
from upd.hbm.springs.balance import Balance
from upd.linalg.parallel import threads_for
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
        Where a slow sweep up jumps: the end of a branch of the right blade, and the highest that it
        reaches after the jump.
    periods
        Number of a peak of the right blade -> the last period there, of a sweep.
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
    folds: tuple[tuple[CurvePeak, CurvePeak], ...] = ()
    periods: Mapping[int, RecordedPeriod] = field(default_factory=dict)

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


#: a curve of contact points, and of whole faces, by harmonic balance; a sweep
PointCurve = ForcedCurve[FrequencyResponse]
FacesCurve = ForcedCurve[InterfaceResponse]
SweptCurve = ForcedCurve[SteppedSine]


def rising(frequency: Array) -> NDArray[np.bool_]:
    """(n,) whether the frequency rises along a path: between two folds, where it falls, the motion
    is unstable.

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


# -- linear limits ---------------------------------------------------------------------------------


#: half-power widths on each side of a mode in which its peak is sought, and of a width between two
#: points there
_WIDTHS, QUARTER = 3, 0.25
Peaks = list[CurvePeak]


def linear_modes(balance: Balance, stuck: bool) -> tuple[Array, Array]:
    """Natural frequencies and half-power widths without contacts or with all points stuck.

    In the mass-normalised modes of the system without contacts, K = Lambda + Psi^T k Psi and
    C = Phi^T C Phi. A mode v of it, w^2 = v^T K v, has the width 2 zeta f = v^T C v / (2 pi).

    Returns
    -------
    frequency, width
        (m,) Hz, rising; widths as if the damping did not couple the modes.

    References
    ----------
    D. J. Ewins, Modal Testing: Theory, Practice and Application, 2nd ed. (2000), 2.4 and 4.2.
    """
    modal, Psi = balance.modal, balance.Psi
    k = balance.stuck_stiffness.ravel() if stuck else np.zeros(len(Psi))
    values, shapes = eigh(np.diag(modal.eigenvalues) + Psi.T @ (k[:, None] * Psi))
    C = np.diag(modal.damping) if modal.proportional else modal.damping
    width = np.einsum("ij,ik,kj->j", shapes, C, shapes) / (2.0 * np.pi)
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), np.maximum(width, 0.0)


def around_modes(frequency: Array, width: Array, start: float, stop: float) -> Array:
    """Frequencies (n,) from start to stop in Hz that pass every mode in steps of a quarter of its
    half-power width.
    """
    steps = np.linspace(-_WIDTHS, _WIDTHS, round(2 * _WIDTHS / QUARTER) + 1)
    near = (frequency[:, None] + width[:, None] * steps).ravel()
    inside = near[(near > start) & (near < stop)]
    return np.unique(np.concatenate([[start], inside, [stop]]))


def finer(frequency: Array, modes: Array, width: Array) -> Array:
    """Frequencies of a sweep, and around every mode that they are too coarse for, further apart
    than a quarter of its half-power width, such ones.

    Between coarser ones a curve has peaks that no point shows, and contact points begin to slip
    unseen.

    Parameters
    ----------
    frequency
        (n,) Hz, rising.
    modes, width
        (m,) Hz.
    """
    if len(frequency) < 2:
        return frequency
    place = np.clip(np.searchsorted(frequency, modes) - 1, 0, len(frequency) - 2)
    coarse = np.diff(frequency)[place] > QUARTER * width
    ends = float(frequency[0]), float(frequency[-1])
    return np.union1d(frequency, around_modes(modes[coarse], width[coarse], *ends))


class Limit(NamedTuple):
    """A linear limit as a function of frequency: no contacts, or all of them closed and sticking.

    Attributes
    ----------
    harmonic, force
        That is read; N.
    modes, width
        (m,) Hz, where this harmonic meets the modes, and their half-power widths.
    moved
        (n,) Hz -> (n, K) amplitudes of coordinates, mm.
    rows
        Side -> (K,) displacement along x at the accelerometer.
    moving
        Blades that move.
    shapes
        Stuck modes on the last of the coordinates; None without contacts: peaks are then numbered
        by frequency.
    """

    harmonic: int
    force: float
    modes: Array
    width: Array
    moved: Callable[[Array], ComplexArray]
    rows: Mapping[Side, Array]
    moving: Sequence[Side]
    shapes: ModeShapes | None = None

    def accelerance(self, side: Side, f: Array) -> ComplexArray:
        """(n,) (m/s2)/N of a blade at (n,) Hz."""
        return measures.accelerance_of(
            self.moved(f) @ self.rows[side], f, self.harmonic, self.force
        )

    def peaks(self, side: Side, grid: Array) -> Peaks:
        """At most the two highest of a blade within (n,) Hz, rising, each by a local search,
        numbered; none of one at rest. The point next to a peak is one of these frequencies.
        """
        if side not in self.moving:
            return []
        response = partial(self.accelerance, side)
        f = around_modes(self.modes, self.width, float(grid[0]), float(grid[-1]))
        a = np.abs(response(f))
        tops = np.flatnonzero((a[1:-1] > a[:-2]) & (a[1:-1] >= a[2:])) + 1
        # flat at the top: to half of the digits of f, of the height lacks (eps^1/2 f / width)^2
        every = [
            minimize_scalar(
                lambda at: -float(abs(response(np.array([at]))[0])),
                bounds=(f[i - 1], f[i + 1]),
                method="bounded",
                options={"xatol": float(np.sqrt(np.finfo(float).eps)) * f[i + 1]},
            )
            for i in tops
        ]
        highest = max([float(a.max(initial=0.0)), *(-float(one.fun) for one in every)])
        peaks = [
            CurvePeak(float(one.x), -float(one.fun), int(np.abs(grid - one.x).argmin()))
            for one in every
            if -one.fun >= measures.PEAKS_ABOVE * highest
        ]
        found = sorted(sorted(peaks, key=lambda one: -one.height)[:2])
        if self.shapes is None or not found:
            return [peak._replace(number=k) for k, peak in enumerate(found, 1)]
        motion = self.moved(np.array([one.frequency for one in found]))
        return measures.numbered(self.shapes, found, motion[:, -len(self.shapes.M) :])


def point_limit(plan: ForcedPlan, model: Model, stuck: bool) -> Limit:
    """A limit of contact points, with F_C as excitation."""
    e, force, k = plan.scene.excitation, plan.scene.damper.centrifugal, model.excitation.lowest
    b = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    modes, width = linear_modes(b, stuck)
    return Limit(
        k,
        force,
        modes / k,
        width / k,
        lambda f: b.linear_displacement(2.0 * np.pi * f, stuck, k),
        {side: model.row(side) for side in SIDES},
        SIDES if stuck else model.excitation.free_blades,
        measures.mode_shapes(model, measures.CANDIDATES * e.stop) if stuck else None,
    )


def faces_limit(march: InterfaceModel, excitation: Excitation, stop: float, stuck: bool) -> Limit:
    """A limit of whole faces in a sweep up to so many Hz, per newton of F_E."""
    k = excitation.lowest
    at = stuck_system(march)[0] if stuck else np.sort(march.frequency)
    outputs = np.eye(len(march.seen_modes))
    return Limit(
        k,
        1.0,
        at / k,
        2.0 * float(march.damping.max()) * at / k,
        lambda f: march.linear_response(k * f, excitation.read, stuck=stuck),
        dict(zip(SIDES, outputs, strict=False)),
        SIDES if stuck else excitation.free_blades,
        stuck_modes_of(march, measures.CANDIDATES * stop) if stuck else None,
    )


def linear_curves(plan: ForcedPlan, free: Limit, stuck: Limit) -> LinearCurves:
    """Curves of both limits, their peaks and modes."""
    f, limits = grid(plan), (free, stuck)
    # finer around every mode: a drawn curve has its tops
    for one in limits:
        f = finer(f, one.modes, one.width)
    curves: list[dict[Side, ComplexArray]] = [
        {
            side: one.accelerance(side, f) if side in one.moving else np.zeros(len(f), complex)
            for side in SIDES
        }
        for one in limits
    ]
    peaks = [{side: one.peaks(side, f) for side in SIDES} for one in limits]
    modes = stuck.shapes.modes if stuck.shapes else []
    return LinearCurves(f, curves[0], curves[1], modes, peaks[0], peaks[1])


def linear_of(plan: ForcedPlan, model: Model) -> LinearCurves:
    """Free and stuck curves of a model, their peaks and modes."""
    return linear_curves(plan, *(point_limit(plan, model, stuck) for stuck in (False, True)))


def stuck_system(march: InterfaceModel) -> tuple[Array, Array, Array]:
    r"""Modes with every contact closed and sticking.

    With the relative motion held, f = G^-1 (B s - Phi q), and
    K = [[Lambda + Phi' G^-1 Phi, -Phi' G^-1 B], [-B' G^-1 Phi, B' G^-1 B]] on (q, s),
    M = diag(1, M_D).

    Parameters
    ----------
    march
        Its first two outputs are the tips along x.

    Returns
    -------
    frequency, shapes, tips
        (k,) Hz rising; (m, k) in the coordinates of the blades' modes; (2, k) of both tips.
    """
    m = len(march.frequency)
    both = np.hstack([-march.shapes, march.columns])
    force = np.linalg.solve(march.compliance, both)
    K = both.T @ force
    K[:m, :m] += np.diag(march.omega**2)
    M = np.eye(len(K))
    M[m:, m:] = march.mass
    values, shapes = eigh(0.5 * (K + K.T), M)
    tips = march.seen_modes[:2] @ shapes[:m] + march.seen_contact[:2] @ (force @ shapes)
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), shapes[:m], tips


def stuck_modes_of(march: InterfaceModel, below: float) -> ModeShapes:
    """Stuck modes that move the tips along x, on the outputs behind the tips.

    Parameters
    ----------
    march
        Its first two outputs are the tips along x, the others coordinates of blades' modes.
    below
        Hz; modes above are left out.
    """
    frequency, shapes, tips = stuck_system(march)
    rows = march.seen_modes[len(SIDES) :]
    return measures.modes_of_tips(np.eye(len(rows)), frequency, rows @ shapes, tips, below)


def stuck_frequency(modes: Iterable[StuckMode], in_phase: bool) -> float:
    """The lowest in Hz, in or out of phase; nan without."""
    found = (m.frequency for m in modes if m.in_phase == in_phase)
    return next(found, math.nan)


def fine_grid(plan: ForcedPlan, model: Model, frequencies: Array | None = None) -> Array:
    """Frequencies of the sweep in Hz, and finer ones around stuck modes where they are too coarse
    for these.

    Parameters
    ----------
    plan, model
        Of the rig.
    frequencies
        (n,) Hz in place of those of the sweep.
    """
    limit = point_limit(plan, model, True)
    return finer(grid(plan) if frequencies is None else frequencies, limit.modes, limit.width)


# -- sweeps, and whole faces by harmonic balance ---------------------------------------------------


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
            maxima = partial(measures.path_maxima, between=False)
            out.append(with_outputs(plan, march, curve, moved, maxima))
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
    modes, f = stuck_modes_of(march, measures.CANDIDATES * stop), curve.frequency
    blades: dict[int, dict[Side, ComplexArray]] = {
        k: {s: measures.accelerance_of(u[:, j], f, k, curve.force) for j, s in enumerate(SIDES)}
        for k, u in moved.items()
    }
    read, peaks = blades.pop(excitation.lowest), dict[Side, tuple[CurvePeak, ...]]()
    for side in SIDES:
        found = maxima(f, np.abs(read[side]))
        at = np.array([one.sample for one in found], int)
        motion = moved[excitation.lowest][at, len(SIDES) :]
        peaks[side] = tuple(measures.numbered(modes, found, motion))
    return replace(curve, accelerance=read, more=blades, peaks=peaks)


def balance_curve(plan: ForcedPlan, name: str, faces: WholeFaces, ratio: float) -> FacesCurve:
    """The balance from the static state along the sweep, rising.

    Parameters
    ----------
    name
        Of the contact.
    ratio
        F_C/F_E.
    """
    force, excitation = plan.scene.damper.centrifugal / ratio, excitation_of(plan.scene.excitation)
    found = interface_response(
        faces.march,
        grid(plan),
        force * excitation.drive,
        faces.start,
        harmonics=plan.scene.balance.harmonics,
        samples=time_steps(plan.scene),
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
        out += [one._replace(sample=one.sample + begin) for one in measures.path_maxima(f, a, 0.0)]
        for i, inner, jumped in ((0, 1, begin > 0), (len(a) - 1, len(a) - 2, end < len(size))):
            if jumped and (len(a) == 1 or a[i] > a[inner]):
                out.append(CurvePeak(float(f[i]), float(a[i]), begin + i))
        begin = end
    return [one for one in out if one.height >= measures.PEAKS_ABOVE * size.max()]
