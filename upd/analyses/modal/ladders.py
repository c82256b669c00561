"""What a convergence study of free vibration varies; how frequencies depend on dimensions.

d ln f / d ln p come from the modes of the rig as given and the matrices of slightly changed ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from upd.analyses.modal.sensitivity import free_and_glued, log_derivatives
from upd.errors import InputError, UpdError
from upd.scene import ModalScene
from upd.vary.ladder import Asked, Ladder, StudyReport, counts, no_levels, refinements
from upd.vary.outcome import SolvedPoint
from upd.vary.tables import TextTable
from upd.vary.variation import Overrides, Variation

#: numbers a ladder follows beside those the analysis names first
_NUMBERS = ("f?_free", "f?_glued", "f?_reduced", "response_below", "response_above")
#: element -> refinements that are affordable beside each other
_REFINE = {"hex8": (1, 2, 3), "hex8i": (1, 2, 3), "hex20": (1, 2, 3), "hex27": (1, 2)}
MODES_ONLY: Overrides = (("want", ["free", "glued"]), ("modes.arrangements", ["symmetric"]))
_REDUCED: Overrides = (
    ("want", ["free", "reduction", "response"]),
    ("modes.arrangements", ["symmetric"]),
)


def _meshes(scene: ModalScene, asked: Asked, *, all_elements: bool) -> Iterator[Variation]:
    """geometry.refine with the scene's element, or with all four: quadratic ones to refine 2."""
    for element in _REFINE if all_elements else (scene.mesh.element,):
        most = 2 if all_elements and element in ("hex20", "hex27") else 3
        for refine in refinements(asked) or _REFINE[element][:most]:
            overrides = (*MODES_ONLY, ("geometry.refine", refine), ("mesh.element", element))
            yield Variation(element, f"refine {refine:g}", overrides, 1.0 / refine)


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


def _no_variations(scene: ModalScene, asked: Asked) -> tuple[Variation, ...]:
    """One set of modes is enough for all dimensions.

    Raises InputError for levels, and when the recipe has other dimensions.
    """
    no_levels(asked, "the dimensions are those of the rig, each by itself")
    missing = [
        name for names in DIMENSIONS.values() for name in names if name not in scene.geometry
    ]
    if missing:
        raise InputError(f"--vary dimensions: the recipe has no parameter {', '.join(missing)}")
    return ()


def _dimension_report(
    scene: ModalScene, solved: Sequence[SolvedPoint], names: Sequence[str]
) -> StudyReport:
    """A row for the frequencies in Hz, then one for each dimension."""
    del solved, names
    frequencies, derivatives = frequency_derivatives(scene)
    rows: list[tuple[str, ...]] = [
        ("as given, Hz", *(f"{f:.2f}" for f in frequencies.values())),
        *(
            (dimension, found, *[""] * (len(frequencies) - 1))
            if isinstance(found, str)
            else (dimension, *(f"{found[name]:+.3f}" for name in frequencies))
            for dimension, found in derivatives.items()
        ),
    ]
    heads = ("dimension", *(name.replace("_", " ") for name in frequencies))
    table = TextTable("d ln f / d ln p", heads, "l" + "r" * len(frequencies), tuple(rows))
    any_found = any(not isinstance(found, str) for found in derivatives.values())
    return StudyReport((table,), any_found)


_MODES = counts(
    "modes",
    "{} modes a blade",
    "reduction.modes",
    (0, 1, 2, 5, 10, 20, 40),
    0,
    _REDUCED,
    offset=1,
)
LADDERS: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_meshes, all_elements=False), _NUMBERS),
    "element": Ladder(partial(_meshes, all_elements=True), _NUMBERS),
    "modes": Ladder(_MODES, _NUMBERS),
    "dimensions": Ladder(
        _no_variations, report=_dimension_report, title=lambda scene, vary: "d ln f / d ln p"
    ),
}
