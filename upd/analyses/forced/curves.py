"""Curves of a forced response: linear limits, with friction by harmonic balance or by sweeps.

Peaks of the limits, free and with every point stuck, of contact points and of whole faces, are
sought around their own modes: they do not depend on the frequencies asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Generic, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar

from upd.analyses.forced import measures
from upd.analyses.forced.measures import (
    CANDIDATES,
    Array,
    ComplexArray,
    CurvePeak,
    ModeShapes,
    StuckMode,
    chosen_peaks,
    numbered,
    tell_stuck_peaks,
    unmoved,
)
from upd.analyses.forced.model import Model, balance_of
from upd.analyses.forced.plan import Excitation, ForcedPlan, excitation_of, grid
from upd.analyses.forced.statics import StaticState
from upd.analyses.seated.interface import Interface
from upd.hbm import FrequencyResponse
from upd.hbm.faces.balance import InterfaceResponse
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.hbm.faces.sweep import SteppedSine
from upd.hbm.springs.balance import Balance
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


def exact_peaks(height: Callable[[Array], Array], f: Array, grid: Array) -> list[CurvePeak]:
    """The peaks of a curve, each by a local search between its neighbours.

    Parameters
    ----------
    height
        Of the curve at any frequencies (n,) in Hz.
    f
        (n,) Hz, rising, fine enough to hold every peak.
    grid
        (m,) Hz on which the curve is kept: the point next to a peak is one of these.
    """
    a = height(f)
    found = [
        _top(height, f[i - 1], f[i + 1])
        for i in np.flatnonzero((a[1:-1] > a[:-2]) & (a[1:-1] >= a[2:])) + 1
    ]
    highest = max([float(a.max(initial=0.0)), *(top for _, top in found)])
    peaks = [
        CurvePeak(at, top, int(np.abs(grid - at).argmin()))
        for at, top in found
        if top >= measures.PEAKS_ABOVE * highest
    ]
    return chosen_peaks(peaks)


def _top(height: Callable[[Array], Array], low: float, high: float) -> tuple[float, float]:
    # flat at the top: to half of the digits of f, of the height lacks (eps^1/2 f / width)^2
    found = minimize_scalar(
        lambda f: -float(height(np.array([f]))[0]),
        bounds=(low, high),
        method="bounded",
        options={"xatol": float(np.sqrt(np.finfo(float).eps)) * high},
    )
    return float(found.x), -float(found.fun)


def linear_peaks(b: Balance, row: Array, force: float, grid: Array, stuck: bool) -> list[CurvePeak]:
    """Peaks of the accelerance without contacts or with all points stuck.

    Parameters
    ----------
    row
        (n_dof,) output.
    force
        Its excitation, N.
    grid
        (n,) Hz, rising: the sweep.
    stuck
        All points closed and sticking; else without contacts.

    Returns
    -------
    list of CurvePeak
        At most the two highest within the sweep, by rising frequency; heights in (m/s2)/N.
    """
    # a mode answers where the harmonic that is read meets it
    k = measures.read_harmonic(b)
    modes, width = linear_modes(b, stuck)

    def height(f: NDArray[np.float64]) -> Array:
        return np.abs(measures.linear_accelerance(b, row, force, f, stuck))

    f = around_modes(modes / k, width / k, float(grid[0]), float(grid[-1]))
    return exact_peaks(height, f, grid)


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


def linear_curves(
    march: InterfaceModel, frequency: Array, excitation: Excitation, *, stuck: bool
) -> tuple[Mapping[Side, ComplexArray], Mapping[Side, list[CurvePeak]]]:
    """Accelerance of both blades per newton of F_E, (m/s2)/N, and its peaks, free or stuck.

    Parameters
    ----------
    frequency
        (n,) Hz, rising: the sweep.
    excitation
        What of the blades is excited.
    stuck
        Every node closed and sticking; else none touches.
    """
    k, H, peaks = excitation.lowest, _at_rest(frequency), dict[Side, list[CurvePeak]]()
    at = stuck_system(march)[0] if stuck else np.sort(march.frequency)
    width = 2.0 * float(march.damping.max()) * at
    fine = around_modes(at / k, width / k, float(frequency[0]), float(frequency[-1]))

    def read(side: Side, f: Array) -> ComplexArray:
        moved = march.linear_response(k * f, excitation.read, stuck=stuck)[:, SIDES.index(side)]
        return measures.accelerance_of(moved, f, k, 1.0)

    for side in SIDES if stuck else excitation.free_blades:
        H[side] = read(side, frequency)
        peaks[side] = exact_peaks(partial(_size, read, side), fine, frequency)
    return H, {side: peaks.get(side, []) for side in SIDES}


def _at_rest(frequency: Array) -> dict[Side, ComplexArray]:
    return {side: np.zeros(len(frequency), complex) for side in SIDES}


def _size(read: Callable[[Side, Array], ComplexArray], side: Side, f: Array) -> Array:
    return np.asarray(np.abs(read(side, f)))


def linear_of_faces(plan: ForcedPlan, march: InterfaceModel) -> LinearCurves:
    """Curves without the damper, and with every node closed and sticking."""
    frequency, excitation = grid(plan), excitation_of(plan.scene.excitation)
    free, free_peaks = linear_curves(march, frequency, excitation, stuck=False)
    stuck, stuck_peaks = linear_curves(march, frequency, excitation, stuck=True)
    shapes = stuck_modes_of(march, CANDIDATES * plan.scene.excitation.stop)
    named = {}
    for side, peaks in stuck_peaks.items():
        f = excitation.lowest * np.array([one.frequency for one in peaks])
        motion = march.linear_response(f, excitation.read, stuck=True)[:, len(SIDES) :]
        named[side] = numbered(shapes, peaks, motion)
    free_peaks = {side: unmoved(peaks) for side, peaks in free_peaks.items()}
    return LinearCurves(frequency, free, stuck, shapes.modes, free_peaks, named)


def linear_of(plan: ForcedPlan, model: Model) -> LinearCurves:
    """Free and stuck curves of a model, their peaks and modes."""
    force, stop = plan.scene.damper.centrifugal, plan.scene.excitation.stop
    b = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    f, k = grid(plan), model.excitation.lowest
    # finer around every mode: a drawn curve has its tops
    for stuck in (False, True):
        at, width = linear_modes(b, stuck)
        f = finer(f, at / k, width / k)
    curves, peaks = (_at_rest(f), _at_rest(f)), (dict[Side, Peaks](), dict[Side, Peaks]())
    for side in SIDES:
        row = model.row(side)
        for stuck in (False, True):
            found: Peaks = []
            if stuck or side in model.excitation.free_blades:
                curves[stuck][side] = measures.linear_accelerance(b, row, force, f, stuck)
                found = linear_peaks(b, row, force, f, stuck)
            peaks[stuck][side] = tell_stuck_peaks(model, found, stop) if stuck else unmoved(found)
    return LinearCurves(f, *curves, measures.stuck_modes(model, CANDIDATES * stop), *peaks)


def stuck_frequency(modes: Iterable[StuckMode], in_phase: bool) -> float:
    """The lowest in Hz, in or out of phase; nan without."""
    found = (m.frequency for m in modes if m.in_phase == in_phase)
    return next(found, math.nan)


def fine_grid(
    plan: ForcedPlan, model: Model, force: float, frequencies: Array | None = None
) -> Array:
    """Frequencies of the sweep in Hz, and finer ones around stuck modes where they are too coarse
    for these.

    Parameters
    ----------
    plan, model
        Of the rig.
    force
        F_E, N.
    frequencies
        (n,) Hz in place of those of the sweep.
    """
    k = model.excitation.lowest
    problem = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    modes, width = linear_modes(problem, True)
    return finer(grid(plan) if frequencies is None else frequencies, modes / k, width / k)
