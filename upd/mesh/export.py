"""Meshes and fields for other programs: .msh (gmsh), .vtu (ParaView), .inp (Abaqus, CalculiX).

Meshio is used here only.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.cache.files import placed_file
from upd.errors import InputError
from upd.mesh import FloatArray, IntArray, Mesh
from upd.mesh.hexmesh import owners

_CELL = {8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}
_QUAD = {4: "quad", 8: "quad8", 9: "quad9"}
#: formats that can be written
ENDINGS = (".msh", ".vtu", ".inp")
_ABAQUS = {8: ("C3D8I", "C3D8", "C3D8R"), 20: ("C3D20", "C3D20R")}
# longest data line that every reader of .inp takes
_PER_LINE = 16

Fields = Mapping[str, Mapping[str, ArrayLike]]


def write_mesh(meshes: Mapping[str, Mesh], path: Path | str, *, element: str | None = None) -> None:
    """Write the bodies to one file; its ending chooses the format.

    .msh : gmsh 2.2; bodies and named faces are physical groups ("sphere", "sphere_contact"). .vtu :
    hexahedra with the cell and point data "body" (0, 1, ... in the order of `meshes`). .inp :
    *NODE, *ELEMENT, *ELSET and *NSET per body, *SURFACE per named face, weights of node sets as
    comments (for *DISTRIBUTING COUPLING; none of the formats keeps them); `element` is the type,
    C3D8I or C3D20 when None. Lengths in mm. Raises InputError for another ending, an element type
    that does not fit, or a file that cannot be written.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise InputError(f"{path}: the ending {path.suffix!r} is not known; use .msh, .vtu or .inp")
    if element is not None and ending != ".inp":
        raise InputError(
            f"{path}: an element type ({element}) belongs to .inp files only; leave it out"
        )
    with placed_file(path) as temporary:
        if ending == ".inp":
            with temporary.open("w", encoding="ascii", newline="\n") as file:
                file.writelines(line + "\n" for line in _inp(meshes, element))
        else:
            (_write_msh if ending == ".msh" else _write_vtu)(meshes, temporary)


def write_fields(path: Path | str, meshes: Mapping[str, Mesh], point_data: Fields) -> None:
    """Write the bodies with nodal fields as .vtu.

    `point_data` is body -> name -> (n_node,) or (n_node, k).

    A field that only some bodies have is not a number on the others.
    Raises InputError for another ending, an unknown body or a wrong length.
    """
    path = Path(path)
    if path.suffix.lower() != ".vtu":
        raise InputError(f"{path}: fields are written as .vtu; choose that ending")
    data = _merged(meshes, point_data)
    with placed_file(path) as temporary:
        _write_vtu(meshes, temporary, data)


def _offsets(meshes: Mapping[str, Mesh]) -> IntArray:
    """Number of the first node of each body in the merged file."""
    if not meshes:
        raise InputError("export: there is no mesh to write")
    return np.concatenate([[0], np.cumsum([mesh.n_node for mesh in meshes.values()])]).astype(
        np.int64
    )


def _write_vtu(
    meshes: Mapping[str, Mesh], path: Path, point_data: Mapping[str, NDArray[Any]] | None = None
) -> None:
    import meshio

    cells = [
        (_CELL[mesh.hexes.shape[1]], mesh.hexes + first)
        for mesh, first in zip(meshes.values(), _offsets(meshes), strict=False)
    ]
    body = [np.full(mesh.n_hex, k) for k, mesh in enumerate(meshes.values())]
    nodes = np.repeat(np.arange(len(meshes)), [mesh.n_node for mesh in meshes.values()])
    data = {"body": nodes, **(point_data or {})}
    points = np.vstack([mesh.points for mesh in meshes.values()])
    meshio.Mesh(points, cells, point_data=data, cell_data={"body": body}).write(
        path, file_format="vtu"
    )


def _merged(meshes: Mapping[str, Mesh], point_data: Fields) -> dict[str, NDArray[Any]]:
    unknown = sorted(set(point_data) - set(meshes))
    if unknown:
        raise InputError(
            f"fields: there is no body {', '.join(unknown)}; the bodies are {', '.join(meshes)}"
        )
    first = _offsets(meshes)
    merged: dict[str, FloatArray] = {}
    for k, (body, mesh) in enumerate(meshes.items()):
        for name, values in point_data.get(body, {}).items():
            field = np.asarray(values, dtype=np.float64)
            if field.ndim not in (1, 2) or len(field) != mesh.n_node:
                raise InputError(
                    f"field {name!r} of {body}: has the shape {field.shape}, one row for "
                    f"each of {mesh.n_node} nodes is needed"
                )
            whole = merged.setdefault(name, np.full((first[-1], *field.shape[1:]), np.nan))
            if whole.shape[1:] != field.shape[1:]:
                raise InputError(
                    f"field {name!r} of {body}: has the shape {field.shape}, unlike that "
                    "of another body"
                )
            whole[first[k] : first[k + 1]] = field
    return dict(merged)


def _write_msh(meshes: Mapping[str, Mesh], path: Path) -> None:
    import meshio

    cells: list[tuple[str, IntArray]] = []
    tags: list[IntArray] = []
    groups: dict[str, IntArray] = {}
    for (body, mesh), first in zip(meshes.items(), _offsets(meshes), strict=False):
        parts = [(body, 3, _CELL[mesh.hexes.shape[1]], mesh.hexes)]
        parts += [
            (f"{body}_{name}", 2, _QUAD[faces.shape[1]], faces)
            for name, faces in mesh.faces.items()
        ]
        for name, dimension, kind, nodes in parts:
            groups[name] = np.array([len(groups) + 1, dimension])
            cells.append((kind, nodes + first))
            tags.append(np.full(len(nodes), len(groups), dtype=np.int64))
    points = np.vstack([mesh.points for mesh in meshes.values()])
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(points, cells, cell_data=data, field_data=groups).write(path, file_format="gmsh22")


def _inp(meshes: Mapping[str, Mesh], element: str | None) -> Iterator[str]:
    """Lines of an Abaqus input file; nodes and elements are numbered from 1 through all bodies."""
    names = [_label(body) for body in meshes]
    if len(set(names)) < len(names):
        raise InputError(
            f"export: the bodies {', '.join(meshes)} get the same name in capitals; rename one"
        )
    yield "*HEADING"
    yield "Lengths in mm: with N, MPa, tonne and s the units agree."
    # CalculiX reads 20 characters of a number: no more than 13 digits with sign, point and exponent
    yield "*NODE"
    number = 1
    for mesh in meshes.values():
        for n, (x, y, z) in enumerate(mesh.points.tolist(), start=number):
            yield f"{n}, {x:.13g}, {y:.13g}, {z:.13g}"
        number += mesh.n_node
    first_hex = 1
    for name, mesh, offset in zip(names, meshes.values(), _offsets(meshes), strict=False):
        yield f"*ELEMENT, TYPE={_type(mesh, element)}, ELSET={name}"
        for n, nodes in enumerate((mesh.hexes + offset + 1).tolist(), start=first_hex):
            yield from _lines([n, *nodes])
        yield f"*NSET, NSET={name}_NODES"
        yield from _lines(range(offset + 1, offset + mesh.n_node + 1), continued=False)
        for key, nodes in mesh.nodes.items():
            yield f"*NSET, NSET={name}_{_label(key)}, UNSORTED"
            yield from _lines((nodes + offset + 1).tolist(), continued=False)
            if key in mesh.weights:
                yield f"** weights of {name}_{_label(key)}, mm2, by node: held in their mean"
                for n, weight in zip(nodes + offset + 1, mesh.weights[key].tolist(), strict=True):
                    yield f"** {n}, {weight:.13g}"
        for key, faces in mesh.faces.items():
            yield f"*SURFACE, NAME={name}_{_label(key)}_FACES, TYPE=ELEMENT"
            for hexahedron, side in owners(mesh, faces, f"{name} {key}").tolist():
                yield f"{first_hex + hexahedron}, S{side + 1}"
        first_hex += mesh.n_hex


def _label(name: str) -> str:
    return re.sub(r"\W", "_", name, flags=re.ASCII).upper()


def _type(mesh: Mesh, element: str | None) -> str:
    size = mesh.hexes.shape[1]
    if size not in _ABAQUS:
        raise InputError(
            f".inp: CalculiX has no hexahedron with {size} nodes; mesh with 8 or 20 nodes, "
            "or write .vtu"
        )
    chosen = (element or _ABAQUS[size][0]).upper()
    if chosen not in _ABAQUS[size]:
        raise InputError(
            f".inp: element type {element!r} does not fit hexahedra with {size} nodes; use "
            f"one of {', '.join(_ABAQUS[size])}"
        )
    return chosen


def _lines(numbers: Iterable[int], *, continued: bool = True) -> Iterator[str]:
    """Data lines of at most 16 numbers.

    A comma at the end: the element continues in the next line.
    """
    items = [str(n) for n in numbers]
    for begin in range(0, len(items), _PER_LINE):
        last = begin + _PER_LINE >= len(items)
        yield ", ".join(items[begin : begin + _PER_LINE]) + ("," if continued and not last else "")
