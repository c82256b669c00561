r"""Derivatives of a forced response and of its followed peak by parameters of the model.

By implicit differentiation of the balance R(x, w, p) = 0 at a solved point,

    J dx/dp = -R_p,   J = dR/dx,

with the J that Newton's method has, one solution per parameter. A peak over w of the height
h(w, p), taken along the solutions, is where h_w changes its sign. To first order

    dw_peak/dp = -h_wp / h_ww,     dh_peak/dp = h_p + h_w dw_peak/dp = h_p,

the height being stationary. From the exact first derivatives at solutions a little below (-) and
above (+) the peak

    dw_peak/dp = (h_p+ - h_p-) / (h_w- - h_w+),     dh_peak/dp = h_p- + h_w- dw_peak/dp,

which also holds where the peak is a kink, as where a contact changes its state just at a sample:
both sides then move with the line on which they meet.

References
----------
M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems (2019), ch. 4; of extrema: the
envelope theorem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError
from upd.hbm.peaks.parameter_change import ParameterChange, force_change
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.starts import newton

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: how far beside a peak first derivatives are taken, as a share of its width (h/|h_ww|)^(1/2):
#: second derivatives are known to its square, and kinks by the samples, which are much closer
#: than the width, are passed over
STEP = 0.005
#: the same as a share of the frequency, to find the width, and at most
FIRST_STEP, LARGEST_STEP = 1e-4, 1e-2


@dataclass(frozen=True)
class PeakDerivative:
    """First derivatives of a followed peak by some parameters.

    Attributes
    ----------
    frequency : float
        [Hz]
    height : float
        w^power |row @ q|.
    by_height : (n,) ndarray
        Derivatives of the height.
    by_frequency : (n,) ndarray
        Derivatives of the frequency [Hz].
    loss : float
        Energy lost to friction per cycle [N mm].
    by_loss : (n,) ndarray
        Its derivatives as the peak is followed; empty of a linear answer.
    """

    frequency: float
    height: float
    by_height: FloatArray
    by_frequency: FloatArray
    loss: float = 0.0
    by_loss: FloatArray = field(default_factory=lambda: np.zeros(0))


class _Slopes(NamedTuple):
    """Angular frequency, height, its derivative by w and by every parameter along the solutions,
    and dx/dw.
    """

    omega: float
    height: float
    by_omega: float
    by_parameter: FloatArray
    x_omega: FloatArray
    #: the loss, and its derivatives by w and by every parameter
    loss: float
    loss_by: FloatArray


def displacement_derivatives(
    b: Balance,
    rows: Sequence[ArrayLike],
    x: FloatArray,
    frequency: float,
    changes: Sequence[ParameterChange],
    *,
    harmonic: int | None = None,
) -> tuple[ComplexArray, ComplexArray]:
    """Complex amplitudes row @ q of a solved point and their derivatives at fixed frequency.

    Parameters
    ----------
    b : Balance
    rows : sequence of (n_dof,) array_like
        Each weighs the displacements.
    x : (n_unknown,) ndarray
        Unknowns of the point.
    frequency : float
        [Hz]
    changes : sequence of ParameterChange
        One for each parameter.
    harmonic : int, optional
        Its number; the lowest above 0 by default.

    Returns
    -------
    value : (n_row,) ndarray of complex
        [mm]
    by_parameter : (n_row, n) ndarray of complex
    """
    found = _moved(b, x, frequency, changes, harmonic)
    weights = np.column_stack([b.modal_row(row) for row in rows])
    return found.eta @ weights, (found.d_eta[1:] @ weights).T


def peak_derivatives(
    b: Balance,
    row: ArrayLike,
    x: FloatArray,
    frequency: float,
    changes: Sequence[ParameterChange],
    *,
    harmonic: int | None = None,
    power: float = 0.0,
) -> PeakDerivative:
    """Derivatives of the height and the frequency of a peak.

    Parameters
    ----------
    b, row, changes, harmonic, power
        Its number; the lowest above 0 by default. The power is of its angular frequency: 2 for
        accelerations.
    x, frequency : (n_unknown,) ndarray, float
        The peak of that height, as `upd.hbm.springs.peak.climb` finds it.

    Returns
    -------
    PeakDerivative

    Raises
    ------
    ConvergenceError
        Where the point is no peak over frequency, or has no solution beside it.
    """
    here = _slopes(b, row, x, frequency, changes, harmonic, power)
    measure, omega = (harmonic, power), 2 * np.pi * frequency
    low, high = _beside(b, row, x, here, changes, FIRST_STEP * omega, measure)
    curve = abs(high.by_omega - low.by_omega) / (2 * FIRST_STEP * omega)
    d = STEP * float(np.sqrt(here.height / curve)) if curve > 0.0 else FIRST_STEP * omega
    while True:
        low, high = _beside(b, row, x, here, changes, min(d, LARGEST_STEP * omega), measure)
        fall = low.by_omega - high.by_omega
        if low.by_omega > 0.0 > high.by_omega:
            break
        if d > LARGEST_STEP * omega:
            raise ConvergenceError(
                f"derivative of a peak: {frequency:.6g} Hz is no maximum over frequency; to fix "
                "it: give the point that upd.hbm.springs.peak.climb finds"
            )
        # between kinks by the samples the slope may rise: what counts is seen from farther
        d *= 2.0
    more, share = high.by_parameter - low.by_parameter, low.by_omega / fall
    by_omega, by_loss = more / fall, low.loss_by + share * (high.loss_by - low.loss_by)
    return PeakDerivative(
        frequency,
        here.height,
        low.by_parameter + share * more,
        by_omega / (2 * np.pi),
        here.loss,
        by_loss[1:] + by_loss[0] * by_omega,
    )


def _beside(
    b: Balance,
    row: ArrayLike,
    x: FloatArray,
    here: _Slopes,
    changes: Sequence[ParameterChange],
    d: float,
    measure: tuple[int | None, float],
) -> tuple[_Slopes, _Slopes]:
    """Slopes at solutions ``d`` rad/s below and above a point."""
    sides = []
    for step in (-d, d):
        f = (here.omega + step) / (2 * np.pi)
        # the tangent is that of one side of a kink
        guesses = (x + step * here.x_omega, x)
        solved = next((y for y in (newton(b, x, f) for x in guesses) if y is not None), None)
        if solved is None:
            raise ConvergenceError(
                f"derivative of a peak: no solution at {f:.9g} Hz beside it; to fix it: follow the "
                "peak with more points"
            )
        sides.append(_slopes(b, row, solved, f, changes, *measure))
    return sides[0], sides[1]


class _Moved(NamedTuple):
    """What moves along the solutions: amplitudes (m,) of the modes in the harmonic that is read,
    and by angular frequency and every parameter those (1 + n, m), the unknowns (n_unknown, 1 + n),
    and forces and motion of the contacts (1 + n, rows, size), with the forces themselves.
    """

    eta: ComplexArray
    d_eta: ComplexArray
    dx: FloatArray
    F: FloatArray
    dF: FloatArray
    dW: FloatArray


def _moved(
    b: Balance,
    x: FloatArray,
    frequency: float,
    changes: Sequence[ParameterChange],
    harmonic: int | None,
) -> _Moved:
    b.require_all_sectors("derivatives of peaks")
    j, k = b.harmonics.place(harmonic), b.harmonics.dynamic
    omega, o, m = 2 * np.pi * frequency, b.harmonics.offset, len(b.modal.eigenvalues)
    _, J, by_omega = b.linearised(x, omega)
    assert J is not None
    F = b.force(x).force.reshape(len(b.Psi), -1)
    w, eta = np.asarray(k * omega, dtype=float), b.amplitudes(F, omega)
    mean = _mean(b, x, F)
    parts = [_direct(b, x, omega, eta, mean, change) for change in changes]
    right = np.column_stack([by_omega, *(part.residual for part in parts)])
    dx: FloatArray = -np.asarray(np.linalg.solve(J.matrix(), right), dtype=float)
    # amplitudes of the modes follow the forces and what acts on them directly
    DF = J.every_derivative()
    dW = dx[: b.Psi.shape[0] * b.harmonics.size].T.reshape(-1, *b.split(x)[0].shape)
    dF = np.einsum("pcldm,npdm->npcl", DF, dW).reshape(len(dW), len(b.Psi), -1)
    acts = np.zeros((len(dW), m), dtype=complex)
    c = b.modal.damping
    acts[0] = -k[j] * (
        1j * (c * eta[j] if b.modal.proportional else c @ eta[j]) - 2 * w[j] * eta[j]
    )
    for n, part in enumerate(parts, 1):
        acts[n] = part.acts[j]
    moved = (dF[:, :, o + 2 * j] - 1j * dF[:, :, o + 2 * j + 1]) @ b.Psi
    d_eta = b.modal.solve(np.full(len(dW), w[j]), acts - moved)
    for n, part in enumerate(parts, 1):
        dF[n] += part.force
    return _Moved(eta[j], d_eta, dx, F, dF, dW.reshape(len(dW), len(b.Psi), -1))


def _slopes(
    b: Balance,
    row: ArrayLike,
    x: FloatArray,
    frequency: float,
    changes: Sequence[ParameterChange],
    harmonic: int | None,
    power: float,
) -> _Slopes:
    eta, d_eta, dx, F, dF, dW = _moved(b, x, frequency, changes, harmonic)
    omega, weights = 2 * np.pi * frequency, b.modal_row(row)
    q, dq = eta @ weights, d_eta @ weights
    scale = (b.harmonics.dynamic[b.harmonics.place(harmonic)] * omega) ** power
    height = float(scale * abs(q))
    slopes: FloatArray = np.asarray(scale * (q.conjugate() * dq).real / abs(q), dtype=float)
    by_omega = float(slopes[0] + power * height / omega)
    # the loss is bilinear in forces and motion
    W = b.split(x)[0].reshape(len(b.Psi), -1)
    loss_by = np.array([_loss(b, f, W) + _loss(b, F, y) for f, y in zip(dF, dW, strict=True)])
    loss = _loss(b, F, W)
    return _Slopes(omega, height, by_omega, slopes[1:], dx[:, 0], loss, loss_by)


def _loss(b: Balance, F: FloatArray, W: FloatArray) -> float:
    """Energy lost per cycle, as `upd.hbm.springs.pieces.loop_area` has it of every point."""
    o, k = b.harmonics.offset, b.harmonics.dynamic
    area = F[:, o::2] * W[:, o + 1 :: 2] - F[:, o + 1 :: 2] * W[:, o::2]
    return float(np.pi * (area @ k).sum())


def _mean(b: Balance, x: FloatArray, F: FloatArray) -> FloatArray:
    """Mean amplitudes (m,) of the modes."""
    out, free = np.zeros(len(b.modal.eigenvalues)), ~b.modal.rigid
    if b.harmonics.static:
        acts = b.modal.Phi.T @ b.static - b.Psi.T @ F[:, 0]
        out[free] = acts[free] / b.modal.eigenvalues[free]
        out[~free] = b.split(x)[1]
    return out


class _Direct(NamedTuple):
    """R_p (n_unknown,) of a parameter; at unchanged motion, its forces on the modes (n_k, m) and
    the contact forces' coefficients (c, size).
    """

    residual: FloatArray
    acts: ComplexArray
    force: FloatArray


def _direct(
    b: Balance,
    x: FloatArray,
    omega: float,
    eta: ComplexArray,
    mean: FloatArray,
    change: ParameterChange,
) -> _Direct:
    """What a parameter does before anything moves."""
    o, Phi, free, k = b.harmonics.offset, b.modal.Phi, ~b.modal.rigid, b.harmonics.dynamic
    F = force_change(b, x, change).reshape(len(b.Psi), -1)
    acts = -((F[:, o::2] - 1j * F[:, o + 1 :: 2]).T @ b.Psi).astype(complex)
    if change.dynamic is not None:
        acts = acts + change.dynamic @ Phi
    still = -(b.Psi.T @ F[:, 0]) if b.harmonics.static else np.zeros(len(mean))
    if change.static is not None and b.harmonics.static:
        still = still + Phi.T @ change.static
    modal = {
        name: Phi.T @ A @ Phi
        for name in ("M", "C", "K")
        if (A := getattr(change, name)) is not None
    }
    for i, w in enumerate(k * omega):
        for name, factor in (("K", 1.0), ("C", 1j * w), ("M", -(w**2))):
            if name in modal:
                acts[i] -= factor * (modal[name] @ eta[i])
    if "K" in modal:
        still = still - modal["K"] @ mean
    answer = b.modal.solve(np.asarray(k * omega, dtype=float), acts) @ b.Psi.T
    R = np.zeros((len(b.Psi), b.harmonics.size))
    R[:, o::2], R[:, o + 1 :: 2] = -answer.real.T, answer.imag.T
    below = np.zeros(0)
    if b.harmonics.static:
        R[:, 0] = -(b.Psi[:, free] / b.modal.eigenvalues[free]) @ still[free]
        below = -still[~free]
    return _Direct(np.concatenate([R.ravel(), below]), acts, F)
