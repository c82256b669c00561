"""Load steps of coupled contact, one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

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


class Reached(NamedTuple):
    """Where a load step starts: history and offset (c n,), the load (r,) that the step before it
    added, and whether the state may start Newton.
    """

    history: CoupledHistory
    offset: FloatArray
    came: FloatArray
    warm: bool


@dataclass(frozen=True)
class SolvedStep:
    """A load step with what it reached, its work and its friction work, N mm."""

    answer: CoupledStep
    reached: Reached
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

    def step(self, at: Reached, value: FloatArray, offset: FloatArray) -> SolvedStep:
        """To a load or motion (r,), N or mm, and an offset (c n,), mm."""
        one = self._tried(at, value, offset)
        parts = 1
        while not one.answer.converged and self.solver.mu.any() and 2 * parts <= _PARTS:
            parts *= 2
            near = self._near(at, value, offset, parts)
            if near is not None:
                again = self._tried(at, value, offset, near)
                one = again if again.answer.converged else one
        return one if one.answer.converged else self._tried(at, value, offset, fall_back=True)

    def _near(
        self, first: Reached, value: FloatArray, offset: FloatArray, parts: int
    ) -> Iterate | None:
        """Where the step ends in even parts, as a start for the whole; None when a part fails."""
        at, start = first, first.history.load if self.by_load else first.history.motion
        for share in np.arange(1, parts + 1) / parts:
            to = start + share * (value - start)
            one = self._tried(at, to, first.offset + share * (offset - first.offset))
            if not one.answer.converged:
                return None
            at = one.reached
        return _iterate(at.history, at.history.slip - first.history.slip)

    def _tried(
        self,
        at: Reached,
        value: FloatArray,
        offset: FloatArray,
        near: Iterate | None = None,
        *,
        fall_back: bool = False,
    ) -> SolvedStep:
        """The step from the state it starts from, or from an iterate near the answer."""
        solver, old = self.solver, at.history
        load, motion = (value, None) if self.by_load else (None, value)
        start, turned = near, False
        if near is None and at.warm:
            start = _iterate(old, old.step)
            turned = load is not None and _turned(solver, at, load)
        answer = solver.solve(
            -np.concatenate((self.h, old.slip.T.ravel())) - offset,
            load=load,
            motion=motion,
            start=start,
            turned=turned,
            may_fall_back=lambda: (
                fall_back and (load is None or carries(solver.B, solver.mu, load))
            ),
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
        reached = Reached(new, offset, new.load - old.load, True)
        return SolvedStep(answer, reached, float(work), slip_work)


def _iterate(at: CoupledHistory, slip: FloatArray) -> Iterate:
    """A state as a start of Newton, with the slip (n, c - 1) on the way to it."""
    y = np.concatenate((at.gap, -slip.T.ravel()))
    return Iterate(at.force.T.ravel(), at.motion, y)


def _turned(solver: Coulomb, at: Reached, load: FloatArray) -> bool:
    """Whether the load turns back on its way; at the start of a call, whether it goes back."""
    size = np.abs(solver.B).max(axis=0)
    return bool((at.came / size) @ ((load - at.history.load) / size) < 0.0)


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
