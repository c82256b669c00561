"""The scene of a bladed disk: modes by nodal diameter, Campbell and interference diagram."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from upd.scene import quantities as q
from upd.scene.base import STRICT, MaterialData, MeshChoice, SceneBase, unreachable_accuracy

#: Outputs a bladed disk can ask for.
BLADED_DISK_WANTS = ("modes", "campbell", "interference")
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

    __pydantic_config__ = STRICT
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

    __pydantic_config__ = STRICT
    speed: q.Speed
    up_to: q.Ratio = 1.2
    engine_orders: Annotated[tuple[Annotated[int, q.at_least(0)], ...], q.FILLED] = (1, 2, 3, 4)
    points: Annotated[int, q.at_least(2)] = 25


@dataclass(frozen=True, kw_only=True)
class BladedDiskScene(SceneBase):
    """Free vibration of a tuned bladed disk, from one sector.

    Attributes
    ----------
    want
        Outputs: "modes", frequencies at rest by nodal diameter; "campbell", frequencies over the
        speed with engine orders and where they cross; "interference", frequencies by nodal
        diameter at the operating speed with the lines of engine orders (SAFE diagram). Cost: upd
        plan shows what each brings with it.
    material
        Of the sector.
    """

    analysis: ClassVar[str] = "bladed disk"

    want: Annotated[tuple[BladedDiskWant, ...], q.FILLED]
    material: MaterialData
    mesh: MeshChoice = field(default_factory=lambda: MeshChoice(element="hex20"))
    modes: SectorModesChoice = field(default_factory=SectorModesChoice)
    rotation: SpinChoice

    @property
    def body_materials(self) -> Mapping[str, MaterialData]:
        """The one material."""
        return {"all": self.material}

    @property
    def n_sectors(self) -> int:
        """Number of blades."""
        return int(self.geometry["n_sectors"])


def bladed_disk_problems(scene: BladedDiskScene) -> Iterator[str]:
    """What does not fit together."""
    if scene.mesh.element == "hex8i":
        yield 'mesh.element: hex8i has no stress stiffness; use "hex20", "hex27" or "hex8"'
    if scene.mesh.symmetry not in ("auto", "full"):
        yield 'mesh.symmetry: a sector has no mirror plane; use "full" or "auto"'
    if scene.material.yield_stress is not None:
        yield "material.yield_stress: is checked in a contact scene, body by body; remove it here"
    if scene.solver.name == "amg":
        yield 'solver.name: modes need a direct solver; use "auto", "pardiso" or "superlu"'
    yield from unreachable_accuracy(scene, "a bladed disk", "the numbers of elements")
