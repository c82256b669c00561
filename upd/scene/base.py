"""What every scene has: recipe, outputs, material, mesh and solver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import ConfigDict

from upd.scene import quantities as q

#: fields of a scene that no file gives: its text with the values alone, its uncertain inputs, and
#: damping fitted to measured curves
INSIDE = ("text", "uncertain", "fitted")
STRICT = ConfigDict(extra="forbid", strict=False, allow_inf_nan=False)


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

    __pydantic_config__ = STRICT
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
        20 ("hex20") or 27 ("hex27"). Cost: hex20 and hex27 take four to eight times the dofs of
        the 8-node elements on the same divisions.
    symmetry
        Part of the model that is solved; "auto" uses the mirror planes that geometry, load and
        effects share. Cost: each mirror plane halves the dofs.
    """

    __pydantic_config__ = STRICT
    element: Literal["hex8", "hex8i", "hex20", "hex27"] = "hex8i"
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

    __pydantic_config__ = STRICT
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

    __pydantic_config__ = STRICT
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
class Rotation:
    """The centrifugal force on a damper, F_C, or what gives it: F_C = m r w^2.

    Attributes
    ----------
    radius
        Of the damper's centre of mass from the axis of rotation.
    speed
        Of the rotation.
    """

    __pydantic_config__ = STRICT
    centrifugal: q.Centrifugal | None = None
    mass: q.Mass | None = None
    radius: q.Radius | None = None
    speed: q.Speed | None = None


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

    __pydantic_config__ = STRICT
    #: whether masses count
    moves: ClassVar[bool] = True

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


def repeated(path: str, values: Sequence[float | str]) -> list[str]:
    """Values that are in a list twice, numbers to six digits."""
    labels = [v if isinstance(v, str) else f"{v:g}" for v in values]
    return [
        f"{path}: {label} is duplicated (numbers are compared to six digits)"
        for label in sorted({x for x in labels if labels.count(x) > 1})
    ]
