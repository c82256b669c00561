"""What a convergence study of free vibration varies, and how frequencies depend on dimensions: by
rigs with one dimension a little larger.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from upd.errors import InputError
from upd.results.answer_table import AnswerTable
from upd.scene import ModalScene
from upd.vary.ladder import Asked, Ladder, StudyReport, counts, no_levels, refinements
from upd.vary.outcome import SolvedPoint
from upd.vary.variation import Overrides, Variation

#: relative step of a dimension. A slope bends by it times about one, and loses what frequencies are
#: rounded to (1e-9) over it
STEP = 1e-4


#: numbers a ladder follows beside those the analysis names first
_NUMBERS = ("f?_free", "f?_glued", "f?_reduced", "response_below", "response_above")
#: elements beside each other, and refinements that are affordable
_ELEMENTS, _REFINE = ("hex8", "hex8i", "hex20", "hex27"), (1, 2, 3)
MODES_ONLY: Overrides = (("want", ["free", "glued"]), ("modes.arrangements", ["symmetric"]))
_REDUCED: Overrides = (
    ("want", ["free", "reduction", "response"]),
    ("modes.arrangements", ["symmetric"]),
)


#: dimension -> parameters that move together
DIMENSIONS: dict[str, tuple[str, ...]] = {
    "shank_length": ("shank_length",),
    "shank_tx": ("shank_tx",),
    "core_length": ("core_length",),
    "core_tx": ("core_tx",),
    "core_wy": ("core_wy",),
    "platform_height": ("platform_height",),
    "width of shank and platform": ("shank_wy", "platform_wy"),
}
#: the rig without a change, and how its frequencies are called
_AS_GIVEN, _OF_MODES = "as given", ("_free", "_glued")


def _meshes(scene: ModalScene, asked: Asked, *, all_elements: bool) -> Iterator[Variation]:
    """geometry.refine with the scene's element, or with all four: quadratic ones to refine 2."""
    for element in _ELEMENTS if all_elements else (scene.mesh.element,):
        most = 2 if element == "hex27" or (all_elements and element == "hex20") else 3
        for refine in refinements(asked) or _REFINE[:most]:
            overrides = (*MODES_ONLY, ("geometry.refine", refine), ("mesh.element", element))
            yield Variation(element, f"refine {refine:g}", overrides, 1.0 / refine)


def _dimensions(scene: ModalScene, asked: Asked) -> Iterator[Variation]:
    """The rig as given, then with one dimension a little larger.

    Raises InputError for levels, and when the recipe has other dimensions.
    """
    no_levels(asked, "the dimensions are those of the rig, each by itself")
    missing = [
        name for names in DIMENSIONS.values() for name in names if name not in scene.geometry
    ]
    if missing:
        raise InputError(f"--vary dimensions: the recipe has no parameter {', '.join(missing)}")
    first = ("modes.arrangements", list(scene.modes.arrangements[:1]))
    base = (*MODES_ONLY, first, ("left_out.solve", "no"))
    yield Variation("dimensions", _AS_GIVEN, base, 1.0)
    for dimension, names in DIMENSIONS.items():
        larger = ((name, (1.0 + STEP) * float(scene.geometry[name])) for name in names)
        lengths = tuple((f"geometry.{name}", f"{value!r} mm") for name, value in larger)
        yield Variation("dimensions", dimension, (*base, *lengths), 1.0)


def _dimension_report(
    scene: ModalScene, solved: Sequence[SolvedPoint], names: Sequence[str]
) -> StudyReport:
    """A row for the frequencies in Hz, then one for each dimension: d ln f / d ln p."""
    del scene, names
    given = {one.point.label: one for one in solved}[_AS_GIVEN]
    frequencies = {key: f for key, f in given.values.items() if key[0].endswith(_OF_MODES)}
    rows = [(f"{_AS_GIVEN}, Hz", *(f"{f:.2f}" for f in frequencies.values()))]
    found = False
    for one in (one for one in solved if one is not given):
        why = one.outcome.failure
        if one.outcome.n_dof != given.outcome.n_dof:
            why = why or "a step of it changes the elements of the mesh: give another value of it"
        slopes = [
            math.log(one.values.get(key, math.nan) / f) / math.log1p(STEP)
            for key, f in frequencies.items()
        ]
        shown = (why, *[""] * (len(slopes) - 1)) if why else (f"{slope:+.3f}" for slope in slopes)
        rows.append((one.point.label, *shown))
        found = found or not why
    heads = ("dimension", *(f"# {name.replace('_', ' ')}" for name, _ in frequencies))
    table = AnswerTable("d ln f / d ln p", heads, tuple(rows))
    return StudyReport((table,), found)


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
        _dimensions, report=_dimension_report, title=lambda scene, vary: "d ln f / d ln p"
    ),
}
