"""The contact law at one instant: normal force, and traction by radial return onto the circle.

Shared by the start of a period, `upd.hbm.springs.period`, and by time integration. Its closed form
over a straight piece of the motion is in `upd.hbm.springs.interval`.

References
----------
J. C. Simo and T. J. R. Hughes, Computational Inelasticity (1998), 1.4.
"""

from __future__ import annotations

import numpy as np

from upd.linalg.compiled import compiled

STICK, SLIP, LIFT = 0, 1, 2


@compiled
def normal(w, k_n, preload, gap):  # type: ignore[no-untyped-def]
    """Normal force of one point.

    Parameters
    ----------
    w : float
        Closing displacement [mm].
    k_n, preload, gap : float
        Parameters of the point [N/mm, N, mm].

    Returns
    -------
    N, slope : float
        Normal force N >= 0 [N] and its derivative by w [N/mm].
    """
    N = preload + k_n * (w - gap)
    if N > 0.0:
        return N, k_n
    return 0.0, 0.0


@compiled
def coulomb(t1, t2, limit):  # type: ignore[no-untyped-def]
    """Traction from the trial traction: radial return onto the circle.

    Parameters
    ----------
    t1, t2 : float
        Trial traction [N].
    limit : float
        mu N [N].

    Returns
    -------
    T1, T2 : float
        Traction [N].
    P11, P12, P22 : float
        Derivative by the trial traction, symmetric.
    n1, n2 : float
        Derivative by the limit.
    state : int
        STICK or SLIP.
    """
    r = np.hypot(t1, t2)
    if r <= limit:
        return t1, t2, 1.0, 0.0, 1.0, 0.0, 0.0, STICK
    n1, n2, c = t1 / r, t2 / r, limit / r
    return limit * n1, limit * n2, c * n2 * n2, -c * n1 * n2, c * n1 * n1, n1, n2, SLIP


@compiled
def step(t1, t2, N, mu):  # type: ignore[no-untyped-def]
    """One step of the law at one point; open contact carries nothing and forgets its slider.

    Parameters
    ----------
    t1, t2 : float
        Trial traction [N].
    N : float
        Normal force [N].
    mu : float
        Friction coefficient.

    Returns
    -------
    T1, T2, P11, P12, P22, n1, n2, state
        As `coulomb` returns them; zeros and LIFT for an open contact.
    """
    if N <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, LIFT
    return coulomb(t1, t2, mu * N)
