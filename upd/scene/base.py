"""What every scene has: recipe, outputs, material, mesh and solver."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from pydantic import AfterValidator, ConfigDict

from upd.mesh import recipes
from upd.scene.quantities import Density, Memory, Poisson, Share, Stress

STRICT = ConfigDict(extra="forbid", strict=False, allow_inf_nan=False)


def known_output(outputs: Mapping[str, str]) -> AfterValidator:
    """A name that is none of ``outputs`` is an error that lists them or names the nearest."""

    def check(value: str) -> str:
        if value not in outputs:
            near = difflib.get_close_matches(value, outputs, 1)
            raise ValueError(
                f"{value!r} is not an output"
                + (f", did you mean {near[0]!r}?" if near else f"; known: {', '.join(outputs)}")
            )
        return value

    return AfterValidator(check)


@dataclass(frozen=True)
class MaterialData:
    """Elastic constants of one body.

    E in MPa, nu, density in t/mm3 (used only when inertia is on).

    Attributes
    ----------
    yield_stress
        MPa; with it a contact checks whether the body yields (von Mises). None: not checked.
    """

    __pydantic_config__ = STRICT
    E: Stress
    nu: Poisson
    density: Density = 7.8e-9
    yield_stress: Stress | None = None


@dataclass(frozen=True)
class MeshChoice:
    """Element family, mirror symmetry, and the accuracy wanted instead of a mesh size."""

    __pydantic_config__ = STRICT
    element: Literal["hex8", "hex8i", "hex20", "hex27"] = "hex8i"
    symmetry: Literal["auto", "full", "half", "quarter"] = "auto"
    accuracy: Share | None = None


@dataclass(frozen=True)
class SolverChoice:
    """Linear solver (auto, pardiso, superlu, amg) and the memory it may use."""

    __pydantic_config__ = STRICT
    name: Literal["auto", "pardiso", "superlu", "amg"] = "auto"
    memory: Memory | None = None


@dataclass(frozen=True)
class LeftOut:
    """Largest relative change of a number by an effect left out before the run warns.

    Attributes
    ----------
    solve
        "yes": numbers are solved again with the effects left out; "no": no change is printed, as in
        a sweep whose scene was checked before.
    stiffness, frequency, peak
        Of contact stiffnesses and approaches; of natural and peak frequencies; of peak amplitudes.
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

    def wants(self, *names: str) -> bool:
        """True when at least one of the outputs is asked for."""
        return any(name in self.want for name in names)


class RecipeScene(SceneBase):
    """A scene whose recipe says which analysis it is for."""

    @property
    def analysis(self) -> str:
        """Name of the analysis."""
        return recipes.analysis(self.recipe)
