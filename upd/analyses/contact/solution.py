"""What a run of a contact finds: its normal loads, its tangential loads, all of it.

Fields are those of the model's contact nodes, (n,); mirror symmetry may make the model a part of
the whole, which loads and stiffnesses are those of. `faces` has the fields on the whole contact.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact.loading import CoupledState, LoadPath, Sheared
from upd.analyses.contact.plan import ContactPlan, DamperLoad, direction_name, is_curved
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.contact.patch import ContactMeasures
from upd.contact.stiffness import BodyShare
from upd.reference import contact_modulus
from upd.results import Case, Estimates

Array = NDArray[np.float64]


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
    alone
        By body: its answer at the same load, pressed by a rigid counterpart, where a stiffness
        calls for it.
    stuck
        By direction in degrees: tangential stiffness in N/mm of the contact set stuck, and that of
        each body stuck to a rigid counterpart, by its own contact set; with normal and tangential
        contact at once of a small load in that direction.
    displacement, reaction
        By body: (n_node, 3) mm, N on its distant set.
    compression
        By body: displacement at depth 3a, mm.
    shares, shear_shares
        By body: its share of the approach, and of the tangential displacement in mm per N.
    mesh_error
        Estimated error of the approach by the mesh near the contact and far from it, mm; None
        where the shares are not known.
    """

    load: DamperLoad
    measures: ContactMeasures
    alone: dict[str, PressedContact] = field(default_factory=dict)
    stuck: dict[float, tuple[float, dict[str, float]]] = field(default_factory=dict)
    displacement: dict[str, Array] = field(default_factory=dict)
    reaction: dict[str, float] = field(default_factory=dict)
    compression: dict[str, float] = field(default_factory=dict)
    shares: dict[str, BodyShare] = field(default_factory=dict)
    shear_shares: dict[str, BodyShare] = field(default_factory=dict)
    mesh_error: tuple[float, float] | None = None

    @property
    def force(self) -> float:
        """N on the whole contact."""
        return self.load.force

    @property
    def case(self) -> Case:
        """The load."""
        return self.load.case

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
        Loaded points of the force-approach curve.
    paths
        Tangential force over displacement, cycles among them.
    moved
        By normal load and direction: share of the normal forces that gross slip would move.
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
    curve: list[NormalCase] = field(default_factory=list)
    tangential: list[TangentialCase] = field(default_factory=list)
    paths: list[LoadPath] = field(default_factory=list)
    moved: dict[Case, float] = field(default_factory=dict)
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
