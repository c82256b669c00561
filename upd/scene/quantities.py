"""Types of a scene's values: quantities with units, forces, shares, names; the annotation at a path
of a scene, and what it notes of a value.
"""

from __future__ import annotations

import re
import types
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, is_dataclass
from functools import partial
from types import MappingProxyType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import AfterValidator, BeforeValidator

from upd.errors import InputError, did_you_mean
from upd.units import parse_quantity, quantity_text

#: tables of a scene, a name, and places in lists
Steps = tuple[str | int, ...]


@dataclass(frozen=True)
class Note:
    """What an annotation notes of a value: what reads or checks it, or what would do.

    Attributes
    ----------
    read
        Makes the value of what the file has, or checks it; None of an example.
    values
        As TOML, of an example: what the message about a bad value proposes; several are the items
        of a list.
    kind
        Of quantity, as in `upd.units.UNITS`; or the unit of a bare number.
    bounds
        In a few words.
    """

    read: Callable[[Any], Any] | None = None
    values: tuple[str, ...] = ()
    kind: str = ""
    bounds: str = ""

    def __call__(self, value: Any) -> Any:
        return value if self.read is None else self.read(value)


def Example(*values: str, kind: str = "", bounds: str = "") -> Note:
    """What would do, and kind and bounds of a value whose own validator reads it."""
    return Note(None, values, kind, bounds)


@dataclass(frozen=True)
class Uncertainty:
    """An input that is known within limits.

    Attributes
    ----------
    path
        Of the quantity in the scene: "contact.friction", "loads.normal[0]".
    value, half_width
        In the unit inside (mm, N, MPa, t, s); the half-width is above 0.
    given
        As the scene has it: "4.9e5 N/mm +- 30 %".
    kind
        Of quantity, as in `upd.units.UNITS`.
    steps
        The path, tables and places in lists one by one.
    """

    path: str
    value: float
    half_width: float
    given: str
    kind: str
    steps: Steps

    @property
    def relative(self) -> float:
        """Half-width over the size of the value; infinite of 0."""
        return self.half_width / abs(self.value) if self.value else float("inf")

    def at(self, shift: float) -> float | str:
        """The value moved by ``shift`` half-widths, as the scene takes it."""
        moved = self.value + shift * self.half_width
        # a fraction has no unit
        return moved if self.kind == "fraction" else quantity_text(moved, self.kind)


def quantity(
    kind: str, words: Mapping[str, Any] = MappingProxyType({}), others: str = ""
) -> BeforeValidator:
    """Number or text with a unit -> number in mm, N, MPa, t, s.

    Parameters
    ----------
    words
        That may stand in its place -> what they mean.
    others
        What a message about anything else adds about them.
    """

    def read(value: Any) -> Any:
        if isinstance(value, str) and value in words:
            return words[value]
        try:
            return parse_quantity(value, kind)
        except InputError as error:
            raise ValueError(f"{error}{others}") from None

    return BeforeValidator(Note(read, kind=kind))


def must(
    rule: Callable[[Any], bool], message: str | Callable[[Any], str], bounds: str = ""
) -> AfterValidator:
    """A value that breaks ``rule`` is a problem.

    ``message`` ends the sentence that begins with the value; ``bounds`` are the rule in a few
    words, for the reference of the keys (without them what the message forbids).
    """

    def check(value: Any) -> Any:
        if not rule(value):
            why = message if isinstance(message, str) else message(value)
            short = isinstance(value, float) or (isinstance(value, int) and abs(value) < 10**15)
            raise ValueError(f"{value:g} {why}" if short else f"{value!r} {why}")
        return value

    known = bounds or f"none that {str(message).partition(';')[0]}"
    return AfterValidator(Note(check, bounds=known))


def one_of(names: Sequence[str]) -> AfterValidator:
    """A name that is none of ``names`` is a problem that lists them or names the nearest."""
    known = ", ".join(names)
    others = f"write one of {known}"
    return must(
        lambda v: v in names,
        lambda v: f"is none of its values{did_you_mean(v, names, others)}",
        known,
    )


def is_whole(value: Any) -> bool:
    """Whether a value is a whole number."""
    return isinstance(value, int) and not isinstance(value, bool)


def is_name(value: str) -> bool:
    """Whether a text can name a scene or a table."""
    return bool(re.fullmatch(r"[\w.-]*\w[\w.-]*", value))


def at_least(least: int) -> AfterValidator:
    """A number below ``least`` is a problem."""
    return must(lambda v: v >= least, f"is less than {least}", f">= {least}")


def _filled(value: Any) -> Any:
    if not value:
        raise ValueError("is empty; give at least one")
    return value


FILLED = AfterValidator(_filled)

positive = must(lambda v: v > 0.0, "is not positive", "> 0")
not_negative = must(lambda v: v >= 0.0, "is negative", ">= 0")
share = must(
    lambda v: 0.0 < v < 1.0,
    'is outside (0, 1); write for example "1 %" or 0.01',
    "between 0 and 1",
)

_PULLS = "N pulls the bodies apart; a contact carries only pressure, give a positive force"

Stress = Annotated[float, quantity("stress"), positive, Example('"200 GPa"')]
Density = Annotated[float, quantity("density"), positive, Example('"7800 kg/m3"')]
Poisson = Annotated[
    float,
    quantity("fraction"),
    must(lambda v: -1.0 < v < 0.5, "is outside (-1, 0.5)", "between -1 and 0.5"),
    Example("0.3"),
]
Force = Annotated[
    float,
    quantity("force"),
    must(lambda v: v >= 0.0, _PULLS, ">= 0"),
    Example('"350 N"'),
]
Mass = Annotated[float, quantity("mass"), positive, Example('"72 g"')]
Speed = Annotated[float, quantity("speed"), positive, Example('"6000 rpm"')]
Radius = Annotated[float, quantity("length"), positive, Example('"300 mm"')]
#: What a centrifugal force and ratios of forces say when other keys give them.
FROM_SPEED, FROM_FORCE = "from speed", "from force"


def or_from(word: str, stand_in: Any) -> BeforeValidator:
    """A value, or a word for one that follows from other keys and is put in later."""
    return BeforeValidator(lambda value: stand_in if value == word else value)


#: A centrifugal force, or "from speed".
Centrifugal = Annotated[Force, or_from(FROM_SPEED, "0 N")]
#: Forces that the equilibrium of a damper under centrifugal force gives, by the share of friction
#: it mobilises.
EQUILIBRIA = ("opposing", "frictionless", "reversed")
#: A normal force in N, or the name of an equilibrium.
NormalLoad = Annotated[
    float | str,
    quantity(
        "force",
        {name: name for name in EQUILIBRIA},
        f"; or one of {', '.join(map(repr, EQUILIBRIA))} (equilibrium under loads.centrifugal)",
    ),
    must(lambda v: isinstance(v, str) or v >= 0.0, _PULLS, f">= 0, or {', '.join(EQUILIBRIA)}"),
    Example('"50 N"', '"200 N"'),
]
#: Direction of a tangential load in degrees from the patch's x.
Direction = Annotated[
    float,
    quantity(
        "angle",
        {"x": 0.0, "y": 90.0},
        '; or "x" (along the longer edge of the patch), "y" (across it)',
    ),
    Example('"x"', '"30 deg"', bounds="an angle, x or y"),
]
Phase = Annotated[float, quantity("angle"), Example('"180 deg"')]
Length = Annotated[float, quantity("length"), Example('"5 mm"')]
Frequency = Annotated[float, quantity("frequency"), positive, Example('"340 Hz"')]
Ratio = Annotated[float, quantity("fraction"), positive, Example("60.0", "194.0")]
#: Ratios of centrifugal to exciting force, or "from force".
Ratios = Annotated[tuple[Ratio, ...], FILLED, or_from(FROM_FORCE, (1.0,))]
LoadRatio = Annotated[
    float,
    quantity("fraction"),
    not_negative,
    must(
        lambda v: v < 1.0,
        "times mu N is gross slip (T >= mu N has no static answer); stay below 1",
        "< 1",
    ),
    Example("0.5", "0.75"),
]
Coefficient = Annotated[float, quantity("fraction"), not_negative, Example("0.3")]
Share = Annotated[float, quantity("fraction"), share, Example('"1 %"')]
Memory = Annotated[float, quantity("memory"), positive, Example('"4 GB"')]
Name = Annotated[
    str,
    must(
        is_name,
        "is no name: use letters, digits, '-', '_' and '.'",
        "letters, digits, -, _ and .",
    ),
    Example('"my_damper"'),
]
#: The recipe and its parameters.
Geometry = Annotated[Mapping[str, Any], Example('{ recipe = "sphere_block", radius = "5 mm" }')]

#: the accuracy of a scene whose errors are not estimated
UNKNOWN = "unknown"


def _accuracy(value: Any) -> Any:
    """ "unknown", a share, or a table of shares."""
    if value is None or value == UNKNOWN:
        return value
    if isinstance(value, Mapping):
        if not value:
            raise ValueError('is empty; write for example { K_N_secant_raw = "1 %" }')
        return {str(name): _wanted_share(one, f"{name}: ") for name, one in value.items()}
    return _wanted_share(value)


def _wanted_share(value: Any, of: str = "") -> float:
    try:
        number = parse_quantity(value, "fraction")
    except InputError as error:
        raise ValueError(f'{of}{error}; or "{UNKNOWN}"' if not of else f"{of}{error}") from None
    if not 0.0 < number < 1.0:
        raise ValueError(f'{of}{number:g} is outside (0, 1); write for example "1 %" or 0.01')
    return number


#: "unknown", the largest error wanted, or those of numbers by their names
Accuracy = Annotated[
    Any,
    BeforeValidator(_accuracy),
    Example(
        '"1 %"', bounds=f'"{UNKNOWN}"; between 0 and 1; or a table of these by the names of numbers'
    ),
]


# -- annotations of a scene's tables ---------------------------------------------------------------


def path_of(steps: Sequence[str | int]) -> str:
    """The path in the file: "loads.normal[0]"."""
    return "".join(f"[{s}]" if isinstance(s, int) else f".{s}" for s in steps).lstrip(".")


#: annotations of a class's fields, by name
hints = partial(typing.get_type_hints, include_extras=True)


def must_be_given(f: Field[Any]) -> bool:
    """Whether a field of a table has no default."""
    return f.default is MISSING and f.default_factory is MISSING


def without_notes(hint: Any) -> Any:
    """The annotation without its notes, and of what may be None the other."""
    while get_origin(hint) in (Annotated, Union, types.UnionType):
        hint = next(kind for kind in get_args(hint) if kind is not type(None))
    return hint


def named_table(hint: Any) -> Any:
    """Class of the tables by name, [measured.NAME], that a key holds; None for another key."""
    inner = without_notes(hint)
    item = without_notes(get_args(inner)[1]) if get_origin(inner) is Mapping else None
    return item if is_dataclass(item) else None


def hint_at(scene: type[Any], steps: Sequence[str | int]) -> Any:
    """The annotation at a place of a kind of scene: tables, the name of a key, place in a list."""
    wanted: Any = scene
    for step in steps:
        inner = without_notes(wanted)
        if is_dataclass(inner):
            wanted = hints(inner).get(str(step), Any)
        elif get_origin(inner) is Mapping:
            wanted = get_args(inner)[1]
        elif get_origin(inner) is tuple:
            items = get_args(inner)
            wanted = items[0] if items[-1] is Ellipsis else items[min(int(step), len(items) - 1)]
    return wanted


def notes(hint: Any) -> Iterator[Any]:
    """Everything noted in an annotation and in what it is made of: validators as functions, and
    choices.
    """
    if get_origin(hint) is Annotated:
        for note in hint.__metadata__:
            yield note.func if isinstance(note, (AfterValidator, BeforeValidator)) else note
        yield from notes(get_args(hint)[0])
    elif get_origin(hint) is Literal:
        yield hint
    elif get_origin(hint) is not None:
        for inside in get_args(hint):
            yield from notes(inside)


def quantity_kind(hint: Any) -> str:
    """Kind of the quantity, or the unit of a bare number; "" of what is none."""
    return next((n.kind for n in notes(hint) if isinstance(n, Note) and n.kind), "")
