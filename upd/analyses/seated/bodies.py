"""The rig's bodies: both blades with K and M on their free dofs, and the damper between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from upd.analyses.base import Plan
from upd.fem import MassProperties, Material, mass, mass_properties, stiffness
from upd.linalg.parallel import in_parallel
from upd.linalg.symmetric import Symmetric
from upd.mesh import IntArray, Mesh, recipes
from upd.reduction import AttachedModel, ReducedModel
from upd.scene.forced_contact import SIDES, Side

_X, _Y = 0, 1


@dataclass(frozen=True)
class Blade:
    """One blade: mesh, K and M on its free dofs, and their numbers in the mesh."""

    side: Side
    mesh: Mesh
    K: Symmetric
    M: Symmetric
    free: IntArray

    def dofs(self, nodes: IntArray) -> IntArray:
        """Free dofs (3 per node) of nodes off the clamped faces and the mirror plane."""
        return np.asarray(
            np.searchsorted(self.free, (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel())
        )

    def probe(self, name: str) -> int:
        """Free dof along x of the node named `name`."""
        return int(np.searchsorted(self.free, 3 * int(self.mesh.nodes[name][0]) + _X))


@dataclass(frozen=True)
class Bodies:
    """Both blades, the damper's mass properties and its mesh.

    Reductions made so far, by the nodes they keep, or by their Gauss points up the slope and along
    the damper.
    """

    blades: Mapping[Side, Blade]
    damper: MassProperties
    damper_mesh: Mesh
    reduced: dict[tuple[Side, bytes], ReducedModel] = field(default_factory=dict)
    attached: dict[tuple[Side, int, int], AttachedModel] = field(default_factory=dict)

    @property
    def half(self) -> bool:
        """Whether they are the halves y >= 0."""
        return is_half(self.damper_mesh)


def make_bodies(plan: Plan[Any]) -> Bodies:
    """Meshes, matrices and the damper's mass properties, of the half the mesh is where it is one.

    Parameters
    ----------
    plan
        Of a scene of the rig with a free damper.
    """
    scene = plan.scene
    meshes, _ = recipes.build_mesh(scene.recipe, plan.parameters)
    material = Material(scene.material.E, scene.material.nu, scene.material.density)
    found = in_parallel(
        [partial(_blade, side, meshes[side], material, scene.mesh.element) for side in SIDES],
        plan.workers,
    )
    damper = meshes["damper"]
    own = Material(material.E, material.nu, scene.damper.density or scene.material.density)
    return Bodies({b.side: b for b in found}, mass_properties(damper, own), damper)


def bodies_key(plan: Plan[Any]) -> str:
    """Text of all that blades, damper and their reduction are made of.

    Parameters
    ----------
    plan
        Of a scene with both blades.
    """
    scene = plan.scene
    of = (scene.material, scene.mesh, scene.damper.density, scene.reduction, scene.solver)
    return repr((plan.parameters, *of))


def _blade(side: Side, mesh: Mesh, material: Material, element: Any) -> Blade:
    held = (3 * mesh.nodes["clamped"][:, None] + np.arange(3)).ravel()
    free = free_dofs(mesh, held)
    K, M = stiffness(mesh, material, element), mass(mesh, material)
    return Blade(side, mesh, Symmetric.of(K).submatrix(free), Symmetric.of(M).submatrix(free), free)


def is_half(mesh: Mesh) -> bool:
    """Whether the mesh is the half y >= 0 of a body."""
    return "plane_y" in mesh.nodes


def free_dofs(mesh: Mesh, held: IntArray) -> IntArray:
    """All dofs but those held, and those across the mirror plane of a half."""
    across = 3 * mesh.nodes["plane_y"] + _Y if is_half(mesh) else np.zeros(0, np.int64)
    return np.setdiff1d(np.arange(3 * mesh.n_node), np.concatenate([held, across]))
