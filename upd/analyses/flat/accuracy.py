"""Levels of a flat contact, by its divisions; errors of its numbers.

Levels of an accuracy have elements of 20 nodes. At the edges of flat faces pressure grows without a
limit, so a stiffness converges with order 1 in the end on any element; but what 8 nodes leave of
bodies and of the bands that hold them is larger for long: K_N of the ready wedge is 4.421e6 N/mm on
8 divisions of 20 nodes (7 s), 4.455e6 on 16 of 8 nodes (12 s), about 4.40e6 in the limit. And where
the recipe can, elements are as thin under the wires as at the contact: with sizes that grow from
the contact to the wires, what those leave falls in no order beside what the contact leaves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

from upd.analyses.contact import accuracy
from upd.analyses.contact.accuracy import AccuracyLadder
from upd.analyses.contact.levels import FEWEST, level_geometry
from upd.analyses.flat.plan import make_plan
from upd.analyses.flat.results import make_results
from upd.analyses.flat.solve import solve_plan
from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import Scene

#: Numbers one accuracy for all is asked of: stiffnesses. The pressure at the edges of flat faces
#: grows under refinement without a limit.
GOVERNING = ("K_N_secant_raw", "K_Tx_initial_raw", "K_Ty_initial_raw", "K_*_per_pad")
#: shares of the scene's divisions, ratio about sqrt 2
_SHARES = (0.35, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0)
#: the level a plan predicts: the first with two before it, which show an order
_PREDICTED = 2
#: parameter of the elements under the wires, and what levels take where the scene says nothing
_BOTTOM, _BOTTOM_LAYER = "bottom_layer", 1.0
#: element of the levels of a scene with one of 8 nodes
_ELEMENT: Final = "hex20"


def _scenes(scene: Scene) -> list[Callable[[], Scene]]:
    """The scene with a share of its divisions, and more."""
    usual = scene.geometry.get("divisions")
    if not isinstance(usual, int):
        raise InputError(
            f"accuracy: the recipe {scene.recipe!r} has no divisions to choose; leave it out"
        )
    element = _ELEMENT if scene.mesh.element in ("hex8", "hex8i") else scene.mesh.element
    mesh = replace(scene.mesh, element=element, accuracy=None)
    geometry = dict(scene.geometry)
    if recipes.has_parameter(scene.recipe, _BOTTOM) and geometry.get(_BOTTOM) is None:
        geometry[_BOTTOM] = _BOTTOM_LAYER
    plain = replace(scene, mesh=mesh, accuracy=None, geometry=geometry)
    counts = dict.fromkeys(max(FEWEST, 2 * round(0.5 * share * usual)) for share in _SHARES)
    return [partial(_level, plain, n) for n in counts]


def _level(scene: Scene, divisions: int) -> Scene:
    return replace(scene, geometry={**scene.geometry, **level_geometry(scene.geometry, divisions)})


def _first(scene: Scene, target: float) -> int:
    del target
    return min(_PREDICTED, len(_scenes(scene)) - 1)


LADDER = AccuracyLadder(_scenes, make_plan, solve_plan, make_results, GOVERNING, _first)
plan_to_accuracy = partial(accuracy.plan_to_accuracy, LADDER)
solve_to_accuracy = partial(accuracy.solve_to_accuracy, LADDER)
estimate = partial(accuracy.estimate, LADDER)
