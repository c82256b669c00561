"""What a run of a contact finds: its normal loads, its tangential loads, all of it; and loads after
loads of two condensed bodies, with normal and tangential contact at once.

Fields are those of the model's contact nodes, (n,); mirror symmetry may make the model a part of
the whole, which loads and stiffnesses are those of. It knows what Hertz, Cattaneo and Mindlin have
for the loads of a sphere on a plane.

The normal load rises without a tangential one; the tangential loads follow it. Friction remembers
its way: every state of coupled contact starts from the one before.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact.plan import (
    ACROSS,
    ALONG,
    COMPONENTS,
    NORMAL,
    ContactPlan,
    direction_name,
    is_curved,
)
from upd.contact.bulk import BodyShare
from upd.contact.coulomb_conditions import STICK
from upd.contact.coupled import CoupledContact, coupled_contact
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact
from upd.contact.patch import ContactMeasures, Patch, located_area, measure
from upd.errors import ConvergenceError
from upd.reference import (
    HertzPoint,
    contact_modulus,
    hertz_axial_displacement,
    hertz_sphere,
    mindlin,
    tangential_compliance_modulus,
)
from upd.results import Case, Estimates
from upd.results import quantities as q

Array = NDArray[np.float64]
#: Relative step of load on both sides of a load over which a slope of the force-approach curve is
#: taken; the curvature of Hertz's F ~ d^(3/2) makes it 0.074 LOAD_STEP^2 too soft.
LOAD_STEP = 0.1
#: Steps in which a normal load rises from nothing, at least.
NORMAL_STEPS = 8
#: name of a number -> its closed form in mm, N, and the source
References = dict[str, tuple[float | None, str]]
_HERTZ, _MINDLIN = "Hertz", "Cattaneo-Mindlin"


@dataclass(frozen=True)
class LoadPath:
    """Tangential force over displacement after one normal load, of the whole contact.

    Attributes
    ----------
    case
        Of the normal load, with the direction.
    load, displacement
        (n_step,) N and mm along the load, from zero on.
    cycle
        First loading to +T*, then the closed loop +T* -> -T* -> +T*; otherwise first loading only.
    slip_work, loop_area
        N mm over the closed loop.
    most_work
        Slip work of the loop that has most, N mm: of coupled contact it may fade from loop to loop
        (shakedown).
    """

    case: Case
    load: Array
    displacement: Array
    cycle: bool = False
    slip_work: float = 0.0
    loop_area: float = 0.0
    most_work: float = 0.0


@dataclass(frozen=True)
class Sheared:
    """What a tangential load step left at the n loaded nodes, unprocessed: for checks.

    Vectors are (n,), or (2 n,) with x dofs first.

    Attributes
    ----------
    components
        Of the load, one per n entries of a vector.
    loaded
        (n,) contact nodes that carry a normal force.
    limit
        (n,) mu times the normal force, N.
    force
        Tractions in N, before they were brought inside their limits.
    before
        Slip before the step, mm.
    displacement, load
        (1 or 2,) mm, and N on the model.
    stick
        (n,) which nodes stick.
    terms
        Size of what ``before`` was summed from where that is more than a slip, mm.
    """

    components: tuple[int, ...]
    loaded: NDArray[np.int64]
    limit: Array
    force: Array
    before: Array
    displacement: Array
    load: Array
    stick: NDArray[np.bool_]
    terms: Array | float = 0.0


@dataclass
class NormalCase:
    """One normal load on the whole contact, of both bodies or of one pressed by a rigid
    counterpart.

    Attributes
    ----------
    force
        N on the whole contact.
    solution
        Its approach is that of the distant sets.
    stiffness
        Tangent normal stiffness of the whole contact, N/mm.
    measures
        Size and pressure of the contact.
    coupled
        With normal and tangential contact at once, the load steps that end in it.
    tilt
        (2,) free tilts in rad; None where they are held.
    alone
        By body: its answer at the same load, pressed by a rigid counterpart, where a stiffness
        calls for it.
    stuck
        By direction in degrees: tangential stiffness in N/mm of the contact set stuck, and that of
        each body stuck to a rigid counterpart, by its own contact set; with normal and tangential
        contact at once of a small load in that direction.
    displacement, reaction
        By body: (n_node, 3) mm, N on its distant set.
    shares, shear_shares
        By body: its share of the approach, and of the tangential displacement in mm per N.
    mesh_error
        Estimated error of the approach by the mesh near the contact and far from it, mm; None
        where the shares are not known.
    """

    force: float
    solution: NormalContact
    stiffness: float
    measures: ContactMeasures
    coupled: CoupledContact | None = None
    tilt: Array | None = None
    alone: dict[str, NormalCase] = field(default_factory=dict)
    stuck: dict[float, tuple[float, dict[str, float]]] = field(default_factory=dict)
    displacement: dict[str, Array] = field(default_factory=dict)
    reaction: dict[str, float] = field(default_factory=dict)
    shares: dict[str, BodyShare] = field(default_factory=dict)
    shear_shares: dict[str, float] = field(default_factory=dict)
    mesh_error: tuple[float, float] | None = None

    @property
    def case(self) -> Case:
        """The load, with as many digits as distinguish the scene's loads."""
        return Case(load=self.force)

    @property
    def stick(self) -> NDArray[np.bool_]:
        """(n,) nodes that stick without a tangential load: all in contact, if pressure does not
        shear.
        """
        return self.solution.contact if self.coupled is None else self.coupled.state[-1] == STICK

    @property
    def finite_body(self) -> float:
        """What the finite bodies add to the approach, mm."""
        return sum(s.finite_body for s in self.shares.values())

    @property
    def finite_body_shear(self) -> float:
        """What the finite bodies add to the tangential displacement, mm per N."""
        return sum(self.shear_shares.values())


@dataclass
class TangentialCase:
    """One tangential load T = ratio mu N in a direction, after one normal load.

    Displacement in mm along it, and tangent dT/dd in N/mm of the whole contact at the present stick
    set. Force in N and slip in mm, (n, 1 or 2), normal forces under it (n,); what the solver left
    at the nodes, for checks, and with normal and tangential contact at once the load steps up to
    it.
    """

    normal: NormalCase
    case: Case
    load: float
    displacement: float
    stiffness: float
    force: Array
    slip: Array
    nodes: Sheared
    coupled: CoupledContact | None = None

    @property
    def pressed(self) -> Array:
        """(n,) normal forces under it, N."""
        coupled = self.coupled
        return self.normal.solution.force if coupled is None else coupled.force[-1, :, 0]

    @property
    def stick(self) -> NDArray[np.bool_]:
        """(n,) nodes that stick."""
        out = np.zeros(len(self.pressed), bool)
        out[self.nodes.loaded] = self.nodes.stick
        return out


@dataclass
class ContactSolution:
    """All that was solved.

    Attributes
    ----------
    curve
        Loaded points of the force-approach curve, N and mm.
    paths
        Tangential force over displacement, cycles among them.
    no_shares
        Why the bodies' shares of the approach are not known.
    left_out
        Numbers solved again with effects left out.
    estimates
        Errors of the numbers, where the mesh was chosen by an accuracy.
    """

    plan: ContactPlan
    model: ContactModel
    normal: list[NormalCase] = field(default_factory=list)
    curve: list[tuple[float, float]] = field(default_factory=list)
    tangential: list[TangentialCase] = field(default_factory=list)
    paths: list[LoadPath] = field(default_factory=list)
    no_shares: str = ""
    left_out: list[Resolved] = field(default_factory=list)
    estimates: Estimates | None = None

    @property
    def curved(self) -> bool:
        """Whether the faces are curved."""
        return is_curved(self.plan.scene)

    @property
    def modulus(self) -> float:
        """Contact modulus E*, MPa."""
        m1, m2 = (self.plan.scene.materials[b.name] for b in (self.model.upper, self.model.lower))
        return contact_modulus(m1.E, m1.nu, m2.E, m2.nu)

    def sheared_case(
        self, normal: NormalCase, direction: float, ratio: float | None = None
    ) -> Case:
        """A normal load with a tangential one; a curved contact has one direction."""
        name = "" if self.curved else direction_name(direction)
        return replace(normal.case, direction=name, ratio=ratio)

    @property
    def lattices(self) -> dict[str, Patch]:
        """The patches of the whole contact by name, from left to right, mirror images included."""
        found = dict(self.model.patches)
        if 0 in self.plan.mirrors:
            found |= {
                {"right": "left"}.get(name, f"{name} mirrored"): patch.image()
                for name, patch in self.model.patches.items()
                if not patch.mirrored[0]
            }
        return dict(sorted(found.items(), key=lambda item: float(item[1].X.min())))

    @property
    def corner(self) -> Array:
        """(2,) origin of the axes that fields are reported in, contact axes in mm: of a curved
        contact the same, of flat faces the bottom left corner of all patches together, x along the
        damper, y up the slope, as in the source thesis.
        """
        if self.curved:
            return np.zeros(2)
        found = self.lattices.values()
        return np.array([min(k.X.min() for k in found), min(k.Y.min() for k in found)])

    def area_of(self, nodes: NDArray[np.bool_]) -> float:
        """Tributary area of nodes (n,) on the whole contact, mm2."""
        return sum(float(k.area()[k.whole(nodes) > 0.0].sum()) for k in self.lattices.values())

    def tractions(self, t: TangentialCase) -> list[Array]:
        """(n,) traction at the nodes in MPa, direction by direction."""
        loaded = t.pressed > 0.0
        return [self.model.multipliers.pressure(force, loaded) for force in t.force.T]

    def rim_nodes(self, case: NormalCase) -> int:
        """How many nodes of the rim of a curved contact's patch carry force."""
        patch = self.model.patch
        return int((patch.whole(case.solution.force).ravel()[patch.rim()] > 0.0).sum())

    # -- closed forms of a sphere on a plane -----------------------------------------------------

    def hertz_of(self, load: float) -> HertzPoint[float] | None:
        """Closed form of a normal load in N, or None when the scene has none."""
        radius = self.plan.scene.sphere_radius
        return None if radius is None or load <= 0.0 else hertz_sphere(load, radius, self.modulus)

    def shear_compliance(self) -> float:
        """C = (2 - nu1)/G1 + (2 - nu2)/G2 in 1/MPa."""
        m1, m2 = (self.plan.scene.materials[b.name] for b in (self.model.upper, self.model.lower))
        return tangential_compliance_modulus(m1.E, m1.nu, m2.E, m2.nu)

    def stick_radius(self, case: TangentialCase) -> float | None:
        """Cattaneo and Mindlin's radius of the stick zone in mm, or None without a closed form."""
        hertz, N = self.hertz_of(case.normal.force), case.normal.force
        mu = self.plan.scene.contact.friction
        return (
            None if hertz is None else float(mindlin.stick_radius(case.load, mu, N, hertz.radius))
        )

    def closed_form_traction(self, case: TangentialCase) -> Callable[[Array], Array] | None:
        """Cattaneo and Mindlin's traction in MPa over the distance from the centre, mm."""
        hertz, c = self.hertz_of(case.normal.force), self.stick_radius(case)
        if hertz is None or c is None or case.load <= 0.0:
            return None
        mu, N = self.plan.scene.contact.friction, case.normal.force
        return lambda r: mindlin.traction(r, hertz.radius, c, mu, N)

    def _within_3a(self, hertz: HertzPoint[float]) -> float:
        """Hertz's approach less the displacement of both half-spaces at depth 3a, mm."""
        within, a, p0 = hertz.approach, hertz.radius, hertz.max_pressure
        for body in (self.model.upper, self.model.lower):
            data = self.plan.scene.materials[body.name]
            within -= float(hertz_axial_displacement(3.0 * a, a, p0, data.E, data.nu))
        return within

    def normal_references(self, case: NormalCase) -> References:
        """Closed forms of the numbers of a normal load, of its stiffnesses and of a cycle after it;
        empty without them.
        """
        hertz, F = self.hertz_of(case.force), case.force
        if hertz is None:
            return {}
        C, within = self.shear_compliance(), self._within_3a(hertz)
        K_T, K_N = mindlin.initial_tangential_stiffness(hertz.radius, C), hertz.tangent_stiffness
        by_hertz = (
            (hertz.radius, (q.RADIUS_MOMENT, q.RADIUS_AREA, q.RADIUS_OUTERMOST)),
            (hertz.approach, (q.APPROACH, q.APPROACH_CONTACT)),
            (hertz.area, (q.CONTACT_AREA, q.CONTACT_AREA_NODES)),
            (hertz.max_pressure, (q.MAX_PRESSURE,)),
            (hertz.mean_pressure, (q.MEAN_PRESSURE,)),
            (K_N, (q.K_N_TANGENT_RAW, q.K_N_TANGENT)),
            (hertz.secant_stiffness, (q.K_N_SECANT_RAW, q.K_N_SECANT)),
        )
        out: References = {
            one.name: (float(value), _HERTZ) for value, alike in by_hertz for one in alike
        }
        scene = self.plan.scene
        if self.plan.effect("friction"):
            amplitude, mu = scene.loads.cycle_amplitude, scene.contact.friction
            energy = float(mindlin.cycle_energy(amplitude, mu, F, hertz.radius, C))
            out[q.CYCLE_ENERGY.name] = energy, "Mindlin-Deresiewicz"
        return out | {
            q.APPROACH_WITHIN_3A.name: (within, "Hertz, within 3a"),
            q.K_N_TANGENT_3A.name: (1.5 * F / within, "Hertz, within 3a"),
            q.K_T_INITIAL_RAW.name: (K_T, _MINDLIN),
            q.K_T_INITIAL.name: (K_T, _MINDLIN),
            q.K_T_OVER_K_N.name: (K_T / K_N, "Mindlin"),
        }

    def shear_references(self, t: TangentialCase) -> References:
        """Closed forms of the numbers of a tangential load; empty without them."""
        hertz, c = self.hertz_of(t.normal.force), self.stick_radius(t)
        if hertz is None or c is None:
            return {}
        mu, C = self.plan.scene.contact.friction, self.shear_compliance()
        moved = float(mindlin.displacement(t.load, mu, t.normal.force, hertz.radius, C))
        values = {q.STICK_RADIUS: c, q.SHEAR_RAW: moved, q.SHEAR: moved}
        return {one.name: (value, _MINDLIN) for one, value in values.items()}


def measured(solution: ContactSolution, answer: NormalContact, load: float) -> ContactMeasures:
    """Size and pressure of the whole contact under one normal load in N; flat faces have no radius.

    The edge is located between the nodes, but of a sphere, whose area is that of Hertz's pressure.
    """
    faces = list(solution.lattices.values())
    forces = [k.whole(answer.force, extensive=True) for k in faces]
    pressure = solution.model.multipliers.pressure(answer.force)
    located = None
    if solution.plan.scene.sphere_radius is None:
        found = [
            located_area(
                k.points(),
                k.cells(),
                (f / k.area()).ravel(),
                k.whole(answer.gap).ravel(),
                (f > 0.0).ravel(),
                solution.modulus,
            )
            for k, f in zip(faces, forces, strict=True)
        ]
        located = sum(area for area, _ in found), sum(left for _, left in found)
    if solution.curved:
        return measure(solution.model.patch, forces[0], located, faces[0].whole(pressure))
    assert located is not None
    none = float("nan")
    return ContactMeasures(
        none,
        none,
        none,
        located[0],
        sum(float(k.area()[f > 0.0].sum()) for k, f in zip(faces, forces, strict=True)),
        float(pressure.max()),
        load / located[0] if located[0] else 0.0,
        located[1],
    )


# -- loads after loads -----------------------------------------------------------------------------


def contact_points_of(model: ContactModel) -> Array:
    """(n, 3) the contact nodes that carry forces, in contact axes, mm."""
    points: Array = model.lower.mesh.points[model.lower.contact[model.multipliers.nodes]]
    return points


def load_point(plan: ContactPlan, model: ContactModel) -> Array:
    """(2,) where the load line meets the contact plane, contact axes in mm."""
    upper = model.upper
    if plan.scene.contact.load_point is not None:
        low: Array = contact_points_of(model)[:, :2].min(axis=0)
        return np.asarray(low + np.array(plan.scene.contact.load_point))
    nodes = upper.mesh.points[upper.mesh.nodes["distant"], :2]
    weights = upper.mesh.weights.get("distant")
    # Middle of the set's extent: its nodes need not be evenly spread. Weights say where it is.
    middle = (
        0.5 * (nodes.min(axis=0) + nodes.max(axis=0))
        if weights is None
        else np.asarray(weights @ nodes / weights.sum())
    )
    return np.asarray(middle if 0 not in plan.mirrors else middle * np.array([0.0, 1.0]))


def tilt_arms(plan: ContactPlan, model: ContactModel) -> Array:
    """(n, k) mm from the load line to the nodes, for the k free tilts."""
    if plan.scene.contact.tilt != "free":
        return np.zeros((len(model.gap), 0))
    return contact_points_of(model)[:, :2] - load_point(plan, model)


def tangential_compliance(
    model: ContactModel,
    components: Sequence[int],
    loaded: NDArray[np.int64],
    body: Body | None = None,
) -> Array:
    """Compliance of the loaded nodes, (n, n) or (2n, 2n) mm/N with x dofs first, of both bodies or
    of one.
    """
    pick = np.ix_(loaded, loaded)
    rows = [[model.compliance(i, j, body)[pick] for j in components] for i in components]
    return np.block(rows)


def cycle_shares(steps: int, loops: int) -> tuple[Array, int, int]:
    """Loads of a cycle over its peak, the first loading and so many loops, and how many of them are
    before the loops and in each.
    """
    quarter = max(2, steps // 5)
    half = (steps - quarter) // 2
    back, forth = np.linspace(1.0, -1.0, half + 1)[1:], np.linspace(-1.0, 1.0, half + 1)[1:]
    first = np.linspace(0.0, 1.0, quarter + 1)[1:]
    return np.concatenate([first, *(back, forth) * loops]), quarter, 2 * half


def raised(
    model: ContactModel,
    friction: float,
    loads: Iterable[float],
    arms: Array,
    *,
    body: Body | None = None,
) -> dict[float, CoupledContact]:
    """Load steps to the positive normal loads in N, each on the way to the next, without a
    tangential load.

    Parameters
    ----------
    arms
        (n, k) mm of the k free tilts.
    body
        Against a rigid counterpart; None: both.
    """
    n, at, out = len(model.gap), 0.0, dict[float, CoupledContact]()
    # approach, shifts along x and y, tilts
    columns = np.zeros((3 * n, 3 + arms.shape[1]))
    columns[:, :3], columns[:n, 3:] = np.kron(np.eye(3), np.ones((n, 1))), arms
    for F in sorted({load for load in loads if load > 0.0}):
        way = np.zeros((int(np.ceil(NORMAL_STEPS * (1.0 - at / F))), columns.shape[1]))
        way[:, 0] = np.linspace(at, F, len(way) + 1)[1:]
        if out:
            out[F] = out[at].go_on(load=way)
        else:
            C = tangential_compliance(model, COMPONENTS, np.arange(n), body)
            out[F] = coupled_contact(C, model.gap, friction, load=way, columns=columns)
        at = F
    return out


def as_normal(found: CoupledContact, stiffness: float) -> NormalContact:
    """The normal part of the last load step."""
    f = found.force[-1, :, 0]
    return NormalContact(
        np.maximum(f, 0.0),
        np.maximum(found.gap[-1], 0.0),
        np.asarray(found.state[-1] > 0),
        float(found.displacement[-1, 0]),
        stiffness,
        int(found.iterations[-1]),
        "fallback" if found.fallbacks else "active set",
        found.status,
        found.message,
        f,
    )


def opened_by_shear(model: ContactModel, found: CoupledContact) -> Array:
    """(n,) mm that the tangential forces open, C_nt t."""
    shear = zip((ALONG, ACROSS), found.force[-1, :, 1:].T, strict=True)
    return np.asarray(sum(model.compliance(NORMAL, c) @ t for c, t in shear))


def shear_nodes(model: ContactModel, friction: float, found: CoupledContact) -> Sheared:
    """What the last step left at the closed nodes: beside the slip before it stands the way that
    the pressure alone moves them, C_tn f.
    """
    on = np.flatnonzero(found.state[-1] > 0)
    f, axes = found.force[-1], (ALONG, ACROSS)
    size = float(np.sqrt(np.diagonal(model.compliance(NORMAL))) @ np.abs(f[:, 0]))
    slip = found.slip[-1] - found.history.step
    before = [model.compliance(c, NORMAL) @ f[:, 0] + slip[:, c] for c in axes]
    return Sheared(
        axes,
        on,
        friction * f[on, 0],
        np.concatenate([f[on, 1], f[on, 2]]),
        np.concatenate([one[on] for one in before]),
        found.displacement[-1, 1:3],
        found.load[-1, 1:3],
        found.state[-1][on] == STICK,
        np.concatenate([np.sqrt(np.diagonal(model.compliance(c)))[on] * size for c in axes]),
    )


def loads_along(base: CoupledContact, values: Array, unit: Array) -> Array:
    """The normal load of the last step with tangential ones (k,) in N along ``unit`` (2,)."""
    out = np.zeros((len(values), base.load.shape[1]))
    out[:, 0] = base.load[-1, 0]
    out[:, 1:3] = np.outer(values, unit)
    return out


def sheared(
    base: CoupledContact, values: Array, unit: Array, needed: float
) -> tuple[list[CoupledContact], Array]:
    """Tangential loads (k,) in N along ``unit`` (2,), rising, after the last step of a normal load.

    Those above ``needed`` are there for a curve, which ends where the contact slides.

    Returns
    -------
    states, displacement
        After each load, and (k,) mm along the direction since the normal load.
    """
    states = [base]
    for T in values:
        try:
            states.append(states[-1].go_on(load=loads_along(base, np.array([T]), unit)))
        except ConvergenceError:
            if needed >= T:
                raise
            break
    moved = [(one.displacement[-1, 1:3] - base.displacement[-1, 1:3]) @ unit for one in states[1:]]
    return states[1:], np.array(moved)
