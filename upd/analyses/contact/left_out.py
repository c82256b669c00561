"""Effects left out of a contact, each verified on a number of the run: solved again with it.

The tilt of the damper is solved with the run's own compliance. The others are solved on the plan's
companion, a coarser whole model with all three directions, once without the effect and once with
it:

- normal and tangential contact at once, a run of its own with contact.coupling = "coupled",
- the shear that pressure alone puts between unlike materials, as a slip already there,
- the gap taken at the places that the displacement carries the faces to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact import plan as planned
from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.loading import LOAD_STEP, slope_loads
from upd.analyses.contact.plan import ACROSS, ALONG, NORMAL, ContactPlan
from upd.analyses.contact.results import make_results
from upd.analyses.contact.solution import ContactSolution, NormalCase, PressedContact
from upd.analyses.contact.solve import Frozen, press, solve_plan
from upd.contact.checks import few_threads
from upd.contact.model import ContactModel
from upd.contact.tangential import TangentialHistory
from upd.errors import InputError, UpdError
from upd.progress import Stages
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene import Scene
from upd.scene.contact import Coupling
from upd.vary.wanted import Wanted, solve_wanted

Array = NDArray[np.float64]
#: Numbers that show what coupling changes, of them those that a run has; and where no stiffness is
#: asked for.
_COUPLED = (
    "K_N_tangent_raw",
    "K_T_initial_raw",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
    "contact_area",
    "stick_area",
)
_WITHOUT_STIFFNESS = ("approach", "K_T_secant_raw")
#: of a damper that tips over when its tilt is free
_TIPS = (
    "the load line runs beside the contact, so that a damper free to tilt tips over: give a "
    "contact.load_point inside the contact, or choose another contact.distant set"
)


def solve(wanted: Wanted, plan: ContactPlan, stages: Stages) -> ContactSolution:
    """Run everything the plan calls for, and numbers again with the effects it leaves out.

    Errors as for `solve_wanted`; what converged so far is their ``partial``.
    """
    found, estimates = solve_wanted(wanted, plan, stages)
    solution: ContactSolution = replace(found, estimates=estimates)
    shown, companion = solution.plan.shown, solution.plan.companion
    cases = [one for one in solution.normal if one.force]
    if not shown:
        return solution
    try:
        with stages("effects left out", "the tilt; the others on a coarser whole model"):
            if planned.TILT in shown:
                solution.left_out += [_tilted(solution, case) for case in cases]
            if companion is not None:
                try:
                    model = prepare(companion, Stages(), "companion")
                    with few_threads(model.gap):
                        solution.left_out += list(_on_companion(solution, model))
                except UpdError:
                    solution.left_out += _not_solved(solution.plan, [one.case for one in cases])
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def _tilted(solution: ContactSolution, case: NormalCase) -> Resolved:
    """The run's own contact with a free tilt: rotations of the upper body as a whole beside its
    condensed compliance.

    A half model is its own mirror image, which leaves the tilt along the plane. A body that tips
    over has neither stiffness nor approach: 0 N/mm, or NaN.
    """
    plan, remedy = solution.plan, ""
    quantity, unit = _quantity(plan.scene)
    stiff = unit == "N/mm"

    def number(one: PressedContact) -> float:
        return one.stiffness if stiff else 1e3 * one.solution.approach

    def tilting(coupling: Coupling, loads: Sequence[float]) -> float:
        contact = replace(plan.scene.contact, tilt="free", coupling=coupling)
        free = replace(plan, scene=replace(plan.scene, contact=contact))
        return number(press(ContactSolution(free, solution.model), loads)[case.force])

    try:
        included = tilting("uncoupled", [case.force])
        if case.state is not None:
            # It does not tip over; with friction again.
            included = tilting("coupled", slope_loads([case.force]))
    except InputError:
        included, remedy = 0.0 if stiff else float("nan"), _TIPS
    except UpdError:
        included = float("nan")
    return Resolved(planned.TILT, quantity, case.case, number(case), included, unit, remedy)


def _on_companion(solution: ContactSolution, model: ContactModel) -> Iterator[Resolved]:
    """Every number that shows what an effect left out changes, on the companion ``model``."""
    plan = solution.plan
    for case in solution.normal if planned.LARGE in plan.shown else ():
        if case.force:
            yield _displaced(plan, model, case.case, case.force)
    # Coupled contact has the other effects.
    if not plan.scene.coupled:
        yield from _sheared(solution, model)


def _displaced(plan: ContactPlan, model: ContactModel, case: Case, load: float) -> Resolved:
    """What displaced faces change of the tangent stiffness, or of the approach where no stiffness
    is asked for; NaN when it is not found.

    Parameters
    ----------
    model
        The companion's.
    load
        N on the whole contact.
    """
    quantity, unit = _quantity(plan.scene)
    assert plan.companion is not None
    companion = ContactSolution(plan.companion, model)

    @cache
    def pressed(load: float, displaced: bool) -> PressedContact:
        one = companion
        if displaced:
            gap = displaced_gap(model, pressed(load, False).solution.force)
            one = replace(companion, model=replace(model, gap=gap))
        return press(one, [load])[load]

    def number(displaced: bool) -> float:
        loads = [load] if unit == "um" else [load * (1.0 - LOAD_STEP), load * (1.0 + LOAD_STEP)]
        try:
            approaches = [pressed(one, displaced).solution.approach for one in loads]
            if unit == "um":
                return 1e3 * approaches[0]
            return 2.0 * LOAD_STEP * load / (approaches[1] - approaches[0])
        except (UpdError, np.linalg.LinAlgError):
            return float("nan")

    return Resolved(planned.LARGE, quantity, case, number(False), number(True), unit)


def _sheared(solution: ContactSolution, model: ContactModel) -> Iterator[Resolved]:
    plan, scene = solution.plan, solution.plan.scene
    companion = partial(solve_plan, stages=Stages(), model=model, companion=True)
    mine = companion(variant(plan, scene.contact.directions))
    numbers = make_results(mine)
    for case in () if solution.curved else mine.normal:
        for direction in scene.loads.directions:
            way = Frozen(mine, case, direction)
            solution.moved[mine.sheared_case(case, direction)] = way.moved_pressure()
    if planned.COUPLING in plan.shown:
        coupled = variant(plan, 2, coupling="coupled")
        yield from _coupled_changes(scene, numbers, lambda: make_results(companion(coupled)))
    directions = scene.loads.directions
    if planned.DIRECTIONS in plan.shown:
        both = make_results(companion(variant(plan, 2)))
        names = ["K_T_initial_raw", "K_T_secant_raw", "cycle_energy"]
        names += [f"K_T{planned.direction_name(d)}_initial_raw" for d in directions]
        found = list(_changes(planned.DIRECTIONS, names, numbers, both))
        yield from found or _changes(planned.DIRECTIONS, ("K_T_tangent_raw",), numbers, both)
    if planned.MATERIALS in plan.shown:
        for case in (one for one in mine.normal if one.force):
            for direction in directions:
                own = mine.sheared_case(case, direction)
                at = [r for r in numbers if replace(r.case, ratio=None) == own]
                yield from _unlike(mine, case, direction, at)


def _unlike(
    mine: ContactSolution, case: NormalCase, direction: float, numbers: Sequence[Result]
) -> Iterator[Resolved]:
    """The tangential loads along a direction with the slip of the pressure alone already there."""
    way = Frozen(mine, case, direction)
    before = pressure_slip(mine.model, way.components, case.solution.force, way.loaded)
    for one in numbers:
        if one.name == q.K_T_SECANT_RAW.name:
            assert one.case.ratio is not None
            try:
                load, moved, _ = way.march(np.array([0.0, one.case.ratio]), before)
                included = float(load[2] / (moved[2] - moved[1]))
            except UpdError:
                included = float("nan")
        elif one.name == q.CYCLE_ENERGY.name:
            included = q.CYCLE_ENERGY.scale * way.cycle(one.case, before).slip_work
        else:
            continue
        yield Resolved(planned.MATERIALS, one.name, one.case, one.value, included, one.unit)


def _changes(
    effect: str, names: Iterable[str], without: Iterable[Result], included: Iterable[Result]
) -> Iterator[Resolved]:
    """The numbers of ``names`` that both lists of results have."""
    theirs = {(r.name, r.case): r.value for r in included}
    wanted = set(names)
    for r in without:
        if r.name in wanted and (r.name, r.case) in theirs:
            yield Resolved(effect, r.name, r.case, r.value, theirs[r.name, r.case], r.unit)


def _coupled_changes(
    scene: Scene, uncoupled: Iterable[Result], solve: Callable[[], Iterable[Result]]
) -> Iterator[Resolved]:
    """What normal and tangential contact at once change of the stiffnesses and of the areas in
    contact and in stick; of the approach and the secant where no stiffness is asked for.

    Parameters
    ----------
    uncoupled
        Numbers of the companion.
    solve
        Its numbers, coupled.
    """
    names = _COUPLED if scene.wants("stiffness") else (*_COUPLED, *_WITHOUT_STIFFNESS)
    # Nothing is coupled without a load.
    mine = [r for r in uncoupled if r.name in names and r.case.load]
    try:
        again = list(solve())
    except (UpdError, np.linalg.LinAlgError):
        again = [replace(r, value=float("nan")) for r in mine]
    areas = {r.case.load: r.value for r in mine if r.name == q.CONTACT_AREA.name}
    for one in _changes(planned.COUPLING, names, mine, again):
        area = areas.get(one.case.load, 0.0)
        known = one.quantity == q.STICK_AREA.name and area > 0.0
        yield replace(one, over=(area, q.STICK_AREA.part_of)) if known else one


def _quantity(scene: Scene) -> tuple[str, str]:
    """Name and unit of the normal number that a run has."""
    return ("K_N_tangent_raw", "N/mm") if scene.wants("stiffness") else ("approach", "um")


def pressure_slip(
    model: ContactModel,
    components: tuple[int, ...],
    force: Array,
    loaded: NDArray[np.int64],
) -> TangentialHistory:
    """The slip that the normal forces (n,) in N put between the loaded nodes, as the history of
    the tangential loads that follow.

    w = d - C_tt t - C_tn f: without tangential load the contact starts with the mismatch C_tn f.
    """
    slip = np.concatenate([(model.compliance(c, NORMAL) @ force)[loaded] for c in components])
    return TangentialHistory(slip, np.zeros(len(slip)), np.zeros(len(loaded), dtype=np.int8))


def displaced_gap(model: ContactModel, force: Array) -> Array:
    """(n,) gap in mm before the load, with the faces where the displacement carries their nodes.

    Node pairs that the normal forces (n,) in N move apart by s along the faces are no longer on
    one normal: across the slope of the deformed faces the gap is smaller by grad(zeta) . s, the
    mean of both faces.
    """
    slope = np.zeros((len(force), 2))
    places = model.multipliers.nodes
    pushed = {
        b.name: b.side * (model.body_compliance(b, NORMAL) @ force)
        for b in (model.upper, model.lower)
    }
    height = 0.5 * sum(
        (b.mesh.points[b.contact[places], 2] + pushed[b.name] for b in (model.upper, model.lower)),
        np.zeros(len(force)),
    )
    for patch in model.patches.values():
        for k, rise in enumerate(patch.slopes(height)):
            slope[patch.order, k] = rise.ravel()[: len(patch.order)]
    moved = np.column_stack([model.compliance(c, NORMAL) @ force for c in (ALONG, ACROSS)])
    return np.asarray(model.gap - (slope * moved).sum(axis=1))


def variant(
    plan: ContactPlan, directions: Literal[1, 2], *, coupling: Coupling = "uncoupled"
) -> ContactPlan:
    """The companion's plan for slip in one direction or two: the loads that press, sheared as far
    as the scene asks for, and only what a change is looked for in.
    """
    scene, companion = plan.scene, plan.companion
    assert companion is not None
    want = [w for w in ("stiffness", "tangential") if scene.wants(w)]
    ratio = planned.largest_ratio(scene)
    if scene.wants("cycle") and not scene.wants("stiffness") and not ratio > 0.0:
        want.append("cycle")
    smaller = replace(
        scene,
        want=tuple(want),
        contact=replace(scene.contact, directions=directions, coupling=coupling),
        loads=replace(scene.loads, tangential=(ratio,)),
    )
    family = planned.Family((NORMAL, *(ALONG, ACROSS)[:directions]))
    return replace(companion, scene=smaller, families=(family,))


def _not_solved(plan: ContactPlan, cases: Iterable[Case]) -> list[Resolved]:
    """What the checks show when the companion has no answer."""
    quantity, unit = _quantity(plan.scene)
    none = float("nan")
    return [
        Resolved(name, quantity, case, none, none, unit)
        for name in plan.shown
        if name != planned.TILT
        for case in cases
    ]
