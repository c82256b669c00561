"""The public blade-damper-blade problem with six dofs, shared by the benchmarks.

Two wedge contacts, variable normal load, lift-off.

Source: N. Balaji, "nonuniq" (public Octave scripts). SI units: the solver only needs consistent
ones.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.hbm import Contacts, FrequencyResponse, System, contacts, frequency_response

Array = NDArray[np.float64]
M = np.diag([1.0, 1, 1, 1, 0.1, 0.1])
C = np.diag([20.0] * 4 + [0, 0])
#: output: y of the second blade
Y2 = np.eye(6)[3]
STATIC = np.array([0, 0, 0, 0, 0, 120.0])
#: Re(F exp(i w t)) = sin(w t) [0 -20 5 0 0 0]
HARMONIC = -1j * np.array([0, -20, 5, 0, 0, 0])
SWEEP = (145.0, 235.0)
#: answers of an independent implementation with 15 harmonics: peak (Hz, m), and points Hz -> m
PEAK = (162.96, 2.2733e-4)
POINTS = {150.0: 2.7919e-5, 160.0: 2.0006e-4, 165.0: 1.5215e-4, 200.0: 3.2477e-5}


def stiffness() -> Array:
    """K (6, 6): ground springs, x-y coupling in each blade, coupling between the blades, damper."""
    K = np.diag([3e5] * 4 + [0, 0])
    for i, j, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
        K[np.ix_([i, j], [i, j])] += k * np.array([[1, -1], [-1, 1]])
    return K


def wedge() -> Contacts:
    """Both contacts, faces at 30 degrees."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    normal = [[s, -c, 0, 0, -s, c], [0, 0, -s, -c, s, c]]
    tangent = [[[-c, -s, 0, 0, c, s], [0, 0, -c, s, c, -s]]]
    return contacts(normal, tangent, k_n=3e5, k_t=3e5, mu=0.5)


def response(
    frequencies: Any, highest: int, samples: int, start: Any = "zero"
) -> FrequencyResponse:
    """The curve at the frequencies in Hz with the harmonics 0 to `highest`."""
    return frequency_response(
        System(
            (M, C, stiffness()),
            wedge(),
            static_force=STATIC,
            harmonics=range(highest + 1),
            samples=samples,
            start=start,
        ),
        harmonic_force=HARMONIC,
        frequencies=frequencies,
    )
