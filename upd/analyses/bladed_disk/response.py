"""Response of a bladed disk to an engine order, with a wedge in every gap between its platforms.

The wedge is a rigid body on contact points at both platforms. The centrifugal force presses it
outwards; both faces lean towards the radius in the middle of the gap. It starts without mean
friction. Where all points slip, they forget, and what pushes the wedge along the axis in the mean
over a cycle has no answer but that of its guide, a pin or the end walls of its pocket: without a
guide it walks off, and curves under a high load stop where it begins to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.hbm import (
    Contacts,
    FrequencyResponse,
    RigidDamper,
    System,
    contact_rows,
    contacts,
    rigid_damper,
    travelling_wave_response,
)
from upd.hbm.springs.peak import climb
from upd.hbm.springs.response import parabola
from upd.hbm.springs.sweep import newton
from upd.linalg.parallel import in_parallel
from upd.linalg.select import threads
from upd.reduction.cyclic import ReducedSector, turn

FloatArray = NDArray[np.float64]


class Wedge(NamedTuple):
    """A damper between two platforms.

    Attributes
    ----------
    mass : float
        t
    inertia : (3,) array_like
        About its centre: radial, tangential, axial [t mm2].
    radius : float
        Of its centre [mm].
    angle : float
        Between the normal of a face and the radius [deg].
    k_n, k_t : float
        Stiffness of all points of a face [N/mm].
    mu : float
    guide : float
        Stiffness of what holds it along the axis [N/mm].
    """

    mass: float
    inertia: ArrayLike
    radius: float
    angle: float
    k_n: float
    k_t: float
    mu: float
    guide: float = 0.0


def gap_of(
    sector: ReducedSector, wedge: Wedge, f_c: float
) -> tuple[Contacts, RigidDamper, FloatArray]:
    """The contacts of a wedge under a centrifugal force.

    Parameters
    ----------
    sector : ReducedSector
        Of any nodal diameter.
    wedge : Wedge
    f_c : float
        [N]

    Returns
    -------
    Contacts, RigidDamper, ndarray
        Points, body and its rows, on the coordinates of both sectors beside the gap.
    """
    p, r = len(sector.high), sector.K.shape[0]
    ends = [one.mean(axis=0) for one in (sector.high, sector.low)]
    # half way between both platforms
    middle = np.mean([np.arctan2(end[1], end[0]) for end in ends])
    own = turn(float(middle))
    radial, across, axial = own.T
    centre = wedge.radius * radial + np.mean([end[2] for end in ends]) * axial
    damper = rigid_damper(
        wedge.mass,
        own * np.asarray(wedge.inertia) @ own.T,
        centre,
        f_c * radial,
        guide=(0.0, 0.0, wedge.guide, 0.0, 0.0, 0.0),
    )
    lean = np.radians(wedge.angle)
    normals = [np.cos(lean) * radial + side * np.sin(lean) * across for side in (-1.0, 1.0)]
    frames = [np.tile([n, axial, np.cross(n, axial)], (p, 1, 1)) for n in normals]
    rows = np.zeros((2 * p, 3, 2 * r))
    rows[:p, :, :r] = -frames[0] @ sector.B_high.reshape(p, 3, r)
    rows[p:, :, r:] = -frames[1] @ sector.B_low.reshape(p, 3, r)
    points = contacts(
        rows[:, 0],
        np.swapaxes(rows[:, 1:], 0, 1),
        k_n=wedge.k_n / p,
        k_t=wedge.k_t / p,
        mu=wedge.mu,
    )
    places = np.vstack([sector.high, sector.low])
    return points, damper, contact_rows(damper, places, np.concatenate(frames))


def wave_response(
    sectors: Mapping[int, ReducedSector],
    wedge: Wedge,
    f_c: float,
    *,
    force: ArrayLike,
    engine_order: int,
    frequencies: ArrayLike,
    harmonics: Iterable[int] = range(4),
    samples: int | None = None,
) -> FrequencyResponse:
    """The damped response; free and stuck ones are methods of the answer.

    Parameters
    ----------
    sectors : mapping
        Nodal diameter -> sector at one speed, of `upd.hbm.nodal_diameters`.
    wedge : Wedge
    f_c : float
        Its centrifugal force [N].
    force : (r,) array_like of complex
        Amplitude on the coordinates of sector 0 [N].
    engine_order : int
    frequencies : (n,) array_like
        Of the excitation [Hz].
    harmonics : iterable of int
    samples : int, optional
        Per period; by rule when None.

    Returns
    -------
    FrequencyResponse
        On the coordinates of sector 0, then the six of its wedge; see `on_sector`.
    """
    one = next(iter(sectors.values()))
    points, damper, rows = gap_of(one, wedge, f_c)
    return travelling_wave_response(
        System(
            {n: (s.M, s.C, s.K) for n, s in sectors.items()},
            points,
            harmonics=harmonics,
            samples=samples,
            damper=damper,
            damper_rows=rows,
            start="frictionless",
        ),
        n_sectors=one.n_sectors,
        engine_order=engine_order,
        harmonic_force=force,
        frequencies=frequencies,
    )


def on_sector(row: ArrayLike) -> FloatArray:
    """A row (r,) on the coordinates of a sector as one of its answers, zero on the wedge."""
    return np.append(np.asarray(row, dtype=float), np.zeros(6))


class WavePerformance(NamedTuple):
    """Highest amplitude over F_C/F_E, n values.

    Attributes
    ----------
    ratio : (n,) ndarray
        F_C/F_E.
    frequency : (n,) ndarray
        [Hz]
    height : (n,) ndarray
        Per unit of F_E [mm/N]; nan where no curve was found.
    """

    ratio: FloatArray
    frequency: FloatArray
    height: FloatArray

    @property
    def inside(self) -> bool:
        """Whether a peak between the first and the last ratio is the lowest."""
        found = np.isfinite(self.height)
        return bool(found.any() and 0 < np.nanargmin(self.height[found]) < found.sum() - 1)

    @property
    def best(self) -> tuple[float, float]:
        """F_C/F_E and height of the lowest peak, by a parabola of their logarithms."""
        found = np.isfinite(self.height)
        at, depth = parabola(np.log(self.ratio[found]), -np.log(self.height[found]))
        return float(np.exp(at)), float(np.exp(-depth))


def other_start(answer: FrequencyResponse, row: ArrayLike) -> float:
    """The peak with sliders that start in the middle of what they may hold.

    Points that partly stick keep the traction of their start: the change of the peak shows what
    that leaves open.

    Parameters
    ----------
    answer : FrequencyResponse
        Of `wave_response`.
    row : (r + 6,) array_like

    Returns
    -------
    float
        Amplitude [mm]; nan where none was found.
    """
    i = int(answer.amplitude(row).argmax())
    b, f = replace(answer.balance, start="mid", slider=None), float(answer.frequency[i])
    x = newton(b, answer.x[i], f)
    return float("nan") if x is None else climb(b, row, x, f).amplitude


def performance(
    solve: Callable[..., FrequencyResponse],
    f_c: float,
    ratios: ArrayLike,
    row: ArrayLike,
    force: ArrayLike,
) -> WavePerformance:
    """The peak over F_C/F_E at one centrifugal force, which scales the answer with the load.

    Parameters
    ----------
    solve : callable
        `wave_response` with all but its ``force``.
    f_c : float
        Centrifugal force of the wedge [N].
    ratios : (n,) array_like
        F_C over the excitation.
    row : (r,) array_like
        Weighs the coordinates of sector 0.
    force : (r,) array_like of complex
        Amplitude for F_E = 1 N.

    Returns
    -------
    WavePerformance
    """
    unit = np.asarray(force, dtype=complex)

    def peak(ratio: float) -> tuple[float, float, float]:
        answer = solve(force=f_c / ratio * unit)
        f, height = answer.peak(on_sector(row)) if answer.arrived else (np.nan, np.nan)
        return ratio, f, height * ratio / f_c

    jobs = [partial(peak, float(one)) for one in np.sort(np.asarray(ratios, dtype=float))]
    return WavePerformance(*np.array(in_parallel(jobs, threads())).T)
