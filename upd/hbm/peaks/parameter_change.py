r"""What a parameter of a forced response changes: first derivatives of the data of a balance.

The contact force depends on the stiffnesses, the preload and the sliders only through the spring
forces s = N_0 + k_n (w_n - g) and y = k_t w_t + T_0, T_0 = -k_t z with the sliders at z, and it is
homogeneous of degree one: traction T(y, mu s) = mu T(y / mu, s) without dimension of its own. The
derivatives by the parameters of a point therefore follow from those by its motion w,

    df/dk_n = (df/dw_n w_n) / k_n - g df/dN_0,     df/dk_t = (df/dw_t w_t) / k_t,
    df/dT_0 = df/dw_t0 / k_t,                      df/dmu  = (f_t - df_t/dw_t (w_t + T_0/k_t)) / mu,
    df/dN_0 = df/dw_n0 / k_n,   or, where k_n is 0 or harmonic 0 is not kept,
            = (f - df/dw_t (w_t + T_0/k_t) - df/dw_n w_n) / (N_0 - k_n g),

w_n0 the mean of w_n: exact for the discrete march, with all its events between the samples.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.friction import START_CODE, Law
from upd.hbm.springs.period import GIVEN, MID

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class ParameterChange:
    """Derivatives of a balance's data by one parameter; what does not depend on it is None.

    Attributes
    ----------
    k_n, k_t, mu, preload, gap : (n_point,) ndarray
        Of the contact points.
    traction : (n_point, d) ndarray
        Of T_0, what the springs along the tangents carry at w = 0; k_t alone does not change it.
    static : (n_dof,) ndarray
        Of the static loads.
    dynamic : (n_k, n_dof) ndarray of complex
        Of the amplitudes of the harmonics above 0.
    M, C, K : (n_dof, n_dof) ndarray
        Of mass, damping and stiffness; the rows of the contacts stay.
    """

    k_n: FloatArray | None = None
    k_t: FloatArray | None = None
    mu: FloatArray | None = None
    preload: FloatArray | None = None
    gap: FloatArray | None = None
    traction: FloatArray | None = None
    static: FloatArray | None = None
    dynamic: ComplexArray | None = None
    M: FloatArray | None = None
    C: FloatArray | None = None
    K: FloatArray | None = None

    def __add__(self, other: ParameterChange) -> ParameterChange:
        """Both at once."""
        both = {}
        for f in fields(self):
            mine, theirs = getattr(self, f.name), getattr(other, f.name)
            both[f.name] = theirs if mine is None else mine if theirs is None else mine + theirs
        return ParameterChange(**both)

    def __mul__(self, factor: float) -> ParameterChange:
        """By another parameter, of which this one is a multiple."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return ParameterChange(**{k: None if v is None else factor * v for k, v in values.items()})


def force_change(b: Balance, x: FloatArray, change: ParameterChange) -> FloatArray:
    """Derivative of the contact forces' coefficients by a parameter, at unchanged motion.

    Parameters
    ----------
    b : Balance
    x : (n_unknown,) ndarray
        Unknowns.
    change : ParameterChange
        Its part of the contacts.

    Returns
    -------
    (n_point, 1 + d, size) ndarray
        Coefficients [N].

    Raises
    ------
    InputError
        Where the force has no derivative: by a friction coefficient or a stiffness of 0.
    """
    _require_differentiable(b, change)
    found = b.force(x, jacobian=True)
    assert found.jacobian is not None
    W, F, D, law = b.split(x)[0], found.force, found.jacobian, b.contacts.law
    normal = np.einsum("pclm,pm->pcl", D[:, :, :, 0], W[:, 0])
    moved = np.einsum("pcldm,pdm->pcl", D[:, :, :, 1:], W[:, 1:])
    tangential = moved + _by_traction(D, law, _at_rest(b))
    out = np.zeros_like(F)
    preload = sum(
        (
            part
            for part in (
                change.preload,
                None if change.gap is None else -law.k_n * change.gap,
                None if change.k_n is None else -law.gap * change.k_n,
            )
            if part is not None
        ),
        start=np.zeros(b.contacts.n_point),
    )
    if np.any(preload):
        out += _each(preload) * _by_preload(b, F, D, tangential + normal)
    if change.k_n is not None:
        out += _each(_over(change.k_n, law.k_n)) * normal
    if change.k_t is not None:
        out += _each(_over(change.k_t, law.k_t)) * moved
    if change.traction is not None:
        out += _by_traction(D, law, change.traction)
    if change.mu is not None:
        out[:, 1:] += _each(_over(change.mu, law.mu)) * (F - tangential)[:, 1:]
    return out


def _each(values: FloatArray) -> FloatArray:
    """(n_point, 1, 1) of every point."""
    return values[:, None, None]


def _by_traction(D: FloatArray, law: Law, traction: FloatArray) -> FloatArray:
    """Derivative of the force along tractions at rest (n_point, d), nothing without any."""
    if not np.any(traction):
        return np.zeros(D.shape[:3])
    # as the mean motion along the tangents
    shift = traction / law.k_t[:, None]
    return np.asarray(np.einsum("pcld,pd->pcl", D[:, :, :, 1:, 0], shift))


def _over(change: FloatArray, value: FloatArray) -> FloatArray:
    """Relative change; 0 of what does not change."""
    return np.divide(change, value, out=np.zeros(len(value)), where=change != 0.0)


def _at_rest(b: Balance) -> FloatArray:
    """T_0 (n_point, d) of sliders whose place is given."""
    d = b.contacts.tangents
    if b.slider is None or START_CODE[b.start] != GIVEN:
        return np.zeros((b.contacts.n_point, d))
    return np.asarray(-b.contacts.law.k_t[:, None] * b.slider[:, :d])


def _by_preload(b: Balance, F: FloatArray, D: FloatArray, rest_of: FloatArray) -> FloatArray:
    """Derivative (n_point, 1 + d, size) of the force by the preload of its point.

    `rest_of` is the derivative along the motion and the tractions at rest.
    """
    law, out = b.contacts.law, np.zeros_like(F)
    stiff = (law.k_n > 0.0) if b.harmonics.static else np.zeros(len(law.k_n), bool)
    out[stiff] = D[stiff, :, :, 0, 0] / law.k_n[stiff, None, None]
    mean = law.preload - law.k_n * law.gap
    rest = ~stiff & (mean != 0.0)
    out[rest] = (F - rest_of)[rest] / mean[rest, None, None]
    return out


def _require_differentiable(b: Balance, change: ParameterChange) -> None:
    law, problems = b.contacts.law, []
    for name in ("mu", "k_n", "k_t"):
        given = getattr(change, name)
        if given is not None and np.any((given != 0.0) & (getattr(law, name) == 0.0)):
            problems.append(f"{name} is 0 at a point and may only rise: give it a value above 0")
    sliders = np.any(_at_rest(b)) or (change.traction is not None and np.any(change.traction))
    if sliders and not b.harmonics.static:
        problems.append("sliders away from 0 need harmonic 0: add it to the harmonics")
    if change.traction is not None and START_CODE[b.start] not in (GIVEN, MID):
        problems.append('a traction at rest counts with start = "zero" or "static" only')
    if problems:
        raise InputError("derivative of the contact force: " + "; ".join(problems))
