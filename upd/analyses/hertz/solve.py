"""Quasi-static contact of two bodies: mesh, stiffness, condensation, normal contact, tangential contact. Arrays in, arrays out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve as solve_dense

from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.plan import ALONG, NORMAL, ContactPlan
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact, normal_curve
from upd.contact.patch import ContactMeasures, measure
from upd.contact.stiffness import BodyShare, axis_half_space, body_share
from upd.contact.tangential import TangentialContact, TangentialPath, tangential_contact, tangential_path
from upd.errors import MeshError
from upd.progress import Stages
from upd.reference import contact_modulus
from upd.results import Case

Array = NDArray[np.float64]
#: (name, case) -> estimated relative error, predicted seconds of half that error.
Estimates = dict[tuple[str, Case], tuple[float, float]]

# Relative step of load over which the tangent stiffness is taken; the curvature of Hertz's F ~ d^(3/2) makes it 0.074 _STEP^2 too soft.
_STEP = 0.1


@dataclass
class NormalCase:
    """One normal load: forces in N, gaps in mm, pressure in MPa on the whole patch, (len(X), len(Y)).

    ``solution`` is that of the model, which mirror symmetry may make a part of the whole.
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

    @property
    def approach(self) -> float:
        return self.solution.approach

    @property
    def label(self) -> str:
        return f"F={self.load:g} N"


@dataclass
class TangentialCase:
    """One tangential load T = ratio mu N after one normal load.

    Traction in MPa and slip in mm on the whole patch, (len(X), len(Y)), with a last axis of 2 for two directions.
    """

    normal: NormalCase
    ratio: float
    load: float
    solution: TangentialContact
    traction: Array
    slip: Array
    stick: NDArray[np.bool_]
    copies: int

    @property
    def stiffness(self) -> float:
        """Tangent dT/dd along the load in N/mm of the whole contact, at the present stick set."""
        value = np.asarray(self.solution.stiffness)
        return self.copies * float(value if value.ndim == 0 else value[0, 0])

    @property
    def label(self) -> str:
        return f"{self.normal.label} T/muN={self.ratio:g}"


@dataclass
class Cycle:
    """A full tangential cycle after one normal load: load in N and displacement in mm per step, work in N mm."""

    normal: NormalCase
    ratio: float
    load: Array
    displacement: Array
    slip_work: float
    loop_area: float

    @property
    def label(self) -> str:
        return f"{self.normal.label} T/muN={self.ratio:g}"


@dataclass
class HertzSolution:
    """All that was solved, for rows, figures and files."""

    plan: ContactPlan
    model: ContactModel
    modulus: float
    normal: list[NormalCase] = field(default_factory=list)
    curve: list[tuple[float, float]] = field(default_factory=list)
    tangential: list[TangentialCase] = field(default_factory=list)
    tangential_stiffness: dict[float, float] = field(default_factory=dict)
    tangential_shares: dict[float, dict[str, BodyShare]] = field(default_factory=dict)
    transverse: dict[float, float] = field(default_factory=dict)
    cycles: list[Cycle] = field(default_factory=list)
    no_shares: str = ""
    estimates: Estimates = field(default_factory=dict)


def solve_plan(plan: ContactPlan, stages: Stages) -> HertzSolution:
    """Run everything the plan calls for. An UpdError raised on the way carries what converged so far as ``partial``."""
    model = prepare(plan, stages)
    m1, m2 = (plan.scene.materials[b.name] for b in (model.upper, model.lower))
    solution = HertzSolution(plan, model, contact_modulus(m1.E, m1.nu, m2.E, m2.nu))
    try:
        _normal(solution, stages)
        if plan.effect("friction"):
            _tangential(solution, stages)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def _normal(solution: HertzSolution, stages: Stages) -> None:
    plan, model = solution.plan, solution.model
    loads = plan.scene.loads
    largest = max(loads.forces)
    # Points evenly spaced in approach by Hertz's F ~ d^(3/2).
    wanted = [largest * s**1.5 for s in np.linspace(0.0, 1.0, loads.curve_points + 1)[1:]] if plan.effect("load curve") else []
    # The slope of the curve between loads a little below and above: at one contact set it moves in steps as nodes come into contact.
    around = [F * (1.0 + s) for F in loads.forces for s in (-_STEP, _STEP)] if plan.scene.wants("stiffness") else []
    forces = sorted({*loads.forces, *wanted, *around})
    with stages("normal contact", f"{len(forces)} loads"):
        found = normal_curve(model.compliance(NORMAL), model.gap, [F / plan.copies for F in forces])
        results = dict(zip(forces, found, strict=True))
        solution.normal = [_normal_case(solution, F, results[F]) for F in loads.forces]
        for case in solution.normal:
            if around and case.load > 0.0:
                low, high = (results[case.load * (1.0 + s)] for s in (-_STEP, _STEP))
                case.stiffness = 2.0 * _STEP * case.load / (high.approach - low.approach)
        if wanted and largest > 0.0:
            solution.curve = [(float(model.gap.min()), 0.0), *((results[F].approach, F) for F in wanted)]
    if plan.effect("internal displacement"):
        with stages("internal displacement", "back-substitution"):
            for case in solution.normal:
                _internal_normal(solution, case)


def _normal_case(solution: HertzSolution, load: float, result: NormalContact) -> NormalCase:
    patch, copies = solution.model.patch, solution.plan.copies
    force = patch.whole(result.force, extensive=True)
    gap = patch.whole(result.gap)
    return NormalCase(load, result, force, gap, force / patch.area(), measure(patch, force), copies * result.stiffness)


def _internal_normal(solution: HertzSolution, case: NormalCase) -> None:
    model, plan = solution.model, solution.plan
    forces = model.nodal(case.solution.force)
    for body in (model.upper, model.lower):
        u = body.displacement(NORMAL, body.side * forces)
        case.displacement[body.name] = u
        case.reaction[body.name] = -body.side * plan.copies * body.reaction(u, NORMAL)
        if case.load > 0.0 and plan.scene.sphere_radius is not None:
            share = _share(solution, body, body.side * u[:, 2], case.force, case.measures.radius_moment, tangential=False)
            if share is not None:
                case.shares[body.name] = share
    if len(case.shares) < 2:
        case.shares.clear()


def _share(solution: HertzSolution, body: Body, along: Array, force: Array, radius: float, *, tangential: bool) -> BodyShare | None:
    axis = body.mesh.nodes["axis"]
    depth = np.abs(body.mesh.points[axis, 2])
    patch = solution.model.patch
    X, Y = np.meshgrid(patch.X, patch.Y, indexing="ij")
    data = solution.plan.scene.materials[body.name]
    inside = depth > 0.5 * radius
    half_space = np.zeros(len(depth))
    half_space[inside] = axis_half_space(
        depth[inside], np.column_stack([X.ravel(), Y.ravel()]), force.ravel(), data.E, data.nu, tangential=tangential
    )
    try:
        return body_share(depth, along[axis], half_space, radius)
    except MeshError as error:
        # The numbers with the bodies taken off are left out, the others stand.
        solution.no_shares = f"{body.name}: {error}"
        return None


def _tangential(solution: HertzSolution, stages: Stages) -> None:
    plan, model = solution.plan, solution.model
    scene = plan.scene
    mu, copies = scene.contact.friction, plan.copies
    components = next(f.components for f in plan.families if ALONG in f.components)
    directions = tuple(c for c in components if c != NORMAL)
    with stages("tangential contact", f"{len(solution.normal)} normal loads"):
        for case in solution.normal:
            limit = mu * case.solution.force
            loaded = np.flatnonzero(limit > 0.0)
            if not loaded.size:
                continue
            C = _tangential_compliance(model, directions, loaded)
            total = mu * case.load
            two = len(directions) == 2

            def vector(value: float, two: bool = two) -> Any:
                return np.array([value, 0.0]) if two else value

            if scene.wants("stiffness"):
                solution.tangential_stiffness[case.load] = copies * _stuck_stiffness(C, len(loaded))
            if scene.wants("tangential"):
                for ratio in scene.loads.tangential:
                    result = tangential_contact(C, limit[loaded], load=vector(ratio * total / copies))
                    solution.tangential.append(_tangential_case(solution, case, ratio, result, loaded))
            if scene.wants("cycle"):
                solution.cycles.append(_cycle(solution, case, C, limit[loaded], two))
    if plan.effect("internal displacement"):
        with stages("internal displacement", "back-substitution"):
            for case in solution.normal:
                _internal_tangential(solution, case)


def _stuck_stiffness(C: Array, n: int) -> float:
    """Tangential stiffness of the model in N/mm along x with every node stuck: e' C^-1 e."""
    e = np.zeros(len(C))
    e[:n] = 1.0
    return float(e @ solve_dense(C, e, assume_a="pos"))


def _tangential_compliance(model: ContactModel, directions: tuple[int, ...], loaded: NDArray[np.int64]) -> Array:
    pick = np.ix_(loaded, loaded)
    return np.block([[model.compliance(i, j)[pick] for j in directions] for i in directions])


def _tangential_case(
    solution: HertzSolution, case: NormalCase, ratio: float, result: TangentialContact, loaded: NDArray[np.int64]
) -> TangentialCase:
    patch = solution.model.patch
    n = len(patch.order)

    def whole(values: Array, extensive: bool) -> Array:
        parts = []
        for part in values.reshape(-1, len(loaded)):
            full = np.zeros(n)
            full[loaded] = part
            parts.append(patch.whole(full, extensive=extensive))
        return np.stack(parts, -1) if len(parts) > 1 else parts[0]

    area = patch.area()
    force = whole(result.force, True)
    traction = force / (area[..., None] if force.ndim == 3 else area)
    stick = np.zeros(n, bool)
    stick[loaded] = result.stick
    load = ratio * solution.plan.scene.contact.friction * case.load
    return TangentialCase(case, ratio, load, result, traction, whole(result.slip, False), patch.whole(stick) > 0.0, solution.plan.copies)


def _cycle(solution: HertzSolution, case: NormalCase, C: Array, limit: Array, two: bool) -> Cycle:
    """First loading to +T*, then the closed loop +T* -> -T* -> +T*."""
    plan = solution.plan
    loads = plan.scene.loads
    quarter = max(2, loads.cycle_steps // 5)
    half = (loads.cycle_steps - quarter) // 2
    peak = loads.cycle_amplitude * plan.scene.contact.friction * case.load / plan.copies
    steps = np.concatenate(
        [np.linspace(0.0, 1.0, quarter + 1)[1:], np.linspace(1.0, -1.0, half + 1)[1:], np.linspace(-1.0, 1.0, half + 1)[1:]]
    )
    history = peak * steps
    path: TangentialPath = tangential_path(C, limit, loads=np.column_stack([history, 0.0 * history]) if two else history)
    displacement = np.asarray(path.displacement)
    along = displacement[:, 0] if displacement.ndim == 2 else displacement
    T, d = plan.copies * history, along
    loop = slice(quarter - 1, None)
    area = abs(float(np.trapezoid(T[loop], d[loop])))
    work = plan.copies * float(np.sum(path.slip_work[quarter:]))
    return Cycle(case, loads.cycle_amplitude, np.concatenate([[0.0], T]), np.concatenate([[0.0], d]), work, area)


def _internal_tangential(solution: HertzSolution, case: NormalCase) -> None:
    """Shear of both bodies per N, and the motion across the load that one tangential direction leaves out.

    Both from full slip, t = mu f: the far field of a body knows the total force only, and the transverse motion is largest there
    (about nu / (4 - 2 nu) of the motion along the load, K. L. Johnson, Contact Mechanics, 1985, section 7.2).
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
    relative = np.zeros((len(model.upper.contact), 2))
    for body in (model.upper, model.lower):
        u = body.displacement(ALONG, nodal)
        relative += u[body.contact, :2]
        if plan.scene.sphere_radius is not None:
            share = _share(solution, body, u[:, 0], whole, case.measures.radius_moment, tangential=True)
            if share is not None:
                shares[body.name] = BodyShare(share.compression / total, share.finite_body / total)
    if len(shares) == 2:
        solution.tangential_shares[case.load] = shares
    along, across = (np.asarray(model.multipliers.spread.T @ relative[:, k])[loaded] for k in (0, 1))
    if np.ptp(along) > 0.0:
        solution.transverse[case.load] = float(np.abs(across).max() / np.ptp(along))
