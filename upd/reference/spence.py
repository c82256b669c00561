"""Spence's indentation with friction: how far an axisymmetric contact of unlike bodies sticks."""

from __future__ import annotations

import math

from scipy.optimize import brentq
from scipy.special import ellipkm1

from upd.errors import InputError

#: Its square is the smallest number.
_SMALLEST = 1e-150


def sticking_part(beta: float, mu: float) -> float:
    """Radius of the sticking disk over the contact radius under a growing normal load.

    With c/a = z and K'(z) = K(sqrt(1 - z^2)), K the complete elliptic integral of the first kind,

        1/(2 z) ln((1 + z)/(1 - z)) = (mu/beta) K'(z),

    the same for a flat punch and a sphere, at every load (printed with beta/mu in places, by which
    no friction would stick everywhere). The shear's own effect on the pressure is neglected, so it
    is exact for small beta only.

    Parameters
    ----------
    beta : float
        Dundurs' second constant, above zero in size.
    mu : float
        Friction, above zero.

    Returns
    -------
    float

    Raises
    ------
    InputError
        For a beta of zero or a friction that is not positive.

    References
    ----------
    .. [1] D. A. Spence, J. Elasticity 5 (1975) 297; K. L. Johnson, Contact Mechanics, section 5.4.

    Examples
    --------
    >>> from upd.reference.spence import sticking_part
    >>> print(f"{sticking_part(0.1, 0.1):.4f}")
    0.9038
    """
    if not abs(beta) > 0.0 or not 0.0 < mu < math.inf:
        raise InputError(
            f"sticking part: beta = {beta:g} and mu = {mu:g}: give a beta that is not zero and a "
            "friction above zero (bodies with beta = 0 stick everywhere under a normal load)."
        )
    ratio = mu / abs(beta)

    def off(w: float) -> float:
        """With z = tanh(w), which a computer can tell from one."""
        z = math.tanh(w)
        return w / z - ratio * float(ellipkm1(z * z))

    # K'(z) tends to ln(4/z) for small z: below the smallest z the disk has no radius.
    if off(_SMALLEST) > 0.0:
        return 0.0
    return math.tanh(
        float(brentq(off, _SMALLEST, 5.0 + math.pi * ratio, xtol=1e-300, maxiter=3000))
    )
