"""Faces of a mesh: lattice of a blade's contact patch, tributary areas, frame; balance of a rigid
damper on both faces in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from upd.contact.rigid_damper import FaceForces, equilibrium
from upd.errors import InputError
from upd.mesh import FloatArray, IntArray, Mesh


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
