"""The outer surface of the meshes in a VTU file, with the fields on it.

Small enough for a page, and a picture of it without script.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.mesh import FloatArray, IntArray, Mesh
from upd.plot.plotly import pack

#: a displacement is drawn at most this part of the bodies' size
SCALE = 0.08
#: gap between bodies drawn apart, as a part of the bodies' size
_APART = 0.25
_LEVELS = 32767
_STRESS_NAME = re.compile(r"pressure_(?P<case>.*)")
_MOTION_NAME = re.compile(r"displacement_(?P<case>.*)|mode_(?P<number>\d+)_(?P<hertz>[\d.]+)Hz")


@dataclass(frozen=True)
class SurfaceBody:
    """Surface of one body: its own points (n, 3) in mm and triangles (m, 3).

    ``nodes`` are the points' numbers in the file.
    """

    name: str
    points: FloatArray
    triangles: IntArray
    nodes: IntArray


@dataclass(frozen=True)
class Field:
    """What is shown on the surface.

    Attributes
    ----------
    values
        Per body (n,), nan where the body has none; in ``unit``, or relative to the largest when
        that is "".
    motion
        Per body (n, 3), the direction and relative size of the displacement, largest 1; None
        when nothing moves.
    """

    label: str
    quantity: str
    unit: str
    values: tuple[FloatArray, ...]
    motion: tuple[FloatArray, ...] | None = None
    largest_mm: float = 0.0

    @property
    def top(self) -> float:
        """End of the colour scale: the largest displacement.

        Of pressures the 99th percentile, beyond which it is an edge's.
        """
        found = np.concatenate([v[np.isfinite(v) & (v > 0.0)] for v in self.values])
        if found.size == 0:
            return 1.0
        return (
            float(np.percentile(found, 99.0)) if self.quantity == "pressure" else float(found.max())
        )


@dataclass(frozen=True)
class Surface:
    """Surfaces of all bodies of a file, with fields."""

    label: str
    bodies: tuple[SurfaceBody, ...]
    fields: tuple[Field, ...]

    @property
    def size(self) -> float:
        """Diagonal of the box around the bodies, mm."""
        points = np.vstack(
            [b.points[np.unique(b.triangles)] for b in self.bodies if b.triangles.size]
        )
        return float(np.linalg.norm(np.ptp(points, axis=0)))


def read_surface(path: Path, names: list[str], label: str = "") -> Surface:
    """Outer faces and fields of a VTU file of `upd`.

    ``names`` of the bodies in the order of their numbers. Raises OSError, ValueError.
    """
    # meshio is slow to import: only when there is a mesh to read.
    import meshio

    try:
        file = meshio.read(path)
    except SystemExit as stop:
        # meshio ends the program at a file it cannot read.
        raise ValueError("is not a VTU file") from stop
    bodies = []
    number = np.asarray(file.point_data["body"]).astype(int)
    hexes = np.vstack([block.data for block in file.cells])
    for k in range(int(number.max()) + 1):
        mine = hexes[number[hexes[:, 0]] == k]
        name = names[k] if k < len(names) else f"body {k + 1}"
        mesh = Mesh(np.asarray(file.points, float), np.asarray(mine, np.int64))
        bodies.append(_body(name, mesh))
    return Surface(label, tuple(bodies), tuple(_fields(file.point_data, bodies)))


def _body(name: str, mesh: Mesh) -> SurfaceBody:
    # Pictures of modes draw the same faces.
    from upd.mesh.hexmesh import boundary_quads

    quads = boundary_quads(mesh)
    nodes, flat = np.unique(quads, return_inverse=True)
    q = flat.reshape(quads.shape)
    return SurfaceBody(
        name, mesh.points[nodes], np.vstack([q[:, [0, 1, 2]], q[:, [0, 2, 3]]]), nodes
    )


def _fields(data: Mapping[str, NDArray[Any]], bodies: list[SurfaceBody]) -> list[Field]:
    """Pressures first, then displacements or modes, in the order of the loads."""
    motions: dict[str, tuple[str, str, FloatArray, tuple[FloatArray, ...], float]] = {}
    for name, values in sorted(data.items()):
        found = _MOTION_NAME.fullmatch(name)
        if found and np.ndim(values) == 2:
            case = found["case"] or ""
            label = (
                f"F={case.removesuffix('N')} N"
                if case
                else f"mode {int(found['number'])}, {found['hertz']} Hz"
            )
            u = np.asarray(values, float)
            motions[case or name] = (label, "mm" if case else "", u, *_motion(u, bodies))
    out = []
    for name, values in data.items():
        found = _STRESS_NAME.fullmatch(name)
        if found:
            case = found["case"]
            moved = motions[case][3:] if case in motions else (None, 0.0)
            per_body = tuple(np.asarray(values, float)[b.nodes] for b in bodies)
            out.append(
                Field(
                    f"pressure, F={case.removesuffix('N')} N", "pressure", "MPa", per_body, *moved
                )
            )
    for label, unit, u, motion, largest in motions.values():
        length = tuple(np.linalg.norm(u[b.nodes], axis=1) for b in bodies)
        scale = 1e3 if unit else 1.0 / (largest or 1.0)
        title = f"displacement, {label}" if unit else label
        out.append(
            Field(
                title,
                "displacement",
                "µm" if unit else "",
                tuple(v * scale for v in length),
                motion,
                largest if unit else 0.0,
            )
        )
    return out


def _motion(u: FloatArray, bodies: list[SurfaceBody]) -> tuple[tuple[FloatArray, ...], float]:
    """Displacements relative to the largest; 0 on bodies without any."""
    still = np.nan_to_num(u, nan=0.0)
    largest = float(np.linalg.norm(still, axis=1).max())
    # Nothing moves: any divisor will do.
    return tuple(still[b.nodes] / (largest or 1.0) for b in bodies), largest


def offsets(surface: Surface) -> FloatArray:
    """How far each body is shifted along z when bodies that lie on each other are drawn apart,
    (n_body, 3) in mm.
    """
    used = [b.points[b.triangles.ravel()] for b in surface.bodies]
    out = np.zeros((len(used), 3))
    if len(used) != 2 or not all(len(points) for points in used):
        return out
    low, high = np.array([p.min(axis=0) for p in used]), np.array([p.max(axis=0) for p in used])
    # Only bodies that lie over each other: blades side by side stay where they are.
    if (low[:, :2] < high[::-1, :2]).all():
        out[np.argsort((low + high)[:, 2], kind="stable")[1], 2] = _APART * surface.size
    return out


def packed(surface: Surface) -> dict[str, Any]:
    """The surface for the page's script."""
    # a pressure moves as the displacement of its load
    motions = {id(f.motion): f.motion for f in surface.fields if f.motion is not None}
    places = {key: k for k, key in enumerate(motions)}
    fields = [
        {
            "label": f.label,
            "quantity": f.quantity,
            "unit": f.unit,
            "largest_mm": f.largest_mm,
            "values": [None if np.isnan(v).all() else pack(v) for v in f.values],
            "top": f.top,
            "motion": places.get(id(f.motion)),
        }
        for f in surface.fields
    ]
    bodies = [
        {
            "name": b.name,
            "points": pack(b.points.T.ravel()),
            "triangles": pack(b.triangles.T.ravel()),
            "n": len(b.points),
        }
        for b in surface.bodies
    ]
    return {
        "label": surface.label,
        "bodies": bodies,
        "fields": fields,
        "motions": [
            [pack(np.round(_LEVELS * u.T.ravel()).astype(np.int16)) for u in motion]
            for motion in motions.values()
        ],
        "apart": offsets(surface).tolist(),
        "reach": SCALE * surface.size,
        "span": surface.size,
        "levels": _LEVELS,
    }
