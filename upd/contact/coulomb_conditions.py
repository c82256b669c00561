"""Signorini's and Coulomb's conditions of one step: which iterate meets them, and their rows.

With the pressing forces given, only the tangential forces and slips are unknown, and friction's
limit is a disk at each node.

See `upd.contact.coulomb` for the equations and how they are solved.

References
----------
S. Hueeber, G. Stadler and B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572: the stabilised
Jacobian.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack
from scipy.optimize import linprog

from upd.contact.checks import EPS
from upd.contact.qp import HALF_THE_DIGITS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

OPEN, STICK, SLIP = 0, 1, 2
#: Sides of the polygons inside Coulomb's disks, for the question whether a contact can hold itself.
_SIDES = 16


@dataclass(frozen=True)
class NewtonRows:
    """One Newton system per node: P f + Q (C f - B s - b) = rhs, (n, c, c) and (n, c).

    `relaxed` (n, c) marks the rows that are not simply y = 0, `is_open` (n,) nodes that are open.
    """

    P: FloatArray
    Q: FloatArray
    rhs: FloatArray
    relaxed: BoolArray
    is_open: BoolArray

    def same_states(self, other: NewtonRows) -> bool:
        """Whether other rows have the same nodes open, stuck and slipping."""
        return np.array_equal(self.relaxed, other.relaxed) and np.array_equal(
            self.is_open, other.is_open
        )


@dataclass(frozen=True)
class AskedStep:
    """What a step asks for: b (m,), and load p (r,) or motion s (r,); columns of them for
    derivatives.
    """

    b: FloatArray
    load: FloatArray | None
    motion: FloatArray | None


@dataclass(frozen=True)
class Iterate:
    """Forces (m,) N, rigid motion (r,) mm, and y = (gap, -slip of the step) (m,) mm."""

    f: FloatArray
    s: FloatArray
    y: FloatArray
    #: Whether y is C f - B s - b of these very f and s, as computed.
    unprocessed: bool = False


@dataclass(frozen=True)
class CoupledStep:
    """One step.

    Attributes
    ----------
    at : Iterate
    state : (n,) ndarray of int
        OPEN, STICK or SLIP.
    residual : float
        Largest misfit of the conditions, of unprocessed forces, over the largest force.
    converged : bool
    method : {"newton", "fallback"}
    iterations : int
    """

    at: Iterate
    state: IntArray
    residual: float
    converged: bool
    method: str
    iterations: int


@dataclass
class CoulombConditions:
    """Coupled contact of n nodes with c = 2 or 3 components: what its answers meet.

    Parameters
    ----------
    C : (m, m) ndarray
        Compliance, symmetric positive definite, m = c n.
    B : (m, r) ndarray
        Displacement of the nodes by the rigid motions, full rank.
    mu : (n,) ndarray
        Friction.
    proven : (m, m) ndarray, optional
        L of C = L L' where it is known, what is above its diagonal is not used.
    pressed : (n,) ndarray, optional
        Normal forces, above zero, where they are given: all c components are then tangential.
    """

    C: FloatArray
    B: FloatArray
    mu: FloatArray
    proven: FloatArray | None = None
    pressed: FloatArray | None = None

    def __post_init__(self) -> None:
        self.n = len(self.mu)
        #: whether Newton's systems may be as soft as they are just below the limit of friction
        self.near_limit = False
        #: first tangential component
        self.first = 1 if self.pressed is None else 0
        self.c = len(self.C) // self.n
        diagonal = np.diagonal(self.C).reshape(self.c, self.n)
        # Weights of displacements against forces: one over the node's own compliance. Any positive
        # value is exact.
        self.rho_n = 1.0 / diagonal[0]
        self.rho_t = (self.c - self.first) / diagonal[self.first :].sum(axis=0)
        self.rho = np.tile(self.rho_t, (self.c, 1))
        self.rho[: self.first] = self.rho_n

    @cached_property
    def holds_itself(self) -> bool:
        """Whether forces within friction can balance without any load."""
        return self_locking(self.B, self.mu)

    @cached_property
    def factor(self) -> FloatArray:
        """L of C = L L', (m, m), in its lower triangle."""
        if self.proven is not None:
            return self.proven
        L, info = lapack.dpotrf(self.C.T, lower=1, clean=0)
        if info != 0:
            raise np.linalg.LinAlgError("compliance is not positive definite")
        return np.asarray(L)

    def solved(self, b: FloatArray) -> FloatArray:
        """C^-1 b, of one column or many."""
        return np.asarray(lapack.dpotrs(self.factor, b, lower=1)[0])

    @cached_property
    def carried(self) -> tuple[FloatArray, FloatArray]:
        """V (m, r) and A (r, r): everything stuck, under a load p,

        f = W b + V p, s = A p - V'b, with A = (B'C^-1 B)^-1, V = C^-1 B A, W = C^-1 - V A^-1 V'.
        """
        CB = self.solved(self.B)
        A = np.linalg.inv(self.B.T @ CB)
        A = 0.5 * (A + A.T)
        return CB @ A, A

    def states(self, at: Iterate) -> IntArray:
        """OPEN, STICK or SLIP of every node."""
        f, y = at.f.reshape(self.c, self.n), at.y.reshape(self.c, self.n)
        push = self._push(f, y)
        q = f[self.first :] - self.rho_t * y[self.first :]
        slips = np.sqrt((q**2).sum(axis=0)) > self.mu * push
        return np.asarray(np.where(push <= 0.0, OPEN, np.where(slips, SLIP, STICK)), np.int64)

    def _push(self, f: FloatArray, y: FloatArray) -> FloatArray:
        """(n,) normal force of forces and misfits (c, n), below zero where the node opens."""
        return f[0] - self.rho_n * y[0] if self.pressed is None else self.pressed

    def _misfit(self, step: AskedStep, at: Iterate) -> FloatArray:
        """y (m,) of the forces and the motion."""
        return at.y if at.unprocessed else self.C @ at.f - self.B @ at.s - step.b

    def judged(self, step: AskedStep, at: Iterate, used: int) -> CoupledStep:
        residual, allowed, size = self._residual(step, at)
        state = self.states(at)
        return CoupledStep(
            at,
            state,
            float(residual.max()) / size,
            bool((residual <= allowed).all()),
            "newton",
            used,
        )

    def _residual(self, step: AskedStep, at: Iterate) -> tuple[FloatArray, FloatArray, float]:
        """Misfit f - Pi(f + rho u) of every dof in N, its rounding level, and the largest force."""
        f = at.f.reshape(self.c, self.n)
        y = self._misfit(step, at).reshape(self.c, self.n)
        want_n = np.maximum(self._push(f, y), 0.0)
        q = f[self.first :] - self.rho_t * y[self.first :]
        shrink = self._shrink(q, self.mu * want_n)
        want = np.vstack((want_n, q * shrink))[1 - self.first :]
        misfit = np.abs(f - want)
        size = float(np.abs(at.f).max(initial=0.0))
        terms = (
            np.sqrt(np.diagonal(self.C)) * float(np.sqrt(np.diagonal(self.C)) @ np.abs(at.f))
            + np.abs(self.B) @ np.abs(at.s)
            + np.abs(step.b)
        )
        # The projection shrinks errors of the slip, which far beyond a given limit are large.
        rho = (self.rho if self.pressed is None else self.rho * shrink).ravel()
        # Nothing may touch: then what the displacements could press with is the measure.
        size = size or float((rho * terms).max())
        allowed = 4.0 * (len(self.C) + 10) * EPS * (np.abs(at.f) + rho * terms + size)
        residual = misfit.ravel()
        if step.load is not None:
            off = np.abs(self.B.T @ at.f - step.load)
            # By the forces there are, not by those that displacements could press with.
            reach = np.abs(self.B.T) @ np.abs(at.f) + np.abs(step.load)
            reach += np.abs(at.f).max(initial=0.0) * np.abs(self.B).max(axis=0)
            residual = np.concatenate((residual, off))
            allowed = np.concatenate((allowed, 4.0 * (len(self.C) + 10) * EPS * reach))
        # Slips so large that rounding hides half of the digits of the forces are no answer.
        return residual, np.minimum(allowed, HALF_THE_DIGITS * size), size or 1.0

    @staticmethod
    def _shrink(q: FloatArray, limit: FloatArray) -> FloatArray:
        """Factors (n,) that bring q (d, n) inside the limits."""
        length = np.sqrt((q**2).sum(axis=0))
        out: FloatArray = np.ones_like(length)
        far = length > limit
        out[far] = limit[far] / length[far]
        return out

    def all_stuck(self) -> NewtonRows:
        n, c = self.n, self.c
        one = np.broadcast_to(np.eye(c), (n, c, c)).copy()
        free = np.zeros((n, c), bool)
        return NewtonRows(np.zeros((n, c, c)), one, np.zeros((n, c)), free, free[:, 0].copy())

    def rows_at(self, at: Iterate) -> NewtonRows:
        """Rows of the stabilised Jacobian at an iterate.

        Open: f = 0. Closed: g = 0, and dw = 0 where it sticks. Where it slips, with
        q = f_t + rho dw, b = mu (f_n - rho g) and v = q / |q|,

            F = f_t - b v = 0,   (I - e (I - M)) df_t - rho e (I - M) d(dw) - v db = -F,
            e = b / |q|,   M = beta f_t v' / max(b, |f_t|),

        written for the new values, where b is mu times the new f_n (g = 0 there):

            (I - e (I - M)) f_t - rho e (I - M) dw - mu v f_n = -e (I - M) q,

        with mu v f_n on the right where f_n is given.
        """
        n, c = self.n, self.c
        rows = self.all_stuck()
        f, y = at.f.reshape(c, n), at.y.reshape(c, n)
        state = self.states(at)
        is_open, slips = state == OPEN, state == SLIP
        rows.P[is_open], rows.Q[is_open] = np.eye(c), 0.0
        rows.relaxed[is_open] = rows.is_open[is_open] = True
        k = np.flatnonzero(slips)
        if k.size:
            P, Q, rhs = self._slip_rows(f[:, k], y[:, k], k, self._push(f, y)[k])
            own = slice(self.first, None)
            rows.P[k, own], rows.Q[k, own], rows.rhs[k, own] = P, Q, rhs
            rows.relaxed[k, own] = True
        return rows

    def _slip_rows(
        self, f: FloatArray, y: FloatArray, k: IntArray, push: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """P (k, d, c), Q (k, d, c) and rhs (k, d) of slipping nodes, d tangential components."""
        first, mu, rho = self.first, self.mu[k], self.rho_t[k]
        d, t, dw = self.c - first, f[first:], -y[first:]
        q = t + rho * dw
        limit = mu * push
        size_q, size_t = np.sqrt((q**2).sum(axis=0)), np.sqrt((t**2).sum(axis=0))
        P, Q = np.zeros((k.size, d, self.c)), np.zeros((k.size, d, self.c))
        way = q / np.where(size_q > 0.0, size_q, 1.0)
        rhs = np.zeros((k.size, d))
        if first:
            P[:, :, 0] = -(mu * way).T
        else:
            rhs += (limit * way).T
        if d == 1:
            P[:, 0, first] = 1.0
            return P, Q, rhs
        e = limit / np.where(size_q > 0.0, size_q, 1.0)
        top = np.maximum(limit, size_t)
        safe = np.where(top > 0.0, top, 1.0)
        cosine = (t * way).sum(axis=0) / np.where(size_t > 0.0, size_t, 1.0)
        short = np.minimum(size_t / np.where(limit > 0.0, limit, np.inf), 1.0)
        # Damping where traction and slip point apart; none (beta = 1) where they agree.
        beta = 1.0 / (1.0 - np.minimum(cosine, 0.0) * short)
        M = np.einsum("in,jn->nij", beta * t / safe, way)
        turn = e[:, None, None] * (np.eye(d) - M)
        P[:, :, first:] = np.eye(d) - turn
        Q[:, :, first:] = rho[:, None, None] * turn
        return P, Q, rhs - np.einsum("nij,jn->ni", turn, q)


def self_locking(columns: FloatArray, friction: FloatArray) -> bool:
    """Whether forces within friction can balance each other without any load.

    Then a state is not unique (residual forces remain after unloading), and a load may jam. By a
    linear programme: the largest sum of normal forces with B'f = 0. Two tangential directions have
    polygons inside Coulomb's disks: friction up to 2 % above the limit may be missed.

    Parameters
    ----------
    columns : (c n, r) ndarray
        B.
    friction : (n,) ndarray

    Returns
    -------
    bool
    """
    G = _pyramids(columns, friction)
    n = len(friction)
    size = np.abs(columns).max(axis=0)
    found = linprog(
        -np.ones(G.shape[1]),
        A_eq=(G / size[:, None]),
        b_eq=np.zeros(len(G)),
        bounds=(0.0, 1.0),
        method="highs",
    )
    most = 0.0 if found.fun is None else -float(found.fun)
    return bool(found.status == 0 and most > np.sqrt(np.finfo(float).eps) * n)


def carries(columns: FloatArray, friction: FloatArray, load: FloatArray) -> bool:
    """Whether some forces within friction balance a load B'f = load.

    Two tangential directions have polygons around Coulomb's disks: what is refused has no answer.

    Parameters
    ----------
    columns : (c n, r) ndarray
    friction : (n,) ndarray
    load : (r,) ndarray
        N.

    Returns
    -------
    bool
    """
    G = _pyramids(columns, friction, around=True)
    size = np.abs(columns).max(axis=0)
    unit = float(np.abs(load).max(initial=0.0)) or 1.0
    found = linprog(
        np.ones(G.shape[1]),
        A_eq=G / size[:, None],
        b_eq=load / size / unit,
        bounds=(0.0, None),
        method="highs",
    )
    return bool(found.status == 0)


def _pyramids(columns: FloatArray, friction: FloatArray, *, around: bool = False) -> FloatArray:
    """(r, edges): B' on the edges of pyramids in or around the cones, unit normal force."""
    n = len(friction)
    parts = columns.reshape(-1, n, columns.shape[1])
    if len(parts) == 2:
        ways = np.array([[1.0], [-1.0]])
    else:
        angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        ways = np.column_stack((np.cos(angle), np.sin(angle)))
        ways /= np.cos(np.pi / _SIDES) if around else 1.0
    edges = [
        (parts[0] + friction[:, None] * np.einsum("d,dnr->nr", way, parts[1:])) for way in ways
    ]
    return np.concatenate(edges).T
