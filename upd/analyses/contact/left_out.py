"""Effects left out of a contact, each verified on a number of the run: solved again with it.

All are solved on the plan's companion, a coarser whole model with all three directions condensed
together, once without the effect and once with it switched on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from upd.analyses.base import Resolved
from upd.analyses.contact import plan as planned
from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.plan import ContactPlan
from upd.analyses.contact.results import make_results
from upd.analyses.contact.solution import ContactSolution
from upd.analyses.contact.solve import solve_plan
from upd.contact.checks import few_threads
from upd.contact.model import ContactModel
from upd.errors import InputError, UpdError
from upd.progress import Stages
from upd.results import Result
from upd.results import quantities as q
from upd.scene import Scene
from upd.vary.solve import changed
from upd.vary.variation import Key

_NORMAL = ("K_N_tangent_raw",), ("approach",)
_SHEAR = ("K_T_initial_raw", "K_Tx_initial_raw", "K_Ty_initial_raw")
_AREAS = ("contact_area", "stick_area")
#: effect -> numbers that show what it changes: the first row of which a run has some; coupling also
#: changes areas
_SHOWN: Mapping[str, tuple[tuple[str, ...], ...]] = {
    planned.TILT: _NORMAL,
    planned.COUPLING: (
        (*_NORMAL[0], *_SHEAR),
        ("approach", "K_T_secant_raw", "cycle_energy"),
    ),
    planned.DIRECTIONS: ((*_SHEAR, "K_T_secant_raw", "cycle_energy"), ("K_T_tangent_raw",)),
}
_SWITCHES: Mapping[str, tuple[str, object]] = {
    planned.TILT: ("contact.tilt", "free"),
    planned.COUPLING: ("contact.coupling", "coupled"),
    planned.DIRECTIONS: ("contact.directions", 2),
}
#: of a damper that tips over when its tilt is free
_TIPS = (
    "the load line runs beside the contact, so that a damper free to tilt tips over: give a "
    "contact.load_point inside the contact, or choose another contact.distant set"
)


def solve(solution: ContactSolution, stages: Stages) -> None:
    """Numbers again with the effects that the plan leaves out."""
    companion = solution.plan.companion
    if companion is not None:
        with stages("effects left out", "on a coarser whole model"):
            solution.left_out += _left_out(solution, companion)


def _left_out(solution: ContactSolution, companion: ContactPlan) -> Iterator[Resolved]:
    """Every number that shows what an effect left out changes."""
    without, model = _under_load(make_results(solution)), None
    plan = replace(companion, scene=_smaller(companion.scene))
    with suppress(UpdError):
        model = prepare(companion, Stages(), "companion")
        without = _numbers(plan, model)
    for effect in solution.plan.shown:
        included, remedy = dict[Key, float](), ""
        try:
            if model is not None:
                included = {(r.name, r.case): r.value for r in _with(effect, plan, model)}
        except InputError:
            remedy = _TIPS
        except (UpdError, np.linalg.LinAlgError):
            pass
        yield from _changes(effect, without, included, remedy)


def _changes(
    effect: str, without: Sequence[Result], included: Mapping[Key, float], remedy: str
) -> Iterator[Resolved]:
    """The numbers that an effect changes; NaN where none was found with it.

    A body that tips over has neither stiffness nor approach: 0 N/mm, or NaN.
    """
    areas = {r.case.load: r.value for r in without if r.name == q.CONTACT_AREA.name}
    known = [r for r in without if (r.name, r.case) in included or not included]
    had = {r.name for r in known}
    names = next((row for row in _SHOWN[effect] if had.intersection(row)), ())
    names += _AREAS if effect == planned.COUPLING else ()
    for r in (one for one in known if one.name in names):
        none = 0.0 if remedy and r.unit == "N/mm" else float("nan")
        value, area = included.get((r.name, r.case), none), areas.get(r.case.load, 0.0)
        over = (area, q.STICK_AREA.part_of) if r.name == q.STICK_AREA.name and area else None
        yield Resolved(effect, r.name, r.case, r.value, value, r.unit, remedy, over=over)


def _smaller(scene: Scene) -> Scene:
    """The scene with what changes are looked for in: sheared as far as the run is, and through a
    cycle where nothing else is sheared.
    """
    ratio = planned.largest_ratio(scene)
    want = [w for w in ("stiffness", "tangential") if scene.wants(w)]
    if scene.wants("cycle") and not scene.wants("stiffness") and not ratio > 0.0:
        want.append("cycle")
    return replace(scene, want=tuple(want), loads=replace(scene.loads, tangential=(ratio,)))


def _under_load(found: Sequence[Result]) -> list[Result]:
    """Numbers of the loads that press: an effect changes nothing else."""
    return [one for one in found if one.case.load and not one.withheld]


def _numbers(plan: ContactPlan, model: ContactModel, *switch: tuple[str, object]) -> list[Result]:
    """Of the companion, with an effect switched on."""
    switched = replace(plan, scene=changed(plan.scene, switch))
    with few_threads(model.gap):
        return _under_load(make_results(solve_plan(switched, Stages(), model)))


def _with(effect: str, plan: ContactPlan, model: ContactModel) -> list[Result]:
    """The companion's numbers with an effect; InputError where its upper body tips over."""
    if effect == planned.TILT and plan.scene.coupled:
        # with friction it would not
        _numbers(plan, model, _SWITCHES[effect], ("contact.coupling", "uncoupled"))
    return _numbers(plan, model, _SWITCHES[effect])
