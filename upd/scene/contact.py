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
    must,
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


@dataclass(frozen=True)
class ContactData:
    """Coulomb friction and what the solver may assume.

    Attributes
    ----------
    directions
        Tangential directions of the slip problem, 1 (along the load) or 2 (slip circle).
    tilt
        Of the upper body about the patch's axes: "held" (its distant set only translates) or
        "free" (no moment about the load line).
    load_point
        Where the load line meets the contact plane, patch axes in mm with the origin at the
        patch's bottom left corner; the centre of the distant set, seen along the normal, when
        None. It matters for a free tilt only.
    distant
        Body -> name of the node set that is held and loaded ("bands" stands for the mesh's set
        distant_bands).
    coupling_limit
        Largest |beta| of Dundurs for which normal and tangential problems are solved one after
        the other: the materials' part of the coupling, that of the bodies' shape is left out.
    transverse_limit
        Accepted from older scene files, without effect: what slip across the load changes is
        solved, and bounded by left_out.stiffness.
    """

    __pydantic_config__ = STRICT
    friction: Coefficient = 0.0
    directions: Literal[1, 2] = 1
    tilt: Literal["held", "free"] = "held"
    load_point: tuple[Length, Length] | None = None
    distant: Annotated[
        Mapping[str, Annotated[str, Example.of('"wires"')]], Example.of('{ damper = "wires" }')
    ] = field(default_factory=dict)
    coupling_limit: Coefficient = 0.1
    transverse_limit: Coefficient = 0.25


@dataclass(frozen=True)
class Loads:
    """Normal forces in N; tangential forces as fractions of mu N; amplitude of the cycle likewise.

    Attributes
    ----------
    centrifugal
        Force in N on the damper, from which the equilibria among ``normal`` follow, or "from
        speed": F_C = m r w^2.
    mass, radius, speed
        Of the damper in t (its material's density times its volume when None), of its centre of
        mass from the axis of rotation in mm, and rad/s.
    directions
        Of the tangential loads, degrees from the patch's x.
    curve_to
        Largest force in N of the force-approach curve; the largest normal load when None.
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
    cycle_steps: Annotated[int, must(lambda v: v >= 8, "is less than 8")] = 300
    curve_points: Annotated[int, must(lambda v: v >= 2, "is less than 2")] = 12
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
    weight
        Share of a point in the stiffness: its nodes' in the normal "stiffness" (without gaps:
        the pressure), or in the "area".
    bodies
        Whose elasticity the springs carry: "both", or "upper" alone, for a dynamic model whose
        lower body is elastic itself (keeping it in the springs would count it twice).
    """

    __pydantic_config__ = STRICT
    rows: Annotated[int, must(lambda v: v >= 1, "is less than 1")] = 4
    columns: Annotated[int, must(lambda v: v >= 1, "is less than 1")] = 6
    weight: Literal["stiffness", "area"] = "stiffness"
    bodies: Literal["both", "upper"] = "both"


@dataclass(frozen=True)
class Scene(RecipeScene):
    """One contact of two bodies.

    ``geometry`` holds the recipe's name under "recipe" and its parameters beside it, in mm.
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
    text: str = field(default="", repr=False)

    moves: ClassVar[bool] = False

    @property
    def body_materials(self) -> Mapping[str, MaterialData]:
        """Material of every body."""
        return self.materials

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
