"""Load steps of coupled contact, one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.contact.coulomb import Coulomb
from upd.contact.coulomb_conditions import CoupledStep, Iterate, carries
from upd.labels import Shown

FloatArray = NDArray[np.float64]

#: Parts in which a load step that Newton does not solve is followed to a new start, at most.
_PARTS = 8


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


@dataclass(frozen=True)
class SolvedStep:
    """A load step with the history and the offset after it, work and friction work of it, N mm."""

    answer: CoupledStep
    after: CoupledHistory
    offset: FloatArray
    work: float
    slip_work: float


@dataclass(frozen=True)
class LoadSteps:
    """Load steps one after the other.

    For one that Newton does not solve, up to `_PARTS` even parts of it lead to a new start near the
    answer, with few states to change. The fallback stands behind.
    """

    solver: Coulomb
    h: FloatArray
    by_load: bool

    def step(
        self,
        at: CoupledHistory,
        before: CoupledHistory | None,
        was: FloatArray,
        value: FloatArray,
        offset: FloatArray,
        warm: bool,
    ) -> SolvedStep:
        """From a state (and the one before it) with offset `was` to load or motion and offset.

        Parameters
        ----------
        was, offset
            (c n,) mm.
        value
            (r,) load or motion, N or mm.
        warm
            Whether the state may start Newton.
        """
        start = self._start(at) if warm else None
        turned = self.by_load and warm and _turned(self.solver, before, at, value)
        one = self._tried(at, was, value, offset, start, turned, fall_back=False)
        parts = 1
        while not one.answer.converged and self.solver.mu.any() and 2 * parts <= _PARTS:
            parts *= 2
            near = self._near(at, before, was, value, offset, warm, parts)
            if near is not None:
                again = self._tried(at, was, value, offset, near, False, fall_back=False)
                one = again if again.answer.converged else one
        if not one.answer.converged:
            one = self._tried(at, was, value, offset, start, turned, fall_back=True)
        return one

    def _near(
        self,
        at: CoupledHistory,
        before: CoupledHistory | None,
        was: FloatArray,
        value: FloatArray,
        offset: FloatArray,
        warm: bool,
        parts: int,
    ) -> Iterate | None:
        """Where the step ends in even parts, as a start for the whole; None when a part fails."""
        first, start = at, at.load if self.by_load else at.motion
        for share in np.arange(1, parts + 1) / parts:
            to = start + share * (value - start)
            turned = self.by_load and warm and _turned(self.solver, before, at, to)
            one = self._tried(
                at,
                was,
                to,
                was + share * (offset - was),
                self._start(at) if warm else None,
                turned,
                fall_back=False,
            )
            if not one.answer.converged:
                return None
            before, at, warm = at, one.after, True
        y = np.concatenate((at.gap, -(at.slip - first.slip).T.ravel()))
        return Iterate(at.force.T.ravel(), at.motion, y)

    @staticmethod
    def _start(at: CoupledHistory) -> Iterate:
        y = np.concatenate((at.gap, -at.step.T.ravel()))
        return Iterate(at.force.T.ravel(), at.motion, y)

    def _tried(
        self,
        at: CoupledHistory,
        was: FloatArray,
        value: FloatArray,
        offset: FloatArray,
        start: Iterate | None,
        turned: bool,
        *,
        fall_back: bool,
    ) -> SolvedStep:
        solver = self.solver
        n, c = solver.n, solver.c
        answer = solver.solve(
            -np.concatenate((self.h, at.slip.T.ravel())) - offset,
            load=value if self.by_load else None,
            motion=None if self.by_load else value,
            start=start,
            turned=turned,
            may_fall_back=partial(_may_be_carried, solver, value if self.by_load else None)
            if fall_back
            else lambda: False,
        )
        f, y = answer.at.f.reshape(c, n), answer.at.y.reshape(c, n)
        after = CoupledHistory(
            f.T.copy(),
            at.slip - y[1:].T,
            y[0].copy(),
            answer.at.s,
            -y[1:].T,
            solver.B.T @ answer.at.f,
        )
        middle = 0.5 * (at.force + after.force).T.ravel()
        work = 0.5 * (at.load + after.load) @ (after.motion - at.motion) - middle @ (offset - was)
        slip_work = float((after.force[:, 1:] * (after.slip - at.slip)).sum())
        return SolvedStep(answer, after, np.asarray(offset), float(work), slip_work)


def _turned(
    solver: Coulomb, before: CoupledHistory | None, at: CoupledHistory, load: FloatArray
) -> bool:
    """Whether the load turns back on its way; at the start of a call, whether it goes back."""
    size = np.abs(solver.B).max(axis=0)
    came = (at.load if before is None else at.load - before.load) / size
    return bool(came @ ((load - at.load) / size) < 0.0)


def offset_of(solver: Coulomb, h: FloatArray, at: CoupledHistory) -> FloatArray:
    """The offset (c n,) that a state was found with: B s - C f - w, w = (h - g, slip).

    Parameters
    ----------
    h
        (n,) gap before any load, mm.
    at
        The state.
    """
    w = np.concatenate((h - at.gap, at.slip.T.ravel()))
    return np.asarray(solver.B @ at.motion - solver.C @ at.force.T.ravel() - w)


def _may_be_carried(solver: Coulomb, load: FloatArray | None) -> bool:
    return load is None or carries(solver.B, solver.mu, load)
