"""Printed values beside the numbers of a run, for every analysis alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from functools import cache
from typing import Any

from upd.mesh import recipes
from upd.reference.printed import Lookup, Printed, printed_values
from upd.results import Result
from upd.scene import AnyScene, load_scene, ready_scenes

#: parameters of a recipe that say how it is meshed or which part is, not how its bodies are
_NOT_OF_THE_BODIES = ("symmetry", "element_nodes", "arrangement", "damper")


def printed_of(scene: AnyScene) -> Lookup:
    """What was printed of the scene's bodies.

    Dimensions that no table prints are those of the ready scene: where the scene's bodies are
    others, in size or material, nothing was printed of them. Mesh and solver do not matter.
    """
    geometry = {**scene.geometry, "arrangement": getattr(scene, "arrangement", "")}
    look_up = printed_values(scene.recipe, geometry, scene.body_materials.values())
    if recipes.closed_form(scene.recipe):
        # its tables print their bodies themselves
        return look_up
    ready = ready_scene(scene)
    same = ready is not None and (
        _bodies(scene) == _bodies(ready) and _elastic(scene) == _elastic(ready)
    )
    return look_up if same else nothing_printed


def nothing_printed(name: str, case: Mapping[str, Any]) -> tuple[Printed, ...]:
    """Look up nothing."""
    del name, case
    return ()


def ready_scene(scene: AnyScene) -> Any:
    """The ready scene of the same kind, recipe and arrangement; None when there is none."""
    return _ready(type(scene).__name__, scene.recipe, getattr(scene, "arrangement", ""))


@cache
def _ready(kind: str, recipe: str, arrangement: str) -> Any:
    for name in ready_scenes():
        scene = load_scene(name)
        mine = (type(scene).__name__, scene.recipe, getattr(scene, "arrangement", ""))
        if mine == (kind, recipe, arrangement):
            return scene
    return None


def _elastic(scene: AnyScene) -> dict[str, tuple[float, ...]]:
    """Constants of every body that its numbers depend on: density counts where things move."""
    return {
        body: (m.E, m.nu, m.density) if scene.moves else (m.E, m.nu)
        for body, m in scene.body_materials.items()
    }


def _bodies(scene: AnyScene) -> dict[str, Any]:
    """Lengths, angles and named choices of the recipe's parameters."""
    given = {
        key: value
        for key, value in scene.geometry.items()
        if key not in ("recipe", "damper") and value != "auto"
    }
    arrangement = getattr(scene, "arrangement", "")
    if arrangement:
        given["arrangement"] = arrangement
    made = recipes.made(scene.recipe, given)
    return {
        f.name: getattr(made, f.name)
        for f in fields(made)
        if f.name not in _NOT_OF_THE_BODIES
        and (f.metadata.get("quantity") is not None or "choices" in f.metadata)
    }


def with_printed(results: Iterable[Result], printed: Lookup) -> list[Result]:
    """The results with what was printed of them.

    A result with a reference of its own gets the relative difference of the printed value from it;
    another is compared with the printed value itself, which it need not converge to.

    Parameters
    ----------
    printed
        Printed values of the scene, from `printed_of`.
    """
    return [_with_printed(result, printed) for result in results]


def _with_printed(result: Result, printed: Lookup) -> Result:
    found = printed(result.name, result.case.given())
    # Several values have no order that could be the run's.
    if len(found) != 1:
        return result
    if result.reference is None:
        return replace(result, reference=found[0].value, source=found[0].source, exact=False)
    return replace(result, printed_error=found[0].value / result.reference - 1.0)
