"""Guyan (static) condensation of a body on the dofs that contact needs, kept on disk under the hash
of all it depends on.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.csgraph import connected_components

from upd.cache.arrays import Store, load_arrays, save_arrays, trim, unreadable
from upd.cache.files import locked
from upd.errors import ConvergenceError
from upd.linalg.amg import compliance_amg
from upd.linalg.common import (
    EPS,
    Condensed,
    checked_dofs,
    checked_vectors,
    is_free,
    log,
    softest_motion,
)
from upd.linalg.schur import schur_complement
from upd.linalg.select import choose
from upd.linalg.symmetric import Matrix, checked, stored, submatrix_of

FloatArray = NDArray[np.float64]

RIGID_NAMES = (
    "translation x",
    "translation y",
    "translation z",
    "rotation about x",
    "rotation about y",
    "rotation about z",
)
_REMEDY = "To fix it: hold the distant set."


def condense(
    K: Any,
    kept: ArrayLike,
    *,
    solver: str = "auto",
    rigid_modes: ArrayLike | None = None,
    layout: ArrayLike | None = None,
    points: ArrayLike | None = None,
    keep_factor: bool = True,
    memory_limit_bytes: float | None = None,
) -> Condensed:
    """Condense a supported body statically onto some of its dofs.

    Parameters
    ----------
    K : (n, n) Symmetric, sparse array or array_like
        N/mm, without its fixed dofs.
    kept : (k,) array_like of int
        In any order.
    solver : {"auto", "pardiso", "superlu", "amg"}
        Multigrid finds the compliance; S is then its inverse.
    rigid_modes : (n, 6) array_like, optional
        Displacements of the dofs in the body's rigid motions: near null space for multigrid, names
        for what floats.
    layout : (n,) array_like of int, optional
        3 * node + component of each dof, for multigrid.
    points : (n_node, 3) array_like, optional
        Positions of these nodes, mm, for multigrid.
    keep_factor : bool, default True
        Hold the factor for `recover` as long as the result lives; otherwise `recover` factorises
        again.
    memory_limit_bytes : float, optional
        What the solver may use; None: what the machine has left.

    Returns
    -------
    Condensed

    Raises
    ------
    InputError
        For bad arguments or a missing solver.
    ConvergenceError
        For a body that floats: it names the free motions.

    References
    ----------
    .. [1] R. J. Guyan, AIAA J. 3 (1965) 380.

    Examples
    --------
    Three springs of 1 kN/mm in a row, clamped at one end, seen from the other.

    >>> import numpy as np
    >>> from upd.reduction import condense
    >>> K = 1e3 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    >>> found = condense(K, [2], solver="superlu")
    >>> print(f"{found.S[0, 0]:.3f} N/mm, {found.compliance()[0, 0]:.3f} mm/N")
    333.333 N/mm, 0.003 mm/N
    >>> found.recover(np.array([3.0])).round(9).tolist()
    [1.0, 2.0, 3.0]
    """
    A = checked(K)
    n = A.shape[0]
    kept = checked_dofs(kept, n)
    modes = (
        None
        if rigid_modes is None
        else checked_vectors(rigid_modes, n, "rigid-body modes").reshape(n, -1)
    )
    require_held(A, modes)
    choice = choose(n, len(kept), solver=solver, memory_limit_bytes=memory_limit_bytes)
    log.info("condensation of %d dofs onto %d by %s: %s", n, len(kept), choice.name, choice.why)
    if choice.name == "amg" and len(kept) < n:
        return compliance_amg(A, kept, modes, layout=layout, points=points)
    direct = "auto" if choice.name == "amg" else choice.name
    found = schur_complement(A, kept, solver=direct, keep_factor=keep_factor)
    _refuse_floating(found.S, A.diagonal()[kept])
    return found


def require_held(A: Matrix, modes: FloatArray | None) -> None:
    """Refuse a body that floats, or that has a loose part.

    Parameters
    ----------
    A : (n, n) Symmetric or csr_array
        N/mm.
    modes : (n, 6) ndarray or None
        Its rigid-body modes; without them nothing is looked at.

    Raises
    ------
    ConvergenceError
        Naming the modes that cost no energy, of the body or of a loose part of it.
    """
    if modes is None:
        return
    n_part, part = connected_components(stored(A), directed=False)
    found = []
    for number in range(n_part):
        dofs = np.flatnonzero(part == number)
        K = A if n_part == 1 else submatrix_of(A, dofs)
        names = _null_motions(K, modes[dofs])
        if names:
            where = (
                "" if n_part == 1 else f"a loose part of {len(dofs)} dofs, the first {dofs[0]}, is "
            )
            found.append(where + "free in " + ", ".join(names))
    if found:
        raise ConvergenceError(f"The body floats: {'; '.join(found)}. {_REMEDY}")


def _refuse_floating(S: FloatArray, weight: FloatArray) -> None:
    """Raise ConvergenceError when S is singular to rounding.

    That is the rounding of the diagonal `weight` (k,) of K it was subtracted from.
    """
    try:
        factor = cho_factor(S, lower=True, check_finite=False)
        v, energy = softest_motion(S, partial(cho_solve, factor, check_finite=False), weight)
    except np.linalg.LinAlgError:
        root = np.sqrt(weight)
        v = np.linalg.eigh(S / np.outer(root, root))[1][:, 0] / root
        energy = float(v @ S @ v)
    if is_free(v, energy):
        most = int(np.argmax(np.abs(v)))
        raise ConvergenceError(
            "The body floats: nothing but the kept dofs holds it. A motion of relative "
            f"energy {energy:.1e} moves "
            f"entry {most} of the kept dofs most. {_REMEDY}"
        )


def _null_motions(K: Matrix, R: FloatArray) -> list[str]:
    """Names of the columns of R with a share in the null space of R'KR.

    Relative to R'DR with D the diagonal of K.
    """
    root = np.sqrt(K.diagonal())
    W = root[:, None] * R
    U, size, _ = np.linalg.svd(W, full_matrices=False)
    U = U[:, size > len(R) * EPS * size.max(initial=0.0)]
    V = U / root[:, None]
    energy, y = np.linalg.eigh(V.T @ (K @ V))
    null = U @ y[:, [is_free(R, one) for one in energy]]
    share = np.linalg.norm(null.T @ W, axis=0)
    # A hinge away from the centroid is a rotation with some translation: name whatever has more
    # than a tenth of itself in it.
    names = (
        RIGID_NAMES
        if R.shape[1] == len(RIGID_NAMES)
        else [f"rigid mode {j}" for j in range(R.shape[1])]
    )
    return [
        name
        for name, s, w in zip(names, share, np.linalg.norm(W, axis=0), strict=True)
        if s > 0.1 * w
    ]


def stored_condensation(
    store: Store, key: str, make: Callable[[], Condensed], *, solver: str, with_factor: bool
) -> Condensed:
    """The condensation under ``key``, from disk or by ``make``.

    Parameters
    ----------
    store
        Folder, bound of its size, and counts of what was taken from where.
    key
        Hash of all the condensation depends on.
    make
        Factorises.
    solver
        The one `key` stands for; what another one made (memory ran short meanwhile) is not kept.
    with_factor
        The factor is needed too, which is not kept on disk: then nobody waits for another process
        that makes the same.
    """
    path = store.folder / f"{key}.npz"
    found = _read(store, path, make)
    if found is not None:
        return found
    if with_factor:
        return _made(store, path, make, solver)
    with locked(store.folder / f"{key}.lock"):
        # Another process may have made it while this one waited.
        return _read(store, path, make) or _made(store, path, make, solver)


def _made(store: Store, path: Path, make: Callable[[], Condensed], solver: str) -> Condensed:
    made = make()
    store.counts["made"] += 1
    if made.solver == solver:
        sizes = np.array([made.n_dof, made.factor_nnz, made.peak_bytes], np.int64)
        save_arrays(
            path,
            {"S": made.S, "C": made.compliance(), "sizes": sizes, "solver": np.array(made.solver)},
        )
        trim(store.folder, store.limit_bytes, path.name)
    return made


def _read(store: Store, path: Path, make: Callable[[], Condensed]) -> Condensed | None:
    """The condensation on disk; the factor behind `recover` is made when first asked for."""
    arrays = load_arrays(path)
    if arrays is None:
        return None
    try:
        S, C = arrays["S"], arrays["C"]
        if (
            S.ndim != 2
            or S.shape[0] != S.shape[1]
            or S.shape != C.shape
            or not (np.isfinite(S).all() and np.isfinite(C).all())
        ):
            raise ValueError("the arrays are not those of a condensation")
        n_dof, nnz, peak = (int(v) for v in arrays["sizes"])
        solver = str(arrays["solver"])
    except (KeyError, ValueError, TypeError) as problem:
        unreadable(path, problem)
        return None
    store.counts["disk"] += 1
    again: list[Condensed] = []

    def recover(u_kept: FloatArray) -> FloatArray:
        if not again:
            again.append(make())
            store.counts["factor"] += 1
        return again[0].recover(u_kept)

    C.flags.writeable = False
    return Condensed(S, recover, solver, nnz, peak, n_dof, [C])
