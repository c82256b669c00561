"""Performance curve: the peaks of both blades over F_C/F_E, from whole curves.

One whole curve by harmonic balance at every F_C/F_E, from those at which every point sticks down to
those at which the damper hardly matters; a few more beside the best one. Nothing is followed, so
nothing is lost: a curve shows all its peaks.

Damping over amplitude: the damped nonlinear modes of both blades, in phase and out of phase.
Amplitudes are those of the accelerometers, in the fundamental harmonic. Where all gaps are closed
at rest only amplitude over F_C matters: one curve serves every F_C and every excitation.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh

from upd.analyses.forced import measures
from upd.analyses.forced.curves import LinearCurves, PointCurve, fine_grid, stuck_frequency
from upd.analyses.forced.measures import numbered_peaks
from upd.analyses.forced.model import LONG_STEPS, SWEEP_POINTS, Array, Model, balance_of
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.measured import CurvePeak
from upd.errors import InputError
from upd.hbm import nonlinear_mode
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.points import Start
from upd.hbm.springs.response import parabola, response_of
from upd.linalg.parallel import threads_for
from upd.results import Case, Result, variable
from upd.results import quantities as q
from upd.results.netcdf import Variable
from upd.scene.forced_contact import SIDES, Side

#: points of a path from one end, before that from the other is taken
MOST_PATH_POINTS = 600


class RatioPoint(NamedTuple):
    """The peaks of both blades at one F_C/F_E; whether the curve reached its end."""

    ratio: float
    peaks: tuple[CurvePeak, ...]
    arrived: bool

    @property
    def worst(self) -> CurvePeak:
        """The highest of both blades and all modes, of a point with peaks."""
        return max(self.peaks, key=lambda one: one.height)


@dataclass(frozen=True)
class Performance:
    """Peaks over F_C/F_E.

    Attributes
    ----------
    points
        The curves, F_C/F_E rising.
    free, stuck
        Highest peaks of both limits, (m/s2)/N.
    finer
        A point near the best one, and the same with more harmonics; None where these are not
        solved.
    """

    points: tuple[RatioPoint, ...]
    free: float
    stuck: float
    finer: tuple[RatioPoint, RatioPoint] | None = None

    @property
    def known(self) -> list[RatioPoint]:
        """The points with a peak."""
        return [one for one in self.points if one.peaks and one.arrived]

    @property
    def best(self) -> RatioPoint | None:
        """The point whose highest peak is lowest; None without points."""
        return min(self.known, key=lambda one: one.worst.height, default=None)

    @property
    def inside(self) -> bool:
        """Whether the best is no end of the curve."""
        return self.best is not None and self.best not in (self.known[0], self.known[-1])

    def beside_best(self) -> list[float]:
        """F_C/F_E between the best one and its neighbours."""
        if len(self.known) < 3:
            return []
        ratios = [one.ratio for one in self.known]
        k = int(np.argmin([one.worst.height for one in self.known]))
        return [math.sqrt(a * b) for a, b in pairwise(ratios[max(k - 1, 0) : k + 2])]

    def factor_two(self) -> tuple[float, float] | None:
        """The highest peak at half and at twice the best F_C/F_E, over that at the best: between
        those of the curve on logarithmic axes, nan beyond its ends.
        """
        best, known = self.best, self.known
        if best is None:
            return None
        x = np.log([one.ratio for one in known])
        y = np.log([one.worst.height for one in known])
        at = math.log(best.ratio) + np.log([0.5, 2.0])
        low, high = np.exp(np.interp(at, x, y, left=np.nan, right=np.nan)) / best.worst.height
        return float(low), float(high)


def peaks_at(
    plan: ForcedPlan,
    model: Model,
    ratio: float,
    start: Start | None = None,
) -> RatioPoint:
    """The peaks of the whole curve at one F_C/F_E.

    Parameters
    ----------
    start
        Of the sliders; that of the scene when None.
    """
    force, e = plan.scene.damper.centrifugal / ratio, plan.scene
    span = np.linspace(e.excitation.start, e.excitation.stop, SWEEP_POINTS)
    sweep = fine_grid(plan, model, span)
    settings = replace(LONG_STEPS, most_points=MOST_PATH_POINTS)
    b = balance_of(plan, model, force, start=start)
    found: dict[tuple[Side, int], CurvePeak] = {}
    up_to = -math.inf
    with threads_for(len(model.M)):
        for down in (False, True):
            answer = response_of(b, sweep, down, True, settings)
            f = answer.frequency
            for side in SIDES if len(f) else ():
                size = np.abs(measures.accelerance(answer, model.row(side), force))
                for peak in numbered_peaks(model, answer, size, e.excitation.stop):
                    known = found.get((side, peak.number))
                    if known is None or peak.height > known.height:
                        found[side, peak.number] = peak._replace(blade=side)
            whole = answer.arrived or (down and float(f.min(initial=math.inf)) <= up_to)
            up_to = float(f.max(initial=-math.inf))
            if whole:
                break
    # what one path does not reach the one from the other end does
    return RatioPoint(ratio, tuple(found.values()), whole)


def of_curve(curve: PointCurve) -> RatioPoint:
    """The peaks of a curve of the run."""
    found = [p._replace(blade=s) for s in SIDES for p in curve.peaks[s]]
    return RatioPoint(curve.ratio, tuple(found), not curve.stopped)


def performance_of(
    linear: LinearCurves, points: Iterable[RatioPoint], curves: Iterable[PointCurve]
) -> Performance:
    """The performance curve.

    Parameters
    ----------
    linear
        Limits of the contact stiffness.
    points
        Those of `peaks_at`.
    curves
        Of the run, of the same contact stiffness: of two of the same F_C/F_E the one that arrived
        counts, its own first.
    """
    found = list(points)
    for one in map(of_curve, curves):
        same = [p for p in found if math.isclose(p.ratio, one.ratio, rel_tol=1e-6)]
        if one.arrived or not same:
            found = [*(p for p in found if p not in same), one]
    free, stuck = (
        max((p.height for s in SIDES for p in peaks[s]), default=math.nan)
        for peaks in (linear.free_peaks, linear.stuck_peaks)
    )
    return Performance(tuple(sorted(found, key=lambda one: one.ratio)), free, stuck)


# -- numbers and arrays ----------------------------------------------------------------------------


def performance_results(name: str, found: Performance) -> list[Result]:
    """F_C/F_E reached, the best one with its highest peak, and what a factor 2 costs."""
    case, known = Case(stiffness=name, name="performance"), found.known
    results = []
    if known:
        results = [
            q.LOWEST_RATIO.of(known[0].ratio, case),
            q.HIGHEST_RATIO.of(known[-1].ratio, case),
        ]
    best, twice = found.best, found.factor_two()
    if best is None or twice is None:
        reason = "no curve has a peak: widen excitation.start and stop"
        return results + [quantity.withheld(case, reason) for quantity in q.BEST]
    results.append(q.BEST_INSIDE.of(found.inside, case))
    worst = best.worst
    at = replace(case, mode=worst.mode, blade=worst.blade)
    values = (
        best.ratio,
        worst.height,
        worst.frequency,
        1.0 - worst.height / found.free,
        *(one - 1.0 for one in twice),
    )
    return results + [
        quantity.of(value, at)
        for quantity, value in zip(q.BEST, values, strict=True)
        if np.isfinite(value)
    ]


def performance_arrays(found: Performance) -> dict[str, Any]:
    """Peaks of both blades over F_C/F_E, nan where a mode has none; the highest, and the limits."""
    points, at = found.known, "point"
    ratio = np.array([one.ratio for one in points])
    modes = {(p.blade, p.number): p.mode for one in points for p in one.peaks}
    out: dict[str, Any] = {
        "ratio": variable(at, ratio, "1", "F_C/F_E"),
        "highest_accelerance": variable(
            at,
            [one.worst.height for one in points],
            "(m/s2)/N",
            "highest peak of both blades and all modes",
        ),
        "free_peak": variable("", found.free, "(m/s2)/N"),
        "stuck_peak": variable("", found.stuck, "(m/s2)/N"),
    }
    for (blade, number), mode in sorted(modes.items()):
        rows = np.full((2, len(points)), np.nan)
        for k, p in ((k, p) for k, one in enumerate(points) for p in one.peaks):
            if (p.blade, p.number) == (blade, number):
                rows[:, k] = p.frequency, p.height
        about = {"mode": mode, "blade": blade}
        out[f"peak_{number}_frequency_{blade}"] = variable(at, rows[0], "Hz", **about)
        out[f"peak_{number}_accelerance_{blade}"] = variable(at, rows[1], "(m/s2)/N", **about)
    if best := found.best:
        out |= {
            "best_ratio": variable("", best.ratio, "1", "F_C/F_E"),
            "best_accelerance": variable("", best.worst.height, "(m/s2)/N"),
        }
    return out


# -- damping over amplitude ------------------------------------------------------------------------


#: amplitudes over that of the first slip: from sticking to slipping everywhere
SPAN = (0.5, 100.0)
#: of the path, at least and at most: the ready symmetric damper's in phase takes 726, as it opens
POINTS, MOST_MODE_POINTS = 40, 800
#: metres in a millimetre
_M = 1e-3


def mode_over_amplitude(
    plan: ForcedPlan, model: Model, linear: LinearCurves, stiffness: str, in_phase: bool
) -> tuple[Case, dict[str, Variable]]:
    """The lowest mode in phase or out of phase, from sticking to slipping everywhere.

    Returns
    -------
    tuple
        Contact stiffness and mode, with where the path ended early as its choice; the curve.

    Raises
    ------
    InputError
        Without such a mode in the sweep, and where nothing sticks at rest.
    """
    scene, mode = plan.scene, "in phase" if in_phase else "out of phase"
    stuck = stuck_frequency(linear.modes, in_phase)
    if not np.isfinite(stuck):
        raise InputError(f"nonlinear modes: no stuck mode {mode}: widen excitation.stop")
    numbers = scene.harmonic_numbers
    b = balance_of(plan, model, scene.damper.centrifugal, numbers)
    values, shapes = eigh(b.stuck_modal_stiffness)
    omega = np.sqrt(np.maximum(values, 0.0))
    k = int(np.abs(omega - 2.0 * np.pi * stuck).argmin())
    first = first_slip(b, shapes[:, k], float(omega[k]))
    rigid = int((values <= len(values) * np.finfo(float).eps * values[-1]).sum())
    found = nonlinear_mode(
        replace(model.system, harmonics=numbers, samples=b.samples, start=scene.balance.slider),
        mode=k - rigid + 1,
        amplitudes=first * np.geomspace(*SPAN, POINTS),
        settings=replace(LONG_STEPS, most_points=MOST_MODE_POINTS),
    )
    square = (2.0 * np.pi * found.frequency) ** 2
    shares = found.state.mean(axis=1)
    at, words = "point", "share of all points and the cycle"
    out = {
        "frequency": variable(at, found.frequency, "Hz", message=found.message),
        "damping": variable(at, found.damping, "1", "damping ratio"),
        "slip": variable(at, shares[:, 1], "1", words),
        "lift": variable(at, shares[:, 2], "1", words),
        "stuck_frequency": variable("", stuck, "Hz"),
        "centrifugal_force": variable("", scene.damper.centrifugal, "N"),
    }
    for side in SIDES:
        acceleration = _M * found.motion(model.row(side)) * square
        out[f"acceleration_{side}"] = variable(at, acceleration, "m/s2")
    ended = "" if found.status == "complete" else f"path ended after {len(square)} points"
    return Case(stiffness=stiffness, mode=mode, choice=ended), out


def first_slip(b: Balance, shape: Array, omega: float) -> float:
    """Amplitude of a stuck mode at which the first point begins to slip.

    N and T of a point move on a straight line, N_0 + a n and T_0 + a t for -1 <= cos <= 1; it slips
    at the smallest a with |T_0 + a t| = mu (N_0 + a n).

    Parameters
    ----------
    b
        The problem.
    shape, omega
        (m,) of the mode on the modes of the problem; rad/s.

    Raises
    ------
    InputError
        Where no point sticks at rest, or none ever slips.
    """
    stiffness = b.stuck_stiffness
    rest = b.split(b.stuck(omega))[0][..., 0] * stiffness + b.stuck_constant
    moved = (b.Psi @ shape).reshape(rest.shape) * stiffness
    mu = b.contacts.law.mu
    limit, slope = mu * rest[:, 0], mu * moved[:, 0]
    C = np.sum(rest[:, 1:] ** 2, axis=1) - limit**2
    A = np.sum(moved[:, 1:] ** 2, axis=1) - slope**2
    # one row for each way
    B = np.outer([2.0, -2.0], np.sum(rest[:, 1:] * moved[:, 1:], axis=1) - limit * slope)
    inside = B**2 - 4.0 * A * C
    below = B + np.sqrt(np.maximum(inside, 0.0))
    good = (C < 0.0) & (inside >= 0.0) & (below > 0.0)
    found = np.divide(-2.0 * C, below, out=np.full_like(below, np.inf), where=good)
    if not np.isfinite(least := float(found.min())):
        raise InputError(
            "nonlinear modes: no point sticks at rest and slips as the amplitude grows; give "
            'contact.friction, or contact.static = "frictionless"'
        )
    return least


def mode_results(case: Case, curve: Mapping[str, Variable]) -> list[Result]:
    """Largest damping; where it is, and what F_C puts a vibration there, unless it still rises at
    the largest amplitude.
    """
    a, damping = curve["acceleration_right"].data, curve["damping"].data
    log_a = np.log(a)
    at, zeta = parabola(log_a, damping)
    near = np.argsort(log_a)
    frequency = float(np.interp(at, log_a[near], curve["frequency"].data[near]))
    acceleration = float(np.exp(at))
    values = {
        q.DAMPING_ACCELERATION: acceleration,
        q.DAMPING_FREQUENCY: frequency,
        q.DAMPING_SHIFT: frequency / float(curve["stuck_frequency"].data) - 1.0,
        q.FORCE_FOR_DAMPING: float(curve["centrifugal_force"].data) / acceleration,
    }
    largest = q.LARGEST_DAMPING.of(zeta, case)
    if damping.argmax() == a.argmax():
        # it still rises
        return [largest]
    return [largest, *(quantity.of(value, case) for quantity, value in values.items())]
