"""Blades and damper as a march of whole faces takes them, and where such a march stands."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor

from upd.errors import ConvergenceError, InputError
from upd.hbm.faces.step import OPEN, STICK

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class InterfaceModel:
    """Blades, damper and faces; of a half model, forces and masses of the half.

    n nodes, m modes, r rigid motions, L places of excitation, K outputs. Vectors of 3 n are laid
    out normal of all nodes, then the two tangents of all.

    Attributes
    ----------
    frequency, damping : (m,) ndarray
        Of the blades' free-interface modes: Hz, and ratio to critical.
    shapes : (3 n, m) ndarray
        Modes at the contact nodes, mass 1.
    compliance : (3 n, 3 n) ndarray
        G: what the modes leave of the blades' static compliance, and the damper's elastic one
        [mm/N].
    columns : (3 n, r) ndarray
        Damper's rigid motions at the nodes.
    mass : (r, r) ndarray
        Damper's mass and inertia [t, t mm2].
    load : (r,) ndarray
        Static load on the damper [N, N mm].
    gap, friction : (n,) ndarray
        Gap before any load [mm]; coefficient.
    places : (m, L) ndarray
        Modes at the places of excitation.
    pushed : (3 n, L) ndarray
        Residual displacement of the contact nodes by the excitation [mm/N].
    seen_modes, seen_contact, seen_drive : (K, m), (K, 3 n), (K, L) ndarray
        Outputs by modes, and their residual compliance to contact forces and excitation.
    copies : int
        Models that make the whole.
    springs : (3 n,) ndarray, optional
        Compliance of each node's own springs, a part of the diagonal of G [mm/N].
    """

    frequency: FloatArray
    damping: FloatArray
    shapes: FloatArray
    compliance: FloatArray
    columns: FloatArray
    mass: FloatArray
    load: FloatArray
    gap: FloatArray
    friction: FloatArray
    places: FloatArray
    pushed: FloatArray
    seen_modes: FloatArray
    seen_contact: FloatArray
    seen_drive: FloatArray
    copies: int = 1
    springs: FloatArray | None = None

    @property
    def n(self) -> int:
        """Contact nodes."""
        return len(self.gap)

    @cached_property
    def omega(self) -> FloatArray:
        """(m,) rad/s."""
        return np.asarray(2.0 * np.pi * self.frequency)

    def linear_response(
        self, frequencies: ArrayLike, drive: ArrayLike, *, stuck: bool
    ) -> ComplexArray:
        """First harmonic of the outputs when no node slips or opens, or when none touches.

        Stuck: w does not move, so with H the receptances of the modes
        (G + Phi H Phi' - B (omega^2 M_D)^-1 B') f = -(E + Phi H P) F.

        Parameters
        ----------
        frequencies : (k,) array_like
            Hz.
        drive : (L,) array_like
            Complex amplitudes on the whole [N].
        stuck : bool

        Returns
        -------
        (k, K) ndarray
            mm.
        """
        F = np.asarray(drive, complex) / self.copies
        out = []
        for w in 2.0 * np.pi * np.atleast_1d(np.asarray(frequencies, float)):
            H = 1.0 / (self.omega**2 - w**2 + 2j * self.damping * self.omega * w)
            force = np.zeros(3 * self.n, complex)
            if stuck:
                A = self.compliance + (self.shapes * H) @ self.shapes.T
                A = A - self.columns @ np.linalg.solve(w**2 * self.mass, self.columns.T)
                force = np.linalg.solve(
                    A, -(self.pushed @ F + (self.shapes * H) @ (self.places @ F))
                )
            q = H * (self.shapes.T @ force + self.places @ F)
            out.append(self.seen_modes @ q + self.seen_contact @ force + self.seen_drive @ F)
        return np.array(out).reshape(len(out), len(self.seen_modes))


@dataclass
class InterfaceState:
    """Where a march stands: motions and forces at the end of a step, sums of the slips.

    Attributes
    ----------
    q, v, p : (m,) ndarray
        Modal displacement, velocity and force.
    s, sv, sa : (r,) ndarray
        Damper's motion, velocity, and the acceleration of the method.
    f, y : (3 n,) ndarray
        Forces [N]; minus gaps, and slips of the last step [mm].
    slip : (2 n,) ndarray
        Accumulated slips [mm].
    state : (n,) ndarray of int
        0 open, 1 stick, 2 slip.
    held : (m,) ndarray
        Modal forces at rest [N].
    """

    q: FloatArray
    v: FloatArray
    p: FloatArray
    s: FloatArray
    sv: FloatArray
    sa: FloatArray
    f: FloatArray
    y: FloatArray
    slip: FloatArray
    state: NDArray[np.int64]
    held: FloatArray

    def copy(self) -> InterfaceState:
        """A state of its own."""
        return InterfaceState(**{name: getattr(self, name).copy() for name in _PARTS})

    def arrays(self) -> tuple[NDArray[Any], ...]:
        """Its arrays, not copied, in the order of its fields, as compiled code takes them."""
        return tuple(getattr(self, name) for name in _PARTS)


_PARTS = tuple(one.name for one in fields(InterfaceState))


def resting(
    model: InterfaceModel, force: FloatArray, slip: FloatArray, gap: FloatArray, motion: FloatArray
) -> InterfaceState:
    """The state of a static solution.

    Parameters
    ----------
    model : InterfaceModel
    force : (n, 3) ndarray
        N.
    slip : (n, 2) ndarray
        Accumulated [mm].
    gap : (n,) ndarray
        mm.
    motion : (r,) ndarray
        Of the damper [mm, rad].

    Returns
    -------
    InterfaceState

    Raises
    ------
    InputError
        When it is not a static solution of this model.
    """
    f = np.ascontiguousarray(force.T).ravel()
    p = model.shapes.T @ f
    q = p / model.omega**2
    w = model.columns @ motion - model.compliance @ f - model.shapes @ q
    wanted = np.concatenate([model.gap - gap, np.ascontiguousarray(slip.T).ravel()])
    reach = (
        np.abs(model.columns) @ np.abs(motion)
        + np.abs(model.compliance) @ np.abs(f)
        + np.abs(model.shapes) @ np.abs(q)
    )
    fine = np.sqrt(EPS)
    pull = np.abs(model.load - model.columns.T @ f)
    # a direction in which nothing pulls is in balance to the rounding of the nodes' whole forces
    whole = np.tile(np.linalg.norm(force, axis=1), 3)
    most = np.abs(model.columns.T) @ whole + np.abs(model.load)
    if (np.abs(w - wanted) > fine * reach.max(initial=0.0)).any() or (pull > fine * most).any():
        raise InputError(
            "interface march: the static state belongs to another contact (its forces, gaps, slips "
            "and motion do not balance here): seat the damper with this model's faces and load"
        )
    open_ = gap > 0.0
    y = np.zeros_like(f)
    y[: model.n] = -np.where(open_, gap, 0.0)
    none = np.zeros_like(motion, dtype=float)
    return InterfaceState(
        q,
        np.zeros_like(q),
        p,
        np.array(motion, float),
        none,
        none.copy(),
        f,
        y,
        np.ascontiguousarray(slip.T).ravel().copy(),
        np.where(open_, OPEN, STICK).astype(np.int64),
        p.copy(),
    )


def in_columns(drive: ArrayLike) -> ComplexArray:
    """Amplitudes (L, H) of an excitation, one column a harmonic, of (L,) or (L, H)."""
    amplitude = np.asarray(drive, complex)
    return amplitude[:, None] if amplitude.ndim == 1 else amplitude


def factored(A: FloatArray, what: str) -> tuple[FloatArray, bool]:
    """Cholesky factors of a compliance.

    Parameters
    ----------
    A : (k, k) ndarray
        [mm/N]
    what : str
        Its name in the message.

    Returns
    -------
    tuple
        As `scipy.linalg.cho_factor` gives them.

    Raises
    ------
    ConvergenceError
        Where it is not positive definite.
    """
    try:
        L, lower = cho_factor(A, lower=True)
    except np.linalg.LinAlgError as error:
        raise ConvergenceError(
            f"{what} is not positive definite: more modes were removed than the static compliance "
            "holds; use fewer modes a blade"
        ) from error
    return L, lower
