"""The [geometry] table of a scene: which recipe, and its parameters in mm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from typing import Any

from upd.errors import InputError, did_you_mean
from upd.mesh import recipes
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


def geometry_parameters(
    table: Mapping[str, Any], own: Sequence[str] = ()
) -> tuple[dict[str, Any], list[str]]:
    """Parameters of the recipe in mm from the scene's [geometry] table, and the problems found.

    `own`: those no other table chooses.
    """
    recipe = table.get("recipe")
    if not isinstance(recipe, str):
        return {}, ["geometry.recipe: is missing: name a recipe or a .py file"]
    try:
        cls = recipes.parameters(recipe)
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
            others = f"known here: {', '.join(known)}"
            problems.append(f"{where}: unknown key{did_you_mean(key, known, others)}")
        elif value == "auto" and key not in _AUTO:
            problems.append(f'{where}: cannot be "auto"; give it a value')
        else:
            try:
                out[key] = value if value == "auto" else _read(value, known[key])
            except InputError as error:
                problems.append(f"{where}: {error}")
    if not problems:
        # What "auto" stands for is chosen later and fits: problems of its stand-in are not the
        # user's.
        chosen = {key for key, value in out.items() if value == "auto"}
        try:
            recipes.made(recipe, {key: value for key, value in out.items() if key not in chosen})
        except InputError as error:
            message = [line.strip() for line in str(error).splitlines()]
            problems += [
                f"geometry: {line}"
                for line in message
                if not any(f"{key}:" in line for key in chosen)
            ]
    return out, problems


def _read(value: Any, parameter: Field[Any]) -> Any:
    """A value of a recipe's parameter, quantities in the unit inside. Raises InputError."""
    quantity, kind = parameter.metadata.get("quantity"), str(parameter.type)
    if quantity is not None or "float" in kind:
        return parse_quantity(value, quantity or "fraction")
    if "int" not in kind:
        return value
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(
            f"{value!r} is not a whole number; write digits without quotes, for example 12"
        )
    if message := never(value):
        raise InputError(message)
    return value


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
