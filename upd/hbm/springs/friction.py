"""Contact with Coulomb friction at points: force and exact discrete Jacobian of a periodic motion.

One point: relative displacement w = (w_n, w_t1, w_t2), w_n > 0 closing;
N = max(0, N_0 + k_n (w_n - gap)); the traction is that of a spring k_t in series with a slider
that holds up to mu N in any direction of the plane. The force opposes closing and sliding. Both
come from one compiled march through the period, exact for a motion that is straight between the
samples: see `upd.hbm.springs.interval` for what happens between them.

References
----------
Return mapping as in plasticity: J. C. Simo and T. J. R. Hughes, Computational Inelasticity
(1998), 1.4. Friction in three dimensions with variable normal load: C. Siewert et al., J. Eng.
Gas Turbines Power 132 (2010) 082501.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.hbm.springs.period import GIVEN, LOWER, MID, UPPER, march_points
from upd.labels import Shown

FloatArray = NDArray[np.float64]
Start = Literal["zero", "frictionless", "static", "mid", "upper", "lower"]

START_CODE = {"zero": GIVEN, "static": GIVEN, "mid": MID, "upper": UPPER, "lower": LOWER}
#: Friction in one direction forgets its start within one period; in two directions the memory fades
#: geometrically while it slips.
MOST_PERIODS = 40


@dataclass(frozen=True, repr=False)
class Law(Shown):
    """Parameters of the contact points.

    The law itself is in `upd.hbm.springs.coulomb`, shared by harmonic balance and time
    integration, and its closed form over a straight piece of the motion in
    `upd.hbm.springs.interval`. To add a law:

    1. write its step beside `coulomb`, with the same arguments and results: the new force, its
       derivative by the trial force (P11, P12, P22), the derivative by the limit (n1, n2) and the
       state (STICK, SLIP, LIFT);
    2. write what it does over an interval beside `friction_event`, with the same arguments and
       results;
    3. give `Law` the parameters it needs and a number that chooses it, and branch on that number in
       `step` and in `upd.hbm.springs.period`;
    4. add the law to the tests of the Jacobian in tests/property/test_hbm_property.py and of the
       order in tests/analytic/test_hbm_friction.py.

    Nothing else knows how the force comes about.

    Attributes
    ----------
    k_n, k_t : (n_point,) ndarray
        Normal and tangential stiffness [N/mm].
    mu : (n_point,) ndarray
        Friction coefficient.
    preload : (n_point,) ndarray
        N_0 [N].
    gap : (n_point,) ndarray
        Gap [mm].
    """

    k_n: FloatArray
    k_t: FloatArray
    mu: FloatArray
    preload: FloatArray
    gap: FloatArray

    @cached_property
    def arrays(self) -> tuple[FloatArray, ...]:
        """Its arrays in the order of its fields, as compiled code takes them."""
        return tuple(getattr(self, f.name) for f in fields(self))

    def tiled(self, n: int) -> Law:
        """The same points n times over."""
        return Law(*(np.tile(one, n) for one in self.arrays))


@dataclass(frozen=True)
class March:
    """One period of the contact force, n samples.

    Attributes
    ----------
    force : (n_point, 1 + d, n) ndarray
        Normal force and tractions [N].
    weighed : (n_point, 1 + d, n) ndarray
        The same with the corners between the samples, which its coefficients are taken from [N].
    state : (n_point, n) ndarray of int8
        STICK, SLIP or LIFT.
    periodic : (n_point,) ndarray of bool
        Whether each point came back to its start.
    periods : (n_point,) ndarray of int
        The periods it took.
    """

    force: FloatArray
    weighed: FloatArray
    state: NDArray[np.int8]
    periodic: NDArray[np.bool_]
    periods: NDArray[np.int64]

    def coefficients(self, Q: FloatArray) -> FloatArray:
        """Coefficients of the force.

        Parameters
        ----------
        Q : (size, n) ndarray
            Analysis matrix of the samples, see `upd.hbm.core.fourier.analysis`.

        Returns
        -------
        (..., 1 + d, size) ndarray
            Coefficients [N].
        """
        return self.weighed @ Q.T


def march(
    law: Law,
    w: FloatArray,
    E: FloatArray,
    *,
    start: Start = "zero",
    slider: FloatArray | None = None,
    most: int = MOST_PERIODS,
) -> March:
    """Periodic contact force of all points along a motion.

    Parameters
    ----------
    law : Law
    w : (n_point, 1 + d, n) ndarray
        Relative displacements [mm] at n samples, d = 0, 1 or 2 tangents.
    E : (n, size) ndarray
        Synthesis matrix of the samples, see `upd.hbm.core.fourier.synthesis`.
    start : {"zero", "static", "mid", "upper", "lower"}
        Position of the sliders before the march: zero, given positions, the middle of the stuck
        interval, or the traction at its upper or lower end along the first tangent.
    slider : (n_point, 2) ndarray, optional
        Slider positions [mm] before the march for start "zero" (not given) and "static".
    most : int
        Periods at most.

    Returns
    -------
    March
    """
    n_point, rows, n = w.shape
    force, weighed = np.zeros((n_point, rows, n)), np.zeros((n_point, rows, n))
    state = np.zeros((n_point, n), dtype=np.int8)
    periodic, periods = np.zeros(n_point, dtype=np.bool_), np.zeros(n_point, dtype=np.int64)
    begin = (START_CODE[start], np.zeros((n_point, 2)) if slider is None else slider, most)
    slope, tangent = np.zeros((n_point, 3, n)), np.zeros((1, 0, 0, 0))
    filled = (force, weighed, state, slope, tangent)
    march_points(w, E, law.arrays, begin, False, filled, periodic, periods)
    return March(force, weighed, state, periodic, periods)
