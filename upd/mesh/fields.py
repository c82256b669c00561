"""What recipes share: fields of their dataclasses as data, and the sizes of a damper.

A recipe writes ``radius: float = in_mm(5.0)`` and asks `field_faults` for what is out of bounds;
bounds that depend on other parameters stay in the recipe's own checks. Two recipes are of the same
damper when their `DamperSizes` agree; what stands for the blade, and the mesh, may differ.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from typing import Any, Literal, get_args, get_origin

#: quantity -> unit inside
UNITS_INSIDE = {"length": "mm", "angle": "deg"}
#: rounding of lengths and angles that follow from others, relative to the largest of them
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Bounds:
    """Between which values a number must lie, whatever the other parameters are.

    Attributes
    ----------
    least, most
        None where there is no end.
    above
        The end that is itself left out, instead of ``least``.
    even
        Whether it must be an even number.
    """

    least: float | None = None
    most: float | None = None
    above: float | None = None
    even: bool = False

    @property
    def text(self) -> str:
        """In a few letters, for a table."""
        even = "even, " if self.even else ""
        low = self.least if self.least is not None else self.above
        if low is not None and self.most is not None:
            return f"{even}{low:g} ... {self.most:g}"
        if self.above is not None:
            return f"{even}> {self.above:g}"
        return f"{even}>= {self.least:g}" if self.least is not None else even.rstrip(", ")

    def hold(self, value: float) -> bool:
        """Whether a number lies inside."""
        return (
            (self.least is None or value >= self.least)
            and (self.most is None or value <= self.most)
            and (self.above is None or value > self.above)
            and not (self.even and value % 2)
        )


def _made(default: Any, bounds: Bounds, quantity: str | None = None, why: str = "") -> Any:
    return field(default=default, metadata={"quantity": quantity, "bounds": bounds, "why": why})


def in_mm(default: float | None, *, least: float | None = None) -> Any:
    """A length in mm, positive unless it has a ``least``; one whose default is None may be left
    out.
    """
    return _made(default, Bounds(least=least, above=0.0 if least is None else None), "length")


def in_degrees(default: float, least: float | None = None, most: float | None = None) -> Any:
    """An angle in degrees."""
    return _made(default, Bounds(least, most, above=0.0 if least is None else None), "angle")


def ratio(default: float | None, least: float | None = None, most: float | None = None) -> Any:
    """A number without unit; one whose default is None may be left out."""
    return _made(default, Bounds(least, most, above=0.0 if least is None else None))


def whole(default: int, least: int = 1, *, even: bool = False, why: str = "") -> Any:
    """A whole number; ``why`` it has a least one, for the message."""
    return _made(default, Bounds(least=least, even=even), why=why)


def choice(default: Any, *choices: Any) -> Any:
    """One of some texts or numbers."""
    return field(default=default, metadata={"choices": choices})


def field_faults(params: Any) -> list[str]:
    """What is out of bounds in a recipe's parameters, one sentence a field in their order."""
    return [
        f"{f.name}: {fault}"
        for f in fields(params)
        if (fault := _fault(f, getattr(params, f.name)))
    ]


def _fault(f: Field[Any], value: Any) -> str:
    choices, bounds = f.metadata.get("choices"), f.metadata.get("bounds")
    if choices is not None:
        if type(value) is type(choices[0]) and value in choices:
            return ""
        if type(choices[0]) is int and (isinstance(value, bool) or not isinstance(value, int)):
            return f"{value!r} is not a whole number; give {_either(choices)}"
        return f"{value!r} is not {_either(choices)}"
    if bounds is None or (value is None and f.default is None):
        return ""
    number = not isinstance(value, bool) and isinstance(value, (int, float))
    if isinstance(f.default, int) and not isinstance(f.default, bool):
        if not number or not isinstance(value, int):
            return f"{value!r} is not a whole number; give one"
        if not bounds.hold(value):
            kind = "an even number" if bounds.even else "a whole number"
            why = f.metadata.get("why", "")
            return f"{value} is not {kind} of at least {bounds.least:g}" + (why and f"; {why}")
        return ""
    if not number or not math.isfinite(value):
        kind = "positive number" if bounds.above == 0.0 else "number"
        return f"{value!r} is not a {kind}; give one"
    if bounds.hold(value):
        return ""
    if bounds.above == 0.0 and bounds.most is None:
        return f"{value!r} is not a positive number; give one"
    unit = UNITS_INSIDE.get(str(f.metadata.get("quantity")), "")
    shown = f"{value:g}{unit and ' '}{unit}"
    if bounds.most is None:
        return f"{shown} is less than {bounds.least:g}"
    return f"{shown} is outside {bounds.text}"


def _either(choices: Sequence[Any]) -> str:
    texts = [f'"{c}"' if isinstance(c, str) else str(c) for c in choices]
    return f"{', '.join(texts[:-1])} or {texts[-1]}" if len(texts) > 1 else texts[0]


def bounds_of(f: Field[Any], kind: Any) -> str:
    """Bounds or choices of a parameter, whatever the others are; "" where it has none.

    Parameters
    ----------
    kind
        Its annotation.
    """
    choices = f.metadata.get("choices") or (get_args(kind) if get_origin(kind) is Literal else ())
    if choices:
        return ", ".join(map(str, choices))
    return str(f.metadata.get("bounds", Bounds()).text)


@dataclass(frozen=True)
class Size:
    """One size of a damper.

    Attributes
    ----------
    value
        mm or degrees.
    unit
        "mm" or "deg".
    parameter
        Of the recipe that sets it; "" where none does.
    """

    value: float
    unit: str = "mm"
    parameter: str = ""

    @property
    def text(self) -> str:
        """The value with its unit and parameter."""
        place = f" ({self.parameter})" if self.parameter else ""
        return f"{self.value:.6g} {self.unit}{place}"


@dataclass(frozen=True)
class DamperSizes:
    """A damper and its contact faces.

    Attributes
    ----------
    kind
        "wedge" or "pads"; sizes of different kinds are not compared.
    volume
        Of the whole damper, mm3.
    sizes
        What is measured, in words -> its size.
    """

    kind: str
    volume: float
    sizes: Mapping[str, Size]

    def differences(self, other: DamperSizes, mine: str, theirs: str) -> list[str]:
        """What differs, one sentence a size; ``mine`` and ``theirs`` say whose damper is whose."""
        if self.kind != other.kind:
            return [f"kind of damper: {self.kind} {mine}, {other.kind} {theirs}"]
        largest = max(size.value for size in (*self.sizes.values(), *other.sizes.values()))
        return [
            f"{what}: {size.text} {mine}, {other.sizes[what].text} {theirs}"
            for what, size in self.sizes.items()
            if not math.isclose(
                size.value, other.sizes[what].value, rel_tol=0.0, abs_tol=_ROUNDING * largest
            )
        ]
