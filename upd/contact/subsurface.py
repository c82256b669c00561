"""Von Mises stress below a contact, from its pressures and tractions on half-spaces.

Every cell between four nodes of the lattice carries the mean of its nodes' tractions, so that the
forces are those of the contact; the stresses of a cell are closed forms
(`upd.reference.love_rectangle_stress`, `cerruti_rectangle_stress`) and their sum over all cells is
a discrete convolution, one per depth. What a half-space leaves out: edges, other patches, the
body's bending, and stresses where it is held.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, sections 3.1, 3.6 and 7.1.
.. [2] I. A. Polonsky and L. M. Keer, Wear 231 (1999) 206, for the convolution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from upd.reference import cerruti_rectangle_stress, love_rectangle_stress, von_mises

Array = NDArray[np.float64]

#: neighbouring depths: half of the ratio moves a smooth maximum by less than a thousandth
_DEPTHS = 1.1
#: first depth below the surface, in cells; between it and the surface nothing is resolved
_SHALLOWEST = 0.25
#: cells along the contact radius of a closed form
_ALONG_RADIUS = 15
#: steps of a lattice are equal up to the rounding of a mesher
_EVEN = 1e-6


@dataclass(frozen=True)
class MostStressed:
    """Largest von Mises stress in a half-space.

    Attributes
    ----------
    value
        MPa.
    place
        (3,) x, y on the lattice and depth, mm.
    resolution
        Relative change of the value on cells twice as large: what the lattice leaves open.
    """

    value: float
    place: Array
    resolution: float


def most_stressed(x: Array, y: Array, tractions: Sequence[Array], nu: float) -> MostStressed:
    """The most stressed place of a half-space under a contact.

    Parameters
    ----------
    x, y : (nx,) and (ny,) ndarray
        Lattice lines, mm. Lines that are not evenly spaced are replaced by as many that are, with
        the tractions between them interpolated.
    tractions : sequence of (nx, ny) ndarray
        Nodal pressure, and, where there is friction, tractions on this body along x and y, MPa.
    nu : float
        Poisson ratio of the body.

    Returns
    -------
    MostStressed
    """
    x, y, fields = _even(x, y, tractions)
    # every cell has the mean of its four nodes
    cells = [0.25 * (f[1:, 1:] + f[1:, :-1] + f[:-1, 1:] + f[:-1, :-1]) for f in fields]
    found = _search(x, y, cells, nu)
    coarse = _search(*_paired(x, y, cells), nu)
    change = abs(coarse[0] / found[0] - 1.0) if found[0] > 0.0 else 0.0
    return MostStressed(found[0], found[1], change)


@cache
def partial_slip_ratio(friction: float, ratio: float, nu: float) -> float:
    """Largest von Mises stress over the largest pressure p0 under a sphere that is sheared.

    Hertz's pressure and Cattaneo's traction on a half-space, like materials: mu p less mu c/a times
    the same over the stuck circle, c/a = (1 - T / mu N)^(1/3). With 15 cells along the contact
    radius it is within 1 % below the surface; at the contact's edge, where sliding with friction
    above 0.3 stresses most, it is up to 6 % low (mu = 0.4; 3 % for 0.6).

    Parameters
    ----------
    friction
        mu.
    ratio
        T / (mu N), below 1.
    nu
        Poisson ratio of both bodies.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, sections 7.1 and 7.2.
    .. [2] G. M. Hamilton, Proc. Inst. Mech. Eng. 197C (1983) 53, for the sliding sphere.
    """
    lines = np.linspace(-1.0, 1.0, 2 * _ALONG_RADIUS + 1)
    r = np.hypot(*np.meshgrid(lines, lines, indexing="ij"))
    pressure = np.sqrt(np.maximum(0.0, 1.0 - r**2))
    c = float(np.cbrt(1.0 - ratio))
    traction = friction * (pressure - np.sqrt(np.maximum(0.0, c**2 - r**2)))
    return most_stressed(lines, lines, [pressure, traction, np.zeros_like(r)], nu).value


def _even(x: Array, y: Array, fields: Sequence[Array]) -> tuple[Array, Array, list[Array]]:
    """Lines and fields with equal steps."""
    given = [np.asarray(field, dtype=float) for field in fields]
    steps = [np.diff(lines) for lines in (x, y)]
    if all(np.ptp(step) <= _EVEN * step.max() for step in steps):
        return x, y, given
    X, Y = (np.linspace(lines[0], lines[-1], len(lines)) for lines in (x, y))
    at = np.stack(np.meshgrid(X, Y, indexing="ij"), axis=-1)
    return X, Y, [RegularGridInterpolator((x, y), field)(at) for field in given]


def _paired(x: Array, y: Array, cells: Sequence[Array]) -> tuple[Array, Array, list[Array]]:
    """Cells twice as large with the same forces; an odd last one is paired with an empty one."""
    wide = [v[0] + 2.0 * float(v[1] - v[0]) * np.arange(len(v) // 2 + 1) for v in (x, y)]
    out = []
    for cell in cells:
        n, m = cell.shape
        even = np.pad(cell, ((0, n % 2), (0, m % 2)))
        out.append(even.reshape((n + 1) // 2, 2, (m + 1) // 2, 2).mean(axis=(1, 3)))
    return wide[0], wide[1], out


def _search(x: Array, y: Array, cells: Sequence[Array], nu: float) -> tuple[float, Array]:
    """Largest von Mises stress over the middles of the loaded cells and the depths below them."""
    loaded = np.any([cell != 0.0 for cell in cells], axis=0)
    if not loaded.any():
        return 0.0, np.array([x[0], y[0], 0.0])
    rows, columns = (np.flatnonzero(loaded.any(axis=axis)) for axis in (1, 0))
    first, last = (rows[0], columns[0]), (rows[-1] + 1, columns[-1] + 1)
    inside = [cell[first[0] : last[0], first[1] : last[1]] for cell in cells]
    step = np.array([x[1] - x[0], y[1] - y[0]])
    n, m = inside[0].shape
    offsets = np.meshgrid(
        step[0] * np.arange(1 - n, n), step[1] * np.arange(1 - m, m), indexing="ij"
    )
    # The surface, and depths down to half the narrower width of the contact: the deepest maximum,
    # under a line contact of half width b, lies at 0.79 b (Johnson, section 4.2).
    top, width = _SHALLOWEST * float(step.min()), float((step * inside[0].shape).min())
    count = int(np.ceil(np.log(max(0.5 * width, float(step.min())) / top) / np.log(_DEPTHS))) + 1
    best, place = 0.0, np.zeros(3)
    for depth in (0.0, *(top * _DEPTHS ** np.arange(count))):
        stress = _stress(offsets, depth, 0.5 * step, inside, nu)
        values = von_mises(stress)
        i, j = np.unravel_index(int(values.argmax()), values.shape)
        if values[i, j] > best:
            best = float(values[i, j])
            corner = np.array([x[first[0]], y[first[1]]])
            place = np.array([*(corner + step * (np.array([i, j]) + 0.5)), depth])
    return best, place


def _stress(
    offsets: Sequence[Array], depth: float, half: Array, cells: Sequence[Array], nu: float
) -> Array:
    """Stress tensors (n, m, 3, 3) in MPa at the middles of the cells, at one depth."""
    # slow to import: only where it is called
    from scipy.signal import fftconvolve

    X, Y = offsets
    kernels = [love_rectangle_stress(X, Y, depth, half[0], half[1], 1.0, nu)]
    if len(cells) > 1:
        kernels.append(cerruti_rectangle_stress(X, Y, depth, half[0], half[1], 1.0, nu))
        # along y: the same with the axes exchanged
        turned = cerruti_rectangle_stress(Y, X, depth, half[1], half[0], 1.0, nu)
        swap = [1, 0, 2]
        kernels.append(turned[..., swap, :][..., swap])
    out = np.zeros((*cells[0].shape, 3, 3))
    for kernel, cell in zip(kernels, cells, strict=False):
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            part = fftconvolve(kernel[..., i, j], cell, mode="valid")
            out[..., i, j] += part
            if i != j:
                out[..., j, i] += part
    return out
