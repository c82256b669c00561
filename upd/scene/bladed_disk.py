"""The scene of a bladed disk: modes by nodal diameter, Campbell and interference diagram, damped
response.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from upd.scene import quantities as q
from upd.scene.base import (
    YIELD_CHECKED,
    MaterialData,
    MeshChoice,
    SceneBase,
    unreachable_accuracy,
)

#: Outputs a bladed disk can ask for.
BLADED_DISK_WANTS = ("modes", "campbell", "interference", "response", "performance")
BladedDiskWant = Annotated[str, q.one_of(BLADED_DISK_WANTS), q.Example('"modes"', '"campbell"')]


@dataclass(frozen=True)
class SectorModesChoice:
    """Modes of every nodal diameter.

    Attributes
    ----------
    count
        Lowest modes of each nodal diameter. Cost: small.
    computed
        Nodal diameters whose modes are computed, 0 and N/2 with them; they are the basis of all
        others. Cost: a factorisation and an eigenvalue problem each.
    """

    count: Annotated[int, q.at_least(1)] = 6
    computed: Annotated[int, q.at_least(2)] = 4


@dataclass(frozen=True)
class SpinChoice:
    """Speed and excitation.

    Attributes
    ----------
    speed
        Operating speed: of the interference diagram; margins are measured from it.
    up_to
        Largest speed of the Campbell diagram, over the operating speed. Cost: small.
    engine_orders
        That excite the blades: EO waves round the circumference, each with the frequency EO times
        the speed. Cost: small.
    points
        Speeds of the Campbell diagram. Cost: small.
    """

    speed: q.Speed
    up_to: q.Ratio = 1.2
    engine_orders: Annotated[tuple[Annotated[int, q.at_least(0)], ...], q.FILLED] = (1, 2, 3, 4)
    points: Annotated[int, q.at_least(2)] = 25


@dataclass(frozen=True)
class WedgeChoice:
    """The wedge in every gap between platforms, a rigid body; F_C = m r w^2 at each speed.

    Attributes
    ----------
    mass
        Of the damper; its inertia is that of a box that fills the gap of the contact patches.
    angle
        Of its faces to the circumference.
    normal_stiffness, tangential_stiffness
        Of all contact points of a face.
    friction
        Coulomb's coefficient.
    axial_stiffness
        Of what holds the wedge along the axis, a pin or end walls: friction alone lets a wedge walk
        off that slips on all its faces. From 10 to 1000 N/mm it changes no peak by .1 %.
    """

    mass: q.Mass = 1e-5
    angle: Annotated[float, q.quantity("angle"), q.Example('"25 deg"')] = 25.0
    normal_stiffness: Annotated[float, q.quantity("stiffness"), q.positive] = 2e4
    tangential_stiffness: Annotated[float, q.quantity("stiffness"), q.positive] = 1e4
    friction: q.Coefficient = 0.3
    axial_stiffness: Annotated[float, q.quantity("stiffness"), q.positive] = 100.0


@dataclass(frozen=True)
class WaveChoice:
    """Response to the engine order of the crossing nearest to the operating speed.

    Attributes
    ----------
    force
        Amplitude at the node set tip, along the circumference.
    damping
        Ratio of the mode at the crossing; damping is proportional to the stiffness.
    harmonics
        Number of harmonics above the mean: of the ready scene's damped peak, 1 leaves out 3 %, 3
        leave out .1 %, under ten times the load 40 % and 6 %. Cost: nodal diameters to reduce,
        unknowns in proportion.
    modes
        Modes of a reduced sector with its contact points held. Cost: small.
    points
        Frequencies of a curve. Cost: time in proportion.
    ratios
        F_C/F_E of the performance curve, beside that of the response. Cost: a curve each.
    """

    force: q.Force = 1.0
    damping: q.Share = 0.002
    harmonics: Annotated[int, q.at_least(1)] = 3
    modes: Annotated[int, q.at_least(1)] = 15
    points: Annotated[int, q.at_least(5)] = 25
    ratios: Annotated[tuple[q.Ratio, ...], q.FILLED] = (10.0, 20.0, 40.0, 100.0)


@dataclass(frozen=True, kw_only=True)
class BladedDiskScene(SceneBase):
    """Vibration of a tuned bladed disk, from one sector.

    Attributes
    ----------
    want
        Outputs: "modes", frequencies at rest by nodal diameter; "campbell", frequencies over the
        speed with engine orders and where they cross; "interference", frequencies by nodal
        diameter at the operating speed with the lines of engine orders (SAFE diagram); "response",
        free, stuck and damped response where an engine order crosses a mode; "performance", the
        peak over F_C/F_E there. Cost: upd plan shows what each brings with it.
    material
        Of the sector.
    """

    analysis: ClassVar[str] = "bladed disk"

    want: Annotated[tuple[BladedDiskWant, ...], q.FILLED]
    material: MaterialData
    mesh: MeshChoice = field(default_factory=lambda: MeshChoice(element="hex20"))
    modes: SectorModesChoice = field(default_factory=SectorModesChoice)
    rotation: SpinChoice
    damper: WedgeChoice = field(default_factory=WedgeChoice)
    response: WaveChoice = field(default_factory=WaveChoice)

    @property
    def n_sectors(self) -> int:
        """Number of blades."""
        return int(self.geometry["n_sectors"])

    def problems(self) -> Iterator[str]:
        """What does not fit together."""
        if self.mesh.element == "hex8i":
            yield 'mesh.element: hex8i has no stress stiffness; use "hex20", "hex20r" or "hex27"'
        if self.mesh.symmetry not in ("auto", "full"):
            yield 'mesh.symmetry: a sector has no mirror plane; use "full" or "auto"'
        if self.material.yield_stress is not None:
            yield YIELD_CHECKED
        if self.solver.name == "amg":
            yield 'solver.name: modes need a direct solver; use "auto", "pardiso" or "superlu"'
        yield from unreachable_accuracy(self, "a bladed disk", "the numbers of elements")
