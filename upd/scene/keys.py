"""Every key of a scene with its meaning, unit, default, bounds and effect on cost.

Every text exists once: a meaning is the entry of the dataclass's docstring, its last sentence
"Cost: ..." the effect on cost; unit and bounds are those of the annotation that checks the value.
A recipe's parameters are described by its own dataclass in the same way.
"""

from __future__ import annotations

import difflib
import inspect
import math
import re
import tomllib
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from itertools import groupby
from textwrap import wrap
from types import SimpleNamespace
from typing import Any, Literal, get_args, get_origin

from upd.errors import InputError
from upd.mesh import recipes
from upd.mesh.fields import bounds_of
from upd.mesh.recipe_modules import READY
from upd.scene import quantities as q
from upd.scene.base import INSIDE
from upd.scene.rotation import damper_mass
from upd.scene.toml import put_back, toml_key, toml_value
from upd.units import UNITS, parse_quantity, quantity_text, unit_inside

#: tables of physical inputs, and such inputs of other tables: what may be known within limits
_INPUT_TABLES = ("material", "materials", "stiffness", "damper", "geometry")
_INPUTS = (
    "contact.friction",
    *(f"loads.{name}" for name in ("normal", "centrifugal", "mass", "radius", "speed")),
    *(f"excitation.{name}" for name in ("force", "damping")),
    "response.damping",
)
#: tables at the end: of all scenes alike, and not physical
_LAST = ("mesh", "solver", "left_out")
#: values of inputs that follow from others
_NO_VALUE = ("none", '"auto"', '"from speed"')
_MUST = "must be given"
_NONE = "none"
#: columns of a scene's file
_WIDTH = 100
#: stands for the names of tables
_NAME = "NAME"
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
    kind
        Of its quantity, as in `upd.units.UNITS`, or the unit of a bare number; "" for texts, counts
        and ratios.
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
    kind: str
    default: str
    bounds: str
    cost: str
    value: str = ""
    given: bool = False
    writable: bool = True
    uncertain: bool = False

    @property
    def unit(self) -> str:
        """Inside; "" for texts, counts and ratios."""
        return unit_inside(self.kind) if self.kind in UNITS else self.kind

    @property
    def path(self) -> str:
        """In the file, with its tables: "contact.friction"."""
        return ".".join(self.steps)

    @property
    def name(self) -> str:
        """Without its table."""
        return self.steps[-1]


def scene_keys(scene: Any, *, absent: bool = False) -> list[SceneKey]:
    """The keys of a loaded scene with their values, its recipe's parameters among them; at last,
    where asked for, those of tables by name, [measured.NAME], of which it has none.
    """
    keys = table_keys(type(scene), scene, given=tomllib.loads(scene.text))
    given = {one.path: one.given for one in scene.uncertain.values()}
    out = [
        replace(key, value=toml_value(given[key.path])) if key.path in given else key
        for key in keys
    ]
    of_class = table_keys(type(scene)) if absent else ()
    return out + [
        key for key in of_class if _NAME in key.steps and not getattr(scene, key.steps[0])
    ]


def recipe_keys(recipe: str, params: Any = None, path: Steps = ()) -> list[SceneKey]:
    """The parameters of a recipe, of `params` or with their defaults; lengths in mm.

    Parameters
    ----------
    recipe
        Ready name or the path of a .py file.
    params
        Its values by attributes.
    path
        Tables in front of every name: of a scene, "geometry".
    """
    made = recipes.made(recipe, {}) if params is None else params
    # the unit has a column of its own
    return [
        replace(key, meaning=_UNIT.sub("", key.meaning), given=key.value != key.default)
        for key in table_keys(recipes.parameters(recipe), made, path=path)
    ]


def entries(cls: type[Any]) -> dict[str, str]:
    """Entries of the sections Attributes and Parameters of a class's docstring, by name; those of
    the classes it is derived from too.
    """
    out = entries(cls.__base__) if cls.__base__ not in (None, object) else {}
    for _, section in _SECTION.findall(inspect.cleandoc(cls.__doc__ or "")):
        names: list[str] = []
        for line in section.splitlines():
            if line and not line.startswith(" "):
                names = [name.strip() for name in line.partition(" : ")[0].split(",")]
                out |= dict.fromkeys(names, "")
            for name in names if line.startswith(" ") else ():
                out[name] = f"{out.get(name, '')} {line.strip()}".strip()
    return out


def is_input(steps: Sequence[str | int]) -> bool:
    """Whether a key is a physical input, which may be known within limits; not a choice."""
    path = ".".join(step for step in steps if isinstance(step, str))
    return steps[0] in _INPUT_TABLES or path in _INPUTS


def input_kind(scene: type[Any], recipe: str, steps: Sequence[str | int]) -> str:
    """Kind of the quantity of a physical input, as in `upd.units.UNITS`; "" for what is none.

    Parameters
    ----------
    scene
        Class of the scene.
    recipe
        Name or path.
    steps
        Tables, the name of the key, and its place in a list.
    """
    if steps[0] == "geometry":
        known = {("geometry", f.name): f for f in fields(recipes.parameters(recipe))}
        found = known.get(tuple(steps))  # type: ignore[arg-type]
        return "" if found is None else str(found.metadata.get("quantity") or "")
    hint = q.hint_at(scene, steps)
    scalar = is_input(steps) and get_origin(q.without_notes(hint)) is not tuple
    return q.quantity_kind(hint) if scalar else ""


def scalar_input(
    scene: Any, keys: Mapping[str, SceneKey], path: str, others: Sequence[str] = ()
) -> tuple[str, float]:
    """Kind of the quantity of an input, as in `upd.units.UNITS`, and value in the unit inside.

    Parameters
    ----------
    scene
        Whose input it is: a forced response.
    keys
        Of the scene, by their paths.
    path
        Of the input.
    others
        Paths that may be meant beside the scene's own inputs.

    Raises
    ------
    InputError
        Where it is no scalar input, or has no value.
    """
    key = keys.get(path)
    kind = "" if key is None else input_kind(type(scene), scene.recipe, key.steps)
    if key is None or kind not in UNITS:
        inputs = list(dict.fromkeys([*others, *(k.path for k in keys.values() if k.uncertain)]))
        near = difflib.get_close_matches(path, inputs, 3)
        meant = f"; did you mean {' or '.join(near)}?" if near else ""
        raise InputError(f"is no scalar input of the scene{meant}. Inputs: {', '.join(inputs)}")
    if path in scene.uncertain:
        return kind, scene.uncertain[path].value
    if key.value in _NO_VALUE:
        value = damper_mass(scene) if path == "damper.mass" else None
        if value is None:
            raise InputError(f"has no value to begin with ({key.value}); give it one in the scene")
        return kind, value
    return kind, parse_quantity(tomllib.loads(f"v = {key.value}")["v"], kind)


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


def table_keys(
    cls: type[Any],
    value: Any = None,
    usual: Any = None,
    path: Steps = (),
    given: Any = None,
) -> Iterator[SceneKey]:
    """Keys of one table, first its own, then those of the tables in it; what must be given first.

    Parameters
    ----------
    cls
        Of the table: of a scene, or of a recipe's parameters.
    value
        The table itself; without it the keys have no values.
    usual
        The table that a scene without it has, if any.
    path
        Tables around it.
    given
        What the file gives of it.
    """
    texts, types = entries(cls), q.hints(cls)
    tables: list[Iterator[SceneKey]] = []
    known = [f for f in fields(cls) if f.init and f.name not in INSIDE]
    for f in sorted(known, key=lambda f: (f.name in _LAST, not q.must_be_given(f))):
        here = getattr(value, f.name) if value is not None else None
        mine = given.get(f.name, {}) if isinstance(given, Mapping) else {}
        hint, where = types[f.name], (*path, f.name)
        inner: Any = q.without_notes(hint)
        default = f.default_factory() if f.default_factory is not MISSING else f.default
        default = default if usual is None else getattr(usual, f.name)
        if f.name == "geometry" and value is not None:
            tables.append(_geometry(value, mine))
        elif is_dataclass(inner) and (here is not None or value is None):
            table_default = default if is_dataclass(default) else None
            tables.append(table_keys(inner, here, table_default, where, mine))  # type: ignore[arg-type]
        elif item := q.named_table(hint):
            for name, one in ({_NAME: None} if here is None else here).items():
                own = mine.get(name, {}) if isinstance(mine, Mapping) else {}
                tables.append(table_keys(item, one, None, (*where, name), own))
        else:
            # of a recipe's parameter its field has them
            kind = str(f.metadata.get("quantity") or q.quantity_kind(hint))
            meaning, _, cost = texts.get(f.name, "").replace("``", "").partition("Cost:")
            yield SceneKey(
                where,
                meaning.strip(),
                kind,
                _MUST if default is MISSING else _text(default, kind),
                bounds_of(f, hint) or _bounds(hint),
                cost.strip().rstrip(".") or _NONE,
                "" if value is None else _text(here, kind),
                isinstance(given, Mapping) and f.name in given,
                uncertain=kind in UNITS and is_input(where),
            )
    for inside in tables:
        yield from inside


def _geometry(scene: Any, given: Mapping[str, Any]) -> Iterator[SceneKey]:
    """The recipe and its parameters as the scene has them."""
    yield SceneKey(
        ("geometry", "recipe"),
        "Name of a ready recipe, or the path of a .py file of your own.",
        "",
        _MUST,
        f"{', '.join(READY)}, or a .py file",
        "none",
        toml_value(scene.recipe),
        True,
    )
    values = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    # not the recipe's own object: what "auto" stands for follows from the loads
    numbers = {name: None if value == "auto" else value for name, value in values.items()}
    known = dict.fromkeys(f.name for f in fields(recipes.parameters(scene.recipe)))
    params = SimpleNamespace(**known | numbers)
    for key in recipe_keys(scene.recipe, params, ("geometry",)):
        if key.name not in values:
            # what another table chooses: the elements of the mesh, its symmetry
            continue
        value = values[key.name]
        # what a file could give: "auto" is given or not at all
        plain = isinstance(value, (str, int)) or (isinstance(value, float) and math.isfinite(value))
        yield replace(
            key,
            value='"auto"' if value == "auto" else key.value,
            given=key.name in given,
            writable=plain and value != "auto",
        )


def _bounds(hint: Any) -> str:
    """In a few words: a list, choices, rules."""
    inner = q.without_notes(hint)
    out = []
    if get_origin(inner) is tuple:
        inside = get_args(inner)
        out.append("a list" if inside[-1] is Ellipsis else f"a list of {len(inside)}")
    noted, whole = list(q.notes(hint)), "whole number " * (inner is int)
    choices = [str(c) for n in noted if get_origin(n) is Literal for c in get_args(n)]
    out += [", ".join(choices)] if choices else []
    known = [n for n in noted if isinstance(n, q.Note) and n.bounds]
    out += [f"{whole}{n.bounds}" for n in known if n.read is not None]
    out += [n.bounds for n in known if n.read is None]
    return "; ".join(out)


def _text(value: Any, kind: str) -> str:
    """A value as TOML, quantities with their unit."""
    if value is None:
        return _NONE
    if isinstance(value, (tuple, list)):
        return f"[{', '.join(_text(v, kind) for v in value)}]"
    if is_dataclass(value):
        types = q.hints(type(value))
        inside = (
            f"{toml_key(f.name)} = {_text(getattr(value, f.name), q.quantity_kind(types[f.name]))}"
            for f in fields(value)
        )
        return f"{{ {', '.join(inside)} }}"
    if isinstance(value, float) and kind in UNITS and kind != "fraction":
        return toml_value(quantity_text(value, kind))
    return toml_value(value)


# -- a loaded scene written as a file again, with every value it has -------------------------------


def scene_as_run(scene: Any) -> str:
    """The scene with every value, those that its file does not give marked "default".

    Reads back as the same scene.
    """
    head = '# The scene as run: every value. Those marked "default" were not given.\n'
    return head + _written(scene, given_data(scene), commented=False)


def scene_to_start_from(scene: Any, name: str) -> str:
    """The scene under another name, each key with its meaning, unit, bounds and effect on cost."""
    head = (
        f'# Begun as a copy of {scene.name}. Lines marked "default" may be left out.\n'
        "# A quantity carries its unit; in brackets: the unit of the bounds, and the bounds.\n\n"
    )
    return head + _written(scene, given_data(scene) | {"name": name}, commented=True)


def given_data(scene: Any, without: Container[str] = ()) -> dict[str, Any]:
    """The scene's data with everything that its file gives; limits of some paths left out."""
    data = tomllib.loads(scene.text)
    for one in scene.uncertain.values():
        if one.path not in without:
            data = put_back(data, one.steps, one.given)
    return data


def _written(scene: Any, given: Mapping[str, Any], *, commented: bool) -> str:
    lines: list[str] = []
    for tables, keys in groupby(scene_keys(scene), key=lambda k: k.steps[:-1]):
        if tables:
            lines += ["", f"[{'.'.join(map(toml_key, tables))}]"]
        for key in keys:
            if commented:
                lines += ["", *comment(key)]
            lines.append(_line(key, given))
    return "\n".join(lines).lstrip("\n") + "\n"


def comment(key: SceneKey) -> list[str]:
    """What a key means, in lines of a file."""
    facts = "; ".join(fact for fact in (key.unit, key.bounds) if fact)
    # a sign and its number stay on one line
    facts = re.sub(r"([<>]=?) ", "\\1\u00a0", facts)
    cost = "" if key.cost == _NONE else f"Cost: {key.cost}."
    text = " ".join(filter(None, (key.meaning, facts and f"({facts})", cost)))
    lines = wrap(text, _WIDTH, initial_indent="# ", subsequent_indent="# ")
    return [line.replace("\u00a0", " ") for line in lines]


def _line(key: SceneKey, given: Mapping[str, Any]) -> str:
    name = toml_key(key.name)
    if key.given:
        value: Any = given
        for step in key.steps:
            value = value[step]
        return f"{name} = {toml_value(value)}"
    if key.value != key.default:
        # put in for a word like "from speed", or worked out of another key
        return f"# {name} = {key.value}    # follows from other keys"
    # what no file can give: nothing, or a default of a recipe of one's own that is no value of TOML
    if key.value == "none" or not key.writable:
        return f"# {name} = {key.value}    # default"
    return f"{name} = {key.value}    # default"
