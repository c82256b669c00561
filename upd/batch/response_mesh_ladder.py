"""Ladders of a forced response over the mesh of its bodies, with the contact points kept.

A contact point at a node of its own would never converge: the displacement under a point force
grows with every refinement. On these ladders a point takes the mean over an area of the face which
is the same on every level: groups of rows and columns into which every level divides evenly.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from upd.analyses.cost import NODES
from upd.analyses.forced.levels import FACES, count_of
from upd.batch.convergence import ConvergenceStudy
from upd.batch.curves import make_curves
from upd.batch.forced_ladder import FORCED_NAMES, base_settings, ladder_title
from upd.batch.ladder import (
    Levels,
    Settings,
    Study,
    StudyMaker,
    StudyPoint,
    followed,
    refinements,
)
from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, SIDES

#: element -> refinements beside each other: one more of linear elements, which cost less
_REFINE: Mapping[str, tuple[float, ...]] = {
    "hex8": (0.5, 1, 2, 3),
    "hex8i": (0.5, 1, 2, 3),
    "hex20": (0.5, 1, 2),
    "hex27": (0.5, 1),
}
#: elements whose faces of four nodes carry a contact node by node
_NODE_BY_NODE = ("hex8i", "hex8")
#: arrangement -> the most columns of points
_COLUMNS: Mapping[str, int] = {"symmetric": 3, "asymmetric": 2}
#: rows of points, where there are more than one: those of a face of two elements
_MOST_ROWS = 2


def response_mesh_study(scene: ForcedScene, vary: str, levels: Levels = None) -> Study:
    """The ladder of a variation, for the scene's first stiffness and lowest F_C/F_E.

    Parameters
    ----------
    vary
        "mesh": geometry.refine, the scene's element. "element": the same for all that carry the
        contact.
    levels
        Refinements, 0.5 or whole numbers; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and a recipe without ``refine``.
    """
    return ConvergenceStudy(
        ladder_title(scene, vary),
        tuple(response_mesh_points(scene, vary, levels)),
        partial(make_curves, names=followed(scene, *FORCED_NAMES)),
        notes=tuple(_notes(scene)),
    )


def response_mesh_points(scene: ForcedScene, vary: str, levels: Levels = None) -> list[StudyPoint]:
    """Points of `response_mesh_study`."""
    if not recipes.has_parameter(scene.recipe, "refine"):
        raise InputError(
            f"--vary {vary}: the recipe has no parameter refine, by which its bodies are divided; "
            "to fix it: give it one, or run the scene with meshes of your own"
        )
    whole_faces = scene.contact.model != "springs"
    known = _NODE_BY_NODE if whole_faces else tuple(_REFINE)
    elements = (scene.mesh.element,) if vary == "mesh" else known
    asked = refinements(levels)
    # Gauss points do not hang on the mesh
    keeps = whole_faces or scene.contact.rule == GAUSS
    base = (*base_settings(scene), *(() if keeps else _same_areas(scene)))
    return [
        StudyPoint(
            element,
            f"refine {refine:g}",
            (*base, ("geometry.refine", refine), ("mesh.element", element)),
            _size(scene, base, element, refine),
        )
        for element in elements
        for refine in asked or _usual(scene, element)
    ]


def _usual(scene: ForcedScene, element: str) -> tuple[float, ...]:
    """The usual refinements; whole ones where the recipe takes no others."""
    default = recipes.parameters(scene.recipe).__dataclass_fields__["refine"].default
    return tuple(n for n in _REFINE[element] if n >= 1 or not isinstance(default, int))


def _size(scene: ForcedScene, base: Settings, element: str, refine: float) -> float:
    """Size of an element against that at refine 1: counts that are not whole are rounded, so it is
    told by the numbers of elements, a cube root.
    """
    if refine == int(refine) or recipes.counted_by_mesh(scene.recipe):
        return 1.0 / refine
    head = "geometry."
    given = {key: value for key, value in scene.geometry.items() if key != "recipe"}
    given |= {key.removeprefix(head): v for key, v in base if key.startswith(head)}
    given |= {"element_nodes": NODES[element]}
    hexes = [
        sum(body["hexes"] for body in recipes.count(scene.recipe, given | {"refine": n}).values())
        for n in (1, refine)
    ]
    return float((hexes[0] / hexes[1]) ** (1.0 / 3.0))


def _same_areas(scene: ForcedScene) -> Settings:
    """Points over areas that all levels share: rows and columns of them, and counts of elements
    that even half of them divides.
    """
    slopes, along = FACES[scene.arrangement]
    rows, columns = _MOST_ROWS, _COLUMNS[scene.arrangement]
    for side in SIDES:
        up, across = scene.contact.lines(side)
        rows, columns = min(rows, _lines(up)), min(columns, _lines(across))
    settings: dict[str, Any] = {"contact.rows": rows, "contact.columns": columns}
    for side, own in (("left", scene.contact.left), ("right", scene.contact.right)):
        settings |= {f"contact.{side}.rows": rows} if own.rows is not None else {}
        settings |= {f"contact.{side}.columns": columns} if own.columns is not None else {}
    # two halves of the face along the damper, each with whole elements on half of the counts
    wanted = dict.fromkeys(slopes, 2 * rows) | {
        along: math.lcm(4, 2 * columns) if scene.arrangement == "symmetric" else 2
    }
    for key, step in wanted.items():
        if recipes.has_parameter(scene.recipe, key):
            settings[f"geometry.{key}"] = _multiple(count_of(scene, key), step)
    return tuple(settings.items())


def _lines(choice: Any) -> int:
    """How many lines of points a choice gives, at least; "all" has as many as are asked."""
    if choice == "all":
        return max(_MOST_ROWS, *_COLUMNS.values())
    return int(choice) if isinstance(choice, int) else len(choice)


def _multiple(count: int, step: int) -> int:
    """The nearest multiple, at least two of them: half of it is one still."""
    return step * max(1, round(count / step))


def _notes(scene: ForcedScene) -> Iterator[str]:
    """What the levels set in the scene."""
    if scene.contact.model != "springs" or scene.contact.rule == GAUSS:
        return
    told = ", ".join(f"{key} = {value}" for key, value in _same_areas(scene))
    yield (
        f"every level: {told}: a contact point takes the mean over the same area on every level, "
        "so that the ladder shows the mesh alone (what the choice of points does: --vary contacts)"
    )


LADDERS: Mapping[str, StudyMaker] = dict.fromkeys(("mesh", "element"), response_mesh_study)
