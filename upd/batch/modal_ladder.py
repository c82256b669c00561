"""Ladders of a rig: mesh, element, and number of modes kept in the reduction."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from upd.batch.ladder import Point
from upd.errors import InputError
from upd.scene import RigScene

VARIATIONS = ("mesh", "element", "modes")
#: numbers the studies follow
FOLLOWED = (*(f"f{k}_{kind}" for kind in ("free", "glued", "reduced") for k in range(1, 5)), "response_below", "response_above")
#: element -> refinements that are affordable beside each other
_REFINE = {"hex8": (1, 2, 3), "hex8i": (1, 2, 3), "hex20": (1, 2, 3), "hex27": (1, 2)}

MODES_ONLY: tuple[tuple[str, Any], ...] = (("want", ["free", "glued"]), ("modes.arrangements", ["symmetric"]))
_REDUCED: tuple[tuple[str, Any], ...] = (("want", ["free", "reduction", "response"]), ("modes.arrangements", ["symmetric"]))


def rig_points(scene: RigScene, vary: str, levels: tuple[int, ...] | None = None) -> list[Point]:
    """The ladder of a variation; ``levels`` are refinements (mesh) or numbers of kept modes (modes).

    mesh    : geometry.refine, the scene's element.
    element : the same for all four elements (hex20 and hex27 to refine 2).
    modes   : fixed-interface modes per blade.
    """
    if vary not in VARIATIONS:
        raise InputError(f"--vary {vary}: choose one of {', '.join(VARIATIONS)}")
    if levels is not None and (len(levels) < 2 or min(levels) < (0 if vary == "modes" else 1)):
        raise InputError(f"--levels {levels}: give at least two whole numbers, {'0' if vary == 'modes' else '1'} or more")
    if vary == "modes":
        return [
            Point("modes", f"{n} modes a blade", (*_REDUCED, ("reduction.modes", n)), 1.0 / (1 + n))
            for n in levels or (0, 1, 2, 5, 10, 20, 40)
        ]
    elements = (scene.mesh.element,) if vary == "mesh" else tuple(_REFINE)
    return list(_mesh_points(elements, levels, vary))


def _mesh_points(elements: Iterable[str], levels: tuple[int, ...] | None, vary: str) -> Iterable[Point]:
    for element in elements:
        usual = _REFINE[element] if vary == "mesh" else _REFINE[element][: 2 if element in ("hex20", "hex27") else 3]
        for refine in levels or usual:
            settings = (*MODES_ONLY, ("geometry.refine", refine), ("mesh.element", element))
            yield Point(element, f"refine {refine}", settings, 1.0 / refine)
