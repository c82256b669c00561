"""The outer surface of the meshes in a VTU file, with the fields on it, as the page's script draws
it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
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

#: surface of a body: its points' numbers in the file (n,), their places (n, 3) in mm, triangles
#: (m, 3)
Side = tuple[IntArray, FloatArray, IntArray]


def read_surface(path: Path, names: Sequence[str], label: str = "") -> dict[str, Any]:
    """Outer faces and fields of a VTU file of `upd`, ready for JSON.

    Parameters
    ----------
    names
        Of the bodies in the order of their numbers.

    Returns
    -------
    dict
        ``bodies`` with their packed ``points`` and ``triangles``; ``fields``, pressures first, then
        displacements or modes, in the order of the loads, with packed ``values`` per body (None
        where it has none) and the number of their ``motion``; ``motions``, packed parts of the
        largest displacement; how far bodies are drawn ``apart`` along z, mm.

    Raises
    ------
    OSError, ValueError
        For what is no such file.
    """
    # meshio is slow to import: only when there is a mesh to read.
    import meshio

    try:
        file = meshio.read(path)
    except SystemExit as stop:
        # meshio ends the program at a file it cannot read.
        raise ValueError("is not a VTU file") from stop
    number = np.asarray(file.point_data["body"]).astype(int)
    hexes = np.vstack([block.data for block in file.cells]).astype(np.int64)
    points = np.asarray(file.points, float)
    bodies = [_side(points, hexes[number[hexes[:, 0]] == k]) for k in range(number.max() + 1)]
    known = [*names, *(f"body {k + 1}" for k in range(len(names), len(bodies)))]
    span = float(np.linalg.norm(np.ptp(np.vstack([body[1] for body in bodies]), axis=0)))
    fields, motions = _fields(file.point_data, bodies)
    return {
        "label": label,
        "bodies": [
            {
                "name": name,
                "points": pack(places.T.ravel()),
                "triangles": pack(triangles.T.ravel()),
                "n": len(places),
            }
            for name, (_, places, triangles) in zip(known, bodies, strict=False)
        ],
        "fields": fields,
        "motions": motions,
        "apart": _offsets([body[1] for body in bodies], _APART * span).tolist(),
        "reach": SCALE * span,
        "span": span,
        "levels": _LEVELS,
    }


def _side(points: FloatArray, hexes: IntArray) -> Side:
    # Pictures of modes draw the same faces.
    from upd.mesh.hexmesh import boundary_faces

    quads = boundary_faces(Mesh(points, hexes))[:, :4]
    nodes, flat = np.unique(quads, return_inverse=True)
    q = flat.reshape(quads.shape)
    return nodes, points[nodes], np.vstack([q[:, [0, 1, 2]], q[:, [0, 2, 3]]])


def _fields(
    data: Mapping[str, NDArray[Any]], bodies: Sequence[Side]
) -> tuple[list[dict[str, Any]], list[Any]]:
    """Fields for the script, and the motions they name: a pressure moves as its load does."""
    pressures, moved = dict[str, Any](), dict[str, Any]()
    for name, values in data.items():
        if found := _STRESS_NAME.fullmatch(name):
            pressures[found["case"]] = np.asarray(values, float)
    for name, values in sorted(data.items()):
        found = _MOTION_NAME.fullmatch(name)
        if found and np.ndim(values) == 2:
            label = f"mode {int(found['number'])}, {found['hertz']} Hz" if found["number"] else ""
            moved[found["case"] or name] = label, np.asarray(values, float)
    # Nothing moves: any divisor will do.
    largest = {
        case: float(np.linalg.norm(np.nan_to_num(u), axis=1).max())
        for case, (_, u) in moved.items()
    }
    place = {case: k for k, case in enumerate(moved)}
    fields = []
    for case, values in pressures.items():
        field = _field(f"pressure, F={case.removesuffix('N')} N", "pressure", "MPa", values, bodies)
        moves = {"motion": place.get(case), "largest_mm": largest.get(case, 0.0)}
        fields.append(field | moves)
    for case, (label, u) in moved.items():
        length = np.linalg.norm(u, axis=1) * (1.0 / (largest[case] or 1.0) if label else 1e3)
        title = label or f"displacement, F={case.removesuffix('N')} N"
        field = _field(title, "displacement", "" if label else "µm", length, bodies)
        moves = {"motion": place[case], "largest_mm": 0.0 if label else largest[case]}
        fields.append(field | moves)
    motions = [
        [
            pack(np.round(_LEVELS / (largest[case] or 1.0) * part.T.ravel()).astype(np.int16))
            for part in (np.nan_to_num(u[nodes]) for nodes, *_ in bodies)
        ]
        for case, (_, u) in moved.items()
    ]
    return fields, motions


def _field(
    label: str, quantity: str, unit: str, values: FloatArray, bodies: Sequence[Side]
) -> dict[str, Any]:
    """A field on the bodies that have it; relative to the largest without a unit."""
    mine = [values[nodes] for nodes, *_ in bodies]
    shown = [None if np.isnan(v).all() else pack(v) for v in mine]
    found = np.concatenate(mine)
    found = found[found > 0.0]
    # of a pressure the last percentile is an edge's
    share = 99.0 if quantity == "pressure" else 100.0
    top = float(np.percentile(found, share)) if found.size else 1.0
    return {"label": label, "quantity": quantity, "unit": unit, "values": shown, "top": top}


def _offsets(bodies: Sequence[FloatArray], gap: float) -> FloatArray:
    """How far each body, points (n, 3), is shifted when bodies that lie on each other are drawn
    apart, (n_body, 3) in mm.
    """
    out = np.zeros((len(bodies), 3))
    if len(bodies) != 2 or not all(map(len, bodies)):
        return out
    low, high = np.array([p.min(axis=0) for p in bodies]), np.array([p.max(axis=0) for p in bodies])
    # Only bodies that lie over each other: blades side by side stay where they are.
    if (low[:, :2] < high[::-1, :2]).all():
        out[np.argsort((low + high)[:, 2], kind="stable")[1], 2] = gap
    return out
