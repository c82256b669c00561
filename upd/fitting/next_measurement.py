r"""Which further measurement would tell most of what a fit leaves unknown.

What is known of ln(factor) z at the answer is, to first order, in half-widths of the targets,

    C = (J'J + P)^-1,   P = diag(1 / (half of the room between the bounds))^2:

beyond what the targets tell, the bounds are all that is known. A measurement of a number with the
derivatives g and the half-width s leaves

    C' = C - C g g'C / (s^2 + g'C g),

and is ranked by the largest eigenvalue of C', the square of the half-width of the widest direction
(E-optimality); it gains log2(1 + g'C g / s^2) / 2 bits of information (D-optimality). Where sets
that fit equally well were traced, what they predict for the number is computed along them.

References
----------
F. Pukelsheim, Optimal Design of Experiments (2006), ch. 6; A. C. Atkinson, A. N. Donev, R. D.
Tobias, Optimum Experimental Designs, with SAS (2007), ch. 10 (augmented designs).
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.errors import UpdError, one_line
from upd.fitting.intervals import Profile
from upd.fitting.residuals import Residuals
from upd.fitting.responses import FitResponses
from upd.fitting.targets import (
    CONTACT_TOTALS,
    PEAK_NUMBERS,
    STUCK_MODES,
    FitTarget,
    Targets,
)
from upd.scene import ForcedScene

log = logging.getLogger(__name__)
Array = NDArray[np.float64]
#: half-widths that are assumed of a measurement, as a part of its value, by its unit, where no
#: target has that unit
_ASSUMED = {"Hz": 1e-3, "(m/s2)/N": 0.05, "N/mm": 0.05}
#: F_C/F_E beside the scene's own, as parts of its lowest
_LOWER = (0.3, 0.1)
#: information below which a measurement is useless
_LEAST_BITS = 0.01
#: members of the longest family at which a measurement is predicted
_MEMBERS = 5


@dataclass(frozen=True)
class FurtherMeasurement:
    """What a measurement that was not made would tell.

    Attributes
    ----------
    name, unit
        Of the number, as a target names it.
    value
        At the answer.
    low, high
        What the fit predicts for it today.
    half_width
        Assumed of the measurement.
    widest
        Half-width of the widest direction today, as a factor of the inputs.
    then
        The same with the measurement.
    bits
        Of information gained.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    half_width: float
    widest: float
    then: float
    bits: float


def candidates(scene: ForcedScene, targets: Targets, *, friction: bool) -> Targets:
    """Measurements that may be made: modes and peaks of the limits, peaks with friction at the
    scene's F_C/F_E and below, contact stiffness of the damper alone.

    Parameters
    ----------
    targets
        Those that were made; they are left out.
    friction
        Whether peaks with friction are among them.
    """
    names: list[tuple[str, float | None]] = [(one, None) for one in STUCK_MODES]
    names += [(name, None) for name, (kind, *_) in PEAK_NUMBERS.items() if kind]
    if friction:
        own = scene.excitation.centrifugal_to_force
        ratios = sorted({*own, *(round(part * min(own), 6) for part in _LOWER)})
        names += [
            (name, ratio)
            for ratio in ratios
            for name, (kind, side, *_) in PEAK_NUMBERS.items()
            if not kind and side == "right"
        ]
    names += [(one, None) for one in CONTACT_TOTALS]
    made = {one.name for one in targets.numbers}
    found = [FitTarget(of, 1.0, None, _unit(of), ratio) for of, ratio in names]
    return Targets(tuple(one for one in found if one.name not in made))


def rank_measurements(
    residuals: Residuals, best: Array, traced: Sequence[Profile]
) -> tuple[FurtherMeasurement, ...]:
    """Measurements by how much each would narrow the widest direction.

    Parameters
    ----------
    residuals
        Of the fit.
    best
        (n,) the answer.
    traced
        Sets that fit as well, where they were traced.

    Returns
    -------
    tuple of FurtherMeasurement
        The most telling first; those that tell nothing are left out.
    """
    made = residuals.responses
    scene, targets = made.scene, made.targets
    friction = bool(targets.ratios) or (made.cheap and not _is_seated(scene))
    asked = candidates(scene, targets, friction=friction)
    responses = FitResponses(scene, asked, made.parameters, needed=False, like=made)
    try:
        value, slope = responses.at(best)
    except UpdError as error:
        log.info("further measurements: %s", one_line(error))
        return ()
    J = residuals.jacobian(best)
    if not residuals.known:
        J = J / np.array([[_half(one.unit, one.value, targets)] for one in targets.numbers])
        J = J * residuals.target[:, None]
    room = 0.5 * (residuals.high - residuals.low)
    C = np.linalg.inv(J.T @ J + np.diag(room**-2.0))
    now = _widest(C)
    along = _along(responses, traced) if responses.cheap else np.zeros((0, len(value)))
    out = []
    for i, one in enumerate(asked.numbers):
        g = slope[i]
        if not np.isfinite(value[i]) or not np.isfinite(g).all():
            continue
        half = _half(one.unit, float(value[i]), targets)
        spread = float(np.sqrt(g @ C @ g))
        then = C - np.outer(C @ g, C @ g) / (half**2 + spread**2)
        mine = along[np.isfinite(along[:, i]), i]
        low, high = (
            (float(mine.min()), float(mine.max()))
            if len(mine)
            else (float(value[i] - spread), float(value[i] + spread))
        )
        bits = 0.5 * float(np.log2(1.0 + (spread / half) ** 2))
        out.append(
            FurtherMeasurement(
                one.name,
                one.unit,
                float(value[i]),
                low,
                high,
                half,
                float(np.exp(now)),
                float(np.exp(_widest(then))),
                bits,
            )
        )
    telling = [one for one in out if one.bits >= _LEAST_BITS]
    return tuple(sorted(telling, key=lambda one: (one.then, -one.bits)))


def _is_seated(scene: ForcedScene) -> bool:
    return scene.contact.loaded and scene.contact.static == "seated"


def _unit(of: str) -> str:
    if of in CONTACT_TOTALS:
        return "N/mm"
    return "(m/s2)/N" if of.endswith("accelerance") else "Hz"


def _half(unit: str, value: float, targets: Targets) -> float:
    """Half-width of a measurement: relative, as the widest of the targets of that unit."""
    known = [
        one.half_width / one.value
        for one in targets.numbers
        if one.unit == unit and one.half_width is not None
    ]
    return abs(value) * max(known, default=_ASSUMED[unit])


def _widest(C: NDArray[Any]) -> float:
    """Half-width of ln(factor) along the widest direction."""
    return float(np.sqrt(np.linalg.eigvalsh(C)[-1]))


def _along(responses: FitResponses, traced: Sequence[Profile]) -> Array:
    """(k, m) numbers at members of the family that reach farthest apart."""
    if not traced:
        return np.zeros((0, responses.targets.count))
    longest = max(traced, key=lambda one: float(np.linalg.norm(np.ptp(one.z, axis=0))))
    which = np.unique(np.linspace(0, len(longest.z) - 1, _MEMBERS).astype(int))
    rows = []
    for z in longest.z[which]:
        try:
            rows.append(responses.value(z))
        except UpdError as error:
            log.info("a member of the family: %s", one_line(error))
    return np.array(rows).reshape(len(rows), responses.targets.count)
