"""What a scene calls for: effects simulated and left out (and how that is checked), size and cost. Nothing is solved here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from upd import recipes
from upd.errors import InputError
from upd.linalg import select
from upd.mesh import Mesh
from upd.mesh_checks import require_sets
from upd.scene import Scene

#: element -> nodes per hexahedron
NODES = {"hex8": 8, "hex8i": 8, "hex20": 20, "hex27": 27}
#: symmetry -> how many copies of the model make the whole
COPIES = {"full": 1, "half": 2, "quarter": 4}
NORMAL, ALONG, ACROSS = 2, 0, 1

# Measured on one core at 2.1 GHz: microseconds per hexahedron to mesh and to assemble (element matrices and sparse matrix).
_MESH_US = 25.0
# Loads, checks, figures and files of a run; memory of the libraries.
_START_S, _START_BYTES = 4.0, 2.5e8
_ASSEMBLY_US = {"hex8": 9.0, "hex8i": 16.0, "hex20": 90.0, "hex27": 150.0}


@dataclass(frozen=True)
class Effect:
    """One effect of the model: simulated or left out, why, and the name of the check made after the solve."""

    name: str
    on: bool
    why: str
    check: str = ""


@dataclass(frozen=True)
class Family:
    """Load cases that share supports, hence one condensation per body.

    components : kept at the contact nodes and tied at the distant set (0 along the load, 1 across, 2 normal).
    mirror     : node set on a mirror plane -> components it holds.
    """

    components: tuple[int, ...]
    mirror: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    @property
    def label(self) -> str:
        return " + ".join({NORMAL: "normal", ALONG: "tangential x", ACROSS: "tangential y"}[c] for c in self.components)


S = TypeVar("S")


@dataclass(frozen=True)
class AnyPlan(Generic[S]):
    """Everything decided before the first number is computed. ``parameters`` go to the recipe as they are."""

    scene: S
    parameters: Mapping[str, Any]
    symmetry: str
    families: tuple[Family, ...]
    effects: tuple[Effect, ...]
    size: Mapping[str, Mapping[str, int]]
    solver: Mapping[str, str]
    seconds: float
    memory_bytes: float
    workers: int

    @property
    def copies(self) -> int:
        return COPIES[self.symmetry]

    @property
    def mirrors(self) -> tuple[int, ...]:
        """Coordinates whose zero is a mirror plane of the model, from the node sets its load families hold."""
        return tuple(sorted({"xyz".index(name[-1]) for family in self.families for name in family.mirror}))

    def effect(self, name: str) -> bool:
        """True when the effect is simulated."""
        return next(e.on for e in self.effects if e.name == name)


#: plan of a contact
Plan = AnyPlan[Scene]


def contact_plan(
    scene: Scene, symmetry: str, families: tuple[Family, ...], effects: Sequence[Effect], parameters: Mapping[str, Any]
) -> Plan:
    """The plan of a contact of two bodies, with its size and cost. Raises InputError when a body lacks its material."""
    two_bodies(scene)
    size = {body: dict(count) for body, count in recipes.count(scene.recipe, parameters).items()}
    if recipes.counted_by_mesh(scene.recipe):
        # The mesh is there: what it lacks is told before anything is written.
        require_contact_sets(scene, recipes.build_mesh(scene.recipe, parameters)[0], families)
    missing = sorted(set(size) - set(scene.materials))
    spare = sorted(set(scene.materials) - set(size))
    if missing or spare:
        raise InputError(
            f"materials: the recipe makes the bodies {', '.join(size)}"
            + (f"; {', '.join(missing)} has no material" if missing else "")
            + (f"; {', '.join(spare)} is not one of them" if spare else "")
        )
    seconds, memory, solver, workers = _cost(scene, families, size)
    return Plan(scene, parameters, symmetry, families, tuple(effects), size, solver, seconds, memory, workers)


def require_contact_sets(scene: Scene, meshes: Mapping[str, Mesh], families: tuple[Family, ...]) -> None:
    """Raise OwnMeshError unless the bodies name their contact, what is held, and the mirror planes of the loads."""
    planes = sorted({plane for family in families for plane in family.mirror})
    held = {name for name in scene.contact.distant if f"distant_{scene.contact.distant[name]}" in getattr(meshes.get(name), "nodes", ())}
    require_sets(scene.recipe, meshes, ("contact", *planes), ("contact",))
    require_sets(scene.recipe, {name: mesh for name, mesh in meshes.items() if name not in held}, ("distant",))


def two_bodies(scene: Scene) -> None:
    """Raise InputError unless the scene has two materials, one per body."""
    if len(scene.materials) != 2:
        raise InputError(f"materials: a contact has two bodies, {len(scene.materials)} given ({', '.join(scene.materials)})")


def mesh_parameters(scene: Scene, symmetry: str) -> dict[str, Any]:
    """Parameters for the recipe: those of the scene, the symmetry and the nodes per element."""
    parameters = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    if "symmetry" in known:
        parameters["symmetry"] = symmetry
    if "element_nodes" in known:
        parameters["element_nodes"] = NODES[scene.mesh.element]
    return parameters


def _cost(scene: Scene, families: tuple[Family, ...], size: Mapping[str, Mapping[str, int]]) -> tuple[float, float, dict[str, str], int]:
    """Predicted seconds and bytes, the solver of every condensation, and how many of them may run side by side."""
    seconds, memory, solver = _START_S, _START_BYTES, {}
    for body, count in size.items():
        n_dof = 3 * count["nodes"]
        seconds += 1e-6 * count["hexes"] * (_MESH_US + _ASSEMBLY_US[scene.mesh.element])
        for family in families:
            n_kept = len(family.components) * count["contact"]
            choice = select.choose(n_dof, n_kept, solver=scene.solver.name, memory_limit_bytes=scene.solver.memory)
            predicted = select.predict(n_dof, n_kept, choice.name)
            seconds += predicted.seconds
            # Every factor is kept for the internal displacement.
            memory += predicted.bytes
            solver[f"{body}, {family.label}"] = f"{choice.name}: {choice.why}"
    limit = scene.solver.memory if scene.solver.memory is not None else select.memory_left()
    # SuperLU and multigrid change process-wide warning filters while they run: one at a time.
    side_by_side = memory <= limit and all(why.startswith("pardiso") for why in solver.values())
    workers = min(select.threads(), len(solver)) if side_by_side else 1
    return seconds, memory, solver, workers
