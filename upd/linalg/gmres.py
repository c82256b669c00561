"""Linear equations by GMRES: a few products near an answer that is nearly known."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Map = Callable[[FloatArray], FloatArray]


class FewProducts(NamedTuple):
    """What GMRES found.

    Attributes
    ----------
    x : (n,) ndarray
        Least residual in the space of the products.
    reached : bool
        Whether the residual is as small as asked.
    products : int
        Products with the matrix.
    ritz : (products,) ndarray of complex
        Eigenvalues of the matrix in that space, those beside the others first to be right.
    """

    x: FloatArray
    reached: bool
    products: int
    ritz: ComplexArray


def gmres(
    product: Map, r: FloatArray, share: float, most: int, near: Map | None = None
) -> FewProducts:
    """x with A x = r to a share of |r|, in a few products with A.

    Parameters
    ----------
    product : callable
        x (n,) -> A x (n,).
    r : (n,) ndarray
    share : float
        Largest residual |r - A x| over |r|.
    most : int
        Most products.
    near : callable, optional
        r (n,) -> x (n_x,), nearly A^-1 r; it may change between products. Ritz values are those of
        A near.

    Returns
    -------
    FewProducts
        Not reached where the residual is not finite, too.

    References
    ----------
    Y. Saad, Iterative Methods for Sparse Linear Systems (2003), 6.5 and 9.4 (flexible); 6.3 for the
    second orthogonalisation.
    """
    size = float(np.linalg.norm(r))
    if not size > 0.0 or not np.isfinite(size) or most < 1:
        x = r if near is None else near(r)
        return FewProducts(x, size == 0.0, 0, np.zeros(0, complex))
    V, H = np.empty((most + 1, len(r))), np.zeros((most + 1, most))
    V[0] = r / size
    Z: list[FloatArray] = []
    rest = np.zeros(most + 1)
    rest[0] = size
    c: FloatArray = np.zeros(0)
    k, reached = 0, False
    while k < most and not reached:
        Z.append(V[k] if near is None else near(V[k]))
        w = product(Z[k])
        for _ in range(2):
            along = V[: k + 1] @ w
            w = w - along @ V[: k + 1]
            H[: k + 1, k] += along
        H[k + 1, k] = np.linalg.norm(w)
        if not np.isfinite(H[: k + 2, k]).all():
            break
        k += 1
        c = np.asarray(np.linalg.lstsq(H[: k + 1, :k], rest[: k + 1])[0], dtype=float)
        left = float(np.linalg.norm(H[: k + 1, :k] @ c - rest[: k + 1]))
        # without a next direction the space holds the answer, or the matrix is singular in it
        reached = left <= share * size
        if H[k, k - 1] == 0.0:
            break
        V[k] = w / H[k, k - 1]
    x = c @ np.asarray(Z[:k]) if k else np.zeros_like(r if near is None else Z[0])
    return FewProducts(x, reached, k, np.linalg.eigvals(H[:k, :k]).astype(complex))
