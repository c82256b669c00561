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

from upd.analyses.forced.model import Model, preloaded
from upd.analyses.forced.other_points import nearer
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.peaks_again import (
    NOT_FOUND,
    FoundPeaks,
    PeaksAgain,
    Variant,
    found_again,
)
from upd.analyses.forced.statics import StaticState, state_of_ratio
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
