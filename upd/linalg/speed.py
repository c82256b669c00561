"""Speed of PARDISO's phases on this machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from upd.linalg.common import checked_matrix
from upd.linalg.pardiso import ANALYSE, FACTORISE, _Pardiso, predict_pardiso


@dataclass(frozen=True)
class FactorSpeed:
    """What a second is enough for.

    Attributes
    ----------
    flops : float
        Operations of the factorisation.
    entries : float
        Entries of the matrix ordered and analysed.
    solve_bytes : float
        Bytes of the factor read by forward and backward substitution.
    """

    flops: float
    entries: float
    solve_bytes: float


def factor_speed(K: Any, clock: Callable[[], float], tries: int = 3) -> FactorSpeed:
    """Speed of the phases for the matrix K, the best of some tries.

    Parameters
    ----------
    K : (n, n) sparse array or array_like
        N/mm.
    clock : callable
        Seconds, by the wall or of this process.
    tries : int, default 3

    Returns
    -------
    FactorSpeed

    Raises
    ------
    InputError, ConvergenceError
        As for `upd.linalg.pardiso.factorise_pardiso`.
    """
    A, expected = checked_matrix(K), predict_pardiso(K)
    found, b = [], np.ones(A.shape[0])
    for _ in range(tries):
        solver, marks = _Pardiso(A), [clock()]
        for phase in (ANALYSE, FACTORISE):
            solver.run(phase)
            marks.append(clock())
        solver.solve(b)
        marks.append(clock())
        solver.close()
        found.append(np.diff(marks))
    analysis, factor, solve = np.min(found, axis=0)
    return FactorSpeed(
        expected.flops / float(factor),
        A.nnz / float(analysis),
        16.0 * expected.factor_nnz / float(solve),
    )
