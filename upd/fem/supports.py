"""Supports as a change of unknowns u = T q: fixed dofs leave, rigid sets move together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array, csr_array

from upd.errors import InputError
from upd.labels import Shown
from upd.mesh import FloatArray, IntArray

_AXES = "xyz"


@dataclass(frozen=True, repr=False)
class RigidSet(Shown):
    """Nodes that move as one.

    Parameters
    ----------
    nodes : (n,) array of int
        Node numbers.
    components : tuple of int, default (0, 1, 2)
        Components tied, each to one translation; the others stay free. (2,) is "one normal dof",
        (0, 1, 2) three translations.
    rotations : bool, default False
        With three more dofs, small rotations about the nodes' centroid; needs all three components.
    """

    nodes: IntArray
    components: tuple[int, ...] = (0, 1, 2)
    rotations: bool = False

    @property
    def n_dof(self) -> int:
        """Dofs of the set: 1 to 3, or 6."""
        return 6 if self.rotations else len(self.components)

    @property
    def dofs(self) -> IntArray:
        """(n * n_components,) dofs of the mesh that the set replaces, node by node."""
        return (
            3 * np.asarray(self.nodes, dtype=np.int64)[:, None]
            + np.array(self.components, dtype=np.int64)
        ).ravel()


@dataclass(frozen=True, repr=False)
class Reduction(Shown):
    """Change of unknowns u = T q.

    Attributes
    ----------
    T : (3 n_node, n_q) csr_array
        K, M and loads become T'KT, T'MT, T'f.
    place : (3 n_node,) array of int
        Number in q of a free dof, -1 for a fixed dof or one in a rigid set.
    rigid : mapping of str to (6,) or (n_components,) array of int
        Numbers in q of each rigid set: translations in the order of its components, then rotations
        about x, y, z.
    """

    T: csr_array
    place: IntArray
    rigid: Mapping[str, IntArray]


@dataclass(frozen=True, repr=False)
class Supports(Shown):
    """Fixed dofs and rigid sets of one body.

    Parameters
    ----------
    fixed : (n_fixed,) array of int, optional
        Dof numbers 3 * node + component, any order; naming one twice does no harm.
    rigid : mapping of str to RigidSet, optional
    """

    fixed: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    rigid: Mapping[str, RigidSet] = field(default_factory=dict)

    def reduction(self, points: FloatArray) -> Reduction:
        """The change of unknowns: free dofs first, in order, then the rigid sets in order.

        Parameters
        ----------
        points : (n_node, 3) ndarray
            mm.

        Returns
        -------
        Reduction

        Raises
        ------
        InputError
            That lists every error: dofs out of range, empty sets, a dof both fixed and rigid or in
            two rigid sets.
        """
        problems = list(_faults(self, len(points)))
        if problems:
            raise InputError("Supports: " + "; ".join(problems) + ".")
        free = np.ones(3 * len(points), dtype=bool)
        free[np.asarray(self.fixed, dtype=np.int64)] = False
        for one in self.rigid.values():
            free[one.dofs] = False
        kept = np.flatnonzero(free)
        place = np.full(len(free), -1)
        place[kept] = np.arange(len(kept))
        rows, columns, values = [kept], [place[kept]], [np.ones(len(kept))]
        numbers: dict[str, IntArray] = {}
        n_q = len(kept)
        for name, one in self.rigid.items():
            numbers[name] = np.arange(n_q, n_q + one.n_dof)
            motion = _motion(points, one)
            row, column = np.nonzero(motion)
            rows.append(one.dofs[row])
            columns.append(n_q + column)
            values.append(motion[row, column])
            n_q += one.n_dof
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return Reduction(csr_array(coo_array(entries, shape=(len(free), n_q))), place, numbers)


def _motion(points: FloatArray, one: RigidSet) -> FloatArray:
    """(n dofs of the nodes, n dofs of the set) motion of the nodes per unit dof of the set."""
    translations = np.tile(np.eye(len(one.components)), (len(one.nodes), 1))
    if not one.rotations:
        return translations
    arms = points[one.nodes] - points[one.nodes].mean(axis=0)
    return np.hstack([translations, _rotations(arms)])


def _rotations(arms: FloatArray) -> FloatArray:
    """(3 n, 3) displacements e_k x r of unit rotations about x, y, z."""
    return np.stack([np.cross(axis, arms).ravel() for axis in np.eye(3)], axis=1)


def rigid_body_modes(points: FloatArray) -> FloatArray:
    """Orthonormal rigid-body modes of a body: the near null space for algebraic multigrid.

    Parameters
    ----------
    points : (n_node, 3) ndarray
        mm.

    Returns
    -------
    (3 n_node, 6) ndarray
        Columns with unit norm; they span the three translations and three rotations.

    Raises
    ------
    InputError
        When the points lie on one line (a rotation about it moves nothing).
    """
    arms = points - points.mean(axis=0)
    size = np.linalg.norm(arms, axis=1).max(initial=0.0)
    spread = np.linalg.svd(arms, compute_uv=False) if len(points) >= 3 else np.zeros(3)
    if not spread[1] > len(points) * np.finfo(float).eps * spread[0]:
        raise InputError(
            f"{len(points)} points on one line have fewer than six rigid-body modes: give "
            "the points of a solid body."
        )
    Q, _ = np.linalg.qr(np.hstack([np.tile(np.eye(3), (len(points), 1)), _rotations(arms / size)]))
    return Q


def _faults(supports: Supports, n_node: int) -> Iterator[str]:
    """Every error of the supports, as text."""
    fixed = np.asarray(supports.fixed, dtype=np.int64)
    wrong = fixed[(fixed < 0) | (fixed >= 3 * n_node)]
    if wrong.size:
        yield f"fixed dof {wrong[0]} is not one of 0 to {3 * n_node - 1}: use 3 * node + component"
    owner: dict[int, str] = {}
    for name, one in supports.rigid.items():
        problem = _set_problem(name, one, n_node)
        if problem:
            yield problem
            continue
        both = np.intersect1d(one.dofs, fixed)
        if both.size:
            components = ", ".join(
                f"{_AXES[c]} ({count} nodes)"
                for c, count in sorted(Counter((both % 3).tolist()).items())
            )
            yield (
                f"rigid set {name!r} holds fixed dofs in component {components}, first "
                f"node {both[0] // 3}: "
                "take the component out of the set, or free those dofs"
            )
        shared = [dof for dof in one.dofs.tolist() if dof in owner]
        if shared:
            yield (
                f"rigid sets {owner[shared[0]]!r} and {name!r} share component "
                f"{_AXES[shared[0] % 3]} of node {shared[0] // 3}: "
                "give each node's component to one set"
            )
        owner.update(dict.fromkeys(one.dofs.tolist(), name))


def _set_problem(name: str, one: RigidSet, n_node: int) -> str:
    """What is wrong with one rigid set by itself; empty when nothing is."""
    nodes = np.asarray(one.nodes)
    if nodes.size == 0:
        return f"rigid set {name!r} has no nodes: name a set that the mesh has"
    if nodes.min() < 0 or nodes.max() >= n_node:
        return (
            f"rigid set {name!r} names node "
            f"{nodes.max() if nodes.max() >= n_node else nodes.min()}, the mesh has 0 to "
            f"{n_node - 1}"
        )
    if len(np.unique(nodes)) != nodes.size:
        return f"rigid set {name!r} has a duplicated node: list each node once"
    if (
        not one.components
        or not set(one.components) <= {0, 1, 2}
        or len(set(one.components)) != len(one.components)
    ):
        return f"rigid set {name!r} has components {one.components}: give one to three of 0, 1, 2"
    if one.rotations and one.components != (0, 1, 2):
        return (
            f"rigid set {name!r} has rotations without all three translations: use components "
            "(0, 1, 2)"
        )
    return ""
