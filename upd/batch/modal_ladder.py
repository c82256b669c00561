"""Ladders of a modal analysis: mesh, element, and number of modes kept in the reduction."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

from upd.batch.convergence import ConvergenceStudy
from upd.batch.curves import make_curves
from upd.batch.ladder import (
    Levels,
    Settings,
    Study,
    StudyMaker,
    StudyPoint,
    followed,
    refinements,
    whole_levels,
)
from upd.scene import ModalScene

#: numbers a ladder follows beside those the analysis names first
_MORE = ("f?_free", "f?_glued", "f?_reduced", "response_below", "response_above")
#: element -> refinements that are affordable beside each other
_REFINE = {"hex8": (1, 2, 3), "hex8i": (1, 2, 3), "hex20": (1, 2, 3), "hex27": (1, 2)}
#: numbers of fixed-interface modes
_MODES = (0, 1, 2, 5, 10, 20, 40)

MODES_ONLY: Settings = (("want", ["free", "glued"]), ("modes.arrangements", ["symmetric"]))
_REDUCED: Settings = (
    ("want", ["free", "reduction", "response"]),
    ("modes.arrangements", ["symmetric"]),
)


def modal_study(scene: ModalScene, vary: str, levels: Levels = None) -> Study:
    """The ladder of a variation.

    Parameters
    ----------
    vary
        "mesh": geometry.refine, the scene's element. "element": the same for all four elements
        (hex20 and hex27 to refine 2). "modes": fixed-interface modes per blade.
    levels
        Refinements or numbers of modes; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none.
    """
    title = f"{scene.title or scene.name}: what accuracy costs, {vary}"
    return ConvergenceStudy(
        title,
        tuple(modal_points(scene, vary, levels)),
        partial(make_curves, names=followed(scene, *_MORE)),
    )


def modal_points(scene: ModalScene, vary: str, levels: Levels = None) -> list[StudyPoint]:
    """Points of `modal_study`."""
    if vary == "modes":
        return [
            StudyPoint(
                "modes", f"{n} modes a blade", (*_REDUCED, ("reduction.modes", n)), 1.0 / (1 + n)
            )
            for n in whole_levels(levels, 0) or _MODES
        ]
    elements = (scene.mesh.element,) if vary == "mesh" else tuple(_REFINE)
    return list(_mesh_points(elements, refinements(levels), vary))


def _mesh_points(
    elements: Iterable[str], levels: tuple[float, ...] | None, vary: str
) -> Iterable[StudyPoint]:
    for element in elements:
        usual = (
            _REFINE[element]
            if vary == "mesh"
            else _REFINE[element][: 2 if element in ("hex20", "hex27") else 3]
        )
        for refine in levels or usual:
            settings = (*MODES_ONLY, ("geometry.refine", refine), ("mesh.element", element))
            yield StudyPoint(element, f"refine {refine:g}", settings, 1.0 / refine)


LADDERS: Mapping[str, StudyMaker] = dict.fromkeys(("mesh", "element", "modes"), modal_study)
