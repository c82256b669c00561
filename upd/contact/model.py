"""Two elastic bodies as the contact solvers see them.

Compliance, tributary areas and gap at the contact nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from upd.contact.patch import Patch, make_patch
from upd.errors import MeshError
from upd.fem.surface import face_mass
from upd.linalg.symmetric import Matrix
from upd.mesh import Mesh

if TYPE_CHECKING:
    from upd.linalg.common import Condensed
    from upd.reduction.learned import LearnedCompliance

    Reduced = Condensed | LearnedCompliance

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Multipliers:
    """Where contact forces live on the contact faces.

    4- and 9-node faces: every node, P is the identity, the areas int phi dA are positive. On 9-node
    faces force over area alternates between corners, mid-edges and centres, because each kind of
    shape function averages a curved pressure in its own way. 8-node faces: the nodal forces of a
    uniform pressure alternate in sign, so the pressure is bilinear between the corner nodes, P its
    consistent load, and gaps are the averages P' g.

    Attributes
    ----------
    nodes : (n,) ndarray of int
        Places in the contact set of the nodes that carry a multiplier.
    spread : (n_contact, n) sparse array
        P: forces at all contact nodes are P lambda; its columns sum to one.
    weights : (n,) ndarray
        Tributary areas [mm2].
    mass : (n, n) sparse array or None
        Face mass matrix of 9-node faces [mm2].

    References
    ----------
    Multipliers of lower order: A. Popp et al., Int. J. Numer. Meth. Engng 83 (2010) 1428.
    """

    nodes: NDArray[np.int64]
    spread: sparse.csr_array
    weights: Array
    mass: sparse.csr_array | None = None

    def pressure(self, force: Array, loaded: NDArray[np.bool_] | None = None) -> Array:
        """Pressure at the multipliers, or traction, from their forces.

        4-node faces: force over area, the average of the pressure around the node. 8-node faces:
        the same, there exactly the bilinear pressure whose consistent load the forces are. 9-node
        faces: the biquadratic pressure that is zero off the loaded nodes and whose consistent load
        the forces are on them, M_AA p_A = f_A; it may be negative at an edge.

        Parameters
        ----------
        force : (n,) ndarray
            Forces [N].
        loaded : (n,) ndarray of bool, optional
            Nodes in contact; None takes those with a force.

        Returns
        -------
        (n,) ndarray
            Pressure [MPa].
        """
        if self.mass is None:
            return force / self.weights
        on = np.flatnonzero(force if loaded is None else loaded)
        pressure = np.zeros(len(force))
        if on.size:
            pressure[on] = splu(sparse.csc_array(self.mass[on][:, on])).solve(force[on])
        return pressure


def make_multipliers(mesh: Mesh) -> Multipliers:
    """Multipliers of the faces "contact" of a mesh.

    Parameters
    ----------
    mesh : Mesh
        With the node set and the faces "contact"; areas are projected on the plane z = 0.

    Returns
    -------
    Multipliers

    Raises
    ------
    MeshError
        When a contact face has a node that is not in the contact set.
    """
    contact, faces = mesh.nodes["contact"], mesh.faces["contact"]
    place = np.full(mesh.n_node, -1, np.int64)
    place[contact] = np.arange(len(contact))
    local = place[faces]
    if (local < 0).any():
        raise MeshError(
            "a contact face has a node that is not in the contact set: name the same nodes in both"
        )
    flat = mesh.points[contact] * np.array([1.0, 1.0, 0.0])
    M = sparse.csr_array(face_mass(flat, local))
    if local.shape[1] != 8:
        areas = np.asarray(M.sum(axis=0), float).ravel()
        return Multipliers(
            np.arange(len(contact)),
            sparse.eye_array(len(contact), format="csr"),
            areas,
            M if local.shape[1] == 9 else None,
        )
    corners = np.unique(local[:, :4])
    G = sparse.csr_array(M @ _bilinear_values(local, len(contact))[:, corners])
    weights = np.asarray(G.sum(axis=0), float).ravel()
    return Multipliers(corners, sparse.csr_array(G @ sparse.diags_array(1.0 / weights)), weights)


def _bilinear_values(faces: NDArray[np.int64], n: int) -> sparse.csc_array:
    """Values (n, n) of the corner nodes' bilinear functions at the nodes of 8-node faces.

    One at the corner, a half at mid-edges.
    """
    values = {(int(c), int(c)): 1.0 for c in np.unique(faces[:, :4])}
    for face in faces:
        for e in range(4):
            for c in (e, (e + 1) % 4):
                values[(int(face[4 + e]), int(face[c]))] = 0.5
    rows, cols = np.array(list(values)).T
    return sparse.csc_array((np.fromiter(values.values(), float), (rows, cols)), shape=(n, n))


@dataclass
class Body:
    """One body: its mesh, its stiffness, and one condensation per family of loads.

    Attributes
    ----------
    name : str
    mesh : Mesh
        With the node sets "contact" and "distant" (the far-field support), which is held node by
        node, or in the mean where the mesh gives it weights.
    K : (3 n_node, 3 n_node) Symmetric or sparse array
        Stiffness [N/mm].
    side : int
        +1 for the upper body, -1 for the lower.
    condensed : dict
        Components of a family of loads -> (condensation or learned compliance, free dofs of the
        mesh).
    """

    name: str
    mesh: Mesh
    K: Matrix
    side: int
    condensed: dict[tuple[int, ...], tuple[Reduced, NDArray[np.int64]]] = field(
        default_factory=dict
    )

    @property
    def contact(self) -> NDArray[np.int64]:
        """Nodes of the contact set, (n_contact,)."""
        return self.mesh.nodes["contact"]

    def _family(self, component: int) -> tuple[tuple[int, ...], Reduced, NDArray[np.int64]]:
        for components, (condensed, free) in self.condensed.items():
            if component in components:
                return components, condensed, free
        raise KeyError(component)

    def compliance(self, row: int, column: int | None = None) -> Array:
        """Compliance at the contact nodes, far-field support held.

        Parameters
        ----------
        row : int
            Component of the displacement (0, 1, 2 for x, y, z).
        column : int, optional
            Component of the forces; None takes `row`.

        Returns
        -------
        (n_contact, n_contact) ndarray
            Displacement along `row` per force along `column` [mm/N].
        """
        column = row if column is None else column
        components, condensed, _ = self._family(row)
        n = len(self.contact)
        i, j = components.index(row), components.index(column)
        block: Array = condensed.compliance()[i * n : (i + 1) * n, j * n : (j + 1) * n]
        return block

    def displacement(self, component: int, forces: Array) -> Array:
        """Displacement of the whole body under contact forces, far-field support held.

        Parameters
        ----------
        component : int
            Component of the forces (0, 1, 2 for x, y, z).
        forces : (n_contact,) ndarray
            Forces at the contact nodes [N].

        Returns
        -------
        (n_node, 3) ndarray
            Displacement [mm].
        """
        components, condensed, free = self._family(component)
        n = len(self.contact)
        load = np.zeros(n * len(components))
        k = components.index(component)
        load[k * n : (k + 1) * n] = forces
        u = np.zeros(3 * self.mesh.n_node)
        u[free] = condensed.under(load)
        return u.reshape(-1, 3)

    def reaction(self, displacement: Array, component: int) -> float:
        """Force with which the far-field support resists a displacement.

        Parameters
        ----------
        displacement : (n_node, 3) ndarray
            Displacement of the whole body [mm].
        component : int
            Component of the force (0, 1, 2 for x, y, z).

        Returns
        -------
        float
            Force [N].
        """
        rows = 3 * self.mesh.nodes["distant"] + component
        return float((self.K @ displacement.ravel())[rows].sum())


def free_dofs(mesh: Mesh, mirror: Mapping[str, tuple[int, ...]]) -> NDArray[np.int64]:
    """Dofs left when the far-field support is held and the mirror planes hold what they must.

    Parameters
    ----------
    mesh : Mesh
        With the node set "distant": held altogether, or, when it has weights, left to
        `upd.reduction.condense_held_in_mean`.
    mirror : mapping
        Node set of a mirror plane -> components held there.

    Returns
    -------
    (n_free,) ndarray of int
        Dof numbers 3 * node + component.
    """
    held = np.zeros((mesh.n_node, 3), bool)
    if "distant" not in mesh.weights:
        held[mesh.nodes["distant"]] = True
    for plane, components in mirror.items():
        for c in components:
            held[mesh.nodes[plane], c] = True
    return np.flatnonzero(~held.ravel())


@dataclass(frozen=True)
class ContactModel:
    """Upper and lower body with the multipliers and the patches they share.

    Attributes
    ----------
    upper, lower : Body
    multipliers : Multipliers
        n multipliers of the contact faces.
    patches : mapping
        Name -> Patch.
    gap : (n,) ndarray
        Initial gap at the multipliers [mm].
    """

    upper: Body
    lower: Body
    multipliers: Multipliers
    patches: Mapping[str, Patch]
    gap: Array

    @property
    def patch(self) -> Patch:
        """The patch of a contact that has only one."""
        (only,) = self.patches.values()
        return only

    def compliance(self, row: int, column: int | None = None, body: Body | None = None) -> Array:
        """Compliance at the multipliers, P' (C1 + C2) P.

        Parameters
        ----------
        row : int
            Component of the relative displacement (0, 1, 2 for x, y, z).
        column : int, optional
            Component of the forces; None takes `row`.
        body : Body, optional
            The share of one body; None: both.

        Returns
        -------
        (n, n) ndarray
            Compliance [mm/N].
        """
        # Forces are equal and opposite, so relative displacements add up for every pair of
        # components.
        first, *others = (self.upper, self.lower) if body is None else (body,)
        C = sum((one.compliance(row, column) for one in others), first.compliance(row, column))
        P = self.multipliers.spread
        return C if P.shape[0] == P.shape[1] else np.asarray(P.T @ (P.T @ C.T).T)

    def nodal(self, multipliers: Array) -> Array:
        """Forces at all contact nodes from those at the multipliers.

        Parameters
        ----------
        multipliers : (n,) ndarray
            Forces [N].

        Returns
        -------
        (n_contact,) ndarray
            Forces [N].
        """
        return np.asarray(self.multipliers.spread @ multipliers)


def make_contact_model(upper: Body, lower: Body, mirrored: tuple[bool, bool]) -> ContactModel:
    """The contact model of two bodies whose contact sets match node by node.

    Node sets "contact_..." are patches of their own; without them the set "contact" is the only
    one.

    Parameters
    ----------
    upper, lower : Body
    mirrored : tuple of two bool
        Which of the planes x = 0, y = 0 the model is cut at; a patch that does not reach the plane
        stands for itself and for its mirror image.

    Returns
    -------
    ContactModel

    Raises
    ------
    MeshError
        When the contact sets differ, or a contact face leaves its set.
    """
    a, b = upper.mesh.points[upper.contact], lower.mesh.points[lower.contact]
    if a.shape != b.shape:
        raise MeshError(
            f"contact sets differ: {upper.name} has {len(a)} nodes, {lower.name} has {len(b)}"
        )
    multipliers = make_multipliers(lower.mesh)
    gap = np.asarray(multipliers.spread.T @ (a[:, 2] - b[:, 2]))
    points, quads = b[multipliers.nodes], _quads(lower.mesh, multipliers)
    sets = {
        name.removeprefix("contact_"): nodes
        for name, nodes in lower.mesh.nodes.items()
        if name.startswith("contact_")
    }
    patches = {}
    for name, nodes in (sets or {"contact": lower.contact}).items():
        mine = np.flatnonzero(np.isin(lower.contact[multipliers.nodes], nodes))
        reaches = [m and bool((points[mine, k] == 0.0).any()) for k, m in enumerate(mirrored)]
        patches[name] = make_patch(
            points, multipliers.weights, (reaches[0], reaches[1]), mine, quads
        )
    return ContactModel(upper, lower, multipliers, patches, gap)


def _quads(mesh: Mesh, multipliers: Multipliers) -> NDArray[np.int64]:
    """Corners (m, 4), among the multipliers, of the contact faces; four to a face of 9 nodes."""
    place = np.full(mesh.n_node, -1, np.int64)
    place[mesh.nodes["contact"][multipliers.nodes]] = np.arange(len(multipliers.nodes))
    faces = place[mesh.faces["contact"]]
    if faces.shape[1] != 9:
        return faces[:, :4]
    quarters = [[k, 4 + k, 8, 4 + (k + 3) % 4] for k in range(4)]
    return faces[:, quarters].reshape(-1, 4)
