"""Residual and derivative of the balance by whole faces, for Newton's method.

The derivative is exact: the recursion of `upd.hbm.faces.jacobian` through the samples. Two
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

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upd.hbm.faces.equations import ContactPeriod, IntArray, InterfaceEquations
from upd.hbm.faces.jacobian import VERGE
from upd.hbm.faces.linear import PeriodDerivative
from upd.hbm.faces.state import FloatArray

#: net slip over the way slipped in a period: 0 for a periodic motion, 1 for a slip in one direction
ADDS_UP = 0.5


class StrangerMovesError(Exception):
    """A node moves whose slips are not among the unknowns.

    Parameters
    ----------
    moving : (n,) ndarray of bool
        Nodes that move.
    """

    def __init__(self, moving: NDArray[np.bool_]) -> None:
        super().__init__()
        self.moving = moving


class InterfaceEvaluation:
    """The equations at one point.

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
        w: float,
        period: ContactPeriod,
        past: FloatArray | None,
    ) -> None:
        self.e, self.x, self.w, self.period = e, x, w, period
        q, rigid, slip = e.split(x)
        h, m = e.shape
        along = np.zeros((2, e.model.n)) if past is None else slips_for_good(e, period)
        state = period.state if past is None else _with_verges(e, period, slip != past, along)
        self.state = state
        ends = e.joined(np.zeros((h, m)), rigid - period.rigid, slip - period.slip)[h * m :]
        self.residual = np.concatenate([e.misfit(period, q, w).ravel(), ends])
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
        return PeriodDerivative(self.e, self.period, self.state, self.w)

    @cached_property
    def slips(self) -> IntArray:
        """Unknowns of the slips of nodes that move among those that may."""
        h, m = self.e.shape
        first = h * m + 3 * len(self.e.model.load)
        return np.asarray(first + np.searchsorted(self.e.tangents, self.linear.moved))

    def like(self, other: InterfaceEvaluation) -> bool:
        """Whether the equations of both have the same form: the same nodes held to a way."""
        return np.array_equal(self.good, other.good)

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
        e, w = self.e, self.w
        h, m = e.shape
        q = self.x[: h * m].reshape(h, m)
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


def evaluate(
    e: InterfaceEquations, x: FloatArray, w: float, past: FloatArray | None = None
) -> InterfaceEvaluation:
    """Residual, its derivatives, and the period they come from.

    Parameters
    ----------
    e : InterfaceEquations
    x : (u,) ndarray
        Unknowns.
    w : float
        rad/s.
    past : (2 n,) ndarray, optional
        Slips before. Nodes that slip for good are then led to the verge of slipping, see the
        module; without it residual and derivative are those of the equations as they stand.

    Returns
    -------
    InterfaceEvaluation

    Raises
    ------
    StrangerMovesError
        When a node moves whose slips are not among the unknowns.
    """
    period = e.march(x, w)
    moving = period.moving
    if (moving & ~e.mobile).any():
        raise StrangerMovesError(moving)
    return InterfaceEvaluation(e, x, w, period, past)


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
