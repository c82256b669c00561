"""Craig-Bampton reduction [1]_: constraint modes and fixed-interface modes; and that of a held body
to its lowest modes and its displacements under given loads.

References
----------
.. [1] R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import ConvergenceError, InputError
from upd.labels import Shown
from upd.linalg.common import (
    EPS,
    FloatArray,
    IntArray,
    checked_dofs,
    checked_vectors,
    log,
)
from upd.linalg.eigen import Eigenproblem
from upd.linalg.eigen_checks import Modes, checked_mass
from upd.linalg.schur import schur_complement
from upd.linalg.select import memory_left
from upd.linalg.symmetric import Matrix, checked, submatrix_of
from upd.reduction.reduced import ReducedModel


@dataclass(frozen=True)
class ErrorTarget:
    """Largest error of the reduced model against the full one.

    Parameters
    ----------
    error : float, default 3e-4
        Relative error of the first `of` elastic frequencies.
    of : int, default 4
        Number of these frequencies.
    most : int, default 200
        Largest number of modes to reach it with.
    """

    error: float = 3e-4
    of: int = 4
    most: int = 200


def craig_bampton(
    K: Any,
    M: Any,
    boundary: ArrayLike,
    *,
    n_modes: int | None = None,
    below_hz: float | None = None,
    target: ErrorTarget | None = None,
    rows: ArrayLike | None = None,
    solver: str = "auto",
) -> ReducedModel:
    """Reduce a body to boundary dofs and modes with the boundary held.

    Give exactly one of `n_modes`, `below_hz` and `target`. The body may float when the boundary
    holds it: then the reduced model has its rigid motions. Takes n (k + m) doubles. Frequencies
    come out too high, never too low (a Ritz method). Constraint modes are the recovery of the
    static condensation.

    Parameters
    ----------
    K, M : (n, n) Symmetric, sparse array or array_like
        N/mm and t, without fixed dofs.
    boundary : (k,) array_like of int
        Dofs kept as displacements.
    n_modes : int, optional
        Number m of these modes (0: static condensation with its mass).
    below_hz : float, optional
        All of them up to this frequency, Hz (a usual choice: twice the highest frequency of
        interest).
    target : ErrorTarget, optional
        As few as make the first frequencies right, judged by the full model's own modes.
    rows : (n_row,) array_like of int, optional
        Dofs at which the way back is kept; None: all (n r doubles).
    solver : {"auto", "pardiso", "superlu"}

    Returns
    -------
    ReducedModel

    Raises
    ------
    InputError
        For bad arguments or too little memory.
    ConvergenceError
        When the body floats with the boundary held, or when the target is not met by `target.most`
        modes.

    Examples
    --------
    A chain of three masses on springs, clamped at one end, reduced to its tip and one mode.

    >>> import numpy as np
    >>> from upd.linalg import modes
    >>> from upd.reduction import craig_bampton
    >>> K = 1e3 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    >>> M = 1e-3 * np.eye(3)
    >>> model = craig_bampton(K, M, [2], n_modes=1)
    >>> model.n, model.fixed_frequency.round(2).tolist()
    (2, [159.15])
    >>> print(f"{model.modes(count=1).frequency[0]:.2f} Hz reduced")
    70.91 Hz reduced
    >>> print(f"{modes(K, M, count=1).frequency[0]:.2f} Hz in full")
    70.83 Hz in full
    """
    A, mass = checked(K), checked_mass(M, int(np.shape(K)[0]))
    n = A.shape[0]
    b = checked_dofs(boundary, n, "boundary")
    kept = np.arange(n) if rows is None else checked_dofs(rows, n, "kept")
    _check(n, len(b), n_modes, below_hz, target)
    static = schur_complement(A, b, solver=solver)
    S, Psi = static.S, static.recover(np.eye(len(b)))
    # its factor is as large as the one that the modes take
    del static
    basis = _Basis(A, mass, b, kept, S, Psi, solver)
    if target is None:
        return basis.model(n_modes, below_hz)
    return _to_target(basis, _reference(A, mass, target, solver), target)


class _Basis:
    """Constraint modes Psi (n, k) with their stiffness S (k, k), and modes with the boundary held,
    whose factor is kept between questions.
    """

    def __init__(
        self,
        A: Matrix,
        M: Matrix,
        boundary: IntArray,
        rows: IntArray,
        S: FloatArray,
        Psi: FloatArray,
        solver: str,
    ) -> None:
        self.M, self.boundary, self.rows, self.S, self.Psi = M, boundary, rows, S, Psi
        self.size = A.diagonal()[boundary]
        self.inner = np.setdiff1d(np.arange(A.shape[0]), boundary)
        self.problem: Eigenproblem | None = None
        self.most = 0
        M_ii = submatrix_of(M, self.inner)
        # Massless inner dofs have no modes; they follow statically.
        if self.inner.size and M_ii.diagonal().any():
            self.problem = Eigenproblem(submatrix_of(A, self.inner), M_ii, solver=solver)
            self.most = self.problem.n_massive

    def modes(self, count: int | None, below_hz: float | None) -> tuple[FloatArray, FloatArray]:
        """Frequencies (m,) and shapes (n, m) with the boundary held."""
        n = self.M.shape[0]
        if self.problem is None or count == 0:
            if count:
                raise InputError(
                    f"{count} modes are wanted, but no dof with mass remains when the "
                    "boundary is held: ask for 0."
                )
            return np.zeros(0), np.zeros((n, 0))
        found = self.problem.modes(count=count, below_hz=below_hz)
        shapes = np.zeros((n, found.frequency.size))
        shapes[self.inner] = found.shapes
        return found.frequency, shapes

    def model(self, count: int | None, below_hz: float | None = None) -> ReducedModel:
        """K = diag(S, Lambda), M = T'MT with T = [Psi Phi]; the block Phi'M Phi is the unit."""
        frequency, Phi = self.modes(count, below_hz)
        k, m, n = len(self.S), len(frequency), self.M.shape[0]
        K, M = np.zeros((k + m, k + m)), np.eye(k + m)
        value = (2.0 * np.pi * frequency) ** 2
        K[:k, :k] = 0.5 * (self.S + self.S.T)
        K[range(k, k + m), range(k, k + m)] = value
        M_Psi = self.M @ self.Psi
        M_bb = self.Psi.T @ M_Psi
        M[:k, :k] = 0.5 * (M_bb + M_bb.T)
        M[k:, :k] = Phi.T @ M_Psi
        M[:k, k:] = M[k:, :k].T
        basis = np.hstack([self.Psi[self.rows], Phi[self.rows]])
        log.info(
            "Craig-Bampton: %d dofs to %d boundary dofs and %d modes up to %.6g Hz",
            n,
            k,
            m,
            frequency.max(initial=0.0),
        )
        return ReducedModel(
            K, M, self.boundary, frequency, self.rows, basis, np.concatenate([self.size, value]), n
        )


def _reference(A: Matrix, M: Matrix, target: ErrorTarget, solver: str) -> Modes:
    """Modes of the full model up to the elastic one number `of`.

    Raises InputError when it has fewer.
    """
    problem = Eigenproblem(A, M, solver=solver)
    count = 0
    n_rigid = 0
    # Each pass asks for more, until rigid motions no longer displace elastic modes.
    while count < target.of + n_rigid:
        count = target.of + n_rigid
        if count > problem.n_massive:
            raise InputError(
                f"Craig-Bampton: {target.of} elastic frequencies are a target, the model "
                "has not so many: ask for fewer."
            )
        found = problem.modes(count=count)
        n_rigid = found.n_rigid
    return found


def _to_target(basis: _Basis, reference: Modes, target: ErrorTarget) -> ReducedModel:
    """The fewest modes that meet the target.

    More of them until it is met, then the least number among these.
    """
    most = min(target.most, basis.most)
    count = min(most, 2 * target.of)
    while True:
        model = basis.model(count)
        error = _error(model, reference, target.of)
        if error <= target.error:
            break
        if count == most:
            raise ConvergenceError(
                f"Craig-Bampton: {count} modes leave an error of {error:.1e} in the first "
                f"{target.of} frequencies, {target.error:.1e} is "
                "the target: allow more modes, keep more boundary dofs, or a larger error."
            )
        count = min(most, 2 * count)
    low, high = -1, count
    while high - low > 1:
        middle = (low + high) // 2
        good = _error(model.truncated(middle), reference, target.of) <= target.error
        low, high = (low, middle) if good else (middle, high)
    return model.truncated(high)


def _error(model: ReducedModel, reference: Modes, of: int) -> float:
    """Largest relative error of the first `of` elastic frequencies.

    Infinite when the reduced model has fewer.
    """
    if model.n < reference.n_rigid + of:
        return np.inf
    return float(np.abs(frequency_error(model, reference, of)).max())


def frequency_error(model: ReducedModel, reference: Modes, of: int) -> FloatArray:
    """Relative error of a reduced model's first elastic frequencies.

    Parameters
    ----------
    model : ReducedModel
    reference : Modes
        Of the full model.
    of : int
        Number of frequencies.

    Returns
    -------
    (of,) ndarray
        Reduced over full, less one.

    Raises
    ------
    InputError
        When either has fewer elastic modes.
    """
    wanted = reference.frequency[reference.n_rigid :][:of]
    if len(wanted) < of or model.n < reference.n_rigid + of:
        raise InputError(
            f"{of} elastic modes are compared, the full model gives {len(wanted)}: ask for "
            "more modes."
        )
    out: FloatArray = (
        model.modes(count=reference.n_rigid + of).frequency[reference.n_rigid :] / wanted - 1.0
    )
    return out


def _check(
    n: int, k: int, n_modes: int | None, below_hz: float | None, target: ErrorTarget | None
) -> None:
    errors = []
    if sum(choice is not None for choice in (n_modes, below_hz, target)) != 1:
        errors.append("give exactly one of n_modes, below_hz and target")
    if n_modes is not None and not 0 <= n_modes <= n - k:
        errors.append(
            f"n_modes = {n_modes}: with the boundary held {n - k} dofs are left; give 0 to "
            "that many"
        )
    if below_hz is not None and not below_hz > 0.0:
        errors.append(f"below_hz = {below_hz}: give a positive frequency in Hz")
    if target is not None and (not target.error > 0.0 or target.of < 1 or target.most < 1):
        errors.append(
            f"{target}: give a positive error, at least one frequency and at least one mode"
        )
    # The constraint modes, their product with M, and the part kept.
    need = 3.0 * 8.0 * n * (k + (n_modes or 0))
    if need > memory_left():
        errors.append(
            f"{k} boundary dofs of {n} need {need / 1e9:.1f} GB for their constraint "
            "modes: keep fewer boundary dofs"
        )
    if errors:
        raise InputError("Craig-Bampton: " + "; ".join(errors) + ".")


@dataclass(frozen=True, repr=False)
class AttachedModel(Shown):
    """A body on modal coordinates, then those of its static shapes.

    Attributes
    ----------
    K, M : (r, r) ndarray
        N/mm and t; M is the unit.
    rows : (k, r) ndarray
        B T: what the loads work on, per unit coordinate.
    frequency : (m,) ndarray
        Hz of the modes, the first coordinates.
    """

    K: FloatArray
    M: FloatArray
    rows: FloatArray
    frequency: FloatArray


def attachment_modes(
    K: Any, M: Any, B: ArrayLike, n_modes: int, *, solver: str = "auto"
) -> AttachedModel:
    """Reduce a held body to its lowest modes Phi and the static shapes X = K^-1 B' of k loads.

    With X_p = X - Phi Lambda^-1 (B Phi)', which the modes lack, Phi' M X_p = 0 and Phi' K X_p = 0:

        X_p' K X_p = B X - (B Phi) Lambda^-1 (B Phi)',    B X_p likewise,

    and X_p' M X_p is brought to the unit. The static compliance B K^-1 B' and the modes are those
    of the body, whatever else the loads' shapes do. Takes n (k + m) doubles, a factor and then, in
    its place, one that counts the modes, k right sides: loads spread over many nodes cost no more
    than those on one.

    Parameters
    ----------
    K, M : (n, n) Symmetric, sparse array or array_like
        N/mm and t, without fixed dofs; K definite.
    B : (k, n) array_like
        Displacements that the loads work on: B' f are the nodal forces.
    n_modes : int
        m, above 0.
    solver : {"auto", "pardiso", "superlu"}

    Returns
    -------
    AttachedModel

    Raises
    ------
    InputError
        For bad arguments or too little memory.
    ConvergenceError
        When the body floats.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed. (2006), ch. 17:
    attachment modes.

    Examples
    --------
    A chain of three masses on springs, clamped at one end, with its lowest mode and a force on its
    tip: 3 springs of 1000 N/mm give way by 3e-3 mm/N.

    >>> import numpy as np
    >>> from upd.reduction import attachment_modes
    >>> K = 1e3 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    >>> found = attachment_modes(K, 1e-3 * np.eye(3), [[0.0, 0.0, 1.0]], 1)
    >>> found.frequency.round(2).tolist()
    [70.83]
    >>> compliance = found.rows @ np.linalg.solve(found.K, found.rows.T)
    >>> compliance.round(12).tolist()
    [[0.003]]
    """
    A = checked(K)
    rows = checked_vectors(np.asarray(B, float).T, A.shape[0], "loads").T
    if n_modes < 1:
        raise InputError(f"n_modes = {n_modes}: give 1 or more")
    problem = Eigenproblem(A, M, sigma=0.0, solver=solver, alone=True)
    X = problem.displacements(rows.T)
    found = problem.modes(count=n_modes)
    value = (2.0 * np.pi * found.frequency) ** 2
    seen = rows @ found.shapes
    X -= found.shapes @ (seen / value).T
    stiffness, mass = rows @ X, X.T @ (checked(M) @ X)
    size = np.sqrt(np.diag(mass))
    scale, V = np.linalg.eigh(0.5 * (mass + mass.T) / np.outer(size, size))
    # shapes that repeat others are left out
    keep = scale > len(scale) * EPS**0.75 * scale[-1]
    T = V[:, keep] / np.sqrt(scale[keep]) / size[:, None]
    n = n_modes + T.shape[1]
    K_r = np.zeros((n, n))
    K_r[range(n_modes), range(n_modes)] = value
    K_r[n_modes:, n_modes:] = T.T @ (0.5 * (stiffness + stiffness.T)) @ T
    return AttachedModel(K_r, np.eye(n), np.hstack([seen, stiffness @ T]), found.frequency)
