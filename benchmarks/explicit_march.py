"""The rig on contact springs integrated explicitly in time, by code of its own.

All modes of the reduced blades and the rigid damper, y'' + 2 zeta omega y' + omega^2 y = P F - J' f
with masses 1, by central differences; each point a normal spring that lifts off, N = max(0, N_0 +
k_n x_n), and a Jenkins slider, T = k_t (x_t - z) cut to +-mu N, z moving with what is cut off.
Nothing here comes from `upd.hbm` but the matrices that both are given: no compliance, no
complementarity, no modes that follow statically, and steps far below the fastest mode.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import eigh

from upd.analyses.forced.interface_model import SpringMarch
from upd.analyses.forced.model import Model
from upd.hbm.faces.state import InterfaceState

Array = NDArray[np.float64]
#: largest angular frequency times the step; 2 is the limit of stability
STEP = 0.8
#: periods of which the last answer is the mean, and those between which it may still change
WINDOW = 8


@njit(cache=True, error_model="numpy")
def advance(  # type: ignore[no-untyped-def]
    steps, dt, square, loss, J, Jt, drive, force, N0, T0, k_n, k_t, mu, tip, y, v, z, out
):
    """One period of `steps` central differences; the sums of each output times exp(-i w t) in out.

    y and v (half a step behind) and the sliders z are overwritten; the law is of N_0 and T_0 at
    y = 0, whose forces on the blades are part of what y is counted from.
    """
    n, size = len(N0), len(y)
    x, g = np.empty(2 * n), np.empty(size)
    out[:] = 0.0
    for step in range(steps):
        theta = 2.0 * np.pi * step / steps
        F = force * np.cos(theta)
        x[:] = 0.0
        for j in range(size):
            for i in range(2 * n):
                x[i] += Jt[j, i] * y[j]
        for j in range(size):
            g[j] = drive[j] * F - square[j] * y[j]
        for i in range(n):
            N = N0[i] + k_n[i] * x[i]
            if N < 0.0:
                N = 0.0
            T = T0[i] + k_t[i] * (x[n + i] - z[i])
            if mu[i] * N < T:
                z[i] += (T - mu[i] * N) / k_t[i]
                T = mu[i] * N
            elif -mu[i] * N > T:
                z[i] += (T + mu[i] * N) / k_t[i]
                T = -mu[i] * N
            N -= N0[i]
            T -= T0[i]
            for j in range(size):
                g[j] -= J[i, j] * N + J[n + i, j] * T
        for k in range(len(tip)):
            seen = 0.0
            for j in range(size):
                seen += tip[k, j] * y[j]
            out[k] += seen * np.exp(-1j * theta)
        for j in range(size):
            half = 0.5 * dt * loss[j]
            v[j] = ((1.0 - half) * v[j] + dt * g[j]) / (1.0 + half)
            y[j] += dt * v[j]


@dataclass(frozen=True)
class ExplicitMarch:
    """Modes of both blades (m) and of the damper's mass (r), points (n) of one tangent each.

    Attributes
    ----------
    omega : (m + r,) ndarray
        rad/s, 0 of the damper.
    damping : float
        Ratio to critical, of the blades' modes.
    J : (2 n, m + r) ndarray
        Closing of all points, then their sliding, by the unknowns.
    drive : (m + r,) ndarray
        Per newton of excitation.
    N0, T0, k_n, k_t, mu : (n,) ndarray
        Forces at rest [N], springs [N/mm], friction.
    tip : (2, m + r) ndarray
        Displacements of the tips, left and right.
    shapes : (n_blade, m) ndarray
        Modes of the blades on their dofs.
    damper : (r, r) ndarray
        Motions of the damper by its unknowns.
    fastest : float
        rad/s, of everything stuck.
    """

    omega: Array
    damping: float
    J: Array
    drive: Array
    N0: Array
    T0: Array
    k_n: Array
    k_t: Array
    mu: Array
    tip: Array
    shapes: Array
    damper: Array
    fastest: float

    def steady(
        self,
        frequency: float,
        force: float,
        start: tuple[Array, Array, Array],
        *,
        step: float = STEP,
        tolerance: float = 5e-5,
        most: int = 400,
    ) -> tuple[NDArray[np.complex128], int, float]:
        """First harmonic of the tips once windows of periods repeat, periods, and the last change.

        Parameters
        ----------
        frequency, force
            Hz, N; the force is a cosine.
        start
            Unknowns, their velocities, and sliders at t = 0.
        step
            Time step times the fastest angular frequency.
        tolerance
            Of the change from one window to the next, over the amplitude.
        """
        y, v, z = (part.copy() for part in start)
        steps = int(np.ceil(self.fastest / (frequency * step)))
        dt = 1.0 / (frequency * steps)
        loss = 2.0 * self.damping * self.omega
        out, seen = np.zeros(2, complex), []
        J = np.ascontiguousarray(self.J)
        Jt = np.ascontiguousarray(self.J.T)
        now, change = np.zeros(2, complex), float("inf")
        while len(seen) < most and change > tolerance:
            given = (self.N0, self.T0, self.k_n, self.k_t, self.mu, self.tip, y, v, z, out)
            advance(steps, dt, self.omega**2, loss, J, Jt, self.drive, force, *given)
            seen.append(2.0 / steps * out)
            if len(seen) >= 6 * WINDOW and len(seen) % WINDOW == 0:
                before, now = np.mean(np.reshape(seen[-2 * WINDOW :], (2, WINDOW, 2)), axis=1)
                change = float(np.abs(now - before).max() / np.abs(now).max())
        return now, len(seen), change

    def at_rest(self) -> tuple[Array, Array, Array]:
        """Nothing moves, every point carries its static force."""
        none = np.zeros(len(self.omega))
        return none, none.copy(), np.zeros(len(self.N0))

    def at(
        self, springs: SpringMarch, state: InterfaceState, force: float
    ) -> tuple[Array, Array, Array]:
        """Where the other march stands at the end of a period; `force` is that of the excitation.

        Modes that it lets follow statically begin where they would stand still.
        """
        n, m = len(self.N0), self.shapes.shape[1]
        kept = len(state.q)
        # the other march's modes by these: alike but for their signs
        turn = springs.modes @ self.shapes[:, :kept]
        f = state.f.reshape(3, n)
        T = f[2] if not f[1].any() else f[1]
        off = np.concatenate([f[0] - self.N0, T - self.T0])
        y = np.zeros(len(self.omega))
        v = np.zeros(len(self.omega))
        y[:m] = (self.drive[:m] * force - self.J[:, :m].T @ off) / self.omega[:m] ** 2
        y[:kept] = turn.T @ (state.q - state.held / self.omega[:kept] ** 2)
        v[:kept] = turn.T @ state.v
        y[m:], v[m:] = (np.linalg.solve(self.damper, part) for part in (state.s, state.sv))
        z = (self.J @ y)[n:] - (T - self.T0) / self.k_t
        return y, v, z


def explicit_march(model: Model, damping: float) -> ExplicitMarch:
    """All of a spring model with one sliding direction a point.

    Parameters
    ----------
    damping
        Of all modes of the blades, ratio to critical.
    """
    assert model.contacts.tangents == 1
    assert model.excitation.blades == ("right",)
    values, shapes = eigh(model.K, model.M)
    mass, turn = eigh(model.damper.M)
    damper = turn / np.sqrt(mass)
    law, r = model.contacts.law, len(mass)
    rows = np.concatenate(
        [
            np.hstack([model.contacts.rows[:, k] @ shapes, model.damper_rows[:, k] @ damper])
            for k in (0, 1)
        ]
    )
    omega = np.concatenate([np.sqrt(np.maximum(values, 0.0)), np.zeros(r)])
    stuck = np.concatenate([law.k_n, law.k_t])
    K = np.diag(omega**2) + rows.T @ (stuck[:, None] * rows)
    none = np.zeros(r)
    return ExplicitMarch(
        omega,
        damping,
        rows,
        np.concatenate([shapes.T @ model.places[:, 0], none]),
        law.preload.copy(),
        model.traction[:, 0].copy(),
        law.k_n.copy(),
        law.k_t.copy(),
        law.mu.copy(),
        np.array([np.concatenate([model.output[s] @ shapes, none]) for s in ("left", "right")]),
        shapes,
        damper,
        float(np.sqrt(np.linalg.eigvalsh(K)[-1])),
    )
