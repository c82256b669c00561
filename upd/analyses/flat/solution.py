"""What a run of a flat contact finds: its loads, its tangential loads, all of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

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
from upd.analyses.contact.plan import (
    ContactPlan,
    direction_name,
)
from upd.analyses.contact.scene_plan import DamperLoad
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.contact.tilt import TiltedContact
from upd.results import Case, Estimates

Array = NDArray[np.float64]


@dataclass
class FlatNormalCase:
    """One normal load on the whole contact in N and its answer.

    Attributes
    ----------
    approach_of
        Approach in mm that each body takes: its mean displacement under the pressure, without
        friction its share of the energy.
    state
        With normal and tangential contact at once, the state it comes from.
    alone, alone_states
        Answer of each body pressed at the same load by a rigid counterpart, where a stiffness
        calls for it.
    """

    load: DamperLoad
    solution: NormalContact
    tilted: TiltedContact | None
    stiffness: float
    approach_of: dict[str, float]
    state: CoupledState | None = None
    alone: dict[str, NormalContact] = field(default_factory=dict)
    alone_states: dict[str, CoupledState] = field(default_factory=dict)
    displacement: dict[str, Array] = field(default_factory=dict)
    reaction: dict[str, float] = field(default_factory=dict)

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

    @property
    def stick(self) -> NDArray[np.bool_]:
        """(n,) nodes that stick without a tangential load: all in contact, if pressure does not
        shear.
        """
        return self.solution.contact if self.state is None else self.state.stick


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
class FlatSolution:
    """All that was solved.

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
    left_out
        Numbers solved again with effects left out.
    estimates
        Errors of the numbers, where the mesh was chosen by an accuracy.
    """

    plan: ContactPlan
    model: ContactModel
    bonded: float = 0.0
    normal: list[FlatNormalCase] = field(default_factory=list)
    curve: list[tuple[float, NormalContact]] = field(default_factory=list)
    stuck: list[StuckContact] = field(default_factory=list)
    tangential: list[FlatTangentialCase] = field(default_factory=list)
    paths: list[LoadPath] = field(default_factory=list)
    moved: dict[Case, float] = field(default_factory=dict)
    left_out: list[Resolved] = field(default_factory=list)
    estimates: Estimates | None = None
