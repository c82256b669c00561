"""Quasi-static contact of two bodies.

Mesh, stiffness, condensation, normal contact, tangential contact. Arrays in, arrays out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve as solve_dense

from upd.analyses.contact.bodies import prepare, pressed
from upd.analyses.contact.coupled import (
    CoupledState,
    as_normal,
    coupled_loop,
    held_stiffness,
    initial_stiffness,
    raised,
    shear_nodes,
    shear_tangent,
    sheared,
    unloaded,
)
from upd.analyses.contact.loading import (
    LOAD_STEP,
    Sheared,
    closed_loop,
    tangential_compliance,
)
from upd.analyses.contact.plan import ACROSS, ALONG, NORMAL, ContactPlan, unit_vector
from upd.analyses.contact.solution import (
    CurvePoint,
    HertzNormalCase,
    HertzSolution,
    HertzTangentialCase,
)
from upd.analyses.hertz.products import show_normal, show_tangential
from upd.contact.bulk import finite_body_share, half_space_mean
from upd.contact.edge import located_area
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact, normal_curve
from upd.contact.patch import measure
from upd.contact.stiffness import BodyShare, axis_half_space, axis_share
from upd.contact.tangential import tangential_contact
from upd.errors import MeshError
from upd.progress import Stages
from upd.reference import contact_modulus
from upd.results import Case

Array = NDArray[np.float64]

# Shares of mu N on the way to a tangential load where the pressure follows the shear.
_SHARES = np.arange(1, 20) / 20.0
# Steps of a lattice are equal up to the rounding of a mesher.
_EVEN = 1e-6


def solve_plan(plan: ContactPlan, stages: Stages) -> HertzSolution:
    """Run everything the plan calls for.

    An UpdError raised on the way carries what converged so far as ``partial``.
    """
    return solve_on(plan, prepare(plan, stages), stages)


def solve_on(plan: ContactPlan, model: ContactModel, stages: Stages) -> HertzSolution:
    """Every load on a contact model."""
    m1, m2 = (plan.scene.materials[b.name] for b in (model.upper, model.lower))
    solution = HertzSolution(plan, model, contact_modulus(m1.E, m1.nu, m2.E, m2.nu))
    try:
        solve_normal(solution, stages)
        if plan.effect("friction"):
            solve_tangential(solution, stages)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def solve_normal(solution: HertzSolution, stages: Stages) -> None:
    """Every normal load, the force-approach curve, displacements inside the bodies."""
    plan, model = solution.plan, solution.model
    loads = plan.scene.loads
    largest = max(loads.forces)
    # Points evenly spaced in approach by Hertz's F ~ d^(3/2).
    wanted = (
        [largest * s**1.5 for s in np.linspace(0.0, 1.0, loads.curve_points + 1)[1:]]
        if plan.effect("load curve")
        else []
    )
    # The slope of the curve between loads a little below and above: at one contact set it moves in
    # steps as nodes come into contact.
    around = (
        [F * (1.0 + s) for F in loads.forces for s in (-LOAD_STEP, LOAD_STEP)]
        if plan.scene.wants("stiffness")
        else []
    )
    forces = sorted({*loads.forces, *wanted, *around})
    with stages("normal contact", f"{len(forces)} loads"):
        states: dict[float, CoupledState] = {}
        if plan.scene.coupled:
            held = np.zeros((len(model.gap), 0))
            states = raised(model, plan.scene.contact.friction, forces, held)
            results = {
                F: as_normal(states[F], held_stiffness(states[F])) if F > 0.0 else unloaded(model)
                for F in forces
            }
        else:
            mine = [F / plan.copies for F in forces]
            show_normal(model, mine)
            found = normal_curve(model.compliance(NORMAL), model.gap, mine)
            results = dict(zip(forces, found, strict=True))
        solution.normal = [
            _normal_case(solution, F, results[F], states.get(F)) for F in loads.forces
        ]
        for case in solution.normal:
            if around and case.load > 0.0:
                low, high = (results[case.load * (1.0 + s)] for s in (-LOAD_STEP, LOAD_STEP))
                case.stiffness = 2.0 * LOAD_STEP * case.load / (high.approach - low.approach)
        if wanted and largest > 0.0:
            solution.curve = [
                (float(model.gap.min()), 0.0),
                *((results[F].approach, F) for F in wanted),
            ]
    if plan.effect("internal displacement"):
        with stages("internal displacement", "back-substitution"):
            for case in solution.normal:
                _internal_normal(solution, case)
    solution.along = [_curve_point(solution, F, results[F]) for F in wanted if F > 0.0]


def _curve_point(solution: HertzSolution, load: float, result: NormalContact) -> CurvePoint:
    """A point of the curve with both bodies' compression beyond 3a, where they have an axis."""
    plan, model, beyond = solution.plan, solution.model, {}
    measures = measure(model.patch, model.patch.whole(result.force, extensive=True))
    if plan.effect("internal displacement") and plan.scene.sphere_radius is not None:
        nodal = model.nodal(result.force)
        for body in (model.upper, model.lower):
            u = body.side * body.displacement(NORMAL, body.side * nodal)[:, 2]
            axis = body.mesh.nodes["axis"]
            depth = np.abs(body.mesh.points[axis, 2])
            beyond[body.name] = float(np.interp(3.0 * measures.radius_moment, depth, u[axis]))
    return CurvePoint(load, result.approach, measures, beyond)


def _normal_case(
    solution: HertzSolution, load: float, result: NormalContact, state: CoupledState | None
) -> HertzNormalCase:
    patch, copies = solution.model.patch, solution.plan.copies
    force = patch.whole(result.force, extensive=True)
    gap = patch.whole(result.gap)
    pressure = patch.whole(solution.model.multipliers.pressure(result.force))
    located = None
    if solution.plan.scene.sphere_radius is None:
        # This contact need not be an ellipse.
        average = force / patch.area()
        located = located_area(patch.X, patch.Y, average, gap, force > 0.0, solution.modulus)
    return HertzNormalCase(
        result,
        copies * result.stiffness,
        load,
        force,
        gap,
        pressure,
        measure(patch, force, located, pressure),
        state=state,
    )


def _internal_normal(solution: HertzSolution, case: HertzNormalCase) -> None:
    model, plan = solution.model, solution.plan
    case.displacement, case.reaction = pressed(model, case.solution.force, plan.copies)
    if case.load > 0.0 and plan.scene.sphere_radius is not None:
        for body in (model.upper, model.lower):
            u, radius = case.displacement[body.name], case.measures.radius_moment
            share = _share(solution, body, u, case.force, radius, tangential=False)
            if share is not None:
                case.shares[body.name] = share
    if len(case.shares) < 2:
        case.shares.clear()
    else:
        case.mesh_error = _mesh_error(solution, case)
    if case.state is not None:
        # What the finite bodies and the mesh add goes with the load; the fields have the shear too.
        case.displacement, case.reaction = pressed(model, case.state.force, plan.copies)


def _mesh_error(solution: HertzSolution, case: HertzNormalCase) -> tuple[float, float] | None:
    """Error of the approach in mm by the mesh near the contact and far from it; None for a lattice
    that is not even.

    The approach is dU/dF of the energy U = min (f' C f / 2 + h' f), so an error dC of the
    compliance moves it by f' dC f / F to first order, whatever it does to the forces. The whole of
    it is the mean displacement of both bodies at the contact minus that of the half-spaces under
    the same pressures and of the finite bodies' share; the far part shows along the axis, and the
    near part is the rest. The near part is counted in full: it goes with (h / a)^2 and a with
    F^(1/3), so that half of it reaches dU/dF.
    """
    model, patch = solution.model, solution.model.patch
    steps = [np.diff(lines) for lines in (patch.X, patch.Y)]
    if max(float(np.ptp(step) / step.mean()) for step in steps) > _EVEN:
        return None
    nodal = model.nodal(case.solution.force)
    whole = far = 0.0
    for body in (model.upper, model.lower):
        u, share = case.displacement[body.name], case.shares[body.name]
        data = solution.plan.scene.materials[body.name]
        mean = body.side * float(nodal @ u[body.contact, 2]) / float(nodal.sum())
        whole += mean - share.finite_body - half_space_mean(patch, case.force, data.E, data.nu)
        far += share.far_mesh
    return whole - far, far


def _share(
    solution: HertzSolution,
    body: Body,
    displacement: Array,
    force: Array,
    radius: float,
    *,
    tangential: bool,
) -> BodyShare | None:
    along = displacement[:, ALONG] if tangential else body.side * displacement[:, NORMAL]
    axis = body.mesh.nodes["axis"]
    depth = np.abs(body.mesh.points[axis, 2])
    patch = solution.model.patch
    X, Y = np.meshgrid(patch.X, patch.Y, indexing="ij")
    data = solution.plan.scene.materials[body.name]
    inside = depth > 0.5 * radius
    half_space = np.zeros(len(depth))
    half_space[inside] = axis_half_space(
        depth[inside],
        np.column_stack([X.ravel(), Y.ravel()]),
        force.ravel(),
        data.E,
        data.nu,
        tangential=tangential,
    )
    try:
        compression, fitted = axis_share(depth, along[axis], half_space, radius)
        finite = finite_body_share(
            body, displacement, force, patch, radius, data.E, data.nu, tangential=tangential
        )
    except MeshError as error:
        # The numbers with the bulk compliance removed are left out, the others stand.
        solution.no_shares = f"{body.name}: {error}"
        return None
    return BodyShare(compression, finite, fitted)


def solve_tangential(solution: HertzSolution, stages: Stages) -> None:
    """Stiffness, tangential loads and cycles after every normal load."""
    plan = solution.plan
    components = next(f.components for f in plan.families if ALONG in f.components)
    directions = tuple(c for c in components if c != NORMAL)
    with stages("tangential contact", f"{len(solution.normal)} normal loads"):
        frozen = [case.solution.force for case in solution.normal]
        show_tangential(plan, solution.model, frozen, directions)
        for case in solution.normal:
            _sheared(solution, case, directions)
    if plan.effect("internal displacement"):
        with stages("internal displacement", "back-substitution"):
            for case in solution.normal:
                _internal_tangential(solution, case)


def _sheared(solution: HertzSolution, case: HertzNormalCase, directions: tuple[int, ...]) -> None:
    """Stiffness, single loads and cycle along x after one normal load."""
    if solution.plan.scene.coupled:
        _sheared_together(solution, case)
        return
    scene, copies, unit = solution.plan.scene, solution.plan.copies, unit_vector(0.0, directions)
    limit = scene.contact.friction * case.solution.force
    loaded = np.flatnonzero(limit > 0.0)
    if not loaded.size:
        return
    C = tangential_compliance(solution.model, directions, loaded)
    total = scene.contact.friction * case.load
    if scene.wants("stiffness"):
        case.shear_stiffness = copies * _stuck_stiffness(C, len(loaded))
    if scene.wants("tangential"):
        for ratio in scene.loads.tangential:
            load = ratio * total / copies
            result = tangential_contact(
                C, limit[loaded], load=load * unit if len(unit) == 2 else load
            )
            nodes = Sheared(
                directions,
                loaded,
                limit[loaded],
                result.unclipped,
                np.zeros(len(result.force)),
                np.atleast_1d(result.displacement),
                load * unit,
                result.stick,
            )
            moved = result.force, result.slip, result.displacement, result.stiffness
            solution.tangential.append(_tangential_case(solution, case, ratio, nodes, *moved))
    if scene.wants("cycle"):
        ratio, steps = scene.loads.cycle_amplitude, scene.loads.cycle_steps
        own = Case(load=case.load, ratio=ratio)
        peak = ratio * scene.contact.friction * case.load / copies
        solution.cycles.append(
            closed_loop(
                own, case.case, C, limit[loaded], peak=peak, steps=steps, unit=unit, copies=copies
            )
        )


def _sheared_together(solution: HertzSolution, case: HertzNormalCase) -> None:
    """The same with normal and tangential contact at once: the pressure follows the shear."""
    scene, state, unit = solution.plan.scene, case.state, unit_vector(0.0, (ALONG, ACROSS))
    if state is None:
        return
    mu = scene.contact.friction
    total = mu * case.load
    if scene.wants("stiffness"):
        case.shear_stiffness = initial_stiffness(state, mu, unit)
    if scene.wants("tangential") and scene.loads.tangential:
        ratios, highest = scene.loads.tangential, max(scene.loads.tangential)
        shares = np.unique(np.concatenate([_SHARES[highest > _SHARES], ratios]))
        path = sheared(state, shares * total, unit, highest * total)
        for ratio in ratios:
            k = int(np.searchsorted(shares, ratio))
            solution.tangential.append(
                _together_case(solution, case, ratio, path.states[k], path.base)
            )
    if scene.wants("cycle"):
        ratio, steps = scene.loads.cycle_amplitude, scene.loads.cycle_steps
        own = Case(load=case.load, ratio=ratio)
        solution.cycles.append(
            coupled_loop(own, case.case, state, peak=ratio * total, steps=steps, unit=unit)
        )


def _together_case(
    solution: HertzSolution,
    case: HertzNormalCase,
    ratio: float,
    state: CoupledState,
    base: CoupledState,
) -> HertzTangentialCase:
    model = solution.model
    nodes = shear_nodes(model, solution.plan.scene.contact.friction, state)
    pressure = model.multipliers.pressure(np.maximum(state.force[:, 0], 0.0))
    found = _tangential_case(
        solution,
        case,
        ratio,
        nodes,
        nodes.force,
        state.found.slip[-1][nodes.loaded].T.ravel(),
        state.motion[1:3] - base.motion[1:3],
        shear_tangent(state),
    )
    return replace(found, pressure=model.patch.whole(pressure), state=state)


def _stuck_stiffness(C: Array, n: int) -> float:
    """Tangential stiffness of the model in N/mm along x with every node stuck: e' C^-1 e."""
    e = np.zeros(len(C))
    e[:n] = 1.0
    return float(e @ solve_dense(C, e, assume_a="pos"))


def _tangential_case(
    solution: HertzSolution,
    case: HertzNormalCase,
    ratio: float,
    nodes: Sheared,
    force: Array,
    slip: Array,
    displacement: Array | float,
    stiffness: Array | float,
) -> HertzTangentialCase:
    """On the whole patch, from forces in N and slips of the loaded nodes, and what the model moves
    by and resists with, one direction or two.
    """
    patch, loaded, copies = solution.model.patch, nodes.loaded, solution.plan.copies
    n = len(patch.order)
    on, stick = np.zeros(n, bool), np.zeros(n, bool)
    on[loaded], stick[loaded] = True, nodes.stick

    def whole(values: Array, *, traction: bool) -> Array:
        parts = []
        for part in values.reshape(-1, len(loaded)):
            full = np.zeros(n)
            full[loaded] = part
            if traction:
                full = solution.model.multipliers.pressure(full, on)
            parts.append(patch.whole(full))
        return np.stack(parts, -1) if len(parts) > 1 else parts[0]

    return HertzTangentialCase(
        case,
        ratio,
        ratio * solution.plan.scene.contact.friction * case.load,
        float(np.ravel(displacement)[0]),
        copies * float(np.ravel(stiffness)[0]),
        whole(force, traction=True),
        whole(slip, traction=False),
        patch.whole(stick) > 0.0,
        case.pressure,
        nodes,
    )


def _internal_tangential(solution: HertzSolution, case: HertzNormalCase) -> None:
    """Shear of both bodies per N, from full slip t = mu f: their far field knows the total force
    only.
    """
    model, plan = solution.model, solution.plan
    forces = plan.scene.contact.friction * case.solution.force
    loaded = np.flatnonzero(forces > 0.0)
    if not loaded.size:
        return
    whole = model.patch.whole(forces, extensive=True)
    total = float(whole.sum())
    nodal = model.nodal(forces)
    shares = {}
    for body in (model.upper, model.lower):
        u = body.displacement(ALONG, nodal)
        if plan.scene.sphere_radius is not None:
            share = _share(solution, body, u, whole, case.measures.radius_moment, tangential=True)
            if share is not None:
                shares[body.name] = share.over(total)
    if len(shares) == 2:
        case.shear_shares = shares
