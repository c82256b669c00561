r"""Which blades are excited, how strongly, in which phase and harmonics of the frequency.

Every force acts along x at mid-core of its blade,

    F(t) = F_E Re( sum_k a_k exp(i k omega t) ),

with the amplitudes a_k relative to F_E. What is read from an answer, its accelerance, is the
acceleration in the lowest harmonic that is excited, per newton of F_E.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.scene.forced import ExcitationChoice, combined_forces
from upd.scene.forced_contact import SIDES, Side

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Excitation:
    """Forces relative to F_E, H harmonics at L blades.

    Attributes
    ----------
    blades
        (L,) those excited, the left one first.
    drive
        (L, H) complex amplitudes of harmonics 1 to H over F_E.
    """

    blades: tuple[Side, ...]
    drive: ComplexArray

    @property
    def harmonics(self) -> tuple[int, ...]:
        """Those excited, rising."""
        return tuple(int(k) + 1 for k in np.flatnonzero(np.any(self.drive != 0.0, axis=0)))

    @property
    def lowest(self) -> int:
        """The harmonic that is read from an answer."""
        return self.harmonics[0]

    @property
    def read(self) -> ComplexArray:
        """(L,) amplitudes of the lowest harmonic over F_E."""
        return np.asarray(self.drive[:, self.lowest - 1])

    @property
    def at_start(self) -> NDArray[np.float64]:
        """(L,) forces at t = 0 over F_E."""
        return np.asarray(self.drive.real.sum(axis=1))

    @property
    def free_blades(self) -> tuple[Side, ...]:
        """Those that move without a damper, in the harmonic that is read."""
        return tuple(side for side, a in zip(self.blades, self.read, strict=True) if a != 0.0)

    @property
    def usual(self) -> bool:
        """Whether F_E on the right blade is all of it."""
        return self.blades == ("right",) and self.drive.tolist() == [[1.0]]

    @property
    def words(self) -> str:
        """The forces along x at mid-core: "F_E on the right blade, 0.5 F_E at 180 deg on the left
        blade".
        """
        parts = []
        for k in self.harmonics:
            for side, a in zip(reversed(self.blades), self.drive[::-1, k - 1], strict=True):
                size, phase = abs(a), round(math.degrees(cmath.phase(a)), 6)
                if size:
                    times = "" if math.isclose(size, 1.0) else f"{size:.4g} "
                    at = f" at {phase + 0.0:g} deg" if phase else ""
                    of = f" in harmonic {k}" if self.harmonics != (1,) else ""
                    parts.append(f"{times}F_E{at} on the {side} blade{of}")
        return ", ".join(parts)


def excitation_of(choice: ExcitationChoice) -> Excitation:
    """The forces of a scene, those of one blade and harmonic added up."""
    found = combined_forces(choice)
    blades = tuple(side for side in SIDES if any(blade == side for blade, _ in found))
    drive = np.zeros((len(blades), max(harmonic for _, harmonic in found)), complex)
    for (blade, harmonic), amplitude in found.items():
        drive[blades.index(blade), harmonic - 1] = amplitude
    return Excitation(blades, drive)
