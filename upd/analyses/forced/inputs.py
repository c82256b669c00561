"""What the peaks of a response depend on most: inputs that are assumed, changed one at a time.

Each input is a row of a table: what it is, and the models or choices that stand for its ends. The
peaks of the curve with the lowest F_C/F_E are found again with each, on the run's own mesh.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from upd.analyses.forced.curves import ForcedCurve, Top
from upd.analyses.forced.measures import CurvePeak, stuck_modes
from upd.analyses.forced.mode_peaks import CANDIDATES
from upd.analyses.forced.model import Model, preloaded
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.peaks_again import FoundPeaks, RunPeak, found_again, moved
from upd.analyses.forced.statics import StaticState, state_of_ratio
from upd.errors import InputError, UpdError, one_line
from upd.linalg.parallel import threads_for
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, Side

log = logging.getLogger(__name__)
#: factors on stiffnesses, the height of the patch, friction, damping
_STIFFNESS, _PATCH, _FRICTION, _DAMPING = (0.5, 2.0), 0.5, (0.8, 1.2), (0.8, 1.25)
#: mobilised part of the friction of both faces before vibration
_MOBILISED = (-0.5, 0.5)
#: harmonics that changes are found with: more move the peaks alike with and without a change
FEW_HARMONICS = 3


class Changed(NamedTuple):
    """One end of an input.

    Attributes
    ----------
    label
        The value in words.
    model
        With it.
    changes
        Of the balance, as `respond` takes them.
    """

    label: str
    model: Model
    changes: Mapping[str, Any]


@dataclass(frozen=True)
class InputEffect:
    """What one end of an input does to a peak: relative changes, nan where it was not found.

    Attributes
    ----------
    name, label
        Of the input; its value.
    number, mode
        Of the right blade's peak.
    frequency, height
        Relative changes.
    """

    name: str
    label: str
    number: int
    mode: str
    frequency: float
    height: float


def _stiffness(side: Side | None, of: str, plan: FoundPeaks) -> Iterator[Changed]:
    model = plan.model
    law = model.contacts.law
    on = np.ones(len(model.face), bool) if side is None else model.face == SIDES.index(side)
    for factor in _STIFFNESS:
        changed = replace(law, **{of: np.where(on, factor, 1.0) * getattr(law, of)})
        made = replace(model, contacts=replace(model.contacts, law=changed))
        yield Changed(f"x {factor:g}", made, {})


def _patch(peaks: FoundPeaks) -> Iterator[Changed]:
    """The same stiffness and forces on the middle of each face."""
    made = moved(peaks.model, _PATCH)
    if made is None or made.state is None:
        return
    try:
        made = preloaded(made, made.state)
    except InputError as error:
        log.info("patch: %s", one_line(error))
        return
    yield Changed(f"{_PATCH:g} of its height", made, {})


def _friction(peaks: FoundPeaks) -> Iterator[Changed]:
    law = peaks.model.contacts.law
    for factor in _FRICTION:
        mu = factor * law.mu
        made = replace(peaks.model.contacts, law=replace(law, mu=mu))
        yield Changed(f"mu {float(mu.max()):g}", replace(peaks.model, contacts=made), {})


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
        yield Changed(f"T/N {ratio:g} on both faces", made, {})


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
    yield Changed("new, not worn in", made, {})


def _start(peaks: FoundPeaks) -> Iterator[Changed]:
    for start in ("lower", "upper"):
        yield Changed(start, peaks.model, {"start": start})


def _damping(peaks: FoundPeaks) -> Iterator[Changed]:
    for factor in _DAMPING:
        model = peaks.model
        made = replace(model, C=factor * model.C, damping=factor * model.damping)
        yield Changed(f"x {factor:g}", made, {})


class Input(NamedTuple):
    """An input that is assumed: its words, when it applies, and its ends."""

    name: str
    applies: Callable[[ForcedScene], bool]
    ends: Callable[[FoundPeaks], Iterator[Changed]]


def _always(scene: ForcedScene) -> bool:
    return True


def _rubs(scene: ForcedScene) -> bool:
    return scene.contact.friction > 0.0


INPUTS = (
    Input("K_T of the left face", _always, lambda p: _stiffness("left", "k_t", p)),
    Input("K_T of the right face", _always, lambda p: _stiffness("right", "k_t", p)),
    Input("K_N of both faces", _always, lambda p: _stiffness(None, "k_n", p)),
    Input("height of the contact patch", _always, _patch),
    Input("friction", _rubs, _friction),
    Input("static friction before vibration", _rubs, _static),
    Input("fit of the faces", _always, _fit),
    Input("start of the sliders", _rubs, _start),
    Input("modal damping", _always, _damping),
)


def input_effects(peaks: FoundPeaks, tops: Mapping[CurvePeak, Top], name: str) -> list[InputEffect]:
    """What one input does to the peaks of the curve with the lowest F_C/F_E.

    Parameters
    ----------
    peaks
        With that curve.
    tops
        Its peaks with few harmonics, which the changes are compared with.
    name
        Of the input.
    """
    one = next(x for x in INPUTS if x.name == name)
    if not one.applies(peaks.plan.scene) or not tops:
        return []
    curve, out = min(peaks.curves, key=lambda c: c.ratio), []
    with threads_for(len(peaks.model.M)):
        for end in one.ends(peaks):
            out += list(_effects(peaks, curve, name, end, tops))
    return out


def few(peaks: FoundPeaks, highest: int) -> range:
    """Few harmonics, those excited among them.

    Parameters
    ----------
    highest
        Of the run.
    """
    return range(min(max(FEW_HARMONICS, *peaks.model.excitation.harmonics), highest) + 1)


def few_harmonics(peaks: FoundPeaks) -> dict[CurvePeak, Top]:
    """The right blade's peaks of the curve with the lowest F_C/F_E, with few harmonics."""
    if not peaks.curves:
        return {}
    with threads_for(len(peaks.model.M)):
        return dict(_few_harmonics(peaks, min(peaks.curves, key=lambda c: c.ratio)))


def _few_harmonics(peaks: FoundPeaks, curve: ForcedCurve) -> Iterator[tuple[CurvePeak, Top]]:
    old, model = curve.answer.balance, peaks.model
    numbers = few(peaks, old.harmonics.highest)
    b = balance_of(peaks.plan, model, curve.force, numbers)
    for peak in curve.peaks["right"]:
        top = curve.tops.get(("right", peak.number))
        if top is None:
            continue
        x = b.embedded(top.x, old)
        one = RunPeak(curve, "right", peak.number, top)
        found = found_again(peaks.plan, model, one, b, x, any_height=True)
        if math.isfinite(found.height):
            yield peak, top._replace(frequency=found.frequency, height=found.height, x=x)


def _expected(peaks: FoundPeaks, model: Model, number: int, frequency: float) -> float:
    """Ratio of a peak's frequency with an input to that of the run: the blades are the same, so
    that the stuck mode tells it, by where the peak lies between it and the free one.
    """
    below = CANDIDATES * peaks.plan.scene.excitation.stop
    own, new = (
        [m.frequency for m in found if m.axis == "x" and m.in_phase == (number % 2 == 1)]
        for found in (peaks.linear.modes, stuck_modes(model, below))
    )
    free = [p.frequency for side in SIDES for p in peaks.linear.free_peaks[side]]
    if not (own and new and free) or own[0] == free[0]:
        return 1.0
    share = min(max((frequency - free[0]) / (own[0] - free[0]), 0.0), 1.0)
    return 1.0 + share * (new[0] / own[0] - 1.0)


def _effects(
    peaks: FoundPeaks,
    curve: ForcedCurve,
    name: str,
    end: Changed,
    tops: Mapping[CurvePeak, Top],
) -> Iterator[InputEffect]:
    numbers = few(peaks, curve.answer.balance.harmonics.highest)
    b = balance_of(peaks.plan, end.model, curve.force, numbers)
    if "start" in end.changes:
        b = b.with_sliders(end.changes["start"], b.slider)
    for peak, top in tops.items():
        ratio = _expected(peaks, end.model, peak.number, top.frequency)
        one = RunPeak(curve, "right", peak.number, top)
        try:
            f, height = found_again(
                peaks.plan, end.model, one, b, top.x, ratio, any_height=True, **end.changes
            )
        except UpdError as error:
            log.info("%s, %s: %s", name, end.label, one_line(error))
            f, height = math.nan, math.nan
        yield InputEffect(
            name,
            end.label,
            peak.number,
            peak.mode,
            f / top.frequency - 1.0,
            height / top.height - 1.0,
        )
