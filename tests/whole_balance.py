"""The balance written out with whole matrices: what tests hold the compiled loops against."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.springs.balance import Balance
from upd.hbm.springs.coulomb import LIFT
from upd.hbm.springs.period import march_points
from upd.hbm.springs.points import MOST_PERIODS, START_CODE, Law, March, Start

Array = NDArray[np.float64]


class Derived(NamedTuple):
    """Coefficients (n_point, 1 + d, size) of the contact force, their exact derivative by those of
    the motion, and the period they were taken from.
    """

    force: Array
    jacobian: Array
    march: March


def harmonic_force(
    law: Law, X: Array, E: Array, Q: Array, *, start: Start = "zero", slider: Array | None = None
) -> Derived:
    """Coefficients of `upd.hbm.springs.points.march`, with the derivative of that march."""
    n_point, rows, size = X.shape
    w, n = np.ascontiguousarray(X @ E.T), len(E)
    force, weighed = np.zeros((n_point, rows, n)), np.zeros((n_point, rows, n))
    state, slope = np.zeros((n_point, n), dtype=np.int8), np.zeros((n_point, 3, n))
    tangent = np.zeros((n_point, rows - 1, n, rows * size))
    periodic, periods = np.zeros(n_point, dtype=np.bool_), np.zeros(n_point, dtype=np.int64)
    sliders = np.zeros((n_point, 2)) if slider is None else slider
    begin, filled = (START_CODE[start], sliders, MOST_PERIODS), (force, weighed, state, slope)
    march_points(w, E, law.arrays, begin, True, (*filled, tangent), periodic, periods)
    J = np.zeros((n_point, rows, size, rows, size))
    for p in range(n_point):
        block = np.eye(size)
        if (state[p] == LIFT).any():
            before, here, after = slope[p]
            by_sample = here[:, None] * E
            by_sample += before[:, None] * np.roll(E, 1, 0) + after[:, None] * np.roll(E, -1, 0)
            block = Q @ by_sample
        J[p, 0, :, 0, :] = law.k_n[p] * block
    if rows > 1:
        J[:, 1:] = np.matmul(Q, tangent).reshape(n_point, rows - 1, size, rows, size)
    return Derived(weighed @ Q.T, J, March(force, weighed, state, periodic, periods))


class Whole(NamedTuple):
    """Residual (n,), its derivatives by the unknowns (n, n) and by the angular frequency (n,), and
    the contact forces.
    """

    residual: Array
    jacobian: Array
    by_frequency: Array
    contact: Derived


def evaluate(b: Balance, x: Array, omega: float) -> Whole:
    """Residual w - u + G f(w) and the rigid equilibrium, with exact derivatives."""
    W, a = b.split(x)
    h, m = b.harmonics, b.modal
    contact = harmonic_force(b.contacts.law, W, b.E, b.Q, start=b.start, slider=b.slider)
    c, o, size = len(b.Psi), h.offset, h.size
    F, rigid_rows = contact.force.reshape(c, size), b.Psi[:, m.rigid]
    C = np.diag(m.damping) if m.proportional else m.damping
    R, slope = W.reshape(c, size).copy(), np.zeros((c, size))
    DF = np.zeros((c, size, c, size))
    d1 = c // len(contact.jacobian)
    for p, one in enumerate(contact.jacobian):
        DF[p * d1 : (p + 1) * d1, :, p * d1 : (p + 1) * d1] = one
    J = np.eye(c * size).reshape(c, size, c, size)
    for j, k in enumerate(h.dynamic):
        w = k * omega
        D = np.diag(m.eigenvalues) - w**2 * np.eye(len(C)) + 1j * w * C
        X = np.linalg.solve(D, np.column_stack([b.Psi.T, b.loads[j]]))
        dX = -np.linalg.solve(D, (1j * C - 2.0 * w * np.eye(len(C))) @ X)
        cos, sin = o + 2 * j, o + 2 * j + 1
        pushed = np.append(F[:, cos] - 1j * F[:, sin], -1.0)
        motion, by_w = b.Psi @ X @ pushed, k * (b.Psi @ dX @ pushed)
        R[:, cos] += motion.real
        R[:, sin] -= motion.imag
        slope[:, cos], slope[:, sin] = by_w.real, -by_w.imag
        moved = np.tensordot(b.Psi @ X[:, :-1], DF[:, cos] - 1j * DF[:, sin], 1)
        J[:, cos] += moved.real
        J[:, sin] -= moved.imag
    n = b.rigid
    whole = np.zeros((b.size, b.size))
    below = np.zeros(0)
    if h.static:
        R[:, 0] += b.G0 @ F[:, 0] - b.u0 - rigid_rows @ a
        below = rigid_rows.T @ F[:, 0] - b.rigid_load
        J[:, 0] += np.tensordot(b.G0, DF[:, 0], 1)
        whole[: c * size : size, c * size :] = -rigid_rows
        whole[c * size :, : c * size] = np.tensordot(rigid_rows.T, DF[:, 0], 1).reshape(n, c * size)
    whole[: c * size, : c * size] = J.reshape(c * size, -1)
    residual = np.concatenate([R.ravel(), below])
    return Whole(residual, whole, np.concatenate([slope.ravel(), np.zeros(n)]), contact)
