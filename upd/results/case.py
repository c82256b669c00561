"""What a number, a check or a group of arrays belongs to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any


@dataclass(frozen=True, eq=False)
class Case:
    """What a number, a check or a group of arrays belongs to.

    Only what applies is given; the label is derived, never parsed.

    A case equals its label, so that scripts may write it: ``row.case == "F=50 N"``.

    Attributes
    ----------
    name
        Words for a case that no number identifies: "Craig-Bampton", "equilibrium", "performance".
    stiffness
        Name of the contact stiffness, a table of the scene.
    body
        A body of the model.
    load
        Normal force, N.
    direction
        Direction of a tangential load: "x", "y" or "45deg".
    ratio
        Tangential load over mu times the normal load.
    friction
        State of the damper's equilibrium: "opposing", "frictionless", "reversed".
    force_ratio
        F_C/F_E, centrifugal over excitation force.
    kind
        Kind of linear curve or of modes: "free", "stuck", "glued".
    arrangement
        Which sides of the platforms face each other: "symmetric", "asymmetric".
    peak
        Number of the peak from 1; 0 is the highest point of a curve without a peak.
    mode
        How the blades move at a peak: "in phase", "out of phase".
    frequency
        Hz.
    part
        Share of the first natural frequency.
    blade
        Blade whose motion it is: "left", "right".
    side
        Face: "left", "right".
    choice
        What was chosen differently: "start mid", "3 harmonics".
    nodal_diameter
        Of the modes of a bladed disk.
    engine_order
        That excites them.
    """

    name: str = ""
    stiffness: str = ""
    body: str = ""
    load: float | None = None
    direction: str = ""
    ratio: float | None = None
    friction: str = ""
    force_ratio: float | None = None
    kind: str = ""
    arrangement: str = ""
    peak: int | None = None
    mode: str = ""
    frequency: float | None = None
    part: float | None = None
    blade: str = ""
    side: str = ""
    choice: str = ""
    nodal_diameter: int | None = None
    engine_order: int | None = None

    @property
    def label(self) -> str:
        """The case in words, as terminal, page and files show it."""
        return self._label(frozenset())

    def _label(self, varying: frozenset[str]) -> str:
        """The label with * for the values of ``varying`` attributes."""

        def shown(name: str, form: str = "{}") -> str:
            """An attribute in words; nothing where it does not apply."""
            value = getattr(self, name)
            if value is None or value == "":
                return ""
            number = f"{value:.6g}" if isinstance(value, float) else str(value)
            return form.format("*" if name in varying else number)

        load = shown("load", "F={} N")
        shear = shown("direction", "_{}") + shown("ratio", "/muN={}")
        parts = [
            shown("stiffness"),
            f"{load} T{shear}" if load and shear else load,
            shown("kind"),
            shown("blade", "{} blade"),
            shown("name"),
            shown("friction", "friction {}"),
            shown("arrangement"),
            shown("body"),
            shown("force_ratio", "F_C/F_E {}"),
            "at the highest point" if self.peak == 0 else shown("peak", "at peak {}"),
            shown("mode"),
            shown("choice"),
            shown("part", "{} f1"),
            shown("frequency", "{} Hz"),
            shown("side"),
            shown("engine_order", "EO {}"),
            shown("nodal_diameter", "ND {}"),
        ]
        return ", ".join(part for part in parts if part)

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
