"""The scene of a seated damper: F_C presses it between two blades, then one of them is moved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

from upd.scene import quantities as q
from upd.scene.base import (
    DamperChoice,
    FaceFriction,
    RigBase,
    repeated,
    rig_problems,
    unreachable_accuracy,
)
from upd.scene.rotation import with_damper

#: Outputs of a seated damper.
SEATED_WANTS = ("seating", "stiffness", "band", "moved")
SeatedWant = Annotated[str, q.one_of(SEATED_WANTS), q.Example('"seating"', '"stiffness"')]
#: the analysis these scenes ask for
SEATED = "seated damper"

Way = Annotated[float, q.quantity("length"), q.positive, q.Example('"20 um"')]
Over = Annotated[float, q.must(lambda v: v > 1.0, "is not above 1", "> 1"), q.Example("1.5")]
whole_quarters = q.must(
    lambda v: v >= 4 and v % 4 == 0, "is not 4, 8, 12 and so on", "4, 8, 12 and so on"
)


@dataclass(frozen=True)
class BladesChoice:
    """What of the blades is elastic.

    Attributes
    ----------
    held
        "bases": all down to the clamped faces of the bases; "platforms": held where the platforms'
        sides join the blades, as blocks are.
    """

    held: Literal["bases", "platforms"] = "bases"


@dataclass(frozen=True)
class SeatingChoice:
    """How F_C is raised, lowered and raised again, and other ways of loading for the band.

    Attributes
    ----------
    steps
        Load steps of each of the three. Cost: seconds of the seating grow in proportion.
    lowest
        To which share of F_C it is lowered.
    over
        Over-pressed: raised to so many times F_C and lowered to it.
    shake
        Vibrated in: first amplitude of the right blade under F_C, along x, dying away to nothing.
    cycles
        Cycles of that.
    cycle_steps
        Load steps of each of these, a multiple of four: the vibration is at its ends after one and
        three quarters. Cost: seconds grow in proportion.
    """

    steps: Annotated[int, q.at_least(2)] = 20
    lowest: q.Share = 0.1
    over: Over = 1.5
    shake: Way = 0.05
    cycles: Annotated[int, q.at_least(1)] = 6
    cycle_steps: Annotated[int, whole_quarters] = 8


@dataclass(frozen=True)
class MovedChoice:
    """How the right blade is moved after the seating, F_C kept.

    Attributes
    ----------
    directions
        Axes along which it is moved, one history each: x across the blades, z up; y along the
        damper needs the full model.
    amplitude
        Of the motion of what holds the blade, to both sides.
    cycles
        Cycles after the first way out. Cost: seconds grow in proportion.
    steps
        Load steps from the middle to the amplitude. Cost: seconds grow in proportion.
    """

    directions: Annotated[tuple[Literal["x", "y", "z"], ...], q.FILLED] = ("x", "z")
    amplitude: Way = 0.05
    cycles: Annotated[int, q.at_least(1)] = 2
    steps: Annotated[int, q.at_least(2)] = 8


@dataclass(frozen=True, kw_only=True)
class SeatedScene(RigBase):
    """A damper seated between two blades.

    Attributes
    ----------
    want
        Outputs: "seating", forces, pressure, stick and slip of both faces while F_C is raised,
        lowered and raised again; "stiffness", stuck stiffness of each face, and from platform to
        platform through the damper; "band", forces after other ways of loading: over-pressed,
        vibrated in; "moved", hysteresis while the right blade is moved. Cost: upd plan shows what
        each brings with it.
    analysis
        What distinguishes this scene from the rig's others.
    """

    only: ClassVar[tuple[str, ...]] = ("seating", "moved", "blades")

    analysis: Literal["seated damper"]
    want: Annotated[tuple[SeatedWant, ...], q.FILLED]
    blades: BladesChoice = field(default_factory=BladesChoice)
    damper: DamperChoice = field(default_factory=DamperChoice)
    contact: FaceFriction = field(default_factory=FaceFriction)
    seating: SeatingChoice = field(default_factory=SeatingChoice)
    moved: MovedChoice = field(default_factory=MovedChoice)

    @property
    def whole(self) -> bool:
        """Whether the full model is solved: asked for, or needed by a motion along the damper."""
        along = self.wants("moved") and "y" in self.moved.directions
        return self.mesh.symmetry == "full" or (self.mesh.symmetry == "auto" and along)

    def derived(self, data: Mapping[str, Any]) -> SeatedScene:
        """With density and F_C of the damper as numbers."""
        return with_damper(self, data)  # type: ignore[no-any-return]

    def problems(self) -> Iterator[str]:
        """What does not fit together."""
        directions = self.moved.directions
        levels = "geometry.refine, geometry.patch_along_slope or pad_along_slope"
        yield from repeated("moved.directions", directions)
        yield from rig_problems(self)
        yield from unreachable_accuracy(self, "a seated damper", levels)
        if self.damper.centrifugal <= 0.0:
            yield "damper.centrifugal: 0 N leaves the damper loose; give a positive force"
        if self.mesh.element not in ("hex8", "hex8i"):
            yield (
                f"mesh.element: the seated damper needs faces of four nodes, not those of "
                f'"{self.mesh.element}"; use "hex8i"'
            )
        if self.mesh.symmetry == "half" and "y" in directions:
            yield (
                'moved.directions: a motion along "y" is not symmetric; set mesh.symmetry = "auto" '
                'or "full"'
            )
