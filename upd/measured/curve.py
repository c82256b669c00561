"""A measured response: accelerance of one blade over frequency; which curve of a file it is, by the
blade, linear limit or F_C/F_E that the file itself gives; and what is wrong with a file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

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
RESPONSE_UNITS = tuple(unit for kind in QUANTITIES for unit in UNITS[kind])
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


@dataclass
class Faults:
    """All that is wrong with a file, each with its place."""

    found: list[str] = field(default_factory=list)

    def add(self, place: str, words: object) -> None:
        """A fault of a place, "line 3, column 2"."""
        self.found.append(f"{place}: {words}")

    @contextmanager
    def at(self, place: str) -> Iterator[None]:
        """Keep an InputError with its place."""
        try:
            yield
        except InputError as error:
            self.add(place, error)

    def check(self) -> None:
        """Raise InputError where something is wrong."""
        if self.found:
            raise InputError("\n".join(self.found))


def checked_curve(
    f: FloatArray,
    values: ComplexArray | FloatArray,
    unit: str,
    label: CurveLabel,
    faults: Faults,
    place: Callable[[str, int], str],
    remedy: str,
) -> MeasuredCurve:
    """A curve with rising frequencies, as the file has it or turned round.

    Parameters
    ----------
    f, values, unit
        Frequencies in Hz and the response, complex or magnitudes, in the order of the file; the
        unit of the response.
    label
        What the file gives of it.
    faults
        Gets what is wrong.
    place
        Of the frequency or the magnitude of a point, by its number.
    remedy
        What to give instead of negative magnitudes.

    Raises
    ------
    InputError
        Where frequencies do not rise or fall all the way from above 0, or magnitudes are negative.
    """
    step = np.diff(f)
    rising = np.median(step) > 0.0 if len(step) else True
    doubled = np.append(False, step <= 0.0 if rising else step >= 0.0)
    way = "rises" if rising else "falls"
    for k in range(len(f)):
        if not f[k] > 0.0:
            faults.add(place("frequency", k), f"{f[k]:g} Hz is not a frequency above 0")
        if doubled[k]:
            faults.add(
                place("frequency", k),
                f"{f[k]:g} Hz comes after {f[k - 1]:g} Hz, where the frequency {way}: sort the "
                "lines and leave out doubled ones",
            )
    if not np.iscomplexobj(values):
        for k in np.flatnonzero(values < 0.0).tolist():
            words = f"the magnitude {values[k]:g} is negative; give {remedy}"
            faults.add(place("magnitude", k), words)
    faults.check()
    turned = slice(None) if f[-1] > f[0] else slice(None, None, -1)
    H, quantity = as_accelerance(f[turned], values[turned], unit)
    blade = label.blade or "right"
    return MeasuredCurve(f[turned], H, blade, label.state, label.force_ratio, quantity, unit)


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


# -- which curve of a file -------------------------------------------------------------------------

#: names of a column, or of an attribute, that gives what a curve is -> what it gives
LABELS = {
    "blade": "blade",
    "state": "state",
    "f_c/f_e": "force_ratio",
    "fc/fe": "force_ratio",
    "centrifugal_to_force": "force_ratio",
    "force_ratio": "force_ratio",
}
_SHOWN = {"blade": "blade", "state": "state", "force_ratio": "F_C/F_E"}
_WORDS = {"blade": get_args(Blade), "state": get_args(State)}


@dataclass(frozen=True)
class CurveLabel:
    """What a curve of a file is, or which is asked for, each None where it is not given.

    Attributes
    ----------
    blade : {"right", "left"} or None
    state : {"free", "stuck"} or None
    force_ratio : float or None
        F_C/F_E.
    column : str or None
        Name of the response asked for, without its unit, where the file holds several; of a netCDF
        file the variable, its groups in front of it with a slash.
    unit : str or None
        Of the response asked for, where the file names none.
    """

    blade: Blade | None = None
    state: State | None = None
    force_ratio: float | None = None
    column: str | None = None
    unit: str | None = None

    @property
    def words(self) -> str:
        """As messages show it."""
        given = [(name, getattr(self, name)) for name in _SHOWN]
        return ", ".join(f"{_SHOWN[k]} {_shown(v)}" for k, v in given if v is not None)

    def agrees(self, wanted: CurveLabel) -> bool:
        """Whether nothing it gives is other than what is wanted.

        A linear limit and F_C/F_E exclude each other.
        """
        mine, other = (
            (one.blade, one.state if one.force_ratio is None else _shown(one.force_ratio))
            for one in (self, wanted)
        )
        return all(None in pair or pair[0] == pair[1] for pair in zip(mine, other, strict=True))


#: nothing given, nothing wanted
ANY = CurveLabel()


def _shown(value: Any) -> str:
    # as the labels of computed curves tell ratios apart
    return str(value) if isinstance(value, str) else f"{value:.6g}"


def read_label(name: str, given: Any) -> Any:
    """What a cell or an attribute gives of a curve.

    Parameters
    ----------
    name
        "blade", "state" or "force_ratio".
    given
        Words or a number; nothing given is None.

    Raises
    ------
    InputError
        Where it gives something else.
    """
    if given is None or not str(given).strip():
        return None
    if name in _WORDS:
        word = str(given).strip().casefold()
        if word not in _WORDS[name]:
            raise InputError(f"{given!r} is no {name}; write {' or '.join(_WORDS[name])}")
        return word
    try:
        ratio = float(given)
    except (TypeError, ValueError):
        ratio = math.nan
    if not (math.isfinite(ratio) and ratio > 0.0):
        raise InputError(f"{given!r} is no F_C/F_E; give a number above 0, or leave it empty")
    return ratio


def label_of(given: Mapping[str, Any]) -> CurveLabel:
    """A curve's label from what is given under names of `LABELS`.

    Raises
    ------
    InputError
        As `read_label` does.
    """
    known = {LABELS[key]: value for key, value in given.items() if key in LABELS}
    return CurveLabel(**{name: read_label(name, value) for name, value in known.items()})


def the_curve(found: Sequence[CurveLabel], wanted: CurveLabel) -> CurveLabel:
    """The one curve of a file that is wanted.

    Parameters
    ----------
    found
        Labels of the curves there are, each once.
    wanted
        What is asked for.

    Raises
    ------
    InputError
        Where none is it, or several are.
    """
    fitting = [one for one in found if one.agrees(wanted)]
    if len(fitting) == 1:
        return fitting[0]
    there = "; ".join(one.words for one in fitting or found)
    if not fitting:
        raise InputError(f"no curve of {wanted.words}; the file has {there}")
    raise InputError(
        f"{len(fitting)} curves, {there}; choose one by blade, state or centrifugal_to_force"
    )
