"""Numbers of elements of the rig's recipe: off its contact, and on it; and how their sizes grow
away from its edges.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from upd.analyses.cost import NODES
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
#: elements of the coarsest graded mesh for those of the recipe's defaults: from every re-entrant
#: edge on as many, which shank, core and platform have on both sides; few along the damper and many
#: up the slope, where free and stuck frequencies gain the least and the most for their dofs
GRADED: Mapping[str, int] = {
    "across": 4,
    "base_columns": 4,
    "base_side": 2,
    "base_layers": 4,
    "shank_layers": 4,
    "platform_layers": 6,
    "core_layers": 6,
    "core_upper": 2,
    "wing_columns": 4,
    "patch_along_slope": 8,
    "patch_along_y": 6,
    "pad_along_slope": 4,
    "pad_along_y": 4,
    "face_along_z": 4,
}
#: ratio of neighbouring sizes in the coarsest graded mesh, and its elements beside a re-entrant
#: edge outside and inside of shank, core and platform
_GROWTH, _OUTSIDE, _INSIDE = 2.0, 4, 2
#: exponent of displacements at a right-angled re-entrant edge: sin(3 pi x / 2) = -x
_EDGE = 0.5445


def count_of(scene: ForcedScene, key: str) -> int:
    """A number of elements, as the scene or the recipe gives it."""
    default = recipes.parameters(scene.recipe).__dataclass_fields__[key].default
    return int(scene.geometry.get(key, default))


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


def graded(scene: ForcedScene, factor: float) -> dict[str, Any]:
    """A mesh that gets finer at re-entrant edges faster than elsewhere, as the recipe's parameters.

    Where displacements go with r^a from an edge, elements of order p leave an error of h^p if their
    sizes are h r^(1 - a/p) [1]_: a stretch that ends there is divided at (i/n)^q, q = p/a, and its
    last size is n^(q - 1) times its first. With s times the elements, sizes that grow by g each do
    so with g^(n - 1) = 2^(n_1 - 1) s^(q - 1), n = s n_1; a = 0.5445 at a right angle [2]_. Equal
    division, or one that keeps the ratio of sizes, leaves h^a, and one that keeps g as much as its
    largest elements leave.

    Parameters
    ----------
    scene
        Its own counts multiply those of the mesh, over the defaults of the recipe.
    factor
        s, 1 or more.

    Returns
    -------
    dict
        Counts, those on the contact where it is refined too (`meshed`), and growths.

    References
    ----------
    .. [1] I. Babuska, R. B. Kellogg, J. Pitkaranta, Numer. Math. 33 (1979) 447.
    .. [2] M. L. Williams, J. Appl. Mech. 19 (1952) 526.
    """
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    order = 1 if NODES[scene.mesh.element] == 8 else 2
    out: dict[str, Any] = {}
    for key in meshed(scene):
        step = 2 if known[key].metadata["bounds"].even else 1
        own = count_of(scene, key) / int(known[key].default)
        # up to rounding in the product
        out[key] = step * max(1, math.ceil(round(factor * GRADED[key] * own / step, 9)))
    for name, n in (("growth", _OUTSIDE), ("growth_inside", _INSIDE)):
        ends = _GROWTH ** (n - 1) * factor ** (order / _EDGE - 1.0)
        out[name] = ends ** (1.0 / (factor * n - 1.0))
    return out
