"""Residual and derivative of the balance by whole faces, for Newton's method.

The derivative is exact: the recursion of `upd.hbm.faces.jacobian` through the samples. The matrices
of all samples are factored once; a direction then costs a solution with each of them, and only
unknowns of nodes that move are directions. Where many are asked for, the matrices are inverted
first. Two
kinds of nodes need more than that on the way to an answer. A node whose slips in a period add up,
instead of taking each other back, is on its way to a place from which it does not slip any more:
the verge of slipping, at one sample. There its slip has vanished, so that the derivative does not
see it, although any motion that is larger makes it slip on. So a node that sticks away from the
place of its past is asked to lie on that verge, and one that slips for good, or stands there, is
not asked where it ends up across its slip, which vanishes with the slip.

References
----------
M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865: active sets as a semismooth
Newton method.
"""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.newton import Border, BorderedFactors, Factors
from upd.hbm.faces.equations import ContactPeriod, IntArray, InterfaceEquations
from upd.hbm.faces.jacobian import VERGE, factor_period, invert_period, march_directions
from upd.hbm.faces.state import FloatArray
from upd.hbm.faces.step import OPEN, SLIP, STICK
from upd.linalg.compiled_lu import PIVOT

#: net slip over the way slipped in a period: 0 for a periodic motion, 1 for a slip in one direction
ADDS_UP = 0.5


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

    def __init__(self, e: InterfaceEquations, period: ContactPeriod, state: IntArray) -> None:
        model, step, n = e.model, e.step(period.w), e.model.n
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
        samples = (period.force, period.relative, state)
        law = (model.friction, step.rho_n, step.rho_t)
        jobs = [
            partial(factor_period, a, min(a + SAMPLES, N), samples, step.W, self.Z, law, self.rows)
            for a in range(0, N, SAMPLES)
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
        e, (h, m, C), N = self.e, q.shape, len(self.state)
        step = (self.step.W, self.Z, self.M, self.step.J, self.late)
        # an even number of equal pieces, whatever the threads
        wide = C if C <= FEW else -(-C // (2 * -(-C // (2 * DIRECTIONS))))

        def some(one: slice) -> tuple[FloatArray, FloatArray, FloatArray]:
            motion = (e.E @ q[..., one].reshape(h, -1)).reshape(N, m, -1)
            ends, forces = (rigid[:, one].copy(), slips[:, one].copy()), np.empty_like(motion)
            nodes, change = (self.moved, self.place), (motion, faster[one], verge[one])
            march_directions(
                self.state, step, nodes, self.rows, self.inverted, change, ends, forces
            )
            return (e.Q @ forces.reshape(N, -1)).reshape(h, m, -1), *ends

        found = e.beside.run([partial(some, slice(a, a + wide)) for a in range(0, C, wide)])
        modal, after, slid = (np.concatenate(one, axis=-1) for one in zip(*found, strict=True))
        return modal, after, slid

    def _invert(self) -> None:
        """Overwrite the factors by inverses."""
        at, square, *_, factors, pivots = self.rows
        N = len(self.state)
        jobs = [
            partial(invert_period, first, min(first + SAMPLES, N), at, square, factors, pivots)
            for first in range(0, N, SAMPLES)
        ]
        self.inverted, self.fine = True, all(self.e.beside.run(jobs))


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


class InterfaceEvaluation:
    """The equations at one point, residual and derivatives, and the period they come from.

    Parameters
    ----------
    e : InterfaceEquations
        The slips of all nodes that move are among their unknowns.
    x : (u,) ndarray
        Unknowns.
    period : ContactPeriod
        That of the unknowns.
    past : (2 n,) ndarray, optional
        Slips before. Nodes that slip for good are then led to the verge of slipping, see the
        module; without it residual and derivative are those of the equations as they stand.

    Attributes
    ----------
    residual : (u,) ndarray
    period : ContactPeriod
        What they come from.
    """

    def __init__(
        self,
        e: InterfaceEquations,
        x: FloatArray,
        period: ContactPeriod,
        past: FloatArray | None = None,
    ) -> None:
        self.e, self.x, self.period = e, x, period
        slip, (h, m) = period.slip_before, e.shape
        along = np.zeros((2, e.model.n)) if past is None else slips_for_good(e, period)
        state = period.state if past is None else _with_verges(e, period, slip != past, along)
        self.state = state
        left = period.rigid_before - period.rigid, slip - period.slip
        ends = e.joined(np.zeros((h, m)), *left)[h * m :]
        self.residual = np.concatenate([e.misfit(period).ravel(), ends])
        #: nodes that slip out of the way for good, numbered among those that may, and that way
        mine = along[:, e.mobile]
        self.good = np.flatnonzero(mine.any(axis=0))
        self.along = mine[:, self.good]
        if (state == VERGE).any() and self.linear.lacks:
            self.residual += self._marched(np.zeros((len(x), 1)), np.zeros(1), np.ones(1))[:, 0]
        self._hold_across(self.residual[:, None], np.zeros((len(x), 1)))

    @cached_property
    def linear(self) -> PeriodDerivative:
        """The period's derivative: its systems are formed where something is asked of it."""
        return PeriodDerivative(self.e, self.period, self.state)

    @cached_property
    def slips(self) -> IntArray:
        """Unknowns of the slips of nodes that move among those that may."""
        e = self.e
        return np.asarray(e.others + np.searchsorted(e.tangents, self.linear.moved))

    @cached_property
    def derivative(self) -> FloatArray:
        """(u, u + 1) derivative by the unknowns and the frequency."""
        u = len(self.x)
        # slips of nodes that do not move stay what they are
        first = u - len(self.e.tangents)
        own = np.concatenate([np.arange(first), self.slips, [u]])
        formed = np.eye(u, u + 1)
        dx, dw = formed[:, own], np.eye(1, len(own), len(own) - 1)[0]
        memory = self.linear.remembered
        slip = slice(first, first + len(memory))
        wanted = np.zeros((u, first + memory.shape[1] + 1))
        wanted[:first, :first] = np.eye(first)
        wanted[self.slips, first:-1] = memory
        found = self._marched(wanted, np.eye(1, wanted.shape[1], wanted.shape[1] - 1)[0])
        out = np.empty_like(dx)
        out[:, :first], out[:, -1] = found[:, :first], found[:, -1]
        out[:, slip] = found[:, first:-1] @ memory.T
        formed[:, own] = self._with_blades(out, dx, dw)
        return formed

    def product(self, x: FloatArray) -> FloatArray:
        """Derivative in a direction of the unknowns (u,), without the others."""
        return self.in_direction(x, 0.0)

    def factored(self, border: Border) -> BorderedFactors:
        """Factors of the derivative with a border."""
        return Factors(self.jacobian, border)

    def in_direction(self, dx: FloatArray, dw: float) -> FloatArray:
        """Derivative in one direction, without the others.

        Parameters
        ----------
        dx : (u,) ndarray
            Of the unknowns.
        dw : float
            Of the frequency [rad/s].

        Returns
        -------
        (u,) ndarray
        """
        one, faster = dx[:, None], np.array([dw])
        return self._with_blades(self._marched(one, faster), one, faster)[:, 0]

    @property
    def jacobian(self) -> FloatArray:
        """(u, u) derivative by the unknowns."""
        return self.derivative[:, :-1]

    @property
    def by_w(self) -> FloatArray:
        """(u,) derivative by the frequency in rad/s."""
        return self.derivative[:, -1]

    def _with_blades(self, out: FloatArray, dx: FloatArray, dw: FloatArray) -> FloatArray:
        """What the period takes from the residual, overwritten, and all else of the residual."""
        e, w, q = self.e, self.period.w, self.period.q
        h, m = e.shape
        alpha, beta = e.stiffness(w)
        change = dx[: h * m].reshape(h, m, -1)
        blades = alpha[:, :, None] * change
        blades += beta[:, :, None] * e.turned(change, np.ones(h))
        by_w = (alpha - e.model.omega**2) * 2.0 / w * q + beta / w * e.turned(q, np.ones(h))
        blades += by_w[:, :, None] * dw
        out[: h * m] += blades.reshape(h * m, -1)
        out[h * m :] += dx[h * m :]
        self._hold_across(out, dx)
        return out

    def _marched(
        self, dx: FloatArray, dw: FloatArray, verge: FloatArray | None = None
    ) -> FloatArray:
        """What the period takes from the residual (u, C): forces of the blades, ends."""
        verge = np.zeros(len(dw)) if verge is None else verge
        h, m = self.e.shape
        own = slice(h * m, h * m + 3 * len(self.e.model.load))
        modal, rigid, slips = self.linear.march(
            dx[: h * m].reshape(h, m, -1), dx[own], dx[self.slips], dw, verge
        )
        out = np.zeros_like(dx)
        out[: h * m] = -modal.reshape(h * m, -1)
        out[own], out[self.slips] = -rigid, -slips
        return out

    def _hold_across(self, out: FloatArray, dx: FloatArray) -> None:
        """Nodes that slip out of the way for good do not slip across that way; out overwritten.

        The rest of such a slip vanishes as the equations are solved, and with it what decides
        where the node ends up across: the derivative of that is of the order of the slip itself,
        and no direction for Newton's method.
        """
        c = len(self.e.tangents) // 2
        one = len(self.x) - 2 * c + self.good
        two = one + c
        v1, v2 = self.along[:, :, None]
        # along the way the equations, across it the slips themselves
        kept = v1 * (out[one] - dx[one]) + v2 * (out[two] - dx[two])
        out[one], out[two] = dx[one] + v1 * kept, dx[two] + v2 * kept


def slips_for_good(e: InterfaceEquations, period: ContactPeriod) -> FloatArray:
    """Unit vectors along the slips of nodes whose slips in the period add up.

    Parameters
    ----------
    e : InterfaceEquations
    period : ContactPeriod

    Returns
    -------
    (2, n) ndarray
        Zero for nodes that stick, and where slips take each other back.
    """
    dy = period.relative[:, e.model.n :].reshape(e.samples, 2, e.model.n)
    net, path = dy.sum(axis=0), np.hypot(dy[:, 0], dy[:, 1]).sum(axis=0)
    size = np.hypot(net[0], net[1])
    return np.where(size > ADDS_UP * path, net / np.where(size > 0.0, size, 1.0), 0.0)


def _with_verges(
    e: InterfaceEquations, period: ContactPeriod, away: NDArray[np.bool_], along: FloatArray
) -> IntArray:
    """States with the verges of nodes that stick away from their past; `along` is added to."""
    n = e.model.n
    left = away.reshape(2, n).any(axis=0) & ~period.moving
    if not left.any():
        return period.state
    state = period.state.copy()
    f = period.force.reshape(e.samples, 3, n)[:, :, left]
    traction = np.hypot(f[:, 1], f[:, 2])
    least = (e.model.friction[left] * f[:, 0] - traction).argmin(axis=0)
    there = (least, np.arange(len(least)))
    drawn = traction[there] > 0.0
    on = np.flatnonzero(left)[drawn]
    state[least[drawn], on] = VERGE
    along[:, on] = np.array([f[:, 1][there], f[:, 2][there]])[:, drawn] / traction[there][drawn]
    return state
