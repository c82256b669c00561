"""What charts of a forced response share: units, sizes, curves and their marked points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Array, Axis, Group
from upd.plot.common import frequency_of
from upd.results import Case

#: the blade that is excited first
BLADES = ("right", "left")
#: shares of the cycle, in the order of the variables
SHARES = ("stick", "slip", "lift-off")
STICK_SHARE, SLIP_SHARE = 0, 1
PER_N = "(m/s²)/N"
HZ_AXIS = Axis("frequency", "Hz")
SHEET: dict[str, Any] = {"columns": 2, "size": (6.4, 4.4)}
#: name, unit, scale, first degree of freedom and names of the damper's motions
MOTIONS = (
    ("translation", "µm", 1e3, 0, ("x, across the blades", "y, along the damper", "z, radial")),
    ("rotation", "mrad", 1e3, 3, ("about x", "about y", "about z")),
)
#: ticks of a path that turns back
PATH_TICKS = 6


@dataclass(frozen=True)
class ChartedCurve:
    """A curve with friction and its colour, one for every F_C/F_E."""

    group: Group
    case: Case
    colour: int

    def data(self, name: str) -> NDArray[Any]:
        """A variable."""
        return np.asarray(self.group[name].data)

    @property
    def frequency(self) -> Array:
        """Hz, along the path."""
        return frequency_of(self.group)

    @property
    def slips(self) -> bool:
        """Whether a contact point slips anywhere on it."""
        return bool(self.data("state")[..., SLIP_SHARE].max() > 0.0)

    @property
    def moves(self) -> bool:
        """Whether a contact point slips or lifts off anywhere on it."""
        return bool(self.data("state")[..., STICK_SHARE].min() < 1.0)

    @property
    def told(self) -> tuple[str, float | None]:
        """Stiffness and F_C/F_E."""
        return self.case.stiffness, self.case.force_ratio


@dataclass(frozen=True)
class ChartedPeak:
    """A peak of a curve: its number and its place on the path, its mode where it is told."""

    curve: ChartedCurve
    number: int
    index: int
    mode: str = ""

    @property
    def case(self) -> Case:
        """The curve's, at the peak."""
        given = self.curve.case.given() | {"peak": self.number, "mode": self.mode}
        return replace(Case(**given), choice="")

    def moves(self, points: Group, side: int) -> bool:
        """Whether a contact point of a face slips or lifts off."""
        stick = self.curve.data("state")[self.index, :, STICK_SHARE]
        return bool((stick[np.asarray(points["face"].data) == side] < 1.0).any())

    @property
    def detail(self) -> str:
        """Where it lies, and the sweep that tells it where that is no balance."""
        words = [f"{self.curve.frequency[self.index]:.1f} Hz"]
        if self.curve.case.choice:
            words = ["time integration", self.curve.case.choice, *words]
        return ", ".join(words)


def charted_peaks(curve: ChartedCurve) -> list[ChartedPeak]:
    """The peaks of a curve."""
    numbers, index = curve.data("peak"), curve.data("peak_index")
    told = str(curve.group["peak"].attributes.get("modes", ""))
    modes = told.split(", ") if told else [""] * len(numbers)
    return [
        ChartedPeak(curve, int(number), int(i), mode)
        for number, i, mode in zip(numbers, index, modes, strict=True)
    ]
