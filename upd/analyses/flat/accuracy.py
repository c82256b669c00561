"""Levels of a flat contact, by its divisions; errors of its numbers.

Levels of an accuracy have elements of 20 nodes. At the edges of flat faces pressure grows without a
limit, so a stiffness converges with order 1 in the end on any element; but what 8 nodes leave of
bodies and of the bands that hold them is larger for long: K_N of the ready wedge is 4.421e6 N/mm on
8 divisions of 20 nodes (7 s), 4.455e6 on 16 of 8 nodes (12 s), about 4.40e6 in the limit.

A damper that wires press along narrow bands across its length (`pads_platform`) needs elements as
short along it as the bands, and as thin under them as at the contact, but longer ones across: of
K_N of a ready pad (about 7.91e5 N/mm in the limit) 18 x 8 elements leave 1.0 %, of which 36 x 8
take 0.5; 28 x 6 leave 0.8 % on fewer dofs. Its levels have twice as many elements along the contact
to those across as the scene has, half as thick as they are long, so that the layers of the pads are
in proportion too. With sizes that grow from the contact to the wires, what those leave falls in no
order beside what the contact leaves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from upd.analyses.contact.levels import FEWEST, MESH, level_geometry, mesh_problem, wanted
from upd.analyses.contact.plans import make_plan
from upd.analyses.flat.results import make_results
from upd.analyses.flat.solve import solve_plan
from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import Scene
from upd.vary.wanted import LevelChoice

#: Numbers one accuracy for all is asked of: stiffnesses. The pressure at the edges of flat faces
#: grows under refinement without a limit.
GOVERNING = ("K_N_secant_raw", "K_Tx_initial_raw", "K_Ty_initial_raw", "K_*_per_pad")
#: shares of the scene's divisions, ratio about sqrt 2
_SHARES = (0.35, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0)
#: likewise where wires press, nearer to each other: with half the elements along each edge a level
#: takes a fifteenth of the seconds, and only four show whether an order holds
_SHARES_OF_WIRES = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0)
#: the level a plan predicts: the first with two before it, which show an order
_PREDICTED = 2
#: thickness of the elements under wires and at the contact, where wires press
_UNDER_WIRES, _AT_CONTACT = 1.0, 0.5
#: element of the levels of a scene with one of 8 nodes
_ELEMENT: Final = "hex20"


def _choices(scene: Scene) -> list[LevelChoice]:
    """The scene with a share of its divisions, and more."""
    if not isinstance(scene.geometry.get("divisions"), int):
        raise InputError(
            f"accuracy: the recipe {scene.recipe!r} has no divisions to choose; leave it out"
        )
    element = _ELEMENT if scene.mesh.element in ("hex8", "hex8i") else scene.mesh.element
    mesh = replace(scene.mesh, element=element)
    wires = recipes.has_parameter(scene.recipe, "bottom_layer")
    geometry = _for_wires(scene.geometry) if wires else scene.geometry
    plain = replace(scene, mesh=mesh, accuracy=None, geometry=geometry)
    usual, fewest = geometry["divisions"], 2 if wires else FEWEST
    shares = _SHARES_OF_WIRES if wires else _SHARES
    counts = dict.fromkeys(max(fewest, 2 * round(0.5 * share * usual)) for share in shares)
    levels = [_level(plain, n, 1 if wires else 2) for n in counts]
    return [LevelChoice(MESH, "mesh", [f"{n} divisions" for n in counts], lambda _, k: levels[k])]


def _for_wires(geometry: Mapping[str, Any]) -> dict[str, Any]:
    """The geometry with half of its divisions across, and thin elements under the wires."""
    under = geometry.get("bottom_layer")
    return {
        **geometry,
        "divisions": 2 * max(1, round(0.25 * geometry["divisions"])),
        "bottom_layer": _UNDER_WIRES if under is None else under,
        "first_layer": min(_AT_CONTACT, geometry["first_layer"]),
    }


def _level(scene: Scene, divisions: int, step: int) -> Scene:
    """The scene with so many divisions, those along the contact in proportion in such steps."""
    own = level_geometry(scene.geometry, divisions, step=step)
    return replace(scene, geometry={**scene.geometry, **own})


PROBLEM = mesh_problem(make_plan, solve_plan, make_results)
WANTED = wanted(PROBLEM, _choices, GOVERNING, lambda target: _PREDICTED)
