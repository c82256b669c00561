"""Peaks of the run found again with one thing changed, on its reduced models.

Linear numbers are those of the linear limits. A peak with friction is climbed to from the run's own
top; on other contact points, and where the climb fails, it is looked for in a band about it, then
in the whole sweep. A change of a top is also that of the highest motion that stays below it.

Levels are coarser and finer in one source of error each: the scene with one thing changed.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np

from upd.analyses.cost import NODES
from upd.analyses.forced import measures
from upd.analyses.forced.curves import LinearCurves, PointCurve, Top, linear_of, stuck_frequency
from upd.analyses.forced.measures import numbered_peaks
from upd.analyses.forced.model import (
    BAND,
    BAND_POINTS,
    LONG_STEPS,
    SWEEP_POINTS,
    Model,
    balance_of,
    make_model,
    respond,
)
from upd.analyses.forced.peaks import climbed
from upd.analyses.forced.plan import ForcedPlan, parameters_of
from upd.analyses.forced.statics import face_laws
from upd.analyses.measured import CurvePeak
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import ConvergenceError, UpdError, one_line
from upd.hbm.core.fourier import harmonics, sample_count
from upd.hbm.springs.peak import FIRST_REACH, is_near
from upd.hbm.springs.sweep import newton
from upd.linalg.parallel import threads_for
from upd.mesh import recipes
from upd.progress import Stages
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, SIDES, FaceLines, FrictionChoice, Side
from upd.scene.quantities import UNKNOWN
from upd.vary.solve import changed
from upd.vary.variation import Overrides, SolvedVariation, Variation, of_geometry

log = logging.getLogger(__name__)
#: first step of a climb that begins at the run's own top, over the usual one: maxima side by side
#: of a flat top are nearer than that
_CLOSE = 0.1
#: points of a path along a band
_MOST_POINTS = 400


def run_curve(curve: PointCurve) -> PointCurve:
    """The curve without its path, which is long: its balance, peaks and tops stay."""
    found = {f.name: getattr(curve.answer, f.name) for f in fields(curve.answer)}
    bare: Any = {name: one[:0] for name, one in found.items() if isinstance(one, np.ndarray)}
    return replace(curve, accelerance={}, more={}, answer=replace(curve.answer, **bare))


class Run(NamedTuple):
    """What is looked for again: the curves of one contact stiffness, with its model and limits."""

    plan: ForcedPlan
    name: str
    model: Model
    linear: LinearCurves
    curves: tuple[PointCurve, ...]


class Variant(NamedTuple):
    """The run with one thing changed.

    Attributes
    ----------
    of
        The change. Without a size it is no level: peaks may then move far, and the highest of their
        mode is taken, wherever in the sweep and however high.
    plan
        With it.
    model
        The changed model; None where the run's own is solved with other harmonics or samples.
    reason
        Why it is not solved.
    """

    of: Variation
    plan: ForcedPlan
    model: Model | None = None
    reason: str = ""


def make_variant(
    plan: ForcedPlan, name: str, base: Model, bodies: Bodies | None, of: Variation
) -> Variant:
    """The model of a variation with the sliding directions and the static state of the run's; why
    there is none.

    Parameters
    ----------
    plan, name
        With the totals of the contact stiffness of this name.
    base
        Of the run.
    bodies
        Of the run; None: they are meshed again.
    """
    fixed = "one" if base.contacts.tangents < 2 else "two"
    if not of.overrides:
        return Variant(of, plan, reason="the mesh has no such level")
    try:
        scene = changed(plan.scene, (("contact.directions", fixed), *of.overrides))
        other = replace(plan, scene=scene, parameters=parameters_of(scene), workers=1)
        if {path.partition(".")[0] for path, _ in of.overrides} == {"balance"}:
            return Variant(of, other)
        laws = face_laws(scene.stiffness[name], Stages())
        state = base.state if scene.contact.static == plan.scene.contact.static else None
        model = make_model(other, bodies or make_bodies(other), laws, state)
    except UpdError as error:
        log.info("%s, %s: %s", of.source, of.label, one_line(error))
        return Variant(of, plan, reason=one_line(error))
    return Variant(of, other, model)


def solve_again(run: Run, variant: Variant) -> SolvedVariation:
    """The numbers of the run's peaks with one thing changed; a fault becomes its reason."""
    of, model, numbers = variant.of, variant.model or run.model, list[Result]()
    if variant.reason:
        return SolvedVariation(of, reason=variant.reason)
    other = run._replace(plan=variant.plan, model=model)
    with threads_for(len(model.M)):
        if variant.model is not None:
            other = other._replace(linear=linear_of(variant.plan, model))
            numbers += limit_results(run.name, other.linear)
        for curve in run.curves:
            numbers += _changes(run, other, curve, of)
    return SolvedVariation(of, numbers)


# -- numbers ---------------------------------------------------------------------------------------


def limit_results(name: str, linear: LinearCurves) -> list[Result]:
    """Stuck frequencies of both blades, peaks free and stuck of each."""
    results, case = [], Case(stiffness=name)
    for in_phase, quantity in ((True, q.STUCK_IN_PHASE), (False, q.STUCK_OUT_OF_PHASE)):
        if math.isfinite(frequency := stuck_frequency(linear.modes, in_phase)):
            results.append(quantity.of(frequency, case))
    for blade in SIDES[::-1]:
        for kind, peaks in (("free", linear.free_peaks), ("stuck", linear.stuck_peaks)):
            for peak in peaks[blade]:
                results += peak_results(replace(case, kind=kind), peak, blade)
    return results


def peak_results(case: Case, peak: CurvePeak, blade: Side, withheld: str = "") -> list[Result]:
    """Frequency and height of a numbered peak."""
    case = replace(case, mode=peak.mode)
    return [
        quantity.on(blade).of(value, case, n=peak.number, withheld=withheld)
        for quantity, value in (
            (q.PEAK_FREQUENCY, peak.frequency),
            (q.PEAK_ACCELERANCE, peak.height),
        )
    ]


def changed_results(
    curve: PointCurve, number: int, frequency: float, height: float, why: str = ""
) -> Iterator[Result]:
    """A numbered peak of both blades with its frequency and height times these factors, or why it
    was not found.
    """
    for side, peaks in curve.peaks.items():
        for peak in (one for one in peaks if one.number == number):
            again = peak._replace(frequency=peak.frequency * frequency, height=peak.height * height)
            yield from peak_results(curve.case, again, side, why)


def _changes(run: Run, other: Run, curve: PointCurve, of: Variation) -> Iterator[Result]:
    """Every peak of a curve: of the right blade where that has one, the other changes alike."""
    for number in dict.fromkeys(number for _, number in curve.tops):
        side: Side = "right" if ("right", number) in curve.tops else "left"
        top = curve.tops[side, number]
        leaves = any(one.number == number and not one.at_top for one in curve.checked)
        if other.model is run.model and (leaves or not top.slips):
            # all sticks, or the height is that of a time integration, which has all harmonics
            continue
        try:
            f, height = peak_again(run, other, curve, side, number, far=math.isnan(of.size))
            yield from changed_results(curve, number, f / top.frequency, height / top.height)
        except UpdError as error:
            log.info("%s, %s, %s: %s", of.source, of.label, curve.case, one_line(error))
            yield from changed_results(curve, number, math.nan, math.nan, one_line(error))


# -- peaks with friction ---------------------------------------------------------------------------


def peak_again(
    run: Run, other: Run, curve: PointCurve, side: Side, number: int, *, far: bool
) -> tuple[float, float]:
    """Frequency and height of a peak on another model: climbed to from the run's top; else on a
    path along a band about it, then along the whole sweep, as the loop of a fold may be longer than
    any band.

    Parameters
    ----------
    run, other
        With the peak, and with another plan, model and limits.
    curve
        Of the run.
    far
        Whether the peak may be far from the run's.

    Raises
    ------
    ConvergenceError
        Where none is near the run's.
    """
    top, old = curve.tops[side, number], curve.answer.balance
    plan, model = other.plan, other.model
    b = balance_of(plan, model, curve.force, plan.scene.harmonic_numbers)
    ratio = expected(run.linear, other.linear, top, number)
    alike = (len(b.Psi), b.contacts.tangents, b.rigid)
    if alike == (len(old.Psi), old.contacts.tangents, old.rigid):
        x = b.embedded(top.x, old)
        for f in dict.fromkeys((ratio * top.frequency, top.frequency)):
            start = newton(b, x, f)
            if start is None:
                continue
            about, reach = top._replace(frequency=f), _CLOSE * FIRST_REACH
            new = climbed(model, b, start, f, side, curve.force, about, reach)
            if new is not None:
                return new.frequency, new.height
    f, e = ratio * top.frequency, plan.scene.excitation
    settings = replace(LONG_STEPS, most_points=_MOST_POINTS)
    for span in (
        np.linspace((1.0 - BAND) * f, (1.0 + BAND) * f, BAND_POINTS),
        np.linspace(e.start, e.stop, SWEEP_POINTS),
    ):
        try:
            answer = respond(plan, model, curve.force, span, settings=settings)
        except ConvergenceError as error:
            log.info("band about %.6g Hz: %s", f, one_line(error))
            continue
        if not len(answer.frequency):
            continue
        size = np.abs(measures.accelerance(answer, model.row(side), curve.force))
        for peak in numbered_peaks(model, answer, size, e.stop):
            near = far or is_near(peak.frequency / f, peak.height / top.height)
            if peak.number == number and near:
                return peak.frequency, peak.height
    raise ConvergenceError("not found on the level")


def expected(own: LinearCurves, other: LinearCurves, top: Top, number: int) -> float:
    """Ratio of a peak's frequency on another model to that of the run, between those of the free
    and of the stuck mode by where the peak lies.
    """
    stuck, again = (stuck_frequency(one.modes, number % 2 == 1) for one in (own, other))
    # the lowest free peaks
    peaks = (one.free_peaks["right"] or one.free_peaks["left"] for one in (own, other))
    start, free = (found[0].frequency if found else math.nan for found in peaks)
    if not math.isfinite(stuck + again + start + free) or stuck == start:
        return again / stuck if math.isfinite(again / stuck) else 1.0
    share = min(max((top.frequency - start) / (stuck - start), 0.0), 1.0)
    return free / start + share * (again / stuck - free / start)


# -- levels ----------------------------------------------------------------------------------------


RECIPE = "blade_rig"
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
#: begin counts on the contact
_ON_CONTACT = {"symmetric": ("patch",), "asymmetric": ("pad", "face")}
#: off the contact, see `geometry.blade_rig_params`
OFF_CONTACT = tuple(key for key in GRADED if not key.startswith(("patch", "pad", "face")))
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
#: rows of Gauss points of the levels, over those of the run
OTHER_ROWS = (1.5, 0.7)
#: the same of a run on lattice lines, and what stands for their number
_GAUSS_ROWS, _LATTICE = (4, 8), 3
#: harmonics that a finer level has more than the run
MORE_HARMONICS = 2


def level_variations(plan: ForcedPlan) -> list[Variation]:
    """Half of the modes, more contact points; more harmonics, more samples; coarser meshes."""
    scene = plan.scene
    modes, highest = scene.reduction.modes, int(scene.balance.harmonics)
    few = modes // 2
    half, (more, finer) = (("reduction.modes", few),), more_harmonics(scene)
    twice = (("balance.samples", samples(scene, 2)),)
    return [
        *([Variation(MODES, f"{few} modes a blade", half, size=modes / few)] if few else []),
        *_contact_levels(scene.contact),
        Variation(HARMONICS, f"{MORE_HARMONICS} harmonics more", finer, size=highest / more),
        Variation(SAMPLES, "2 times the samples", twice, size=0.5),
        *(_coarser(plan, factor) for factor in COARSER),
    ]


def more_harmonics(scene: ForcedScene) -> tuple[int, Overrides]:
    """The highest of some harmonics more, and what makes them: with samples for them."""
    more = int(scene.balance.harmonics) + MORE_HARMONICS
    return more, (("balance.harmonics", more), ("balance.samples", samples(scene, 1, more)))


def samples(scene: ForcedScene, factor: int, highest: int = 1) -> int:
    """So many times those of the scene's balance, and as many as the rule gives a harmonic."""
    given, rule = scene.balance.samples, sample_count(harmonics(range(highest + 1)))
    own = sample_count(harmonics(scene.harmonic_numbers)) if given == "auto" else int(given)
    return max(factor * own, rule)


def _coarser(plan: ForcedPlan, factor: float) -> Variation:
    """The blades on a coarser mesh with the same contact points; without overrides where the mesh
    has no such level.

    Where the recipe does not tell the elements, or the contact points are nodes, quadratic elements
    become linear ones with incompatible modes at the last.
    """
    scene, size = plan.scene, 1.0 / factor
    gauss, own = scene.contact.rule == GAUSS, scene.recipe == RECIPE
    label, changes = f"{factor:g} times the elements along every edge", Overrides()
    if gauss and own and (fewer := times(scene, factor)) != times(scene, 1.0):
        changes = of_geometry(fewer)
    elif gauss and not own and "refine" in plan.parameters:
        changes = of_geometry({"refine": factor * plan.parameters["refine"]})
    elif NODES[scene.mesh.element] > 8 and factor == min(COARSER):
        changes = (("mesh.element", "hex8i"),)
        label, size = "hex8i elements on the same lattice", _LINEAR
    # it has no levels of its own
    alone = (*changes, ("accuracy", UNKNOWN)) if changes else ()
    return Variation(MESH, label, alone, size=size)


def lines_named(contact: FrictionChoice) -> bool:
    """Whether a scene names single lattice lines."""
    lines = [one for side in SIDES for one in contact.lines(side)]
    return any(one != "all" and not isinstance(one, int) for one in lines)


def with_gauss(rows: int, columns: int) -> Overrides:
    """So many Gauss points on each face."""
    return (
        ("contact.rule", GAUSS),
        ("contact.rows", rows),
        ("contact.columns", columns),
        ("contact.share", "area"),
        *((f"contact.{side}", FaceLines()) for side in SIDES),
    )


def _contact_levels(contact: FrictionChoice) -> list[Variation]:
    """More and fewer Gauss points than the run has; Gauss points where it has lattice lines of
    whole faces.

    Lines that the scene names are a choice of the patch: they have no finer level.
    """
    row, columns, rows = _LATTICE, 2, list(_GAUSS_ROWS)
    if contact.rule == GAUSS:
        row, columns = int(contact.rows), int(contact.columns)
        rows = [math.ceil(factor * row) for factor in OTHER_ROWS]
    elif lines_named(contact):
        return []
    return [
        Variation(POINTS, f"{m} x {columns} Gauss points", with_gauss(m, columns), size=row / m)
        for m in dict.fromkeys(rows)
        if m != row
    ]


# -- numbers of elements ---------------------------------------------------------------------------


def times(
    scene: ForcedScene, factor: float, base: Mapping[str, int] | None = None
) -> dict[str, int]:
    """So many times the counts that its mesh is refined by, rounded up to those that the recipe
    allows: on the contact too, where the contact points are none of its nodes.

    Parameters
    ----------
    base
        Counts in place of the recipe's defaults.
    """
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    on = _ON_CONTACT[scene.arrangement] if scene.contact.rule == GAUSS else ()
    out = {}
    for key in (key for key in GRADED if key in OFF_CONTACT or key.startswith(on)):
        default = int(known[key].default)
        count = factor * int(scene.geometry.get(key, default))
        if base is not None:
            count *= base[key] / default
        step = 2 if known[key].metadata["bounds"].even else 1
        # up to rounding in the product
        out[key] = step * max(1, math.ceil(round(count / step, 9)))
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
        Counts, those on the contact where it is refined too (`times`), and growths.

    References
    ----------
    .. [1] I. Babuska, R. B. Kellogg, J. Pitkaranta, Numer. Math. 33 (1979) 447.
    .. [2] M. L. Williams, J. Appl. Mech. 19 (1952) 526.
    """
    order = 1 if NODES[scene.mesh.element] == 8 else 2
    out: dict[str, Any] = {**times(scene, factor, GRADED)}
    for name, n in (("growth", _OUTSIDE), ("growth_inside", _INSIDE)):
        ends = _GROWTH ** (n - 1) * factor ** (order / _EDGE - 1.0)
        out[name] = ends ** (1.0 / (factor * n - 1.0))
    return out
