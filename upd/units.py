"""Quantities with units, read at the door: "200 GPa" becomes 2.0e5.

Inside, everything is mm, N, MPa, tonne, s.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from typing import Any

from upd.errors import InputError

# kind -> unit -> factor to the internal unit (the first one of each kind)
UNITS: dict[str, dict[str, float]] = {
    "length": {"mm": 1.0, "m": 1e3, "cm": 10.0, "um": 1e-3, "µm": 1e-3, "nm": 1e-6},
    "force": {"N": 1.0, "kN": 1e3, "MN": 1e6, "mN": 1e-3, "uN": 1e-6},
    "stress": {"MPa": 1.0, "GPa": 1e3, "kPa": 1e-3, "Pa": 1e-6, "N/mm2": 1.0},
    "stiffness": {"N/mm": 1.0, "N/um": 1e3, "N/m": 1e-3, "kN/mm": 1e3, "MN/m": 1.0},
    "density": {"t/mm3": 1.0, "kg/m3": 1e-12, "g/cm3": 1e-9, "g/mm3": 1e-6},
    "mass": {"g": 1e-6, "kg": 1e-3, "t": 1.0, "mg": 1e-9},
    "speed": {"rpm": 2.0 * math.pi / 60.0, "rad/s": 1.0, "1/s": 2.0 * math.pi},
    "memory": {"B": 1.0, "MB": 1e6, "GB": 1e9, "MiB": 2.0**20, "GiB": 2.0**30},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "angle": {"deg": 1.0, "rad": 180.0 / math.pi},
    "accelerance": {
        "(m/s2)/N": 1.0,
        "m/s2/N": 1.0,
        "(m/s^2)/N": 1.0,
        "(m/s²)/N": 1.0,
        "1/kg": 1.0,
        "(mm/s2)/N": 1e-3,
        "g/N": 9.80665,
    },
    "mobility": {"(mm/s)/N": 1.0, "mm/s/N": 1.0, "(m/s)/N": 1e3, "m/s/N": 1e3},
    "receptance": {"mm/N": 1.0, "m/N": 1e3, "um/N": 1e-3, "µm/N": 1e-3},
    "fraction": {"": 1.0, "%": 1e-2},
}
#: largest number, and its inverse the smallest: their fifth powers, which stiffness and inertia
#: need, are still numbers
_LARGEST = sys.float_info.max**0.2
#: units a person would write, before the one inside
_WRITTEN = {"stress": ("GPa",), "density": ("kg/m3",), "memory": ("GB", "MB"), "mass": ("g",)}
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def parse_quantity(value: Any, kind: str) -> float:
    """Return ``value`` ("5 mm", "200 GPa") in internal units.

    ``kind`` is a key of `UNITS`. A fraction may be a bare number; every other kind needs its unit.
    Raises InputError naming the units that are understood.
    """
    table = UNITS[kind]
    known = ", ".join(u for u in table if u)
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise InputError(f"{value!r} is not a {kind}: write a number with its unit ({known})")
    if isinstance(value, (int, float)):
        if kind != "fraction":
            raise InputError(
                f"{value} has no unit: write it as text with one of {known}, for example "
                f'"{value} {next(iter(table))}"'
            )
        unit = ""
        try:
            number = float(value)
        except OverflowError:
            # whole numbers of more than 308 digits are no floats
            number = math.inf
    else:
        parts = number_and_unit(value)
        if parts is None:
            raise InputError(f"{value!r} is not a number with a unit ({known})")
        number, unit = parts
    if unit not in table:
        if not unit:
            raise InputError(f"{value!r} has no unit: add one of {known}")
        raise InputError(f"{_fault(unit)}; a {kind} is needed here: use one of {known}")
    if not math.isfinite(number):
        raise InputError(f"{value!r} is not finite")
    if number and not 1.0 / _LARGEST < abs(number) < _LARGEST:
        raise InputError(
            f"{value!r} is out of range: give a number between {1.0 / _LARGEST:.0e} and "
            f"{_LARGEST:.0e}"
        )
    factor = table[unit]
    # Divide by whole numbers where possible: 5 um and 0.005 mm are then the same float.
    return (
        number / round(1.0 / factor)
        if factor < 1.0 and abs(round(1.0 / factor) * factor - 1.0) < 1e-12
        else number * factor
    )


def number_and_unit(text: str) -> tuple[float, str] | None:
    """Both parts of "5 mm", the unit as it is written; None of another text."""
    match = _NUMBER.fullmatch(text)
    return None if match is None else (float(match[1]), match[2])


def unit_factor(unit: str, kinds: Sequence[str]) -> tuple[str, float]:
    """Kind of a bare unit, and the factor from it to the internal one.

    Parameters
    ----------
    unit
        "Hz", "(m/s2)/N".
    kinds
        Keys of `UNITS` that are understood here.

    Raises
    ------
    InputError
        For another unit; the message names those understood.
    """
    for kind in kinds:
        if unit and unit in UNITS[kind]:
            return kind, UNITS[kind][unit]
    known = "; ".join(f"of {kind} {', '.join(u for u in UNITS[kind] if u)}" for kind in kinds)
    raise InputError(f"{_fault(unit)}; understood are those {known}")


def _fault(unit: str) -> str:
    """What is wrong with a unit: of another kind, or not known."""
    other = next((k for k, units in UNITS.items() if unit and unit in units), None)
    return f"{unit!r} is a unit of {other}" if other else f"the unit {unit!r} is not known"


def unit_inside(kind: str) -> str:
    """The unit that numbers of this kind have inside, "" of fractions."""
    return next(unit for unit, factor in UNITS[kind].items() if factor == 1.0)


def quantity_text(value: float, kind: str) -> str:
    """A number in internal units as text that `parse_quantity` reads back to the same float.

    In the unit a person would write where that loses no digit, else in the one inside. A fraction
    has none.
    """
    inside = unit_inside(kind)
    for unit in (*_WRITTEN.get(kind, ()), inside):
        text = f"{value / UNITS[kind][unit]:.12g} {unit}".rstrip()
        if parse_quantity(text if unit else float(text), kind) == value:
            return text
    return f"{value!r} {inside}".rstrip()
