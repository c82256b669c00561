"""What a number, a check or a group of arrays belongs to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any


def _written(form: str, default: Any = "") -> Any:
    """An attribute and how the label shows it."""
    return field(default=default, metadata={"form": form})


@dataclass(frozen=True, eq=False, kw_only=True)
class Case:
    """What a number, a check or a group of arrays belongs to.

    Only what applies is given; the label is derived, never parsed.

    A case equals its label, so that scripts may write it: ``row.case == "F=50 N"``. Attributes
    stand in the label's order.

    Attributes
    ----------
    stiffness
        Name of the contact stiffness, a table of the scene.
    load
        Normal force, N.
    direction
        Direction of a tangential load: "x", "y" or "45deg".
    ratio
        Tangential load over mu times the normal load.
    kind
        Kind of linear curve or of modes: "free", "stuck", "glued".
    blade
        Blade whose motion it is: "left", "right".
    name
        Words for a case that no number identifies: "Craig-Bampton", "equilibrium", "performance".
    friction
        State of the damper's equilibrium: "opposing", "frictionless", "reversed".
    arrangement
        Which sides of the platforms face each other: "symmetric", "asymmetric".
    body
        A body of the model.
    force_ratio
        F_C/F_E, centrifugal over excitation force.
    peak
        Number of the peak from 1; 0 is the highest point of a curve without a peak.
    mode
        How the blades move at a peak: "in phase", "out of phase".
    choice
        What was chosen differently: "start mid", "3 harmonics".
    frequency
        Hz.
    side
        Face: "left", "right".
    engine_order
        That excites them.
    nodal_diameter
        Of the modes of a bladed disk.
    """

    stiffness: str = _written("{}")
    load: float | None = _written("F={} N", None)
    direction: str = _written("_{}")
    ratio: float | None = _written("/muN={}", None)
    kind: str = _written("{}")
    blade: str = _written("{} blade")
    name: str = _written("{}")
    friction: str = _written("friction {}")
    arrangement: str = _written("{}")
    body: str = _written("{}")
    force_ratio: float | None = _written("F_C/F_E {}", None)
    peak: int | None = _written("at peak {}", None)
    mode: str = _written("{}")
    choice: str = _written("{}")
    frequency: float | None = _written("{} Hz", None)
    side: str = _written("{}")
    engine_order: int | None = _written("EO {}", None)
    nodal_diameter: int | None = _written("ND {}", None)

    @property
    def label(self) -> str:
        """The case in words, as terminal, page and files show it."""
        return self._label(frozenset())

    def _label(self, varying: frozenset[str]) -> str:
        """The label with * for the values of ``varying`` attributes."""
        words = dict[str, str]()
        for one in fields(self):
            value = getattr(self, one.name)
            number = f"{value:.6g}" if isinstance(value, float) else str(value)
            text = one.metadata["form"].format("*" if one.name in varying else number)
            words[one.name] = "" if value in (None, "") else text
        if self.peak == 0:
            words["peak"] = "at the highest point"
        shear = words.pop("direction") + words.pop("ratio")
        if words["load"] and shear:
            words["load"] += f" T{shear}"
        return ", ".join(filter(None, words.values()))

    def matches(self, other: Case | str) -> bool:
        """Whether ``other`` means this case: itself or its label, with or without the mode."""
        return self == other or (bool(self.mode) and replace(self, mode="") == other)

    def __str__(self) -> str:
        return self.label

    def __eq__(self, other: object) -> bool:
        return self.label == (other.label if isinstance(other, Case) else other)

    def __hash__(self) -> int:
        return hash(self.label)

    def given(self) -> dict[str, Any]:
        """The attributes that apply, by name: for files."""
        return {
            f.name: value for f in fields(self) if (value := getattr(self, f.name)) != f.default
        }


NO_CASE = Case()


def shared_label(cases: Iterable[Case], varying: Iterable[str] = ()) -> str:
    """The label that cases share, with * for the values that differ and for those ``varying``.

    Only * is left when not the same attributes apply to all of them.
    """
    different = list(dict.fromkeys(cases))
    given = [case.given() for case in different]
    if any(set(one) != set(given[0]) for one in given):
        return "*"
    differ = (name for name in given[0] if len({one[name] for one in given}) > 1)
    return different[0]._label(frozenset((*differ, *varying)))
