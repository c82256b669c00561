"""The scene of one contact: its tables as frozen dataclasses, and what does not fit together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Literal

from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import quantities as q
from upd.scene.base import MaterialData, SceneBase, repeated
from upd.scene.rotation import rotation_problems, volume_of

#: body whose density is the damper's
_DAMPER = "damper"
#: Outputs a scene can ask for.
WANTS = (
    "normal",
    "stiffness",
    "curve",
    "body_compression",
    "tangential",
    "cycle",
    "fields",
    "worn_zones",
    "contact_law",
)
Want = Annotated[str, q.one_of(WANTS), q.Example('"normal"', '"stiffness"')]
#: Outputs each analysis of a contact can give.
CONTACT_WANTS: dict[str, tuple[str, ...]] = {
    "curved contact": tuple(w for w in WANTS if w not in ("worn_zones", "contact_law")),
    "flat contact": tuple(w for w in WANTS if w != "body_compression"),
}
#: Outputs that call for friction when there is some.
FRICTION_WANTS = ("stiffness", "tangential", "cycle", "contact_law")


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

    friction: q.Coefficient = 0.0
    directions: Literal[1, 2] = 1
    tilt: Literal["held", "free"] = "held"
    load_point: tuple[q.Length, q.Length] | None = None
    coupling: Coupling = "uncoupled"
    distant: Annotated[
        Mapping[str, Annotated[str, q.Example('"wires"')]], q.Example('{ damper = "wires" }')
    ] = field(default_factory=dict)
    coupling_limit: q.Coefficient = 0.1


@dataclass(frozen=True, kw_only=True)
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

    centrifugal: q.Centrifugal | None = None
    mass: q.Mass | None = None
    radius: q.Radius | None = None
    speed: q.Speed | None = None
    normal: Annotated[tuple[q.NormalLoad, ...], q.FILLED]
    tangential: tuple[q.LoadRatio, ...] = ()
    directions: Annotated[tuple[q.Direction, ...], q.FILLED] = (0.0,)
    cycle_amplitude: q.Share = 0.75
    cycle_steps: Annotated[int, q.at_least(8)] = 300
    curve_points: Annotated[int, q.at_least(2)] = 12
    curve_to: q.Force | None = None

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

    rows: Annotated[int, q.at_least(1)] = 4
    columns: Annotated[int, q.at_least(1)] = 6
    weight: Literal["stiffness", "area"] = "stiffness"
    bodies: Literal["both", "upper"] = "both"


@dataclass(frozen=True, kw_only=True)
class Scene(SceneBase):
    """One contact of two bodies.

    Attributes
    ----------
    want
        Outputs: "normal", pressure, contact area and radius, approach; "stiffness", normal (and,
        with friction, tangential) contact stiffness; "curve", force-approach curve up to the
        largest load; "body_compression", approach split into contact and finite body; "tangential",
        stick and slip under tangential load; "cycle", hysteresis loop of a full tangential cycle;
        "fields", displacement of the whole bodies as VTU; "worn_zones", where the pressure peaks
        are; "contact_law", contact points for a dynamic model: position, normal, k_n, k_t, preload.
        Cost: upd plan shows what each brings with it.
    materials
        One per body of the recipe.
    """

    moves: ClassVar[bool] = False

    want: Annotated[tuple[Want, ...], q.FILLED]
    materials: Annotated[
        Mapping[str, MaterialData], q.Example('{ damper = { E = "200 GPa", nu = 0.3 } }')
    ]
    loads: Loads
    contact: ContactData = field(default_factory=ContactData)
    law: LawChoice = field(default_factory=LawChoice)

    @property
    def analysis(self) -> str:
        """Name of the analysis, which the recipe declares."""
        return recipes.analyses(self.recipe)[0]

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

    def derived(self, data: Mapping[str, Any]) -> Scene:
        """With F_C as a number."""
        loads, mass = self.loads, self.loads.mass
        problems = rotation_problems("loads", loads, data.get("loads", {}))
        if not problems and loads.speed is None and mass is not None:
            problems = ["loads.mass: counts for F_C = m r w^2 only; add radius and speed"]
        if problems:
            raise InputError(*problems)
        if loads.speed is None or loads.radius is None:
            return self
        if mass is None:
            material = self.materials.get(_DAMPER)
            if material is None:
                raise InputError("loads.mass: is missing; give the damper's mass")
            mass = material.density * volume_of(self)
        force = mass * loads.radius * loads.speed**2
        return replace(self, loads=replace(loads, centrifugal=force))

    def problems(self) -> Iterator[str]:
        """What does not fit together."""
        loads, contact = self.loads, self.contact
        yield from repeated("loads.normal", loads.normal)
        yield from repeated("loads.tangential", loads.tangential)
        if self.wanted_accuracy is None and self.geometry.get("divisions") == "auto":
            yield 'geometry.divisions: "auto" needs an accuracy, for example "1 %"'
        try:
            kind = self.analysis
        except InputError:
            # a problem of geometry.recipe, found there
            return
        if kind not in CONTACT_WANTS:
            known = ", ".join(CONTACT_WANTS)
            yield f"geometry.recipe: its ANALYSIS is {kind!r}; write one of {known}, rig"
            return
        known = ", ".join(CONTACT_WANTS[kind])
        for w in self.want:
            if w not in CONTACT_WANTS[kind]:
                yield f"want: {w!r} is no output of a {kind}; choose among {known}"
        word = next((v for v in loads.normal if isinstance(v, str)), "")
        if kind == "flat contact":
            yield from repeated(
                "loads.directions", [f"{d % 360.0:g} deg" for d in loads.directions]
            )
            if word and loads.centrifugal == 0.0:
                yield (
                    f"loads.centrifugal: 0 N presses nothing together, so {word!r} has no answer; "
                    'give the force at speed, for example "350 N"'
                )
            if 0.0 in loads.normal:
                yield "loads.normal: 0 N presses nothing together; give a positive force"
            if loads.curve_to == 0.0:
                yield "loads.curve_to: 0 N gives no curve; give a positive force"
            if word and loads.centrifugal is None:
                yield (
                    f"loads.normal: {word!r} needs loads.centrifugal, the centrifugal force on the "
                    "damper"
                )
        else:
            only_flat = {
                "loads.centrifugal": loads.centrifugal is not None,
                "loads.speed": loads.speed is not None,
                "loads.directions": loads.directions != (0.0,),
                "loads.curve_to": loads.curve_to is not None,
                "contact.tilt": contact.tilt != "held",
                "contact.load_point": contact.load_point is not None,
                "contact.distant": bool(contact.distant),
                "law": self.law != LawChoice(),
            }
            if word:
                yield f"loads.normal: {word!r} is for flat damper faces; give a force with its unit"
            for where, given in only_flat.items():
                if given:
                    yield f"{where}: has no meaning for a {kind}; remove it"


def friction_on(scene: Scene) -> bool:
    """True when an output needs friction and there is some."""
    return scene.contact.friction > 0.0 and scene.wants(*FRICTION_WANTS)
