"""Sectors of the tests: hexahedra between radii, angles and planes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from upd.fem import Material, box_mesh, mass, stiffness
from upd.fem.inertia import centrifugal_load, plane_mass, stress_stiffness
from upd.mesh import FloatArray, Mesh
from upd.reduction.cyclic import CyclicModel, Sector

STEEL = Material(2e5, 0.3, 7.8e-9)


def lattice_sector(
    radii: ArrayLike,
    degrees: ArrayLike,
    z: ArrayLike,
    keep: Callable[[float, float], bool] = lambda r, angle: True,
    n_node: int = 20,
) -> Mesh:
    """Cells of a polar lattice, kept by radius (mm) and angle (deg) of their centres; the face at
    the smallest radius is clamped.
    """
    box = box_mesh(radii, degrees, z, n_node)
    centres = box.points[box.hexes[:, :8]].mean(axis=1)
    cells = box.hexes[[keep(r, angle) for r, angle, _ in centres]]
    used, hexes = np.unique(cells, return_inverse=True)
    r, angle, height = box.points[used].T
    points = np.column_stack([r * np.cos(np.radians(angle)), r * np.sin(np.radians(angle)), height])
    sets = {
        "low": angle == np.min(degrees),
        "high": angle == np.max(degrees),
        "clamped": r == np.min(radii),
    }
    nodes = {name: np.flatnonzero(where) for name, where in sets.items()}
    return Mesh(points, hexes.reshape(-1, n_node).astype(np.int64), {}, nodes)


def bladed_sector() -> Mesh:
    """A twelfth of a bladed disk: six cells of 5 deg, cells 2 and 3 a blade, 1 to 4 a platform."""

    def keep(r: float, angle: float) -> bool:
        return r < 120 or 10 < angle < 20 or (140 < r < 150 and 5 < angle < 25)

    radii = [60, 90, 120, 140, 150, 185, 220]
    return lattice_sector(radii, np.arange(0, 31, 5), [-6, 0, 6], keep)


def with_contacts(mesh: Mesh) -> Mesh:
    """The bladed sector with the corners of its platform's ends as contact patches, and its tip."""
    x, y, z = mesh.points.T
    r, angle = np.hypot(x, y), np.degrees(np.arctan2(y, x))
    corner = np.isin(np.arange(mesh.n_node), mesh.hexes[:, :8])
    on = corner & ((r > 139) & (r < 151))
    sets = {
        "contact_right": np.flatnonzero(on & np.isclose(angle, 25)),
        "contact_left": np.flatnonzero(on & np.isclose(angle, 5)),
        "tip": np.flatnonzero(np.isclose(r, 220) & np.isclose(angle, 15) & np.isclose(z, 6)),
    }
    return Mesh(mesh.points, mesh.hexes, mesh.faces, {**mesh.nodes, **sets})


def model_of(
    mesh: Mesh, n_sectors: int, *, rotating: bool = False, element: str = "hex20"
) -> CyclicModel:
    """Of steel."""
    sector = Sector.of(mesh, n_sectors)
    K, M = stiffness(mesh, STEEL, element), mass(mesh, STEEL)
    model = CyclicModel.of(sector, K, M)
    if not rotating:
        return model
    u = model.static(centrifugal_load(mesh, M))
    return CyclicModel.of(sector, K, M, stress_stiffness(mesh, STEEL, u, element) - plane_mass(M))


def whole_ring(mesh: Mesh, n_sectors: int) -> tuple[Mesh, FloatArray]:
    """The mesh of all sectors with shared faces merged, and the sector of each hexahedron."""
    points, hexes = [], []
    for j in range(n_sectors):
        a = 2.0 * np.pi * j / n_sectors
        R = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
        points.append(mesh.points @ R.T)
        hexes.append(mesh.hexes + j * mesh.n_node)
    stacked = np.vstack(points)
    _, first, inverse = np.unique(
        np.round(stacked, 6) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    cells = inverse.ravel()[np.vstack(hexes)]
    ring = Mesh(stacked[first], cells.astype(np.int64))
    return ring, np.repeat(np.arange(n_sectors), mesh.n_hex)
