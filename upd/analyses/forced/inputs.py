"""What the peaks of a response depend on most: inputs that are assumed, changed one at a time.

Each input is a row of a table: what it is, and the models that stand for its ends. The
peaks of the curve with the lowest F_C/F_E are found again with each, on the run's own mesh.

Effects that a run leaves out are solved again with them: sliding along the damper, and the damper's
own elasticity.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.linalg import block_diag, eigh
from scipy.spatial import cKDTree

from upd.analyses.base import Resolved
from upd.analyses.forced.blade_parts import MIRROR_SIGNS
from upd.analyses.forced.levels import Laws, make_variant
from upd.analyses.forced.linear_limits import stuck_frequency
from upd.analyses.forced.measures import StuckMode, tell_modes
from upd.analyses.forced.model import Array, Model, balance_of, preloaded
from upd.analyses.forced.peaks_again import (
    NOT_FOUND,
    FoundPeaks,
    PeaksAgain,
    Variant,
    found_again,
    places_up,
    straight,
)
from upd.analyses.forced.plan import ALONG, ELASTIC, ForcedPlan
from upd.analyses.forced.statics import StaticState, state_of_ratio
from upd.analyses.seated.bodies import Bodies
from upd.analyses.seated.interface import damper_compliance
from upd.errors import InputError, one_line
from upd.hbm.springs.points import stuck_stiffness
from upd.linalg.parallel import threads_for
from upd.mesh import IntArray
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene.forced_contact import SIDES, Side
from upd.vary.variation import Variation

log = logging.getLogger(__name__)
#: factors on stiffnesses, the height of the patch, friction, damping
_STIFFNESS, _PATCH, _FRICTION, _DAMPING = (0.5, 2.0), 0.5, (0.8, 1.2), (0.8, 1.25)
#: mobilised part of the friction of both faces before vibration
_MOBILISED = (-0.5, 0.5)
#: harmonics that changes are found with: more move the peaks alike with and without a change
FEW_HARMONICS = 3


#: value of an input in words, and the model with it
Changed = tuple[str, Model]


def _stiffness(side: Side | None, of: str, peaks: FoundPeaks) -> Iterator[Changed]:
    model = peaks.model
    law = model.contacts.law
    on = np.ones(len(model.face), bool) if side is None else model.face == SIDES.index(side)
    for factor in _STIFFNESS:
        changed = replace(law, **{of: np.where(on, factor, 1.0) * getattr(law, of)})
        made = replace(model, contacts=replace(model.contacts, law=changed))
        yield f"x {factor:g}", made


def _patch(peaks: FoundPeaks) -> Iterator[Changed]:
    """The same stiffness and forces on the middle of each face."""
    made = nearer(peaks.model, _PATCH)
    if made is None or made.state is None:
        return
    try:
        made = preloaded(made, made.state)
    except InputError as error:
        log.info("patch: %s", one_line(error))
        return
    yield f"{_PATCH:g} of its height", made


def _friction(peaks: FoundPeaks) -> Iterator[Changed]:
    law = peaks.model.contacts.law
    for factor in _FRICTION if np.any(law.mu) else ():
        mu = factor * law.mu
        made = replace(peaks.model.contacts, law=replace(law, mu=mu))
        yield f"mu {float(mu.max()):g}", replace(peaks.model, contacts=made)


def _static(peaks: FoundPeaks) -> Iterator[Changed]:
    model, scene = peaks.model, peaks.plan.scene
    mu, F = scene.contact.friction, scene.damper.centrifugal
    if model.state is None or not mu:
        return
    frames = np.stack([model.faces[side].frame for side in SIDES])
    for part in _MOBILISED:
        ratio = part * mu
        try:
            state: StaticState = state_of_ratio(frames, F, mu, ratio)
            made = preloaded(model, state)
        except InputError as error:
            log.info("static state T/N %g: %s", ratio, one_line(error))
            continue
        yield f"T/N {ratio:g} on both faces", made


def _fit(peaks: FoundPeaks) -> Iterator[Changed]:
    """Faces that fit without load: F_C spreads the blades."""
    model = peaks.model
    if model.state is None:
        return
    law = replace(model.contacts.law, preload=np.zeros(model.contacts.n_point))
    made = replace(
        model,
        contacts=replace(model.contacts, law=law),
        static=np.zeros_like(model.static),
        traction=np.zeros_like(model.traction),
        state=None,
    )
    yield "new, not worn in", made


def _damping(peaks: FoundPeaks) -> Iterator[Changed]:
    for factor in _DAMPING:
        model = peaks.model
        made = replace(model, C=factor * model.C, damping=factor * model.damping)
        yield f"x {factor:g}", made


#: input that is assumed -> its ends; those that take the longest first
INPUTS: Mapping[str, Callable[[FoundPeaks], Iterator[Changed]]] = {
    "fit of the faces": _fit,
    "height of the contact patch": _patch,
    "K_T of the left face": partial(_stiffness, "left", "k_t"),
    "K_T of the right face": partial(_stiffness, "right", "k_t"),
    "K_N of both faces": partial(_stiffness, None, "k_n"),
    "friction": _friction,
    "static friction before vibration": _static,
    "modal damping": _damping,
}


def input_variants(few: FoundPeaks) -> list[Variant]:
    """Both ends of every input that applies."""
    return [
        Variant(Variation(name, label), model, any_height=True)
        for name, ends in INPUTS.items()
        for label, model in ends(few)
    ]


def effects_of(few: FoundPeaks, found: PeaksAgain) -> list[Result]:
    """Relative changes of the right blade's peaks by one end of an input; none of a peak that was
    not found.

    Parameters
    ----------
    few
        Of `few_harmonics`.
    found
        The peaks with that end.
    """
    out = []
    for one in few.peaks:
        again = found.peaks.get((one.ratio, one.blade, one.number), NOT_FOUND)
        choice = f"{found.of.source}: {found.of.label}"
        case = replace(one.case, mode=one.mode, choice=choice)
        for quantity, new, old in (
            (q.FREQUENCY_CHANGE, again.frequency, one.top.frequency),
            (q.ACCELERANCE_CHANGE, again.height, one.top.height),
        ):
            if math.isfinite(new):
                out.append(quantity.of(new / old - 1.0, case, n=one.number))
    return out


def few_harmonics(peaks: FoundPeaks) -> FoundPeaks | None:
    """The right blade's peaks of the curve with the lowest F_C/F_E, with few harmonics; None
    without peaks.
    """
    lowest = min((one.ratio for one in peaks.peaks), default=math.nan)
    model, out = peaks.model, []
    for one in peaks.peaks:
        if one.ratio != lowest or one.blade != "right":
            continue
        old, top = one.balance, one.top
        most = min(max(FEW_HARMONICS, *model.excitation.harmonics), old.harmonics.highest)
        with threads_for(len(model.M)):
            b = balance_of(peaks.plan, model, one.force, range(most + 1))
            x = b.embedded(top.x, old)
            found = found_again(peaks, model, one, b, x, any_height=True)
        if math.isfinite(found.height):
            top = top._replace(frequency=found.frequency, height=found.height, x=x)
            out.append(one._replace(balance=b, top=top, check=None, other=None))
    return peaks._replace(peaks=tuple(out)) if out else None


def nearer(model: Model, factor: float) -> Model | None:
    """The model with its points nearer to the middle of each face, up the slope.

    The motion of a point between others is theirs by straight lines: that of a face under a rigid
    damper is nearly one. Stiffness and static forces stay with the points.

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
        up = places_up(model)[on]
        rows = np.unique(np.round(up, 6))
        if len(rows) < 2:
            return None
        weight = straight(rows, factor * rows)
        row = np.abs(up[:, None] - rows).argmin(axis=1)
        column = face.position @ face.frame[1]
        mine = np.zeros((len(on), len(on)))
        for i in range(len(on)):
            # the points of every row nearest along the damper
            for j in range(len(rows)):
                there = np.flatnonzero(row == j)
                near = there[np.abs(column[there] - column[i]).argmin()]
                mine[i, near] += weight[row[i], j]
        at[np.ix_(on, on)] = mine
        faces[side] = replace(face, position=mine @ face.position, values=mine @ face.values)

    def rows_of(of: Array) -> Array:
        return np.ascontiguousarray(np.einsum("gp,pdn->gdn", at, of))

    contacts = replace(model.contacts, rows=rows_of(model.contacts.rows))
    return replace(model, contacts=contacts, damper_rows=rows_of(model.damper_rows), faces=faces)


# -- an effect left out ----------------------------------------------------------------------------


def along_variant(peaks: FoundPeaks, bodies: Bodies, laws: Laws) -> Variant | None:
    """The model in which friction resists sliding along the damper too; None where the run has it
    or nothing rubs.
    """
    if peaks.model.contacts.tangents == 2 or not peaks.plan.scene.contact.friction:
        return None
    of = Variation(ALONG, "both sliding directions", (("contact.directions", "two"),))
    return make_variant(peaks.plan, peaks.model, bodies, laws, of)._replace(any_height=True)


def highest_slipping(few: FoundPeaks) -> FoundPeaks | None:
    """The highest peak on which a point slips alone; None without one."""
    slipping = [one for one in few.peaks if one.top.slips]
    if not slipping:
        return None
    return few._replace(peaks=(max(slipping, key=lambda one: one.top.height),))


def along_changes(few: FoundPeaks, found: PeaksAgain) -> list[Resolved]:
    """Change of a peak by friction along the damper, with few harmonics.

    Parameters
    ----------
    few
        Of `highest_slipping`.
    found
        The peak with `along_variant`.
    """
    (one,) = few.peaks
    top, again = one.top, found.peaks.get((one.ratio, one.blade, one.number), NOT_FOUND)
    case, remedy = replace(one.case, mode=one.mode), 'set contact.directions = "two"'
    return [
        Resolved(ALONG, f"peak_{one.number}_{kind}", case, before, after, unit, remedy)
        for kind, unit, before, after in (
            ("accelerance", "(m/s2)/N", top.height, again.height),
            ("frequency", "Hz", top.frequency, again.frequency),
        )
    ]


# -- the elastic damper ----------------------------------------------------------------------------


def elastic_changes(peaks: FoundPeaks, bodies: Bodies, name: str) -> list[Resolved]:
    """Stuck frequencies with the damper's elasticity in series with the contact springs.

    Parameters
    ----------
    name
        Of the contact stiffness.
    """
    out, rigid = [], peaks.linear.modes
    elastic = elastic_stuck(peaks.plan, bodies, peaks.model)
    for in_phase, quantity in ((True, "stuck_in_phase"), (False, "stuck_out_of_phase")):
        before, after = (stuck_frequency(modes, in_phase) for modes in (rigid, elastic))
        if math.isfinite(before):
            remedy = (
                "the rigid damper is too stiff for these springs, unless they hold its elasticity "
                "already: compare with a contact analysis of the damper"
            )
            case = Case(stiffness=name)
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
    M, _, K, B = model.linear(stuck=False)
    k = stuck_stiffness(model.contacts).ravel()
    G = elastic_compliance(plan, bodies, model)
    # (k^-1 + G)^-1, also where k = 0
    joint = np.linalg.solve(np.eye(len(k)) + k[:, None] * G, np.diag(k))
    values, shapes = eigh(K + B.T @ joint @ B, M)
    return tell_modes(model, values, shapes, 2.0 * plan.scene.excitation.stop)


def elastic_compliance(plan: ForcedPlan, bodies: Bodies, model: Model) -> Array:
    """Elastic compliance of the free damper at its contact rows, mm/N.

    Returns
    -------
    Array
        (n, n), n = n_point (1 + tangents), point by point; symmetric, positive semidefinite.
    """
    nodes, shares = zip(*(_on_nodes(bodies, model, side) for side in SIDES), strict=True)
    G = damper_compliance(plan, bodies, nodes)[0]
    at, n = np.stack([block_diag(*one) for one in zip(*shares, strict=True)]), len(G) // 3
    G = np.einsum("fmn,fngk,gpk->mfpg", at, G.reshape(3, n, 3, n), at, optimize=True)
    components = [0, 1, 2] if model.contacts.tangents == 2 else [0, 2]
    rows = len(at[0]) * len(components)
    # a half has half of the forces
    part = 0.5 if bodies.half else 1.0
    return np.asarray(part * G[:, components][..., components].reshape(rows, rows))


def _on_nodes(bodies: Bodies, model: Model, side: Side) -> tuple[IntArray, Array]:
    """Nodes (n,) of a face that its points move with, and their shares (3, m, n) in the motion of
    the points along its frame; a point that stands for a pair moves as the even part of both.
    """
    face, mesh = model.faces[side], bodies.blades[side].mesh
    if bodies.half or not model.halved:
        return face.nodes, np.stack([face.values] * 3)
    patch, mirrored = mesh.nodes["patch"], mesh.points[face.nodes] * np.array([1.0, -1.0, 1.0])
    image = patch[cKDTree(mesh.points[patch]).query(mirrored)[1]]
    nodes, place = np.unique(np.concatenate([face.nodes, image]), return_inverse=True)
    own, other = np.split(place, 2)
    shares = np.zeros((3, face.n_point, len(nodes)))
    shares[:, :, own] += 0.5 * face.values
    shares[:, :, other] += 0.5 * MIRROR_SIGNS[:, None, None] * face.values
    return nodes, shares
