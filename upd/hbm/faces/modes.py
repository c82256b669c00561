r"""Steps of the blades' modes in a time march.

A mode swings by q'' + 2 zeta omega q' + omega^2 q = p. One with `RESOLVED` steps or more in its
period is stepped exactly under the mean of the forces at both ends, which no step length feeds
energy into. A faster one cannot be: held forces have images about the sampling frequency, and a
mode that lies there answers them instead of the excitation. It is stepped by the Lobatto IIIC
method of two stages, with x = (q, q'), x' = A x + g,

    X_1 = x_0 + dt/2 (A X_1 + g_0) - dt/2 (A X_2 + g_1),
    x_1 = X_2 = x_0 + dt/2 (A X_1 + g_0) + dt/2 (A X_2 + g_1),

of second order, L-stable and stiffly accurate: at its static displacement a mode rests exactly, its
inertia is felt at the frequencies that the steps resolve, and what they do not resolve dies out.
Left out altogether, such modes leave their static compliance, and what that lacks of a receptance
is their inertia, (w / omega)^2 of it at w rad/s.

References
----------
E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., IV.5 (Lobatto IIIC).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

FloatArray = NDArray[np.float64]
#: steps in a period from which a mode is stepped exactly
RESOLVED = 4


def resolved(omega: FloatArray, dt: float) -> NDArray[np.bool_]:
    """Whether modes have `RESOLVED` steps or more in a period.

    Parameters
    ----------
    omega : (m,) ndarray
        rad/s.
    dt : float
        s.

    Returns
    -------
    (m,) ndarray of bool
    """
    return np.asarray(RESOLVED * omega * dt <= 2.0 * np.pi)


def modal_step(omega: FloatArray, damping: FloatArray, dt: float, scale: float) -> FloatArray:
    """A step of oscillators of mass 1, see the module.

    Under the mean of the forces the first of the steady response's harmonics comes out smaller by
    sin(x)/x, x = omega dt.

    Parameters
    ----------
    omega, damping : (m,) ndarray
        rad/s, ratio to critical.
    dt : float
        s.
    scale : float
        Of the forces on the modes that the steps resolve.

    Returns
    -------
    (8, m) ndarray
        q after by q, v, force before and after; v after by the same.
    """
    # x = (q, v dt), force dt^2: time in steps, so that all entries are alike
    a = np.asarray(omega * dt)
    A = np.zeros((len(a), 2, 2))
    A[:, 0, 1] = 1.0
    A[:, 1, 0], A[:, 1, 1] = -(a**2), -2.0 * damping * a
    by = np.where(resolved(omega, dt)[:, None, None], _held(A, scale), _implicit(A))
    units = np.array([[1.0, dt, dt**2, dt**2], [1.0 / dt, 1.0, dt, dt]])
    return np.ascontiguousarray((by * units).transpose(1, 2, 0).reshape(8, -1))


def _held(A: FloatArray, scale: float) -> FloatArray:
    """(m, 2, 4) x after by x, force before and after, exact under the mean of the forces."""
    E = np.zeros((len(A), 3, 3))
    E[:, :2, :2], E[:, 1, 2] = A, 1.0
    E = expm(E)
    half = 0.5 * scale * E[:, :2, 2:]
    return np.concatenate([E[:, :2, :2], half, half], axis=2)


def _implicit(A: FloatArray) -> FloatArray:
    """(m, 2, 4) the same by Lobatto IIIC."""
    one, half = np.eye(2), 0.5 * A
    stages = np.block([[one - half, half], [-half, one - half]])
    right = np.zeros((4, 4))
    right[:2, :2] = right[2:, :2] = one
    right[1, 2:], right[3, 2:] = (0.5, -0.5), (0.5, 0.5)
    return np.asarray(np.linalg.solve(stages, np.broadcast_to(right, stages.shape))[:, 2:])
