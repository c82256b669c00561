"""What is wrong with a value of a scene and what to write instead, from pydantic's errors."""

from __future__ import annotations

import difflib
import types
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from upd.errors import did_you_mean
from upd.scene.base import INSIDE
from upd.scene.forced import FORCED, FORCED_ONLY
from upd.scene.quantities import Example, hint_at, hints, must_be_given, path_of, without_notes
from upd.scene.seated import SEATED, SEATED_ONLY, SeatedScene
from upd.scene.toml import toml_value

#: pydantic's kinds of errors, or how they begin -> what a value is not
_NOT = {
    "tuple": "list",
    "dict": "table",
    "mapping": "table",
    "dataclass": "table",
    "string": "text",
    "int": "whole number",
    "float": "number",
    "finite_number": "finite number",
}


def sentence(error: Any, scene: type[Any]) -> str:
    """One problem of a scene: its path in the file, what is wrong, and what to write instead."""
    # pydantic marks an error of a table's key by one more step
    location = tuple(step for step in error["loc"] if step != "[key]")
    return f"{path_of(location) or 'scene'}: {_fault(error, location, scene)}"


def _fault(error: Any, location: Sequence[Any], scene: type[Any]) -> str:
    kind, value = error["type"], error["input"]
    if kind == "value_error":
        return str(error["msg"]).removeprefix("Value error, ")
    if kind == "unexpected_keyword_argument":
        known = _keys(hint_at(scene, location[:-1])) or _keys(scene)
        others = f"known here: {', '.join(known)}"
        return f"unknown key{did_you_mean(location[-1], known, others)}"
    if kind in ("missing", "missing_argument"):
        return f"is missing{_addition(location, scene)}"
    wanted = hint_at(scene, location)
    example = _example(wanted, _default(location, scene))
    if kind == "too_long":
        return f"has {len(value)} values; write {example}"
    if kind == "literal_error":
        return _other_choice(
            value, Literal[FORCED, SEATED] if location == ("analysis",) else wanted
        )
    what = next((word for begin, word in _NOT.items() if kind.startswith(begin)), "")
    quotes = ", quotes included" if '"' in example and isinstance(value, str) else ""
    quotes = ", without quotes" if kind.startswith(("int", "float")) else quotes
    fault = f"is no {what}" if what else "does not fit here"
    return f"{value!r} {fault}; write for example {example}{quotes}"


def _addition(location: Sequence[Any], scene: type[Any]) -> str:
    """The remedy for a key or an item that is missing."""
    if location == ("analysis",):
        name, tables = (SEATED, SEATED_ONLY) if scene is SeatedScene else (FORCED, FORCED_ONLY)
        return (
            f'; add analysis = "{name}", or remove the tables that only it has '
            f"({', '.join(tables)})"
        )
    if isinstance(location[-1], int):
        return f"; write {_example(hint_at(scene, location[:-1]))}"
    return f"; add for example {location[-1]} = {_example(hint_at(scene, location))}"


def _other_choice(value: Any, wanted: Any) -> str:
    choices = [toml_value(choice) for choice in get_args(without_notes(wanted))]
    if len(choices) == 1:
        return f"{value!r} is not known; write {choices[0]}"
    near = difflib.get_close_matches(toml_value(value), choices, 1)
    meant = f", did you mean {near[0]}?" if near else ""
    return f"{value!r} is none of its values{meant}; write one of {', '.join(choices)}"


def _default(location: Sequence[Any], scene: type[Any]) -> Any:
    """The default of a key, None when it has none."""
    table = without_notes(hint_at(scene, location[:-1]))
    if not location or not is_dataclass(table):
        return None
    found = next((f.default for f in fields(table) if f.name == location[-1]), None)
    return None if found is MISSING else found


def _keys(wanted: Any) -> list[str]:
    """Keys of the table at a place; none when its keys are free."""
    cls = without_notes(wanted)
    return [f.name for f in fields(cls) if f.name not in INSIDE] if is_dataclass(cls) else []


def _example(wanted: Any, default: Any = None) -> str:
    """TOML that would do."""
    return _items(wanted, default)[0]


def _items(wanted: Any, default: Any = None) -> tuple[str, ...]:
    """TOML of one or more values that would do."""
    origin, inside = get_origin(wanted), get_args(wanted)
    if origin is Annotated:
        given = next((note for note in wanted.__metadata__ if isinstance(note, Example)), None)
        return given.values if given else _items(inside[0], default)
    if origin in (Union, types.UnionType):
        return _items(next(kind for kind in inside if kind is not type(None)), default)
    if origin is Literal:
        return tuple(map(toml_value, inside))
    if origin is tuple:
        items = _items(inside[0]) if inside[-1] is Ellipsis else [_example(kind) for kind in inside]
        return (f"[{', '.join(items)}]",)
    if origin is Mapping:
        return (f"{{ key = {_example(inside[1])} }}",)
    if is_dataclass(wanted):
        return (_table(wanted),)
    usual = {int: "12", float: "0.5", str: '"text"'}
    plain = isinstance(default, (int, float, str)) and not isinstance(default, bool) and default
    return (toml_value(default) if plain else usual.get(wanted, '"text"'),)


def _table(cls: Any) -> str:
    """An inline table with the keys that must be there, or with the first one."""
    known: tuple[Field[Any], ...] = fields(cls)
    needed = [f for f in known if must_be_given(f)]
    keys = [
        f"{f.name} = {_example(hints(cls)[f.name], None if f.default is MISSING else f.default)}"
        for f in needed or known[:1]
    ]
    return f"{{ {', '.join(keys)} }}"
