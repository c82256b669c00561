"""The [geometry] table of a scene: which recipe, and its parameters in mm."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from upd.errors import InputError
from upd.mesh import recipes
from upd.mesh.recipe_modules import is_file
from upd.units import parse_quantity

#: Parameters of a recipe that may be "auto".
_AUTO = ("patch", "core_depth", "divisions")
#: Parameters of a recipe that the [mesh] table sets.
CHOSEN_BY_MESH = {
    "symmetry": "mesh.symmetry",
    "element_nodes": "mesh.element",
    "arrangement": "modes.arrangements",
    "damper": 'want ("free", "glued")',
}
#: Largest whole number: counts beyond it fill any memory.
_MOST = 100_000


def recipe_path(recipe: str, folder: Path) -> str:
    """A ready recipe's name, or the absolute path of the user's file, which the scene gives
    relative to its own folder.
    """
    return str((folder / recipe).resolve()) if is_file(recipe) else recipe


def geometry_parameters(
    table: Mapping[str, Any], folder: Path, own: Sequence[str] = ()
) -> tuple[dict[str, Any], list[str]]:
    """Parameters of the recipe in mm from the scene's [geometry] table, and the problems found.

    `own`: those no other table chooses.
    """
    recipe = table.get("recipe")
    if not isinstance(recipe, str):
        return {}, ["geometry.recipe: is missing: name a recipe or a .py file"]
    try:
        cls = recipes.parameters(recipe_path(recipe, folder))
    except InputError as error:
        return {}, [f"geometry.recipe: {error}"]
    known = {f.name: f for f in fields(cls)}
    out: dict[str, Any] = {}
    problems: list[str] = []
    for key, value in table.items():
        if key == "recipe":
            continue
        where = f"geometry.{key}"
        if key in CHOSEN_BY_MESH and key not in own:
            problems.append(f"{where}: set {CHOSEN_BY_MESH[key]} instead")
        elif key not in known:
            near = difflib.get_close_matches(key, known, 1)
            problems.append(
                f"{where}: unknown key"
                + (f", did you mean {near[0]!r}?" if near else f"; known here: {', '.join(known)}")
            )
        elif value == "auto":
            if key in _AUTO:
                out[key] = value
            else:
                problems.append(f'{where}: cannot be "auto"; give it a value')
        else:
            read = _reader(known[key].metadata.get("quantity"), known[key].type)
            try:
                out[key] = read(value)
            except InputError as error:
                problems.append(f"{where}: {error}")
    if not problems:
        # What "auto" stands for is chosen later and fits: problems of its stand-in are not the
        # user's.
        chosen = {key for key, value in out.items() if value == "auto"}
        try:
            recipes.made(
                recipe_path(recipe, folder),
                {key: value for key, value in out.items() if key not in chosen},
            )
        except InputError as error:
            message = [line.strip() for line in str(error).splitlines()]
            problems += [
                f"geometry: {line}"
                for line in message
                if not any(f"{key}:" in line for key in chosen)
            ]
    return out, problems


def _reader(quantity: str | None, kind: Any) -> Callable[[Any], Any]:
    def read(value: Any) -> Any:
        if quantity is not None:
            return parse_quantity(value, quantity)
        if "int" in str(kind) and "float" not in str(kind):
            if isinstance(value, bool) or not isinstance(value, int):
                raise InputError(
                    f"{value!r} is not a whole number; write digits without quotes, for example 12"
                )
            if message := never(value):
                raise InputError(message)
            return value
        if "float" in str(kind):
            return parse_quantity(value, "fraction")
        return value

    return read


def never(value: Any) -> str:
    """What no key of a scene takes, though a number could be made of it.

    True and false, numbers beyond all counts.
    """
    if isinstance(value, bool):
        return f"{str(value).lower()} is no value of a scene; write a number, or text in quotes"
    if isinstance(value, bytes):
        return "is bytes; write text"
    if isinstance(value, int) and abs(value) > _MOST:
        return f"is more than the largest whole number of a scene, {_MOST}; give a smaller one"
    return ""
