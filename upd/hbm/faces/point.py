"""A point of the balance by whole faces: its unknowns, and what is read from its period."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from upd.hbm.faces.equations import ContactPeriod, InterfaceEquations
from upd.hbm.faces.state import EPS, ComplexArray, FloatArray
from upd.hbm.faces.step import OPEN, SLIP, STICK


class InterfacePoint(NamedTuple):
    """A point of the curve.

    Attributes
    ----------
    frequency : float
        Hz.
    q : (2 H + 1, m) ndarray
        Coefficients of the blades' modes.
    rigid : (3, r) ndarray
        Damper's motion, velocity and acceleration before the period, time in steps.
    slip : (2 n,) ndarray
        Slips before the period [mm].
    iterations : int
        Of Newton's method.
    amplitude : (H + 1, K) ndarray
        Complex harmonics 0 to H of the outputs [mm].
    share : (3,) ndarray
        Of nodes and samples that are open, stick, slip.
    truncation : float
        Share of the modal contact forces' variation that harmonics above H hold.
    energy : (3,) ndarray
        In a period, of the whole: work of the excitation, lost by damping, by friction [N mm].
    nodes : (n, 3) ndarray
        Shares of the period in which each node is open, sticks, slips.
    loss : (n,) ndarray
        By friction at each node in a period, of the whole [N mm].
    unresolved : float
        Motion of the faces by blades' harmonics above H over that by those up to H.
    residual : float
        The residual of the equations: of the blades' forces over the forces, of slips and the
        damper's motion after the period over the motion of the faces, whichever is larger.
    """

    frequency: float
    q: FloatArray
    rigid: FloatArray
    slip: FloatArray
    iterations: int
    amplitude: ComplexArray
    share: FloatArray
    truncation: float
    energy: FloatArray
    nodes: FloatArray
    loss: FloatArray
    unresolved: float
    residual: float


def read_point(
    e: InterfaceEquations,
    period: ContactPeriod,
    q: FloatArray,
    rigid: FloatArray,
    slip: FloatArray,
    frequency: float,
    iterations: int,
) -> InterfacePoint:
    """Read a point from its period; a period is large and is not kept.

    Parameters
    ----------
    e : InterfaceEquations
    period : ContactPeriod
        That of the unknowns.
    q, rigid, slip, frequency, iterations
        As in `InterfacePoint`.

    Returns
    -------
    InterfacePoint
    """
    w = 2.0 * np.pi * frequency
    nodes = np.array([(period.state == code).mean(axis=0) for code in (OPEN, STICK, SLIP)]).T
    loss = _rubbed(e, period)
    return InterfacePoint(
        frequency,
        q,
        rigid,
        slip,
        iterations,
        _outputs(e, q, period),
        nodes.mean(axis=0),
        _left_out(period, e.highest),
        np.append(_energy(e, q, period, w), loss.sum()),
        nodes,
        loss,
        _unresolved(e, q, period, w),
        _residual(e, period, q, rigid, slip, w),
    )


def _unresolved(e: InterfaceEquations, q: FloatArray, period: ContactPeriod, w: float) -> float:
    """What the contact forces' harmonics above H would move the faces by the blades' modes."""
    model = e.model
    modal = 2.0 / e.samples * np.fft.rfft(period.modal, axis=0)[e.highest + 1 :]
    kw = w * np.arange(e.highest + 1, e.highest + 1 + len(modal))[:, None]
    resistance = model.omega**2 - kw**2 + 2j * model.damping * model.omega * kw
    moved = float(np.linalg.norm(model.shapes @ q[1:].T))
    if moved == 0.0:
        return 0.0
    return float(np.linalg.norm(model.shapes @ (modal / resistance).T)) / moved


def _residual(
    e: InterfaceEquations,
    period: ContactPeriod,
    q: FloatArray,
    rigid: FloatArray,
    slip: FloatArray,
    w: float,
) -> float:
    """The largest of the residual of the equations, over what they are made of."""
    model = e.model
    forces = np.abs(e.Q @ period.modal).max() + np.abs(e.drive @ model.places.T).max()
    blades = float(np.abs(e.misfit(period, q, w)).max() / forces) if forces > 0.0 else 0.0
    face = float(np.abs(model.shapes @ q[1:].T).max())
    if face <= EPS * float(np.abs(model.shapes @ q[0]).max()):
        return blades
    reach = np.abs(model.columns).max(axis=0)
    ends = [np.abs((period.rigid - rigid)[0] * reach).max(), np.abs(period.slip - slip).max()]
    return max(blades, float(max(ends)) / face)


def _rubbed(e: InterfaceEquations, period: ContactPeriod) -> FloatArray:
    """Lost by friction at each node, of the whole [N mm]."""
    mean = 0.5 * (period.force + np.roll(period.force, 1, axis=0))
    lost = (mean * period.relative).sum(axis=0).reshape(3, -1)[1:].sum(axis=0)
    return np.asarray(e.model.copies * lost)


def _outputs(e: InterfaceEquations, q: FloatArray, period: ContactPeriod) -> ComplexArray:
    """(H + 1, K) harmonics of the outputs."""
    model = e.model
    real = q @ model.seen_modes.T + e.Q @ (period.force @ model.seen_contact.T)
    real = real + e.drive @ model.seen_drive.T
    out = np.zeros((e.highest + 1, real.shape[1]), complex)
    out[0] = real[0]
    out[1:] = real[1::2] - 1j * real[2::2]
    return out


def _left_out(period: ContactPeriod, highest: int) -> float:
    """Share of the modal forces' variation that higher harmonics hold."""
    modal = np.fft.rfft(period.modal, axis=0)
    whole = float(np.linalg.norm(modal[1:]))
    # sums of the samples' forces, rounded
    if whole <= len(period.modal) * EPS * float(np.linalg.norm(modal[0])):
        return 0.0
    return float(np.linalg.norm(modal[1 + highest :])) / whole


def _energy(e: InterfaceEquations, q: FloatArray, period: ContactPeriod, w: float) -> FloatArray:
    """Work of the excitation and lost by damping, of the whole [N mm]."""
    model, share = e.model, 2.0 * np.pi / e.samples
    F, rate = e.E @ e.drive, e.E @ e.turned(e.drive, e.order)
    v = e.E @ e.turned(q, e.order)
    # the places also move with the contact forces: F d(E'f) = d(F E'f) - E'f dF
    into = share * (np.sum(F * (v @ model.places)) - np.sum(rate * (period.force @ model.pushed)))
    damped = share * w * float(np.sum(2.0 * model.damping * model.omega * v**2))
    return np.asarray(model.copies * np.array([into, damped]))
