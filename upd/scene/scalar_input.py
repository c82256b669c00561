"""A scalar input of a scene by its path: the kind of its quantity and its value."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import fields

from upd.errors import InputError
from upd.mesh import recipes
from upd.scene.forced import ForcedScene
from upd.scene.keys import SceneKey, is_input, quantity_kind
from upd.scene.rotation import damper_mass
from upd.units import UNITS, parse_quantity

#: values of inputs that follow from others
_NO_VALUE = ("none", '"auto"', '"from speed"')


def scalar_input(
    scene: ForcedScene, keys: Mapping[str, SceneKey], path: str, others: Sequence[str] = ()
) -> tuple[str, float]:
    """Kind of the quantity, as in `upd.units.UNITS`, and value in the unit inside.

    Parameters
    ----------
    scene
        Whose input it is.
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
    key, steps = keys.get(path), tuple(path.split("."))
    kind = ""
    if key is not None and steps[0] == "geometry":
        known = {f.name: f for f in fields(recipes.parameters(scene.recipe))}
        kind = str(known[steps[1]].metadata.get("quantity") or "") if steps[1] in known else ""
    elif key is not None and is_input(steps):
        kind = quantity_kind(type(scene), steps)
    if key is None or kind not in UNITS:
        inputs = list(dict.fromkeys([*others, *(k.path for k in keys.values() if k.uncertain)]))
        near = difflib.get_close_matches(path, inputs, 3)
        told = f"; did you mean {' or '.join(near)}?" if near else ""
        raise InputError(f"is no scalar input of the scene{told}. Inputs: {', '.join(inputs)}")
    if path in scene.uncertain:
        return kind, scene.uncertain[path].value
    if key.value in _NO_VALUE:
        value = damper_mass(scene) if path == "damper.mass" else None
        if value is None:
            raise InputError(f"has no value to begin with ({key.value}); give it one in the scene")
        return kind, value
    return kind, parse_quantity(tomllib.loads(f"v = {key.value}")["v"], kind)
