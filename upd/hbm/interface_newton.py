"""Residual and derivative of the balance by whole faces, for Newton's method.

The derivative is exact: the recursion of `upd.hbm.interface_jacobian` through the samples. Two
kinds of nodes need more than that on the way to an answer. A node whose slips in a period add up,
instead of taking each other back, is on its way to a place from which it does not slip any more:
the verge of slipping, at one sample. There its slip has vanished, so that the derivative does not
see it, although any motion that is larger makes it slip on. So a node that sticks away from the
place of its past is asked to stand on that verge, and one that slips for good, or stands there, is
not asked where it ends up across its slip, which vanishes with the slip.

References
----------
M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865: active sets as a semismooth
Newton method.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.interface_equations import ContactPeriod, IntArray, InterfaceEquations
from upd.hbm.interface_jacobian import VERGE, period_derivative
from upd.hbm.interface_state import FloatArray
from upd.hbm.interface_step import STICK

#: net slip over the way slipped in a period: 0 for a periodic motion, 1 for a slip in one direction
ADDS_UP = 0.5


class InterfaceEvaluation(NamedTuple):
    """The equations at one point.

    Attributes
    ----------
    residual : (u,) ndarray
    jacobian : (u, u) ndarray
        By the unknowns.
    by_w : (u,) ndarray
        By the frequency in rad/s.
    period : ContactPeriod
        What they come from.
    """

    residual: FloatArray
    jacobian: FloatArray
    by_w: FloatArray
    period: ContactPeriod


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
    model = e.model
    period = e.march(x, w)
    moving = period.moving
    if (moving & ~e.mobile).any():
        raise StrangerMovesError(moving)
    q, rigid, slip = e.split(x)
    h, m = e.shape
    alpha, beta = e.stiffness(w)
    turned = e.turned(q, np.ones(h))
    ends = e.joined(np.zeros((h, m)), rigid - period.rigid, slip - period.slip)[h * m :]
    residual = np.concatenate([e.misfit(period, q, w).ravel(), ends])
    along = np.zeros((2, model.n)) if past is None else slips_for_good(e, period)
    state = period.state if past is None else _with_verges(e, period, slip != past, along)
    forces, D, moved = _derivative(e, period, state, w)
    u, r = len(x), len(model.load)
    Jac, by_w = np.zeros((u, u)), np.zeros(u)
    told = (-e.Q @ forces.reshape(e.samples, -1)).reshape(h, -1, m)
    spread = told.transpose(0, 2, 1).reshape(h * m, -1)
    # unknowns of the columns: slips of the nodes that move among those that may
    of_slips = h * m + 3 * r + np.searchsorted(e.tangents, moved)
    own = np.concatenate([np.arange(h * m + 3 * r), of_slips])
    into = np.concatenate([np.arange(h * m, h * m + 3 * r), of_slips])
    Jac[: h * m, own] = spread[:, :-2]
    rows = np.arange(h * m)
    Jac[rows, rows] += alpha.ravel()
    # cosine to sine of the same harmonic, and back
    a, b = rows.reshape(h, m)[1::2].ravel(), rows.reshape(h, m)[2::2].ravel()
    Jac[a, b] += beta[1::2].ravel()
    Jac[b, a] -= beta[2::2].ravel()
    by_w[: h * m] = spread[:, -2]
    by_w[: h * m] += ((alpha - model.omega**2) * 2.0 / w * q + beta / w * turned).ravel()
    Jac[np.arange(h * m, u), np.arange(h * m, u)] = 1.0
    Jac[np.ix_(into, own)] -= D[:, :-2]
    by_w[into] = -D[:, -2]
    residual[: h * m] += spread[:, -1]
    residual[into] -= D[:, -1]
    _hold_across(e, along, residual, Jac, by_w)
    return InterfaceEvaluation(residual, Jac, by_w, period)


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


def _hold_across(
    e: InterfaceEquations,
    along: FloatArray,
    residual: FloatArray,
    Jac: FloatArray,
    by_w: FloatArray,
) -> None:
    """Nodes that slip out of the way for good do not slip across that way.

    What is left of such a slip vanishes as the equations are solved, and with it what tells
    where the node ends up across: the derivative of that is of the order of the slip itself,
    and no direction for Newton's method.
    """
    c = len(e.tangents) // 2
    first = len(by_w) - 2 * c
    mine = along[:, e.mobile]
    for i in np.flatnonzero(mine.any(axis=0)):
        rows = first + np.array([i, c + i])
        keep = np.outer(mine[:, i], mine[:, i])
        Jac[rows] = keep @ Jac[rows]
        Jac[np.ix_(rows, rows)] += np.eye(2) - keep
        by_w[rows], residual[rows] = keep @ by_w[rows], keep @ residual[rows]


def _derivative(
    e: InterfaceEquations, period: ContactPeriod, state: IntArray, w: float
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Of modal forces and end state, and the tangents that move."""
    model, step, n = e.model, e.step(w), e.model.n
    on = np.flatnonzero((state != STICK).any(axis=0))
    moved = np.concatenate([n + on, 2 * n + on])
    h, m = e.shape
    r = len(model.load)
    place = np.full(3 * n, -1)
    place[moved] = np.arange(len(moved))
    columns = h * m + 3 * r + len(moved) + 2
    forces = np.empty((e.samples, columns, m))
    D = np.empty((columns, 3 * r + len(moved)))
    Z = np.ascontiguousarray(step.Z[:, : m + r])
    M = e.moves[:, : m + r].T @ Z
    fine = period_derivative(
        period.force,
        period.relative,
        state,
        step.W,
        Z,
        M,
        e.E,
        moved,
        place,
        model.columns,
        step.J,
        step.dJ,
        model.load,
        model.friction,
        step.rho_n,
        step.rho_t,
        forces,
        D,
    )
    if not fine:
        forces[:], D[:] = np.nan, np.nan
    return forces, D.T, moved
