"""The damper of a recipe in words that recipes share: which kind, how large, where it touches.

Two recipes are of the same damper when these agree; what stands for the blade, and the mesh, may
differ.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

#: rounding of lengths and angles that follow from others, relative to the largest of them
_ROUNDING = 1e-12


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
