"""Fields of both faces on the lattices of the whole contact, mirror images included.

x along the damper from its middle, y up the slope from the patch's lower edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from upd.analyses.seated.interface import Array
from upd.analyses.seated.lattice import lattice, lines
from upd.analyses.seated.solve import SeatedSolution
from upd.mesh import IntArray, Mesh
from upd.scene.forced_contact import SIDES, Side


@dataclass(frozen=True)
class FacePatch:
    """One connected part of a face: a pad, or the whole of it.

    Attributes
    ----------
    name
        "pad 1" and so on; "" where the face is one.
    x, y
        Lattice lines, mm.
    at : (len(x), len(y)) array of int
        Node of the interface at each place.
    doubled : (len(x),) array of bool
        Lines on the mirror plane of a half, whose nodes carry half of the force.
    flipped : (len(x),) array of bool
        Lines of the mirror image.
    """

    side: Side
    name: str
    x: Array
    y: Array
    at: IntArray
    doubled: NDArray[np.bool_]
    flipped: NDArray[np.bool_]

    def field(self, values: Array, *, extensive: bool = False, odd: bool = False) -> Array:
        """(len(x), len(y)) of a field of the interface's nodes (n,).

        ``extensive``: forces and areas; ``odd``: the mirror image has the opposite.
        """
        out = np.asarray(values, float)[self.at]
        if extensive:
            out = np.where(self.doubled[:, None], 2.0 * out, out)
        return np.asarray(np.where(self.flipped[:, None], -out, out) if odd else out)


def face_patches(solution: SeatedSolution) -> list[FacePatch]:
    """The parts of both faces, left first, along the damper."""
    assert solution.bodies is not None
    out: list[FacePatch] = []
    first = 0
    for side in SIDES:
        mesh = solution.bodies.blades[side].mesh
        patch = lattice(mesh)
        local = mesh.points[patch.nodes] @ patch.frame.T
        up = local[:, 2] - local[:, 2].min()
        found = []
        for nodes in _parts(mesh, patch.nodes):
            found += _whole(side, nodes + first, local[nodes, 1], up[nodes], solution)
        found.sort(key=lambda one: float(one.x[0]))
        if len(found) > 1:
            found = [
                FacePatch(side, f"pad {k + 1}", p.x, p.y, p.at, p.doubled, p.flipped)
                for k, p in enumerate(found)
            ]
        out += found
        first += len(patch.nodes)
    return out


def _parts(mesh: Mesh, nodes: IntArray) -> list[IntArray]:
    """Places in `nodes` of each connected part of the patch."""
    faces = np.searchsorted(nodes, mesh.faces["patch"][:, :4])
    ends = np.concatenate([faces[:, [k, (k + 1) % 4]] for k in range(4)])
    n = len(nodes)
    graph = coo_array((np.ones(len(ends)), ends.T), shape=(n, n))
    count, part = connected_components(graph, directed=False)
    return [np.flatnonzero(part == k) for k in range(count)]


def _whole(
    side: Side, nodes: IntArray, along: Array, up: Array, solution: SeatedSolution
) -> list[FacePatch]:
    """A part with its mirror image: one where it lies on the plane, two else."""
    i, j = lines(along), lines(up)
    at = np.empty((int(i.max()) + 1, int(j.max()) + 1), np.int64)
    at[i, j] = nodes
    x, y = np.empty(len(at)), np.empty(at.shape[1])
    x[i], y[j] = along, up
    no = np.zeros(len(x), bool)
    if solution.interface.copies == 1:
        return [FacePatch(side, "", x, y, at, no, no)]
    if x[0] == 0.0:
        # the line on the plane once
        mirrored = np.concatenate((at[:0:-1], at))
        place = np.concatenate((-x[:0:-1], x))
        return [FacePatch(side, "", place, y, mirrored, place == 0.0, place < 0.0)]
    return [
        FacePatch(side, "", -x[::-1], y, at[::-1], no, ~no),
        FacePatch(side, "", x, y, at, no, no),
    ]
