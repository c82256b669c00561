"""Ranges of a scene's inputs, "path=low:high", as fits and choices of a damper read them, and the
one model of a forced response that they move.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from upd.errors import InputError, one_line
from upd.scene.forced import ForcedScene
from upd.scene.keys import given_data
from upd.scene.quantities import UNKNOWN
from upd.scene.read import load_scene
from upd.units import parse_quantity, quantity_text, unit_inside


@dataclass
class InputProblems:
    """All that is wrong with several texts, raised at once.

    Attributes
    ----------
    heading
        Of what they are; without one they have headings of their own.
    lines
        A problem each.
    """

    heading: str = ""
    lines: list[str] = field(default_factory=list)

    @contextmanager
    def of(self, place: str = "") -> Iterator[None]:
        """Keep an InputError with its place."""
        try:
            yield
        except InputError as error:
            self.lines.append(f"{place}: {error}" if place else str(error))

    def twice(self, names: Sequence[str], what: str = "given twice") -> None:
        """Names that must be different."""
        self.lines += [f"{n}: {what}" for n in dict.fromkeys(names) if names.count(n) > 1]

    def check(self) -> None:
        """Raise InputError where something is wrong."""
        if self.lines:
            head = [f"{self.heading}:"] if self.heading else []
            raise InputError(("\n" + "  " * len(head)).join([*head, *self.lines]))


def read_range(text: str, kind: str, value: float) -> tuple[float, float]:
    """Both ends of "low:high" in the unit inside: quantities, numbers, or factors, "x0.1:x10".

    Parameters
    ----------
    text
        What stands after the path.
    kind, value
        Of the input, as `upd.scene.scalar_input` has them.

    Raises
    ------
    InputError
        Where it is no range of values above 0.
    """
    ends = [end.strip() for end in text.split(":")]
    if len(ends) != 2:
        raise InputError(f"{text!r} is no range; write low:high, quantities or x0.1:x10")
    low, high = (
        bare_quantity(end[1:], "fraction") * value if end[:1] == "x" else bare_quantity(end, kind)
        for end in ends
    )
    if not 0.0 < low < high:
        raise InputError(f"{text!r}: write two values above 0, the lower one first")
    return low, high


def bare_quantity(text: str, kind: str) -> float:
    """A quantity, or a bare number in the unit inside."""
    try:
        number = float(text)
    except ValueError:
        return parse_quantity(text, kind)
    return parse_quantity(number if kind == "fraction" else f"{number!r} {unit_inside(kind)}", kind)


def check_ends(
    read: Callable[[float], object], ends: Iterable[float], kind: str, remedy: str
) -> None:
    """Raise InputError where a scene refuses a value.

    Parameters
    ----------
    read
        Reads the scene with a value.
    ends, kind
        The values, and the kind of their quantity.
    remedy
        What to do then.
    """
    for end in ends:
        try:
            read(end)
        except InputError as error:
            shown = quantity_text(float(f"{end:.4g}"), kind)
            raise InputError(
                f"the scene refuses {shown} ({one_line(error)}); to fix it: {remedy}"
            ) from None


def input_text(value: float, kind: str) -> Any:
    """A value as a scene takes it: a fraction has no unit."""
    return float(value) if kind == "fraction" else quantity_text(float(value), kind)


def with_values(scene: ForcedScene, values: Mapping[str, Any]) -> ForcedScene:
    """The scene read again with some values; all others keep what the scene knows of their limits.

    Raises
    ------
    InputError
        Where the scene refuses them.
    """
    return load_scene(given_data(scene, values), dict(values))  # type: ignore[no-any-return]


def stiffness_of(scene: ForcedScene, paths: Iterable[str]) -> str:
    """Name of the contact stiffness that inputs are of; the scene's first where they are of none.

    Raises
    ------
    InputError
        Where they are of several.
    """
    steps = [path.split(".") for path in paths]
    named = list(dict.fromkeys(one[1] for one in steps if one[0] == "stiffness"))
    if len(named) > 1:
        raise InputError(
            f"parameters of several contact stiffnesses ({', '.join(named)}); to fix it: give "
            "those of one"
        )
    return named[0] if named else next(iter(scene.stiffnesses))


def one_model(
    scene: ForcedScene,
    stiffness: str,
    what: str,
    *,
    more: Iterable[str] = (),
) -> ForcedScene:
    """A scene of contact points with one contact stiffness and one mesh, nothing estimated or
    solved again.

    Parameters
    ----------
    stiffness
        Its name.
    what
        Needs it: "a fit".
    more
        What else is wrong with the scene.

    Raises
    ------
    InputError
        With everything that is wrong with it.
    """
    problems = InputProblems("scene")
    if scene.contact.model == "interface":
        problems.lines.append(
            f'contact.model: {what} takes contact points on springs; set contact.model="springs"'
        )
    if scene.wanted_accuracy is not None:
        problems.lines.append(
            f'accuracy: {what} keeps one mesh; leave it out or set it to "{UNKNOWN}", and choose '
            "the levels in the scene"
        )
    problems.lines += more
    problems.check()
    return replace(
        scene,
        accuracy=UNKNOWN,
        uncertain={},
        measured={},
        left_out=replace(scene.left_out, solve="no"),
        contact=replace(scene.contact, stiffness=(stiffness,)),
    )
