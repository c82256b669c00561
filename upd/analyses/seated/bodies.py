"""The rig's bodies: both blades with K and M on their free dofs, the damper between them; lattice,
areas and frame of a blade's contact patch, and the balance of a rigid damper on both faces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from upd.analyses.base import Plan
from upd.contact.rigid_damper import FaceForces, equilibrium
from upd.errors import InputError
from upd.fem import MassProperties, Material, mass, mass_properties, stiffness
from upd.linalg.parallel import in_parallel
from upd.linalg.symmetric import Symmetric
from upd.mesh import FloatArray, IntArray, Mesh, recipes
from upd.reduction import AttachedModel, ReducedModel
from upd.scene.forced_contact import SIDES, Side

_X = 0
#: mirror family of motions of a half -> components the plane y = 0 holds: x and z move evenly in
#: "x", y does in "y"
FAMILIES = {"x": [1], "y": [0, 2]}
#: state of the damper -> the rigid one beside it; of the seated one friction opposes all it can
RIGID = {
    "seated": "rigid damper, full friction against F_C",
    "opposing": "rigid damper, full friction against F_C",
    "reversed": "rigid damper, full friction along F_C",
    "frictionless": "rigid damper without friction",
}


@dataclass(frozen=True)
class Blade:
    """A body of a rig, a blade, the damper, or all glued: mesh, K and M on its free dofs, their
    numbers in the mesh, and the mirror family of its motion, "" of a whole.
    """

    name: str
    mesh: Mesh
    K: Symmetric
    M: Symmetric
    free: IntArray
    family: str = ""

    def dofs(self, nodes: IntArray) -> IntArray:
        """Free dofs (3 per node) of nodes off the clamped faces and the mirror plane."""
        return np.asarray(
            np.searchsorted(self.free, (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel())
        )

    def probe(self, name: str) -> int:
        """Free dof along x of the node named `name`."""
        return int(np.searchsorted(self.free, 3 * int(self.mesh.nodes[name][0]) + _X))

    def whole(self, u: FloatArray) -> FloatArray:
        """Values (n, ...) of the free dofs on all dofs."""
        out = np.zeros((3 * self.mesh.n_node, *u.shape[1:]))
        out[self.free] = u
        return out


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
    jobs = [partial(make_blade, side, meshes[side], material, scene.mesh.element) for side in SIDES]
    found = in_parallel(jobs, plan.workers)
    damper = meshes["damper"]
    own = Material(material.E, material.nu, scene.damper.density or scene.material.density)
    blades = {side: blade for side, (blade,) in zip(SIDES, found, strict=True)}
    return Bodies(blades, mass_properties(damper, own), damper)


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


def make_blade(
    name: str, mesh: Mesh, material: Material, element: Any, families: Sequence[str] = ("x",)
) -> list[Blade]:
    """A body with K and M, once for every mirror family of a half."""
    K = Symmetric.of(stiffness(mesh, material, element))
    M = Symmetric.of(mass(mesh, material))
    out = []
    for family in families if is_half(mesh) else ("",):
        free = free_dofs(mesh, mesh.nodes.get("clamped", np.zeros(0, np.int64)), family)
        out.append(Blade(name, mesh, K.submatrix(free), M.submatrix(free), free, family))
    return out


def is_half(mesh: Mesh) -> bool:
    """Whether the mesh is the half y >= 0 of a body."""
    return "plane_y" in mesh.nodes


def free_dofs(mesh: Mesh, held: IntArray, family: str = "x") -> IntArray:
    """All dofs but those of held nodes, and those that the mirror plane of a half holds."""
    fixed = np.zeros((mesh.n_node, 3), bool)
    fixed[held] = True
    if is_half(mesh):
        fixed[mesh.nodes["plane_y"][:, None], FAMILIES[family]] = True
    return np.flatnonzero(~fixed.ravel())


# -- faces -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PatchLattice:
    """Corner nodes of a patch in rows up the slope and columns along the damper.

    Attributes
    ----------
    nodes, row, column
        (k,) numbers in the mesh, and the row (0 the lowest) and column of each.
    area
        (k,) tributary area, mm2.
    frame
        (3, 3) unit rows: normal, along the damper, up the slope.
    """

    nodes: IntArray
    row: IntArray
    column: IntArray
    area: FloatArray
    frame: FloatArray

    @property
    def n_row(self) -> int:
        """Rows, 0 the lowest."""
        return int(self.row.max()) + 1

    @property
    def n_column(self) -> int:
        """Columns along the damper."""
        return int(self.column.max()) + 1


def patch_frame(mesh: Mesh) -> FloatArray:
    """Unit rows: normal into the blade, along y, up the slope (with a positive z)."""
    p = mesh.points[mesh.faces["patch"][:, :4]]
    outward = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]).sum(axis=0)
    normal = -outward / np.linalg.norm(outward)
    along = np.array([0.0, 1.0, 0.0])
    up = np.cross(normal, along)
    up /= np.linalg.norm(up)
    return np.array([normal, along, up if up[2] > 0.0 else -up])


def lattice(mesh: Mesh) -> PatchLattice:
    """The lattice of a blade's patch."""
    faces = mesh.faces["patch"][:, :4]
    nodes, frame = np.unique(faces), patch_frame(mesh)
    p = mesh.points[faces]
    quarter = np.linalg.norm(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]), axis=1) / 8.0
    area = np.zeros(mesh.n_node)
    np.add.at(area, faces, quarter[:, None])
    local = mesh.points[nodes] @ frame.T
    return PatchLattice(nodes, lines(local[:, 2]), lines(local[:, 1]), area[nodes], frame)


def lines(x: FloatArray) -> IntArray:
    """Number of the lattice line of each node from its coordinate.

    Lines closer than half of the digits are one.
    """
    order = np.argsort(x)
    step = np.diff(x[order]) > np.sqrt(np.finfo(float).eps) * np.ptp(x)
    out = np.empty(len(x), np.int64)
    out[order] = np.concatenate([[0], np.cumsum(step)])
    return out


def face_angles(frames: FloatArray) -> tuple[float, float]:
    """Inclination of left and right face to the horizontal, deg.

    Parameters
    ----------
    frames
        (2, 3, 3) of each face, unit rows: normal into the blade, along the damper, up the slope.
    """
    x, _, z = frames[:, 0].T
    left, right = np.degrees(np.arctan2(np.abs(x), np.maximum(z, 0.0)))
    return float(left), float(right)


def rigid_balance(
    frames: FloatArray, centrifugal: float, friction: float, state: str
) -> FaceForces | None:
    """Forces of a rigid damper that slips on both faces; None where it jams before.

    Parameters
    ----------
    state
        "opposing", "frictionless" or "reversed".
    """
    try:
        return equilibrium(*face_angles(frames), centrifugal, friction, state)
    except InputError:
        return None
