"""What a run of a curved contact finds: its loads, its tangential loads, all of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact.coupled import (
    CoupledState,
)
from upd.analyses.contact.loading import (
    LoadPath,
    Sheared,
)
from upd.analyses.contact.plan import ContactPlan
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.contact.patch import ContactMeasures
from upd.contact.stiffness import BodyShare
from upd.results import Case, Estimates

Array = NDArray[np.float64]


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
    state
        With normal and tangential contact at once, the state it comes from.
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
    state: CoupledState | None = None

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

    @property
    def stick(self) -> NDArray[np.bool_]:
        """(n,) nodes that stick without a tangential load: all in contact, if pressure does not
        shear.
        """
        return self.solution.contact if self.state is None else self.state.stick


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
    estimates: Estimates | None = None
