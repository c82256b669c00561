"""What a run of a contact finds: its normal loads, its tangential loads, all of it.

Fields are those of the model's contact nodes, (n,); mirror symmetry may make the model a part of
the whole, which loads and stiffnesses are those of. `faces` has the fields on the whole contact.
It knows what Hertz, Cattaneo and Mindlin have for the loads of a sphere on a plane.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact.loading import CoupledState, LoadPath, Sheared
from upd.analyses.contact.plan import ContactPlan, direction_name, is_curved
from upd.contact.bulk import BodyShare
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.contact.patch import ContactMeasures
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
#: name of a number -> its closed form in mm, N, and the source
References = dict[str, tuple[float | None, str]]
_HERTZ, _MINDLIN = "Hertz", "Cattaneo-Mindlin"


@dataclass
class PressedContact:
    """Answer of both bodies under a normal load, or of one pressed by a rigid counterpart.

    Attributes
    ----------
    stiffness
        Tangent normal stiffness of the whole contact, N/mm.
    state
        With normal and tangential contact at once, the state it comes from.
    tilt
        (2,) free tilts in rad; None where they are held.
    """

    solution: NormalContact
    stiffness: float
    state: CoupledState | None = None
    tilt: Array | None = None

    @property
    def stick(self) -> NDArray[np.bool_]:
        """(n,) nodes that stick without a tangential load: all in contact, if pressure does not
        shear.
        """
        return self.solution.contact if self.state is None else self.state.stick


@dataclass(kw_only=True)
class NormalCase(PressedContact):
    """One normal load on the whole contact.

    Attributes
    ----------
    force
        N on the whole contact.
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
    measures: ContactMeasures
    alone: dict[str, PressedContact] = field(default_factory=dict)
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
        return sum(self.shear_shares.values())


@dataclass
class TangentialCase:
    """One tangential load T = ratio mu N in a direction, after one normal load.

    Displacement in mm along it, and tangent dT/dd in N/mm of the whole contact at the present stick
    set. Force in N and slip in mm, (n, 1 or 2), normal forces under it (n,); what the solver left
    at the nodes, for checks, and with normal and tangential contact at once its state.
    """

    normal: NormalCase
    case: Case
    load: float
    displacement: float
    stiffness: float
    force: Array
    slip: Array
    nodes: Sheared
    state: CoupledState | None = None

    @property
    def pressed(self) -> Array:
        """(n,) normal forces under it, N."""
        return self.normal.solution.force if self.state is None else self.state.force[:, 0]

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
