"""What a scene calls for: effects simulated and left out (and how that is checked), size and cost. Nothing is solved here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from upd import recipes
from upd.errors import InputError
from upd.linalg import select
from upd.reference import contact_modulus, hertz_sphere, sphere_gap
from upd.scene import FRICTION_WANTS, Scene, friction_on

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


@dataclass(frozen=True)
class Plan:
    """Everything decided before the first number is computed. ``parameters`` go to the recipe as they are."""

    scene: Scene
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

    def effect(self, name: str) -> bool:
        """True when the effect is simulated."""
        return next(e.on for e in self.effects if e.name == name)


def make_plan(scene: Scene) -> Plan:
    """Derive the plan of ``scene``. Raises InputError when its parts do not fit together."""
    _two_materials(scene)
    symmetry, why = _symmetry(scene)
    families = _families(scene, symmetry)
    parameters = recipe_parameters(scene, symmetry)
    size = {body: dict(count) for body, count in recipes.count(scene.recipe, parameters).items()}
    missing = sorted(set(size) - set(scene.materials))
    spare = sorted(set(scene.materials) - set(size))
    if missing or spare:
        raise InputError(
            f"materials: the recipe makes the bodies {', '.join(size)}"
            + (f"; {', '.join(missing)} has no material" if missing else "")
            + (f"; {', '.join(spare)} is not one of them" if spare else "")
        )
    seconds, memory, solver, workers = _cost(scene, families, size)
    return Plan(scene, parameters, symmetry, families, _effects(scene, symmetry, why), size, solver, seconds, memory, workers)


def _two_materials(scene: Scene) -> None:
    if len(scene.materials) != 2:
        raise InputError(f"materials: a contact has two bodies, {len(scene.materials)} given ({', '.join(scene.materials)})")


def _symmetry(scene: Scene) -> tuple[str, str]:
    asked = scene.mesh.symmetry
    planes = "symmetry" in recipes.parameters(scene.recipe).__dataclass_fields__
    two = friction_on(scene) and scene.contact.directions == 2
    if asked != "auto":
        if asked != "full" and not planes:
            raise InputError(f'mesh.symmetry: the recipe {scene.recipe!r} has no mirror planes; use "full"')
        if asked != "full" and two:
            raise InputError('mesh.symmetry: the slip circle (contact.directions = 2) needs the full model; use "full" or "auto"')
        return asked, "asked for in the scene"
    if not planes:
        return "full", "the geometry has no mirror planes"
    if two:
        return "full", "slip in two directions is solved on the full model"
    return "quarter", "geometry, load and effects share both mirror planes"


def _families(scene: Scene, symmetry: str) -> tuple[Family, ...]:
    tangential: tuple[int, ...] = ()
    if friction_on(scene):
        tangential = (ALONG, ACROSS) if scene.contact.directions == 2 else (ALONG,)
    if symmetry != "quarter":
        mirror = {"plane_y": (1,)} if symmetry == "half" else {}
        return (Family((NORMAL, *tangential), mirror),)
    families = [Family((NORMAL,), {"plane_x": (0,), "plane_y": (1,)})]
    if tangential:
        # A load along x is odd about x = 0: the plane keeps u_x and holds u_y, u_z.
        families.append(Family(tangential, {"plane_x": (1, 2), "plane_y": (1,)}))
    return tuple(families)


def recipe_parameters(scene: Scene, symmetry: str) -> dict[str, Any]:
    """Parameters for the recipe: those of the scene, the symmetry, the nodes per element, and a patch sized from the load when "auto"."""
    parameters = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    if "symmetry" in known:
        parameters["symmetry"] = symmetry
    if "element_nodes" in known:
        parameters["element_nodes"] = NODES[scene.mesh.element]
    if parameters.get("patch") == "auto":
        parameters["patch"] = auto_patch(scene)
    if parameters.get("core_depth") == "auto":
        parameters["core_depth"] = auto_core_depth(scene, float(parameters["patch"]))
    return parameters


def _largest_contact(scene: Scene, load: float | None = None) -> float:
    """Hertz's radius in mm of the largest load (or of ``load``)."""
    (m1, m2) = list(scene.materials.values())[:2]
    load = max(scene.loads.normal) if load is None else load
    return float(hertz_sphere(load, _sphere(scene), contact_modulus(m1.E, m1.nu, m2.E, m2.nu)).radius)


def _sphere(scene: Scene) -> float:
    if scene.sphere_radius is None:
        raise InputError(f'geometry: "auto" sizes are known for a sphere on a plane only; recipe {scene.recipe!r} needs lengths')
    return scene.sphere_radius


def auto_core_depth(scene: Scene, patch: float) -> float:
    """Depth of the fine core relative to the patch: one contact radius, and deep enough for the sphere's curvature."""
    curvature = 2.0 * float(sphere_gap(patch / np.sqrt(2.0), _sphere(scene))) / patch
    return float(max(0.15, curvature, min(0.5, _largest_contact(scene) / patch)))


def auto_patch(scene: Scene, load: float | None = None) -> float:
    """Edge of the square patch in mm: 2.6 times the Hertz radius of the largest load, so that the rim stays clear of the contact."""
    load = max(scene.loads.normal) if load is None else load
    if not load > 0.0:
        raise InputError('geometry.patch: "auto" needs a positive normal load to size the patch; give the patch a length')
    return 2.6 * _largest_contact(scene, load)


def _effects(scene: Scene, symmetry: str, why_symmetry: str) -> tuple[Effect, ...]:
    mu, loads = scene.contact.friction, scene.loads
    friction = friction_on(scene)
    if friction:
        why_friction = f"mu = {mu:g} and the outputs {', '.join(w for w in scene.want if w in FRICTION_WANTS)}"
    elif scene.wants(*FRICTION_WANTS):
        why_friction = "mu = 0: no tangential force can be carried"
    else:
        why_friction = "no output asks for it"
    two = friction and scene.contact.directions == 2
    out = [
        Effect("unilateral contact", True, "the gap is curved: the contact set depends on the load"),
        Effect("friction", friction, why_friction, "" if friction else "no tangential force"),
    ]
    if friction:
        out += [
            Effect("slip in two directions", two, "asked for" if two else "the load has one direction", "" if two else "transverse slip"),
            Effect("normal-tangential coupling", False, "solved one after the other: exact when beta = 0", "Dundurs beta"),
            Effect(
                "load history",
                scene.wants("cycle"),
                "a full cycle is asked for" if scene.wants("cycle") else "first loading only",
                "" if scene.wants("cycle") else "first loading",
            ),
        ]
    curve = scene.wants("curve")
    return (
        *out,
        Effect("mirror symmetry", symmetry != "full", why_symmetry, "symmetric pressure" if symmetry == "full" else ""),
        Effect("load curve", curve, f"{loads.curve_points} points asked for" if curve else "single loads only"),
        Effect("internal displacement", *_internal(scene)),
        Effect("inertia", False, "every output is static: M is not assembled", "static outputs"),
        Effect("large displacement", False, "the contact is small against the body", "contact radius against sphere"),
    )


def _internal(scene: Scene) -> tuple[bool, str]:
    users = [w for w in scene.want if w in ("fields", "body_compression", "stiffness")]
    if friction_on(scene) and scene.contact.directions == 1:
        users.append("the check of transverse slip")
    if users:
        return True, "a back-substitution per load for " + ", ".join(users)
    return False, "no output asks for it: contact nodes only"


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
