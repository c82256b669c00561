"""Stiffness, tangential loads and cycles of a contact after every normal load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from upd.analyses.contact.coupled import (
    CoupledState,
    coupled_loop,
    initial_stiffness,
    shear_nodes,
    shear_tangent,
    sheared,
)
from upd.analyses.contact.effects import largest_ratio
from upd.analyses.contact.loading import (
    LoadPath,
    Sheared,
    along,
    closed_loop,
    load_history,
    tangential_compliance,
)
from upd.analyses.contact.plan import (
    ACROSS,
    ALONG,
    NORMAL,
    ContactPlan,
    slip_components,
    unit_vector,
)
from upd.analyses.contact.products import show_tangential
from upd.analyses.contact.solution import (
    ContactSolution,
    NormalCase,
    StuckContact,
    TangentialCase,
)
from upd.contact.tangential import TangentialPath, tangential_path
from upd.progress import Stages
from upd.results import Case

Array = NDArray[np.float64]

#: Shares of mu N of the force-displacement curve: even steps, then closer to gross slip.
PATH_SHARES = np.concatenate(
    [np.linspace(0.05, 0.9, 18), [0.93, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999]]
)
# On the way to the tangential loads of a curved contact where the pressure follows the shear.
_SHARES = np.arange(1, 20) / 20.0


def march_shares(plan: ContactPlan, curved: bool, *, companion: bool = False) -> Array:
    """Shares of mu N that the march to the tangential loads takes: of flat faces to gross slip, for
    a curve.

    On a companion that march takes four steps to the largest load: exact along one direction; along
    two the slip turns a little from step to step. Coupled, which nodes stick depends on the steps:
    the run's.
    """
    ratio = largest_ratio(plan.scene)
    if curved:
        return np.asarray(_SHARES[ratio > _SHARES])
    if not companion:
        return PATH_SHARES
    few = ratio * np.array([0.25, 0.5, 0.75])
    return np.asarray(PATH_SHARES[ratio > PATH_SHARES] if plan.scene.coupled else few)


def solve_tangential(solution: ContactSolution, stages: Stages, *, companion: bool = False) -> None:
    """Stiffness, tangential loads, curve and cycle of every direction after every normal load."""
    plan, scene = solution.plan, solution.plan.scene
    shares = march_shares(plan, solution.curved, companion=companion)
    with stages("tangential contact", f"{len(solution.normal)} normal loads"):
        if solution.curved:
            frozen = [case.solution.force for case in solution.normal]
            show_tangential(plan, solution.model, frozen, slip_components(scene, 0.0))
        for case in solution.normal:
            loaded = np.flatnonzero(case.solution.force > 0.0)
            for direction in scene.loads.directions if loaded.size else ():
                if case.state is not None:
                    _sheared_together(solution, case, case.state, direction, shares)
                else:
                    _sheared(solution, case, direction, loaded, shares)


def _sheared(
    solution: ContactSolution,
    case: NormalCase,
    direction: float,
    loaded: NDArray[np.int64],
    shares: Array,
) -> None:
    """Stiffness, single loads, curve and cycle of one direction after one normal load."""
    scene, copies = solution.plan.scene, solution.plan.copies
    components = slip_components(scene, direction)
    unit = unit_vector(direction, components)
    C = tangential_compliance(solution.model, components, loaded)
    limit = scene.contact.friction * case.solution.force[loaded]
    total = float(limit.sum())
    if solution.curved:
        total = scene.contact.friction * case.force / copies
    if _wants_stiffness(solution):
        solution.stuck.append(_stuck(solution, case, direction, C, loaded))
    for ratios in _marches(solution, shares):
        path = tangential_path(C, limit, loads=load_history(ratios * total, unit))
        if not solution.curved:
            own = solution.sheared_case(case, direction)
            solution.paths.append(LoadPath(own, case.case, *along(path, unit, copies)))
        for ratio in (r for r in scene.loads.tangential if r in ratios):
            k = int(np.searchsorted(ratios, ratio))
            before = path.slip[k - 1] if k else np.zeros(len(C))
            d, load = np.atleast_1d(path.displacement[k]), ratio * total * unit
            force, stick = path.unclipped[k], path.state[k] == 0
            nodes = Sheared(components, loaded, limit, force, before, d, load, stick)
            solution.tangential.append(
                _single_load(solution, case, direction, ratio, nodes, path, k)
            )
    if scene.wants("cycle"):
        loop = closed_loop(
            _cycle_case(solution, case, direction),
            case.case,
            C,
            limit,
            peak=scene.loads.cycle_amplitude * total,
            steps=scene.loads.cycle_steps,
            unit=unit,
            copies=copies,
        )
        solution.paths.append(loop)


def _wants_stiffness(solution: ContactSolution) -> bool:
    """Whether the stuck contact is asked for: flat faces share their law by it."""
    return not solution.curved or solution.plan.scene.wants("stiffness")


def _cycle_case(solution: ContactSolution, case: NormalCase, direction: float) -> Case:
    ratio = solution.plan.scene.loads.cycle_amplitude if solution.curved else None
    return solution.sheared_case(case, direction, ratio)


def _marches(solution: ContactSolution, shares: Array) -> list[Array]:
    """Shares of mu N, march by march: each load of a curved contact alone, all loads of flat faces
    on one way to gross slip.
    """
    scene = solution.plan.scene
    if not scene.wants("tangential"):
        return []
    if solution.curved:
        return [np.array([ratio]) for ratio in scene.loads.tangential]
    return [np.unique(np.concatenate([shares, scene.loads.tangential]))]


def _stuck(
    solution: ContactSolution,
    case: NormalCase,
    direction: float,
    C: Array,
    loaded: NDArray[np.int64],
) -> StuckContact:
    """The contact set stuck and moved by one along the direction: T = e' C^-1 e, for both bodies
    and for each on a rigid counterpart.
    """
    model, copies = solution.model, solution.plan.copies
    components = slip_components(solution.plan.scene, direction)
    unit = unit_vector(direction, components)

    def moved(compliance: Array) -> tuple[Array, float]:
        e = np.repeat(unit, len(compliance) // len(unit))
        t = cho_solve(cho_factor(compliance), e)
        return t, copies * float(e @ t)

    t, total = moved(C)
    of = {}
    for body in (model.upper, model.lower):
        if body.name in case.alone:
            on = np.flatnonzero(case.alone[body.name].solution.force > 0.0)
            of[body.name] = moved(tangential_compliance(model, components, on, body))[1]
    nodal = np.zeros(len(model.gap))
    nodal[loaded] = t.reshape(len(components), len(loaded)).T @ unit
    own = solution.sheared_case(case, direction)
    return StuckContact(case.case, own, direction, total, of, nodal)


def _single_load(
    solution: ContactSolution,
    case: NormalCase,
    direction: float,
    ratio: float,
    nodes: Sheared,
    path: TangentialPath,
    k: int,
) -> TangentialCase:
    """After step k of a march."""
    unit, n = unit_vector(direction, nodes.components), len(solution.model.gap)

    def spread(values: Array) -> Array:
        out = np.zeros((n, len(unit)))
        out[nodes.loaded] = values.reshape(len(unit), len(nodes.loaded)).T
        return out

    stick = np.zeros(n, bool)
    stick[nodes.loaded] = nodes.stick
    return TangentialCase(
        case,
        solution.sheared_case(case, direction, ratio),
        ratio * solution.plan.scene.contact.friction * case.force,
        float(nodes.displacement @ unit),
        solution.plan.copies * _tangent(np.atleast_2d(path.stiffness[k]), unit, solution.curved),
        spread(path.force[k]),
        spread(path.slip[k]),
        stick,
        case.solution.force,
        nodes,
    )


def _tangent(K: Array, unit: Array, held: bool) -> float:
    """Stiffness along the load: with the motion across it ``held``, or free to follow."""
    if held:
        return float(K[0, 0])
    return 1.0 / float(unit @ np.linalg.pinv(K, hermitian=True) @ unit) if K.any() else 0.0


def _sheared_together(
    solution: ContactSolution,
    case: NormalCase,
    state: CoupledState,
    direction: float,
    shares: Array,
) -> None:
    """The same with normal and tangential contact at once: the pressure follows the shear."""
    scene, n = solution.plan.scene, len(solution.model.gap)
    mu, unit = scene.contact.friction, unit_vector(direction, (ALONG, ACROSS))
    total, own = mu * case.force, solution.sheared_case(case, direction)
    if _wants_stiffness(solution):
        states = {name: one.state for name, one in case.alone.items()}
        of = {name: initial_stiffness(s, mu, unit) for name, s in states.items() if s is not None}
        first = initial_stiffness(state, mu, unit)
        solution.stuck.append(StuckContact(case.case, own, direction, first, of, np.zeros(n)))
    if scene.wants("tangential"):
        ratios = np.unique(np.concatenate([shares, scene.loads.tangential]))
        needed = max(scene.loads.tangential, default=0.0) * total
        path = sheared(state, ratios * total, unit, needed)
        if not solution.curved:
            T, d = (np.concatenate([[0.0], values]) for values in (path.loads, path.moved))
            solution.paths.append(LoadPath(own, case.case, T, d))
        for ratio in scene.loads.tangential:
            k = int(np.searchsorted(ratios, ratio))
            now, moved = path.states[k], path.moved[k]
            solution.tangential.append(_together_case(solution, case, direction, ratio, now, moved))
    if scene.wants("cycle"):
        peak, steps = scene.loads.cycle_amplitude * total, scene.loads.cycle_steps
        cycle = _cycle_case(solution, case, direction)
        solution.paths.append(
            coupled_loop(cycle, case.case, state, peak=peak, steps=steps, unit=unit)
        )


def _together_case(
    solution: ContactSolution,
    case: NormalCase,
    direction: float,
    ratio: float,
    state: CoupledState,
    moved: float,
) -> TangentialCase:
    mu, unit = solution.plan.scene.contact.friction, unit_vector(direction, (ALONG, ACROSS))
    nodes, K = shear_nodes(solution.model, mu, state), shear_tangent(state)
    slip = np.zeros((len(solution.model.gap), 2))
    slip[nodes.loaded] = state.found.slip[-1][nodes.loaded]
    free = 1.0 / float(unit @ np.linalg.inv(K) @ unit) if K.any() else 0.0
    return TangentialCase(
        case,
        solution.sheared_case(case, direction, ratio),
        ratio * mu * case.force,
        float(moved),
        float(K[0, 0]) if solution.curved else free,
        state.force[:, 1:],
        slip,
        state.stick,
        state.force[:, 0],
        nodes,
        state,
    )


def note_moved(run: ContactSolution, companion: ContactSolution) -> None:
    """Note in the run what shear would move of the companion's pressure, of flat faces."""
    for stuck in () if run.curved else companion.stuck:
        case = next(c for c in companion.normal if c.case == stuck.normal)
        run.moved[stuck.case] = moved_by_shear(companion, case, stuck)


def moved_by_shear(solution: ContactSolution, case: NormalCase, stuck: StuckContact) -> float:
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
