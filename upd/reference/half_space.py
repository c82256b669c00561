"""Elastic half-space z >= 0 under surface loads.

Point loads, rectangles, and the compliance of a lattice of nodes. Units: mm, N, MPa. x, y lie in
the surface, z points into the body; a positive P or pressure presses along +z, tension is positive.

Stresses under rectangles: with the potentials of the loaded rectangle V = int 1/rho,
chi = int ln(rho + z) and Omega = int [z ln(rho + z) - rho] they are derivatives of these three
([2]_ for the pressure, [1]_, eqs (3.7) to (3.9), for the traction). Every derivative needed is a
closed form at the four corners, X = x -+ half_x, Y = y -+ half_y, summed with alternating sign.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, chapter 3.
.. [2] A. E. H. Love, Phil. Trans. R. Soc. A 228, 1929, 377.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.reference._checks import FloatArray, elastic, not_negative, positive, require


def boussinesq(
    x: ArrayLike, y: ArrayLike, z: ArrayLike, P: float, E: float, nu: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Displacements under the normal point load P at the origin.

    Parameters
    ----------
    x, y, z : array_like
        Positions in mm that broadcast, z >= 0.
    P : float
        N.
    E, nu : float
        MPa and Poisson ratio.

    Returns
    -------
    u_x, u_y, u_z : float or ndarray
        mm.

    Raises
    ------
    InputError
        Above the surface and at the load.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.18).

    Examples
    --------
    >>> from upd.reference import boussinesq
    >>> u_x, u_y, u_z = boussinesq(0.0, 0.0, 1.0, P=100.0, E=200e3, nu=0.3)
    >>> print(f"{u_z:.4e} mm")
    2.4828e-04 mm
    """
    X, Y, Z, rho = _points("boussinesq", x, y, z, E, nu)
    scale = P * (1 + nu) / (2 * np.pi * E)
    radial = Z / rho**3 - (1 - 2 * nu) / (rho * (rho + Z))
    return scale * X * radial, scale * Y * radial, scale * (Z**2 / rho**3 + 2 * (1 - nu) / rho)


def cerruti(
    x: ArrayLike, y: ArrayLike, z: ArrayLike, Q: float, E: float, nu: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Displacements under the tangential point load Q along +x at the origin.

    Parameters
    ----------
    x, y, z : array_like
        Positions in mm that broadcast, z >= 0.
    Q : float
        N.
    E, nu : float
        MPa and Poisson ratio.

    Returns
    -------
    u_x, u_y, u_z : float or ndarray
        mm.

    Raises
    ------
    InputError
        Above the surface and at the load.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.75).

    Examples
    --------
    >>> from upd.reference import cerruti
    >>> u_x, u_y, u_z = cerruti(1.0, 0.0, 0.0, Q=100.0, E=200e3, nu=0.3)
    >>> print(f"{u_x:.4e} mm, {u_z:.4e} mm")
    2.0690e-04 mm, 4.1380e-05 mm
    """
    X, Y, Z, rho = _points("cerruti", x, y, z, E, nu)
    scale = Q * (1 + nu) / (2 * np.pi * E)
    bulk = 1 - 2 * nu
    mixed = 1 / rho**3 - bulk / (rho * (rho + Z) ** 2)
    u_x = scale * (1 / rho + bulk / (rho + Z) + X**2 * mixed)
    return u_x, scale * X * Y * mixed, scale * X * (Z / rho**3 + bulk / (rho * (rho + Z)))


def boussinesq_stress(x: ArrayLike, y: ArrayLike, z: ArrayLike, P: float, nu: float) -> FloatArray:
    """Stresses under the normal point load P at the origin.

    Parameters
    ----------
    x, y, z : array_like
        Positions in mm that broadcast, z >= 0.
    P : float
        N.
    nu : float
        Poisson ratio.

    Returns
    -------
    (..., 3, 3) ndarray
        MPa, tension positive.

    Raises
    ------
    InputError
        Above the surface and at the load.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.19), in Cartesian components.

    Examples
    --------
    >>> from upd.reference import boussinesq_stress
    >>> print(f"{boussinesq_stress(0.0, 0.0, 1.0, P=100.0, nu=0.3)[2, 2]:.3f} MPa")
    -47.746 MPa
    """
    X, Y, Z, rho = np.broadcast_arrays(*_points("boussinesq_stress", x, y, z, 1.0, nu))
    bulk, far = 1 - 2 * nu, 3 * Z / rho**5
    # sigma_r - sigma_theta and sigma_theta, with r^2 divided out: finite on the axis
    turning = bulk * (2 * rho + Z) / (rho**3 * (rho + Z) ** 2)
    hoop = bulk * (Z / rho**3 - 1 / (rho * (rho + Z)))
    out = np.empty((*rho.shape, 3, 3))
    for i, j, a, b in ((0, 0, X, X), (1, 1, Y, Y), (0, 1, X, Y)):
        out[..., i, j] = out[..., j, i] = a * b * (turning - far) + (hoop if i == j else 0.0)
    for i, a in enumerate((X, Y, Z)):
        out[..., i, 2] = out[..., 2, i] = -far * Z * a
    return P / (2 * np.pi) * out


def cerruti_stress(x: ArrayLike, y: ArrayLike, z: ArrayLike, Q: float, nu: float) -> FloatArray:
    """Stresses under the tangential point load Q along +x at the origin.

    Parameters
    ----------
    x, y, z : array_like
        Positions in mm that broadcast, z >= 0.
    Q : float
        N.
    nu : float
        Poisson ratio.

    Returns
    -------
    (..., 3, 3) ndarray
        MPa, tension positive.

    Raises
    ------
    InputError
        Above the surface and at the load.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.76).

    Examples
    --------
    >>> from upd.reference import cerruti_stress
    >>> print(f"{cerruti_stress(1.0, 0.0, 0.0, Q=100.0, nu=0.3)[0, 0]:.3f} MPa")
    -41.380 MPa
    """
    X, Y, Z, rho = np.broadcast_arrays(*_points("cerruti_stress", x, y, z, 1.0, nu))
    bulk, deep = 1 - 2 * nu, rho + Z
    near = bulk * (1 / (rho**3 * deep**2) + 2 / (rho**2 * deep**3))
    once = bulk / (rho * deep**2)
    far = 3 / rho**5
    out = np.empty((*rho.shape, 3, 3))
    out[..., 0, 0] = X * (X**2 * (near - far) + bulk / rho**3 - 3 * once)
    out[..., 1, 1] = X * (Y**2 * (near - far) + bulk / rho**3 - once)
    out[..., 0, 1] = out[..., 1, 0] = Y * (X**2 * (near - far) - once)
    for i, a in enumerate((X, Y, Z)):
        out[..., i, 2] = out[..., 2, i] = -far * X * Z * a
    return Q / (2 * np.pi) * out


def love_rectangle(
    x: ArrayLike, y: ArrayLike, half_x: float, half_y: float, p: float, E: float, nu: float
) -> FloatArray:
    """Surface displacement u_z of a uniform pressure on a rectangle.

    Parameters
    ----------
    x, y : array_like
        Positions in mm that broadcast.
    half_x, half_y : float
        The pressure acts on abs(x) <= half_x, abs(y) <= half_y, mm.
    p : float
        MPa.
    E, nu : float
        MPa and Poisson ratio.

    Returns
    -------
    float or ndarray
        mm.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.25).

    Examples
    --------
    >>> from upd.reference import love_rectangle
    >>> print(f"{love_rectangle(0.0, 0.0, 1.0, 1.0, p=100.0, E=200e3, nu=0.3):.4e} mm")
    1.0212e-03 mm
    """
    along, across, _ = _rectangle("love_rectangle", x, y, half_x, half_y, E, nu)
    return p * (1 - nu**2) / (np.pi * E) * (along + across)


def cerruti_rectangle(
    x: ArrayLike, y: ArrayLike, half_x: float, half_y: float, q: float, E: float, nu: float
) -> tuple[FloatArray, FloatArray]:
    """Surface displacements of a uniform traction along +x on a rectangle.

    Johnson's point load at z = 0, that is [(1 - nu)/r + nu x^2/r^3, nu x y/r^3] / (2 pi G),
    integrated over the rectangle.

    Parameters
    ----------
    x, y : array_like
        Positions in mm that broadcast.
    half_x, half_y : float
        The traction acts on abs(x) <= half_x, abs(y) <= half_y, mm.
    q : float
        MPa.
    E, nu : float
        MPa and Poisson ratio.

    Returns
    -------
    u_x, u_y : float or ndarray
        mm.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.75).

    Examples
    --------
    >>> from upd.reference import cerruti_rectangle
    >>> u_x, u_y = cerruti_rectangle(0.0, 0.0, 1.0, 1.0, q=100.0, E=200e3, nu=0.3)
    >>> print(f"{u_x:.4e} mm")
    1.2400e-03 mm
    """
    along, across, mixed = _rectangle("cerruti_rectangle", x, y, half_x, half_y, E, nu)
    scale = q * (1 + nu) / (np.pi * E)
    return scale * ((1 - nu) * across + along), scale * nu * mixed


def pressure_shift_rectangle(
    x: ArrayLike, y: ArrayLike, half_x: float, half_y: float, p: float, E: float, nu: float
) -> tuple[FloatArray, FloatArray]:
    """Surface displacements along the surface of a uniform pressure on a rectangle.

    Johnson's point load at z = 0, -(1 - 2 nu)/(4 pi G) [x, y]/r^2 towards the load, integrated over
    the rectangle. Nothing for nu = 1/2.

    Parameters
    ----------
    x, y : array_like
        Positions in mm that broadcast, off the rectangle's corners.
    half_x, half_y : float
        The pressure acts on abs(x) <= half_x, abs(y) <= half_y, mm.
    p : float
        MPa.
    E, nu : float
        MPa and Poisson ratio.

    Returns
    -------
    u_x, u_y : float or ndarray
        mm.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.18).

    Examples
    --------
    >>> from upd.reference import pressure_shift_rectangle
    >>> u_x, u_y = pressure_shift_rectangle(2.0, 0.0, 1.0, 1.0, p=100.0, E=200e3, nu=0.3)
    >>> print(f"{u_x:.4e} mm, {u_y:.1f}")
    -8.1484e-05 mm, -0.0
    """
    where = "pressure_shift_rectangle"
    elastic(where, E, nu)
    positive(where, half_x=half_x, half_y=half_y)
    X, Y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    along = across = np.zeros(np.broadcast_shapes(X.shape, Y.shape))
    for sx in (1, -1):
        for sy in (1, -1):
            u, v, sign = X + sx * half_x, Y + sy * half_y, sx * sy
            along = along + sign * _primitive(u, v)
            across = across + sign * _primitive(v, u)
    scale = -p * (1 - 2 * nu) * (1 + nu) / (2 * np.pi * E)
    return scale * along[()], scale * across[()]


def half_space_compliance(
    nx: int,
    ny: int,
    dx: float,
    dy: float,
    E: float,
    nu: float,
    component: Literal["normal", "tangential", "both", "all"] = "normal",
) -> FloatArray:
    """Displacement of every lattice node per unit force on every node.

    A force is spread evenly over its dx by dy cell. Symmetric positive definite; one body: add two
    of them for a contact.

    Parameters
    ----------
    nx, ny : int
        Nodes of the lattice; node i + nx*j is at (i dx, j dy).
    dx, dy : float
        mm.
    E, nu : float
        MPa and Poisson ratio.
    component : {"normal", "tangential", "both", "all"}, default "normal"
        z from z, x from x, both x and y from both, or z, x and y from all (z into the body; the
        coupling of z with x and y changes sign for the body on the other side).

    Returns
    -------
    (n, n) ndarray
        mm/N, n = nx ny; for "both" (2 n, 2 n), layout [x..., y...]; for "all" (3 n, 3 n), layout
        [z..., x..., y...].

    Raises
    ------
    InputError
        For an empty lattice or an unknown component.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, sections 3.3 and 3.6.

    Examples
    --------
    >>> from upd.reference import half_space_compliance
    >>> C = half_space_compliance(2, 1, dx=1.0, dy=1.0, E=200e3, nu=0.3)
    >>> (1e6 * C).round(3).tolist()
    [[5.106, 1.503], [1.503, 5.106]]
    """
    where = "half_space_compliance"
    positive(where, nx=nx, ny=ny, dx=dx, dy=dy)
    X, Y = np.meshgrid(np.arange(nx) * dx, np.arange(ny) * dy)
    half = (dx / 2, dy / 2)
    unit = 1 / (dx * dy)
    i, j = np.tile(np.arange(nx), ny), np.repeat(np.arange(ny), nx)
    di, dj = i[:, None] - i[None, :], j[:, None] - j[None, :]
    # offsets by absolute value, signs put back afterwards: symmetric to the last bit
    cell = (np.abs(dj), np.abs(di))
    if component == "normal":
        u_zz = love_rectangle(X, Y, *half, unit, E, nu)[cell]
        return np.asarray(u_zz)
    u_xx, u_xy = cerruti_rectangle(X, Y, *half, unit, E, nu)
    if component == "tangential":
        return np.asarray(u_xx[cell])
    if component not in ("both", "all"):
        raise InputError(
            f'{where}: unknown component "{component}"; take "normal", "tangential", "both" or '
            '"all"'
        )
    u_yy = cerruti_rectangle(Y, X, dy / 2, dx / 2, unit, E, nu)[0]
    cross = u_xy[cell] * np.sign(di) * np.sign(dj)
    both = np.block([[u_xx[cell], cross], [cross, u_yy[cell]]])
    if component == "both":
        return both
    u_zz = love_rectangle(X, Y, *half, unit, E, nu)[cell]
    u_xz, u_yz = pressure_shift_rectangle(X, Y, *half, unit, E, nu)
    from_z = np.vstack((u_xz[cell] * np.sign(di), u_yz[cell] * np.sign(dj)))
    return np.block([[u_zz, from_z.T], [from_z, both]])


def _points(
    where: str, x: ArrayLike, y: ArrayLike, z: ArrayLike, E: float, nu: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    elastic(where, E, nu)
    not_negative(where, z=z)
    X, Y, Z = (np.asarray(v, dtype=float)[()] for v in (x, y, z))
    rho = np.sqrt(X**2 + Y**2 + Z**2)
    require(
        rho > 0,
        where,
        "a point lies at the load",
        "the displacement is infinite there: spread the load over a rectangle",
    )
    return X, Y, Z, rho


def _rectangle(
    where: str, x: ArrayLike, y: ArrayLike, half_x: float, half_y: float, E: float, nu: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Integrals of X^2/R^3, Y^2/R^3 and X Y/R^3 over the rectangle, (X, Y) from it to the point.

    The first two add up to 1/R's.
    """
    elastic(where, E, nu)
    positive(where, half_x=half_x, half_y=half_y)
    X, Y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    along = across = mixed = np.zeros(np.broadcast_shapes(X.shape, Y.shape))
    for sx in (1, -1):
        for sy in (1, -1):
            u, v, sign = X + sx * half_x, Y + sy * half_y, sx * sy
            along = along + sign * _x_asinh(v, u)
            across = across + sign * _x_asinh(u, v)
            mixed = mixed - sign * np.hypot(u, v)
    return along[()], across[()], mixed[()]


def _x_asinh(u: FloatArray, v: FloatArray) -> FloatArray:
    """u asinh(v/|u|), zero at u = 0; its mixed derivative is v^2/(u^2 + v^2)^(3/2)."""
    U, V = np.broadcast_arrays(u, v)
    size = np.abs(U)
    inside = size > np.abs(V) * np.finfo(float).tiny
    result: FloatArray = U * np.arcsinh(np.divide(V, size, out=np.zeros(U.shape), where=inside))
    return result


def _primitive(u: FloatArray, v: FloatArray) -> FloatArray:
    """v ln sqrt(u^2 + v^2) + u atan(v/u); its mixed derivative is u/(u^2 + v^2)."""
    U, V = np.broadcast_arrays(u, v)
    angle = np.arctan(np.divide(V, U, out=np.zeros(U.shape), where=U != 0.0))
    size = np.hypot(U, V)
    log = np.log(size, out=np.zeros(U.shape), where=size > 0.0)
    result: FloatArray = V * log + U * angle
    return result


# -- stresses under rectangles ---------------------------------------------------------------------


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
