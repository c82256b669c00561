"""A measured response: accelerance of one blade over frequency."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError
from upd.labels import Shown
from upd.mesh import FloatArray
from upd.units import UNITS, unit_factor

ComplexArray = NDArray[np.complex128]
Blade = Literal["left", "right"]
#: "free" without the damper, "stuck" with every contact point sticking
State = Literal["free", "stuck"]
#: kinds of response -> power of i omega that makes it an acceleration, factor from the inner unit
#: of `upd.units.UNITS` to (m/s2)/N
TO_ACCELERANCE = {"accelerance": (0, 1.0), "mobility": (1, 1e-3), "receptance": (2, 1e-3)}
QUANTITIES = tuple(TO_ACCELERANCE)
#: fewest points of a curve: a peak and both its sides
LEAST_POINTS = 3


@dataclass(frozen=True, repr=False)
class MeasuredCurve(Shown):
    """A measured frequency response, whichever way its file gave it.

    Attributes
    ----------
    frequency : (n,) ndarray
        Hz, rising.
    accelerance : (n,) ndarray
        (m/s2)/N; complex, or real magnitudes.
    blade : {"right", "left"}
        Whose acceleration along x it is, per newton of F_E.
    state : {"free", "stuck"} or None
        A linear limit it was measured in.
    force_ratio : float or None
        F_C/F_E of a curve with friction.
    quantity, unit : str
        As measured: "accelerance", "mobility" or "receptance", and its unit.
    source : Path
        The file.
    """

    frequency: FloatArray
    accelerance: ComplexArray | FloatArray
    blade: Blade = "right"
    state: State | None = None
    force_ratio: float | None = None
    quantity: str = "accelerance"
    unit: str = "(m/s2)/N"
    source: Path = Path()

    @property
    def is_complex(self) -> bool:
        """Whether the phase was measured."""
        return bool(np.iscomplexobj(self.accelerance))

    @property
    def magnitude(self) -> FloatArray:
        """(n,) modulus, (m/s2)/N."""
        return np.asarray(np.abs(self.accelerance), dtype=np.float64)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz."""
        return float(self.frequency[0]), float(self.frequency[-1])


def as_accelerance(
    frequency: FloatArray, values: ComplexArray | FloatArray, unit: str
) -> tuple[ComplexArray | FloatArray, str]:
    """Measured values in (m/s2)/N, and what they were.

    a = i omega v = (i omega)^2 x; of magnitudes the modulus of that.

    Parameters
    ----------
    frequency : (n,) ndarray
        Hz.
    values : (n,) ndarray
        Complex or magnitudes, in ``unit``.
    unit : str
        Of accelerance, mobility or receptance; it gives which.

    Returns
    -------
    accelerance : (n,) ndarray
        Complex where the values are.
    quantity : str

    Raises
    ------
    InputError
        For a unit of something else.

    References
    ----------
    D. J. Ewins, Modal Testing: Theory, Practice and Application, 2nd ed. (2000), 2.2.
    """
    quantity, factor = unit_factor(unit, QUANTITIES)
    power, to_m = TO_ACCELERANCE[quantity]
    omega = 2.0 * np.pi * frequency
    turn = (1j * omega) ** power if np.iscomplexobj(values) else omega**power
    return factor * to_m * turn * values, quantity


def response_unit(own: str, given: str | None) -> str:
    """The unit of a response: the file's own, or the one given beside a file that has none.

    Parameters
    ----------
    own
        As the file has it, "" where it has none.
    given
        By the caller or the scene.

    Raises
    ------
    InputError
        For decibels, for a unit of something else, and where both give different units.
    """
    if own.casefold().startswith("db"):
        raise InputError("values in dB are not read; give linear ones, with their unit")
    unit = given or own
    mine = unit_factor(unit, QUANTITIES)
    if given and own and (own not in UNITS[mine[0]] or unit_factor(own, QUANTITIES) != mine):
        raise InputError(
            f"the file gives its unit, {own!r}, but unit = {given!r}; remove unit, or correct "
            "the file"
        )
    return unit


def checked_curve(frequency: FloatArray) -> list[tuple[int, str]]:
    """What is wrong with the frequencies (n,) of a curve: (number of the point, words)."""
    found = [
        (k, f"{f:g} Hz is not a frequency above 0") for k, f in enumerate(frequency) if not f > 0.0
    ]
    step = np.diff(frequency)
    rising = np.median(step) > 0.0 if len(step) else True
    wrong = np.flatnonzero(step <= 0.0 if rising else step >= 0.0)
    way = "rises" if rising else "falls"
    found += [
        (
            int(k) + 1,
            f"{frequency[k + 1]:g} Hz comes after {frequency[k]:g} Hz, where the frequency {way}: "
            "sort the lines and leave out doubled ones",
        )
        for k in wrong
    ]
    return sorted(found)


def the_one(names: list[str], wanted: str | None, word: str) -> str:
    """The response that is meant among those a file holds.

    Parameters
    ----------
    names
        Those there are.
    wanted
        The one asked for; None: the only one.
    word
        What they are called: "columns", "variables".

    Raises
    ------
    InputError
        Where it is not there, or where several are and none is named.
    """
    if wanted is not None:
        if wanted in names:
            return wanted
        raise InputError(f"no response {wanted!r} among the {word} ({', '.join(names) or 'none'})")
    if len(names) == 1:
        return names[0]
    if not names:
        raise InputError(
            f"no response among the {word}; name it with its unit, for example "
            '"accelerance [(m/s2)/N]"'
        )
    raise InputError(f"{len(names)} responses, {', '.join(names)}; name one by column = ...")
