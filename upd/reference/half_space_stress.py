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

#: the corner's share of a derivative: X, Y, z, rho -> array
_Corner = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]


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
    at = _Corners("love_rectangle_stress", x, y, z, half_x, half_y, nu)
    bulk, depth = 1.0 - 2.0 * nu, at.z
    V_xx, V_yy, V_z = at(_V_xx), at(_V_yy), at(_V_z)
    return _tensor(
        p,
        2.0 * nu * V_z - bulk * at(_chi_xx) - depth * V_xx,
        2.0 * nu * V_z - bulk * at(_chi_yy) - depth * V_yy,
        # V is harmonic
        V_z + depth * (V_xx + V_yy),
        -bulk * at(_chi_xy) - depth * at(_V_xy),
        -depth * at(_V_xz),
        -depth * at(_V_yz),
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
    at = _Corners("cerruti_rectangle_stress", x, y, z, half_x, half_y, nu)
    depth, V_x = at.z, at(_V_x)
    return _tensor(
        q,
        2.0 * (1.0 + nu) * V_x + 2.0 * nu * at(_omega_xxx) - depth * at(_chi_xxx),
        2.0 * nu * (V_x + at(_omega_xyy)) - depth * at(_chi_xyy),
        -depth * at(_V_xz),
        at(_V_y) + 2.0 * nu * at(_omega_xxy) - depth * at(_chi_xxy),
        at(_V_z) - depth * at(_V_xx),
        -depth * at(_V_xy),
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


class _Corners:
    """A derivative at positions: its corner shares summed with their signs."""

    def __init__(
        self,
        where: str,
        x: ArrayLike,
        y: ArrayLike,
        z: ArrayLike,
        half_x: float,
        half_y: float,
        nu: float,
    ) -> None:
        positive(where, half_x=half_x, half_y=half_y)
        not_negative(where, z=z)
        elastic(where, 1.0, nu)
        px, py, self.z = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (x, y, z)))
        on_edge = (np.abs(px) == half_x) | (np.abs(py) == half_y)
        require(
            ~(on_edge & (self.z == 0.0)),
            where,
            "stresses on the edges of the rectangle are unbounded or not one value",
            "take points beside them or below the surface",
        )
        self.corners = []
        for sx in (1.0, -1.0):
            for sy in (1.0, -1.0):
                X, Y = px + sx * half_x, py + sy * half_y
                self.corners.append((sx * sy, X, Y, np.sqrt(X**2 + Y**2 + self.z**2)))

    def __call__(self, share: _Corner) -> FloatArray:
        out = np.zeros(self.z.shape)
        for sign, X, Y, rho in self.corners:
            out += sign * share(X, Y, self.z, rho)
        return out


def _tensor(scale: float, *components: FloatArray) -> FloatArray:
    """(..., 3, 3) from xx, yy, zz, xy, xz, yz times 2 pi."""
    out = np.empty((*components[0].shape, 3, 3))
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    for (i, j), component in zip(places, components, strict=True):
        out[..., i, j] = out[..., j, i] = component
    return scale / (2.0 * np.pi) * out


# Corner shares of the derivatives. Terms that are the same at both ends of an edge cancel in the
# sum and are left out, so that nothing is lost where rho + Y is small.


def _V_x(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return np.asarray(np.arcsinh(Y / np.hypot(X, z)))


def _V_y(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return _V_x(Y, X, z, rho)


def _V_z(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return np.asarray(-np.arctan2(X * Y, z * rho))


def _V_xx(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return -X * Y / (rho * (X**2 + z**2))


def _V_yy(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return _V_xx(Y, X, z, rho)


def _V_xy(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return 1.0 / rho


def _V_xz(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return -z * Y / (rho * (X**2 + z**2))


def _V_yz(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return _V_xz(Y, X, z, rho)


def _chi_xx(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    # atan(Y / X) - atan(z Y / (X rho)) in one angle
    return np.asarray(np.arctan2(X * Y * (rho - z), X**2 * rho + z * Y**2))


def _chi_yy(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return _chi_xx(Y, X, z, rho)


def _chi_xy(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return np.asarray(np.log(rho + z))


def _chi_xxx(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return Y / rho * (z / (X**2 + z**2) - 1.0 / (rho + z))


def _chi_xxy(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return X / (rho * (rho + z))


def _chi_xyy(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return Y / (rho * (rho + z))


def _omega_xxx(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return Y / (rho + z) - _V_x(X, Y, z, rho)


def _omega_xxy(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return -X / (rho + z)


def _omega_xyy(X: FloatArray, Y: FloatArray, z: FloatArray, rho: FloatArray) -> FloatArray:
    return -Y / (rho + z)
