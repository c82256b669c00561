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
    """Load steps one after the other."""

    solver: Coulomb
    h: FloatArray
    by_load: bool

    def step(self, at: Reached, value: FloatArray, offset: FloatArray) -> SolvedStep:
        """To a load or motion (r,), N or mm, and an offset (c n,), mm."""
        solver, old = self.solver, at.history
        load, motion = (value, None) if self.by_load else (None, value)
        start, turned = None, False
        if at.warm:
            y = np.concatenate((old.gap, -old.step.T.ravel()))
            start = Iterate(old.force.T.ravel(), old.motion, y)
        if at.warm and load is not None:
            # on its way; at the start of a call, whether it goes back
            size = np.abs(solver.B).max(axis=0)
            turned = bool((at.came / size) @ ((load - old.load) / size) < 0.0)
        answer = solver.solve(
            -np.concatenate((self.h, old.slip.T.ravel())) - offset,
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
        reached = Reached(new, offset, new.load - old.load, True)
        return SolvedStep(answer, reached, float(work), slip_work)


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
