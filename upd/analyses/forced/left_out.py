"""What a forced response leaves out, solved again with it: the change of a peak or of a stuck
frequency.

The peak is the highest of the curve with the lowest F_C/F_E, where most slips. It is followed again
in a narrow band, once as the run has it and once per effect.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from upd.analyses.base import Resolved
from upd.analyses.forced import effects as checks
from upd.analyses.forced.checked_peak import highest_peaks, peak_changes
from upd.analyses.forced.companions import with_values
from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.elastic_damper import elastic_stuck
from upd.analyses.forced.levels import quiet
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Model, make_model, preloaded
from upd.analyses.forced.paths import STARTS, peak_again
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import ForcedSolution, PeakAgain
from upd.analyses.forced.statics import admissible, same
from upd.analyses.forced.stiffness import FaceLaw
from upd.analyses.seated.bodies import Bodies
from upd.errors import InputError
from upd.progress import Stages
from upd.results import Case
from upd.scene.forced_contact import SIDES, Side

log = logging.getLogger(__name__)
Laws = Mapping[Side, FaceLaw]


@dataclass(frozen=True)
class _Peak:
    """The peak that is followed again, its curve and model, and the base of comparison."""

    top: ModePeak
    curve: ForcedCurve
    model: Model
    base: PeakAgain

    @property
    def frequency(self) -> float:
        """Hz."""
        return self.top.frequency


def solve_again(
    solution: ForcedSolution, laws: Mapping[str, Laws], stages: Stages
) -> list[Resolved]:
    """Every effect that the plan leaves out, on the number itself.

    Parameters
    ----------
    solution
        With its curves solved.
    laws
        Stiffness name -> side -> law of the face.

    Returns
    -------
    list of Resolved
        Two per effect (height and frequency of the peak, or both stuck frequencies); empty for the
        effects on a peak when no curve has one.
    """
    out: list[Resolved] = []
    with stages("effects left out", "each solved again"), quiet():
        peak = _highest(solution, list(solution.models))
        for check, make in _CHOICES.items() if peak is not None else ():
            assert peak is not None
            begin = time.perf_counter()
            found = make(solution, peak, laws[peak.curve.stiffness])
            if found is not None:
                log.info("%s: solved again in %.1f s", check, time.perf_counter() - begin)
                out += _of_peak(check, peak, *found)
        for name, law in laws.items():
            out += _two_k_t(solution, name, law)
        out += _elasticity(solution)
    return out


def _highest(solution: ForcedSolution, names: Sequence[str]) -> _Peak | None:
    """The highest peak of the curve with the lowest F_C/F_E that has one."""
    for curve, top in highest_peaks(solution, names):
        model = solution.models[curve.stiffness]
        base = peak_again(solution.plan, model, curve.force, top.frequency, "as run")
        if base.found:
            return _Peak(top, curve, model, base)
    return None


def _of_peak(
    check: str, peak: _Peak, answer: PeakAgain, remedy: str, note: str = ""
) -> list[Resolved]:
    return peak_changes(check, peak.curve, peak.top, peak.base, answer, remedy, note, answer.status)


#: the peak again, the remedy, and what it does not cover
Found = tuple[PeakAgain, str] | tuple[PeakAgain, str, str]


def _again(solution: ForcedSolution, peak: _Peak, choice: str, **changes: Any) -> PeakAgain:
    """The same model with another choice of the balance."""
    return peak_again(
        solution.plan, peak.model, peak.curve.force, peak.frequency, choice, **changes
    )


def _remade(
    plan: ForcedPlan, bodies: Bodies | None, peak: _Peak, law: Laws, choice: str
) -> PeakAgain:
    """Another model, one blade after the other: others work beside, and memory is theirs too."""
    assert bodies is not None
    plan = replace(plan, workers=1)
    model, force = make_model(plan, bodies, law), peak.curve.force
    near = peak_again(plan, model, force, peak.frequency, choice)
    # What moved out of the band is looked for in the whole sweep.
    return near if near.found else peak_again(plan, model, force, None, choice)


def _along(solution: ForcedSolution, peak: _Peak, law: Laws) -> Found | None:
    if peak.model.contacts.tangents == 2 or not solution.plan.scene.contact.friction:
        return None
    plan = with_values(solution.plan, "contact", directions="two")
    return _remade(plan, solution.bodies, peak, law, "two"), 'set contact.directions = "two"'


def _odd(solution: ForcedSolution, peak: _Peak, law: Laws) -> Found | None:
    if not peak.model.halved:
        return None
    plan = replace(with_values(solution.plan, "mesh", symmetry="full"), symmetry="full")
    return _remade(plan, solution.bodies, peak, law, "full"), 'set mesh.symmetry = "full"'


def _spread(solution: ForcedSolution, peak: _Peak, law: Laws) -> Found | None:
    if not solution.plan.scene.contact.loaded:
        return None
    plan = with_values(solution.plan, "contact", fit="unloaded")
    return _remade(plan, solution.bodies, peak, law, "unloaded"), (
        'how well the faces fit decides: set contact.fit = "unloaded" and read both answers'
    )


def _starts(solution: ForcedSolution, peak: _Peak, law: Laws) -> Found | None:
    """The start whose peak is farthest away; starts that find none are named, and tell that the
    band is not known where no other leaves the limits.
    """
    if solution.plan.scene.wants("spread") or solution.plan.scene.wants("band"):
        return None
    slider = solution.plan.scene.balance.slider
    found = [_again(solution, peak, s, start=s) for s in STARTS if s != slider]
    lost = [one.choice for one in found if not one.found]
    far = _farthest(solution, peak, found)
    remedy = (
        f"the peak is a band over the static states of the sliders (farthest: {far.choice}): "
        'ask for want = ["spread"]'
    )
    return far, remedy, f"starts not solved: {', '.join(lost)}" if lost else ""


def _farthest(solution: ForcedSolution, peak: _Peak, found: Sequence[PeakAgain]) -> PeakAgain:
    """The answer farthest from the run's; one that was not found where the others are near."""
    limits, base = solution.plan.scene.left_out, peak.base

    def changes(one: PeakAgain) -> float:
        """Largest change over its limit."""
        return max(
            abs(one.height / base.height - 1.0) / limits.peak,
            abs(one.frequency / base.frequency - 1.0) / limits.frequency,
        )

    far = max(found, key=lambda one: changes(one) if one.found else -np.inf)
    lost = [one for one in found if not one.found]
    return lost[0] if lost and (not far.found or changes(far) <= 1.0) else far


def _statics(solution: ForcedSolution, peak: _Peak, law: Laws) -> Found | None:
    """The static state whose peak is farthest away; states that show none are named."""
    scene, own = solution.plan.scene, peak.model.state
    if own is None or not scene.contact.friction or scene.wants("band"):
        return None
    assert solution.bodies is not None
    found, lost = [], []
    for state in admissible(solution.plan, solution.bodies, Stages()):
        if same(state, own, scene.damper.centrifugal):
            continue
        try:
            model = preloaded(peak.model, state)
        except InputError:
            lost.append(state.name)
            continue
        args = (solution.plan, model, peak.curve.force)
        near = peak_again(*args, peak.frequency, state.name)
        # what moved out of the band is looked for in the whole sweep
        near = near if near.found else peak_again(*args, None, state.name)
        found.append(near)
        lost += [] if near.found else [state.name]
    if not found:
        return None
    far = _farthest(solution, peak, found)
    remedy = (
        f"friction leaves the static state open (farthest: {far.choice}): ask for "
        'want = ["band"], or set contact.static'
    )
    return far, remedy, f"states not solved: {', '.join(lost)}" if lost else ""


def _two_k_t(solution: ForcedSolution, name: str, law: Laws) -> list[Resolved]:
    """The softer of a law's two tangential stiffnesses in place of their mean."""
    peak = _highest(solution, [name]) if any(one.anisotropy for one in law.values()) else None
    if peak is None:
        return []
    model, factor = peak.model, np.ones(peak.model.contacts.n_point)
    for k, side in enumerate(SIDES):
        factor[model.face == k] = 1.0 - 0.5 * (law[side].anisotropy or 0.0)
    k_t = model.contacts.law.k_t * factor
    softer = replace(
        model, contacts=replace(model.contacts, law=replace(model.contacts.law, k_t=k_t))
    )
    answer = peak_again(solution.plan, softer, peak.curve.force, peak.frequency, "the softer k_t")
    remedy = "read the answer for the direction that slides: give its K_T alone"
    return _of_peak(checks.TWO_K_T, peak, answer, remedy)


_CHOICES: Mapping[str, Callable[[ForcedSolution, _Peak, Laws], Found | None]] = {
    checks.ALONG: _along,
    checks.ODD: _odd,
    checks.FIT: _spread,
    checks.START: _starts,
    checks.STATIC: _statics,
}


def _elasticity(solution: ForcedSolution) -> list[Resolved]:
    """Stuck frequencies with the damper's elasticity in series with the contact springs."""
    out = []
    for name, model in solution.models.items():
        if name not in solution.linear or solution.bodies is None:
            continue
        rigid = solution.linear[name].modes
        elastic = elastic_stuck(solution.plan, solution.bodies, model)
        for in_phase, quantity in ((True, "stuck_in_phase"), (False, "stuck_out_of_phase")):
            before, after = (
                next((m.frequency for m in modes if m.axis == "x" and m.in_phase == in_phase), None)
                for modes in (rigid, elastic)
            )
            if before is not None:
                remedy = (
                    "the rigid damper is too stiff for these springs, unless they hold its "
                    "elasticity already: compare with a contact analysis of the damper"
                )
                out.append(
                    Resolved(
                        checks.ELASTIC,
                        quantity,
                        Case(stiffness=name),
                        before,
                        float("nan") if after is None else after,
                        "Hz",
                        remedy,
                    )
                )
    return out
