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
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.effects import (
    COUPLED_NUMBERS,
    COUPLING,
    DIRECTIONS,
    LARGE,
    MATERIALS,
    TILT,
    TIPS,
    largest_ratio,
)
from upd.analyses.contact.loading import (
    LOAD_STEP,
    load_history,
    raised,
    slope,
    slope_loads,
    tilt_arms,
)
from upd.analyses.contact.plan import (
    ACROSS,
    ALONG,
    NORMAL,
    OWN_LEVEL,
    ContactPlan,
    Family,
    direction_name,
)
from upd.analyses.contact.results import make_results
from upd.analyses.contact.solution import ContactSolution, NormalCase
from upd.analyses.contact.solve import solve_plan
from upd.analyses.contact.tangential import Frozen, note_moved
from upd.contact.checks import few_threads
from upd.contact.model import ContactModel
from upd.contact.normal import normal_contact
from upd.contact.tangential import tangential_path
from upd.contact.tangential_step import TangentialHistory
from upd.contact.tilt import tilted_contact
from upd.errors import InputError, UpdError
from upd.progress import Stages
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene import Scene
from upd.scene.contact import Coupling
from upd.vary.wanted import Wanted, solve_wanted

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pressed:
    """A frictionless contact: approach in mm, forces (n,) in N."""

    approach: float
    force: Array


#: gap (n,) mm and load in N -> contact of the companion
Press = Callable[[Array, float], Pressed]


def left_out(plan: ContactPlan, name: str) -> bool:
    """Whether the plan leaves out an effect that applies, and is to show what it changes."""
    solves = plan.scene.left_out.solves
    return solves and any(e.name == name and e.word == "no" for e in plan.effects)


def solve(wanted: Wanted, plan: ContactPlan, stages: Stages) -> ContactSolution:
    """Run everything the plan calls for, and numbers again with the effects it leaves out.

    Errors as for `solve_wanted`; what converged so far is their ``partial``.
    """
    found, estimates = solve_wanted(wanted, plan, stages)
    solution: ContactSolution = replace(found, estimates=estimates)
    plan, companion = solution.plan, solution.plan.companion
    cases = [one for one in solution.normal if one.force]
    tilts = left_out(plan, TILT)
    if companion is None and not tilts:
        return solution
    try:
        with stages("effects left out", "the tilt; the others on a coarser whole model"):
            if tilts:
                solution.left_out += [_tilted(solution, case) for case in cases]
            if companion is not None:
                try:
                    model = prepare(companion, Stages(), "companion")
                    with few_threads(model.gap):
                        solution.left_out += list(_on_companion(solution, model))
                except UpdError:
                    solution.left_out += _not_solved(plan, [one.case for one in cases])
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
    plan, model = solution.plan, solution.model
    stiff = plan.scene.wants("stiffness")
    quantity, unit = _quantity(plan.scene)
    without = case.stiffness if stiff else 1e3 * case.solution.approach
    remedy, arms = "", tilt_arms(plan, model, held=False)
    try:
        found = tilted_contact(
            model.compliance(NORMAL),
            model.gap,
            arms,
            load=case.force / plan.copies,
            start=case.solution.contact,
            free=(0 not in plan.mirrors, 1 not in plan.mirrors),
        )
        included = plan.copies * found.free_stiffness if stiff else 1e3 * found.normal.approach
        if case.state is not None:
            # It does not tip over; with friction again.
            states = raised(model, plan.scene.contact.friction, slope_loads([case.force]), arms)
            approach = 1e3 * float(states[case.force].motion[0])
            included = slope(states, case.force) if stiff else approach
    except InputError:
        included, remedy = 0.0 if stiff else float("nan"), TIPS
    except UpdError:
        included = float("nan")
    return Resolved(TILT, quantity, case.case, without, included, unit, remedy)


def _on_companion(solution: ContactSolution, model: ContactModel) -> Iterator[Resolved]:
    """Every number that shows what an effect left out changes, on the companion ``model``."""
    plan, scene = solution.plan, solution.plan.scene
    arms = tilt_arms(variant(plan, 2), model)

    def press(gap: Array, load: float) -> Pressed:
        if scene.coupled:
            state = raised(model, scene.contact.friction, [load], arms, gap=gap)[load]
            return Pressed(float(state.motion[0]), state.force[:, 0])
        C = model.compliance(NORMAL)
        found = (
            tilted_contact(C, gap, arms, load=load).normal
            if arms.size
            else normal_contact(C, gap, load=load)
        )
        return Pressed(found.approach, found.force)

    for case in solution.normal:
        if case.force:
            yield from _displaced_changes(plan, model, press, case.case, case.force)
    # Coupled contact has the other effects.
    if not scene.coupled:
        yield from _sheared(solution, model)


def _sheared(solution: ContactSolution, model: ContactModel) -> Iterator[Resolved]:
    plan, scene = solution.plan, solution.plan.scene
    companion = partial(solve_plan, stages=Stages(), model=model, companion=True)
    mine = companion(variant(plan, scene.contact.directions))
    numbers = make_results(mine)
    note_moved(solution, mine)

    def again(directions: Literal[1, 2], coupling: Coupling = "uncoupled") -> list[Result]:
        return make_results(companion(variant(plan, directions, coupling=coupling)))

    yield from _coupled_changes(plan, numbers, lambda: again(2, "coupled"))
    directions = scene.loads.directions
    if left_out(plan, DIRECTIONS):
        both = again(2)
        names = ["K_T_initial_raw", "K_T_secant_raw", "cycle_energy"]
        names += [f"K_T{direction_name(d)}_initial_raw" for d in directions]
        found = list(_changes(DIRECTIONS, names, numbers, both))
        yield from found or _changes(DIRECTIONS, ("K_T_tangent_raw",), numbers, both)
    if left_out(plan, MATERIALS):
        for case in (one for one in mine.normal if one.force):
            for direction in directions:
                own = mine.sheared_case(case, direction)
                at = [r for r in numbers if replace(r.case, ratio=None) == own]
                yield from _unlike(mine, case, direction, at)


def _unlike(
    mine: ContactSolution, case: NormalCase, direction: float, numbers: Sequence[Result]
) -> Iterator[Resolved]:
    """The tangential loads along a direction with the slip of the pressure alone already there."""
    scene, model = mine.plan.scene, mine.model
    way = Frozen(mine, case, direction)
    before = pressure_slip(model, way.components, case.solution.force, way.loaded)
    for one in (r for r in numbers if r.name == "K_T_secant_raw"):
        assert one.case.ratio is not None
        load = one.case.ratio * scene.contact.friction * case.force * way.unit
        K = _slipped_stiffness(way.compliance, way.limit, before, load)
        yield Resolved(MATERIALS, one.name, one.case, one.value, K, one.unit)
    for one in (r for r in numbers if r.name == "cycle_energy"):
        work = way.cycle(one.case, before).slip_work
        yield Resolved(MATERIALS, one.name, one.case, one.value, work, one.unit)


def _changes(
    effect: str, names: Iterable[str], without: Iterable[Result], included: Iterable[Result]
) -> Iterator[Resolved]:
    """The numbers of ``names`` that both lists of results have."""
    theirs = {(r.name, r.case): r.value for r in included}
    wanted = set(names)
    for r in without:
        if r.name in wanted and (r.name, r.case) in theirs:
            yield Resolved(effect, r.name, r.case, r.value, theirs[r.name, r.case], r.unit)


def _displaced_changes(
    plan: ContactPlan, model: ContactModel, press: Press, case: Case, load: float
) -> Iterator[Resolved]:
    """What displaced faces change of the normal stiffness, or of the approach where no stiffness
    is asked for.

    Parameters
    ----------
    model, press
        The companion and its contact.
    load
        N on the whole contact.
    """
    if not left_out(plan, LARGE):
        return

    @cache
    def plain(load: float) -> Pressed:
        return press(model.gap, load)

    def displaced(load: float) -> float:
        return press(displaced_gap(model, plain(load).force), load).approach

    quantity, unit = _quantity(plan.scene)
    numbers = [_number(plan.scene, way, load) for way in (lambda F: plain(F).approach, displaced)]
    yield Resolved(LARGE, quantity, case, numbers[0], numbers[1], unit)


def _coupled_changes(
    plan: ContactPlan, uncoupled: Iterable[Result], solve: Callable[[], Iterable[Result]]
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
    if not left_out(plan, COUPLING):
        return
    others = () if plan.scene.wants("stiffness") else ("approach", "K_T_secant_raw")
    # Nothing is coupled without a load.
    mine = [r for r in uncoupled if r.name in (*COUPLED_NUMBERS, *others) and r.case.load]
    try:
        again = list(solve())
    except (UpdError, np.linalg.LinAlgError):
        again = [replace(r, value=float("nan")) for r in mine]
    areas = {r.case.load: r.value for r in mine if r.name == "contact_area"}
    for one in _changes(COUPLING, [r.name for r in mine], mine, again):
        area = areas.get(one.case.load, 0.0)
        known = one.quantity == q.STICK_AREA.name and area > 0.0
        yield replace(one, over=(area, q.STICK_AREA.part_of)) if known else one


def _quantity(scene: Scene) -> tuple[str, str]:
    """Name and unit of the normal number that a run has."""
    return ("K_N_tangent_raw", "N/mm") if scene.wants("stiffness") else ("approach", "um")


def _number(scene: Scene, approach: Callable[[float], float], load: float) -> float:
    """Tangent stiffness in N/mm at the load, or the approach in um; NaN when it is not found."""
    try:
        if not scene.wants("stiffness"):
            return 1e3 * approach(load)
        low, high = (approach(load * (1.0 + s)) for s in (-LOAD_STEP, LOAD_STEP))
        return 2.0 * LOAD_STEP * load / (high - low)
    except (UpdError, np.linalg.LinAlgError):
        return float("nan")


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
    ratio = largest_ratio(scene)
    if scene.wants("cycle") and not scene.wants("stiffness") and not ratio > 0.0:
        want.append("cycle")
    smaller = replace(
        scene,
        want=tuple(want),
        contact=replace(scene.contact, directions=directions, coupling=coupling),
        loads=replace(scene.loads, tangential=(ratio,)),
    )
    family = Family((NORMAL, *(ALONG, ACROSS)[:directions]))
    return replace(companion, scene=smaller, families=(family,))


def _slipped_stiffness(C: Array, limit: Array, before: TangentialHistory, load: Array) -> float:
    """Secant tangential stiffness in N/mm along the load (1 or 2,) in N, after a slip that is
    already there; NaN when it is not found.
    """
    size = float(np.linalg.norm(load))
    unit = load / size
    try:
        path = tangential_path(
            C, limit, loads=load_history(np.array([0.0, size]), unit), history=before
        )
    except UpdError:
        return float("nan")
    first, last = path.displacement.reshape(2, len(unit)) @ unit
    return size / float(last - first)


def _not_solved(plan: ContactPlan, cases: Iterable[Case]) -> list[Resolved]:
    """What the checks show when the companion has no answer."""
    quantity, unit = _quantity(plan.scene)
    return [
        Resolved(e.name, quantity, case, float("nan"), float("nan"), unit)
        for e in plan.effects
        if e.check and e.word == "no" and e.name not in OWN_LEVEL
        for case in cases
    ]
