"""Viscous damping by modal ratios."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.mesh import FloatArray


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
