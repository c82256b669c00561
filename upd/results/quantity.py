"""What a number is: its name, unit and words, declared once for results, terminal, page, tables."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import Any

from upd.results.case import Case
from upd.results.number import Result

#: how names of numbers of the left blade begin
LEFT = "left_"
#: unit -> of N, mm, t, s, rad, N mm or parts of one
_SCALES = {"um": 1e3, "um2": 1e6, "%": 1e2, "g": 1e6, "mrad": 1e3, "urad": 1e6}


@dataclass(frozen=True)
class Quantity:
    """A number that runs give, or several numbered alike: "peak_{n}_frequency".

    Attributes
    ----------
    name
        As files and scripts have it; {n} is a number, an axis or a body.
    unit
        Of its values in files.
    words
        As it is printed; the name without underscores where nothing is given.
    full
        The number it stands for: of the full model, of the contact without the finite bodies.
    same_bodies
        Whether it converges on the bodies there are, not to a closed form of half-spaces.
    is_error
        Whether it is an error itself and has none.
    source
        Where it comes from, of one that has no reference.
    in_percent
        Whether its values are given in %, not as parts of one.
    part_of
        What its changes are parts of, where it may vanish itself.
    """

    name: str
    unit: str = ""
    words: str = ""
    full: str = ""
    same_bodies: bool = False
    is_error: bool = False
    source: str = ""
    in_percent: bool = False
    part_of: str = ""

    @property
    def scale(self) -> float:
        """Its unit over N, mm, t, s, rad, N mm or parts of one, in which its values are given."""
        return 1.0 if self.in_percent else _SCALES.get(self.unit, 1.0)

    def of(
        self,
        value: float,
        case: Case,
        reference: float | None = None,
        source: str = "",
        *,
        n: object = "",
        **more: Any,
    ) -> Result:
        """The number of a case, with a reference and its source; both values in mm, N, t, rad."""
        if reference is not None:
            reference *= self.scale
        value, source = self.scale * float(value), source or self.source
        return Result(self.named(n), case, value, self.unit, reference, source, **more)

    def withheld(self, case: Case, reason: str, *, n: object = "") -> Result:
        """The number that was asked for and not reached: no value, and the reason."""
        return self.of(math.nan, case, n=n, withheld=reason)

    def named(self, n: object) -> str:
        """Its name with a number, an axis or a body."""
        return self.name.format(n=n)

    def label(self, n: object = "") -> str:
        """It in words, with a number, an axis or a body."""
        return self.words.format(n=n) if self.words else self.named(n).replace("_", " ")

    def on(self, blade: str) -> Quantity:
        """The same number of the right blade, which needs no name, or the left one."""
        if blade != "left":
            return self
        words = f"left blade, {self.words}" if self.words else ""
        return replace(self, name=LEFT + self.name, words=words)

    def in_unit(self, unit: str) -> Quantity:
        """The same number of an analysis that gives it in another unit."""
        return replace(self, unit=unit)

    def number_of(self, name: str) -> str | None:
        """What {n} is in a name; None for the name of another number."""
        found = re.fullmatch(re.escape(self.name).replace(r"\{n\}", "([^_]+)"), name)
        return None if found is None else "".join(found.groups())
