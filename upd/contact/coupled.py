"""Quasi-static contact of condensed elastic bodies with friction, normal and tangential at once.

References
----------
.. [1] K. L. Johnson, Contact Mechanics (1985), sections 5.4 and 7.1.
.. [2] S. Hueeber, G. Stadler and B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.contact.checks import (
    Problems,
    compliance_matrix,
    few_threads,
    numbers,
    one_of,
)
from upd.contact.coulomb import Coulomb
from upd.contact.coulomb_conditions import CoupledStep, Iterate, carries
from upd.errors import ConvergenceError, InputError
from upd.labels import Shown

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, repr=False)
class CoupledHistory(Shown):
    """What the next load step must know about the one before.

    Attributes
    ----------
    force : (n, c) ndarray
        Forces [N]: normal, tangential.
    slip : (n, c - 1) ndarray
        Accumulated slip [mm]: also the way that open nodes move.
    gap : (n,) ndarray
        Gap [mm].
    motion : (r,) ndarray
        Rigid motion [mm].
    step : (n, c - 1) ndarray
        Slip of the last step [mm].
    load : (r,) ndarray
        B'f [N].
    """

    force: FloatArray
    slip: FloatArray
    gap: FloatArray
    motion: FloatArray
    step: FloatArray
    load: FloatArray


@dataclass(frozen=True, repr=False)
class CoupledContact(Shown):
    """Answers of a load history of k steps at n nodes with c = 2 or 3 components.

    Attributes
    ----------
    force : (k, n, c) ndarray
        Normal force and tangential forces of every node [N].
    gap : (k, n) ndarray
        Gap [mm], zero where closed.
    slip : (k, n, c - 1) ndarray
        Accumulated relative motion along the face [mm].
    state : (k, n) ndarray of int
        0 open, 1 stick, 2 slip.
    displacement, load : (k, r) ndarray
        Rigid motion [mm] (approach and tangential shift without `columns`) and B'f [N].
    work, slip_work : (k,) ndarray
        Work of the load and the offset per step, p.ds - f.d(offset) by the trapezoidal rule, and
        dissipated work with the forces after the step, which oppose its slip: never negative
        [N mm].
    residual : (k,) ndarray
        Largest misfit of both laws over the largest force, from unprocessed forces and
        displacements.
    iterations : (k,) ndarray of int
        Steps of the solver.
    fallbacks : int
        Load steps that the fallback had to finish.
    self_locking : bool
        Whether friction is so large that the contact can hold forces without any load: the state
        then depends on how the load came, and a load may jam. Nodes that never touch count too.
    status : {"converged", "not converged"}
    message : str
        One sentence.
    history : CoupledHistory
        For the next step.
    """

    force: FloatArray
    gap: FloatArray
    slip: FloatArray
    state: IntArray
    displacement: FloatArray
    load: FloatArray
    work: FloatArray
    slip_work: FloatArray
    residual: FloatArray
    iterations: IntArray
    fallbacks: int
    self_locking: bool
    status: str
    message: str
    history: CoupledHistory
    _solver: Coulomb
    _last: Iterate
    _gap: FloatArray

    def go_on(
        self,
        *,
        load: ArrayLike | None = None,
        displacement: ArrayLike | None = None,
        offset: ArrayLike | None = None,
    ) -> CoupledContact:
        """More steps of the same bodies from here, without checking and factoring them again.

        Parameters
        ----------
        load, displacement, offset : array_like, optional
            As `coupled_contact`; the offset is from the place without any load.

        Returns
        -------
        CoupledContact
            Of the new steps.

        Raises
        ------
        InputError, ConvergenceError
            As `coupled_contact`.
        """
        with few_threads(()):
            problems = Problems("coupled contact")
            path = _path(problems, self._solver, load, displacement, offset)
            problems.raise_any()
            assert path is not None
            return _march(self._solver, self._gap, load is not None, path, self.history, True)

    def friction_loss(self, before: CoupledHistory) -> FloatArray:
        """Work that friction took in each step.

        By the mean tractions of a step over its slips: the work of all forces balances with it;
        the traction after the step alone is off by the step's share.

        Parameters
        ----------
        before : CoupledHistory
            State before the first step.

        Returns
        -------
        (k,) ndarray
            N mm.
        """
        tractions = np.concatenate((before.force[None, :, 1:], self.force[..., 1:]))
        slips = np.concatenate((before.slip[None], self.slip))
        mean = 0.5 * (tractions[1:] + tractions[:-1])
        return np.asarray((mean * np.diff(slips, axis=0)).sum(axis=(1, 2)))

    def fork(self) -> CoupledContact:
        """The same answers, to `go_on` from beside these: in another thread, for another history.

        Returns
        -------
        CoupledContact
            With the same matrices and factors.
        """
        return replace(self, _solver=self._solver.twin())

    def stiffness(self) -> FloatArray:
        """Tangent stiffness dB'f/ds (r, r) of the last step, with the states it has [N/mm].

        Raises ConvergenceError where the states change with any displacement.
        """
        try:
            df = self._solver.derivative(self._last)
        except np.linalg.LinAlgError as error:
            raise ConvergenceError(
                "coupled contact: the forces have no derivative by the displacement here: the "
                "states change with any displacement; step off this state."
            ) from error
        return np.asarray(self._solver.B.T @ df)


def coupled_contact(
    compliance: ArrayLike,
    gap: ArrayLike,
    friction: ArrayLike,
    *,
    load: ArrayLike | None = None,
    displacement: ArrayLike | None = None,
    history: CoupledHistory | None = None,
    columns: ArrayLike | None = None,
    offset: ArrayLike | None = None,
) -> CoupledContact:
    """Contact with Signorini's and Coulomb's conditions together, along a load history.

    Gap and slip follow from the forces f by w = B s - C f - offset, s the rigid motion:

        g = h - w_n >= 0, f_n >= 0, g f_n = 0;   |f_t| <= mu f_n, the slip of a step along f_t

    (f_t acts on the other body, and so opposes the slip).

    Parameters
    ----------
    compliance : (c n, c n) array_like
        Compliance of both bodies together [mm/N], c = 2 or 3 components: normal of all nodes, then
        x of all (and y of all).
    gap : (n,) array_like
        Gap before any load [mm].
    friction : float or (n,) array_like
        Coefficient of friction.
    load : (r,) or (k, r) array_like, optional
        B'f after each step [N]: N, T_x (and T_y) without `columns`. Give exactly one of `load` and
        `displacement`.
    displacement : (r,) or (k, r) array_like, optional
        Rigid motion after each step [mm]: approach, shift along x (and y) without `columns`.
    history : CoupledHistory, optional
        Of the step before the first; None starts without forces and slip.
    columns : (c n, r) array_like, optional
        B, the displacement of the nodes by each rigid motion (tilts, the six motions of a body that
        only its contacts hold, several faces with normals of their own). None: an approach and a
        shift along each tangential direction.
    offset : (c n,) or (k, c n) array_like, optional
        Imposed motion of the nodes after each step [mm], by component as `compliance`: in the
        normal direction it opens the gap, in a tangential one it is subtracted from the relative
        motion. From the place without any load, also where a history is continued; None is zero.
        A single row of load, displacement or offset beside several of the other holds in all of
        their steps.

    Returns
    -------
    CoupledContact

    Raises
    ------
    InputError
        For bad arguments; all problems at once.
    ConvergenceError
        When a load cannot be carried: a body lifts off, or slides as a whole.

    Examples
    --------
    Two nodes, pressed and pushed by less than friction holds.

    >>> import numpy as np
    >>> from upd.contact import coupled_contact
    >>> C = 1e-5 * np.kron(np.eye(2), [[2.0, 1.0], [1.0, 2.0]])
    >>> found = coupled_contact(C, [0.0, 0.0], 0.5, load=[[10.0, 0.0], [10.0, 4.0]])
    >>> found.force[-1].round(6).tolist()
    [[5.0, 2.0], [5.0, 2.0]]
    >>> found.state[-1].tolist()  # both stick
    [1, 1]
    """
    # Few dofs are closed and so share the work, and threads that wait for a busy core cost more
    # than they give.
    with few_threads(()):
        problems = Problems("coupled contact")
        solver, h = _solver(problems, compliance, gap, friction, columns)
        path = _path(problems, solver, load, displacement, offset)
        problems.raise_any()
        assert solver is not None and path is not None
        start = _start(solver, h, history)
        return _march(solver, h, load is not None, path, start, history is not None)


def _solver(
    problems: Problems,
    compliance: ArrayLike,
    gap: ArrayLike,
    friction: ArrayLike,
    columns: ArrayLike | None,
) -> tuple[Coulomb | None, FloatArray]:
    C, L = compliance_matrix(problems, compliance)
    h = numbers(problems, "gap", gap, ("n",))
    mu = numbers(problems, "friction", friction, (), ("n" if h is None else h.size,))
    if h is None or mu is None or C is None:
        return None, np.zeros(0)
    n = h.size
    problems.add(
        len(C) not in (2 * n, 3 * n),
        f"compliance has {len(C)} rows for {n} gaps: it needs 2n or 3n, normal of all nodes first.",
    )
    problems.add(bool((mu < 0.0).any()), "friction is negative: give coefficients >= 0.")
    if problems.found:
        return None, h
    B = np.kron(np.eye(len(C) // n), np.ones((n, 1)))
    if columns is not None:
        given = numbers(problems, "columns", columns, (len(C), "r"))
        if given is None:
            return None, h
        problems.add(
            np.linalg.matrix_rank(given / np.abs(given).max(axis=0, initial=1e-300))
            < given.shape[1],
            "columns are not independent: a rigid motion that is a sum of others leaves no "
            "unique answer; drop it.",
        )
        B = given
    return Coulomb(C, np.asarray(B, np.float64), np.full(n, mu, np.float64), L), h


def _path(
    problems: Problems,
    solver: Coulomb | None,
    load: ArrayLike | None,
    displacement: ArrayLike | None,
    offset: ArrayLike | None,
) -> tuple[FloatArray, FloatArray] | None:
    """Load or displacement (k, r) and offset (k, c n) after each step."""
    r, m = ("r", "c n") if solver is None else (solver.B.shape[1], len(solver.C))
    found = one_of(problems, (r,), ("k", r), load=load, displacement=displacement)
    given = None if offset is None else numbers(problems, "offset", offset, (m,), ("k", m))
    if solver is None or found is None or (offset is not None and given is None):
        return None
    values, offsets = found[1], np.zeros(len(solver.C)) if given is None else given
    if problems.add(
        offsets.ndim == values.ndim == 2 and len(offsets) != len(values),
        f"offset has {len(offsets)} steps, load or displacement {len(values)}: give as many, or "
        "one row that holds in all of them.",
    ):
        return None
    steps = max(len(np.atleast_2d(values)), len(np.atleast_2d(offsets)))
    return (
        np.broadcast_to(values, (steps, values.shape[-1])),
        np.broadcast_to(offsets, (steps, offsets.shape[-1])),
    )


def _start(solver: Coulomb, h: FloatArray, history: CoupledHistory | None) -> CoupledHistory:
    n, c, r = solver.n, solver.c, solver.B.shape[1]
    none = np.zeros((n, c - 1))
    fresh = CoupledHistory(np.zeros((n, c)), none, h, np.zeros(r), none, np.zeros(r))
    if history is None:
        return fresh
    if not isinstance(history, CoupledHistory):
        raise InputError(
            f"coupled contact: history is a {type(history).__name__}: give the attribute "
            "`history` of an earlier result."
        )
    problems = Problems("coupled contact")
    for name, like in vars(fresh).items():
        numbers(problems, f"history.{name}", getattr(history, name), like.shape)
    problems.add(bool(problems.found), "give the history of the same contact.")
    problems.raise_any()
    return history


class _Reached(NamedTuple):
    """Where a load step starts: history and offset (c n,), the load (r,) that the step before it
    added, and whether the state may start Newton.
    """

    history: CoupledHistory
    offset: FloatArray
    came: FloatArray
    warm: bool


def _march(
    solver: Coulomb,
    h: FloatArray,
    by_load: bool,
    path: tuple[FloatArray, FloatArray],
    history: CoupledHistory,
    warm: bool,
) -> CoupledContact:
    # the offset that the state was found with: B s - C f - w, w = (h - g, slip)
    w = np.concatenate((h - history.gap, history.slip.T.ravel()))
    offset = solver.B @ history.motion - solver.C @ history.force.T.ravel() - w
    at = _Reached(history, offset, history.load, warm)
    answers, after, works = list[CoupledStep](), list[CoupledHistory](), list[tuple[float, float]]()
    for number, (value, offset) in enumerate(zip(*path, strict=True)):
        answer, at, work = _step(solver, h, by_load, at, value, offset)
        if by_load and not answer.converged:
            raise ConvergenceError(_not_carried(solver, value, number, answer))
        answers.append(answer)
        after.append(at.history)
        works.append(work)
    return _collected(solver, h, answers, after, works)


def _step(
    solver: Coulomb,
    h: FloatArray,
    by_load: bool,
    at: _Reached,
    value: FloatArray,
    offset: FloatArray,
) -> tuple[CoupledStep, _Reached, tuple[float, float]]:
    """To a load or motion (r,), N or mm, and an offset (c n,), mm: the answer, where it leads, its
    work and its friction work, N mm.
    """
    old = at.history
    load, motion = (value, None) if by_load else (None, value)
    start, turned = None, False
    if at.warm:
        y = np.concatenate((old.gap, -old.step.T.ravel()))
        start = Iterate(old.force.T.ravel(), old.motion, y)
    if at.warm and load is not None:
        # on its way; at the start of a call, whether it goes back
        size = np.abs(solver.B).max(axis=0)
        turned = bool((at.came / size) @ ((load - old.load) / size) < 0.0)
    answer = solver.solve(
        -np.concatenate((h, old.slip.T.ravel())) - offset,
        load=load,
        motion=motion,
        start=start,
        turned=turned,
        may_fall_back=lambda: load is None or carries(solver.B, solver.mu, load),
    )
    f, y = (v.reshape(solver.c, solver.n) for v in (answer.at.f, answer.at.y))
    new = CoupledHistory(
        f.T.copy(),
        old.slip - y[1:].T,
        y[0].copy(),
        answer.at.s,
        -y[1:].T,
        solver.B.T @ answer.at.f,
    )
    middle = 0.5 * (old.force + new.force).T.ravel()
    work = 0.5 * (old.load + new.load) @ (new.motion - old.motion)
    work -= middle @ (offset - at.offset)
    slip_work = float((new.force[:, 1:] * (new.slip - old.slip)).sum())
    return answer, _Reached(new, offset, new.load - old.load, True), (float(work), slip_work)


def _collected(
    solver: Coulomb,
    h: FloatArray,
    answers: Sequence[CoupledStep],
    after: Sequence[CoupledHistory],
    works: Sequence[tuple[float, float]],
) -> CoupledContact:
    bad = [k for k, a in enumerate(answers) if not a.converged]
    locking = solver.holds_itself
    work, slip_work = np.array(works).T
    message = f"{len(after)} load steps solved."
    if bad:
        message = (
            f"{len(bad)} of {len(after)} steps did not converge, the first is number {bad[0]} "
            f"(misfit {answers[bad[0]].residual:.1e} of the largest force)."
        )
    if locking:
        message += (
            " Friction is large enough for the contact to hold forces without any load: the state "
            "depends on how the load came."
        )
    return CoupledContact(
        force=np.array([s.force for s in after]),
        gap=np.array([s.gap for s in after]),
        slip=np.array([s.slip for s in after]),
        state=np.array([a.state for a in answers]),
        displacement=np.array([s.motion for s in after]),
        load=np.array([s.load for s in after]),
        work=work,
        slip_work=slip_work,
        residual=np.array([a.residual for a in answers]),
        iterations=np.array([a.iterations for a in answers]),
        fallbacks=sum(a.method == "fallback" for a in answers),
        self_locking=locking,
        status="not converged" if bad else "converged",
        message=message,
        history=after[-1],
        _solver=solver,
        _last=answers[-1].at,
        _gap=h,
    )


def _not_carried(solver: Coulomb, value: FloatArray, number: int, answer: CoupledStep) -> str:
    """Why a load has no answer, as far as a linear programme can tell."""
    what = f"coupled contact: load step {number} ({', '.join(f'{v:.6g}' for v in value)} N)"
    if not carries(solver.B, solver.mu, value):
        return (
            f"{what} cannot be carried: no forces within friction balance it, so a body lifts "
            "off or slides as a whole. Lower the tangential load, raise the normal one, or give "
            "the displacement."
        )
    return (
        f"{what} has no answer after {answer.iterations} steps of Newton and its fallback "
        f"(misfit {answer.residual:.1e} of the largest force). Take smaller load steps, or give "
        "the displacement."
    )
