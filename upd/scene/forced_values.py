"""Values that the tables of a forced response take: fits, harmonics, samples, lattice lines."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator

from upd.scene.quantities import Example, Noted, must, positive, quantity

Stiffness = Annotated[float, quantity("stiffness"), positive, Example.of('"1e6 N/mm"')]
#: words of contact.fit and how far the faces are worn in
FITS = {"unloaded": 0.0, "new": 0.0, "loaded": 1.0, "worn": 1.0}
#: highest harmonic of a force and of the balance
MOST_HARMONICS = 31


def checked_fit(value: Any) -> Any:
    """A word of contact.fit, or a number 0 to 1."""
    if isinstance(value, str) and value in FITS:
        return value
    if isinstance(value, (int, float)) and not isinstance(value, bool) and 0.0 <= value <= 1.0:
        return float(value)
    raise ValueError(
        f'{value!r} is no fit of the faces; write "loaded" or "worn", "unloaded" or "new", or a '
        "number 0 to 1"
    )


#: harmonics that a force may have
harmonic_number = must(lambda v: 1 <= v <= MOST_HARMONICS, "is no harmonic, 1 to 31", "1 to 31")


def whole_number(value: Any) -> bool:
    """Whether a value is one."""
    return isinstance(value, int) and not isinstance(value, bool)


def checked_lines(value: Any) -> Any:
    """All lines, a number of groups, or numbers of lines, rising."""
    if value == "all" or (whole_number(value) and value >= 1):
        return value
    if (
        isinstance(value, (list, tuple))
        and value
        and all(whole_number(v) and v >= 0 for v in value)
        and len(set(value)) == len(value)
    ):
        return tuple(sorted(value))
    raise ValueError(
        f'{value!r} chooses no lattice lines; write "all", a number of groups of lines, or '
        "a list of line numbers from 0"
    )


def checked_harmonics(value: Any) -> Any:
    """The highest harmonic, or "adaptive"."""
    if value == "adaptive" or (whole_number(value) and 1 <= value <= MOST_HARMONICS):
        return value
    raise ValueError(
        f'{value!r} is no number of harmonics; give the highest, 1 to 31, or "adaptive"'
    )


def checked_samples(value: Any) -> Any:
    """Samples a period, or "auto"."""
    if value == "auto" or (whole_number(value) and value >= 8):
        return value
    raise ValueError(f'{value!r} is no number of samples; give 8 or more per period, or "auto"')


#: Lattice lines of a contact patch: "all", a number of groups of neighbours, or their numbers from
#: 0.
Lines = Annotated[
    Any,
    BeforeValidator(checked_lines),
    Noted(bounds="all, a number of groups, or a list of line numbers from 0"),
    Example.of('"all"'),
]
