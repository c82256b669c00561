"""Numbers of elements of the rig's recipe: off its contact, and on it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS

RECIPE = "blade_rig"
#: off the contact, see `geometry.blade_rig_params`
OFF_CONTACT = (
    "across",
    "base_columns",
    "base_side",
    "base_layers",
    "shank_layers",
    "platform_layers",
    "core_layers",
    "core_upper",
    "wing_columns",
)
#: arrangement -> counts up its faces, and the count along the damper
FACES: Mapping[str, tuple[tuple[str, ...], str]] = {
    "symmetric": (("patch_along_slope",), "patch_along_y"),
    "asymmetric": (("pad_along_slope", "face_along_z"), "pad_along_y"),
}


def count_of(scene: ForcedScene, key: str) -> int:
    """A number of elements, as the scene or the recipe gives it."""
    default = recipes.parameters(scene.recipe).__dataclass_fields__[key].default
    return int(scene.geometry.get(key, default))


def up_slope(scene: ForcedScene) -> tuple[str, ...]:
    """Counts up the scene's contact faces that its recipe has."""
    return tuple(
        key for key in FACES[scene.arrangement][0] if recipes.has_parameter(scene.recipe, key)
    )


def on_contact(scene: ForcedScene) -> tuple[str, ...]:
    """Counts of the scene's contact faces that its recipe has."""
    slopes, along = FACES[scene.arrangement]
    return tuple(key for key in (*slopes, along) if recipes.has_parameter(scene.recipe, key))


def meshed(scene: ForcedScene) -> tuple[str, ...]:
    """Counts that its mesh is refined by: on the contact too, where the contact points are none of
    its nodes.
    """
    return (*OFF_CONTACT, *(on_contact(scene) if scene.contact.rule == GAUSS else ()))


def times(scene: ForcedScene, keys: tuple[str, ...], factor: float) -> dict[str, Any]:
    """So many times the counts, rounded up to those the recipe allows, as its parameters."""
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    out = {}
    for key in keys:
        step = 2 if known[key].metadata["bounds"].even else 1
        count = -int(-factor * count_of(scene, key) / step // 1)
        out[key] = step * max(1, count)
    return out
