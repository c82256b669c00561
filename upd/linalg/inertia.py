"""How many modes lie below a frequency: Sylvester's law of inertia, no search.

With a factor K - sigma M = L D L' as many diagonal entries of D are negative as K x = lambda M x
has eigenvalues below sigma [1]_ (M may be singular where K is positive definite on its null space).
A mode that no iteration ever saw is counted too.

The rounding of the factor displaces eigenvalues by a little, so the shift stands in a gap between
modes found, and the factor itself must show that nothing lies on the shift (`_stands_clear`).

References
----------
.. [1] B. N. Parlett, The Symmetric Eigenvalue Problem, ch. 3.3.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from upd.errors import ConvergenceError
from upd.linalg.common import FloatArray, Solve, log
from upd.linalg.eigen_checks import Modes
from upd.linalg.pardiso import signed_pardiso
from upd.linalg.superlu import signed_superlu
from upd.linalg.symmetric import Matrix, combined

#: Where in a gap the shift is tried.
_PLACES = (0.5, 0.25, 0.75)
#: How far, in parts of its distance from the shift, the factor may displace a neighbour; and how
#: near to the shift, in parts of the nearest neighbour's distance, it may see anything else.
_DISPLACED, _ON_THE_SHIFT = 0.1, 1e-3
#: Neighbours looked at on either side, and random vectors.
_NEIGHBOURS, _PROBES = 4, 2
#: Inverse iterations with them: an eigenvalue on the shift stands out after one.
_STEPS = 3


@dataclass(frozen=True)
class Count:
    """Modes counted below a shift that stands in a gap.

    Attributes
    ----------
    sigma : float
        The shift, (rad/s)^2.
    below : int
        Eigenvalues below it, by inertia.
    """

    sigma: float
    below: int

    def missed(self, found: Modes) -> int:
        """Eigenvalues counted and not found; negative when too many were found."""
        return self.below - int((found.eigenvalue < self.sigma).sum())


def count_modes(
    K: Matrix, M: Matrix, found: Modes, keep: int, limit: float, solver: str
) -> Count | None:
    """Count the modes below a shift above the first `keep` found and above `limit`.

    Parameters
    ----------
    K, M : (n, n) Symmetric or csr_array
    found : Modes
        More than `keep` of them: the next one bounds the gap.
    keep : int
        Modes wanted of those found.
    limit : float
        (rad/s)^2; all modes below it are wanted too.
    solver : {"pardiso", "superlu"}

    Returns
    -------
    Count or None
        None when there is no gap, or no factor to be trusted.
    """
    # The widest gap above the modes wanted, relative to its upper end.
    value = found.eigenvalue
    low = np.maximum(np.concatenate([[0.0], value])[keep:-1], limit)
    high = value[keep:]
    width = (high - low) / np.maximum(high, np.finfo(np.float64).tiny)
    # Rounding of the eigenvalues themselves must be no matter.
    if not width.size or width.max() < np.sqrt(np.finfo(np.float64).eps):
        return None
    j = int(np.argmax(width))
    for place in _PLACES:
        sigma = float(low[j] + place * (high[j] - low[j]))
        try:
            factor = _factor(K, M, sigma, solver)
        except ConvergenceError as error:
            log.info("no inertia at %.6g (rad/s)^2: %s", sigma, error)
            return None
        if factor is not None and _stands_clear(M, found, sigma, factor[1]):
            return Count(sigma, factor[0])
    return None


def about_how_many(K: Matrix, M: Matrix, limit: float, solver: str) -> int:
    """Modes below ``limit``, (rad/s)^2, unproven: one on it may count or not; 0 where no factor
    tells.
    """
    with suppress(ConvergenceError):
        factor = _factor(K, M, limit, solver)
        return factor[0] if factor is not None else 0
    return 0


def _factor(K: Matrix, M: Matrix, sigma: float, solver: str) -> tuple[int, Solve] | None:
    """Eigenvalues below sigma, and x -> (K - sigma M)^-1 x; None where no factor can be trusted."""
    signed = signed_pardiso if solver == "pardiso" else signed_superlu
    return signed(combined(K, -sigma, M))


def _stands_clear(M: Matrix, found: Modes, sigma: float, solve: Solve) -> bool:
    """Whether the factor puts the neighbours found where they are, and nothing on the shift.

    For a mode x, x'M (K - sigma M)^-1 M x is 1 / (lambda - sigma). Inverse iteration from random
    vectors v, v'Mv = 1, tends to the eigenvalue nearest to the shift, |(K - sigma M)^-1 M v|_M
    to one over its distance from below: when that is near to the distance of the nearest neighbour
    found, there is none on the shift whose side rounding would choose.
    """
    value = found.eigenvalue
    next_one = int(np.searchsorted(value, sigma))
    near = slice(max(0, next_one - _NEIGHBOURS), next_one + _NEIGHBOURS)
    X, distance = found.shapes[:, near], value[near] - sigma
    seen = np.einsum("ij,ij->j", M @ X, solve(M @ X))
    if not (np.abs(seen * distance - 1.0) <= _DISPLACED).all():
        return False
    v: FloatArray = np.random.default_rng(0).standard_normal((M.shape[0], _PROBES))
    size = _norm(M, v)
    for _ in range(_STEPS):
        v = solve(M @ (v / size))
        size = _norm(M, v)
    return bool((size * np.abs(distance).min() <= 1.0 / _ON_THE_SHIFT).all())


def _norm(M: Matrix, v: FloatArray) -> FloatArray:
    """(m,) M norms of columns."""
    out: FloatArray = np.sqrt(np.maximum(np.einsum("ij,ij->j", v, M @ v), 0.0))
    return out
