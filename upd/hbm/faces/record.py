r"""A period of a time march in full: forces, slips and states of every node, motion of the damper.

The steps of `upd.hbm.faces.march` carry the damper from s_0 to s_1 by the forces f_1 alone
(WBZ-alpha, beta = 1, gamma = 3/2):

    a = M_D^-1 (p - B' f_1),    s_1 = s_0 + dt s'_0 + dt^2/2 a,
    s'_1 = s'_0 + dt (s''_0 / 4 + 3/4 a),    s''_1 = (s''_0 + a) / 2,

so its motion at every sample follows from the forces recorded there. What a node loses in a step is
the mean of its traction at both ends times its slip, the measure in which the march's energy
closes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.hbm.faces.march import Fallback, InterfaceMarch
from upd.hbm.faces.state import FloatArray, InterfaceModel, InterfaceState
from upd.hbm.faces.step import OPEN, SLIP, STICK
from upd.hbm.faces.sweep import SteppedSine


@dataclass(frozen=True)
class RecordedPeriod:
    """A period of N samples of n nodes.

    Attributes
    ----------
    force : (N, 3, n) ndarray
        Normal and two tangents, on the blades, after each step [N].
    slip : (N, 2, n) ndarray
        Accumulated slips after each step [mm].
    state : (N, n) ndarray of int
        0 open, 1 stick, 2 slip.
    motion : (N, r) ndarray
        Rigid motions of the damper [mm, rad].
    loss : (n,) ndarray
        Of each node in the period [N mm].
    copies : int
        Models that make the whole.
    """

    force: FloatArray
    slip: FloatArray
    state: NDArray[np.int64]
    motion: FloatArray
    loss: FloatArray
    copies: int

    @property
    def share(self) -> FloatArray:
        """(n, 3) of the samples that each node sticks, slips, is open."""
        return np.stack([(self.state == one).mean(axis=0) for one in (STICK, SLIP, OPEN)], axis=1)

    @property
    def energy(self) -> float:
        """Friction loss of the whole in the period [N mm]."""
        return self.copies * float(self.loss.sum())


def recorded_period(march: InterfaceMarch, start: InterfaceState) -> RecordedPeriod:
    """March one period and keep all of it.

    Parameters
    ----------
    march : InterfaceMarch
    start : InterfaceState
        Not changed.

    Returns
    -------
    RecordedPeriod

    Raises
    ------
    ConvergenceError
        When a step has no answer that any of the solvers finds.
    """
    n, N, at = march.model.n, march.samples, start.copy()
    period = march.period(at, record=True)
    assert march.past is not None
    moved = march.past.move[:, n:].reshape(N, 2, n)
    force = period.force.reshape(N, 3, n)
    before = np.concatenate([start.f.reshape(1, 3, n), force[:-1]])
    loss = np.einsum("ktp,ktp->p", 0.5 * (before + force)[:, 1:], moved)
    return RecordedPeriod(
        force,
        start.slip.reshape(2, n) + np.cumsum(moved, axis=0),
        period.state,
        _motion(march.model, march.dt, period.force, start),
        loss,
        march.model.copies,
    )


def _motion(
    model: InterfaceModel, dt: float, force: FloatArray, start: InterfaceState
) -> FloatArray:
    pull = np.linalg.solve(model.mass, (model.load - force @ model.columns).T).T
    s, v, a, out = start.s, start.sv, start.sa, []
    for one in pull:
        s = s + dt * v + 0.5 * dt**2 * one
        v = v + dt * (0.25 * a + 0.75 * one)
        a = 0.5 * (a + one)
        out.append(s)
    return np.array(out)


def period_of_sweep(found: SteppedSine, point: int, fallback: Fallback | None) -> RecordedPeriod:
    """The last period at a point of a sweep, integrated again.

    Twice: the steps then start from the samples of a period before, as those of the sweep did, and
    end where these ended to their rounding.

    Parameters
    ----------
    found : SteppedSine
    point : int
        Its number, from 0.
    fallback : callable or None
        As for `InterfaceMarch`.

    Returns
    -------
    RecordedPeriod
    """
    f = float(found.frequency[point])
    march = InterfaceMarch(found.model, f, found.drive, found.samples, fallback)
    start = found.starts[point]
    march.period(start.copy())
    return recorded_period(march, start)
