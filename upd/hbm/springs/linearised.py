"""The balance at one answer, linearised: its Jacobian in parts.

The Jacobian I + G df/dw couples the harmonics through the forces of points that move, where df/dw
is full; points that stick or are open over the whole cycle have a constant stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.kept_factors import KeptFactors
from upd.hbm.springs.modal import Modal
from upd.hbm.springs.terms import MOVES, STICKS, receptances, residual_terms

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
EPS = float(np.finfo(float).eps)


class Rows(NamedTuple):
    """Rows of the contacts on the modes, and what never changes about them.

    Attributes
    ----------
    Psi : (c, m) ndarray
        The rows.
    transposed : (m, c) ndarray
    damping : (1, m) or (m, m) ndarray
        Modal damping, one row where it is diagonal.
    basis : (c, r) ndarray or None
        Orthonormal basis U of the columns of Psi where r < c.
    kept : KeptFactors
        The newest large factors of equations with these rows.
    """

    Psi: FloatArray
    transposed: FloatArray
    damping: FloatArray
    basis: FloatArray | None
    kept: KeptFactors


def rows_of(Psi: FloatArray, system: Modal) -> Rows:
    """Rows with their basis.

    Parameters
    ----------
    Psi : (c, m) ndarray
        Rows of the contacts on the modes.
    system : Modal

    Returns
    -------
    Rows
    """
    U, size, _ = np.linalg.svd(Psi, full_matrices=False)
    rank = int(np.count_nonzero(size > max(Psi.shape) * EPS * size.max(initial=0.0)))
    basis = np.ascontiguousarray(U[:, :rank]) if 0 < rank < len(Psi) else None
    damping = np.ascontiguousarray(np.atleast_2d(system.damping))
    return Rows(Psi, np.ascontiguousarray(Psi.T), damping, basis, KeptFactors())


@dataclass(frozen=True)
class Linearised:
    """Jacobian of the balance at one answer, as its parts.

    Attributes
    ----------
    modal : Modal
        The linear system.
    rows : Rows
        Rows of the contacts on its modes.
    w : (n_k,) ndarray
        Angular frequencies of the harmonics above 0 [rad/s].
    offset : int
        Coefficients before theirs, 1 with harmonic 0.
    G0 : (c, c) ndarray
        Static compliance [mm/N].
    R : (c, n_rigid) ndarray
        Rigid modes at the rows.
    state : (n_point,) ndarray of int8
        Which points move, stick or are open over the whole cycle.
    stiffness : (n_point, 1 + d) ndarray
        Stiffness of sticking points [N/mm].
    DF : (n_moving, 1 + d, size, 1 + d, size) ndarray
        Derivative of the force of points that move [N/mm].
    """

    modal: Modal
    rows: Rows
    w: FloatArray
    offset: int
    G0: FloatArray
    R: FloatArray
    state: NDArray[np.int8]
    stiffness: FloatArray
    DF: FloatArray

    @property
    def finite(self) -> bool:
        """Whether the derivatives are."""
        return bool(np.isfinite(self.DF).all())

    def product(self, X: FloatArray, a: FloatArray) -> FloatArray:
        """J x of a change (c, size) of the motion and one (n_rigid,) of the rigid amplitudes.

        The residual is linear in motion and forces: J x is that of the motion and of its forces
        without loads.
        """
        c = len(self.rows.Psi)
        none = np.zeros((len(self.w), len(self.modal.eigenvalues)), complex)
        return np.asarray(
            residual_terms(
                X,
                a,
                self.force(X),
                self.w,
                1.0,
                self.offset == 1,
                self.modal.eigenvalues,
                self.modal.rigid,
                self.rows.damping,
                none,
                self.rows.Psi,
                self.rows.transposed,
                np.zeros(c),
                np.zeros(len(a)),
                False,
            )[0]
        )

    def force(self, X: FloatArray) -> FloatArray:
        """Change of the contact forces (c, size) with a motion (c, size) of the rows [N]."""
        d1, size, DF, moves = self.stiffness.shape[1], X.shape[1], self.DF, self.state == MOVES
        motion = X.reshape(-1, d1, size)
        held = np.where(self.state[:, None] == STICKS, self.stiffness, 0.0)
        out = held[..., None] * motion
        out[moves] = np.matmul(
            DF.reshape(len(DF), d1 * size, d1 * size), motion[moves].reshape(-1, d1 * size, 1)
        ).reshape(-1, d1, size)
        return np.asarray(out.reshape(-1, size))

    def receptance(self, Psi: FloatArray, transposed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Psi D^-1 Psi' (n_k, r, r) of the harmonics above 0, real and imaginary part [mm/N]."""
        if self.modal.proportional:
            real, imag = receptances(
                self.w, self.modal.eigenvalues, self.modal.damping, Psi, transposed
            )
            return real, imag
        none = np.zeros((len(self.w), Psi.shape[1]), complex)
        G = self.modal.receptance(Psi, self.w, none, slopes=False)[0]
        return np.ascontiguousarray(G.real), np.ascontiguousarray(G.imag)

    def every_derivative(self) -> FloatArray:
        """Derivatives of the force of all points, (n_point, 1 + d, size, 1 + d, size) [N/mm]."""
        size, d1 = self.offset + 2 * len(self.w), self.stiffness.shape[1]
        out = np.zeros((len(self.state), d1 * size, d1 * size))
        out[self.state == MOVES] = self.DF.reshape(-1, d1 * size, d1 * size)
        place, held = np.arange(d1 * size), self.state == STICKS
        out[np.flatnonzero(held)[:, None], place, place] = np.repeat(
            self.stiffness[held], size, axis=1
        )
        return out.reshape(-1, d1, size, d1, size)

    def complex_part(self, X: FloatArray) -> ComplexArray:
        """Amplitudes a - i b (n_k, c) of coefficients (c, size)."""
        o = self.offset
        return np.asarray((X[:, o::2] - 1j * X[:, o + 1 :: 2]).T)

    def real_part(self, X: ComplexArray, static: FloatArray) -> FloatArray:
        """Coefficients (c, size) of amplitudes (n_k, c) and a mean (c,)."""
        o = self.offset
        out = np.empty((X.shape[1], o + 2 * len(X)))
        out[:, o::2], out[:, o + 1 :: 2] = X.real.T, -X.imag.T
        if o:
            out[:, 0] = static
        return out
