"""Residuals of a fit, and the nearest answer to a start by bounded least squares.

With residuals r_i = (value_i - target_i) / scale_i and the logarithms z of the factors,

    min 1/2 |r(z)|^2,   low <= z <= high,

by the trust-region reflective method. Scales of measured curves are stated half-widths, or 95 %
ones estimated from what the fit leaves.

With residuals r of N values and p inputs, the noise sigma^2 = (a |H|)^2 + b^2 follows by
`upd.measured.damping` and the half-width is t sigma, t of Student's distribution with N - p degrees
of freedom at 95 %. It holds for independent errors: what the curve has and the model has not makes
neighbouring residuals alike, and `CurveNoise.correlation` shows it.

References
----------
M. A. Branch, T. F. Coleman, Y. Li, SIAM J. Sci. Comput. 21 (1999) 1.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import qmc
from scipy.stats import t as student

from upd.errors import ConvergenceError, UpdError, one_line
from upd.fitting.models import STEP
from upd.fitting.responses import FitResponses
from upd.fitting.targets import CurveTarget
from upd.measured.damping import noise_of

Array = NDArray[np.float64]
#: half of the digits: below, a change of an exact number is rounding
ROUNDING = float(np.sqrt(np.finfo(float).eps))
#: to so much of its frequency a peak with friction is climbed
CLIMBED = 1e-6
#: change of ln(factor) below which the fit of a curve ends
FLAT = 1e-6
#: evaluations of one start at most
EVALUATIONS = 100
#: share of the room between the bounds that a start keeps away from them
_ROOM = 1e-6
#: probability with which an estimated half-width holds
PROBABILITY = 0.95


@dataclass(frozen=True)
class Start:
    """Where one start ended.

    Attributes
    ----------
    begin, end : ndarray
        (n,) ln(factor); the end is the begin where it failed.
    misfit : float
        |r|^2; infinite where it failed.
    failure : str
        Why it failed, "" where it did not.
    """

    begin: Array
    end: Array
    misfit: float
    failure: str = ""


class Residuals:
    """Residuals of a fit and their Jacobian.

    Parameters
    ----------
    responses
        What is aimed at.

    Attributes
    ----------
    curves : list of CurveNoise
        What the weights of the measured curves are made of.
    coarse : bool
        Whether curves count by the logarithms of their magnitudes, which lead to the answer from
        far: a peak at another frequency is seen from beside it.
    """

    def __init__(self, responses: FitResponses) -> None:
        self.responses = responses
        targets = responses.targets
        self.numbers = len(targets.numbers)
        values = [np.array([one.value for one in targets.numbers])]
        self.target = np.concatenate([*values, *(one.values for one in targets.curves)])
        self.known = bool(targets.curves) or targets.numbers[0].half_width is not None
        self.low, self.high = np.array([one.bounds for one in responses.parameters]).T
        self.coarse = False
        self.curves = [first_noise(one) for one in targets.curves]
        self.scale = self._scales([one.curve.magnitude for one in targets.curves])
        ends = self.numbers + np.cumsum([0, *(len(one.values) for one in targets.curves)])
        #: values of every curve
        self.parts = [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]

    def __call__(self, z: Array) -> Array:
        """(m,) residuals."""
        value = self.responses.at(z)[0]
        out = np.asarray((value - self.target) / self.scale)
        return self._coarse(value, out, None)[0] if self.coarse else out

    def jacobian(self, z: Array) -> Array:
        """(m, n) their derivatives by ln(factor)."""
        value, slope = self.responses.at(z)
        J = np.asarray(slope / self.scale[:, None])
        if not self.coarse:
            return J
        return self._coarse(value, (value - self.target) / self.scale, (slope, J))[1]

    def weigh(self, z: Array) -> float:
        """Weights of the measured curves by what the fit has there: their noise by the magnitude of
        the fitted curve, estimated from its residuals where it was not stated.

        Returns
        -------
        float
            Largest relative change of a weight.
        """
        value, before = self.responses.at(z)[0], self.scale
        count = len(self.target)
        self.curves, size = [], []
        for one, part in zip(self.responses.targets.curves, self.parts, strict=True):
            unknowns = len(self.low) * len(one.values) / count
            noise = noise_after(one, value[part], unknowns, count - len(self.low), self.rounding)
            self.curves.append(noise)
            size.append(magnitude_of(one, value[part]))
        self.scale = self._scales(size)
        change = np.abs(self.scale / before - 1.0)
        return float(change.max(initial=0.0))

    def met(self, z: Array) -> bool:
        """Whether every target is met: numbers within their half-widths, or exactly where they have
        none, curves within theirs in the mean of the squares.
        """
        r = self(z)
        limit = 1.0 if self.known else self.rounding
        numbers = bool(np.abs(r[: self.numbers]).max(initial=0.0) <= limit)
        return numbers and all(float(np.mean(r[part] ** 2)) <= 1.0 for part in self.parts)

    @property
    def rounding(self) -> float:
        """What a residual without half-width may be off: where contacts are solved again or peaks
        are climbed, their own error.
        """
        steps = [step**2 for step in self.responses.source.steps if step > STEP]
        followed = [CLIMBED] if self.responses.targets.ratios else []
        return max([ROUNDING, *steps, *followed])

    def _scales(self, size: Sequence[Array]) -> Array:
        """(m,) half-widths, with curves of these magnitudes."""
        targets, parts = self.responses.targets, []
        for one, noise, H in zip(targets.curves, self.curves, size, strict=True):
            half = np.hypot(noise.relative * H, noise.constant)
            parts.append(np.tile(half, one.parts))
        return np.concatenate([np.array([one.scale for one in targets.numbers]), *parts])

    def _coarse(
        self, value: Array, r: Array, slopes: tuple[Array, Array] | None
    ) -> tuple[Array, Array]:
        """Residuals and Jacobian with one row ln |H| / |H_measured| for every point of a curve."""
        rows, lines = [r[: self.numbers]], []
        if slopes is not None:
            lines.append(slopes[1][: self.numbers])
        for one, part in zip(self.responses.targets.curves, self.parts, strict=True):
            H = as_complex(one, value[part])
            size = np.maximum(np.abs(H), np.finfo(float).tiny)
            measured = one.curve.magnitude
            least = np.finfo(float).eps * measured.max()
            rows.append(np.log(size / np.maximum(measured, least)))
            if slopes is not None:
                dH = as_complex(one, slopes[0][part])
                lines.append((H.conj()[:, None] * dH).real / size[:, None] ** 2)
        return np.concatenate(rows), np.concatenate(lines) if lines else np.zeros(0)

    def solve(self, begin: Array, held: int | None = None) -> Start:
        """The nearest answer to a start; with one parameter held where it is.

        Parameters
        ----------
        begin
            (n,) within the bounds.
        held
            Number of a parameter.
        """
        free = np.array([k for k in range(len(begin)) if k != held], int)

        def whole(part: Array) -> Array:
            z = np.array(begin, float)
            z[free] = part
            return z

        def residual(part: Array) -> Array:
            try:
                return self(whole(part))
            except ConvergenceError:
                # the method takes a shorter step
                return np.full(len(first), np.inf)

        def slope(part: Array) -> Array:
            return self.jacobian(whole(part))[:, free]

        try:
            first = self(begin)
            if not free.size:
                return Start(begin, begin, float((first**2).sum()))
            # with noise the misfit stays, and the last digits of z change nothing that is known
            small = self.rounding if not self.parts else max(self.rounding, FLAT)
            found = least_squares(
                residual,
                begin[free],
                jac=slope,
                bounds=(self.low[free], self.high[free]),
                xtol=(1.0 if self.parts else 0.1) * small,
                ftol=small**1.9,
                gtol=small**1.9,
                max_nfev=EVALUATIONS,
            )
        except (UpdError, np.linalg.LinAlgError) as error:
            return Start(begin, begin, np.inf, one_line(error))
        return Start(begin, whole(found.x), 2.0 * float(found.cost))

    def inside(self, z: Array) -> Array:
        """Strictly within the bounds, as the method asks for."""
        room = _ROOM * (self.high - self.low)
        return np.clip(z, self.low + room, self.high - room)

    def starts(self, count: int) -> list[Array]:
        """The scene itself, and points spread evenly over the bounds, the same ones every time."""
        n = len(self.low)
        inside = 0.5 * (self.high - self.low)
        middle = self.low + inside
        # strictly inside, as the method asks for
        first = np.clip(np.zeros(n), middle - 0.99 * inside, middle + 0.99 * inside)
        points = qmc.Halton(n, scramble=True, rng=0).random(max(count - 1, 0))
        return [first, *(self.low + points * (self.high - self.low))]


@dataclass(frozen=True)
class CurveNoise:
    """How well a measured curve is taken to be known.

    Attributes
    ----------
    relative, constant
        Half-width of a part: of the value, and (m/s2)/N.
    estimated
        Whether from the residuals of the fit.
    correlation
        Of residuals of neighbouring points over their half-widths, 0 for independent errors.
    limit
        Three standard deviations of it for independent errors.
    rms
        Of the residuals, over the half-widths.
    rounding
        Whether the residuals are no more than what the model itself is off.
    """

    relative: float
    constant: float
    estimated: bool
    correlation: float = 0.0
    limit: float = 1.0
    rms: float = 0.0
    rounding: bool = False

    @property
    def white(self) -> bool:
        """Whether the residuals may be independent errors, or are rounding."""
        return self.rounding or abs(self.correlation) <= self.limit


def first_noise(target: CurveTarget) -> CurveNoise:
    """Before any fit: as stated, else each point by its own size."""
    if target.stated:
        return CurveNoise(target.relative or 0.0, target.constant or 0.0, False)
    # down to where differences of the highest are rounding
    floor = float(np.finfo(float).eps ** 0.5 * target.curve.magnitude.max())
    return CurveNoise(1.0, floor, True)


def as_complex(target: CurveTarget, parts: Array) -> NDArray[np.complex128]:
    """Values from their parts (real, then imaginary; or magnitudes) along the first axis."""
    if not target.curve.is_complex:
        return parts.astype(complex)
    real, imaginary = np.split(parts, 2)
    return np.asarray(real + 1j * imaginary)


def magnitude_of(target: CurveTarget, parts: Array) -> Array:
    """(n,) of a computed curve."""
    return np.abs(as_complex(target, parts))


def noise_after(
    target: CurveTarget, parts: Array, unknowns: float, free: int, least: float
) -> CurveNoise:
    """From what a fit leaves.

    Parameters
    ----------
    parts
        Of the fitted curve.
    unknowns
        Inputs that were fitted to this curve.
    free
        Values of all targets less inputs.
    least
        Part of a value that the model itself is off.
    """
    r = (parts - target.values).reshape(target.parts, -1)
    size = magnitude_of(target, parts)
    if target.stated:
        relative, constant = target.relative or 0.0, target.constant or 0.0
    else:
        found = noise_of(r, size, unknowns)
        factor = float(student.ppf(0.5 * (1.0 + PROBABILITY), max(free, 1)))
        relative, constant = factor * max(found.relative, least), factor * found.constant
    u = r / np.hypot(relative * size, constant)
    square = float((u**2).sum())
    near = float((u[:, 1:] * u[:, :-1]).sum()) / max(square, np.finfo(float).tiny)
    limit = 3.0 / np.sqrt(u.size)
    rms = float(np.sqrt(square / u.size))
    left = float(np.linalg.norm(r) / np.linalg.norm(size))
    stated = target.stated
    return CurveNoise(relative, constant, not stated, near, float(limit), rms, left <= least)
