"""Ladders of free vibration and of a seated damper; how natural frequencies depend on dimensions.

d ln f / d ln p come from the modes of the rig as given and the matrices of slightly changed ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from upd.analyses.modal.sensitivity import free_and_glued, log_derivatives
from upd.analyses.seated.varied import PATCH
from upd.batch.ladder import (
    Counts,
    Ladder,
    Levels,
    StudyReport,
    even,
    no_levels,
    refinements,
    whole_levels,
)
from upd.batch.study_point import Settings, SolvedPoint, StudyPoint
from upd.batch.study_tables import TextTable
from upd.errors import InputError, UpdError
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


#: dimension -> parameters that move together
DIMENSIONS = {
    **{
        name: (name,)
        for name in (
            "shank_length",
            "shank_tx",
            "core_length",
            "core_tx",
            "core_wy",
            "platform_height",
        )
    },
    "width of shank and platform": ("shank_wy", "platform_wy"),
}


def frequency_derivatives(
    scene: ModalScene,
) -> tuple[dict[str, float], dict[str, dict[str, float] | str]]:
    """Natural frequencies in Hz, and d ln f / d ln p of each of them for every dimension.

    A dimension without derivatives has the reason in their place. Raises UpdError when the rig as
    given has no modes.
    """
    sets = free_and_glued(scene)
    frequencies = {
        f"f{k + 1}_{one.kind}": mode.frequency for one in sets for k, mode in enumerate(one.modes)
    }
    table: dict[str, dict[str, float] | str] = {}
    for dimension, names in DIMENSIONS.items():
        try:
            found = log_derivatives(scene, sets, names)
        except UpdError as error:
            table[dimension] = str(error)
        else:
            table[dimension] = {name: value for (name, _), value in found.items()}
    return frequencies, table


def _no_points(scene: ModalScene, levels: Levels) -> tuple[StudyPoint, ...]:
    """One set of modes is enough for all dimensions.

    Raises InputError for levels, and when the recipe has other dimensions.
    """
    no_levels(levels, "the dimensions are those of the rig, each by itself")
    missing = [
        name for names in DIMENSIONS.values() for name in names if name not in scene.geometry
    ]
    if missing:
        raise InputError(f"--vary dimensions: the recipe has no parameter {', '.join(missing)}")
    return ()


def _dimension_report(scene: ModalScene, solved: Sequence[SolvedPoint]) -> StudyReport:
    """A row for the frequencies in Hz, then one for each dimension."""
    frequencies, derivatives = frequency_derivatives(scene)
    rows = [("as given, Hz", *(f"{f:.2f}" for f in frequencies.values()))]
    for dimension, found in derivatives.items():
        cells = (
            [found, *[""] * (len(frequencies) - 1)]
            if isinstance(found, str)
            else [f"{found[name]:+.3f}" for name in frequencies]
        )
        rows.append((dimension, *cells))
    align = "l" + "r" * len(frequencies)
    page = TextTable("d ln f / d ln p", ("dimension", *frequencies), align, tuple(rows), 27)
    short = replace(page, columns=tuple(name.replace("_", " ") for name in page.columns))
    any_found = any(not isinstance(found, str) for found in derivatives.values())
    return StudyReport((short,), any_found, page=(page,))


_MODAL_NUMBERS = ("f?_free", "f?_glued", "f?_reduced", "response_below", "response_above")
_SEATED_NUMBERS = ("closed_share", "max_pressure", "damper_u?", "seating_loss")
_MODES = Counts(
    "modes",
    "{} modes a blade",
    "reduction.modes",
    (0, 1, 2, 5, 10, 20, 40),
    0,
    lambda scene: _REDUCED,
    offset=1,
)
_LOAD_STEPS = Counts(
    "steps", "{} load steps", "seating.steps", (2, 5, 10, 20, 40), 2, lambda scene: _SEATED
)

MODAL: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_modal_meshes, all_elements=False), _MODAL_NUMBERS),
    "element": Ladder(partial(_modal_meshes, all_elements=True), _MODAL_NUMBERS),
    "modes": Ladder(_MODES, _MODAL_NUMBERS),
    "dimensions": Ladder(
        _no_points, subject=lambda scene, vary: "d ln f / d ln p", report=_dimension_report
    ),
}
SEATED: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_seated_meshes, all_elements=False), _SEATED_NUMBERS),
    "element": Ladder(partial(_seated_meshes, all_elements=True), _SEATED_NUMBERS),
    "steps": Ladder(_LOAD_STEPS, _SEATED_NUMBERS),
}
