"""Modal form of the linear part.

It gives the response of chosen rows at any frequency at a cost that does not grow with the size
of the model. In mass-normalised modes, K Phi = M Phi Lambda, the dynamic stiffness is
Lambda - w^2 I + i w Phi'C Phi. Nothing is truncated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, eigh, eigvalsh

from upd.errors import InputError
from upd.hbm.springs.terms import receptances

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Modal:
    """Modes of a linear system, all m = n of them.

    Of a travelling wave they are complex. Several systems of one size may be stacked along a first
    axis of all arrays; it then is that of the frequencies.

    Attributes
    ----------
    Phi : (n, m) ndarray
        Mass-normalised modes [t^-1/2].
    eigenvalues : (m,) ndarray
        [rad^2/s^2]
    damping : (m,) or (m, m) ndarray
        Modal damping [1/s]; (m,) when it is diagonal in the modes.
    rigid : (m,) ndarray of bool
        Modes that have no static stiffness.
    """

    Phi: FloatArray
    eigenvalues: FloatArray
    damping: FloatArray
    rigid: NDArray[np.bool_]

    @property
    def proportional(self) -> bool:
        """Whether the damping matrix is diagonal in the modes."""
        return self.damping.shape == self.eigenvalues.shape

    @property
    def frequencies(self) -> FloatArray:
        """Undamped natural frequencies (m,) [Hz], rigid modes first as zeros."""
        return np.sqrt(np.where(self.rigid, 0.0, np.abs(self.eigenvalues))) / (2 * np.pi)

    def solve(self, w: FloatArray, f: ComplexArray) -> ComplexArray:
        """Modal amplitudes under modal forces.

        Parameters
        ----------
        w : (n_w,) ndarray
            Angular frequencies > 0 [rad/s].
        f : (n_w, m) ndarray of complex
            Modal forces.

        Returns
        -------
        (n_w, m) ndarray of complex
            Infinite at an undamped natural frequency.
        """
        if self.proportional:
            # infinite at an undamped natural frequency, as below
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.asarray(f / self._diagonal(w))
        return np.asarray(np.linalg.solve(self._matrix(w), f[..., None])[..., 0])

    def drive_point(self, Psi: FloatArray, w: FloatArray) -> FloatArray:
        """Receptance of each row at itself, damping between modes left out.

        Parameters
        ----------
        Psi : (r, m) ndarray
            Rows on the modes.
        w : (n_w,) ndarray
            Angular frequencies [rad/s].

        Returns
        -------
        (n_w, r) ndarray
            Modulus [mm/N].
        """
        diagonal = self.damping if self.proportional else np.diagonal(self.damping)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / (self.eigenvalues - w[:, None] ** 2 + 1j * w[:, None] * diagonal)
            return np.abs(inverse @ (Psi * Psi.conj()).real.T)

    def receptance(
        self, Psi: FloatArray, w: FloatArray, load: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Receptance between rows, and their motion under a load.

        Parameters
        ----------
        Psi : (r, m) ndarray
            Rows on the modes.
        w : (n_w,) ndarray
            Angular frequencies [rad/s].
        load : (n_w, m) ndarray of complex
            Modal loads.

        Returns
        -------
        G : (n_w, r, r) ndarray of complex
            Psi D^-1 Psi^H [mm/N], not finite at an undamped natural frequency.
        u : (n_w, r) ndarray of complex
            Psi D^-1 load [mm].
        """
        H = np.swapaxes(Psi.conj(), -1, -2)
        if self.proportional:
            with np.errstate(divide="ignore", invalid="ignore"):
                inverse = 1 / self._diagonal(w)
                if np.iscomplexobj(Psi):
                    u = Psi @ (inverse * load)[:, :, None]
                    return (inverse[:, None, :] * Psi) @ H, u[..., 0]
                # one real product: a complex one with a real matrix is several times slower
                parts = np.concatenate([inverse.real, inverse.imag])[:, None, :] * Psi
                P = (parts.reshape(-1, Psi.shape[1]) @ Psi.T).reshape(-1, len(Psi), len(Psi))
                return P[: len(w)] + 1j * P[len(w) :], (inverse * load) @ Psi.T
        across = np.broadcast_to(H, (len(w), *H.shape[-2:]))
        right = np.concatenate([across, load[:, :, None]], axis=2)
        Y = np.asarray(Psi @ np.linalg.solve(self._matrix(w), right))
        return Y[..., :-1], Y[..., -1]

    def receptance_parts(self, Psi: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Real and imaginary part of the receptance alone, compiled where damping is diagonal."""
        if self.proportional and not np.iscomplexobj(Psi):
            across = np.ascontiguousarray(Psi.T)
            real, imag = receptances(w, self.eigenvalues, self.damping, Psi, across)
            return real, imag
        G, _ = self.receptance(Psi, w, np.zeros((len(w), Psi.shape[-1]), complex))
        return np.ascontiguousarray(G.real), np.ascontiguousarray(G.imag)

    def _diagonal(self, w: FloatArray) -> ComplexArray:
        return np.asarray(self.eigenvalues - w[:, None] ** 2 + 1j * w[:, None] * self.damping)

    def _matrix(self, w: FloatArray) -> ComplexArray:
        one = np.eye(self.eigenvalues.shape[-1])
        base = self.eigenvalues[..., None] * one + 0j
        return base - w[:, None, None] ** 2 * one + 1j * w[:, None, None] * self.damping


def modal(M: ArrayLike, C: ArrayLike, K: ArrayLike) -> Modal:
    """Modes of a dense symmetric or Hermitian system.

    Parameters
    ----------
    M, C, K : (n, n) array_like
        Mass [t], positive definite; damping [N s/mm], symmetric; stiffness [N/mm], positive
        semi-definite. Complex ones are Hermitian.

    Returns
    -------
    Modal

    Raises
    ------
    InputError
        On shapes, symmetry, an indefinite K or M, or a C that feeds energy into a motion.
    """
    kind = np.result_type(float, *(np.asarray(A).dtype for A in (M, C, K)))
    matrices = {name: np.asarray(A, dtype=kind) for name, A in (("M", M), ("C", C), ("K", K))}
    n = len(matrices["M"])
    problems = [
        f"{name} has shape {A.shape}, give ({n}, {n})"
        for name, A in matrices.items()
        if A.shape != (n, n)
    ]
    problems += [
        f"{name} is not finite" for name, A in matrices.items() if not np.all(np.isfinite(A))
    ]
    if not problems:
        problems += [
            f"{name} is not symmetric"
            for name, A in matrices.items()
            if np.abs(A - A.conj().T).max() > n * np.sqrt(EPS) * np.abs(A).max()
        ]
    if problems:
        raise InputError("linear system: " + "; ".join(problems))
    try:
        values, Phi = eigh(*((matrices[name] + matrices[name].conj().T) / 2 for name in ("K", "M")))
    except LinAlgError as error:
        raise InputError(
            "linear system: M is not positive definite; condense massless dofs first"
        ) from error
    rounding = n * EPS * np.abs(values).max()
    if values[0] < -1e3 * rounding:
        raise InputError(
            f"linear system: K is indefinite (eigenvalue {values[0]:.3g}, rounding "
            f"{rounding:.1g}); check its signs"
        )
    # the low modes of a slender body lie 1e-10 below the highest: only what rounding itself may
    # leave counts as rigid
    rigid = values <= 10 * rounding
    damping = _damping(Phi, matrices["C"])
    least = damping.min() if damping.ndim == 1 else eigvalsh((damping + damping.conj().T) / 2)[0]
    if least < -n * np.sqrt(EPS) * np.abs(damping).max():
        raise InputError(
            f"linear system: C feeds energy into a motion (x'C x = {least:.3g} for x'M x = 1): "
            "nothing bounds its response; check its signs"
        )
    return Modal(Phi, np.where(rigid, 0.0, values), damping, rigid)


def _damping(Phi: FloatArray, C: FloatArray) -> FloatArray:
    c = Phi.conj().T @ C @ Phi
    off = c - np.diag(np.diagonal(c))
    level = np.abs(Phi).T @ np.abs(C) @ np.abs(Phi)
    return (
        np.diagonal(c).real.copy()
        if np.all(np.abs(off) <= len(C) * 64 * EPS * max(level.max(), EPS * EPS))
        else c
    )
