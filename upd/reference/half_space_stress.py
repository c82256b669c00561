"""Stresses in an elastic half-space z >= 0 under uniform tractions on a rectangle.

x, y lie in the surface, z points into the body; a positive pressure presses along +z, tension is
positive. Units: mm, MPa.

With the potentials of the loaded rectangle V = int 1/rho, chi = int ln(rho + z) and
Omega = int [z ln(rho + z) - rho] the stresses are derivatives of these three (A. E. H. Love, Phil.
Trans. R. Soc. A 228, 1929, 377, for the pressure; K. L. Johnson, Contact Mechanics, 1985, eqs
(3.7) to (3.9), for the traction). Every derivative needed is a closed form at the four corners,
X = x -+ half_x, Y = y -+ half_y, summed with alternating sign.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, sections 3.1, 3.2 and 3.6.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from upd.reference._checks import FloatArray, elastic, not_negative, positive, require


def love_rectangle_stress(
    x: ArrayLike, y: ArrayLike, z: ArrayLike, half_x: float, half_y: float, p: float, nu: float
) -> FloatArray:
    """Stresses under a uniform pressure on abs(x) <= half_x, abs(y) <= half_y.

    2 pi s_xx / p = 2 nu V_z - (1 - 2 nu) chi_xx - z V_xx, likewise s_yy,
    2 pi s_zz / p = V_z - z V_zz, 2 pi s_xy / p = -(1 - 2 nu) chi_xy - z V_xy,
    2 pi s_xz / p = -z V_xz, likewise s_yz.

    Parameters
    ----------
    x, y, z : array_like
        Positions in mm that broadcast, z >= 0.
    half_x, half_y : float
        Half edges of the rectangle, mm.
    p : float
        MPa.
    nu : float
        Poisson ratio.

    Returns
    -------
    (..., 3, 3) ndarray
        MPa, tension positive.

    Raises
    ------
    InputError
        Above the surface, and on the lines of the rectangle's edges in the surface.

    References
    ----------
    .. [1] A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377.

    Examples
    --------
    Under the middle the surface carries p normal to it and (1 + 2 nu) p / 2 along it:

    >>> from upd.reference import love_rectangle_stress
    >>> stress = love_rectangle_stress(0.0, 0.0, 0.0, 1.0, 1.0, p=100.0, nu=0.3)
    >>> [round(float(stress[k, k]), 3) for k in range(3)]
    [-80.0, -80.0, -100.0]
    """
    total, X, Y, depth, rho = _corners("love_rectangle_stress", x, y, z, half_x, half_y, nu)
    bulk, ring_x, ring_y = 1.0 - 2.0 * nu, rho * (X**2 + depth**2), rho * (Y**2 + depth**2)
    V_xx, V_yy = total(-X * Y / ring_x), total(-Y * X / ring_y)
    V_z = total(-np.arctan2(X * Y, depth * rho))
    # atan(Y / X) - atan(z Y / (X rho)) in one angle
    chi_xx = total(np.arctan2(X * Y * (rho - depth), X**2 * rho + depth * Y**2))
    chi_yy = total(np.arctan2(Y * X * (rho - depth), Y**2 * rho + depth * X**2))
    return _tensor(
        p,
        2.0 * nu * V_z - bulk * chi_xx - depth * V_xx,
        2.0 * nu * V_z - bulk * chi_yy - depth * V_yy,
        # V is harmonic
        V_z + depth * (V_xx + V_yy),
        -bulk * total(np.log(rho + depth)) - depth * total(1.0 / rho),
        -depth * total(-depth * Y / ring_x),
        -depth * total(-depth * X / ring_y),
    )


def cerruti_rectangle_stress(
    x: ArrayLike, y: ArrayLike, z: ArrayLike, half_x: float, half_y: float, q: float, nu: float
) -> FloatArray:
    """Stresses under a uniform traction along +x on abs(x) <= half_x, abs(y) <= half_y.

    2 pi s_xx / q = 2 (1 + nu) V_x + 2 nu Omega_xxx - z chi_xxx,
    2 pi s_yy / q = 2 nu V_x + 2 nu Omega_xyy - z chi_xyy, 2 pi s_zz / q = -z V_xz,
    2 pi s_xy / q = V_y + 2 nu Omega_xxy - z chi_xxy, 2 pi s_xz / q = V_z - z V_xx,
    2 pi s_yz / q = -z V_xy.

    Parameters
    ----------
    x, y, z : array_like
        Positions in mm that broadcast, z >= 0.
    half_x, half_y : float
        Half edges of the rectangle, mm.
    q : float
        MPa.
    nu : float
        Poisson ratio.

    Returns
    -------
    (..., 3, 3) ndarray
        MPa, tension positive.

    Raises
    ------
    InputError
        Above the surface, and on the lines of the rectangle's edges in the surface.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, section 3.6; eq. (3.76) is its point load.

    Examples
    --------
    The surface carries the traction:

    >>> from upd.reference import cerruti_rectangle_stress
    >>> stress = cerruti_rectangle_stress(0.0, 0.0, 0.0, 1.0, 1.0, q=100.0, nu=0.3)
    >>> round(float(stress[0, 2]), 3)
    -100.0
    """
    total, X, Y, depth, rho = _corners("cerruti_rectangle_stress", x, y, z, half_x, half_y, nu)
    x_line, below = X**2 + depth**2, rho + depth
    log_x = np.arcsinh(Y / np.hypot(X, depth))
    V_x, V_y = total(log_x), total(np.arcsinh(X / np.hypot(Y, depth)))
    chi_xxx = total(Y / rho * (depth / x_line - 1.0 / below))
    omega_xyy = total(-Y / below)
    return _tensor(
        q,
        2.0 * (1.0 + nu) * V_x + 2.0 * nu * total(Y / below - log_x) - depth * chi_xxx,
        2.0 * nu * (V_x + omega_xyy) - depth * total(Y / (rho * below)),
        -depth * total(-depth * Y / (rho * x_line)),
        V_y + 2.0 * nu * total(-X / below) - depth * total(X / (rho * below)),
        total(-np.arctan2(X * Y, depth * rho)) - depth * total(-X * Y / (rho * x_line)),
        -depth * total(1.0 / rho),
    )


def von_mises(stress: ArrayLike) -> FloatArray:
    """Von Mises stress of stress tensors (..., 3, 3), in their unit.

    Examples
    --------
    >>> import numpy as np
    >>> from upd.reference import von_mises
    >>> float(von_mises(np.diag([100.0, 0.0, 0.0])))
    100.0
    """
    s = np.asarray(stress, dtype=float)
    mean = np.trace(s, axis1=-2, axis2=-1)[..., None, None] / 3.0
    deviator = s - mean * np.eye(3)
    return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=(-2, -1))))


def _corners(
    where: str, x: ArrayLike, y: ArrayLike, z: ArrayLike, half_x: float, half_y: float, nu: float
) -> tuple[Callable[[FloatArray], FloatArray], FloatArray, FloatArray, FloatArray, FloatArray]:
    """What sums corner shares (4, ...) of a derivative with their signs; X, Y from the corners,
    depths, and distances rho from the corners.

    Terms that are the same at both ends of an edge cancel in the sum and are left out of the
    shares, so that nothing is lost where rho + Y is small.
    """
    positive(where, half_x=half_x, half_y=half_y)
    not_negative(where, z=z)
    elastic(where, 1.0, nu)
    px, py, depth = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (x, y, z)))
    on_edge = (np.abs(px) == half_x) | (np.abs(py) == half_y)
    require(
        ~(on_edge & (depth == 0.0)),
        where,
        "stresses on the edges of the rectangle are unbounded or not one value",
        "take points beside them or below the surface",
    )
    signs = [(sx, sy) for sx in (1.0, -1.0) for sy in (1.0, -1.0)]
    X = np.stack([px + sx * half_x for sx, _ in signs])
    Y = np.stack([py + sy * half_y for _, sy in signs])

    def total(shares: FloatArray) -> FloatArray:
        return np.asarray(sum(sx * sy * one for (sx, sy), one in zip(signs, shares, strict=True)))

    return total, X, Y, depth, np.sqrt(X**2 + Y**2 + depth**2)


def _tensor(scale: float, *components: FloatArray) -> FloatArray:
    """(..., 3, 3) from xx, yy, zz, xy, xz, yz times 2 pi."""
    out = np.empty((*components[0].shape, 3, 3))
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    for (i, j), component in zip(places, components, strict=True):
        out[..., i, j] = out[..., j, i] = component
    return scale / (2.0 * np.pi) * out
