"""What every scene has: recipe, outputs, material, mesh and solver."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from pydantic import AfterValidator, ConfigDict

from upd.mesh import recipes
from upd.scene.quantities import (
    UNKNOWN,
    Density,
    Memory,
    Poisson,
    Share,
    Stress,
    Uncertainty,
)

#: fields a scene has inside, which no file gives: its text with the values alone, what it says of
#: how well it knows its inputs, and damping fitted to measured curves
INSIDE = ("text", "uncertain", "fitted")
STRICT = ConfigDict(extra="forbid", strict=False, allow_inf_nan=False)


@dataclass(frozen=True)
class OutputNames:
    """Outputs of an analysis, by name; any other name is an error that lists them or names the
    nearest.
    """

    outputs: Mapping[str, str]

    def __call__(self, value: str) -> str:
        if value not in self.outputs:
            near = difflib.get_close_matches(value, self.outputs, 1)
            known = ", ".join(self.outputs)
            raise ValueError(
                f"{value!r} is not an output"
                + (f", did you mean {near[0]!r}?" if near else f"; known: {known}")
            )
        return value


def known_output(outputs: Mapping[str, str]) -> AfterValidator:
    """A name that is none of ``outputs`` is an error that lists them or names the nearest."""
    return AfterValidator(OutputNames(outputs))


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
    E: Stress
    nu: Poisson
    density: Density = 7.8e-9
    yield_stress: Stress | None = None


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
    memory: Memory | None = None


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
    stiffness: Share = 0.05
    frequency: Share = 0.01
    peak: Share = 0.05

    def limit(self, unit: str) -> float:
        """The limit of a number with this unit."""
        return {"Hz": self.frequency, "(m/s2)/N": self.peak}.get(unit, self.stiffness)

    @property
    def solves(self) -> bool:
        """Whether numbers are solved again."""
        return self.solve == "yes"


class SceneBase:
    """Questions that every scene answers; its class has the fields ``geometry`` and ``want``."""

    geometry: Mapping[str, Any]
    want: tuple[str, ...]
    material: MaterialData
    accuracy: Any
    mesh: MeshChoice
    #: path -> what the scene says of how well it knows this input
    uncertain: Mapping[str, Uncertainty]
    #: whether masses count
    moves: ClassVar[bool] = True

    @property
    def recipe(self) -> str:
        """Name of the recipe, or the path of the user's .py file."""
        return str(self.geometry["recipe"])

    @property
    def body_materials(self) -> Mapping[str, MaterialData]:
        """Material of every body; "all" where they share one."""
        return {"all": self.material}

    @property
    def estimates(self) -> bool:
        """Whether errors are estimated."""
        return bool(self.accuracy != UNKNOWN)

    @property
    def wanted_accuracy(self) -> float | Mapping[str, float] | None:
        """Largest estimated error of all main numbers, or of some by their names; None: the scene
        gives its levels itself.
        """
        return None if self.accuracy == UNKNOWN else self.accuracy

    def wants(self, *names: str) -> bool:
        """True when at least one of the outputs is asked for."""
        return any(name in self.want for name in names)


class RecipeScene(SceneBase):
    """A scene whose recipe says which analysis it is for."""

    @property
    def analysis(self) -> str:
        """Name of the analysis."""
        return recipes.analysis(self.recipe)
