"""Quasi-static contact of condensed elastic bodies with friction, normal and tangential at once.

References
----------
.. [1] K. L. Johnson, Contact Mechanics (1985), sections 5.4 and 7.1.
.. [2] S. Hueeber, G. Stadler and B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

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
from upd.contact.load_steps import CoupledHistory, LoadSteps, Reached, SolvedStep, offset_of
from upd.errors import ConvergenceError, InputError
from upd.labels import Shown

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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
            march = LoadSteps(self._solver, self._gap, load is not None)
            return _march(march, path, self.history, True)

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
        march = LoadSteps(solver, h, load is not None)
        return _march(march, path, _start(solver, h, history), history is not None)


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


def _march(
    march: LoadSteps, path: tuple[FloatArray, FloatArray], history: CoupledHistory, warm: bool
) -> CoupledContact:
    solver, solved = march.solver, list[SolvedStep]()
    at = Reached(history, offset_of(solver, march.h, history), history.load, warm)
    for number, (value, offset) in enumerate(zip(*path, strict=True)):
        one = march.step(at, value, offset)
        if march.by_load and not one.answer.converged:
            raise ConvergenceError(_not_carried(solver, value, number, one.answer))
        solved.append(one)
        at = one.reached
    return _collected(march, solved)


def _collected(march: LoadSteps, solved: list[SolvedStep]) -> CoupledContact:
    answers, after = [one.answer for one in solved], [one.reached.history for one in solved]
    bad = [k for k, a in enumerate(answers) if not a.converged]
    locking = march.solver.holds_itself
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
        work=np.array([one.work for one in solved]),
        slip_work=np.array([one.slip_work for one in solved]),
        residual=np.array([a.residual for a in answers]),
        iterations=np.array([a.iterations for a in answers]),
        fallbacks=sum(a.method == "fallback" for a in answers),
        self_locking=locking,
        status="not converged" if bad else "converged",
        message=message,
        history=after[-1],
        _solver=march.solver,
        _last=answers[-1].at,
        _gap=march.h,
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
