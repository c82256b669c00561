"""What the scenes of two blades share: material, the damper between them, the fit of its faces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from upd.scene import quantities as q
from upd.scene.base import STRICT, MaterialData, Rotation, SceneBase

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
    """

    __pydantic_config__ = STRICT
    friction: q.Coefficient = 0.6
    fit: Fit = "new"

    @property
    def worn(self) -> float:
        """How far the faces are worn in, 0 to 1."""
        return FITS[self.fit] if isinstance(self.fit, str) else float(self.fit)


@dataclass(frozen=True, kw_only=True)
class DamperChoice(Rotation):
    """The rigid damper; mass and inertia come from its mesh.

    Attributes
    ----------
    centrifugal
        Force through its centre of mass, upwards, F_C; or "from speed": F_C = m r w^2.
    mass
        Of the damper, spread evenly over its volume, instead of its density.
    density
        Of the damper, where it is not of the blades' material; the density or the mass.
    """

    centrifugal: q.Centrifugal = 350.0
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
    def body_materials(self) -> Mapping[str, MaterialData]:
        """The one material, of all bodies."""
        return {"all": self.material}

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


def rig_problems(scene: RigBase) -> Iterator[str]:
    """What of material, mesh and solver does not fit the rig."""
    if scene.material.yield_stress is not None:
        yield "material.yield_stress: is checked in a contact scene, body by body; remove it here"
    if scene.mesh.symmetry == "quarter":
        yield 'mesh.symmetry: the rig has one mirror plane; use "half", "full" or "auto"'
    if scene.solver.name == "amg":
        yield (
            'solver.name: condensations of the blades need a direct solver; use "auto", '
            '"pardiso" or "superlu"'
        )


def unreachable_accuracy(scene: RigBase, what: str, instead: str) -> list[str]:
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
