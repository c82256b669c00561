"""Damping over amplitude: the damped nonlinear modes of both blades, in phase and out of phase.

Amplitudes are those of the accelerometers, in the fundamental harmonic. Where all gaps are closed
at rest only amplitude over F_C matters: one curve serves every F_C and every excitation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from upd.analyses.forced.curves import LinearCurves
from upd.analyses.forced.linear_limits import stuck_frequency
from upd.analyses.forced.model import LONG_STEPS, Array, Model, balance_of
from upd.analyses.forced.plan import ForcedPlan
from upd.errors import InputError
from upd.hbm import nonlinear_mode
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.points import stuck_stiffness
from upd.hbm.springs.response import parabola
from upd.results import Case, Result, variable
from upd.results import quantities as q
from upd.scene.forced_contact import SIDES, Side

#: amplitudes over that of the first slip: from sticking to slipping everywhere
SPAN = (0.5, 100.0)
#: of the path, at least and at most
POINTS, MOST_POINTS = 40, 400
#: metres in a millimetre
_M = 1e-3


@dataclass(frozen=True)
class ModeCurve:
    """A mode over its amplitude.

    Attributes
    ----------
    case
        Contact stiffness and mode; its choice says where the path ended early.
    acceleration
        Side -> (n,) amplitude along x at the accelerometer, m/s2.
    frequency, damping
        (n,) Hz, and damping ratio.
    slip, lift
        (n,) shares of the contact that slips and opens, of all points and the cycle.
    stuck
        Hz with all points sticking.
    centrifugal
        F_C, N.
    message
        Where and why the path ended.
    """

    case: Case
    acceleration: Mapping[Side, Array]
    frequency: Array
    damping: Array
    slip: Array
    lift: Array
    stuck: float
    centrifugal: float
    message: str


def mode_over_amplitude(
    plan: ForcedPlan, model: Model, linear: LinearCurves, stiffness: str, in_phase: bool
) -> ModeCurve:
    """The lowest mode in phase or out of phase, from sticking to slipping everywhere.

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
        **model.system,
        mode=k - rigid + 1,
        amplitudes=first * np.geomspace(*SPAN, POINTS),
        harmonics=numbers,
        samples=b.samples,
        start=scene.balance.slider,
        settings=replace(LONG_STEPS, most_points=MOST_POINTS),
    )
    square = (2.0 * np.pi * found.frequency) ** 2
    shares = found.state.mean(axis=1)
    ended = "" if found.status == "complete" else f"path ended after {len(square)} points"
    return ModeCurve(
        Case(stiffness=stiffness, mode=mode, choice=ended),
        {side: _M * found.motion(model.row(side)) * square for side in SIDES},
        found.frequency,
        found.damping,
        shares[:, 1],
        shares[:, 2],
        stuck,
        scene.damper.centrifugal,
        found.message,
    )


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
    stiffness = stuck_stiffness(b.contacts)
    rest = b.split(b.stuck(omega))[0][..., 0] * stiffness + b.stuck_constant
    moved = (b.Psi @ shape).reshape(rest.shape) * stiffness
    mu = b.contacts.law.mu
    limit, slope = mu * rest[:, 0], mu * moved[:, 0]
    C = np.sum(rest[:, 1:] ** 2, axis=1) - limit**2
    A = np.sum(moved[:, 1:] ** 2, axis=1) - slope**2
    found = [np.inf]
    for sign in (1.0, -1.0):
        B = 2.0 * sign * (np.sum(rest[:, 1:] * moved[:, 1:], axis=1) - limit * slope)
        inside = B**2 - 4.0 * A * C
        below = B + np.sqrt(np.maximum(inside, 0.0))
        good = (C < 0.0) & (inside >= 0.0) & (below > 0.0)
        found += list(-2.0 * C[good] / below[good])
    if not np.isfinite(least := float(min(found))):
        raise InputError(
            "nonlinear modes: no point sticks at rest and slips as the amplitude grows; give "
            'contact.friction, or contact.static = "frictionless"'
        )
    return least


# -- numbers and arrays ----------------------------------------------------------------------------


def mode_results(curve: ModeCurve) -> list[Result]:
    """Largest damping; where it is, and what F_C puts a vibration there, unless it still rises at
    the largest amplitude.
    """
    case = curve.case
    a = curve.acceleration["right"]
    log_a = np.log(a)
    at, zeta = parabola(log_a, curve.damping)
    near = np.argsort(log_a)
    frequency = float(np.interp(at, log_a[near], curve.frequency[near]))
    acceleration = float(np.exp(at))
    values = {
        q.DAMPING_ACCELERATION: acceleration,
        q.DAMPING_FREQUENCY: frequency,
        q.DAMPING_SHIFT: frequency / curve.stuck - 1.0,
        q.FORCE_FOR_DAMPING: curve.centrifugal / acceleration,
    }
    largest = q.LARGEST_DAMPING.of(zeta, case)
    if curve.damping.argmax() == a.argmax():
        # it still rises
        return [largest]
    return [largest, *(quantity.of(value, case) for quantity, value in values.items())]


def mode_arrays(curve: ModeCurve) -> dict[str, Any]:
    """The curve, over its points."""
    at = "point"
    out: dict[str, Any] = {
        "frequency": variable(at, curve.frequency, "Hz", message=curve.message),
        "damping": variable(at, curve.damping, "1", "damping ratio"),
        "slip": variable(at, curve.slip, "1", "share of all points and the cycle"),
        "lift": variable(at, curve.lift, "1", "share of all points and the cycle"),
        "stuck_frequency": variable("", curve.stuck, "Hz"),
        "centrifugal_force": variable("", curve.centrifugal, "N"),
    }
    for side in SIDES:
        out[f"acceleration_{side}"] = variable(at, curve.acceleration[side], "m/s2")
    return out
