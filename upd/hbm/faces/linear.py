"""The period of contact and damper linearised about an answer: what directions do to its end.

The matrices of all samples are factored once; a direction then costs a solution with each of them,
and only unknowns of nodes that move are directions. Where many directions are asked for, the
matrices are inverted first. See `upd.hbm.faces.jacobian`.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from upd.hbm.faces.equations import ContactPeriod, IntArray, InterfaceEquations
from upd.hbm.faces.jacobian import factor_period, invert_period, march_directions
from upd.hbm.faces.state import FloatArray
from upd.hbm.faces.step import OPEN, SLIP, STICK
from upd.linalg.compiled_lu import PIVOT

#: most directions that are integrated together, and those below which they are not split; samples
#: factored together. They weigh costs only: what many share against all threads being busy
DIRECTIONS, FEW, SAMPLES = 400, 32, 16


class PeriodDerivative:
    """The derivative of one period, to be taken in any directions.

    Parameters
    ----------
    e : InterfaceEquations
    period : ContactPeriod
    state : (N, n) ndarray of int
        Its states, with the verges.
    w : float
        rad/s.

    Attributes
    ----------
    moved : (2 c,) ndarray of int
        Tangents of the nodes that move, first ones, then second ones.
    lacks : bool
        Whether nodes on the verge do something by themselves.
    remembered : (2 c, d) ndarray
        Unit slips before the period that it depends on. A node that is open at the first sample
        does not remember its slip, and one that slips only that across its slip: its traction has
        that direction, whatever it has slipped along it.
    """

    def __init__(
        self, e: InterfaceEquations, period: ContactPeriod, state: IntArray, w: float
    ) -> None:
        model, step, n = e.model, e.step(w), e.model.n
        self.e, self.step, self.state = e, step, state
        m, r = e.shape[1], len(model.load)
        on = np.flatnonzero((state != STICK).any(axis=0))
        self.moved = np.concatenate([n + on, 2 * n + on])
        self.place = np.full(3 * n, -1)
        self.place[self.moved] = np.arange(len(self.moved))
        self.Z = np.ascontiguousarray(step.Z[:, : m + r])
        self.M = np.ascontiguousarray(e.moves[:, : m + r].T @ self.Z)
        # two rows of a node that slips, three of an open one
        k = (2 * (state != STICK) + (state == OPEN)).sum(axis=1)
        at = np.concatenate([[0], np.cumsum(k)])
        square = np.concatenate([[0], np.cumsum(k**2)])
        rows = at[-1]
        cols, owner = np.empty(rows, np.int64), np.empty(rows, np.int64)
        P, left, keep = np.empty((rows, 3)), np.empty(rows), np.empty((rows, 2))
        PZ, Z_rows = np.empty((rows, m + r)), np.empty((rows, m + r))
        factors, pivots = np.empty(square[-1]), np.empty(rows, PIVOT)
        self.rows = (at, square, cols, owner, P, left, keep, PZ, Z_rows, factors, pivots)
        self.inverted = False
        N = len(state)
        jobs = [
            partial(
                factor_period,
                first,
                min(first + SAMPLES, N),
                period.force,
                period.relative,
                state,
                step.W,
                self.Z,
                model.friction,
                step.rho_n,
                step.rho_t,
                *self.rows,
            )
            for first in range(0, N, SAMPLES)
        ]
        self.fine = all(e.beside.run(jobs))
        self.lacks = bool((left != 0.0).any())
        self.remembered = _remembered(period, state[0], on, step.rho_t)
        self.late = (model.load - period.force @ model.columns) @ step.dJ.T

    def march(
        self,
        q: FloatArray,
        rigid: FloatArray,
        slips: FloatArray,
        faster: FloatArray,
        verge: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """March C directions.

        Parameters
        ----------
        q : (h, m, C) ndarray
            Of the blades' coefficients.
        rigid : (3 r, C) ndarray
            Of the damper's state before the period.
        slips : (2 c, C) ndarray
            Of the slips before it of the nodes that move.
        faster : (C,) ndarray
            Of the frequency [rad/s].
        verge : (C,) ndarray
            Shares of what nodes on the verge do by themselves.

        Returns
        -------
        modal : (h, m, C) ndarray
            Changes of the coefficients of the modal forces; none of them a number where a sample's
            system is singular.
        rigid, slips : ndarray
            Changes of the same after the period.
        """
        if len(faster) > FEW and self.fine and not self.inverted:
            self._invert()
        if not self.fine:
            return np.full_like(q, np.nan), np.full_like(rigid, np.nan), np.full_like(slips, np.nan)
        C = len(faster)
        # an even number of equal pieces, whatever the threads
        wide = C if C <= FEW else -(-C // (2 * -(-C // (2 * DIRECTIONS))))
        parts = [slice(a, a + wide) for a in range(0, C, wide)]
        jobs = [
            partial(
                self._march,
                q[:, :, one],
                rigid[:, one].copy(),
                slips[:, one].copy(),
                faster[one],
                verge[one],
            )
            for one in parts
        ]
        found = self.e.beside.run(jobs)
        modal, ends, slid = (np.concatenate(one, axis=-1) for one in zip(*found, strict=True))
        return modal, ends, slid

    def _invert(self) -> None:
        """Overwrite the factors by inverses."""
        at, square, *_, factors, pivots = self.rows
        N = len(self.state)
        jobs = [
            partial(invert_period, first, min(first + SAMPLES, N), at, square, factors, pivots)
            for first in range(0, N, SAMPLES)
        ]
        self.inverted, self.fine = True, all(self.e.beside.run(jobs))

    def _march(
        self,
        q: FloatArray,
        rigid: FloatArray,
        slips: FloatArray,
        faster: FloatArray,
        verge: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Some of the directions; rigid and slips are overwritten."""
        e, (h, m, C), N = self.e, q.shape, len(self.state)
        motion = (e.E @ q.reshape(h, m * C)).reshape(N, m, C)
        forces = np.empty((N, m, C))
        march_directions(
            self.state,
            self.step.W,
            self.Z,
            self.M,
            self.moved,
            self.place,
            *self.rows,
            self.inverted,
            self.step.J,
            self.late,
            motion,
            faster,
            verge,
            rigid,
            slips,
            forces,
        )
        return (e.Q @ forces.reshape(N, m * C)).reshape(q.shape), rigid, slips


def _remembered(
    period: ContactPeriod, state: IntArray, on: IntArray, rho_t: FloatArray
) -> FloatArray:
    """Slips of the nodes `on` that the first sample depends on, by its states (n,)."""
    n, c = len(state), len(on)
    t1, t2 = (period.force[0] + np.tile(rho_t, 3) * period.relative[0]).reshape(3, n)[1:, on]
    both, across = np.flatnonzero(state[on] >= STICK), np.flatnonzero(state[on] == SLIP)
    both = np.setdiff1d(both, across)
    size = np.hypot(t1, t2)[across]
    out = np.zeros((2 * c, 2 * len(both) + len(across)))
    out[np.concatenate([both, c + both]), np.arange(2 * len(both))] = 1.0
    places = 2 * len(both) + np.arange(len(across))
    out[across, places], out[c + across, places] = -t2[across] / size, t1[across] / size
    return out
