"""What the contact solvers ask of their input; all faults are reported at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack

from upd.errors import InputError

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)


class Faults:
    """Collects faults so that one InputError names them all."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.found: list[str] = []

    def add(self, condition: bool, message: str) -> bool:
        """Note `message` when `condition` holds; returns the condition."""
        if condition:
            self.found.append(message)
        return condition

    def raise_any(self) -> None:
        """InputError with every fault noted so far."""
        if self.found:
            raise InputError(f"{self.where}: " + " | ".join(self.found))


def numbers(faults: Faults, name: str, values: ArrayLike) -> FloatArray | None:
    """Float copy of `values`, or None and a fault when it holds something else than finite numbers."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        faults.add(True, f"{name} is not an array of numbers: give floats.")
        return None
    bad = int(np.count_nonzero(~np.isfinite(array)))
    if faults.add(bad > 0, f"{name} holds {bad} values that are NaN or infinite: mend the step that made them."):
        return None
    return array


def compliance_matrix(faults: Faults, values: ArrayLike) -> FloatArray | None:
    """Symmetric part of the compliance (n, n) when it is square, symmetric and positive on the diagonal; else None and the fault."""
    C = numbers(faults, "compliance", values)
    if C is None:
        return None
    if faults.add(C.ndim != 2 or C.shape[0] != C.shape[-1] or C.size == 0, f"compliance has shape {C.shape}: it must be (n, n), n >= 1."):
        return None
    scale = float(np.abs(C).max())
    skew = float(np.abs(C - C.T).max())
    # Rounding of a condensation leaves far less than half the digits; more than that is a mistake of the caller.
    if faults.add(
        skew > np.sqrt(EPS) * scale,
        f"compliance is not symmetric (max |C - C'| is {skew / scale if scale else 0.0:.1e} of max |C|): "
        "check the dof order and that both bodies use the same nodes.",
    ):
        return None
    dead = np.flatnonzero(np.diagonal(C) <= 0)
    if faults.add(
        dead.size > 0,
        f"compliance is not positive definite: {dead.size} diagonal entries are <= 0, first at row {dead[0] if dead.size else 0}. "
        "Drop dofs fixed by symmetry and check the sign.",
    ):
        return None
    return np.asarray((C + C.T) / 2)


def unit_response(faults: Faults, C: FloatArray) -> FloatArray:
    """C^-1 e, which also proves C positive definite; a fault when it is not, to working precision."""
    remedy = "Hold the bodies (no rigid motion) and merge coincident contact nodes."
    message = f"compliance is not positive definite to working precision: {{}}. {remedy}"
    L, info = lapack.dpotrf(C.T, lower=1, clean=0)
    if faults.add(info != 0, message.format(f"its Cholesky factorisation breaks down at row {info - 1}")):
        return np.ones(len(C))
    pivot = np.diagonal(L) ** 2 / np.diagonal(C)
    worst = int(np.argmin(pivot))
    if faults.add(bool(pivot[worst] <= len(C) * EPS), message.format(f"row {worst} depends on the rows before it")):
        return np.ones(len(C))
    return np.asarray(lapack.dpotrs(L, np.ones(len(C)), lower=1)[0])
