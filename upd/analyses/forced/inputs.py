"""What the peaks of a response depend on most: inputs that are assumed, changed one at a time.

Each end of an input is a variation of the scene. The peaks of the curve with the lowest F_C/F_E are
found again with each, on the run's own mesh.

Effects that a run leaves out are solved again with them: sliding along the damper, and the damper's
own elasticity.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from upd.analyses.base import Resolved
from upd.analyses.forced.again import Run, Variant, make_variant, peak_again
from upd.analyses.forced.curves import Top, stuck_frequency
from upd.analyses.forced.measures import StuckMode, mode_shapes
from upd.analyses.forced.model import Model, balance_of, preloaded
from upd.analyses.forced.plan import ALONG, ELASTIC, ForcedPlan
from upd.analyses.measured import CurvePeak
from upd.analyses.seated.bodies import Bodies
from upd.analyses.seated.interface import damper_compliance
from upd.errors import InputError, UpdError, one_line
from upd.hbm.springs.points import stuck_stiffness
from upd.linalg.parallel import threads_for
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene.forced_contact import SIDES, Side
from upd.vary.solve import changed
from upd.vary.variation import SolvedVariation, Variation

log = logging.getLogger(__name__)
#: factors on stiffnesses, the height of the patch, friction, damping
_STIFFNESS, _PATCH, _FRICTION, _DAMPING = (0.5, 2.0), 0.5, (0.8, 1.2), (0.8, 1.25)
#: mobilised part of the friction of both faces before vibration
_MOBILISED = (-0.5, 0.5)
#: harmonics that changes are found with: more move the peaks alike with and without a change
FEW_HARMONICS = 3


def input_variants(few: Run, bodies: Bodies) -> list[Variant]:
    """Both ends of every input that applies, those that take the longest first."""
    plan, name, model = few.plan, few.name, few.model
    out = [make_variant(plan, name, model, bodies, of) for of in _inputs(few)]
    patch = nearer(model, _PATCH)
    if patch is not None and patch.state is not None:
        of = Variation("height of the contact patch", f"{_PATCH:g} of its height")
        try:
            out.append(Variant(of, plan, preloaded(patch, patch.state)))
        except InputError as error:
            log.info("patch: %s", one_line(error))
    return out


def _inputs(few: Run) -> Iterator[Variation]:
    """Inputs that are assumed, at their ends."""
    scene, loaded = few.plan.scene, few.model.state is not None
    mu, totals = scene.contact.friction, scene.stiffness[few.name]
    if loaded:
        # F_C then spreads the blades
        fit = (("contact.fit", "unloaded"),)
        yield Variation("fit of the faces", "new, not worn in", fit)
    for name, sides, of in (
        ("K_T of the left face", ("left",), "K_T"),
        ("K_T of the right face", ("right",), "K_T"),
        ("K_N of both faces", SIDES, "K_N"),
    ):
        for factor in _STIFFNESS:
            faces: dict[str, Any] = {}
            for face in sides:
                own = getattr(totals, face)
                faces[face] = replace(own, **{of: factor * getattr(own, of)})
            moved = (f"stiffness.{few.name}", replace(totals, **faces))
            yield Variation(name, f"x {factor:g}", (moved,))
    for factor in _FRICTION if mu else ():
        yield Variation("friction", f"mu {factor * mu:g}", (("contact.friction", factor * mu),))
    for part in _MOBILISED if mu and loaded else ():
        static = (("contact.static", dict.fromkeys(SIDES, part * mu)),)
        label = f"T/N {part * mu:g} on both faces"
        yield Variation("static friction before vibration", label, static)
    for factor in _DAMPING:
        fitted = tuple((blade, f, factor * zeta) for blade, f, zeta in scene.fitted)
        damping = ("excitation.damping", factor * scene.excitation.damping), ("fitted", fitted)
        yield Variation("modal damping", f"x {factor:g}", damping)


def few_harmonics(run: Run) -> Run | None:
    """The right blade's peaks of the curve with the lowest F_C/F_E, with few harmonics; None
    without peaks.
    """
    curve = min(run.curves, key=lambda one: one.case.force_ratio or 0.0, default=None)
    if curve is None:
        return None
    plan, model = run.plan, run.model
    most = min(max(FEW_HARMONICS, *model.excitation.harmonics), plan.scene.balance.harmonics)
    scene = changed(plan.scene, (("balance.harmonics", most),))
    other, peaks = run._replace(plan=replace(plan, scene=scene)), list[CurvePeak]()
    tops: dict[tuple[Side, int], Top] = {}
    with threads_for(len(model.M)):
        b = balance_of(other.plan, model, curve.force, scene.harmonic_numbers)
        for peak in curve.peaks["right"]:
            top = curve.tops.get(("right", peak.number))
            if top is None:
                continue
            with suppress(UpdError):
                f, height = peak_again(run, other, curve, "right", peak.number, far=True)
                x = b.embedded(top.x, curve.answer.balance)
                peaks.append(peak._replace(frequency=f, height=height))
                tops["right", peak.number] = top._replace(frequency=f, height=height, x=x)
    answer = replace(curve.answer, balance=b)
    few = replace(curve, answer=answer, peaks={"right": tuple(peaks)}, tops=tops, checked=())
    return other._replace(curves=(few,)) if peaks else None


def effects_of(few: Run, found: SolvedVariation) -> list[Result]:
    """Relative changes of the right blade's peaks by one end of an input; none of a peak that was
    not found.

    Parameters
    ----------
    few
        Of `few_harmonics`.
    found
        The peaks with that end.
    """
    of, out = found.variation, []
    for one, again in _pairs(few, found):
        case = replace(few.curves[0].case, mode=one.mode, choice=f"{of.source}: {of.label}")
        f, height = again.frequency / one.frequency, again.height / one.height
        out.append(q.FREQUENCY_CHANGE.of(f - 1.0, case, n=one.number))
        out.append(q.ACCELERANCE_CHANGE.of(height - 1.0, case, n=one.number))
    return out


def _pairs(few: Run, found: SolvedVariation) -> Iterator[tuple[CurvePeak, CurvePeak]]:
    """Peaks of the right blade, and what is found of them again."""
    (curve,) = few.curves
    for one in curve.peaks["right"]:
        case = replace(curve.case, mode=one.mode)
        names = (q.PEAK_FREQUENCY.named(one.number), q.PEAK_ACCELERANCE.named(one.number))
        if all((name, case) in found.values for name in names):
            f, height = (found.values[name, case] for name in names)
            yield one, one._replace(frequency=f, height=height)


def nearer(model: Model, factor: float) -> Model | None:
    """The model with its points nearer to the middle of each face, up the slope.

    The motion of a point between others of its column is theirs by straight lines: that of a face
    under a rigid damper is nearly one. Stiffness and static forces stay with the points.

    Parameters
    ----------
    factor
        On the places up the slope from the middle of a face, at most 1.

    Returns
    -------
    Model or None
        None where the points are in one row.
    """
    n = model.contacts.n_point
    at = np.zeros((n, n))
    faces = {}
    for k, side in enumerate(SIDES):
        face, on = model.faces[side], np.flatnonzero(model.face == k)
        local = face.position @ face.frame[2]
        up, columns = local - face.weight @ local, face.line[:, 1]
        mine = np.zeros((len(on), len(on)))
        for column in np.unique(columns):
            line = np.flatnonzero(columns == column)
            line = line[np.argsort(up[line])]
            if len(line) < 2:
                return None
            for point, one in zip(line, np.eye(len(line)), strict=True):
                mine[line, point] = np.interp(factor * up[line], up[line], one)
        at[np.ix_(on, on)] = mine
        faces[side] = replace(face, position=mine @ face.position, values=mine @ face.values)

    rows, on_damper = (
        np.ascontiguousarray(np.einsum("gp,pdn->gdn", at, of))
        for of in (model.contacts.rows, model.damper_rows)
    )
    contacts = replace(model.contacts, rows=rows)
    return replace(model, contacts=contacts, damper_rows=on_damper, faces=faces)


# -- an effect left out ----------------------------------------------------------------------------


def along_the_damper(few: Run, bodies: Bodies) -> tuple[Run, Variant] | None:
    """The highest peak on which a point slips alone, and the model in which friction resists
    sliding along the damper too; None where the run has it or nothing rubs.
    """
    (curve,), model = few.curves, few.model
    slipping = {key: top for key, top in curve.tops.items() if top.slips}
    if model.contacts.tangents == 2 or not few.plan.scene.contact.friction or not slipping:
        return None
    highest = max(slipping, key=lambda key: slipping[key].height)
    alone = few._replace(curves=(replace(curve, tops={highest: slipping[highest]}),))
    of = Variation(ALONG, "both sliding directions", (("contact.directions", "two"),))
    return alone, make_variant(few.plan, few.name, model, bodies, of)


def along_changes(few: Run, found: SolvedVariation) -> list[Resolved]:
    """Change of that peak by friction along the damper."""
    remedy, case = 'set contact.directions = "two"', few.curves[0].case
    return [
        Resolved(
            ALONG, of.named(one.number), replace(case, mode=one.mode), *values, of.unit, remedy
        )
        for one, again in _pairs(few, found)
        for of, values in (
            (q.PEAK_ACCELERANCE, (one.height, again.height)),
            (q.PEAK_FREQUENCY, (one.frequency, again.frequency)),
        )
    ]


# -- the elastic damper ----------------------------------------------------------------------------


def elastic_changes(run: Run, bodies: Bodies) -> list[Resolved]:
    """Stuck frequencies with the damper's elasticity in series with the contact springs."""
    out, rigid = [], run.linear.modes
    elastic = elastic_stuck(run.plan, bodies, run.model)
    for in_phase, quantity in ((True, "stuck_in_phase"), (False, "stuck_out_of_phase")):
        before, after = (stuck_frequency(modes, in_phase) for modes in (rigid, elastic))
        if math.isfinite(before):
            remedy = (
                "the rigid damper is too stiff for these springs, unless they hold its elasticity "
                "already: compare with a contact analysis of the damper"
            )
            case = Case(stiffness=run.name)
            out.append(Resolved(ELASTIC, quantity, case, before, after, "Hz", remedy))
    return out


def elastic_stuck(plan: ForcedPlan, bodies: Bodies, model: Model) -> list[StuckMode]:
    """Stuck modes with the damper's elastic compliance in series with the contact springs.

    The damper floats: its rigid motion keeps its inertia, and its deformation follows
    quasi-statically from self-equilibrated contact forces (inertia relief), G = B P' K^+ P B' with
    P = I - M R (R' M R)^-1 R'. The force of stuck points per rigid relative displacement is then
    (k^-1 + G)^-1 in place of k.

    Returns
    -------
    list of StuckMode
        Up to twice the end of the sweep.

    References
    ----------
    .. [1] R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., 17.5 (inertia
           relief).
    """
    faces = [model.faces[side] for side in SIDES]
    G = damper_compliance(plan, bodies, [face.nodes for face in faces])[0]
    # shares of the nodes in the motion of the points along their frames
    at = np.stack([block_diag(*(face.values for face in faces))] * 3)
    if bodies.half:
        at[1, model.position[:, 1] == 0.0] = 0.0
    n = len(G) // 3
    G = np.einsum("fmn,fngk,gpk->mfpg", at, G.reshape(3, n, 3, n), at, optimize=True)
    components = [0, 1, 2] if model.contacts.tangents == 2 else [0, 2]
    _, _, K, B = model.linear(stuck=False)
    k = stuck_stiffness(model.contacts).ravel()
    # at the contact rows, point by point; a half has half of the forces
    G = (0.5 if bodies.half else 1.0) * G[:, components][..., components].reshape(len(k), len(k))
    # (k^-1 + G)^-1, also where k = 0
    joint = np.linalg.solve(np.eye(len(k)) + k[:, None] * G, np.diag(k))
    return mode_shapes(model, 2.0 * plan.scene.excitation.stop, K + B.T @ joint @ B).modes
