"""Linear systems that answer a harmonic force.

By solving at every frequency, or by superposing modes.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse import csc_array, issparse
from scipy.sparse.linalg import splu

from upd.errors import ConvergenceError, InputError
from upd.fem.damping import checked_ratio
from upd.labels import Shown
from upd.linalg.eigen_checks import Modes
from upd.mesh import FloatArray

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class DirectSystem:
    """M u'' + C u' + K u = f, solved at every frequency: exact, one factorisation each.

    For reduced models, and sparse ones up to some ten thousand dofs; larger ones by modes or after
    a reduction.

    Attributes
    ----------
    K, M, C : (n, n) ndarray or sparse array
        Stiffness [N/mm], mass [t] and damping [N s/mm], dense or sparse, all alike; C may be None
        (undamped).
    """

    K: Any
    M: Any
    C: Any = None

    @property
    def n(self) -> int:
        """Number of dofs."""
        return int(self.K.shape[0])

    def receptance(self, force: FloatArray, rows: FloatArray, omega: FloatArray) -> ComplexArray:
        """Displacement of the outputs under a harmonic force.

        Parameters
        ----------
        force : (n,) ndarray
            Amplitude of the force [N].
        rows : (n_out, n) ndarray
            Rows that weigh the displacements.
        omega : (n_f,) ndarray
            Angular frequencies [rad/s].

        Returns
        -------
        (n_f, n_out) ndarray of complex
            Displacement [mm].

        Raises
        ------
        ConvergenceError
            At an undamped natural frequency.
        """
        return (
            np.stack([rows @ self._solve(w, force) for w in omega])
            if len(omega)
            else np.zeros((0, len(rows)), complex)
        )

    def _solve(self, w: float, force: FloatArray) -> ComplexArray:
        Z: Any = self.K - w**2 * self.M
        if self.C is not None:
            Z = Z + 1j * w * self.C
        solve = _sparse_solve if issparse(self.K) else _dense_solve
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                return solve(Z, force)
        except (RuntimeError, Warning, np.linalg.LinAlgError) as error:
            raise ConvergenceError(
                f"The dynamic stiffness is singular at {w / (2 * np.pi):.6g} Hz, an "
                "undamped natural frequency: add damping or move it."
            ) from error


def _dense_solve(Z: Any, force: FloatArray) -> ComplexArray:
    return np.asarray(
        lu_solve(lu_factor(np.asarray(Z, dtype=np.complex128)), force), dtype=np.complex128
    )


def _sparse_solve(Z: Any, force: FloatArray) -> ComplexArray:
    A: Any = csc_array(Z)
    A = A.astype(np.complex128)
    # The dynamic stiffness is indefinite, so pivoting stays on.
    return np.asarray(
        splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.1).solve(force.astype(complex)),
        dtype=np.complex128,
    )


@dataclass(frozen=True, repr=False)
class ModalSystem(Shown):
    """Superposition of modes with modal damping.

    Attributes
    ----------
    frequency : (m,) ndarray
        Natural frequencies [Hz].
    shapes : (n, m) ndarray
        Mass-normalised mode shapes [t^-1/2].
    zeta : (m,) ndarray
        Damping ratios; that of a rigid motion (0 Hz) has no effect.
    static : callable, optional
        K^-1 of the static problem as a function, f (n,) -> u (n,), for the modes left out; None:
        they are left out.
    """

    frequency: FloatArray
    shapes: FloatArray
    zeta: FloatArray
    static: Any = None

    @property
    def n(self) -> int:
        """Number of dofs."""
        return int(self.shapes.shape[0])

    def receptance(self, force: FloatArray, rows: FloatArray, omega: FloatArray) -> ComplexArray:
        """Displacement of the outputs under a harmonic force.

        The sum of phi_out phi_f / (omega_j^2 - omega^2 + 2 i zeta_j omega_j omega); the rest
        statically.

        Parameters
        ----------
        force : (n,) ndarray
            Amplitude of the force [N].
        rows : (n_out, n) ndarray
            Rows that weigh the displacements.
        omega : (n_f,) ndarray
            Angular frequencies [rad/s].

        Returns
        -------
        (n_f, n_out) ndarray of complex
            Displacement [mm].

        Raises
        ------
        ConvergenceError
            At an undamped natural frequency.

        References
        ----------
        D. J. Ewins, Modal Testing, 2.4; static correction: R. W. Clough and J. Penzien, Dynamics of
        Structures, ch. 13.
        """
        natural = 2.0 * np.pi * self.frequency
        share, out = self.shapes.T @ force, rows @ self.shapes
        below = (
            natural[None, :] ** 2 - omega[:, None] ** 2 + 2j * self.zeta * natural * omega[:, None]
        )
        if (below == 0.0).any():
            raise ConvergenceError(
                "The response is infinite at an undamped natural frequency: add damping or "
                "move the frequency."
            )
        H: ComplexArray = np.asarray((share / below) @ out.T, dtype=np.complex128)
        if self.static is not None:
            rest = self.static(force) - self.shapes @ (share / natural**2)
            H += rows @ rest
        return H


def direct_system(model: Any, C: Any = None, *, M: Any = None) -> DirectSystem:
    """System of a reduced model, or of matrices.

    Parameters
    ----------
    model : object with K and M, or (n, n) ndarray or sparse array
        A reduced model; K itself [N/mm] when `M` is given.
    C : (n, n) ndarray or sparse array, optional
        Damping [N s/mm].
    M : (n, n) ndarray or sparse array, optional
        Mass [t].

    Returns
    -------
    DirectSystem

    Raises
    ------
    InputError
        When the shapes differ.
    """
    K, mass = (model, M) if M is not None else (model.K, model.M)
    shapes = {np.shape(A) for A in (K, mass, C) if A is not None}
    if len(shapes) != 1 or len(next(iter(shapes))) != 2 or len(set(next(iter(shapes)))) != 1:
        raise InputError(
            f"K, M and C have shapes {sorted(shapes)}: give square matrices on the same dofs."
        )
    return DirectSystem(K, mass, C)


def modal_system(found: Modes, zeta: ArrayLike, *, static: Any = None) -> ModalSystem:
    """System of modes with damping ratios.

    Parameters
    ----------
    found : Modes
        What `upd.linalg.modes` found, m modes.
    zeta : float or (m,) array_like
        Damping ratios.
    static : callable, optional
        K^-1 f of a supported body, as `upd.linalg.factorise(K)` gives it.

    Returns
    -------
    ModalSystem

    Raises
    ------
    InputError
        For ratios that do not fit, or a static correction of a body that floats.
    """
    if static is not None and found.n_rigid:
        raise InputError("A body that floats has no static answer: leave `static` out.")
    return ModalSystem(
        found.frequency, found.shapes, checked_ratio(zeta, len(found.frequency)), static
    )
