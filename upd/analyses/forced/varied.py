"""What is varied in a response: levels that its errors are estimated from, levels that a wanted
accuracy chooses among, and the ladders of convergence studies.

Coarser levels that show an order give Richardson's error with the factor 1.25 of three grids, of
the order that re-entrant edges leave on fine meshes: a higher one is an accident of coarse levels.
Levels without an order (heights that the mesh hardly changes, harmonics where contacts open and
close) have their range as the scale of the error; more contact points are taken as of first order.

A wanted accuracy is reached at the least cost by rounds: they solve the peaks, estimate what every
source leaves in them, and raise what pays: mesh, modes kept, contact points, harmonics, samples.

Studies are at the scene's first stiffness and lowest F_C/F_E. A contact point at a node of its own
would never converge over meshes: the displacement under a point force grows with every refinement.
On the ladders of meshes the points are Gauss points, mean motions that no mesh changes. The ladder
of the contact runs springs on points, the cheap model, then both faces node by node, with elastic
bodies and no springs: what each costs, where its peaks lie, and how far these are from the finest
mesh of the faces.

References
----------
P. J. Roache, Verification and Validation in Computational Science and Engineering (1998), ch. 5;
L. Eca, M. Hoekstra, J. Comput. Phys. 262 (2014) 104: the range of data as the scale of an error.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from upd.analyses.forced.again import (
    HARMONICS,
    MESH,
    MODES,
    MORE_HARMONICS,
    POINTS,
    RECIPE,
    SAMPLES,
    TIME,
    changed_results,
    graded,
    lines_named,
    samples,
    with_gauss,
)
from upd.analyses.forced.interface_model import INTERFACE
from upd.analyses.forced.plan import make_plan
from upd.analyses.forced.results import make_results
from upd.analyses.forced.solve import ForcedSolution, solve
from upd.analyses.seated.plan import PATCH
from upd.errors import InputError
from upd.mesh import recipes
from upd.results import Case, ErrorPart, Estimates, Result
from upd.results import quantities as q
from upd.results.quantities import Quantity, quantity_of
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, Side
from upd.vary.ladder import (
    Asked,
    Ladder,
    StudyReport,
    chosen_levels,
    counts,
    even,
    finest_report,
    refinements,
    whole_levels,
)
from upd.vary.orders import observed_order, two_level_error
from upd.vary.outcome import SolvedPoint
from upd.vary.solve import changed
from upd.vary.variation import (
    Key,
    LevelChoice,
    Overrides,
    Problem,
    SolvedVariation,
    Variation,
    of_geometry,
)

#: names of accuracies -> numbers they are asked of
ASKED = {"peak_frequency": "peak_?_frequency", "peak": "peak_?_accelerance"}
#: times the elements of the coarsest graded mesh; the first level is the scene's own mesh
_FINER = (None, 1.5, 2, 2.5, 3)
#: times the samples
_MORE = (None, 2, 4, 8)
#: Gauss points up the slope in place of the scene's lines, which are the first level, and those
#: along the damper
_GAUSS, _COLUMNS = (None, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64), 2
_MODES = (5, 10, 20, 40)
_HARMONICS = (1, 3, 5, 7, 9, 11, 13)


def choices(scene: ForcedScene) -> list[LevelChoice]:
    """What may be chosen of a scene, by source.

    The scene's own mesh and contact points are the lowest levels, finer meshes are graded
    (`graded`); numbers of modes and harmonics may fall below its own. Gauss points
    stand for a face whatever its mesh, so that both errors fall, each by its own choice.
    """
    contact = scene.contact
    found = [
        # before the mesh, which it decides the counts of
        (POINTS, "{} Gauss points up the slope", _GAUSS, lambda _, n: with_gauss(n, _COLUMNS)),
        (MESH, "graded x {:g}", _FINER, lambda scene, n: of_geometry(graded(scene, n))),
        (MODES, "{} a blade", _MODES, lambda _, n: (("reduction.modes", n),)),
        (HARMONICS, "to {}", _HARMONICS, lambda _, n: (("balance.harmonics", n),)),
        (SAMPLES, "x {}", _MORE, lambda scene, n: (("balance.samples", samples(scene, n)),)),
    ]
    # Gauss points do not stand for lines that a scene names
    fixed = contact.rule == GAUSS or contact.share != "area" or lines_named(contact)
    without = {POINTS: fixed, MESH: scene.recipe != RECIPE}
    return [LevelChoice(one[0], *one) for one in found if not without.get(one[0])]


# -- errors by source ------------------------------------------------------------------------------


#: in the order of their parts
_SOURCES = (MESH, MODES, POINTS, HARMONICS, SAMPLES, TIME)
#: factor of safety of three levels that show an order
_SAFETY = 1.25
#: source -> factor on the range of its levels, and how that bounds its error
_RANGES = {
    # the rule is of second order: a quarter of the change remains
    SAMPLES: (_SAFETY / (1.0 - 0.25), f"change with {{}}, order 2, factor {_SAFETY:g}"),
    MODES: (1.0, "change from {}: what more modes change is less"),
    TIME: (1.0, "the highest motion that stays; {}"),
}
#: order of frequencies on fine meshes: twice the exponent of displacements at a re-entrant edge of
#: 270 degrees (M. L. Williams, J. Appl. Mech. 19, 1952, 526)
_ORDER = 2.0 * 0.5445
#: order below which levels show none
_LEAST = 0.5
#: numbers of the performance curve: their error is that of the peaks beside
_BEST = (q.BEST_RATIO, q.BEST_PEAK, q.BEST_FREQUENCY, q.BEST_REDUCTION)


def estimate(solution: ForcedSolution, numbers: Sequence[Result]) -> Estimates:
    """What every source adds to the error of the peaks, stuck frequencies and reductions.

    Parameters
    ----------
    solution
        With its levels.
    numbers
        Of the run.
    """
    levels = [*solution.levels, *_integrated(solution)] if solution.levels else []
    known = {(one.name, one.case) for level in levels for one in level.numbers}
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    for one in (one for one in numbers if not one.withheld):
        key, quantity = (one.name, one.case), quantity_of(one.name)[0]
        if key in known and one.value:
            parts = list(_parts(levels, key, one.value))
            if quantity in (q.PEAK_ACCELERANCE, q.PEAK_ACCELERANCE.on("left")):
                # heights of few meshes may agree by chance: no better known than the frequency
                twin = one.name.replace("accelerance", "frequency"), one.case
                parts = _at_least(parts, out.get(twin, ()))
            out[key] = tuple(parts)
        elif quantity in (q.REDUCTION, q.REDUCTION.on("left")) and one.value:
            side: Side = "right" if quantity == q.REDUCTION else "left"
            out[key] = tuple(_of_reduction(one, numbers, side, out))
        elif quantity in _BEST:
            out[key] = _of_best(solution, quantity, one, out)
    return {key: parts for key, parts in out.items() if parts}


def _integrated(solution: ForcedSolution) -> Iterator[SolvedVariation]:
    """The next motion towards a top, which leaves, as a level of the highest that stays."""
    of = Variation(TIME, "the next motion towards the top, which leaves")
    for curve in solution.curves:
        found = list[Result]()
        for one in {one.number: one for one in curve.checked if not one.at_top}.values():
            why = "" if one.stays else "no motion near it is stable"
            found += changed_results(curve, one.number, 1.0 + one.apart, 1.0 + one.step, why)
        if found:
            yield SolvedVariation(of, found)


def _parts(levels: Sequence[SolvedVariation], key: Key, own: float) -> Iterator[ErrorPart]:
    """Parts of one number's error.

    Parameters
    ----------
    own
        The number of the run.
    """
    for source in _SOURCES:
        mine = [one for one in levels if one.variation.source == source]
        if source == POINTS and key[1].kind == "free":
            continue
        found = [(one.variation, one.values[key] / own) for one in mine if key in one.values]
        whys = [one.reason for one in mine if one.reason]
        whys += [
            one.withheld
            for level in mine
            for one in level.numbers
            if one.withheld and (one.name, one.case) == key
        ]
        if found:
            yield ErrorPart(source, *bound(source, found))
        elif whys:
            yield ErrorPart(source, math.nan, f"not estimated: {whys[0]}")


def _at_least(parts: Sequence[ErrorPart], others: Sequence[ErrorPart]) -> list[ErrorPart]:
    """The parts, that of the mesh at least as large as another number's."""
    least = max((one.error for one in others if one.source == MESH and one.known), default=0.0)
    return [
        replace(one, error=least, basis=f"as of its frequency; {one.basis}")
        if one.source == MESH and one.error < least
        else one
        for one in parts
    ]


def bound(source: str, found: Sequence[tuple[Variation, float]]) -> tuple[float, str]:
    """Bound of a number's relative error from its other levels, and how it was found.

    Parameters
    ----------
    found
        Levels with the number over that of the run.
    """
    names = ", ".join(one.label for one, _ in found)
    ratios = [1.0, *(r for _, r in found)]
    spread = max(ratios) - min(ratios)
    if source == MESH:
        error, words = _of_meshes(found)
        return error, f"against {names}: {words}"
    if source == POINTS:
        # of an error C h^p, p >= 1, levels from the size s to S >= 1 show at least the part S - s
        sizes = [1.0, *(one.size for one, _ in found)]
        return spread / (max(sizes) - min(sizes)), f"range with {names}, order 1"
    factor, basis = _RANGES.get(source, (_SAFETY, f"range with {{}}, factor {_SAFETY:g}"))
    return factor * spread, basis.format(names)


def _of_meshes(found: Sequence[tuple[Variation, float]]) -> tuple[float, str]:
    """Richardson's error of the run from coarser meshes; their range where they show no order."""
    near = sorted(found, key=lambda one: one[0].size)[:2]
    ratios, size = [1.0, *(r for _, r in near)], near[0][0].size
    error = _SAFETY * two_level_error(ratios[1], 1.0, size, _ORDER)
    if len(near) < 2:
        return error, f"order {_ORDER:.2g} of re-entrant edges, two levels, factor {_SAFETY:g}"
    shown = observed_order([1.0, *(one.size for one, _ in near)], ratios)
    if not shown >= _LEAST:
        return _SAFETY * (max(ratios) - min(ratios)), f"range, in no order, factor {_SAFETY:g}"
    words = f"order {shown:.1f}, taken as {_ORDER:.2g} of re-entrant edges, factor {_SAFETY:g}"
    return error, words


def _of_reduction(
    one: Result, numbers: Sequence[Result], side: Side, parts: Mapping[Key, tuple[ErrorPart, ...]]
) -> Iterator[ErrorPart]:
    """Of 100 (1 - h / free), the errors of the highest peak h and of the free one, times
    (h / free) / (1 - h / free).
    """
    factor, found = abs((100.0 - one.value) / one.value), list[ErrorPart]()
    height, free = q.PEAK_ACCELERANCE.on(side), Case(stiffness=one.case.stiffness, kind="free")
    heights = [r for r in numbers if not r.withheld and quantity_of(r.name)[0] == height]
    for case in (one.case, free):
        mine = [r for r in heights if replace(r.case, mode="") == case]
        top = max(mine, key=lambda r: r.value, default=None)
        found += () if top is None else parts.get((top.name, top.case), ())
    for source in dict.fromkeys(part.source for part in found):
        same = [part for part in found if part.source == source]
        words = f"of the highest peak and of the free one: {same[0].basis}"
        yield replace(same[0], error=factor * math.fsum(p.error for p in same), basis=words)


def _of_best(
    solution: ForcedSolution,
    quantity: Quantity,
    one: Result,
    parts: Mapping[Key, tuple[ErrorPart, ...]],
) -> tuple[ErrorPart, ...]:
    """The best F_C/F_E lies between its neighbours on the curve; its peak is as well known as the
    worst known one of the run's curves, beside what more harmonics change there.
    """
    performance = solution.performances[one.case.stiffness]
    best = performance.best
    if best is None:
        return ()
    if quantity == q.BEST_RATIO:
        known = [p.ratio for p in performance.known]
        k = known.index(best.ratio)
        beside = [r / best.ratio for r in known[max(k - 1, 0) : k + 2] if r != best.ratio]
        error = max((max(r, 1.0 / r) for r in beside), default=math.nan) - 1.0
        why = "the next F_C/F_E on either side"
        return (ErrorPart("points of the curve", error, why),) if beside else ()
    of, what = q.PEAK_ACCELERANCE, "height"
    if quantity == q.BEST_FREQUENCY:
        of, what = q.PEAK_FREQUENCY, "frequency"
    mine = [
        found
        for (name, case), found in parts.items()
        if quantity_of(name)[0] in (of, of.on("left"))
        and case.stiffness == one.case.stiffness
        and case.force_ratio is not None
    ]
    if not mine:
        return ()
    worst = max(mine, key=lambda found: math.fsum(p.error for p in found if p.known))
    out = [replace(p, basis=f"as of the run's peaks: {p.basis}") for p in worst]
    if performance.finer is not None:
        at, (near, finer) = performance.finer[0].ratio, (p.worst for p in performance.finer)
        error = _SAFETY * abs(getattr(finer, what) / getattr(near, what) - 1.0)
        basis = f"{MORE_HARMONICS} harmonics more at F_C/F_E {at:.3g}, factor {_SAFETY:g}"
        out = [*(p for p in out if p.source != HARMONICS), ErrorPart(HARMONICS, error, basis)]
    if quantity == q.BEST_REDUCTION and one.value:
        factor = abs((100.0 - one.value) / one.value)
        out = [replace(p, error=factor * p.error) for p in out]
    return tuple(out)


PROBLEM = Problem(
    make_plan,
    solve,
    make_results,
    corrected=lambda solution, numbers, found: estimate(solution, numbers),
    choices=choices,
    governing=lambda scene: ASKED,
    varies_lowest=True,
    trial=lambda scene: changed(scene, (("want", ("response",)), ("left_out.solve", "no"))),
)


# -- convergence studies ---------------------------------------------------------------------------


#: numbers a ladder follows beside those the analysis names first: where the model changes, the
#: stuck frequencies
_NUMBERS = ("peak_?_frequency", "peak_?_accelerance", "stuck_in_phase", "stuck_out_of_phase")
#: element -> refinements beside each other: one more of linear elements, which cost less
_REFINE: Mapping[str, tuple[float, ...]] = {
    "hex8": (0.5, 1, 2, 3),
    "hex8i": (0.5, 1, 2, 3),
    "hex20": (0.5, 1, 2),
    "hex20r": (0.5, 1, 2),
    "hex27": (0.5, 1),
}
#: rows of Gauss points on the ladder of contact points, and on every mesh of a scene that has
#: lattice lines
_ROWS, _ON_MESHES = (2, 3, 5, 7, 10), 4


def _gauss(rows: int) -> Overrides:
    """So many rows of two Gauss points on each face."""
    return (
        ("contact.rule", GAUSS),
        ("contact.share", "area"),
        *((f"contact.{face}rows", rows) for face in ("", "left.", "right.")),
        *((f"contact.{face}columns", 2) for face in ("", "left.", "right.")),
    )


def _base(scene: ForcedScene, method: str = "balance") -> Overrides:
    """One stiffness, and one path of the balance or the sweeps alone."""
    return (
        *at_ratio(scene),
        ("contact.stiffness", [next(iter(scene.stiffnesses))]),
        ("balance.method", method),
    )


def _contact_points(scene: ForcedScene, asked: Asked) -> list[Variation]:
    return [
        Variation("contacts", f"{n} x 2 Gauss points", (*_base(scene), *_gauss(n)), 1.0 / n)
        for n in whole_levels(asked, 1) or _ROWS
    ]


def response_meshes(scene: ForcedScene, asked: Asked, *, vary: str = "mesh") -> Iterator[Variation]:
    """geometry.refine, with the scene's element ("mesh") or all that carry the contact ("element").

    Raises InputError for levels that are none, and for a recipe without ``refine``.
    """
    if not recipes.has_parameter(scene.recipe, "refine"):
        raise InputError(
            f"--vary {vary}: the recipe has no parameter refine, by which its bodies are divided; "
            "to fix it: give it one, or run the scene with meshes of your own"
        )
    whole_faces = scene.contact.model != "springs"
    known = NODE_BY_NODE if whole_faces else tuple(_REFINE)
    refined = refinements(asked)
    # Gauss points do not hang on the mesh
    keeps = whole_faces or scene.contact.rule == GAUSS
    base = (*_base(scene), *(() if keeps else _gauss(_ON_MESHES)))
    # the usual refinements; whole ones where the recipe takes no others
    default = recipes.parameters(scene.recipe).__dataclass_fields__["refine"].default
    whole = isinstance(default, int)
    for element in (scene.mesh.element,) if vary == "mesh" else known:
        for refine in refined or [n for n in _REFINE[element] if n >= 1 or not whole]:
            overrides = (*base, ("geometry.refine", refine), ("mesh.element", element))
            yield Variation(element, f"refine {refine:g}", overrides, 1.0 / refine)


def _notes(scene: ForcedScene) -> Iterator[str]:
    """What the levels set in the scene."""
    if scene.contact.model == "springs" and scene.contact.rule != GAUSS:
        yield (
            "every level: 4 x 2 Gauss points on each face, which do not hang on the mesh (what the "
            "choice of points does: --vary contacts)"
        )


# -- springs and whole faces -----------------------------------------------------------------------


#: meshes of both faces: 60, 198 and 468 nodes of the symmetric damper's half (the last has the
#: thesis's elements), 60, 196 and 460 of the asymmetric one's
_MESHES: Mapping[str, Mapping[int, tuple[int, ...]]] = {
    "symmetric": {4: (10,), 8: (20,), 12: (34,)},
    "asymmetric": {3: (6, 3), 6: (12, 6), 9: (20, 9)},
}
#: the levels run unless others are asked for: 60 and 126 nodes, 60 and 95
_USUAL = {"symmetric": (4, 6), "asymmetric": (3, 4)}
#: elements whose faces of four nodes carry a contact node by node; the first stands in for others
NODE_BY_NODE = ("hex8i", "hex8")
#: source of the levels on springs
SPRINGS = "springs"


def at_ratio(scene: ForcedScene) -> Overrides:
    """What every level of a response sets: the lowest F_C/F_E, where most slips.

    At a load under which every point sticks no level differs from another.
    """
    return (
        ("want", ["response"]),
        ("left_out.solve", "no"),
        ("excitation.centrifugal_to_force", [min(scene.excitation.centrifugal_to_force)]),
        *([("excitation.force", [])] if scene.excitation.force else []),
    )


def whole_faces_points(scene: ForcedScene, asked: Asked = None) -> list[Variation]:
    """One level for each stiffness of the springs, one for each mesh of both faces.

    Parameters
    ----------
    asked
        Elements up the patch or pad, those along it in proportion; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and for a rig whose faces are not divided by these parameters.
    """
    base = at_ratio(scene)
    made = []
    for name in scene.stiffnesses:
        overrides = (*base, ("contact.model", SPRINGS), ("contact.stiffness", [name]))
        made.append(Variation(SPRINGS, name, overrides, 1.0))
    for mesh in _meshes(scene, asked):
        slope, along = list(mesh.values())[:2]
        overrides = (*base, *_of_faces(scene), *of_geometry(mesh))
        made.append(Variation(INTERFACE, f"{slope} x {along}", overrides, 1.0))
    return made


def _of_faces(scene: ForcedScene) -> Overrides:
    """What a contact by whole faces asks of the scene."""
    mine = scene.mesh.element
    return (
        ("contact.model", INTERFACE),
        ("mesh.element", mine if mine in NODE_BY_NODE else NODE_BY_NODE[0]),
        ("balance.method", "balance"),
    )


def _meshes(scene: ForcedScene, asked: Asked) -> Iterator[dict[str, int]]:
    """Parameter -> elements, of every level: up the face first, then along it."""
    known = _MESHES[scene.arrangement]
    chosen = chosen_levels(
        asked or _USUAL[scene.arrangement],
        lambda n: float(n).is_integer() and n >= 2,
        "whole numbers of elements up a face, 2 or more",
        least=1,
    )
    slope, others = PATCH[scene.arrangement]
    missing = [key for key in (slope, *others) if key not in scene.geometry]
    if missing:
        raise InputError(
            f"--vary contact: the recipe has no {' and no '.join(missing)}, by which it divides "
            "the faces; to fix it: run the scene with meshes of your own"
        )
    most = max(known)
    for n in map(int, chosen):
        counts = known.get(n) or tuple(even(n * one / most) for one in known[most])
        yield {slope: n} | dict(zip(others, counts, strict=True))


def _contact_notes(scene: ForcedScene) -> Iterator[str]:
    """What the levels set in the scene."""
    ratio, span = min(scene.excitation.centrifugal_to_force), scene.excitation
    yield f"every level: F_C/F_E {ratio:g} alone, {span.start:g} to {span.stop:g} Hz"
    changes = ((key, value) for key, value in _of_faces(scene) if isinstance(value, str))
    settings = ", ".join(f'{key} = "{value}"' for key, value in changes)
    yield f"interface, elements up x along a face: {settings}"
    yield "springs: method, points and mesh as in the scene"


def _contact_report(
    scene: ForcedScene, solved: Sequence[SolvedPoint], names: Sequence[str]
) -> StudyReport:
    """Numbers of every level and their changes from the finest faces, whatever the contact is
    called.
    """
    nameless = []
    for one in solved:
        results = (replace(r, case=replace(r.case, stiffness="")) for r in one.outcome.results)
        nameless.append(replace(one, outcome=replace(one.outcome, results=tuple(results))))
    return finest_report(scene, nameless, names)


def _title(scene: ForcedScene, vary: str) -> str:
    """With the load."""
    what = "springs and whole faces" if vary == "contact" else f"what accuracy costs, {vary}"
    return f"{what}, F_C/F_E {min(scene.excitation.centrifugal_to_force):g}"


_march = partial(_base, method="march")
_on_levels = partial(Ladder, follow=_NUMBERS, report=finest_report, title=_title)
_on_meshes = partial(Ladder, follow=_NUMBERS, notes=_notes, title=_title)
_counts = partial(counts, base=_base, offset=1)

LADDERS: Mapping[str, Ladder] = {
    "mesh": _on_meshes(response_meshes),
    "element": _on_meshes(partial(response_meshes, vary="element")),
    "harmonics": _on_levels(
        _counts("harmonics", "to harmonic {}", "balance.harmonics", (1, 3, 5, 7), 1)
    ),
    "samples": _on_levels(
        _counts("samples", "{} samples", "balance.samples", (32, 64, 128, 256, 512), 8)
    ),
    # What sweeps up and down reach is what time steps change.
    "steps": _on_levels(
        _counts("steps", "{} steps a period", "balance.samples", (32, 64, 128, 256), 8, base=_march)
    ),
    "modes": _on_levels(
        _counts("modes", "{} modes a blade", "reduction.modes", (0, 2, 5, 10, 20, 40), 0)
    ),
    "contacts": _on_levels(_contact_points),
    "contact": Ladder(
        whole_faces_points,
        _NUMBERS,
        _contact_report,
        _contact_notes,
        _title,
    ),
}
