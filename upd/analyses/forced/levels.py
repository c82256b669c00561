"""The peaks of a response on other levels: coarser and finer in one source of error each.

Every level is a model of its own or another choice of harmonics and samples. A linear number is
read from the linear limits of the level; a peak on which a point slips or opens is climbed to from
the run's own top, and looked for in a band about it where that fails.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

from upd.analyses.cost import NODES
from upd.analyses.forced.curves import ForcedCurve, LinearCurves
from upd.analyses.forced.mode_peaks import tell_stuck_peaks
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.paths import (
    balance_like,
)
from upd.analyses.forced.peaks_again import (
    NOT_FOUND,
    Found,
    FoundPeaks,
    RunPeak,
    found_again,
    linear_of,
    moved_points,
    peak_on,
    stuck_frequency,
)
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.stiffness import FaceLaw
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import UpdError, one_line
from upd.hbm.fourier import harmonics as harmonics_of
from upd.hbm.fourier import sample_count
from upd.linalg.parallel import threads_for
from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, SIDES, FaceLines, FrictionChoice, Side
from upd.scene.quantities import UNKNOWN

log = logging.getLogger(__name__)
RECIPE = "blade_rig"
#: off the contact, see `geometry.blade_rig_params`
OFF_CONTACT = (
    "across",
    "base_columns",
    "base_side",
    "base_layers",
    "shank_layers",
    "platform_layers",
    "core_layers",
    "core_upper",
    "wing_columns",
)
#: arrangement -> counts up its faces, and the count along the damper
FACES: Mapping[str, tuple[tuple[str, ...], str]] = {
    "symmetric": (("patch_along_slope",), "patch_along_y"),
    "asymmetric": (("pad_along_slope", "face_along_z"), "pad_along_y"),
}
#: elements of the coarsest graded mesh for those of the recipe's defaults: from every re-entrant
#: edge on as many, which shank, core and platform have on both sides; few along the damper and many
#: up the slope, where free and stuck frequencies gain the least and the most for their dofs
GRADED: Mapping[str, int] = {
    "across": 4,
    "base_columns": 4,
    "base_side": 2,
    "base_layers": 4,
    "shank_layers": 4,
    "platform_layers": 6,
    "core_layers": 6,
    "core_upper": 2,
    "wing_columns": 4,
    "patch_along_slope": 8,
    "patch_along_y": 6,
    "pad_along_slope": 4,
    "pad_along_y": 4,
    "face_along_z": 4,
}
#: ratio of neighbouring sizes in the coarsest graded mesh, and its elements beside a re-entrant
#: edge outside and inside of shank, core and platform
_GROWTH, _OUTSIDE, _INSIDE = 2.0, 4, 2
#: exponent of displacements at a right-angled re-entrant edge: sin(3 pi x / 2) = -x
_EDGE = 0.5445
MESH, MODES, POINTS = "mesh", "modes kept", "contact points"
HARMONICS, SAMPLES, TIME = "harmonics", "samples", "time integration"
#: elements along every edge of the coarser meshes, over those of the run
COARSER = (0.75, 0.5)
#: spacing of the nodes of linear elements over that of quadratic ones on the same lattice
_LINEAR = 2.0
#: rows of Gauss points of the finer levels, over those of the run
MORE_ROWS = (1.5, 2.0)
#: the same of a run on lattice lines, and what stands for their number
_GAUSS_ROWS, _LATTICE = (4, 8), 3
#: harmonics that a finer level has more than the run
MORE_HARMONICS = (2,)
#: number and blade of a peak, with F_C/F_E, or None of a linear limit with its kind
Place = tuple[float | str, Side, int]
Laws = Mapping[Side, FaceLaw]


class PeakLevel(NamedTuple):
    """One level.

    Attributes
    ----------
    source, label
        Of the error; the level in words.
    size
        Of its spacing over that of the run: above 1 coarser, below 1 finer.
    peaks
        Place -> what is found there.
    stuck
        Stuck frequencies in phase and out of phase, Hz; nan without.
    seconds
        It took.
    why
        Why something was not found; "" otherwise.
    """

    source: str
    label: str
    size: float
    peaks: Mapping[Place, Found]
    stuck: tuple[float, float]
    seconds: float
    why: str = ""


# -- levels that are models ------------------------------------------------------------------------
class MadeModel(NamedTuple):
    """A level that is a model.

    Attributes
    ----------
    source, label, size
        As of `PeakLevel`.
    model
        Or why there is none.
    seconds
        That making it took.
    """

    source: str
    label: str
    size: float
    model: Model | str
    seconds: float


def coarse_model(plan: ForcedPlan, base: Model, laws: Laws, factor: float) -> MadeModel:
    """The blades on a coarser mesh with the same contact points.

    Parameters
    ----------
    base
        Of the run.
    factor
        On the elements along every edge.
    """
    begin = time.perf_counter()
    other, label, size = _coarser(plan, factor)
    if other is None:
        return MadeModel(MESH, label, size, "the mesh has no such level", 0.0)
    try:
        model = make_model(_alike(other, base), make_bodies(other), laws, base.state)
    except UpdError as error:
        return MadeModel(MESH, label, size, one_line(error), 0.0)
    return MadeModel(MESH, label, size, model, time.perf_counter() - begin)


def _coarser(plan: ForcedPlan, factor: float) -> tuple[ForcedPlan | None, str, float]:
    """The plan of a coarser mesh, its label and size.

    Where the recipe does not tell the elements, or the contact points are nodes, quadratic elements
    become linear ones with incompatible modes at the last.
    """
    scene, parameters, size = plan.scene, dict(plan.parameters), 1.0 / factor
    label = f"{factor:g} times the elements along every edge"
    gauss = scene.contact.rule == GAUSS
    fewer = times(scene, _counts(scene), factor) if scene.recipe == RECIPE and gauss else {}
    if fewer and fewer != times(scene, _counts(scene), 1.0):
        parameters |= fewer
    elif gauss and "refine" in parameters and scene.recipe != RECIPE:
        parameters["refine"] = factor * parameters["refine"]
    elif NODES[scene.mesh.element] > 8 and factor == min(COARSER):
        scene = replace(scene, mesh=replace(scene.mesh, element="hex8i"))
        parameters["element_nodes"] = NODES["hex8i"]
        label, size = "hex8i elements on the same lattice", _LINEAR
    else:
        return None, label, size
    # it has no levels of its own
    scene = replace(scene, accuracy=UNKNOWN)
    return replace(plan, scene=scene, parameters=parameters, workers=1), label, size


def _counts(scene: ForcedScene) -> tuple[str, ...]:
    return (*OFF_CONTACT, *on_contact(scene))


def other_models(plan: ForcedPlan, base: Model, bodies: Bodies, laws: Laws) -> list[MadeModel]:
    """Models of the same blades: with half of the modes, with more contact points."""
    count = plan.scene.reduction.modes
    fewer = replace(plan.scene.reduction, modes=count // 2)
    label = f"{count // 2} modes a blade"
    wanted = []
    if count > 1:
        size = count / (count // 2)
        wanted.append((MODES, label, size, replace(plan.scene, reduction=fewer)))
    for label, size, contact in _contact_levels(plan.scene.contact, laws):
        wanted.append((POINTS, label, size, replace(plan.scene, contact=contact)))
    out = []
    for source, label, size, scene in wanted:
        try:
            other = _alike(replace(plan, scene=scene), base)
            made: Model | str = make_model(other, bodies, laws, base.state)
        except UpdError as error:
            made = one_line(error)
        out.append(MadeModel(source, label, size, made, 0.0))
    return out


def _contact_levels(contact: FrictionChoice, laws: Laws) -> list[tuple[str, float, FrictionChoice]]:
    """More Gauss points than the run has; Gauss points where it has lattice lines of whole faces.

    The points of a contact law, and lines that the scene names, are a choice of the patch: they
    have no finer level.
    """
    if contact.rule == GAUSS:
        row, column = int(contact.rows), int(contact.columns)
        counts = [(math.ceil(more * row), column) for more in MORE_ROWS]
    else:
        lines = [one for side in SIDES for one in contact.lines(side)]
        named = any(one != "all" and not isinstance(one, int) for one in lines)
        if named or any(law.law is not None for law in laws.values()):
            return []
        row, counts = _LATTICE, [(rows, 2) for rows in _GAUSS_ROWS]
    return [
        (
            f"{rows} x {columns} Gauss points",
            row / rows,
            replace(
                contact,
                rule=GAUSS,
                rows=rows,
                columns=columns,
                left=FaceLines(),
                right=FaceLines(),
                share="area",
            ),
        )
        for rows, columns in counts
    ]


def model_level(peaks: FoundPeaks, made: MadeModel) -> PeakLevel:
    """The peaks on another model."""
    begin = time.perf_counter() - made.seconds
    if isinstance(made.model, str):
        return _none(made.source, made.label, made.model)
    try:
        return _level(peaks, made.model, made.source, made.label, made.size, begin)
    except UpdError as error:
        return _none(made.source, made.label, one_line(error))


def _level(
    peaks: FoundPeaks, model: Model, source: str, label: str, size: float, begin: float
) -> PeakLevel:
    base, plan = peaks.model, peaks.plan
    if (model.halved, model.contacts.tangents) != (base.halved, base.contacts.tangents):
        return _none(source, label, "another kind of contact points")
    with threads_for(len(model.M)):
        linear = linear_of(plan, model)
        found = dict(_linear_peaks(peaks, linear))
        move = moved_points(base, model)
        for curve in peaks.curves:
            for one in _first_blades(curve):
                if one.top.slips:
                    again = peak_on(peaks, model, linear, one, move)
                else:
                    again = found.get(("stuck", one.blade, one.number), NOT_FOUND)
                found |= _both_blades(one, again)
    stuck = stuck_frequency(linear, True), stuck_frequency(linear, False)
    return PeakLevel(source, label, size, found, stuck, time.perf_counter() - begin)


def _first_blades(curve: ForcedCurve) -> Iterator[RunPeak]:
    """Every mode's peak once, of the right blade where that has one."""
    for number in dict.fromkeys(number for _, number in curve.tops):
        side: Side = "right" if ("right", number) in curve.tops else "left"
        yield RunPeak(curve, side, number, curve.tops[side, number])


def _both_blades(one: RunPeak, again: Found) -> dict[Place, Found]:
    """A peak, and the other blade's of the same mode: it changes alike."""
    ratio, number = one.curve.ratio, one.number
    out: dict[Place, Found] = {(ratio, one.blade, number): again}
    other: Side = "left" if one.blade == "right" else "right"
    own, first = one.curve.compared(other, number), one.curve.compared(one.blade, number)
    if own is not None and first is not None:
        f, height = again.frequency / first[0], again.height / first[1]
        out[ratio, other, number] = Found(f * own[0], height * own[1])
    return out


def _none(source: str, label: str, why: str) -> PeakLevel:
    log.info("%s, %s: %s", source, label, why)
    return PeakLevel(source, label, 1.0, {}, (math.nan, math.nan), 0.0, why)


def _alike(plan: ForcedPlan, model: Model) -> ForcedPlan:
    """The plan with the sliding directions of a model, one blade after the other."""
    directions: Literal["one", "two"] = "one" if model.contacts.tangents < 2 else "two"
    contact = replace(plan.scene.contact, directions=directions)
    return replace(plan, scene=replace(plan.scene, contact=contact), workers=1)


def _linear_peaks(peaks: FoundPeaks, linear: LinearCurves) -> Iterator[tuple[Place, Found]]:
    """Peaks of the limits by rising frequency, with the numbers they have in the run."""
    for kind in ("free", "stuck"):
        for side in SIDES:
            own, other = (
                sorted(getattr(one, f"{kind}_peaks")[side], key=lambda p: p.frequency)
                for one in (peaks.linear, linear)
            )
            numbers = linear_numbers(peaks, kind, side)
            for number, peak in zip(numbers, other, strict=False):
                if len(own) == len(other):
                    yield (kind, side, number), Found(peak.frequency, peak.height)


def linear_numbers(peaks: FoundPeaks, kind: str, side: Side) -> list[int]:
    """Numbers of a limit's peaks, by rising frequency."""
    own = sorted(getattr(peaks.linear, f"{kind}_peaks")[side], key=lambda p: p.frequency)
    if kind == "free":
        return list(range(1, len(own) + 1))
    told = tell_stuck_peaks(peaks.model, own, peaks.plan.scene.excitation.stop)
    return [one.number for one in sorted(told, key=lambda p: p.frequency)]


# -- harmonics and samples -------------------------------------------------------------------------
def balance_level(peaks: FoundPeaks, source: str, more: int, factor: int) -> PeakLevel:
    """The peaks with friction with more harmonics, or more samples in a period.

    Parameters
    ----------
    more
        Harmonics more.
    factor
        On the samples.
    """
    label = f"{more} harmonics more" if more else f"{factor} times the samples"
    begin, found, size = time.perf_counter(), dict[Place, Found](), 1.0 / factor
    plan, model, why = peaks.plan, peaks.model, ""
    with threads_for(len(model.M)):
        for curve in peaks.curves:
            old = curve.answer.balance
            highest = old.harmonics.highest + more
            size = 1.0 / factor if not more else old.harmonics.highest / highest
            numbers = range(highest + 1)
            samples = max(factor * old.samples, sample_count(harmonics_of(numbers)))
            b = balance_like(plan, model, curve.force, old, numbers, samples)
            for one in _first_blades(curve):
                if not one.top.slips or curve.stayed(one.blade, one.number) is not None:
                    continue
                try:
                    again = found_again(plan, model, one, b, b.embedded(one.top.x, old))
                except UpdError as error:
                    why = one_line(error)
                    log.info("%s, %s: %s", label, curve.case, why)
                    again = NOT_FOUND
                found |= _both_blades(one, again)
    seconds = time.perf_counter() - begin
    return PeakLevel(source, label, size, found, (math.nan, math.nan), seconds, why)


def at_place(
    levels: Sequence[PeakLevel], source: str, place: Place
) -> list[tuple[PeakLevel, Found]]:
    """What the levels of a source have at a place."""
    return [
        (one, one.peaks[place]) for one in levels if one.source == source and place in one.peaks
    ]


# -- numbers of elements ---------------------------------------------------------------------------


def count_of(scene: ForcedScene, key: str) -> int:
    """A number of elements, as the scene or the recipe gives it."""
    default = recipes.parameters(scene.recipe).__dataclass_fields__[key].default
    return int(scene.geometry.get(key, default))


def on_contact(scene: ForcedScene) -> tuple[str, ...]:
    """Counts of the scene's contact faces that its recipe has."""
    slopes, along = FACES[scene.arrangement]
    return tuple(key for key in (*slopes, along) if recipes.has_parameter(scene.recipe, key))


def meshed(scene: ForcedScene) -> tuple[str, ...]:
    """Counts that its mesh is refined by: on the contact too, where the contact points are none of
    its nodes.
    """
    return (*OFF_CONTACT, *(on_contact(scene) if scene.contact.rule == GAUSS else ()))


def times(scene: ForcedScene, keys: tuple[str, ...], factor: float) -> dict[str, Any]:
    """So many times the counts, rounded up to those the recipe allows, as its parameters."""
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    out = {}
    for key in keys:
        step = 2 if known[key].metadata["bounds"].even else 1
        count = -int(-factor * count_of(scene, key) / step // 1)
        out[key] = step * max(1, count)
    return out


def graded(scene: ForcedScene, factor: float) -> dict[str, Any]:
    """A mesh that gets finer at re-entrant edges faster than elsewhere, as the recipe's parameters.

    Where displacements go with r^a from an edge, elements of order p leave an error of h^p if their
    sizes are h r^(1 - a/p) [1]_: a stretch that ends there is divided at (i/n)^q, q = p/a, and its
    last size is n^(q - 1) times its first. With s times the elements, sizes that grow by g each do
    so with g^(n - 1) = 2^(n_1 - 1) s^(q - 1), n = s n_1; a = 0.5445 at a right angle [2]_. Equal
    division, or one that keeps the ratio of sizes, leaves h^a, and one that keeps g as much as its
    largest elements leave.

    Parameters
    ----------
    scene
        Its own counts multiply those of the mesh, over the defaults of the recipe.
    factor
        s, 1 or more.

    Returns
    -------
    dict
        Counts, those on the contact where it is refined too (`meshed`), and growths.

    References
    ----------
    .. [1] I. Babuska, R. B. Kellogg, J. Pitkaranta, Numer. Math. 33 (1979) 447.
    .. [2] M. L. Williams, J. Appl. Mech. 19 (1952) 526.
    """
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    order = 1 if NODES[scene.mesh.element] == 8 else 2
    out: dict[str, Any] = {}
    for key in meshed(scene):
        step = 2 if known[key].metadata["bounds"].even else 1
        own = count_of(scene, key) / int(known[key].default)
        # up to rounding in the product
        out[key] = step * max(1, math.ceil(round(factor * GRADED[key] * own / step, 9)))
    for name, n in (("growth", _OUTSIDE), ("growth_inside", _INSIDE)):
        ends = _GROWTH ** (n - 1) * factor ** (order / _EDGE - 1.0)
        out[name] = ends ** (1.0 / (factor * n - 1.0))
    return out
