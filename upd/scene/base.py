"""What all scenes have: recipe, outputs, material, mesh, solver; what those of two blades share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict

from upd.scene import quantities as q

#: fields of a scene that no file gives: its text with the values alone, its uncertain inputs, and
#: damping fitted to measured curves
INSIDE = ("text", "uncertain", "fitted")


@dataclass(frozen=True)
class MaterialData:
    """Elastic constants of one body.

    Attributes
    ----------
    E
        Young's modulus.
    nu
        Poisson's ratio.
    density
        Mass per volume, used where there is inertia: in modes, responses and the damper's mass.
    yield_stress
        With it a contact checks whether the body yields (von Mises); not checked when None. Cost:
        small.
    """

    E: q.Stress
    nu: q.Poisson
    density: q.Density = 7.8e-9
    yield_stress: q.Stress | None = None


@dataclass(frozen=True)
class MeshChoice:
    """Element family and mirror symmetry.

    Attributes
    ----------
    element
        Hexahedron: 8 nodes ("hex8"; "hex8i" with incompatible modes, which bends without locking),
        20 ("hex20"; "hex20r" with reduced integration, which does not lock in thin bodies and needs
        two elements across) or 27 ("hex27"). Cost: 20 and 27 nodes take four to eight times the
        dofs of the 8-node elements on the same divisions.
    symmetry
        Part of the model that is solved; "auto" uses the mirror planes that geometry, load and
        effects share. Cost: each mirror plane halves the dofs.
    """

    element: Literal["hex8", "hex8i", "hex20", "hex20r", "hex27"] = "hex8i"
    symmetry: Literal["auto", "full", "half", "quarter"] = "auto"


@dataclass(frozen=True)
class SolverChoice:
    """Linear solver and the memory it may use.

    Attributes
    ----------
    name
        "auto" takes pardiso where it is installed, superlu elsewhere; "amg" iterates with algebraic
        multigrid. Cost: pardiso condenses over ten times faster than superlu; amg needs the least
        memory.
    route
        How a curved contact sees its bodies: "condensed" onto the contact nodes, by one solution
        per node or a factor that has them in its front; "products" solves for the forces that the
        contact meets, some dozens; "auto" takes products where condensing does not fit the memory
        or takes twice as long. Cost: upd plan shows each.
    memory
        Above it, "auto" turns to the solver that needs less; without it, what is free on the
        machine. Cost: less memory takes more seconds.
    """

    name: Literal["auto", "pardiso", "superlu", "amg"] = "auto"
    route: Literal["auto", "condensed", "products"] = "auto"
    memory: q.Memory | None = None


@dataclass(frozen=True)
class LeftOut:
    """Largest relative change of a number by an effect left out before the run warns.

    Attributes
    ----------
    solve
        "yes": numbers are solved again with the effects left out; "no": no change is printed, as in
        a sweep whose scene was checked before. Cost: "no" saves the second solves, which upd plan
        lists.
    stiffness
        Largest change of contact stiffnesses and approaches.
    frequency
        Largest change of natural and peak frequencies.
    peak
        Largest change of peak amplitudes.
    """

    solve: Literal["yes", "no"] = "yes"
    stiffness: q.Share = 0.05
    frequency: q.Share = 0.01
    peak: q.Share = 0.05

    def limit(self, unit: str) -> float:
        """The limit of a number with this unit."""
        return {"Hz": self.frequency, "(m/s2)/N": self.peak}.get(unit, self.stiffness)

    @property
    def solves(self) -> bool:
        """Whether numbers are solved again."""
        return self.solve == "yes"


@dataclass(frozen=True, kw_only=True)
class SceneBase:
    """What every scene has. ``geometry`` holds the recipe's name under "recipe" and its parameters
    beside it, in mm.

    Attributes
    ----------
    name
        Of the run folder.
    title
        Heading of the page.
    want
        Outputs; all else follows from them. Cost: upd plan shows what each brings with it.
    accuracy
        Largest estimated error wanted, of all main numbers or of some by their names: the run
        chooses the cheapest levels that reach it. "unknown" leaves all errors unknown; when none,
        they are estimated on the scene's own levels. Cost: the companions of an estimate take up to
        a third of the run; half the error of a mesh takes about eight times the elements.
    geometry
        The recipe and its parameters.
    """

    #: of all tables of a scene: no other keys, no number that is not finite
    __pydantic_config__ = ConfigDict(extra="forbid", strict=False, allow_inf_nan=False)
    #: whether masses count
    moves: ClassVar[bool] = True
    #: tables that only this kind of scene has
    only: ClassVar[tuple[str, ...]] = ()

    name: q.Name
    title: str = ""
    want: tuple[str, ...]
    accuracy: q.Accuracy = None
    geometry: q.Geometry
    mesh: MeshChoice = field(default_factory=MeshChoice)
    solver: SolverChoice = field(default_factory=SolverChoice)
    left_out: LeftOut = field(default_factory=LeftOut)
    text: str = field(default="", repr=False)
    #: path -> input that is known within limits
    uncertain: Mapping[str, q.Uncertainty] = field(default_factory=dict, repr=False)

    @property
    def recipe(self) -> str:
        """Name of the recipe, or the path of the user's .py file."""
        return str(self.geometry["recipe"])

    @property
    def body_materials(self) -> Mapping[str, MaterialData]:
        """Material of every body; one of all bodies under "all"."""
        known: Any = self
        return known.materials if hasattr(known, "materials") else {"all": known.material}

    @property
    def estimates(self) -> bool:
        """Whether errors are estimated."""
        return bool(self.accuracy != q.UNKNOWN)

    @property
    def wanted_accuracy(self) -> float | Mapping[str, float] | None:
        """Largest estimated error of all main numbers, or of some by their names; None: the scene
        gives its levels itself.
        """
        return None if self.accuracy == q.UNKNOWN else self.accuracy

    def wants(self, *names: str) -> bool:
        """True when at least one of the outputs is asked for."""
        return any(name in self.want for name in names)

    def derived(self, data: Mapping[str, Any]) -> Any:
        """The scene with what follows from other keys as numbers, `data` as they were read. Raises
        InputError whose arguments are the problems.
        """
        return self


def repeated(path: str, values: Sequence[float | str]) -> list[str]:
    """Values that are in a list twice, numbers to six digits."""
    labels = [v if isinstance(v, str) else f"{v:g}" for v in values]
    return [
        f"{path}: {label} is duplicated (numbers are compared to six digits)"
        for label in sorted({x for x in labels if labels.count(x) > 1})
    ]


# -- two blades: material, the damper between them, the fit of its faces --------------------------

#: words of contact.fit -> how far the faces are worn in
FITS = {"unloaded": 0.0, "new": 0.0, "loaded": 1.0, "worn": 1.0}


def _fits(value: Any) -> bool:
    """Whether a value is a word of contact.fit, or a number 0 to 1."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return 0.0 <= value <= 1.0
    return isinstance(value, str) and value in FITS


Fit = Annotated[
    Any,
    q.must(
        _fits,
        'is no fit of the faces; write "new", "worn" (or "unloaded", "loaded"), or a number 0 to 1',
        "loaded, unloaded, worn, new, or 0 to 1",
    ),
]


@dataclass(frozen=True, kw_only=True)
class FaceFriction:
    """Coulomb friction on both faces of the damper, and their fit.

    Attributes
    ----------
    friction
        Coulomb's coefficient.
    fit
        How well the faces fit each other: "new" (flat, they touch everywhere without load), "worn"
        (worn in under F_C, which then presses evenly), or a number between, 0 new to 1 worn.
    """

    friction: q.Coefficient = 0.6
    fit: Fit = "new"

    @property
    def worn(self) -> float:
        """How far the faces are worn in, 0 to 1."""
        return FITS[self.fit] if isinstance(self.fit, str) else float(self.fit)


@dataclass(frozen=True, kw_only=True)
class DamperChoice:
    """The rigid damper; mass and inertia come from its mesh.

    Attributes
    ----------
    centrifugal
        Force through its centre of mass, upwards, F_C; or "from speed": F_C = m r w^2.
    mass
        Of the damper, spread evenly over its volume, instead of its density.
    radius
        Of the damper's centre of mass from the axis of rotation.
    speed
        Of the rotation.
    density
        Of the damper, where it is not of the blades' material; the density or the mass.
    """

    centrifugal: q.Centrifugal = 350.0
    mass: q.Mass | None = None
    radius: q.Radius | None = None
    speed: q.Speed | None = None
    density: q.Density | None = None


@dataclass(frozen=True, kw_only=True)
class RigBase(SceneBase):
    """A scene of two blades.

    Attributes
    ----------
    material
        Of blades, bases and damper.
    """

    material: MaterialData

    @property
    def arrangement(self) -> str:
        """Which sides of the platforms face each other, with a damper between them."""
        return str(self.geometry.get("arrangement", "symmetric"))


def rig_parameters(scene: Any, symmetry: str, element_nodes: int) -> dict[str, Any]:
    """Parameters that the recipe of a rig is given for the damper free between both blades.

    Parameters
    ----------
    scene
        A forced response or a seated damper.
    symmetry, element_nodes
        As the recipe names them.
    """
    return {
        **{k: v for k, v in scene.geometry.items() if k not in ("recipe", "damper")},
        "arrangement": scene.arrangement,
        "damper": "free",
        "symmetry": symmetry,
        "element_nodes": element_nodes,
    }


#: the problem of a yield stress where no contact is checked
YIELD_CHECKED = "material.yield_stress: is checked in a contact scene, body by body; remove it here"


def rig_problems(scene: RigBase) -> Iterator[str]:
    """What of material, mesh and solver does not fit the rig."""
    if scene.material.yield_stress is not None:
        yield YIELD_CHECKED
    if scene.mesh.symmetry == "quarter":
        yield 'mesh.symmetry: the rig has one mirror plane; use "half", "full" or "auto"'
    if scene.solver.name == "amg":
        yield (
            'solver.name: condensations of the blades need a direct solver; use "auto", '
            '"pardiso" or "superlu"'
        )


def unreachable_accuracy(scene: SceneBase, what: str, instead: str) -> list[str]:
    """The problem of a target accuracy where the levels are not chosen by the run.

    Parameters
    ----------
    what
        Of scene this is.
    instead
        What to raise for a better accuracy.
    """
    if scene.accuracy in (None, q.UNKNOWN):
        return []
    return [f"accuracy: {what} does not choose its levels itself; raise {instead}"]
