"""Quasi-static contact of a damper's flat faces on a platform. Arrays in, arrays out.

All fields are those of the model's contact nodes, (n,); mirror symmetry may make the model a half
of the whole, which loads and stiffnesses are those of.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from upd.analyses.contact.bodies import prepare, pressed
from upd.analyses.contact.coupled import (
    CoupledState,
    as_normal,
    coupled_loop,
    held_stiffness,
    initial_stiffness,
    pressed_by,
    raised,
    shear_nodes,
    shear_tangent,
    sheared,
    slope,
    slope_loads,
)
from upd.analyses.contact.effects import largest_ratio
from upd.analyses.contact.loading import (
    LoadPath,
    Sheared,
    along,
    closed_loop,
    load_history,
    slip_components,
    tangential_compliance,
    tilt_arms,
)
from upd.analyses.contact.plan import (
    ACROSS,
    ALONG,
    NORMAL,
    ContactPlan,
    direction_name,
    unit_vector,
)
from upd.analyses.contact.scene_plan import DamperLoad, normal_loads
from upd.analyses.contact.solution import (
    FlatNormalCase,
    FlatSolution,
    FlatTangentialCase,
    StuckContact,
)
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact, normal_curve
from upd.contact.tangential import TangentialPath, tangential_path
from upd.contact.tilt import TiltedContact, tilted_contact
from upd.progress import Stages

Array = NDArray[np.float64]

#: Shares of mu N of the force-displacement curve: even steps, then closer to gross slip.
PATH_SHARES = np.concatenate(
    [np.linspace(0.05, 0.9, 18), [0.93, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999]]
)


def solve_plan(plan: ContactPlan, stages: Stages) -> FlatSolution:
    """Run everything the plan calls for, but for the effects it leaves out.

    An error raised on the way carries what converged so far as ``partial``.
    """
    return solve_on(plan, prepare(plan, stages), stages)


def solve_companion(plan: ContactPlan, model: ContactModel) -> FlatSolution:
    """The loads on the companion.

    The march to the largest load takes four steps: exact along one direction; along two the slip
    turns a little from step to step. Coupled, which nodes stick depends on the steps: the run's.
    """
    ratio = largest_ratio(plan.scene)
    few = ratio * np.array([0.25, 0.5, 0.75])
    steps = PATH_SHARES[ratio > PATH_SHARES] if plan.scene.coupled else few
    return solve_on(plan, model, Stages(), steps)


def solve_on(
    plan: ContactPlan, model: ContactModel, stages: Stages, steps: Array = PATH_SHARES
) -> FlatSolution:
    """Every load on a contact model; ``steps`` as of `solve_tangential`."""
    solution = FlatSolution(plan, model)
    try:
        solve_normal(solution, stages)
        if plan.effect("friction"):
            solve_tangential(solution, stages, steps)
        if plan.scene.wants("fields"):
            with stages("internal displacement", "back-substitution"):
                for case in solution.normal:
                    forces = case.solution.force if case.state is None else case.state.force
                    case.displacement, case.reaction = pressed(solution.model, forces, plan.copies)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def solve_normal(solution: FlatSolution, stages: Stages) -> None:
    """Every normal load and the force-approach curve."""
    plan, model = solution.plan, solution.model
    scene, copies = plan.scene, plan.copies
    loads = normal_loads(scene)
    C = model.compliance(NORMAL)
    curve = _curve_loads(plan, max(load.force for load in loads))
    with stages("normal contact", f"{len(loads) + len(curve)} loads"):
        # Nothing opened: a start from all nodes is then the answer after one linear solve.
        solution.bonded = copies * float(cho_solve(cho_factor(C), np.ones(len(C))).sum())
        wanted = [load.force for load in loads]
        if scene.coupled:
            _pressed_and_sheared(solution, loads, curve)
            return
        answers, tilted = _pressed(solution, C, [*wanted, *curve])
        solution.normal = [
            _normal_case(solution, load, answers[load.force], tilted.get(load.force))
            for load in loads
        ]
        solution.curve = [(F, answers[F]) for F in curve]
        for body in _bodies_alone(solution):
            alone, _ = _pressed(solution, model.body_compliance(body, NORMAL), wanted)
            for case in solution.normal:
                case.alone[body.name] = alone[case.force]


def _pressed(
    solution: FlatSolution, compliance: Array, forces: list[float]
) -> tuple[dict[float, NormalContact], dict[float, TiltedContact]]:
    """Answers of the forces in N on the whole contact, by force; those of a free tilt beside
    them.
    """
    gap, copies = solution.model.gap, solution.plan.copies
    distinct = sorted(set(forces))
    arms = tilt_arms(solution.plan, solution.model)
    if arms.size:
        tilted = {F: tilted_contact(compliance, gap, arms, load=F / copies) for F in distinct}
        return {F: t.normal for F, t in tilted.items()}, tilted
    found = normal_curve(compliance, gap, [F / copies for F in distinct])
    return dict(zip(distinct, found, strict=True)), {}


def _pressed_and_sheared(
    solution: FlatSolution, loads: tuple[DamperLoad, ...], curve: list[float]
) -> None:
    """Normal loads with normal and tangential contact at once, the slope of the curve as their
    stiffness.
    """
    model, mu, arms = (
        solution.model,
        solution.plan.scene.contact.friction,
        tilt_arms(solution.plan, solution.model),
    )
    wanted = [load.force for load in loads]
    states = raised(model, mu, [*slope_loads(wanted), *curve], arms)
    for load in loads:
        state, F = states[load.force], load.force
        free = slope(states, F)
        answer = as_normal(state, held_stiffness(state) if arms.size else free)
        shares = {b.name: pressed_by(model, b, state.force) for b in (model.upper, model.lower)}
        solution.normal.append(FlatNormalCase(answer, free, load, None, shares, state=state))
    solution.curve = [(F, as_normal(states[F], float("nan"))) for F in curve]
    for body in _bodies_alone(solution):
        alone = raised(model, mu, slope_loads(wanted), arms, body=body)
        for case in solution.normal:
            case.alone[body.name] = as_normal(alone[case.force], slope(alone, case.force))
            case.alone_states[body.name] = alone[case.force]


def _bodies_alone(solution: FlatSolution) -> tuple[Body, ...]:
    """Bodies whose stiffness against a rigid counterpart is asked for.

    A rigid body adds no compliance, so the contact of the other one is solved with its own alone:
    f >= 0, h + C_b f - d e >= 0, e'f = F. The forces of the pair would not do: of all that carry F
    over touching faces its own have the least energy f'C_b f, so a stiffness F^2 / f'C_b f by any
    others is too soft.
    """
    scene, model = solution.plan.scene, solution.model
    if scene.wants("stiffness"):
        return model.upper, model.lower
    return (model.upper,) if scene.wants("contact_law") and scene.law.bodies == "upper" else ()


def _curve_loads(plan: ContactPlan, largest: float) -> list[float]:
    loads = plan.scene.loads
    if not plan.effect("load curve"):
        return []
    top = largest if loads.curve_to is None else loads.curve_to
    return [top * k / loads.curve_points for k in range(1, loads.curve_points + 1)]


def _normal_case(
    solution: FlatSolution, load: DamperLoad, answer: NormalContact, tilted: TiltedContact | None
) -> FlatNormalCase:
    model, f = solution.model, answer.force
    total = float(f.sum())
    # f . (h + C f - d e) = 0, so the approach is the sum of the bodies' energies over the load (and
    # of the gaps closed).
    shares = {
        b.name: float(f @ model.body_compliance(b, NORMAL) @ f) / total if total else 0.0
        for b in (model.upper, model.lower)
    }
    stiffness = tilted.free_stiffness if tilted is not None else answer.stiffness
    return FlatNormalCase(answer, solution.plan.copies * stiffness, load, tilted, shares)


def solve_tangential(solution: FlatSolution, stages: Stages, steps: Array = PATH_SHARES) -> None:
    """Stiffness, tangential loads, curve and cycle of every direction after every normal load.

    ``steps`` are the shares of mu N that the march to a load takes.
    """
    scene = solution.plan.scene
    names = ", ".join(direction_name(d) for d in scene.loads.directions)
    with stages("tangential contact", f"{len(solution.normal)} normal loads, directions {names}"):
        for case in solution.normal:
            loaded = np.flatnonzero(case.solution.force > 0.0)
            if not loaded.size:
                continue
            for direction in scene.loads.directions:
                _sheared(solution, case, direction, loaded, steps)


def _sheared(
    solution: FlatSolution,
    case: FlatNormalCase,
    direction: float,
    loaded: NDArray[np.int64],
    steps: Array,
) -> None:
    """Stiffness, single loads, curve and cycle of one direction after one normal load."""
    scene, copies = solution.plan.scene, solution.plan.copies
    if case.state is not None:
        _sheared_together(solution, case, case.state, direction, steps)
        return
    components = slip_components(scene, direction)
    unit = unit_vector(direction, components)
    C = tangential_compliance(solution.model, components, loaded)
    limit = scene.contact.friction * case.solution.force[loaded]
    total = float(limit.sum())
    stuck = _stuck(solution, case, direction, C, components, loaded)
    solution.stuck.append(stuck)
    if scene.wants("tangential"):
        ratios = np.unique(np.concatenate([steps, scene.loads.tangential]))
        path = tangential_path(C, limit, loads=load_history(ratios * total, unit))
        solution.paths.append(LoadPath(stuck.case, case.case, *along(path, unit, copies)))
        for ratio in scene.loads.tangential:
            k = int(np.searchsorted(ratios, ratio))
            nodes = Sheared(
                components,
                loaded,
                limit,
                path.unclipped[k],
                path.slip[k - 1] if k else np.zeros(len(C)),
                np.atleast_1d(path.displacement[k]),
                ratio * total * unit,
                path.state[k] == 0,
            )
            solution.tangential.append(
                _tangential_case(solution, case, direction, ratio, path, k, nodes, unit)
            )
    if scene.wants("cycle"):
        peak = scene.loads.cycle_amplitude * total
        solution.paths.append(
            closed_loop(
                stuck.case,
                case.case,
                C,
                limit,
                peak=peak,
                steps=scene.loads.cycle_steps,
                unit=unit,
                copies=copies,
            )
        )


def _sheared_together(
    solution: FlatSolution,
    case: FlatNormalCase,
    state: CoupledState,
    direction: float,
    steps: Array,
) -> None:
    """The same with normal and tangential contact at once: the pressure follows the shear."""
    scene = solution.plan.scene
    mu, unit = scene.contact.friction, unit_vector(direction, (ALONG, ACROSS))
    total = mu * case.force
    stuck = StuckContact(
        case.case,
        direction,
        initial_stiffness(state, mu, unit),
        {name: initial_stiffness(one, mu, unit) for name, one in case.alone_states.items()},
        np.zeros(len(solution.model.gap)),
    )
    solution.stuck.append(stuck)
    if scene.wants("tangential"):
        ratios = np.unique(np.concatenate([steps, scene.loads.tangential]))
        needed = max(scene.loads.tangential, default=0.0) * total
        path = sheared(state, ratios * total, unit, needed)
        T, d = (np.concatenate([[0.0], values]) for values in (path.loads, path.moved))
        solution.paths.append(LoadPath(stuck.case, case.case, T, d))
        for ratio in scene.loads.tangential:
            k = int(np.searchsorted(ratios, ratio))
            solution.tangential.append(
                _together_case(solution, case, direction, ratio, path.states[k], path.moved[k])
            )
    if scene.wants("cycle"):
        peak, steps_of = scene.loads.cycle_amplitude * total, scene.loads.cycle_steps
        solution.paths.append(
            coupled_loop(stuck.case, case.case, state, peak=peak, steps=steps_of, unit=unit)
        )


def _together_case(
    solution: FlatSolution,
    case: FlatNormalCase,
    direction: float,
    ratio: float,
    state: CoupledState,
    moved: float,
) -> FlatTangentialCase:
    mu, unit = solution.plan.scene.contact.friction, unit_vector(direction, (ALONG, ACROSS))
    K = shear_tangent(state)
    return FlatTangentialCase(
        case,
        direction,
        ratio,
        ratio * mu * case.force,
        moved,
        # Stiffness along the load while the motion across it stays free to follow.
        1.0 / float(unit @ np.linalg.inv(K) @ unit) if K.any() else 0.0,
        state.force[:, 1:],
        state.found.slip[-1],
        state.stick,
        state.force[:, 0],
        shear_nodes(solution.model, mu, state),
        state,
    )


def _stuck(
    solution: FlatSolution,
    case: FlatNormalCase,
    direction: float,
    C: Array,
    components: tuple[int, ...],
    loaded: NDArray[np.int64],
) -> StuckContact:
    """The contact set stuck and moved by one along the direction: T = e' C^-1 e, for both bodies
    and for each on a rigid counterpart.
    """
    model, copies, unit = (
        solution.model,
        solution.plan.copies,
        unit_vector(direction, components),
    )

    def moved(compliance: Array) -> tuple[Array, float]:
        e = np.repeat(unit, len(compliance) // len(unit))
        t = cho_solve(cho_factor(compliance), e)
        return t, copies * float(e @ t)

    t, total = moved(C)
    of = {}
    for body in (model.upper, model.lower):
        if body.name in case.alone:
            on = np.flatnonzero(case.alone[body.name].force > 0.0)
            of[body.name] = moved(tangential_compliance(model, components, on, body))[1]
    nodal = np.zeros(len(model.gap))
    nodal[loaded] = t.reshape(len(components), len(loaded)).T @ unit
    return StuckContact(case.case, direction, total, of, nodal)


def _tangential_case(
    solution: FlatSolution,
    case: FlatNormalCase,
    direction: float,
    ratio: float,
    path: TangentialPath,
    step: int,
    nodes: Sheared,
    unit: Array,
) -> FlatTangentialCase:
    n, copies, loaded = len(solution.model.gap), solution.plan.copies, nodes.loaded

    def spread(values: Array) -> Array:
        out = np.zeros((n, len(unit)))
        out[loaded] = values.reshape(len(unit), len(loaded)).T
        return out

    stick = np.zeros(n, bool)
    stick[loaded] = nodes.stick
    moved = float(np.atleast_1d(path.displacement[step]) @ unit)
    K = np.atleast_2d(path.stiffness[step])
    # Stiffness along the load while the motion across it stays free to follow.
    stiffness = 1.0 / float(unit @ np.linalg.pinv(K, hermitian=True) @ unit) if K.any() else 0.0
    load = ratio * solution.plan.scene.contact.friction * case.force
    return FlatTangentialCase(
        case,
        direction,
        ratio,
        load,
        moved,
        copies * stiffness,
        spread(path.force[step]),
        spread(path.slip[step]),
        stick,
        case.solution.force,
        nodes,
    )


def note_moved(run: FlatSolution, companion: FlatSolution) -> None:
    """Note in the run what shear would move of the companion's pressure."""
    for stuck in companion.stuck:
        case = next(c for c in companion.normal if c.case == stuck.normal)
        run.moved[stuck.case] = moved_by_shear(companion, case, stuck)


def moved_by_shear(solution: FlatSolution, case: FlatNormalCase, stuck: StuckContact) -> float:
    """How far shear with T = mu N would change the normal forces that are frozen.

    Sum |df| / 2 N over the nodes kept in contact.

    The tangential forces t open or close the contact by C_nt t; kept closed at the same load, the
    normal forces change by df = -C_nn^-1 (C_nt t - d e), e'df = 0.
    """
    scene, model = solution.plan.scene, solution.model
    components = slip_components(scene, stuck.direction)
    unit = unit_vector(stuck.direction, components)
    total = scene.contact.friction * float(case.solution.force.sum())
    on = np.flatnonzero(case.solution.contact)
    t = stuck.nodal * (total / float(stuck.nodal.sum()))
    opened = sum(
        (u * (model.compliance(NORMAL, c) @ t) for c, u in zip(components, unit, strict=True)),
        np.zeros(len(t)),
    )[on]
    factor = cho_factor(model.compliance(NORMAL)[np.ix_(on, on)])
    e = cho_solve(factor, np.ones(len(on)))
    df = -cho_solve(factor, opened)
    df -= e * (df.sum() / e.sum())
    return float(np.abs(df).sum() / (2.0 * case.solution.force.sum()))
