"""The scene of a seated damper: F_C presses it between two blades, then one of them is moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

from upd.scene.base import (
    STRICT,
    LeftOut,
    MaterialData,
    MeshChoice,
    SceneBase,
    SolverChoice,
    known_output,
)
from upd.scene.forced import DamperChoice
from upd.scene.quantities import (
    FILLED,
    Accuracy,
    Coefficient,
    Example,
    Geometry,
    Name,
    Noted,
    Share,
    Uncertainty,
    at_least,
    must,
    positive,
    quantity,
)
from upd.scene.rig import rig_problems

#: Outputs of a seated damper, and what each one is.
SEATED_WANTS = {
    "seating": "forces, pressure, stick and slip of both faces while F_C is raised, lowered and "
    "raised again",
    "stiffness": "stuck stiffness of each face, and from platform to platform through the damper",
    "band": "forces after other ways of loading: over-pressed, vibrated in",
    "moved": "hysteresis while the right blade is moved",
}
#: the analysis these scenes ask for
SEATED = "seated damper"
#: tables that only this scene has
SEATED_ONLY = ("seating", "moved", "blades")

Way = Annotated[float, quantity("length"), positive, Example.of('"20 um"')]
Over = Annotated[float, must(lambda v: v > 1.0, "is not above 1", "> 1"), Example.of("1.5")]
whole_quarters = must(
    lambda v: v >= 4 and v % 4 == 0, "is not 4, 8, 12 and so on", "4, 8, 12 and so on"
)
#: words of contact.fit and how far the faces are worn in
FITS = {"new": 0.0, "worn": 1.0}


def _fit(value: Any) -> Any:
    if isinstance(value, str) and value in FITS:
        return value
    if isinstance(value, (int, float)) and not isinstance(value, bool) and 0.0 <= value <= 1.0:
        return float(value)
    raise ValueError(f'{value!r} is no fit of the faces; write "new", "worn" or a number 0 to 1')


@dataclass(frozen=True)
class SeatedContact:
    """Coulomb friction on every matching node of both faces.

    Attributes
    ----------
    friction
        Coulomb's coefficient.
    fit
        How well the faces fit each other: "new" (flat, they touch everywhere without load), "worn"
        (worn in under F_C, which then presses evenly), or a number between, 0 new to 1 worn.
    """

    __pydantic_config__ = STRICT
    friction: Coefficient = 0.6
    fit: Annotated[Any, BeforeValidator(_fit), Noted(bounds="new, worn, or 0 to 1")] = "new"

    @property
    def worn(self) -> float:
        """How far the faces are worn in, 0 to 1."""
        return FITS[self.fit] if isinstance(self.fit, str) else float(self.fit)


@dataclass(frozen=True)
class BladesChoice:
    """What of the blades is elastic.

    Attributes
    ----------
    held
        "bases": all down to the clamped faces of the bases; "platforms": held where the platforms'
        sides join the blades, as blocks are.
    """

    __pydantic_config__ = STRICT
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
        Over-pressed: raised to so many times F_C and let go to it.
    shake
        Vibrated in: first amplitude of the right blade under F_C, along x, dying away to nothing.
    cycles
        Cycles of that.
    cycle_steps
        Load steps of each of these, a multiple of four: the vibration is at its ends after one and
        three quarters. Cost: seconds grow in proportion.
    """

    __pydantic_config__ = STRICT
    steps: Annotated[int, at_least(2)] = 20
    lowest: Share = 0.1
    over: Over = 1.5
    shake: Way = 0.05
    cycles: Annotated[int, at_least(1)] = 6
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

    __pydantic_config__ = STRICT
    directions: Annotated[tuple[Literal["x", "y", "z"], ...], FILLED] = ("x", "z")
    amplitude: Way = 0.05
    cycles: Annotated[int, at_least(1)] = 2
    steps: Annotated[int, at_least(2)] = 8


@dataclass(frozen=True)
class SeatedScene(SceneBase):
    """A damper seated between two blades. ``geometry`` holds the recipe's name under "recipe" and
    its parameters beside it, in mm.

    Attributes
    ----------
    name
        Of the run folder.
    title
        Heading of the page.
    analysis
        What tells this scene from the rig's others.
    want
        Outputs; all else follows from them. Cost: upd plan shows what each brings with it.
    geometry
        The recipe and its parameters.
    material
        Of blades, bases and damper.
    accuracy
        Largest estimated error wanted, of all main numbers or of some by their names: the run
        chooses the cheapest levels that reach it. "unknown" leaves all errors unknown; when none,
        they are estimated on the scene's own levels. Cost: the companions of an estimate take up to
        a third of the run; half the error of a mesh takes about eight times the elements.
    """

    __pydantic_config__ = STRICT
    name: Name
    analysis: Literal["seated damper"]
    want: Annotated[
        tuple[Annotated[str, known_output(SEATED_WANTS), Example.of('"seating"')], ...], FILLED
    ]
    geometry: Geometry
    material: MaterialData
    title: str = ""
    mesh: MeshChoice = field(default_factory=MeshChoice)
    blades: BladesChoice = field(default_factory=BladesChoice)
    damper: DamperChoice = field(default_factory=DamperChoice)
    contact: SeatedContact = field(default_factory=SeatedContact)
    seating: SeatingChoice = field(default_factory=SeatingChoice)
    moved: MovedChoice = field(default_factory=MovedChoice)
    solver: SolverChoice = field(default_factory=SolverChoice)
    left_out: LeftOut = field(default_factory=LeftOut)
    accuracy: Accuracy = None
    text: str = field(default="", repr=False)
    uncertain: Mapping[str, Uncertainty] = field(default_factory=dict, repr=False)

    @property
    def arrangement(self) -> str:
        """Which sides of the platforms face each other."""
        return str(self.geometry.get("arrangement", "symmetric"))

    @property
    def whole(self) -> bool:
        """Whether the full model is solved: asked for, or needed by a motion along the damper."""
        along = self.wants("moved") and "y" in self.moved.directions
        return self.mesh.symmetry == "full" or (self.mesh.symmetry == "auto" and along)


def seated_problems(scene: SeatedScene) -> list[str]:
    """What does not fit together."""
    problems = []
    if scene.damper.centrifugal <= 0.0:
        problems.append("damper.centrifugal: 0 N leaves the damper loose; give a positive force")
    if scene.mesh.element not in ("hex8", "hex8i"):
        problems.append(
            f"mesh.element: the seated damper needs faces of four nodes, not those of "
            f'"{scene.mesh.element}"; use "hex8i"'
        )
    problems += rig_problems(
        scene.mesh,
        scene.solver,
        scene.accuracy,
        of="a seated damper",
        instead="geometry.refine, geometry.patch_along_slope or pad_along_slope",
    )
    if scene.mesh.symmetry == "half" and "y" in scene.moved.directions:
        problems.append(
            'moved.directions: a motion along "y" is not symmetric; set mesh.symmetry = "auto" '
            'or "full"'
        )
    if len(set(scene.moved.directions)) < len(scene.moved.directions):
        problems.append("moved.directions: one is duplicated")
    return problems
