"""Convergence rates and error estimates from results on several meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError


def fit_rate(h: ArrayLike, error: ArrayLike) -> float:
    """Order p of |error| = C h^p, least squares in the logarithms over all meshes.

    explains less than half of the variance of the logarithms: an error that changes sign, or is the
    scatter of nodes at the contact's edge.

    Parameters
    ----------
    h, error
        (n,), n >= 2. Exact zeros in the error are left out. Returns nan when fewer than two
        points remain, or when a power law.
    """
    size, e = np.asarray(h, float), np.abs(np.asarray(error, float))
    good = e > 0.0
    if good.sum() < 2:
        return float("nan")
    x, y = np.log(size[good]), np.log(e[good])
    slope, start = np.polyfit(x, y, 1)
    variance = float(np.sum((y - y.mean()) ** 2))
    explained = (
        1.0 - float(np.sum((y - slope * x - start) ** 2)) / variance if variance > 0.0 else 0.0
    )
    return float(slope) if explained >= 0.5 else float("nan")


@dataclass(frozen=True)
class Extrapolation:
    """Limit of q(h) = limit + C h^order, and the largest deviation of the meshes from the fit,
    relative to the limit.
    """

    limit: float
    order: float
    scatter: float


def extrapolate(
    h: ArrayLike, values: ArrayLike, *, orders: tuple[float, float] = (0.5, 4.0)
) -> Extrapolation:
    """Fit q(h) = limit + C h^p over three or more meshes.

    p is the best of a fine grid within ``orders``, limit and C are linear.

    For exactly three meshes with a constant ratio of sizes this is Richardson's extrapolation (P.
    J. Roache, Verification and Validation in Computational Science and Engineering, 1998, chapter
    5). Finer meshes weigh more (1 / h).
    """
    size, q = np.asarray(h, float), np.asarray(values, float)
    if size.shape != q.shape or len(size) < 3:
        raise InputError(
            "extrapolation needs three meshes or more, with one value each; got "
            f"{size.shape} and {q.shape}"
        )
    weight = np.sqrt(1.0 / size)

    def fit(p: float) -> tuple[float, np.ndarray[tuple[int], np.dtype[np.float64]]]:
        A = np.column_stack([np.ones_like(size), (size / size.max()) ** p])
        solution, *_ = np.linalg.lstsq(A * weight[:, None], q * weight, rcond=None)
        return float(np.sum((weight * (A @ solution - q)) ** 2)), solution

    grid = np.linspace(*orders, 141)
    best = min(grid, key=lambda p: fit(p)[0])
    solution = fit(best)[1]
    model = solution[0] + solution[1] * (size / size.max()) ** best
    scale = abs(solution[0]) or 1.0
    return Extrapolation(float(solution[0]), float(best), float(np.abs(model - q).max() / scale))


def two_level_error(coarse: float, fine: float, ratio: float, order: float = 1.0) -> float:
    """Estimated relative error of ``fine`` from two meshes whose sizes differ by ``ratio`` > 1,
    assuming the order p.

    |fine - coarse| / (ratio^p - 1), relative to |fine| (Roache, as above, eq. 5.4.2). The default
    order 1 is cautious for this method.
    """
    if not ratio > 1.0:
        raise InputError(
            f"the coarse mesh must be coarser: ratio of sizes {ratio:g} is not above 1"
        )
    if fine == 0.0:
        return 0.0 if coarse == 0.0 else float("inf")
    return float(abs(fine - coarse) / (ratio**order - 1.0) / abs(fine))


def change_order(h: ArrayLike, values: ArrayLike) -> float:
    """Order p at which a quantity still changes under refinement, from |dq / d log h| = C h^p.

    Needs no limit, so it shows a missing one.

    q = limit + C h^p gives p > 0; q = C h^-s (the pressure at the edge of a flat punch) gives -s, q
    = C log h gives 0: no limit. h, values : (n,), n >= 3. nan as in `fit_rate`.
    """
    size, q = np.asarray(h, float), np.asarray(values, float)
    order = np.argsort(-size)
    size, q = size[order], q[order]
    if len(size) < 3:
        return float("nan")
    change = np.diff(q) / np.diff(np.log(size))
    x, y = 0.5 * (np.log(size[1:]) + np.log(size[:-1])), np.abs(change)
    if not np.all(y > 0.0) or len(set(np.sign(change))) > 1:
        return float("nan")
    return float(np.polyfit(x, np.log(y), 1)[0])
