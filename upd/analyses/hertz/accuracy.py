"""Levels of a sphere's contact, sized from the load; errors of its numbers."""

from __future__ import annotations

import math
from dataclasses import replace

from upd.analyses.contact.levels import MESH, mesh_problem, wanted
from upd.analyses.contact.plan import refined_growth
from upd.analyses.contact.plans import auto_patch, make_plan
from upd.analyses.hertz.results import make_results
from upd.analyses.hertz.samples import sample
from upd.analyses.hertz.solve import solve_plan
from upd.errors import InputError
from upd.mesh import recipes
from upd.reference import contact_modulus, hertz_sphere
from upd.scene import Scene
from upd.vary.wanted import LevelChoice

#: Numbers the accuracy is asked of: those of the normal contact. The others carry their estimate
#: beside them; a slip annulus thinner than an element converges late and would multiply the cost of
#: every run.
GOVERNING = ("radius_moment", "max_pressure", "mean_pressure", "approach")
#: Nodes along the contact radius of the smallest load, level by level (ratio about sqrt 2).
LEVELS = (3.0, 4.2, 6.0, 8.5, 12.0, 17.0, 24.0)
#: Growth of neighbouring elements (when the scene gives none) on a level with that many nodes along
#: the radius.
_GROWTH, _GROWTH_AT = 1.5, 6.0
#: Largest error estimate of a level over (1 / nodes along the contact radius)^1.5, measured on the
#: Hertz scene (0.45 with 8.5 nodes, 0.38 with 12): what to expect of a level before it has run.
_FIRST, _POWER = 0.4, 1.5


def level_scene(scene: Scene, level: int) -> Scene:
    """``scene`` with patch and divisions for ``level``.

    A patch sized from the largest load, no larger than the scene's, spacing from the smallest.
    """
    if scene.sphere_radius is None:
        raise InputError(
            f"accuracy: the recipe {scene.recipe!r} has no contact radius to size the "
            'mesh from; give geometry.divisions, and no accuracy or "unknown"'
        )
    loads = [F for F in scene.loads.forces if F > 0.0]
    if not loads:
        raise InputError("accuracy: needs a positive normal load to size the mesh")
    m1, m2 = list(scene.materials.values())[:2]
    E = contact_modulus(m1.E, m1.nu, m2.E, m2.nu)
    radius = hertz_sphere(min(loads), scene.sphere_radius, E).radius
    patch = auto_patch(scene, max(loads))
    if scene.geometry.get("patch", "auto") != "auto":
        patch = min(patch, float(scene.geometry["patch"]))
    divisions = 2 * math.ceil(0.5 * patch / radius * LEVELS[level])
    if scene.mesh.element in ("hex20", "hex27"):
        divisions = 2 * math.ceil(divisions / 4)
    geometry = {**scene.geometry, "patch": patch, "divisions": max(4, divisions)}
    if "growth" in recipes.parameters(scene.recipe).__dataclass_fields__:
        # The far mesh is refined with the patch.
        geometry["growth"] = round(
            refined_growth(
                float(scene.geometry.get("growth", _GROWTH)), _GROWTH_AT / LEVELS[level]
            ),
            4,
        )
    return replace(scene, geometry=geometry, accuracy=None)


def _choices(scene: Scene) -> list[LevelChoice]:
    del scene
    labels = [f"with {nodes:g} nodes along the radius" for nodes in LEVELS]
    return [LevelChoice(MESH, "mesh", labels, level_scene)]


def _first(target: float) -> int:
    """The level that the scatter measured suggests."""
    return next(
        (k for k, nodes in enumerate(LEVELS) if _FIRST / nodes**_POWER <= target), len(LEVELS) - 1
    )


PROBLEM = mesh_problem(make_plan, solve_plan, make_results, sample)
WANTED = wanted(PROBLEM, _choices, GOVERNING, _first)
