"""Annotations of a scene's tables: the one at a path, and what it notes of a value."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, is_dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import AfterValidator, BeforeValidator

from upd.scene.quantities import Noted, QuantityReader


def path_of(steps: Sequence[str | int]) -> str:
    """The path in the file: "loads.normal[0]"."""
    return "".join(f"[{s}]" if isinstance(s, int) else f".{s}" for s in steps).lstrip(".")


def hints(cls: Any) -> dict[str, Any]:
    """Annotations of a class's fields, by name."""
    return typing.get_type_hints(cls, include_extras=True)


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
    readers = (n.kind for n in notes(hint) if isinstance(n, (QuantityReader, Noted)) and n.kind)
    return next(readers, "")
