"""Contact force over the interval between two samples: exact for a motion straight in between.

On a straight piece of the motion the normal force N and the trial traction change linearly, and the
law has a closed form. A point that sticks reaches the cone |T| = mu N at the root of a quadratic
equation; it then slips to the end of the piece. An open point closes, and a closed one opens, where
N crosses zero: there the slider starts anew, or ends on the tip of the cone. In the plane the
traction of a slipping point turns towards the sliding direction e: with the angle phi between them,

    phi' = -k_t |w'| sin(phi)/(mu N),   tan(phi_b/2) = tan(phi_a/2) exp(-k_t |dw| Lambda),
    Lambda = ln(L_b/L_a)/(L_b - L_a),   L = mu N.

The motion is straight up to the square of the interval, and as accurate is the force.

Samples miss the corners of the force inside an interval. The integral of the force against a test
function that is linear over the interval differs from the rule of trapezoids by the area of the
corner, which goes to both samples in proportion to their nearness. With it the coefficients change
smoothly where an event passes a sample.

References
----------
States and their times within the period for forces along one direction: E. P. Petrov and
D. J. Ewins, Analytical formulation of friction interface elements for analysis of nonlinear
multi-harmonic vibrations of bladed disks, J. Turbomach. 125 (2003) 364-371. The equation of the
angle follows from T = L n, |n| = 1 and T' = k_t w' - a n with a > 0.
"""

from __future__ import annotations

import numpy as np

from upd.hbm.springs.coulomb import LIFT, SLIP, STICK
from upd.linalg.compiled import compiled

#: values an interval is described by: traction before, normal forces before and after (negative
#: when open), change of the trial traction
INPUTS = 6
#: what comes of it: traction after, its shares of the corner at the sample before and after
OUTPUTS = 6
UNIT = np.eye(INPUTS)
#: below it the difference quotient of the logarithm is a series: its fourth power is rounding
SERIES = float(np.finfo(float).eps) ** 0.25


@compiled
def normal_corner(a, b):  # type: ignore[no-untyped-def]
    """Corner of the normal force where a contact closes or opens between two samples.

    Parameters
    ----------
    a, b : float
        N_0 + k_n (w - gap) at the samples, of different sign [N].

    Returns
    -------
    before, after : float
        What the corner adds to the samples [N].
    before_a, before_b, after_a, after_b : float
        Their derivatives.
    """
    s, change = a / (a - b), abs(a - b)
    area, opens = a * b / change, np.sign(a - b)
    area_a, area_b = -opens * (1 - s) * (1 - s), opens * s * s
    s_a, s_b = (1 - s) / (a - b), s / (a - b)
    return (
        0.5 * (1 - s) * area,
        0.5 * s * area,
        0.5 * ((1 - s) * area_a - s_a * area),
        0.5 * ((1 - s) * area_b - s_b * area),
        0.5 * (s * area_a + s_a * area),
        0.5 * (s * area_b + s_b * area),
    )


@compiled
def _slip_begins(T1, T2, L, M, D1, D2, on_cone):  # type: ignore[no-untyped-def]
    """Share of a straight piece after which a point slips whose trial traction T + D leaves M.

    The limit goes from L to M: root of |T + s D|^2 = (L + s (M - L))^2 where the left side
    overtakes the right one.

    Returns
    -------
    s : float
        0 to 1.
    rate : float
        Half the derivative of their difference at the root; 0 where the point slipped before.
    """
    A = D1 * D1 + D2 * D2 - (M - L) * (M - L)
    B = T1 * D1 + T2 * D2 - L * (M - L)
    C = T1 * T1 + T2 * T2 - L * L
    if on_cone or C >= 0.0:
        if B >= 0.0:
            return 0.0, 0.0
        return min(-2 * B / A, 1.0), -B
    rate = np.sqrt(max(B * B - A * C, 0.0))
    s = -C / (B + rate) if B > 0.0 else (rate - B) / A
    return min(s, 1.0), rate


@compiled
def _turned(T1, T2, L, M, D1, D2, rest):  # type: ignore[no-untyped-def]
    """Direction of the traction after slip over a share of the change D, in the plane.

    From the traction T on the cone, |T| = L, to the limit M.

    Returns
    -------
    n1, n2 : float
        Direction after.
    kept, across : float
        Derivative of its angle by that of T, and minus that by the exponent.
    exponent, by_x : float
        k_t |dw| Lambda, and its relative derivative by x = M/L - 1.
    """
    v = np.hypot(D1, D2)
    if v == 0.0 or L == 0.0:
        # from the tip of the cone at once along the sliding direction
        return (D1 / v, D2 / v, 0.0, 0.0, 0.0, 0.0) if v > 0.0 else (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    e1, e2 = D1 / v, D2 / v
    x = M / L - 1.0
    quotient = np.log1p(x) / x if x != 0.0 else 1.0
    if abs(x) < SERIES:
        slope = -0.5 + x * (2.0 / 3.0 - x * (0.75 - 0.8 * x))
    else:
        slope = (1.0 / (1.0 + x) - quotient) / x
    exponent = v * rest * quotient / L
    c, z, E = (T1 * e1 + T2 * e2) / L, (e1 * T2 - e2 * T1) / L, np.exp(-exponent)
    whole = (1.0 + c) + (1.0 - c) * E * E
    if whole <= 0.0:
        return e1, e2, 0.0, 0.0, exponent, slope / quotient
    cos, kept = ((1.0 + c) - (1.0 - c) * E * E) / whole, 2.0 * E / whole
    sin = z * kept
    return cos * e1 - sin * e2, cos * e2 + sin * e1, kept, sin, exponent, slope / quotient


@compiled
def _closed(passed, mu, on_cone, plane, jacobian, out, P):  # type: ignore[no-untyped-def]
    """A piece on which the contact is closed and slips at the end; see `friction_event`."""
    T1, T2, a, b, D1, D2 = passed
    L, M = mu * a, mu * b
    s, rate = _slip_begins(T1, T2, L, M, D1, D2, on_cone)
    K1, K2, limit = T1 + s * D1, T2 + s * D2, L + s * (M - L)
    v, size = (np.hypot(D1, D2), np.hypot(K1, K2)) if plane else (abs(D1), abs(K1))
    kept, sin, exponent, by_x = 0.0, 0.0, 0.0, 0.0
    if plane:
        n1, n2, kept, sin, exponent, by_x = _turned(K1, K2, size, M, D1, D2, 1.0 - s)
    else:
        n1, n2 = np.sign(K1 if K1 != 0.0 else D1), 0.0
    out[0], out[1] = M * n1, M * n2
    c1, c2 = K1 - (1 - s) * T1 - s * out[0], K2 - (1 - s) * T2 - s * out[1]
    out[2], out[3] = 0.5 * (1 - s) * c1, 0.5 * (1 - s) * c2
    out[4], out[5] = 0.5 * s * c1, 0.5 * s * c2
    if not jacobian:
        return
    for i in range(INPUTS):
        dT1, dT2 = UNIT[i, 0], UNIT[i, 1]
        dL, dM = mu * UNIT[i, 2], mu * UNIT[i, 3]
        dD1, dD2 = UNIT[i, 4], UNIT[i, 5]
        ds = 0.0
        if rate > 0.0:
            ds = (
                -(K1 * (dT1 + s * dD1) + K2 * (dT2 + s * dD2) - limit * (dL + s * (dM - dL))) / rate
            )
        dK1, dK2 = dT1 + s * dD1 + ds * D1, dT2 + s * dD2 + ds * D2
        turn = 0.0
        if plane and v > 0.0:
            ahead, dv = (D1 * dD2 - D2 * dD1) / (v * v), (D1 * dD1 + D2 * dD2) / v
            turn = ahead
            if size > 0.0:
                dsize = (K1 * dK1 + K2 * dK2) / size
                dx = (dM - M / size * dsize) / size
                relative = dv / v + by_x * dx - dsize / size
                dexponent = exponent * relative
                if s < 1.0:
                    dexponent -= exponent * ds / (1.0 - s)
                turn += kept * ((K1 * dK2 - K2 * dK1) / (size * size) - ahead) - sin * dexponent
        d1, d2 = dM * n1 - M * n2 * turn, dM * n2 + M * n1 * turn
        P[0, i], P[1, i] = d1, d2
        dc1 = dK1 - (1 - s) * dT1 - s * d1 + ds * (T1 - out[0])
        dc2 = dK2 - (1 - s) * dT2 - s * d2 + ds * (T2 - out[1])
        P[2, i], P[3, i] = 0.5 * ((1 - s) * dc1 - ds * c1), 0.5 * ((1 - s) * dc2 - ds * c2)
        P[4, i], P[5, i] = 0.5 * (s * dc1 + ds * c1), 0.5 * (s * dc2 + ds * c2)


@compiled
def _closing(passed, mu, jacobian, out, P):  # type: ignore[no-untyped-def]
    """An open contact that closes: the slider starts where N crosses zero. Returns the state."""
    _, _, a, b, D1, D2 = passed
    s, r = a / (a - b), b / (b - a)
    v, M = np.hypot(D1, D2), mu * b
    slips = r * v > M
    e1, e2 = (D1 / v, D2 / v) if slips else (0.0, 0.0)
    out[0], out[1] = (M * e1, M * e2) if slips else (r * D1, r * D2)
    for j in range(2):
        out[2 + j], out[4 + j] = -0.5 * s * r * out[j], -0.5 * s * s * out[j]
    if jacobian:
        for i in range(INPUTS):
            da, db, dD1, dD2 = UNIT[i, 2], UNIT[i, 3], UNIT[i, 4], UNIT[i, 5]
            ds = (r * da + s * db) / (a - b)
            if slips:
                turn = (e1 * dD2 - e2 * dD1) / v
                P[0, i], P[1, i] = mu * db * e1 - M * e2 * turn, mu * db * e2 + M * e1 * turn
            else:
                P[0, i], P[1, i] = r * dD1 - ds * D1, r * dD2 - ds * D2
            for j in range(2):
                P[2 + j, i] = -0.5 * (s * r * P[j, i] + (r - s) * ds * out[j])
                P[4 + j, i] = -0.5 * (s * s * P[j, i] + 2 * s * ds * out[j])
    return SLIP if slips else STICK


@compiled
def _opening(passed, mu, on_cone, jacobian, out, P):  # type: ignore[no-untyped-def]
    """A closed contact that opens: the traction slides down to the tip of the cone."""
    T1, T2, a, b, D1, D2 = passed
    z, L = a / (a - b), mu * a
    Z1, Z2 = z * D1, z * D2
    share, rate = _slip_begins(T1, T2, L, 0.0, Z1, Z2, on_cone)
    K1, K2, limit, s = T1 + share * Z1, T2 + share * Z2, (1.0 - share) * L, share * z
    out[0], out[1] = 0.0, 0.0
    # corners of the polygon: T at 0, K at s, 0 at z; u and t are their heights over the chord
    u1, u2 = K1 - (1 - s) * T1, K2 - (1 - s) * T2
    t1, t2 = -(1 - z) * T1, -(1 - z) * T2
    out[2] = 0.5 * (1 - s) * (z * u1 + (1 - z) * t1)
    out[3] = 0.5 * (1 - s) * (z * u2 + (1 - z) * t2)
    out[4] = 0.5 * z * (s * u1 + (1 - s) * t1)
    out[5] = 0.5 * z * (s * u2 + (1 - s) * t2)
    if not jacobian:
        return
    for i in range(INPUTS):
        dT1, dT2 = UNIT[i, 0], UNIT[i, 1]
        da, db, dL = UNIT[i, 2], UNIT[i, 3], mu * UNIT[i, 2]
        dz = ((1 - z) * da + z * db) / (a - b)
        dZ1, dZ2 = z * UNIT[i, 4] + dz * D1, z * UNIT[i, 5] + dz * D2
        dshare = 0.0
        if rate > 0.0:
            moved = K1 * (dT1 + share * dZ1) + K2 * (dT2 + share * dZ2)
            dshare = -(moved - limit * (1.0 - share) * dL) / rate
        ds = dshare * z + share * dz
        du1 = dT1 + share * dZ1 + dshare * Z1 - (1 - s) * dT1 + ds * T1
        du2 = dT2 + share * dZ2 + dshare * Z2 - (1 - s) * dT2 + ds * T2
        dt1, dt2 = dz * T1 - (1 - z) * dT1, dz * T2 - (1 - z) * dT2
        P[0, i], P[1, i] = 0.0, 0.0
        P[2, i] = 0.5 * (
            (1 - s) * (dz * (u1 - t1) + z * du1 + (1 - z) * dt1) - ds * (z * u1 + (1 - z) * t1)
        )
        P[3, i] = 0.5 * (
            (1 - s) * (dz * (u2 - t2) + z * du2 + (1 - z) * dt2) - ds * (z * u2 + (1 - z) * t2)
        )
        P[4, i] = 0.5 * (
            z * (ds * (u1 - t1) + s * du1 + (1 - s) * dt1) + dz * (s * u1 + (1 - s) * t1)
        )
        P[5, i] = 0.5 * (
            z * (ds * (u2 - t2) + s * du2 + (1 - s) * dt2) + dz * (s * u2 + (1 - s) * t2)
        )


@compiled
def friction_event(passed, mu, on_cone, plane, jacobian, out, P):  # type: ignore[no-untyped-def]
    """Traction over an interval in which a point slips, closes or opens.

    Parameters
    ----------
    passed : tuple of float
        T1, T2: traction at the sample before [N]. a, b: N_0 + k_n (w - gap) at the samples, at
        least one above zero [N]. D1, D2: k_t times the change of the tangential displacement [N].
    mu : float
        Friction coefficient.
    on_cone : bool
        Whether the point slipped at the sample before.
    plane : bool
        Whether there are two tangents.
    jacobian : bool
        Whether the derivative is wanted.
    out : (OUTPUTS,) ndarray
        Traction at the sample after, what the corners add to the sample before and after [N].
    P : (OUTPUTS, INPUTS) ndarray
        Derivative of `out` by (T1, T2, a, b, D1, D2).

    Returns
    -------
    int
        State at the sample after: STICK, SLIP or LIFT.
    """
    if passed[2] <= 0.0:
        return _closing(passed, mu, jacobian, out, P)
    if passed[3] <= 0.0:
        _opening(passed, mu, on_cone, jacobian, out, P)
        return LIFT
    _closed(passed, mu, on_cone, plane, jacobian, out, P)
    return SLIP
