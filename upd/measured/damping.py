r"""Modal damping from a whole measured curve.

Near its resonances the accelerance of a viscously damped structure is a sum of its modes,

    H(f) = sum_r A_r T_r(f) + L + U (f / f_0)^2 + W (f / f_0)^4,
    T_r = -f^2 / D_r,    D_r = f_r^2 - f^2 + 2 i zeta_r f_r f,

the real terms L, U, W for the modes below and above the band: of one at f_s << f the accelerance
is A_s, of one at f_s >> f it is -A_s (f / f_s)^2 (1 + (f / f_s)^2 + ...). Natural frequencies,
damping ratios, modal constants A_r and residual terms are found together, so that neither a shifted
frequency nor a wrong modal mass or sensitivity of a transducer passes into the damping: zeta comes
from the shape of the peak, not from its height. The derivatives are

    dH/dA_r = T_r,  dH/dzeta_r = -A_r T_r 2 i f_r f / D_r,
    dH/df_r = -A_r T_r (2 f_r + 2 i zeta_r f) / D_r,

of a magnitude Re(conj(H) dH) / |H|.

Noise may be a part of the value, constant, or both: sigma_k^2 = alpha^2 + (beta |H(f_k)|)^2. Each
point counts by 1 / sigma_k; alpha and beta follow from the residuals by the normal likelihood, and
both steps repeat until they agree. With the weighted Jacobian J and p unknowns the covariance is
s^2 (J'J)^-1, s^2 = |r|^2 / (n - p). It holds for independent errors: what the curve has and the sum
has not (another mode, a nonlinear joint) makes neighbouring residuals alike.

References
----------
.. [1] D. J. Ewins, Modal Testing: Theory, Practice and Application, 2nd ed. (2000), 4.4 to 4.6.
.. [2] R. J. Carroll, D. Ruppert, Transformation and Weighting in Regression (1988), ch. 2, 3
   (pseudo-likelihood of the variance); G. Schwarz, Ann. Statist. 6 (1978) 461.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares, minimize_scalar

from upd.errors import InputError
from upd.labels import Shown
from upd.measured.compare import noisy_peaks
from upd.measured.curve import ComplexArray, MeasuredCurve
from upd.mesh import FloatArray

#: unknowns of a mode, and residual terms
_OF_MODE, _RESIDUAL = 3, 3
#: fits with weights renewed, at most, and change of the weights' shape below which they end
_ROUNDS, _SETTLED = 30, 1e-4
#: steps of a search: of one that is to tell where to begin, and of the last
_FEW, _MOST = 30, 500
#: most modes whose signs are tried one by one where no phase was measured
_MOST_SIGNS = 5


class NoiseLevel(NamedTuple):
    """Standard deviation of a part: as a part of the value, and (m/s2)/N beside it."""

    relative: float
    constant: float


def noise_mix(r: FloatArray, size: FloatArray) -> float:
    """Share of the noise that is a part of the value, of the variance at the highest point.

    Least normal pseudo-likelihood of residuals r (parts, n) with variance s^2 v,
    v = (1 - mix) + mix size^2: n ln s^2 + sum ln v, s^2 = mean r^2 / v.

    Parameters
    ----------
    r : (parts, n) ndarray
        Residuals.
    size : (n,) ndarray
        Magnitudes over the highest.
    """
    square = (r**2).mean(axis=0)
    if not square.any():
        return 1.0

    # down to a constant that is less than one of n parts of the variance at the lowest point, in
    # even steps of its logarithm
    low = float(2.0 * np.log(max(float(size.min()), np.finfo(float).eps)) - np.log(len(size)))
    found = minimize_scalar(
        lambda t: _likelihood(square, size, -np.expm1(t)), bounds=(low, 0.0), method="bounded"
    )
    return float(-np.expm1(found.x))


def _likelihood(square: FloatArray, size: FloatArray, mix: float) -> float:
    """-2 ln L of a part but for a constant, of mean squares (n,), see `noise_mix`."""
    v = np.maximum((1.0 - mix) + mix * size**2, np.finfo(float).tiny)
    return float(len(v) * np.log(np.mean(square / v)) + np.log(v).sum())


def noise_of(r: FloatArray, magnitude: FloatArray, unknowns: float = 0.0) -> NoiseLevel:
    """Noise of a curve from residuals, as a part of the value or constant, both where the residuals
    show both: where the information criterion of Schwarz, -2 ln L + ln N for one more unknown, is
    lower.

    Parameters
    ----------
    r : (parts, n) ndarray
        Residuals of real and imaginary part, or of the magnitude, (m/s2)/N.
    magnitude : (n,) ndarray
        Of the fitted curve, (m/s2)/N.
    unknowns : float
        Fitted to it: so many values less are free.
    """
    top = float(magnitude.max())
    size = magnitude / top
    square, mix = (r**2).mean(axis=0), noise_mix(r, size)
    if square.any():
        likelihood = {m: len(r) * _likelihood(square, size, m) for m in (1.0, 0.0, mix)}
        alone = min((1.0, 0.0), key=lambda m: likelihood[m])
        mix = alone if likelihood[alone] <= likelihood[mix] + np.log(r.size) else mix
    v = (1.0 - mix) + mix * size**2
    variance = float((r**2 / v).sum()) / max(r.size - unknowns, 1.0)
    return NoiseLevel(np.sqrt(variance * mix) / top, np.sqrt(variance * (1.0 - mix)))


@dataclass(frozen=True, repr=False)
class DampingFit(Shown):
    """Modes fitted to a measured curve, by rising frequency.

    Attributes
    ----------
    frequency, frequency_error : (m,) ndarray
        Natural frequencies and their standard errors, Hz.
    zeta, zeta_error : (m,) ndarray
        Damping ratios and their standard errors.
    constant : (m,) ndarray
        Modal constants A_r, (m/s2)/N.
    residual : (3,) ndarray
        L, U, W, (m/s2)/N.
    reference : float
        f_0, Hz: the middle of the band.
    noise : NoiseLevel
        Of a real or imaginary part, or of a magnitude.
    correlation : float
        Of residuals of neighbouring points, 0 for independent errors.
    correlation_limit : float
        Three standard deviations of the correlation of so many independent errors: beyond it the
        residuals are not independent.
    """

    frequency: FloatArray
    frequency_error: FloatArray
    zeta: FloatArray
    zeta_error: FloatArray
    constant: FloatArray
    residual: FloatArray
    reference: float
    noise: NoiseLevel
    correlation: float
    correlation_limit: float

    def response(self, frequency: ArrayLike) -> ComplexArray:
        """The fitted accelerance, (m/s2)/N.

        Parameters
        ----------
        frequency : (k,) array_like
            Hz.

        Returns
        -------
        (k,) ndarray of complex
        """
        x = np.concatenate([self.frequency, self.zeta, self.constant, self.residual])
        return _sum(np.asarray(frequency, float), self.reference, x)[0]


def _sum(f: FloatArray, reference: float, x: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """H (n,) of m modes and residual terms, and its derivatives (n, 3 m + 3), see the module: the
    last m + 3 are what H is linear in.
    """
    fr, zeta, A = np.split(x[:-_RESIDUAL], _OF_MODE)
    at = f[:, None]
    D = fr**2 - at**2 + 2j * zeta * fr * at
    T = np.asarray(-(at**2) / D, dtype=np.complex128)
    powers = (at / reference) ** (2 * np.arange(_RESIDUAL))
    turned = -A * T / D
    jacobian = np.hstack([turned * (2.0 * fr + 2j * zeta * at), turned * 2j * fr * at, T, powers])
    return T @ A + powers @ x[-_RESIDUAL:], jacobian


def fit_damping(curve: MeasuredCurve, modes: ArrayLike | None = None) -> DampingFit:
    """Damping ratios of the modes in the band of a measured linear curve, by least squares.

    See `upd.measured.damping` for the equations.

    Parameters
    ----------
    curve : MeasuredCurve
        Of a linear structure: free or stuck.
    modes : (m,) array_like, optional
        Frequencies near those of the modes, Hz; by default the curve's peaks.

    Returns
    -------
    DampingFit

    Raises
    ------
    InputError
        For a curve without a peak, with fewer points than unknowns, or that no sum of modes is
        like.

    Notes
    -----
    Where only magnitudes were measured, noise that is constant lifts valleys (a modulus is never
    negative): leave out what lies in the noise.

    Examples
    --------
    >>> import numpy as np
    >>> from upd.measured import MeasuredCurve, fit_damping
    >>> f, f0, zeta = np.linspace(300.0, 380.0, 801), 340.0, 0.004
    >>> H = -2.0 * f**2 / (f0**2 - f**2 + 2j * zeta * f0 * f)
    >>> noise = np.random.default_rng(1).standard_normal((2, len(f)))
    >>> curve = MeasuredCurve(f, H + 0.02 * abs(H) * (noise[0] + 1j * noise[1]), state="free")
    >>> fit = fit_damping(curve)
    >>> bool(abs(fit.zeta[0] / zeta - 1.0) < 0.01), round(float(fit.frequency[0]), 1)
    (True, 340.0)
    """
    f, size = curve.frequency, curve.magnitude
    found = noisy_peaks(f, size)
    wanted = None if modes is None else np.sort(np.asarray(modes, float).ravel())
    if wanted is None and not found:
        raise InputError(
            f"the curve has no peak between {f[0]:g} and {f[-1]:g} Hz that falls to half power on "
            "both sides: measure beyond it"
        )
    at = np.array([p.frequency for p in found]) if wanted is None else wanted
    m = len(at)
    unknowns, values = (_OF_MODE * m + _RESIDUAL), len(f) * (1 + curve.is_complex)
    if values <= unknowns:
        raise InputError(
            f"{values} measured values for {unknowns} unknowns of {m} modes: measure more points"
        )
    near = [p for p in found if np.isfinite(p.zeta) and p.zeta > 0.0]
    # by half power of the peak next to it; a step of the curve where none has it
    zeta = np.median(np.diff(f)) / at
    if near:
        nearest = np.abs([[p.frequency - one for p in near] for one in at]).argmin(axis=1)
        zeta = np.array([p.zeta for p in near])[nearest]
    reference = float(np.sqrt(f[0] * f[-1]))
    starts = _starts(curve, reference, at, zeta)
    # without phase the valleys tell the signs, and a search that begins without regard to them may
    # end in another valley: it begins with and without their weight
    weights = [np.ones(len(f))]
    if not curve.is_complex:
        weights.append(np.maximum(size / size.max(), np.finfo(float).eps))
    tried = []
    for sigma in weights:
        tries = [_weighted(curve, reference, x, sigma, _FEW) for x in starts]
        begin = min(tries, key=lambda one: one[1])[0]
        tried.append(_reweighted(curve, reference, begin, sigma))
    return min(tried, key=lambda one: one[1])[0]


def _starts(
    curve: MeasuredCurve, reference: float, at: FloatArray, zeta: FloatArray
) -> list[FloatArray]:
    """Where the search begins: modal constants by linear least squares, of magnitudes with every
    choice of signs.
    """
    if curve.is_complex:
        x = np.concatenate([at, zeta, np.zeros(len(at) + _RESIDUAL)])
        basis = _sum(curve.frequency, reference, x)[1][:, 2 * len(at) :]
        both = np.vstack([basis.real, basis.imag])
        H = np.concatenate([curve.accelerance.real, curve.accelerance.imag])
        linear = np.linalg.lstsq(both, H, rcond=None)[0]
        return [np.concatenate([at, zeta, linear])]
    height = np.array([np.interp(one, curve.frequency, curve.magnitude) for one in at])
    others = list(itertools.product((1.0, -1.0), repeat=min(len(at), _MOST_SIGNS) - 1))
    out = []
    for signs in others:
        all_signs = np.ones(len(at))
        all_signs[1 : 1 + len(signs)] = signs
        A = 2.0 * zeta * height
        # modes below the band may have constants as large as those in it, of either sign
        for below in (0.0, 1.0, -1.0):
            residual = np.zeros(_RESIDUAL)
            residual[0] = below * A.mean()
            out.append(np.concatenate([at, zeta, all_signs * A, residual]))
    return out


def _residual(
    curve: MeasuredCurve, reference: float, x: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Differences (parts, n) from the measured values and their derivatives (parts, n, p)."""
    H, J = _sum(curve.frequency, reference, x)
    if curve.is_complex:
        r = H - curve.accelerance
        return np.stack([r.real, r.imag]), np.stack([J.real, J.imag])
    size = np.maximum(np.abs(H), np.finfo(float).tiny)
    return (size - curve.magnitude)[None], (np.real(H.conj()[:, None] * J) / size[:, None])[None]


def _weighted(
    curve: MeasuredCurve,
    reference: float,
    start: FloatArray,
    sigma: FloatArray,
    most: int = _MOST,
) -> tuple[FloatArray, float, FloatArray, FloatArray]:
    """Unknowns, sum of squares, weighted residuals (parts, n) and derivatives (parts n, p)."""
    f, p = curve.frequency, len(start)
    fr, zeta, A = np.split(start[:-_RESIDUAL], _OF_MODE)
    top = float(np.abs(curve.accelerance).max())
    size = np.where(A != 0.0, np.abs(A), np.abs(2.0 * zeta * top))
    scale = np.concatenate([zeta * fr, zeta, size, np.full(_RESIDUAL, size.max())])
    low, high = np.full(p, -np.inf), np.full(p, np.inf)
    low[: len(fr)], high[: len(fr)] = f[0], f[-1]
    low[len(fr) : 2 * len(fr)] = 0.0

    def residual(x: FloatArray) -> FloatArray:
        return np.asarray((_residual(curve, reference, x)[0] / sigma).ravel())

    def jacobian(x: FloatArray) -> FloatArray:
        return np.asarray((_residual(curve, reference, x)[1] / sigma[:, None]).reshape(-1, p))

    eps = float(np.finfo(float).eps)
    found = least_squares(
        residual,
        start,
        jacobian,
        bounds=(low, high),
        x_scale=scale,
        xtol=4.0 * eps,
        ftol=4.0 * eps,
        gtol=4.0 * eps,
        max_nfev=most,
    )
    r: FloatArray = found.fun.reshape(-1, len(f))
    return found.x, 2.0 * float(found.cost), r, np.asarray(found.jac)


def _reweighted(
    curve: MeasuredCurve, reference: float, x: FloatArray, sigma: FloatArray
) -> tuple[DampingFit, float]:
    """Fits with the weights of their own residuals until these repeat, and -2 / parts times the
    logarithm of the likelihood.
    """
    f, mix = curve.frequency, -1.0
    for _ in range(_ROUNDS):
        x, total, r, J = _weighted(curve, reference, x, sigma)
        size = np.abs(_sum(f, reference, x)[0])
        size /= size.max()
        last, mix = mix, noise_mix(r * sigma, size)
        sigma = np.sqrt((1.0 - mix) + mix * size**2)
        if abs(mix - last) <= _SETTLED:
            break
    x, total, r, J = _weighted(curve, reference, x, sigma)
    _, p = J.shape
    variance = total / (r.size - p)
    # columns of one length: unknowns have many units
    length = np.linalg.norm(J, axis=0)
    inverse = np.linalg.pinv((J / length).T @ (J / length), hermitian=True)
    error = np.sqrt(variance * np.diag(inverse)) / length
    order = np.argsort(np.split(x[:-_RESIDUAL], _OF_MODE)[0])
    fr, zeta, A = (part[order] for part in np.split(x[:-_RESIDUAL], _OF_MODE))
    df, dz, _ = (part[order] for part in np.split(error[:-_RESIDUAL], _OF_MODE))
    top = float(np.abs(_sum(f, reference, x)[0]).max())
    noise = NoiseLevel(float(np.sqrt(variance * mix)) / top, float(np.sqrt(variance * (1.0 - mix))))
    if not (np.isfinite(error).all() and (zeta > 0.0).all()):
        raise InputError(
            "no sum of damped modes is like the curve: give a linear, free or stuck curve with "
            "several points within the width of its peaks"
        )
    near = float((r[:, 1:] * r[:, :-1]).sum() / max(float((r**2).sum()), np.finfo(float).tiny))
    n, residual = len(f), x[-_RESIDUAL:]
    limit = float(3.0 / np.sqrt(n))
    fit = DampingFit(fr, df, zeta, dz, A, residual, reference, noise, near, limit)
    # r is weighted: sum ln v is of the weights
    least = max(float((r**2).mean()), float(np.finfo(float).tiny))
    return fit, float(n * np.log(least) + 2.0 * np.log(sigma).sum())
