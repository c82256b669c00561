"""Every key of a scene with its meaning, unit, default, bounds and effect on cost.

Nothing is said twice: a meaning is the entry of the dataclass's docstring, its last sentence
"Cost: ..." the effect on cost; unit and bounds are those of the annotation that checks the value.
A recipe's parameters are told the same way, from its own dataclass.
"""

from __future__ import annotations

import difflib
import inspect
import math
import re
import tomllib
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass, replace
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import AfterValidator, BeforeValidator

from upd.errors import InputError
from upd.mesh import recipes
from upd.mesh.fields import table
from upd.mesh.recipe_modules import READY
from upd.scene.base import INSIDE, OutputNames
from upd.scene.quantities import Noted, QuantityReader, Rule
from upd.scene.toml import toml_key, toml_value
from upd.units import UNITS, quantity_text, unit_inside

#: tables of physical inputs, and such inputs of other tables: what may be known within limits
_INPUT_TABLES = ("material", "materials", "stiffness", "damper", "geometry")
_INPUTS = (
    "contact.friction",
    *(f"loads.{name}" for name in ("normal", "centrifugal", "mass", "radius", "speed")),
    *(f"excitation.{name}" for name in ("force", "damping")),
    "response.damping",
)
_MUST = "must be given"
_NONE = "none"
#: value of a key of no scene
_UNKNOWN = object()
Steps = tuple[str, ...]
_UNIT = re.compile(r", (?:mm|degrees)(?=[.;:]|$)")
_SECTION = re.compile(
    r"^(Attributes|Parameters)\n-+\n(.*?)(?=^\w+\n-+$|\Z)", re.DOTALL | re.MULTILINE
)


@dataclass(frozen=True)
class SceneKey:
    """One key of a scene.

    Attributes
    ----------
    steps
        Its tables in the file and its name.
    meaning
        From the docstring.
    unit
        Inside; "" for texts, counts and ratios.
    units
        All that are understood.
    default
        As TOML, "none", or "must be given".
    bounds
        What the value must hold, and its choices.
    cost
        What it does to seconds and memory; "none" where that is nothing worth a word.
    value
        Of the scene, as TOML; "" without one.
    given
        Whether the file gives it.
    writable
        Whether a file could give the value.
    uncertain
        Whether it is an input that may be known within limits, "0.6 +- 0.1".
    """

    steps: tuple[str, ...]
    meaning: str
    unit: str
    units: tuple[str, ...]
    default: str
    bounds: str
    cost: str
    value: str = ""
    given: bool = False
    writable: bool = True
    uncertain: bool = False

    @property
    def path(self) -> str:
        """In the file, with its tables: "contact.friction"."""
        return ".".join(self.steps)

    @property
    def table(self) -> str:
        """The table it stands in, "" for the scene itself."""
        return ".".join(self.steps[:-1])

    @property
    def name(self) -> str:
        """Without its table."""
        return self.steps[-1]


def scene_keys(scene: Any) -> list[SceneKey]:
    """The keys of a loaded scene with their values, its recipe's parameters among them."""
    keys = _walk(type(scene), scene, None, (), tomllib.loads(scene.text))
    given = {one.path: one.given for one in scene.uncertain.values()}
    return [
        replace(key, value=toml_value(given[key.path])) if key.path in given else key
        for key in keys
    ]


def absent_keys(scene: Any) -> list[SceneKey]:
    """The keys of tables by name, [measured.NAME], of which a loaded scene has none."""
    empty = {
        name
        for name, hint in typing.get_type_hints(type(scene), include_extras=True).items()
        if name not in INSIDE
        and get_origin(inner := _plain(hint)) is Mapping
        and is_dataclass(_plain(get_args(inner)[1]))
        and not getattr(scene, name)
    }
    return [key for key in class_keys(type(scene)) if key.steps[0] in empty]


def class_keys(scene: type[Any]) -> list[SceneKey]:
    """The keys of a kind of scene; those of its recipe are told by `recipe_keys`."""
    return list(_walk(scene, None, None, (), {}))


def recipe_keys(recipe: str, params: Any = None, path: Steps = ()) -> list[SceneKey]:
    """The parameters of a recipe, of `params` or with their defaults; lengths in mm.

    Parameters
    ----------
    recipe
        Ready name or the path of a .py file.
    params
        The recipe's own object.
    path
        Tables in front of every name: of a scene, "geometry".
    """
    cls = recipes.parameters(recipe)
    told = entries(cls)
    known = {f.name: f for f in fields(cls)}
    out = []
    for row in table(recipes.made(recipe, {}) if params is None else params, here=False):
        f = known[row.name]
        meaning, cost = _parted(told.get(row.name, ""))
        # the unit has a column of its own
        meaning = _UNIT.sub("", meaning)
        kind = str(f.metadata.get("quantity") or "")
        out.append(
            SceneKey(
                (*path, row.name),
                meaning,
                row.unit,
                _units(kind),
                _MUST if f.default is MISSING else _text(f.default, kind),
                row.bounds,
                cost,
                _text(row.value, kind),
                row.value != f.default,
            )
        )
    return out


def params_of(scene: Any) -> Any:
    """The recipe's own object of a loaded scene; what "auto" stands for has its default."""
    numbers = {k: v for k, v in scene.geometry.items() if k != "recipe" and v != "auto"}
    return recipes.made(scene.recipe, numbers)


def entries(cls: type[Any]) -> dict[str, str]:
    """Entries of the sections Attributes and Parameters of a class's docstring, by name."""
    out: dict[str, str] = {}
    for _, section in _SECTION.findall(inspect.getdoc(cls) or ""):
        names: list[str] = []
        for line in section.splitlines():
            if line and not line.startswith(" "):
                names = [name.strip() for name in line.partition(" : ")[0].split(",")]
            for name in names if line.startswith(" ") else ():
                out[name] = f"{out.get(name, '')} {line.strip()}".strip()
    return out


def is_input(steps: Sequence[str | int]) -> bool:
    """Whether a key is a physical input, which may be known within limits; not a choice."""
    path = ".".join(step for step in steps if isinstance(step, str))
    return steps[0] in _INPUT_TABLES or path in _INPUTS


def quantity_kind(scene: type[Any], steps: Sequence[str | int]) -> str:
    """Kind of the quantity at a place of a kind of scene, "" for what is none.

    Parameters
    ----------
    scene
        Its class.
    steps
        Tables, the name of the key, and its place in a list.
    """
    wanted: Any = scene
    for step in steps:
        inner = _plain(wanted)
        if is_dataclass(inner):
            hints = typing.get_type_hints(inner, include_extras=True)
            wanted = hints.get(str(step), Any)
        elif get_origin(inner) is Mapping or get_origin(inner) is tuple:
            # of a list, that of its items
            wanted = get_args(inner)[get_origin(inner) is Mapping]
        else:
            return ""
    return "" if get_origin(_plain(wanted)) is tuple else _kind(wanted)


def chosen_keys(keys: Sequence[SceneKey], asked: str) -> list[SceneKey]:
    """The keys a person means: a path, a table, or the last word of one.

    Raises InputError with the nearest when there is none.
    """
    found = [k for k in keys if k.path == asked]
    found = found or [k for k in keys if k.path.startswith(f"{asked}.")]
    found = found or [k for k in keys if k.path.endswith(f".{asked}")]
    if found:
        return found
    names = [*dict.fromkeys([k.path for k in keys] + [k.name for k in keys])]
    near = difflib.get_close_matches(asked, names, 3)
    raise InputError(
        f"{asked}: not a key here"
        + (f"; did you mean {' or '.join(near)}?" if near else "; leave it out to see all keys")
    )


def _walk(cls: type[Any], value: Any, usual: Any, path: Steps, given: Any) -> Iterator[SceneKey]:
    """Keys of one table, first its own, then those of the tables in it.

    ``usual`` is the table that a scene without it has, if any.
    """
    told, hints = entries(cls), typing.get_type_hints(cls, include_extras=True)
    known = [f for f in fields(cls) if f.name not in INSIDE]
    for f in sorted(known, key=lambda f: _is_table(f, hints[f.name], value)):
        here = getattr(value, f.name) if value is not None else None
        mine = given.get(f.name, {}) if isinstance(given, Mapping) else {}
        where = (*path, f.name)
        inner = _plain(hints[f.name])
        default = _default(f) if usual is None else getattr(usual, f.name)
        if f.name == "geometry" and value is not None:
            yield from _geometry(value, mine)
        elif is_dataclass(inner) and (here is not None or value is None):
            table_default = default if is_dataclass(default) else None
            yield from _walk(inner, here, table_default, where, mine)  # type: ignore[arg-type]
        elif get_origin(inner) is Mapping and is_dataclass(item := _plain(get_args(inner)[1])):
            for name, one in ({"NAME": None} if here is None else here).items():
                yield from _walk(
                    item,  # type: ignore[arg-type]
                    one,
                    None,
                    (*where, name),
                    mine.get(name, {}) if isinstance(mine, Mapping) else {},
                )
        else:
            has = isinstance(given, Mapping) and f.name in given
            yield _leaf(
                where,
                told.get(f.name, ""),
                hints[f.name],
                default,
                _UNKNOWN if value is None else here,
                given=has,
            )


def _is_table(f: Field[Any], hint: Any, value: Any) -> bool:
    inner = _plain(hint)
    if is_dataclass(inner):
        return value is None or getattr(value, f.name) is not None
    return f.name == "geometry" or (
        get_origin(inner) is Mapping and is_dataclass(_plain(get_args(inner)[1]))
    )


def _default(f: Field[Any]) -> Any:
    return f.default_factory() if f.default_factory is not MISSING else f.default


def _leaf(
    steps: Steps, entry: str, hint: Any, default: Any, value: Any, *, given: bool
) -> SceneKey:
    meaning, cost = _parted(entry)
    notes, kind = list(_notes(hint)), _kind(hint)
    return SceneKey(
        steps,
        meaning,
        unit_inside(kind) if kind in UNITS else kind,
        _units(kind),
        _MUST if default is MISSING else _text(default, kind),
        _bounds(hint, notes),
        cost,
        "" if value is _UNKNOWN else _text(value, kind),
        given,
        uncertain=kind in UNITS and is_input(steps),
    )


def _kind(hint: Any) -> str:
    """Of the quantity, "" of what is none."""
    notes = list(_notes(hint))
    kinds = [reader.kind for n in notes if isinstance(reader := _func(n), QuantityReader)]
    kinds += [n.kind for n in notes if isinstance(n, Noted) and n.kind]
    return kinds[0] if kinds else ""


def _geometry(scene: Any, given: Mapping[str, Any]) -> Iterator[SceneKey]:
    """The recipe and its parameters as the scene has them."""
    yield SceneKey(
        ("geometry", "recipe"),
        "Name of a ready recipe, or the path of a .py file of your own.",
        "",
        (),
        _MUST,
        f"{', '.join(READY)}, or a .py file",
        "none",
        toml_value(scene.recipe),
        True,
    )
    values = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    for key in recipe_keys(scene.recipe, params_of(scene), ("geometry",)):
        if key.name not in values:
            # what another table chooses: the elements of the mesh, its symmetry
            continue
        auto = values[key.name] == "auto"
        yield replace(
            key,
            value='"auto"' if auto else key.value,
            given=key.name in given,
            writable=_writable(values[key.name]),
            uncertain=bool(key.unit),
        )


def _writable(value: Any) -> bool:
    """Whether a file could give the parameter of a recipe; "auto" is given or not at all."""
    if isinstance(value, float):
        return math.isfinite(value)
    return isinstance(value, (str, int)) and value != "auto"


def _bounds(hint: Any, notes: Sequence[Any]) -> str:
    """In a few words: a list, choices, rules."""
    inner = _plain(hint)
    out = []
    if get_origin(inner) is tuple:
        inside = get_args(inner)
        out.append("a list" if inside[-1] is Ellipsis else f"a list of {len(inside)}")
    choices = [c for choice in _choices(hint) for c in get_args(choice)]
    out += [", ".join(map(str, choices))] if choices else []
    whole = inner is int
    rules = [_func(n) for n in notes]
    out += [f"{'whole number ' * whole}{r.bounds}" for r in rules if isinstance(r, Rule)]
    out += [n.bounds for n in notes if isinstance(n, Noted) and n.bounds]
    out += [", ".join(r.outputs) for r in rules if isinstance(r, OutputNames)]
    return "; ".join(out)


def _choices(hint: Any) -> Iterator[Any]:
    if get_origin(hint) is Literal:
        yield hint
    elif get_origin(hint) is not None:
        for inside in get_args(hint):
            yield from _choices(inside)


def _notes(hint: Any) -> Iterator[Any]:
    """Everything noted in an annotation and in what it is made of."""
    if get_origin(hint) is Annotated:
        yield from hint.__metadata__
        yield from _notes(get_args(hint)[0])
    elif get_origin(hint) is not None and get_origin(hint) is not Literal:
        for inside in get_args(hint):
            yield from _notes(inside)


def _func(note: Any) -> Any:
    return note.func if isinstance(note, (AfterValidator, BeforeValidator)) else None


def _plain(wanted: Any) -> Any:
    """The annotation without its notes, and of what may be None the other."""
    while get_origin(wanted) in (Annotated, Union, types.UnionType):
        wanted = next(kind for kind in get_args(wanted) if kind is not type(None))
    return wanted


def _parted(entry: str) -> tuple[str, str]:
    """Meaning and effect on cost."""
    meaning, _, cost = entry.replace("``", "").partition("Cost:")
    return meaning.strip(), cost.strip().rstrip(".") or _NONE


def _units(kind: str) -> tuple[str, ...]:
    return tuple(u for u in UNITS.get(kind, {}) if u)


def _text(value: Any, kind: str) -> str:
    """A value as TOML, quantities with their unit."""
    if value is None:
        return _NONE
    if isinstance(value, (tuple, list)):
        return f"[{', '.join(_text(v, kind) for v in value)}]"
    if is_dataclass(value):
        hints = typing.get_type_hints(type(value), include_extras=True)
        inside = (
            f"{toml_key(f.name)} = {_text(getattr(value, f.name), _kind(hints[f.name]))}"
            for f in fields(value)
        )
        return f"{{ {', '.join(inside)} }}"
    if isinstance(value, float) and kind in UNITS and kind != "fraction":
        return toml_value(quantity_text(value, kind))
    return toml_value(value)
