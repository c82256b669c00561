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
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from upd.analyses.cost import NODES
from upd.analyses.forced import measures
from upd.analyses.forced.curves import ForcedCurve, LinearCurves, TimeCheck, Top
from upd.analyses.forced.linear_limits import linear_limits_of
from upd.analyses.forced.measures import Unsolved
from upd.analyses.forced.mesh_counts import OFF_CONTACT, RECIPE, on_contact, times
from upd.analyses.forced.mode_peaks import tell_stuck_peaks
from upd.analyses.forced.model import Array, Model, make_model
from upd.analyses.forced.moved_points import straight
from upd.analyses.forced.paths import (
    BAND,
    BAND_POINTS,
    LONG_STEPS,
    SWEEP_POINTS,
    balance_like,
    balance_of,
    respond,
)
from upd.analyses.forced.peaks import climbed, confirmed, peak_of_mode, with_tops
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.stiffness import FaceLaw
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import ConvergenceError, UpdError, one_line
from upd.hbm.balance import Balance
from upd.hbm.fourier import harmonics as harmonics_of
from upd.hbm.fourier import sample_count
from upd.hbm.peaks import FIRST_REACH, is_near
from upd.hbm.starts import newton
from upd.linalg.parallel import threads_for
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, SIDES, FaceLines, FrictionChoice, Side
from upd.scene.quantities import UNKNOWN

log = logging.getLogger(__name__)
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
#: first step of a climb that begins at the run's own top, over the usual one: maxima side by side
#: of a flat top are nearer than that
_CLOSE = 0.1
#: points of a path along a band
_MOST_POINTS = 400
#: number and blade of a peak, with F_C/F_E, or None of a linear limit with its kind
Place = tuple[float | str, Side, int]
Laws = Mapping[Side, FaceLaw]


class Found(NamedTuple):
    """Frequency in Hz and height in (m/s2)/N of a peak on a level; nan where it was not found."""

    frequency: float
    height: float


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
        Why nothing was found; "" otherwise.
    """

    source: str
    label: str
    size: float
    peaks: Mapping[Place, Found]
    stuck: tuple[float, float]
    seconds: float
    why: str = ""


@dataclass(frozen=True)
class FoundPeaks:
    """What is looked for on every level, by one contact stiffness.

    Attributes
    ----------
    plan, model
        Of the run.
    linear
        Its linear limits.
    curves
        With their peaks and tops.
    """

    plan: ForcedPlan
    model: Model
    linear: LinearCurves
    curves: tuple[ForcedCurve, ...]

    @property
    def bare(self) -> FoundPeaks:
        """Without what a level does not need of the curves: less to send."""
        return replace(self, curves=tuple(_bare(one) for one in self.curves))


def _bare(curve: ForcedCurve) -> ForcedCurve:
    a = curve.answer
    nothing = {name: getattr(a, name)[:0] for name in _ALONG}
    return replace(curve, answer=replace(a, **nothing), accelerance={})


_ALONG = (
    "frequency",
    "x",
    "contact_displacement",
    "contact_force",
    "state",
    "energy",
    "linear",
    "truncation",
    "aliasing",
    "periodic",
    "highest_harmonic",
)


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
    return _level(peaks, made.model, made.source, made.label, made.size, begin)


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
            for side, number, top in _first_blades(curve):
                place = (curve.ratio, side, number)
                if top.slips:
                    again = peak_on(peaks, model, linear, curve, side, number, top, move)
                else:
                    again = found.get(("stuck", side, number), Found(math.nan, math.nan))
                found[place] = again
                found |= _other_blade(curve, side, number, again)
    stuck = _stuck(linear, True), _stuck(linear, False)
    return PeakLevel(source, label, size, found, stuck, time.perf_counter() - begin)


def _first_blades(curve: ForcedCurve) -> Iterator[tuple[Side, int, Top]]:
    """Every mode's peak once, of the right blade where that has one."""
    for number in dict.fromkeys(number for _, number in curve.tops):
        side: Side = "right" if ("right", number) in curve.tops else "left"
        yield side, number, curve.tops[side, number]


def _other_blade(curve: ForcedCurve, side: Side, number: int, again: Found) -> dict[Place, Found]:
    """The other blade's peak of the same mode: it changes alike."""
    other: Side = "left" if side == "right" else "right"
    own, first = curve.compared(other, number), curve.compared(side, number)
    if own is None or first is None:
        return {}
    f, height = again.frequency / first[0], again.height / first[1]
    return {(curve.ratio, other, number): Found(f * own[0], height * own[1])}


def _none(source: str, label: str, why: str) -> PeakLevel:
    log.info("%s, %s: %s", source, label, why)
    return PeakLevel(source, label, 1.0, {}, (math.nan, math.nan), 0.0, why)


def linear_of(plan: ForcedPlan, model: Model) -> LinearCurves:
    """The linear limits of a model."""
    force = plan.scene.damper.centrifugal
    problem = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    return linear_limits_of(plan, model, Unsolved(problem), force)


def _alike(plan: ForcedPlan, model: Model) -> ForcedPlan:
    """The plan with the sliding directions of a model, one blade after the other."""
    directions: Literal["one", "two"] = "one" if model.contacts.tangents < 2 else "two"
    contact = replace(plan.scene.contact, directions=directions)
    return replace(plan, scene=replace(plan.scene, contact=contact), workers=1)


def _stuck(linear: LinearCurves, in_phase: bool) -> float:
    found = (m.frequency for m in linear.modes if m.axis == "x" and m.in_phase == in_phase)
    return next(found, math.nan)


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


# -- a peak on another level -----------------------------------------------------------------------


def peak_on(
    peaks: FoundPeaks,
    model: Model,
    linear: LinearCurves,
    curve: ForcedCurve,
    side: Side,
    number: int,
    top: Top,
    move: Array | None,
) -> Found:
    """A peak with friction on another model.

    Parameters
    ----------
    move
        (n, n_run) motion of the model's points from that of the run's; None where they are the
        same.
    """
    old = curve.answer.balance
    ratio = expected(peaks.linear, linear, number, top.frequency)
    check = curve.stayed(side, number)
    if check is not None:
        return confirmed_again(peaks, model, linear, curve, check, ratio)
    b = balance_of(peaks.plan, model, curve.force, old.harmonics.numbers, old.samples)
    x = top.x if move is None else carried(b, old, top.x, move)
    return found_again(peaks.plan, model, curve, side, number, top, b, x, ratio)


def confirmed_again(
    peaks: FoundPeaks,
    model: Model,
    linear: LinearCurves,
    curve: ForcedCurve,
    check: TimeCheck,
    ratio: float,
) -> Found:
    """The highest motion that stays on another model, where the top of the run's path leaves: the
    border between both moves too.
    """
    plan, force, old = peaks.plan, curve.force, curve.answer.balance
    f = ratio * check.frequency
    band = np.linspace((1.0 - 2.0 * BAND) * f, (1.0 + 2.0 * BAND) * f, 2 * BAND_POINTS)
    settings = replace(LONG_STEPS, most_points=_MOST_POINTS)
    answer = respond(
        plan,
        model,
        force,
        band,
        harmonics=old.harmonics.numbers,
        samples=old.samples,
        settings=settings,
    )
    blades = {s: measures.accelerance(answer, model.row(s), force) for s in SIDES}
    path = ForcedCurve(curve.stiffness, curve.ratio, force, answer, blades, 0.0)
    if path.empty:
        return Found(math.nan, math.nan)
    path = confirmed(plan, model, with_tops(plan, model, linear, path))
    mine = [p for p in path.peaks[check.blade] if p.number == check.number]
    return Found(mine[0].frequency, mine[0].height) if mine else Found(math.nan, math.nan)


def expected(own: LinearCurves, other: LinearCurves, number: int, frequency: float) -> float:
    """Ratio of a peak's frequency on another model to that of the run, between those of the free
    and of the stuck mode by where the peak lies.
    """
    in_phase = number % 2 == 1
    stuck, again = _stuck(own, in_phase), _stuck(other, in_phase)
    free = [one.free_peaks["right"] or one.free_peaks["left"] for one in (own, other)]
    if not (math.isfinite(stuck) and math.isfinite(again) and all(free)):
        return 1.0
    start = free[0][0].frequency
    ends = free[1][0].frequency / start, again / stuck
    if stuck == start:
        return ends[1]
    share = min(max((frequency - start) / (stuck - start), 0.0), 1.0)
    return ends[0] + share * (ends[1] - ends[0])


def found_again(
    plan: ForcedPlan,
    model: Model,
    curve: ForcedCurve,
    side: Side,
    number: int,
    top: Top,
    b: Balance,
    x: Array,
    ratio: float = 1.0,
    any_height: bool = False,
    **changes: Any,
) -> Found:
    """A peak of another problem: climbed to from the run's top; in a band about it, then in the
    whole sweep, as the highest of several maxima, where the run has these or the climb fails.

    Parameters
    ----------
    b, x
        The problem, and the run's motion at the top in its unknowns.
    ratio
        Of its frequency to that of the run, as far as the linear limits tell.
    any_height
        Whether it may lie anywhere in the sweep and have any height: the highest of its mode.
    **changes
        Of the problem, as `respond` takes them.
    """
    for factor in dict.fromkeys((ratio, 1.0)) if not top.crowded else ():
        f = factor * top.frequency
        start = newton(b, x, f)
        if start is not None:
            about = top._replace(frequency=f)
            new = climbed(model, b, start, f, side, curve.force, about, _CLOSE * FIRST_REACH)
            if new is not None:
                return Found(new.frequency, new.height)
    f = ratio * top.frequency
    e = plan.scene.excitation
    bands = [
        np.linspace((1.0 - BAND) * f, (1.0 + BAND) * f, BAND_POINTS),
        # the loop of a fold may be longer than any band
        np.linspace(e.start, e.stop, SWEEP_POINTS),
    ]
    for band in bands:
        given: dict[str, Any] = {"harmonics": b.harmonics.numbers, "samples": b.samples}
        given["settings"] = replace(LONG_STEPS, most_points=_MOST_POINTS)
        try:
            peak = peak_of_mode(plan, model, curve.force, side, number, band, **(given | changes))
        except ConvergenceError as error:
            log.info("band about %.6g Hz: %s", f, one_line(error))
            continue
        if peak is not None and (any_height or is_near(peak[0] / f, peak[1] / top.height)):
            return Found(*peak)
    return Found(math.nan, math.nan)


def moved_points(base: Model, other: Model) -> Array | None:
    """(n, n_base) displacements of a model's points from those of the run's, on the same faces, by
    straight lines up the slope; None where the points are the same.
    """
    if np.array_equal(base.position.shape, other.position.shape) and np.allclose(
        _up(base), _up(other), atol=1e-6 * float(np.ptp(_up(base)) or 1.0)
    ):
        return None
    out = np.zeros((other.contacts.n_point, base.contacts.n_point))
    for k in range(len(SIDES)):
        mine, new = np.flatnonzero(base.face == k), np.flatnonzero(other.face == k)
        x, s = _up(base)[mine], _up(other)[new]
        rows = np.unique(np.round(x, 9))
        weight = straight(rows, s)
        for j, row in enumerate(rows):
            on = mine[np.isclose(x, row, atol=1e-8 * max(np.ptp(x), 1.0))]
            # along the damper the motion hardly changes: the mean of the row's points
            out[np.ix_(new, on)] = weight[:, j : j + 1] / len(on)
    return out


def _up(model: Model) -> Array:
    """(n,) places up the slope from the middle of each face, mm."""
    out = np.zeros(len(model.face))
    for k, side in enumerate(SIDES):
        on, face = model.face == k, model.faces[side]
        local = face.position @ face.frame[2]
        out[on] = local - face.weight @ local
    return out


def carried(b: Balance, old: Balance, x: Array, move: Array) -> Array:
    """Unknowns of a motion on another model: the same motion of its points, and the rigid motion
    that goes with it.
    """
    W, _ = old.split(x)
    moved = np.einsum("pq,qdk->pdk", move, W)
    flat = np.concatenate([moved.ravel(), np.zeros(b.rigid)])
    if not b.rigid:
        return flat
    F = b.force(flat, False).force.reshape(len(b.Psi), -1)
    rows = b.Psi[:, b.modal.rigid]
    mean = moved.reshape(len(b.Psi), -1)[:, 0] + b.G0 @ F[:, 0] - b.u0
    a = np.linalg.lstsq(rows, mean, rcond=None)[0]
    return np.concatenate([moved.ravel(), a])


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
    plan, model = peaks.plan, peaks.model
    with threads_for(len(model.M)):
        for curve in peaks.curves:
            old = curve.answer.balance
            highest = old.harmonics.highest + more
            size = 1.0 / factor if not more else old.harmonics.highest / highest
            numbers = range(highest + 1)
            samples = max(factor * old.samples, sample_count(harmonics_of(numbers)))
            b = balance_like(plan, model, curve.force, old, numbers, samples)
            for side, number, top in _first_blades(curve):
                if top.slips and curve.stayed(side, number) is None:
                    x = b.embedded(top.x, old)
                    again = found_again(plan, model, curve, side, number, top, b, x)
                    found[curve.ratio, side, number] = again
                    found |= _other_blade(curve, side, number, again)
    return PeakLevel(source, label, size, found, (math.nan, math.nan), time.perf_counter() - begin)


def at_place(
    levels: Sequence[PeakLevel], source: str, place: Place
) -> list[tuple[PeakLevel, Found]]:
    """What the levels of a source have at a place."""
    return [
        (one, one.peaks[place]) for one in levels if one.source == source and place in one.peaks
    ]
