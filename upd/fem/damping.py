"""Viscous damping: Rayleigh (proportional) and by modal ratios."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from upd.errors import InputError
from upd.mesh import FloatArray


def rayleigh_coefficients(frequency: ArrayLike, zeta: ArrayLike) -> tuple[float, float]:
    """Coefficients of C = alpha M + beta K from two damping ratios.

    zeta = alpha / (2 omega) + beta omega / 2; between the two frequencies the ratio is smaller,
    outside it is larger.

    Parameters
    ----------
    frequency : (2,) array_like
        Hz, rising, above zero.
    zeta : (2,) array_like
        Damping ratios at these frequencies.

    Returns
    -------
    alpha : float
        1/s.
    beta : float
        s.

    Raises
    ------
    InputError
        When the ratios need a negative coefficient, or the frequencies do not rise.

    References
    ----------
    .. [1] R. W. Clough, J. Penzien, Dynamics of Structures, ch. 12.
    """
    omega, ratio = (
        2.0 * np.pi * np.asarray(frequency, dtype=np.float64),
        np.asarray(zeta, dtype=np.float64),
    )
    if (
        omega.shape != (2,)
        or ratio.shape != (2,)
        or not 0.0 < omega[0] < omega[1]
        or not (ratio >= 0.0).all()
    ):
        raise InputError(
            "Rayleigh damping takes two rising frequencies above zero and two ratios of "
            "zero or more."
        )
    alpha, beta = (
        float(c) for c in np.linalg.solve(np.column_stack([0.5 / omega, 0.5 * omega]), ratio)
    )
    floor = -4 * np.finfo(float).eps * ratio.max()
    if alpha < floor * omega[1] or beta < floor / omega[0]:
        low, high = ratio[1] * omega[0] / omega[1], ratio[1] * omega[1] / omega[0]
        raise InputError(
            f"Rayleigh damping: ratios {ratio.tolist()} need a negative coefficient (alpha "
            f"{alpha:.3g}, beta {beta:.3g}), which feeds in "
            f"energy: with {ratio[1]:.3g} at the second frequency the first ratio lies "
            f"between {low:.3g} and {high:.3g}."
        )
    return max(alpha, 0.0), max(beta, 0.0)


def rayleigh_ratio(alpha: float, beta: float, frequency: ArrayLike) -> FloatArray:
    """Damping ratio alpha / (2 omega) + beta omega / 2.

    Parameters
    ----------
    alpha, beta : float
        1/s and s.
    frequency : (m,) array_like
        Hz, above zero.

    Returns
    -------
    (m,) ndarray
        Damping ratios.

    Raises
    ------
    InputError
        For a rigid motion (0 Hz), whose ratio is not defined.
    """
    omega = 2.0 * np.pi * np.asarray(frequency, dtype=np.float64)
    if not (omega > 0.0).all():
        raise InputError("The damping ratio of a rigid motion (0 Hz) is not defined: leave it out.")
    out: FloatArray = 0.5 * alpha / omega + 0.5 * beta * omega
    return out


def rayleigh(K: Any, M: Any, alpha: float, beta: float) -> Any:
    """Damping matrix C = alpha M + beta K.

    Parameters
    ----------
    K, M : (n, n) sparse array or ndarray
        N/mm and t.
    alpha, beta : float
        1/s and s, not negative.

    Returns
    -------
    (n, n) csr_array or ndarray
        N s/mm, sparse or dense as K and M are.

    Raises
    ------
    InputError
        For K and M of different shapes, or negative coefficients.
    """
    if np.shape(K) != np.shape(M):
        raise InputError(f"K is {np.shape(K)}, M is {np.shape(M)}: give both on the same dofs.")
    if not (alpha >= 0.0 and beta >= 0.0):
        raise InputError(
            f"alpha = {alpha} 1/s, beta = {beta} s: negative coefficients feed energy in."
        )
    C = alpha * M + beta * K
    return C if isinstance(C, np.ndarray) else csr_array(C)


def modal_damping(M: Any, shapes: ArrayLike, frequency: ArrayLike, zeta: ArrayLike) -> FloatArray:
    """Damping matrix C = M Phi diag(2 zeta omega) Phi' M of given modal ratios, dense.

    What the modes leave out stays undamped. Meant for reduced models: it takes n^2 doubles.

    Parameters
    ----------
    M : (n, n) sparse array or ndarray
        t.
    shapes : (n, m) array_like
        Mass-normalised shapes Phi, t^-1/2.
    frequency : (m,) array_like
        Hz.
    zeta : float or (m,) array_like
        One damping ratio, or one per mode.

    Returns
    -------
    (n, n) ndarray
        N s/mm, symmetric.

    Raises
    ------
    InputError
        For shapes that do not fit, or negative ratios.

    References
    ----------
    .. [1] R. W. Clough, J. Penzien, Dynamics of Structures, ch. 12.
    """
    Phi, f = np.asarray(shapes, dtype=np.float64), np.asarray(frequency, dtype=np.float64)
    if Phi.ndim != 2 or f.shape != Phi.shape[1:] or np.shape(M) != (len(Phi), len(Phi)):
        raise InputError(
            f"Shapes {Phi.shape}, frequencies {f.shape} and M {np.shape(M)} do not fit: "
            "give (n, m), (m,), (n, n)."
        )
    ratio = checked_ratio(zeta, len(f))
    MPhi = M @ Phi
    C: FloatArray = (MPhi * (4.0 * np.pi * ratio * f)) @ MPhi.T
    return 0.5 * (C + C.T)


def checked_ratio(zeta: ArrayLike, m: int) -> FloatArray:
    """Damping ratios, one per mode, checked.

    Parameters
    ----------
    zeta : float or (m,) array_like
    m : int
        Number of modes.

    Returns
    -------
    (m,) ndarray

    Raises
    ------
    InputError
        For another number of ratios, negative ones, or ones that are not finite.
    """
    ratio = np.asarray(zeta, dtype=np.float64)
    if ratio.shape not in ((), (m,)):
        raise InputError(f"{ratio.shape} damping ratios for {m} modes: give one, or one per mode.")
    if not (np.isfinite(ratio).all() and (ratio >= 0.0).all()):
        raise InputError("Damping ratios are finite and not negative (0.005 is half a per cent).")
    return np.broadcast_to(ratio, (m,)).copy()
