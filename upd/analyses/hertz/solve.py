"""Quasi-static contact of two bodies.

Mesh, stiffness, condensation, normal contact, tangential contact. Arrays in, arrays out.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve as solve_dense

from upd.analyses.base import Resolved
from upd.analyses.contact.bodies import prepare, pressed
from upd.analyses.contact.loading import (
    LOAD_STEP,
    LoadPath,
    Sheared,
    closed_loop,
    tangential_compliance,
)
from upd.analyses.contact.plan import ALONG, NORMAL, ContactPlan, unit_vector
from upd.contact.bulk import finite_body_share, half_space_mean
from upd.contact.edge import located_area
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact, normal_curve
from upd.contact.patch import ContactMeasures, measure
from upd.contact.stiffness import BodyShare, axis_half_space, axis_share
from upd.contact.tangential import TangentialContact, tangential_contact
from upd.errors import MeshError
from upd.progress import Stages
from upd.reference import contact_modulus
from upd.results import Case

Array = NDArray[np.float64]
#: (name, case) -> estimated relative error, predicted seconds of half that error.
Estimates = dict[tuple[str, Case], tuple[float, float]]

# Steps of a lattice are equal up to the rounding of a mesher.
_EVEN = 1e-6


@dataclass
class HertzNormalCase:
    """One normal load: forces in N, gaps in mm, pressure in MPa on the whole patch, (len(X),
    len(Y)).

    Attributes
    ----------
    solution
        Of the model, which mirror symmetry may make a part of the whole.
    stiffness
        Tangent normal stiffness of the whole contact, N/mm.
    shares, displacement, reaction
        By body: its share of the approach, (n_node, 3) mm, N on its distant set.
    shear_stiffness
        N/mm along the load with every node stuck.
    shear_shares
        By body: its share of the tangential displacement, mm per N.
    mesh_error
        Estimated error of the approach by the mesh near the contact and far from it, mm; None
        where the shares are not known.
    """

    load: float
    solution: NormalContact
    force: Array
    gap: Array
    pressure: Array
    measures: ContactMeasures
    stiffness: float
    shares: dict[str, BodyShare] = field(default_factory=dict)
    displacement: dict[str, Array] = field(default_factory=dict)
    reaction: dict[str, float] = field(default_factory=dict)
    shear_stiffness: float | None = None
    shear_shares: dict[str, BodyShare] = field(default_factory=dict)
    mesh_error: tuple[float, float] | None = None

    @property
    def approach(self) -> float:
        """Of the distant sets, mm."""
        return self.solution.approach

    @property
    def finite_body(self) -> float:
        """What the finite bodies add to the approach, mm."""
        return sum(s.finite_body for s in self.shares.values())

    @property
    def finite_body_shear(self) -> float:
        """What the finite bodies add to the tangential displacement, mm per N."""
        return sum(s.finite_body for s in self.shear_shares.values())

    @property
    def case(self) -> Case:
        """The load."""
        return Case(load=self.load)


@dataclass
class HertzTangentialCase:
    """One tangential load T = ratio mu N after one normal load.

    Traction in MPa and slip in mm on the whole patch, (len(X), len(Y)), with a last axis of 2 for
    two directions; what the solver left at the nodes, for checks.
    """

    normal: HertzNormalCase
    ratio: float
    load: float
    solution: TangentialContact
    traction: Array
    slip: Array
    stick: NDArray[np.bool_]
    copies: int
    nodes: Sheared

    @property
    def stiffness(self) -> float:
        """Tangent dT/dd along the load in N/mm of the whole contact, at the present stick set."""
        value = np.asarray(self.solution.stiffness)
        return self.copies * float(value if value.ndim == 0 else value[0, 0])

    @property
    def displacement(self) -> float:
        """Along the load, mm."""
        return float(np.ravel(self.solution.displacement)[0])

    @property
    def traction_along(self) -> Array:
        """(len(X), len(Y)) traction along the load, MPa."""
        return self.traction[..., 0] if self.traction.ndim == 3 else self.traction

    @property
    def case(self) -> Case:
        """Normal load and ratio."""
        return Case(load=self.normal.load, ratio=self.ratio)


@dataclass(frozen=True)
class CurvePoint:
    """One loaded point of the curve: N, mm, and what lies beyond depth 3a in each body, mm."""

    load: float
    approach: float
    measures: ContactMeasures
    compression: dict[str, float]


@dataclass
class HertzSolution:
    """All that was solved.

    Attributes
    ----------
    modulus
        Contact modulus E*, MPa.
    curve
        Approach in mm and normal force in N.
    along
        What else is known at the loaded points of the curve.
    no_shares
        Why the bodies' shares of the approach are not known.
    left_out
        Numbers solved again with effects left out.
    """

    plan: ContactPlan
    model: ContactModel
    modulus: float
    normal: list[HertzNormalCase] = field(default_factory=list)
    curve: list[tuple[float, float]] = field(default_factory=list)
    along: list[CurvePoint] = field(default_factory=list)
    tangential: list[HertzTangentialCase] = field(default_factory=list)
    cycles: list[LoadPath] = field(default_factory=list)
    no_shares: str = ""
    left_out: list[Resolved] = field(default_factory=list)
    estimates: Estimates = field(default_factory=dict)


def solve_plan(plan: ContactPlan, stages: Stages) -> HertzSolution:
    """Run everything the plan calls for.

    An UpdError raised on the way carries what converged so far as ``partial``.
    """
    model = prepare(plan, stages)
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
        found = normal_curve(model.compliance(NORMAL), model.gap, [F / plan.copies for F in forces])
        results = dict(zip(forces, found, strict=True))
        solution.normal = [_normal_case(solution, F, results[F]) for F in loads.forces]
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
    else:
        solution.along = [
            CurvePoint(F, results[F].approach, _measures(solution, results[F]), {})
            for F in wanted
            if F > 0.0
        ]


def _measures(solution: HertzSolution, result: NormalContact) -> ContactMeasures:
    patch = solution.model.patch
    return measure(patch, patch.whole(result.force, extensive=True))


def _curve_point(solution: HertzSolution, load: float, result: NormalContact) -> CurvePoint:
    """A point of the curve with both bodies' compression beyond 3a, where they have an axis."""
    model, measures, beyond = solution.model, _measures(solution, result), {}
    if solution.plan.scene.sphere_radius is not None:
        nodal = model.nodal(result.force)
        for body in (model.upper, model.lower):
            u = body.side * body.displacement(NORMAL, body.side * nodal)[:, 2]
            axis = body.mesh.nodes["axis"]
            depth = np.abs(body.mesh.points[axis, 2])
            beyond[body.name] = float(np.interp(3.0 * measures.radius_moment, depth, u[axis]))
    return CurvePoint(load, result.approach, measures, beyond)


def _normal_case(solution: HertzSolution, load: float, result: NormalContact) -> HertzNormalCase:
    patch, copies = solution.model.patch, solution.plan.copies
    force = patch.whole(result.force, extensive=True)
    gap = patch.whole(result.gap)
    pressure = patch.whole(solution.model.multipliers.pressure(result.force))
    located = None
    if solution.plan.scene.sphere_radius is None:
        # Nobody says that this contact is an ellipse.
        average = force / patch.area()
        located = located_area(patch.X, patch.Y, average, gap, force > 0.0, solution.modulus)
    return HertzNormalCase(
        load,
        result,
        force,
        gap,
        pressure,
        measure(patch, force, located, pressure),
        copies * result.stiffness,
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
        return
    case.mesh_error = _mesh_error(solution, case)


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
        for case in solution.normal:
            _sheared(solution, case, directions)
    if plan.effect("internal displacement"):
        with stages("internal displacement", "back-substitution"):
            for case in solution.normal:
                _internal_tangential(solution, case)


def _sheared(solution: HertzSolution, case: HertzNormalCase, directions: tuple[int, ...]) -> None:
    """Stiffness, single loads and cycle along x after one normal load."""
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
            solution.tangential.append(_tangential_case(solution, case, ratio, result, nodes))
    if scene.wants("cycle"):
        ratio = scene.loads.cycle_amplitude
        mine, peak, steps = (
            Case(load=case.load, ratio=ratio),
            ratio * scene.contact.friction * case.load / copies,
            scene.loads.cycle_steps,
        )
        solution.cycles.append(
            closed_loop(
                mine, case.case, C, limit[loaded], peak=peak, steps=steps, unit=unit, copies=copies
            )
        )


def _stuck_stiffness(C: Array, n: int) -> float:
    """Tangential stiffness of the model in N/mm along x with every node stuck: e' C^-1 e."""
    e = np.zeros(len(C))
    e[:n] = 1.0
    return float(e @ solve_dense(C, e, assume_a="pos"))


def _tangential_case(
    solution: HertzSolution,
    case: HertzNormalCase,
    ratio: float,
    result: TangentialContact,
    nodes: Sheared,
) -> HertzTangentialCase:
    patch, loaded = solution.model.patch, nodes.loaded
    n = len(patch.order)

    on = np.zeros(n, bool)
    on[loaded] = True

    def whole(values: Array, *, traction: bool) -> Array:
        parts = []
        for part in values.reshape(-1, len(loaded)):
            full = np.zeros(n)
            full[loaded] = part
            if traction:
                full = solution.model.multipliers.pressure(full, on)
            parts.append(patch.whole(full))
        return np.stack(parts, -1) if len(parts) > 1 else parts[0]

    stick = np.zeros(n, bool)
    stick[loaded] = result.stick
    load = ratio * solution.plan.scene.contact.friction * case.load
    return HertzTangentialCase(
        case,
        ratio,
        load,
        result,
        whole(result.force, traction=True),
        whole(result.slip, traction=False),
        patch.whole(stick) > 0.0,
        solution.plan.copies,
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
