"""Coulomb friction between two condensed bodies at frozen normal forces, with the slip history."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import blas

from upd.contact.checks import (
    EPS,
    Problems,
    compliance_matrix,
    few_threads,
    numbers,
    one_of,
)
from upd.contact.coulomb import Coulomb
from upd.contact.coulomb_conditions import Iterate
from upd.contact.qp import (
    FREE,
    HALF_THE_DIGITS,
    BoxQP,
    FloatArray,
    ForceSolution,
    Method,
    State,
)
from upd.errors import ConvergenceError
from upd.labels import Shown

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, repr=False)
class TangentialHistory(Shown):
    """What the next load step must know about the one before.

    Attributes
    ----------
    slip : (n,) or (2 n,) ndarray
        Accumulated slip [mm].
    force : (n,) or (2 n,) ndarray
        Tractions [N].
    state : (n,) ndarray of int
        0 stick, +1 or -1 slip (+1 in two directions).
    """

    slip: FloatArray
    force: FloatArray
    state: State


@dataclass(frozen=True, repr=False)
class TangentialContact(Shown):
    """Answer of one tangential load step at n nodes.

    Vectors are (n,), or (2 n,) = [x_0 .. x_{n-1}, y_0 .. y_{n-1}] in two directions.

    Attributes
    ----------
    force : (n,) or (2 n,) ndarray
        Tractions [N].
    slip : (n,) or (2 n,) ndarray
        Accumulated slip [mm].
    stick, slipping : (n,) ndarray of bool
        Both False at nodes without normal force.
    displacement : float or (2,) ndarray
        Rigid displacement of the bodies [mm].
    load : float or (2,) ndarray
        Sum of the tractions [N].
    slip_work : float
        Work dissipated in this step [N mm].
    stiffness : float or (2, 2) ndarray
        dT/dd [N/mm].
    iterations : int
        Steps of the solver.
    method : {"active set", "fallback"}
        Method that finished.
    status : {"converged", "gross slip", "no friction"}
    message : str
        One sentence.
    history : TangentialHistory
        For the next step.
    unclipped : (n,) or (2 n,) ndarray
        Tractions before they were brought inside their limits [N]: for checks.
    rates : (n, 1) or (2 n, 2) ndarray or None
        Change of the tractions with the displacement [N/mm], whose sums are the stiffness; None
        where another solver found the answer.
    """

    force: FloatArray
    slip: FloatArray
    stick: BoolArray
    slipping: BoolArray
    displacement: float | FloatArray
    load: float | FloatArray
    slip_work: float
    stiffness: float | FloatArray
    iterations: int
    method: str
    status: str
    message: str
    history: TangentialHistory
    unclipped: FloatArray
    rates: FloatArray | None = None


@dataclass(frozen=True, repr=False)
class TangentialPath(Shown):
    """Answers of a load history of k steps.

    Attributes
    ----------
    displacement, load : (k,) or (k, 2) ndarray
        Rigid displacement [mm] and load [N].
    force, slip : (k, n) or (k, 2 n) ndarray
        Tractions [N] and accumulated slip [mm].
    state : (k, n) ndarray of int
        0 stick, +1 or -1 slip, 0 without normal force.
    slip_work : (k,) ndarray
        Work dissipated per step [N mm].
    stiffness : (k,) or (k, 2, 2) ndarray
        dT/dd [N/mm].
    iterations : (k,) ndarray of int
        Steps of the solver.
    fallbacks : int
        Number of load steps that the fallback had to finish.
    status : {"converged", "gross slip", "no friction"}
        "gross slip" when some step slips everywhere.
    message : str
        One sentence.
    history : TangentialHistory
        After the last step.
    unclipped : (k, n) or (k, 2 n) ndarray
        Tractions before they were brought inside their limits [N]: for checks.
    """

    displacement: FloatArray
    load: FloatArray
    force: FloatArray
    slip: FloatArray
    state: State
    slip_work: FloatArray
    stiffness: FloatArray
    iterations: NDArray[np.int_]
    fallbacks: int
    status: str
    message: str
    history: TangentialHistory
    unclipped: FloatArray

    def loop_area(self, first: int = 0) -> float:
        """Work of the load over the path, by the trapezoidal rule.

        Parameters
        ----------
        first : int
            Step the path is taken from; over a closed loop the work is the dissipated energy.

        Returns
        -------
        float
            Work [N mm].
        """
        middle = (self.load[first + 1 :] + self.load[first:-1]) / 2
        return float((middle * np.diff(self.displacement[first:], axis=0)).sum())


def tangential_contact(
    compliance: ArrayLike,
    limit: ArrayLike,
    *,
    load: ArrayLike | None = None,
    displacement: ArrayLike | None = None,
    history: TangentialHistory | None = None,
) -> TangentialContact:
    """Friction tractions for one load step at frozen normal forces.

    Slip w = d - C t. A node sticks, w = w_prev, or slips with |t| = limit and w - w_prev = lambda
    t, lambda >= 0: the minimum of 1/2 t'C t - (d - w_prev)'t over |t_i| <= limit_i, with the rigid
    displacement d given or found from the load e't = T.

    Parameters
    ----------
    compliance : (n, n) or (2 n, 2 n) array_like
        Compliance [mm/N], symmetric positive definite: (n, n) for one direction, (2 n, 2 n) for two
        with dofs [x_0 .. x_{n-1}, y_0 .. y_{n-1}].
    limit : (n,) array_like
        Friction limits [N]: mu times the normal force, >= 0.
    load : float or (2,) array_like, optional
        Load T [N]. Give exactly one of `load` and `displacement`.
    displacement : float or (2,) array_like, optional
        Rigid displacement d [mm].
    history : TangentialHistory, optional
        Of the step before; None starts from no slip and full stick.

    Returns
    -------
    TangentialContact

    Raises
    ------
    InputError
        For bad input, and for gross slip (a load not below the sum of the limits); all problems are
        named.
    ConvergenceError
        When no method reaches the tolerance.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), section 7.2; S. Hueeber, G. Stadler and
    B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572.

    Examples
    --------
    The two outer nodes of three slip under 9 N, the middle one takes the rest:

    >>> import numpy as np
    >>> from upd.contact import tangential_contact
    >>> C = 1e-5 * np.array([[2.0, 1.0, 0.5], [1.0, 2.0, 1.0], [0.5, 1.0, 2.0]])
    >>> result = tangential_contact(C, limit=[3.0, 6.0, 3.0], load=9.0)
    >>> result.force.round(6).tolist()
    [3.0, 3.0, 3.0]
    >>> result.slipping.tolist()
    [True, False, True]
    >>> round(1e3 * result.displacement, 6)  # um
    0.12
    """
    with few_threads(compliance):
        problems = Problems("tangential contact")
        solver = _TangentialSolver(problems, compliance, limit)
        values = solver.targets(problems, load, displacement, steps=False)
        start = solver.start(problems, history)
        problems.raise_any()
        return solver.step(values, load is not None, start)


def tangential_path(
    compliance: ArrayLike,
    limit: ArrayLike,
    *,
    loads: ArrayLike | None = None,
    displacements: ArrayLike | None = None,
    history: TangentialHistory | None = None,
) -> TangentialPath:
    """March a load history, each step from the slip and the states of the one before.

    Parameters
    ----------
    compliance : (n, n) or (2 n, 2 n) array_like
        Compliance [mm/N], as in `tangential_contact`.
    limit : (n,) array_like
        Friction limits [N].
    loads : (k,) or (k, 2) array_like, optional
        Loads [N]. Give exactly one of `loads` and `displacements`.
    displacements : (k,) or (k, 2) array_like, optional
        Rigid displacements [mm].
    history : TangentialHistory, optional
        Of the step before the first; None starts from no slip and full stick.

    Returns
    -------
    TangentialPath

    Raises
    ------
    InputError, ConvergenceError
        As in `tangential_contact`.

    Examples
    --------
    A full cycle of the load: the loop area is the work dissipated by slip.

    >>> import numpy as np
    >>> from upd.contact import tangential_path
    >>> C = 1e-5 * np.array([[2.0, 1.0, 0.5], [1.0, 2.0, 1.0], [0.5, 1.0, 2.0]])
    >>> path = tangential_path(C, limit=[3.0, 6.0, 3.0], loads=[9.0, -9.0, 9.0])
    >>> path.state.tolist()
    [[1, 0, 1], [-1, 0, -1], [1, 0, 1]]
    >>> (1e3 * path.displacement).round(6).tolist()  # um
    [0.12, -0.12, 0.12]
    >>> bool(np.all(path.slip_work > 0))
    True
    """
    with few_threads(compliance):
        problems = Problems("tangential path")
        solver = _TangentialSolver(problems, compliance, limit)
        values = solver.targets(problems, loads, displacements, steps=True)
        at = solver.start(problems, history)
        problems.raise_any()
        steps: list[TangentialContact] = []
        for value in values:
            steps.append(solver.step(value, loads is not None, at))
            at = steps[-1].history
    bad = [step for step in steps if step.status != "converged"]
    stacked = {name: np.array([getattr(step, name) for step in steps]) for name in _STACKED}
    return TangentialPath(
        **stacked,
        state=np.array([step.history.state for step in steps]),
        fallbacks=sum(step.method == "fallback" for step in steps),
        status=bad[0].status if bad else "converged",
        message=f"{len(steps)} load steps solved."
        + (f" {len(bad)} of them: {bad[0].message}" if bad else ""),
        history=at,
    )


#: what a path has of each step
_STACKED = (
    *("displacement", "load", "force", "slip", "slip_work", "stiffness", "iterations"),
    "unclipped",
)


class _TangentialSolver:
    """Checked compliance and limit, ready for many steps.

    Only nodes with a limit above zero enter the problem.
    """

    def __init__(self, problems: Problems, compliance: ArrayLike, limit: ArrayLike) -> None:
        C, L = compliance_matrix(problems, compliance)
        s = numbers(problems, "limit", limit, ("n",))
        self.directions, self.limit, self.n = 1, np.zeros(0), 0
        if s is None:
            return
        self.limit, self.n = s, s.size
        negative = np.flatnonzero(s < 0)
        problems.add(
            negative.size > 0,
            f"limit is negative at {negative.size} nodes: it is mu times a normal force >= 0.",
        )
        if C is None or problems.add(
            len(C) not in (s.size, 2 * s.size),
            f"compliance has {len(C)} rows for {s.size} limits: it needs n rows (one "
            "direction) or 2n (two directions, x dofs first).",
        ):
            return
        if problems.found:
            return
        self.directions = len(C) // s.size
        self.carried = np.flatnonzero(s > 0)
        self.dofs = np.concatenate([self.carried + i * s.size for i in range(self.directions)])
        self.bound = s[self.carried]
        self.total = float(s.sum())
        self.C = C
        if self.carried.size:
            inner = C
            if self.carried.size < s.size:
                inner, L = C[np.ix_(self.dofs, self.dofs)], None
            if self.directions == 1:
                self.box = BoxQP(inner)
            else:
                n = self.carried.size
                rigid = np.asarray(np.kron(np.eye(2), np.ones((n, 1))), np.float64)
                self.disks = Coulomb(inner, rigid, np.ones(n), L, self.bound)

    def targets(
        self,
        problems: Problems,
        load: ArrayLike | None,
        displacement: ArrayLike | None,
        *,
        steps: bool,
    ) -> FloatArray:
        """Loads or displacements as an array () or (2,) per step.

        Problems are noted for a wrong shape and for gross slip.
        """
        names = ("loads", "displacements") if steps else ("load", "displacement")
        one: tuple[int, ...] = () if self.directions == 1 else (2,)
        shapes = [("k", *one), (0, *one)] if steps else [one]
        given = dict(zip(names, (load, displacement), strict=True))
        found = one_of(problems, *shapes, **given)
        if found is None:
            return np.zeros(0)
        name, values = found
        if load is None or problems.found:
            return values
        size = np.atleast_1d(
            np.abs(values) if self.directions == 1 else np.hypot(values[..., 0], values[..., 1])
        )
        # A load within rounding of the limit leaves no node to stick; no load on no friction is
        # fine.
        gross = np.flatnonzero((size >= self.total * (1 - 4 * self.n * EPS)) & (size > 0))
        place = f"{name}[{gross[0] if gross.size else 0}]" if steps else name
        problems.add(
            gross.size > 0,
            f"gross slip: {place} is {size[gross[0]] if gross.size else 0:.9g} N and the "
            "friction limit, the sum of mu N over the nodes, "
            f"is {self.total:.9g} N: there is no static answer. Lower the load, raise mu "
            "N, or prescribe the displacement.",
        )
        return values

    def start(self, problems: Problems, history: TangentialHistory | None) -> TangentialHistory:
        """The history, checked; without one, no slip and all nodes stick."""
        size = self.directions * self.n
        if history is None:
            return TangentialHistory(
                np.zeros(size), np.zeros(size), np.zeros(self.n, dtype=np.int8)
            )
        for name, wanted in (("slip", size), ("force", size), ("state", self.n)):
            numbers(problems, f"history.{name}", getattr(history, name), (wanted,))
        return history

    def step(self, value: FloatArray, by_load: bool, at: TangentialHistory) -> TangentialContact:
        """One checked load step."""
        before = at.slip[self.dofs]
        load, motion = (value, None) if by_load else (None, value)
        if not self.carried.size:
            # the bodies slide past each other by the displacement; a load can only be zero
            r, none = self.directions, np.zeros(0)
            d = np.zeros(r) if motion is None else np.atleast_1d(motion)
            zero, state = np.zeros((r, r)), np.zeros(0, dtype=np.int8)
            rates = np.zeros((0, r))
            answer = ForceSolution(none, none, d, state, 0, "active set", zero, none, rates)
        elif self.directions == 1:
            answer = self.box.solve(
                before,
                -self.bound,
                self.bound,
                load=load,
                motion=motion,
                state=at.state[self.carried],
            )
        else:
            answer = self._in_two_directions(at, load, motion)
        return self._result(at, answer, load)

    def _in_two_directions(
        self, at: TangentialHistory, load: FloatArray | None, motion: FloatArray | None
    ) -> ForceSolution:
        # every step by itself: a path is its single steps
        solver, before = self.disks.twin(), at.slip[self.dofs]
        limit, slipping, start = np.tile(self.bound, 2), at.state[self.carried] != FREE, None
        if slipping.any():
            # on the rim, also when the limit changed since the last step
            f = at.force[self.dofs]
            size = np.tile(np.hypot(*f.reshape(2, -1)), 2)
            rim = np.tile(slipping, 2) & (size > 0.0)
            f[rim] *= (limit / np.where(rim, size, 1.0))[rim]
            onwards = HALF_THE_DIGITS * f / solver.rho.ravel()
            start = Iterate(f, np.zeros(2), -np.where(rim, onwards, 0.0))
        found = solver.solve(-before, load=load, motion=motion, start=start)
        if not found.converged:
            raise ConvergenceError(
                f"friction problem with {len(self.bound)} nodes in two directions: no answer after "
                f"{found.iterations} steps of Newton and its fallback. Take smaller load steps, or "
                "look for nearly dependent rows in the compliance matrix."
            )
        # rounding removed: no traction beyond its limit, no slip where a node sticks
        x, s = solver.nearest(found.at.f), found.at.s
        y = solver.C @ x - solver.B @ s + before
        q = np.hypot(*(x - solver.rho.ravel() * y).reshape(2, -1))
        slips = q > self.bound * (1.0 + 4.0 * (len(x) + 10) * EPS)
        y[np.tile(~slips, 2)] = 0.0
        rates = solver.derivative(Iterate(x, s, y))
        method: Method = "fallback" if found.method == "fallback" else "active set"
        state = slips.astype(np.int8)
        K = solver.B.T @ rates
        return ForceSolution(x, y, s, state, found.iterations, method, K, found.at.f, rates)

    def _result(
        self, at: TangentialHistory, answer: ForceSolution, load: FloatArray | None
    ) -> TangentialContact:
        """Spread the answer of the carried nodes over all nodes.

        The others slip freely, w = d - C t.
        """
        size, some = self.directions * self.n, self.carried.size
        force, slip, full = np.zeros(size), np.zeros(size), np.zeros(self.n, dtype=np.int8)
        raw, rates = np.zeros(size), np.zeros((size, self.directions))
        rates[self.dofs] = answer.rates
        force[self.dofs], raw[self.dofs] = answer.x, answer.unclipped
        if some < self.n:
            slip = np.repeat(answer.motion, self.n)
        if 0 < some < self.n:
            slip -= blas.dgemv(1.0, self.C.T, force)
        slip[self.dofs] = at.slip[self.dofs] - answer.residual
        full[self.carried] = answer.state
        stick = np.zeros(self.n, dtype=bool)
        stick[self.carried] = answer.state == FREE
        slipping = full != FREE
        status = "converged"
        message = (
            f"{int(stick.sum())} nodes stick, {int(slipping.sum())} slip after "
            f"{answer.iterations} steps of the {answer.method}."
        )
        if not some:
            status = "no friction"
            message = (
                "No node has a friction limit above zero: no traction, the slip is the rigid "
                "displacement (zero under zero load)."
            )
        elif load is None and not stick.any():
            status = "gross slip"
            message = (
                f"Gross slip: all {some} nodes slip at the friction limit. Lower "
                "the displacement or raise mu N."
            )
        total = answer.x.reshape(self.directions, -1).sum(axis=1) if load is None else load
        one = self.directions == 1
        return TangentialContact(
            force=force,
            slip=slip,
            stick=stick,
            slipping=slipping,
            displacement=answer.motion.item() if one else answer.motion,
            load=total.item() if one else total,
            slip_work=float(answer.x @ (slip - at.slip)[self.dofs]),
            stiffness=answer.stiffness.item() if one else answer.stiffness,
            iterations=answer.iterations,
            method=answer.method,
            status=status,
            message=message,
            history=TangentialHistory(slip, force, full),
            unclipped=raw,
            rates=rates if some else None,
        )
