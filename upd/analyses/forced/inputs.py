"""What the peaks of a response depend on most: inputs that are assumed, changed one at a time.

Each input is a row of a table: what it is, and the models that stand for its ends. The
peaks of the curve with the lowest F_C/F_E are found again with each, on the run's own mesh.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from upd.analyses.base import Resolved
from upd.analyses.forced.levels import Laws, make_variant
from upd.analyses.forced.model import Array, Model, preloaded
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.peaks_again import (
    NOT_FOUND,
    FoundPeaks,
    PeaksAgain,
    Variant,
    found_again,
    places_up,
    straight,
)
from upd.analyses.forced.plan import ALONG
from upd.analyses.forced.statics import StaticState, state_of_ratio
from upd.analyses.seated.bodies import Bodies
from upd.errors import InputError, one_line
from upd.linalg.parallel import threads_for
from upd.results import Case
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


@dataclass(frozen=True)
class InputEffect:
    """What one end of an input does to a peak: relative changes, nan where it was not found.

    Attributes
    ----------
    name, label
        Of the input; its value.
    case, number
        Of the right blade's peak.
    frequency, height
        Relative changes.
    """

    name: str
    label: str
    case: Case
    number: int
    frequency: float
    height: float


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


def effects_of(few: FoundPeaks, found: PeaksAgain) -> list[InputEffect]:
    """What one end of an input does to the right blade's peaks.

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
        change = (new / old - 1.0 for new, old in zip(again, one.top[:2], strict=True))
        case = replace(one.case, mode=one.mode)
        out.append(InputEffect(found.of.source, found.of.label, case, one.number, *change))
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
