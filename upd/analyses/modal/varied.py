"""What varies in a rig: its mesh, for the errors of its numbers, where the modes kept are judged by
the full model; in convergence studies meshes, elements, modes, and every dimension by a little.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from upd.analyses.modal.plan import MODES_ABOVE, ModalPlan, make_plan
from upd.analyses.modal.results import REDUCED, make_results
from upd.analyses.modal.solve import ModalSolution, solve
from upd.errors import InputError
from upd.plot.answer_table import AnswerTable
from upd.results import ErrorPart, Estimates, Result
from upd.results.quantities import quantity_of
from upd.scene import RigScene
from upd.vary.errors import merged
from upd.vary.ladder import Asked, Ladder, StudyReport, counts, no_levels, refinements
from upd.vary.outcome import SolvedPoint
from upd.vary.solve import MESH, changed, coarser_rigs, refined
from upd.vary.variation import ALONE, LevelChoice, Levels, Overrides, Problem, Variation

#: source of error beside the mesh
KEPT = "modes kept"
#: times the elements along an edge, and numbers of modes kept, of an accuracy
_FINER, _MODES = (1, 2, 3), (5, 10, 20, 40)
#: elements with nodes between the corners, and the spacing of nodes without these over that with
_QUADRATIC, _BETWEEN = ("hex20", "hex20r", "hex27"), 2.0
#: outputs a companion has, where the run has them: the reduced model has the mesh of the full one
_WANTED = ("free", "glued", "response")


def bare(scene: RigScene) -> Overrides:
    """Overrides without what costs and shows no number."""
    return (("want", tuple(w for w in scene.want if w in _WANTED) or ("free",)), *ALONE)


def levels(plan: ModalPlan) -> Levels:
    """Variations of the rig's mesh.

    Of quadratic elements the linear ones with incompatible modes on the same hexahedra, with twice
    the spacing of nodes: corners and clamped edges let the frequencies of both fall with the same
    order, below the formal one of either. Of linear elements coarser rigs.
    """
    if plan.scene.mesh.element in _QUADRATIC:
        label = "elements hex8i on the same hexahedra"
        return {MESH: [Variation(MESH, label, (("mesh.element", "hex8i"),), _BETWEEN)]}
    return {MESH: coarser_rigs(PROBLEM, plan)}


def _corrected(solution: ModalSolution, numbers: Sequence[Result], found: Estimates) -> Estimates:
    """The errors by the mesh, and by the modes left out: of the reduced model, which has the mesh
    of the full one, against that; of the peak solved again.
    """
    by_mesh, by_modes = dict(found), {}
    for one in (r for r in numbers if r.case == REDUCED):
        quantity, n = quantity_of(one.name)
        full = next((r for r in numbers if r.name == quantity.full.format(n=n)), None)
        if full is not None:
            by_mesh[one.name, one.case] = found[full.name, full.case]
            error = abs(one.value / full.value - 1.0)
            part = ErrorPart(KEPT, error, "against the full model")
            by_modes[one.name, one.case] = (part,)
    for again in (one for one in solution.left_out if one.effect == MODES_ABOVE):
        error = abs(again.included / again.without - 1.0)
        basis = "solved again with the modes up to twice the limit"
        by_modes[again.quantity, again.case] = (ErrorPart(KEPT, error, basis),)
    return merged(by_mesh, by_modes)


# -- an accuracy that is wanted --------------------------------------------------------------------


def choices(scene: RigScene) -> list[LevelChoice]:
    """What may be chosen of a rig: its refinement from its own up, and the number of modes kept."""
    found, reduction = [], scene.reduction
    if isinstance(scene.geometry.get("refine"), (int, float)):
        found.append(LevelChoice(MESH, "elements along an edge", "x {}", _FINER, refined))
    if scene.wants("reduction") and reduction.below is None and reduction.error is None:
        found.append(
            LevelChoice(
                KEPT, "modes kept", "{} a blade", _MODES, lambda _, n: (("reduction.modes", n),)
            )
        )
    return found


def level_of(plan: ModalPlan) -> Variation:
    refine = float(plan.scene.geometry.get("refine", 1.0))
    return Variation(MESH, f"geometry.refine = {refine:.2g}", size=1.0 / refine)


PROBLEM = Problem(
    make_plan,
    solve,
    make_results,
    bare,
    levels,
    lambda plan, source, factor: refined(plan.scene, factor),
    corrected=_corrected,
    choices=choices,
    governing=lambda scene: {name: name for name in ("f*_free", "f*_glued", "f*_reduced")},
    level_of=level_of,
    varies_lowest=True,
    trial=lambda scene: changed(scene, (("left_out.solve", "no"),)),
)


# -- convergence studies --------------------------------------------------------------------------


#: relative step of a dimension. A slope bends by it times about one, and loses what frequencies are
#: rounded to (1e-9) over it
STEP = 1e-4


#: numbers a ladder follows beside those the analysis names first
_NUMBERS = ("f?_free", "f?_glued", "f?_reduced")
#: elements beside each other, and refinements that are affordable
_ELEMENTS, _REFINE = ("hex8", "hex8i", "hex20", "hex20r", "hex27"), (1, 2, 3)
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


def _meshes(scene: RigScene, asked: Asked, *, all_elements: bool) -> Iterator[Variation]:
    """geometry.refine with the scene's element, or with all: quadratic ones to refine 2."""
    for element in _ELEMENTS if all_elements else (scene.mesh.element,):
        most = 2 if element == "hex27" or (all_elements and element in _QUADRATIC) else 3
        for refine in refinements(asked) or _REFINE[:most]:
            overrides = (*MODES_ONLY, ("geometry.refine", refine), ("mesh.element", element))
            yield Variation(element, f"refine {refine:g}", overrides, 1.0 / refine)


def _dimensions(scene: RigScene, asked: Asked) -> Iterator[Variation]:
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
    scene: RigScene, solved: Sequence[SolvedPoint], names: Sequence[str]
) -> StudyReport:
    """A row for the frequencies in Hz, then one for each dimension: d ln f / d ln p."""
    del scene, names
    given, title = {one.point.label: one for one in solved}[_AS_GIVEN], "d ln f / d ln p"
    if given.outcome.failure:
        failed = tuple((one.point.label, one.outcome.failure) for one in solved)
        return StudyReport((AnswerTable(title, ("dimension", "failure"), failed),), found=False)
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
    return StudyReport((AnswerTable(title, heads, tuple(rows)),), found)


_COUNTS = counts(
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
    "modes": Ladder(_COUNTS, _NUMBERS),
    "dimensions": Ladder(
        _dimensions, report=_dimension_report, title=lambda scene, vary: "d ln f / d ln p"
    ),
}
