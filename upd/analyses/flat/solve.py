"""Quasi-static contact of a damper's flat faces on a platform. Arrays in, arrays out.

All fields are those of the model's contact nodes, (n,); mirror symmetry may make the model a half of the whole, which loads and
stiffnesses are those of.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.plan import NORMAL, ContactPlan
from upd.analyses.flat.plan import NormalLoad, component, normal_loads
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact, normal_curve
from upd.contact.tangential import TangentialPath, tangential_path
from upd.contact.tilt import TiltedContact, tilted_contact
from upd.progress import Stages

Array = NDArray[np.float64]

#: shares of mu N of the force-displacement curve: even steps, then closer to gross slip
_PATH = np.concatenate([np.linspace(0.05, 0.9, 18), [0.93, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999]])


@dataclass
class NormalCase:
    """One normal load on the whole contact in N, its answer, and the approach in mm that each body takes (energy shares)."""

    load: NormalLoad
    solution: NormalContact
    tilted: TiltedContact | None
    stiffness: float
    approach_of: dict[str, float]
    displacement: dict[str, Array] = field(default_factory=dict)
    reaction: dict[str, float] = field(default_factory=dict)

    @property
    def force(self) -> float:
        return self.load.force

    @property
    def label(self) -> str:
        return self.load.label

    @property
    def n_open(self) -> int:
        return int((~self.solution.contact).sum())


@dataclass(frozen=True)
class Stuck:
    """Tangential stiffness in N/mm with every node of the contact set stuck: both bodies, each alone, and the nodal field (n,)."""

    total: float
    of: dict[str, float]
    nodal: Array


@dataclass
class TangentialCase:
    """One tangential load T = ratio mu N in a direction (degrees from x), after one normal load. Traction and slip (n, 1 or 2)."""

    normal: NormalCase
    direction: float
    ratio: float
    load: float
    displacement: float
    stiffness: float
    force: Array
    slip: Array
    stick: NDArray[np.bool_]

    @property
    def label(self) -> str:
        return f"{self.normal.label} T_{direction_name(self.direction)}/muN={self.ratio:g}"


@dataclass
class Path:
    """Tangential force in N over displacement in mm along one direction; a full cycle when ``cycle``, with its slip work in N mm."""

    normal: NormalCase
    direction: float
    load: Array
    displacement: Array
    cycle: bool = False
    slip_work: float = 0.0
    loop_area: float = 0.0

    @property
    def label(self) -> str:
        return f"{self.normal.label} T_{direction_name(self.direction)}"


@dataclass
class FlatSolution:
    """All that was solved, for rows, figures and files. ``bonded`` is the normal stiffness in N/mm when no node may open."""

    plan: ContactPlan
    model: ContactModel
    bonded: float = 0.0
    normal: list[NormalCase] = field(default_factory=list)
    curve: list[tuple[float, NormalContact]] = field(default_factory=list)
    stuck: dict[tuple[str, float], Stuck] = field(default_factory=dict)
    tangential: list[TangentialCase] = field(default_factory=list)
    paths: list[Path] = field(default_factory=list)
    transverse: dict[tuple[str, float], float] = field(default_factory=dict)
    moved: dict[tuple[str, float], float] = field(default_factory=dict)


def direction_name(direction: float) -> str:
    """x, y or the angle."""
    return {0.0: "x", 90.0: "y"}.get(direction % 360.0, f"{direction:g}deg")


def solve(plan: ContactPlan, stages: Stages) -> FlatSolution:
    """Run everything the plan calls for. An error raised on the way carries what converged so far as ``partial``."""
    solution = FlatSolution(plan, prepare(plan, stages))
    try:
        _normal(solution, stages)
        if plan.effect("friction"):
            _tangential(solution, stages)
        if plan.scene.wants("fields"):
            with stages("internal displacement", "back-substitution"):
                for case in solution.normal:
                    _internal(solution, case)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def contact_points_of(model: ContactModel) -> Array:
    """(n, 3) the contact nodes that carry forces, in contact axes, mm."""
    points: Array = model.lower.mesh.points[model.lower.contact[model.multipliers.nodes]]
    return points


def load_point(solution: FlatSolution) -> Array:
    """(2,) where the load line meets the contact plane, contact axes in mm."""
    scene, upper = solution.plan.scene, solution.model.upper
    if scene.contact.load_point is not None:
        low: Array = contact_points_of(solution.model)[:, :2].min(axis=0)
        return np.asarray(low + np.array(scene.contact.load_point))
    nodes = upper.mesh.points[upper.mesh.nodes["distant"], :2]
    # Middle of the set's extent: its nodes need not be evenly spread.
    middle = 0.5 * (nodes.min(axis=0) + nodes.max(axis=0))
    return np.asarray(middle if 0 not in solution.plan.mirrors else middle * np.array([0.0, 1.0]))


def _normal(solution: FlatSolution, stages: Stages) -> None:
    plan, model = solution.plan, solution.model
    scene, copies = plan.scene, plan.copies
    loads = normal_loads(scene)
    C = model.compliance(NORMAL)
    curve = _curve_loads(plan, max(load.force for load in loads))
    with stages("normal contact", f"{len(loads) + len(curve)} loads"):
        # Nothing opened: a start from all nodes is then the answer after one linear solve.
        solution.bonded = copies * float(cho_solve(cho_factor(C), np.ones(len(C))).sum())
        if scene.contact.tilt == "free":
            arms = contact_points_of(model)[:, :2] - load_point(solution)
            tilted = {F: tilted_contact(C, model.gap, arms, load=F / copies) for F in dict.fromkeys([ld.force for ld in loads] + curve)}
            answers = {F: t.normal for F, t in tilted.items()}
        else:
            tilted = {}
            forces = sorted({*(load.force for load in loads), *curve})
            answers = dict(zip(forces, normal_curve(C, model.gap, [F / copies for F in forces]), strict=True))
        solution.normal = [_normal_case(solution, load, answers[load.force], tilted.get(load.force)) for load in loads]
        solution.curve = [(F, answers[F]) for F in curve]


def _curve_loads(plan: ContactPlan, largest: float) -> list[float]:
    loads = plan.scene.loads
    if not plan.effect("load curve"):
        return []
    top = largest if loads.curve_to is None else loads.curve_to
    return [top * k / loads.curve_points for k in range(1, loads.curve_points + 1)]


def _normal_case(solution: FlatSolution, load: NormalLoad, answer: NormalContact, tilted: TiltedContact | None) -> NormalCase:
    model, f = solution.model, answer.force
    total = float(f.sum())
    # f . (h + C f - d e) = 0, so the approach is the sum of the bodies' energies over the load (and of the gaps closed).
    shares = {b.name: float(f @ model.body_compliance(b, NORMAL) @ f) / total if total else 0.0 for b in (model.upper, model.lower)}
    stiffness = tilted.free_stiffness if tilted is not None else answer.stiffness
    return NormalCase(load, answer, tilted, solution.plan.copies * stiffness, shares)


def _tangential(solution: FlatSolution, stages: Stages) -> None:
    scene = solution.plan.scene
    names = ", ".join(direction_name(d) for d in scene.loads.directions)
    with stages("tangential contact", f"{len(solution.normal)} normal loads, directions {names}"):
        for case in solution.normal:
            loaded = np.flatnonzero(case.solution.force > 0.0)
            if not loaded.size:
                continue
            for direction in scene.loads.directions:
                _sheared(solution, case, direction, loaded)


def _sheared(solution: FlatSolution, case: NormalCase, direction: float, loaded: NDArray[np.int64]) -> None:
    """Stiffness, single loads, curve and cycle of one direction after one normal load."""
    scene, copies = solution.plan.scene, solution.plan.copies
    components = (0, 1) if scene.contact.directions == 2 else (_axis(direction),)
    unit = np.array([np.cos(np.radians(direction)), np.sin(np.radians(direction))])[list(components)]
    C = _block(solution.model, components, loaded)
    limit = scene.contact.friction * case.solution.force[loaded]
    total = float(limit.sum())

    def vector(values: Array) -> Any:
        return np.outer(values, unit) if len(components) == 2 else values

    stuck = _stuck(solution, C, components, unit, loaded)
    solution.stuck[case.label, direction] = stuck
    if scene.wants("tangential"):
        ratios = np.unique(np.concatenate([_PATH, scene.loads.tangential]))
        path = tangential_path(C, limit, loads=vector(ratios * total))
        solution.paths.append(Path(case, direction, *_along(path, unit, copies)))
        for ratio in scene.loads.tangential:
            k = int(np.searchsorted(ratios, ratio))
            solution.tangential.append(_tangential_case(solution, case, direction, ratio, path, k, loaded, unit))
    if scene.wants("cycle"):
        solution.paths.append(_cycle(solution, case, direction, C, limit, vector, unit))
    if len(components) == 1:
        solution.transverse[case.label, direction] = _transverse(solution, components[0], stuck)
    moved = _moved(solution, case, components, unit, stuck, total)
    if moved is not None:
        solution.moved[case.label, direction] = moved


def _axis(direction: float) -> int:
    found = component(direction)
    assert found is not None
    return found


def _block(model: ContactModel, components: tuple[int, ...], loaded: NDArray[np.int64], body: Body | None = None) -> Array:
    pick = np.ix_(loaded, loaded)

    def one(i: int, j: int) -> Array:
        return (model.compliance(i, j) if body is None else model.body_compliance(body, i, j))[pick]

    return np.block([[one(i, j) for j in components] for i in components])


def _stuck(solution: FlatSolution, C: Array, components: tuple[int, ...], unit: Array, loaded: NDArray[np.int64]) -> Stuck:
    """The contact set stuck and moved by one along ``unit``: T = e' C^-1 e; a body's share of the motion is t' C_b t / T."""
    model, copies, n = solution.model, solution.plan.copies, len(loaded)
    e = np.repeat(unit, n)
    t = cho_solve(cho_factor(C), e)
    total = float(e @ t)
    of = {b.name: copies * total**2 / float(t @ _block(model, components, loaded, b) @ t) for b in (model.upper, model.lower)}
    nodal = np.zeros(len(model.gap))
    nodal[loaded] = t.reshape(len(components), n).T @ unit
    return Stuck(copies * total, of, nodal)


def _tangential_case(
    solution: FlatSolution,
    case: NormalCase,
    direction: float,
    ratio: float,
    path: TangentialPath,
    step: int,
    loaded: NDArray[np.int64],
    unit: Array,
) -> TangentialCase:
    n, copies = len(solution.model.gap), solution.plan.copies

    def spread(values: Array) -> Array:
        out = np.zeros((n, len(unit)))
        out[loaded] = values.reshape(len(unit), len(loaded)).T
        return out

    stick = np.zeros(n, bool)
    stick[loaded] = path.state[step] == 0
    moved = float(np.atleast_1d(path.displacement[step]) @ unit)
    K = np.atleast_2d(path.stiffness[step])
    # Stiffness along the load while the motion across it stays free to follow.
    stiffness = 1.0 / float(unit @ np.linalg.pinv(K, hermitian=True) @ unit) if K.any() else 0.0
    load = ratio * solution.plan.scene.contact.friction * case.force
    return TangentialCase(case, direction, ratio, load, moved, copies * stiffness, spread(path.force[step]), spread(path.slip[step]), stick)


def _along(path: TangentialPath, unit: Array, copies: int) -> tuple[Array, Array]:
    """Load of the whole contact in N and displacement in mm along the direction, from zero on."""
    load, moved = (np.asarray(v).reshape(len(path.load), len(unit)) @ unit for v in (path.load, path.displacement))
    return np.concatenate([[0.0], copies * load]), np.concatenate([[0.0], moved])


def _cycle(solution: FlatSolution, case: NormalCase, direction: float, C: Array, limit: Array, vector: Any, unit: Array) -> Path:
    """First loading to +T*, then the closed loop +T* -> -T* -> +T*."""
    loads, copies = solution.plan.scene.loads, solution.plan.copies
    quarter = max(2, loads.cycle_steps // 5)
    half = (loads.cycle_steps - quarter) // 2
    legs = [np.linspace(0.0, 1.0, quarter + 1), np.linspace(1.0, -1.0, half + 1), np.linspace(-1.0, 1.0, half + 1)]
    steps = np.concatenate([leg[1:] for leg in legs])
    path = tangential_path(C, limit, loads=vector(loads.cycle_amplitude * float(limit.sum()) * steps))
    T, d = _along(path, unit, copies)
    area = abs(float(np.trapezoid(T[quarter:], d[quarter:])))
    return Path(case, direction, T, d, True, copies * float(np.sum(path.slip_work[quarter:])), area)


def _transverse(solution: FlatSolution, component: int, stuck: Stuck) -> float:
    """Motion across a load that slip in one direction leaves out, over that along it: largest at the nodes, all of them stuck."""
    model = solution.model
    nodal = model.nodal(stuck.nodal)
    across = sum(body.displacement(component, nodal)[body.contact, 1 - component] for body in (model.upper, model.lower))
    return float(np.abs(across).max())


def _moved(solution: FlatSolution, case: NormalCase, components: tuple[int, ...], unit: Array, stuck: Stuck, total: float) -> float | None:
    """How far shear with T = mu N would change the normal forces that are frozen: sum |df| / 2 N over the nodes kept in contact.

    The tangential forces t open or close the contact by C_nt t; kept closed at the same load, the normal forces change by
    df = -C_nn^-1 (C_nt t - d e), e'df = 0.
    """
    model = solution.model
    if not any(NORMAL in f.components and set(components) <= set(f.components) for f in solution.plan.families):
        return None
    on = np.flatnonzero(case.solution.contact)
    t = stuck.nodal * (total / float(stuck.nodal.sum()))
    opened = sum((u * (model.compliance(NORMAL, c) @ t) for c, u in zip(components, unit, strict=True)), np.zeros(len(t)))[on]
    factor = cho_factor(model.compliance(NORMAL)[np.ix_(on, on)])
    e = cho_solve(factor, np.ones(len(on)))
    df = -cho_solve(factor, opened)
    df -= e * (df.sum() / e.sum())
    return float(np.abs(df).sum() / (2.0 * case.solution.force.sum()))


def _internal(solution: FlatSolution, case: NormalCase) -> None:
    model, plan = solution.model, solution.plan
    forces = model.nodal(case.solution.force)
    for body in (model.upper, model.lower):
        u = body.displacement(NORMAL, body.side * forces)
        case.displacement[body.name] = u
        case.reaction[body.name] = -body.side * plan.copies * body.reaction(u, NORMAL)
