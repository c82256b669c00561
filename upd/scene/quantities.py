"""Types of a scene's values: quantities with units, forces, shares, names."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from upd.errors import InputError
from upd.units import parse_quantity


def quantity(kind: str) -> BeforeValidator:
    """Number or text with a unit -> number in mm, N, MPa, t, s."""

    def check(value: Any) -> Any:
        try:
            return parse_quantity(value, kind)
        except InputError as error:
            raise ValueError(str(error)) from None

    return BeforeValidator(check)


def must(rule: Callable[[Any], bool], message: str) -> AfterValidator:
    """A value that breaks ``rule`` is a problem.

    ``message`` ends the sentence that begins with the value.
    """

    def check(value: Any) -> Any:
        if not rule(value):
            raise ValueError(
                f"{value:g} {message}"
                if isinstance(value, (int, float))
                else f"{value!r} {message}"
            )
        return value

    return AfterValidator(check)


FILLED = AfterValidator(lambda value: value if value else _empty())


def _empty() -> Any:
    raise ValueError("is empty; give at least one")


positive = must(lambda v: v > 0.0, "is not positive")
not_negative = must(lambda v: v >= 0.0, "is negative")
share = must(lambda v: 0.0 < v < 1.0, 'is outside (0, 1); write for example "1 %" or 0.01')

Stress = Annotated[float, quantity("stress"), positive]
Density = Annotated[float, quantity("density"), positive]
Poisson = Annotated[
    float, quantity("fraction"), must(lambda v: -1.0 < v < 0.5, "is outside (-1, 0.5)")
]
Force = Annotated[
    float,
    quantity("force"),
    must(
        lambda v: v >= 0.0,
        "N pulls the bodies apart; a contact carries only pressure, give a positive force",
    ),
]
#: Forces that the equilibrium of a damper under centrifugal force gives, by the share of friction
#: it mobilises.
EQUILIBRIA = ("opposing", "frictionless", "reversed")


def _force_or_equilibrium(value: Any) -> Any:
    if isinstance(value, str) and value in EQUILIBRIA:
        return value
    try:
        number = parse_quantity(value, "force")
    except InputError as error:
        known = ", ".join(repr(e) for e in EQUILIBRIA)
        raise ValueError(
            f"{error}; or one of {known} (equilibrium under loads.centrifugal)"
        ) from None
    if number < 0.0:
        raise ValueError(
            f"{number:g} N pulls the bodies apart; a contact carries only pressure, give a "
            "positive force"
        )
    return number


#: A normal force in N, or the name of an equilibrium.
NormalLoad = Annotated[float | str, BeforeValidator(_force_or_equilibrium)]


def _direction(value: Any) -> Any:
    if value in ("x", "y"):
        return {"x": 0.0, "y": 90.0}[value]
    try:
        return parse_quantity(value, "angle")
    except InputError as error:
        raise ValueError(
            f'{error}; or "x" (along the longer edge of the patch), "y" (across it)'
        ) from None


#: Direction of a tangential load in degrees from the patch's x.
Direction = Annotated[float, BeforeValidator(_direction)]
Length = Annotated[float, quantity("length")]
Frequency = Annotated[float, quantity("frequency"), positive]
LoadRatio = Annotated[
    float,
    quantity("fraction"),
    not_negative,
    must(
        lambda v: v < 1.0, "times mu N is gross slip (T >= mu N has no static answer); stay below 1"
    ),
]
Coefficient = Annotated[float, quantity("fraction"), not_negative]
Share = Annotated[float, quantity("fraction"), share]
Memory = Annotated[float, quantity("memory"), positive]
Name = Annotated[
    str,
    must(
        lambda v: bool(re.fullmatch(r"[\w.-]*\w[\w.-]*", v)),
        "is no name: use letters, digits, '-', '_' and '.'",
    ),
]
