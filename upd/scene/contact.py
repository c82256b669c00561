"""A scene's tables as frozen dataclasses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from upd.mesh import recipes
from upd.scene.base import (
    STRICT,
    LeftOut,
    MaterialData,
    MeshChoice,
    RecipeScene,
    SolverChoice,
    known_output,
)
from upd.scene.quantities import (
    FILLED,
    Accuracy,
    Centrifugal,
    Coefficient,
    Direction,
    Example,
    Force,
    Geometry,
    Length,
    LoadRatio,
    Mass,
    Name,
    NormalLoad,
    Radius,
    Share,
    Speed,
    Uncertainty,
    at_least,
)

#: Outputs a scene can ask for, and what each one is.
WANTS = {
    "normal": "pressure, contact area and radius, approach",
    "stiffness": "normal (and, with friction, tangential) contact stiffness",
    "curve": "force-approach curve up to the largest load",
    "body_compression": "approach split into contact and finite body",
    "tangential": "stick and slip under tangential load",
    "cycle": "hysteresis loop of a full tangential cycle",
    "fields": "displacement of the whole bodies as VTU",
    "worn_zones": "where the pressure peaks are",
    "contact_law": "contact points for a dynamic model: position, normal, k_n, k_t, preload",
}
#: Outputs each analysis of a contact can give.
CONTACT_WANTS = {
    "curved contact": (
        "normal",
        "stiffness",
        "curve",
        "body_compression",
        "tangential",
        "cycle",
        "fields",
    ),
    "flat contact": (
        "normal",
        "stiffness",
        "curve",
        "tangential",
        "cycle",
        "fields",
        "worn_zones",
        "contact_law",
    ),
}
#: Outputs that call for friction when there is some.
FRICTION_WANTS = ("stiffness", "tangential", "cycle", "contact_law")
#: Outputs that need no mass matrix.
STATIC_WANTS = tuple(WANTS)


Want = Annotated[str, known_output(WANTS), Example.of('"normal"', '"stiffness"')]


#: words of contact.coupling
Coupling = Literal["uncoupled", "coupled"]


@dataclass(frozen=True)
class ContactData:
    """Coulomb friction and what the solver may assume.

    Attributes
    ----------
    friction
        Coulomb's coefficient. Cost: above 0, outputs that need friction keep the tangential dofs of
        the contact, two or three times the condensed matrix.
    directions
        Tangential directions of the slip problem, 1 (along the load) or 2 (slip circle). Cost: 2
        solves the full model, with two tangential dofs a node.
    tilt
        Of the upper body about the patch's axes: "held" (its distant set only translates) or
        "free" (no moment about the load line).
    load_point
        Where the load line meets the contact plane, patch axes in mm with the origin at the
        patch's bottom left corner; the centre of the distant set, seen along the normal, when
        None. It matters for a free tilt only.
    coupling
        Of normal and tangential contact: "uncoupled" (normal forces first, which then stay) or
        "coupled" (both at once, exact for bodies of any shape and material). Without friction they
        are the same. Cost: "coupled" solves the full model with all three dofs a node, step by
        step: ten times the seconds and more.
    distant
        Body -> name of the node set that is held and loaded ("bands" stands for the mesh's set
        distant_bands): node by node, or evenly and in the mean where the mesh gives it weights, as
        bands of exact width have.
    coupling_limit
        Largest |beta| of Dundurs for which uncoupled normal and tangential contact may stand: the
        materials' part of the coupling, that of the bodies' shape is an effect left out.
    """

    __pydantic_config__ = STRICT
    friction: Coefficient = 0.0
    directions: Literal[1, 2] = 1
    tilt: Literal["held", "free"] = "held"
    load_point: tuple[Length, Length] | None = None
    coupling: Coupling = "uncoupled"
    distant: Annotated[
        Mapping[str, Annotated[str, Example.of('"wires"')]], Example.of('{ damper = "wires" }')
    ] = field(default_factory=dict)
    coupling_limit: Coefficient = 0.1


@dataclass(frozen=True)
class Loads:
    """Normal forces, tangential forces as fractions of mu N, amplitude of the cycle likewise.

    Attributes
    ----------
    normal
        Forces that press the bodies together, each a case of its own; or equilibria of the damper
        under loads.centrifugal, by the friction they mobilise. Cost: every case is solved.
    centrifugal
        Force on the damper, from which the equilibria among ``normal`` follow, or "from speed":
        F_C = m r w^2.
    mass
        Of the damper; its material's density times its volume when None.
    radius
        Of the damper's centre of mass from the axis of rotation.
    speed
        Of the rotation.
    tangential
        Forces along the face, relative to friction times normal force. Cost: every one is solved,
        for every normal load and direction.
    directions
        Of the tangential loads, from the patch's x. Cost: every one is solved.
    cycle_amplitude
        Largest tangential force of the full cycle, relative to friction times normal force.
    cycle_steps
        Load steps of the full cycle. Cost: seconds of the cycle grow with them.
    curve_points
        Loads of the force-approach curve. Cost: every one is solved.
    curve_to
        Largest force of the force-approach curve; the largest normal load when None.
    """

    __pydantic_config__ = STRICT
    normal: Annotated[tuple[NormalLoad, ...], FILLED]
    centrifugal: Centrifugal | None = None
    mass: Mass | None = None
    radius: Radius | None = None
    speed: Speed | None = None
    tangential: tuple[LoadRatio, ...] = ()
    directions: Annotated[tuple[Direction, ...], FILLED] = (0.0,)
    cycle_amplitude: Share = 0.75
    cycle_steps: Annotated[int, at_least(8)] = 300
    curve_points: Annotated[int, at_least(2)] = 12
    curve_to: Force | None = None

    @property
    def forces(self) -> tuple[float, ...]:
        """The normal forces in N; only for scenes without equilibria among them."""
        return tuple(float(F) for F in self.normal)


@dataclass(frozen=True)
class LawChoice:
    """Contact points for a dynamic model: rows (along y) x columns (along x) per patch.

    Attributes
    ----------
    rows
        Contact points along y, up the slope.
    columns
        Contact points along x, along the damper.
    weight
        Share of a point in the stiffness: its nodes' in the normal "stiffness" (without gaps:
        the pressure), or in the "area".
    bodies
        Whose elasticity the springs carry: "both", or "upper" alone, for a dynamic model whose
        lower body is elastic itself (keeping it in the springs would count it twice).
    """

    __pydantic_config__ = STRICT
    rows: Annotated[int, at_least(1)] = 4
    columns: Annotated[int, at_least(1)] = 6
    weight: Literal["stiffness", "area"] = "stiffness"
    bodies: Literal["both", "upper"] = "both"


@dataclass(frozen=True)
class Scene(RecipeScene):
    """One contact of two bodies.

    ``geometry`` holds the recipe's name under "recipe" and its parameters beside it, in mm.

    Attributes
    ----------
    name
        Of the run folder.
    title
        Heading of the page.
    want
        Outputs; all else follows from them. Cost: upd plan shows what each brings with it.
    geometry
        The recipe and its parameters.
    materials
        One per body of the recipe.
    accuracy
        Largest estimated error wanted, of all main numbers or of some by their names: the run
        chooses the cheapest levels that reach it. "unknown" leaves all errors unknown; when none,
        they are estimated on the scene's own levels. Cost: the companions of an estimate take up to
        a third of the run; half the error of a mesh takes about eight times the elements.
    """

    __pydantic_config__ = STRICT
    name: Name
    want: Annotated[tuple[Want, ...], FILLED]
    geometry: Geometry
    materials: Annotated[
        Mapping[str, MaterialData], Example.of('{ damper = { E = "200 GPa", nu = 0.3 } }')
    ]
    loads: Loads
    title: str = ""
    mesh: MeshChoice = field(default_factory=MeshChoice)
    contact: ContactData = field(default_factory=ContactData)
    solver: SolverChoice = field(default_factory=SolverChoice)
    left_out: LeftOut = field(default_factory=LeftOut)
    law: LawChoice = field(default_factory=LawChoice)
    accuracy: Accuracy = None
    text: str = field(default="", repr=False)
    uncertain: Mapping[str, Uncertainty] = field(default_factory=dict, repr=False)

    moves: ClassVar[bool] = False

    @property
    def body_materials(self) -> Mapping[str, MaterialData]:
        """Material of every body."""
        return self.materials

    @property
    def coupled(self) -> bool:
        """Whether normal and tangential contact are solved at once: without friction they need
        not be.
        """
        return self.contact.coupling == "coupled" and self.contact.friction > 0.0

    @property
    def slip_directions(self) -> int:
        """Tangential directions that are solved: coupled contact has both."""
        return 2 if self.coupled else self.contact.directions

    @property
    def sphere_radius(self) -> float | None:
        """Radius in mm when the recipe declares a sphere on a plane, whose closed forms then
        apply.
        """
        if recipes.closed_form(self.recipe) != "sphere on plane":
            return None
        return float(self.geometry["radius"])


def friction_on(scene: Scene) -> bool:
    """True when an output needs friction and there is some."""
    return scene.contact.friction > 0.0 and scene.wants(*FRICTION_WANTS)
