"""Ladders of free vibration and of a seated damper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from upd.analyses.seated.varied import PATCH
from upd.batch.ladder import Counts, Ladder, Levels, even, refinements, whole_levels
from upd.batch.study_point import Settings, StudyPoint
from upd.scene import ModalScene, SeatedScene

#: element -> refinements that are affordable beside each other
_REFINE = {"hex8": (1, 2, 3), "hex8i": (1, 2, 3), "hex20": (1, 2, 3), "hex27": (1, 2)}
MODES_ONLY: Settings = (("want", ["free", "glued"]), ("modes.arrangements", ["symmetric"]))
_REDUCED: Settings = (
    ("want", ["free", "reduction", "response"]),
    ("modes.arrangements", ["symmetric"]),
)
#: elements up a patch
_SLOPE = (4, 8, 12, 16)
_SEATED: Settings = (("want", ["seating", "stiffness"]), ("left_out.solve", "no"))


def _modal_meshes(scene: ModalScene, levels: Levels, *, all_elements: bool) -> Iterator[StudyPoint]:
    """geometry.refine with the scene's element, or with all four: quadratic ones to refine 2."""
    asked = refinements(levels)
    for element in _REFINE if all_elements else (scene.mesh.element,):
        most = 2 if all_elements and element in ("hex20", "hex27") else 3
        for refine in asked or _REFINE[element][:most]:
            settings = (*MODES_ONLY, ("geometry.refine", refine), ("mesh.element", element))
            yield StudyPoint(element, f"refine {refine:g}", settings, 1.0 / refine)


def _seated_meshes(
    scene: SeatedScene, levels: Levels, *, all_elements: bool
) -> Iterator[StudyPoint]:
    """Elements up the patch, those along it in proportion."""
    slope, others = PATCH[scene.arrangement]
    usual, asked = int(scene.geometry[slope]), whole_levels(levels, 2)
    for element in ("hex8", "hex8i") if all_elements else (scene.mesh.element,):
        for n in asked or _SLOPE:
            counts = {slope: n} | {key: even(scene.geometry[key] * n / usual) for key in others}
            settings = tuple((f"geometry.{key}", value) for key, value in counts.items())
            yield StudyPoint(
                element,
                f"{n} elements up the patch",
                (*_SEATED, *settings, ("mesh.element", element)),
                1.0 / n,
            )


_MODAL_NUMBERS = ("f?_free", "f?_glued", "f?_reduced", "response_below", "response_above")
_SEATED_NUMBERS = ("closed_share", "max_pressure", "damper_u?", "seating_loss")
_MODES = Counts(
    "modes",
    "{} modes a blade",
    "reduction.modes",
    (0, 1, 2, 5, 10, 20, 40),
    0,
    lambda scene: _REDUCED,
    more=1,
)
_LOAD_STEPS = Counts(
    "steps", "{} load steps", "seating.steps", (2, 5, 10, 20, 40), 2, lambda scene: _SEATED
)

MODAL: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_modal_meshes, all_elements=False), _MODAL_NUMBERS),
    "element": Ladder(partial(_modal_meshes, all_elements=True), _MODAL_NUMBERS),
    "modes": Ladder(_MODES, _MODAL_NUMBERS),
}
SEATED: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_seated_meshes, all_elements=False), _SEATED_NUMBERS),
    "element": Ladder(partial(_seated_meshes, all_elements=True), _SEATED_NUMBERS),
    "steps": Ladder(_LOAD_STEPS, _SEATED_NUMBERS),
}
