"""What is wrong with a value of a scene and what to write instead, from pydantic's errors."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from upd.scene.base import INSIDE
from upd.scene.forced import FORCED, FORCED_ONLY
from upd.scene.quantities import Example
from upd.scene.seated import SEATED, SEATED_ONLY, SeatedScene

#: pydantic's kinds of errors -> what a value is not
_NOT = {
    "tuple_type": "list",
    "dict_type": "table",
    "mapping_type": "table",
    "dataclass_type": "table",
    "string_type": "text",
    "string_sub_type": "text",
    "string_unicode": "text",
    "int_type": "whole number",
    "int_parsing": "whole number",
    "int_parsing_size": "whole number",
    "int_from_float": "whole number",
    "float_type": "number",
    "float_parsing": "number",
    "finite_number": "finite number",
}


def sentence(error: Any, scene: type[Any]) -> str:
    """One problem of a scene: its path in the file, what is wrong, and what to write instead."""
    # pydantic marks an error of a table's key by one more step
    location = tuple(step for step in error["loc"] if step != "[key]")
    path = (
        "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in location).lstrip(
            "."
        )
        or "scene"
    )
    kind, value = error["type"], error["input"]
    if kind == "value_error":
        return f"{path}: {str(error['msg']).removeprefix('Value error, ')}"
    if kind == "unexpected_keyword_argument":
        known = _keys(_annotation(location[:-1], scene)) or _keys(scene)
        near = difflib.get_close_matches(str(location[-1]), known, 1)
        return f"{path}: unknown key" + (
            f", did you mean {near[0]!r}?" if near else f"; known here: {', '.join(known)}"
        )
    if kind in ("missing", "missing_argument"):
        return f"{path}: is missing{_addition(location, scene)}"
    wanted = _annotation(location, scene)
    example = _example(wanted, _default(location, scene))
    if kind == "too_long":
        return f"{path}: has {len(value)} values; write {example}"
    if kind == "literal_error":
        wanted = Literal[FORCED, SEATED] if location == ("analysis",) else wanted
        return f"{path}: {_other_choice(value, wanted)}"
    what = f"is no {_NOT[kind]}" if kind in _NOT else "does not fit here"
    quotes = ", quotes included" if '"' in example and isinstance(value, str) else ""
    quotes = ", without quotes" if kind.startswith(("int", "float")) else quotes
    return f"{path}: {value!r} {what}; write for example {example}{quotes}"


def _addition(location: Sequence[Any], scene: type[Any]) -> str:
    """The remedy for a key or an item that is missing."""
    if location == ("analysis",):
        name, tables = (SEATED, SEATED_ONLY) if scene is SeatedScene else (FORCED, FORCED_ONLY)
        return (
            f'; add analysis = "{name}", or remove the tables that only it has '
            f"({', '.join(tables)})"
        )
    if isinstance(location[-1], int):
        return f"; write {_example(_annotation(location[:-1], scene))}"
    return f"; add for example {location[-1]} = {_example(_annotation(location, scene))}"


def _other_choice(value: Any, wanted: Any) -> str:
    choices = [_toml(choice) for choice in get_args(_plain(wanted))]
    near = difflib.get_close_matches(_toml(value), choices, 1)
    if len(choices) == 1:
        return f"{value!r} is not known; write {choices[0]}"
    return (
        f"{value!r} is none of its values"
        + (f", did you mean {near[0]}?" if near else "")
        + f"; write one of {', '.join(choices)}"
    )


def _annotation(location: Sequence[Any], scene: type[Any]) -> Any:
    """The annotation of what stands at a place of the scene."""
    wanted: Any = scene
    for step in location:
        inner = _plain(wanted)
        if is_dataclass(inner):
            wanted = _hints(inner).get(str(step), Any)
        elif get_origin(inner) is Mapping:
            wanted = get_args(inner)[1]
        elif get_origin(inner) is tuple:
            items = get_args(inner)
            wanted = items[0] if items[-1] is Ellipsis else items[min(int(step), len(items) - 1)]
    return wanted


def _default(location: Sequence[Any], scene: type[Any]) -> Any:
    """The default of a key, None when it has none."""
    table = _plain(_annotation(location[:-1], scene))
    if not location or not is_dataclass(table):
        return None
    found = next((f.default for f in fields(table) if f.name == location[-1]), None)
    return None if found is MISSING else found


def _hints(cls: Any) -> dict[str, Any]:
    return typing.get_type_hints(cls, include_extras=True)


def _plain(wanted: Any) -> Any:
    """The annotation without its notes, and of what may be None the other."""
    while get_origin(wanted) in (Annotated, Union, types.UnionType):
        wanted = next(kind for kind in get_args(wanted) if kind is not type(None))
    return wanted


def _keys(wanted: Any) -> list[str]:
    """Keys of the table at a place; none when its keys are free."""
    cls = _plain(wanted)
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
        return tuple(map(_toml, inside))
    if origin is tuple:
        items = _items(inside[0]) if inside[-1] is Ellipsis else [_example(kind) for kind in inside]
        return (f"[{', '.join(items)}]",)
    if origin is Mapping:
        return (f"{{ key = {_example(inside[1])} }}",)
    if is_dataclass(wanted):
        return (_table(wanted),)
    usual = {int: "12", float: "0.5", str: '"text"'}
    plain = isinstance(default, (int, float, str)) and not isinstance(default, bool) and default
    return (_toml(default) if plain else usual.get(wanted, '"text"'),)


def _table(cls: Any) -> str:
    """An inline table with the keys that must be there, or with the first one."""
    known: tuple[Field[Any], ...] = fields(cls)
    needed = [f for f in known if f.default is MISSING and f.default_factory is MISSING]
    keys = [
        f"{f.name} = {_example(_hints(cls)[f.name], None if f.default is MISSING else f.default)}"
        for f in needed or known[:1]
    ]
    return f"{{ {', '.join(keys)} }}"


def _toml(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)
