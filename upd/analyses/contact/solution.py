"""What a run of a contact finds: its loads, its tangential loads, all of it.

A curved contact has its fields on the whole patch, a flat one at the nodes of the model.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact.coupled import CoupledState
from upd.analyses.contact.loading import LoadPath, Sheared
from upd.analyses.contact.plan import ContactPlan, direction_name
from upd.analyses.contact.scene_plan import DamperLoad
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.contact.patch import ContactMeasures
from upd.contact.stiffness import BodyShare
from upd.contact.tilt import TiltedContact
from upd.results import Case, Estimates

Array = NDArray[np.float64]


@dataclass
class PressedContact:
    """One normal load.

    Attributes
    ----------
    solution
        Of the model, which mirror symmetry may make a part of the whole.
    stiffness
        Tangent normal stiffness of the whole contact, N/mm.
    state
        With normal and tangential contact at once, the state it comes from.
    displacement, reaction
        By body: (n_node, 3) mm, N on its distant set.
    """

    solution: NormalContact
    stiffness: float
    state: CoupledState | None = field(default=None, kw_only=True)
    displacement: dict[str, Array] = field(default_factory=dict, kw_only=True)
    reaction: dict[str, float] = field(default_factory=dict, kw_only=True)

    @property
    def stick(self) -> NDArray[np.bool_]:
        """(n,) nodes that stick without a tangential load: all in contact, if pressure does not
        shear.
        """
        return self.solution.contact if self.state is None else self.state.stick


@dataclass
class ContactSolution:
    """All that was solved.

    Attributes
    ----------
    left_out
        Numbers solved again with effects left out.
    estimates
        Errors of the numbers, where the mesh was chosen by an accuracy.
    """

    plan: ContactPlan
    model: ContactModel
    left_out: list[Resolved] = field(default_factory=list, kw_only=True)
    estimates: Estimates | None = field(default=None, kw_only=True)


# -- curved ----------------------------------------------------------------------------------------


@dataclass
class HertzNormalCase(PressedContact):
    """One normal load: forces in N, gaps in mm, pressure in MPa on the whole patch, (len(X),
    len(Y)).

    Attributes
    ----------
    shares
        By body: its share of the approach.
    shear_stiffness
        N/mm along the load with every node stuck.
    shear_shares
        By body: its share of the tangential displacement, mm per N.
    mesh_error
        Estimated error of the approach by the mesh near the contact and far from it, mm; None
        where the shares are not known.
    """

    load: float
    force: Array
    gap: Array
    pressure: Array
    measures: ContactMeasures
    shares: dict[str, BodyShare] = field(default_factory=dict)
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

    Displacement in mm along it, and tangent dT/dd in N/mm of the whole contact at the present stick
    set. Traction in MPa and slip in mm on the whole patch, (len(X), len(Y)), with a last axis of 2
    for two directions; the pressure under it; what the solver left at the nodes, for checks, and
    with normal and tangential contact at once its state.
    """

    normal: HertzNormalCase
    ratio: float
    load: float
    displacement: float
    stiffness: float
    traction: Array
    slip: Array
    stick: NDArray[np.bool_]
    pressure: Array
    nodes: Sheared
    state: CoupledState | None = None

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
class HertzSolution(ContactSolution):
    """All that was solved of a curved contact.

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
    """

    modulus: float
    normal: list[HertzNormalCase] = field(default_factory=list)
    curve: list[tuple[float, float]] = field(default_factory=list)
    along: list[CurvePoint] = field(default_factory=list)
    tangential: list[HertzTangentialCase] = field(default_factory=list)
    cycles: list[LoadPath] = field(default_factory=list)
    no_shares: str = ""


# -- flat ------------------------------------------------------------------------------------------


@dataclass
class FlatNormalCase(PressedContact):
    """One normal load on the whole contact in N and its answer.

    Attributes
    ----------
    approach_of
        Approach in mm that each body takes: its mean displacement under the pressure, without
        friction its share of the energy.
    alone, alone_states
        Answer of each body pressed at the same load by a rigid counterpart, where a stiffness
        calls for it.
    """

    load: DamperLoad
    tilted: TiltedContact | None
    approach_of: dict[str, float]
    alone: dict[str, NormalContact] = field(default_factory=dict)
    alone_states: dict[str, CoupledState] = field(default_factory=dict)

    @property
    def force(self) -> float:
        """N on the whole contact."""
        return self.load.force

    @property
    def case(self) -> Case:
        """The load."""
        return self.load.case

    @property
    def tilt(self) -> Array | None:
        """(2,) free tilts in rad; None where they are held."""
        if self.tilted is not None:
            return self.tilted.tilt
        motion = np.zeros(0) if self.state is None else self.state.motion[3:]
        return motion if motion.size else None


@dataclass(frozen=True)
class StuckContact:
    """Every node of the contact set stuck under one normal load, moved along ``direction`` in
    degrees; with normal and tangential contact at once a small load in that direction.

    Attributes
    ----------
    total
        Tangential stiffness in N/mm.
    of
        That of each body stuck to a rigid counterpart, by its own contact set.
    nodal
        (n,) field of it.
    """

    normal: Case
    direction: float
    total: float
    of: dict[str, float]
    nodal: Array

    @property
    def case(self) -> Case:
        """Normal load and direction."""
        return replace(self.normal, direction=direction_name(self.direction))


@dataclass
class FlatTangentialCase:
    """One tangential load T = ratio mu N in a direction (degrees from x), after one normal load.

    Traction and slip (n, 1 or 2), normal forces under it (n,); what the solver left at the nodes,
    for checks, and with normal and tangential contact at once its state.
    """

    normal: FlatNormalCase
    direction: float
    ratio: float
    load: float
    displacement: float
    stiffness: float
    force: Array
    slip: Array
    stick: NDArray[np.bool_]
    pressed: Array
    nodes: Sheared
    state: CoupledState | None = None

    @property
    def case(self) -> Case:
        """Normal load, direction and ratio."""
        return replace(self.normal.case, direction=direction_name(self.direction), ratio=self.ratio)


@dataclass
class FlatSolution(ContactSolution):
    """All that was solved of a flat contact.

    Attributes
    ----------
    bonded
        Normal stiffness in N/mm when no node may open.
    curve
        Normal force in N and its answer.
    stuck
        By normal load and direction.
    moved
        By normal load and direction: share of the normal forces that gross slip would move.
    """

    bonded: float = 0.0
    normal: list[FlatNormalCase] = field(default_factory=list)
    curve: list[tuple[float, NormalContact]] = field(default_factory=list)
    stuck: list[StuckContact] = field(default_factory=list)
    tangential: list[FlatTangentialCase] = field(default_factory=list)
    paths: list[LoadPath] = field(default_factory=list)
    moved: dict[Case, float] = field(default_factory=dict)
