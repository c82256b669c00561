"""A mesh of one's own as a recipe: bodies and named sets of a .msh or .inp file.

Bodies are the physical volumes (gmsh) or the element sets (Abaqus, CalculiX); sets are the physical
surfaces or the node sets, named ``contact`` or ``BODY_contact``, whatever the case of the letters.
Boundary faces follow from the node sets; nodes that face each other are put in the same order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import TypeVar

import numpy as np

from upd.errors import InputError, OwnMeshError
from upd.mesh.boundary import boundary_faces
from upd.mesh.hexmesh import FloatArray, IntArray, Mesh
from upd.mesh.pairing import OUT_OF_LINE, in_pairs

#: endings of the files
ENDINGS = (".msh", ".inp")
#: bodies of a rig without its damper, and the one of a rig with the damper glued in
_BLADES, _GLUED = ("left", "right"), "rig"
_HEXES = {"hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27}


@dataclass(frozen=True)
class MeshFile:
    """Parameters of a mesh file.

    Attributes
    ----------
    scale
        Millimetres in a unit of length of the file: 1000 for one in metres.
    element_nodes
        Nodes per hexahedron, set by mesh.element: those of the file.
    """

    scale: float = 1.0
    element_nodes: int = 8

    def __post_init__(self) -> None:
        if not self.scale > 0.0:
            raise InputError(f"scale: {self.scale!r} is not positive; 1000 for a file in metres")


@dataclass(frozen=True)
class RigFile(MeshFile):
    """Parameters of the mesh file of two blades.

    Attributes
    ----------
    arrangement, damper, symmetry
        What the analysis asks for; the file holds the whole rig.
    """

    arrangement: str = "symmetric"
    damper: str = "none"
    symmetry: str = "full"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.symmetry != "full":
            raise InputError('symmetry: the file holds the whole rig; set mesh.symmetry = "full"')


@dataclass
class _Content:
    """What a file holds: points, bodies as hexahedra, sets as node numbers."""

    points: FloatArray
    bodies: dict[str, IntArray] = field(default_factory=dict)
    sets: dict[str, IntArray] = field(default_factory=dict)


def recipe_of(path: Path) -> ModuleType:
    """The file as a recipe: a module with ``build`` and the analysis its sets are for.

    Raises
    ------
    InputError
        When the file cannot be read or is no mesh.
    OwnMeshError
        When it has no hexahedra or no named bodies.
    """
    meshes = _meshes(path)
    module = ModuleType(f"upd_mesh_{path.stem}")
    module.__file__ = str(path.resolve())
    rig = set(_BLADES) <= set(meshes)

    def build_rig(params: RigFile) -> dict[str, Mesh]:
        names = [_GLUED] if params.damper == "glued" else list(_BLADES)
        if not set(names) <= set(meshes):
            raise OwnMeshError(
                f"there is no body {_GLUED!r}, the blades with the damper glued in; leave "
                '"glued" out of want'
            )
        return _scaled({name: meshes[name] for name in names}, params)

    def build(params: MeshFile) -> dict[str, Mesh]:
        return _scaled(meshes, params)

    vars(module)["build"] = build_rig if rig else build
    vars(module)["ANALYSIS"] = "rig" if rig else _contact_analysis(meshes)
    return module


def _contact_analysis(meshes: Mapping[str, Mesh]) -> str:
    """Flat where all contact nodes lie in one plane, curved else."""
    faces = [
        mesh.points[mesh.nodes["contact"]] for mesh in meshes.values() if "contact" in mesh.nodes
    ]
    # To what pairs of nodes may be out of line.
    extents = [np.ptp(points, axis=0) for points in faces if len(points)]
    flat = bool(extents) and all(x[2] <= OUT_OF_LINE * x.max() for x in extents)
    return "flat contact" if flat else "curved contact"


def _scaled(meshes: Mapping[str, Mesh], params: MeshFile) -> dict[str, Mesh]:
    for name, mesh in meshes.items():
        nodes = mesh.hexes.shape[1]
        if nodes != params.element_nodes:
            element = {8: "hex8", 20: "hex20", 27: "hex27"}[nodes]
            raise OwnMeshError(
                f"{name}: the file has hexahedra of {nodes} nodes; set mesh.element = "
                f'"{element}"' + (' or "hex8i"' if nodes == 8 else "")
            )
    return {name: mesh.with_points(params.scale * mesh.points) for name, mesh in meshes.items()}


def _meshes(path: Path) -> dict[str, Mesh]:
    try:
        content = _inp(path) if path.suffix.lower() == ".inp" else _msh(path)
    except OSError as problem:
        raise InputError(
            f"recipe {str(path)!r}: cannot be read ({problem.strerror}); give the path of a mesh"
        ) from None
    except (ValueError, KeyError, IndexError) as problem:
        raise InputError(
            f"recipe {str(path)!r}: is damaged or of another kind ({problem}); to fix it: correct "
            "it there or write the file again"
        ) from None
    if not content.bodies:
        raise OwnMeshError(
            f"recipe {str(path)!r}: has no named body of hexahedra; to fix it: name the volumes "
            "(physical volumes in gmsh, *ELEMENT ... ELSET=NAME in .inp)"
        )
    return in_pairs({name: _body(content, name) for name in content.bodies})


def _body(content: _Content, name: str) -> Mesh:
    """One body with its own node numbers, its sets and the boundary faces on them."""
    used, hexes = np.unique(content.bodies[name], return_inverse=True)
    mesh = Mesh(content.points[used], hexes.reshape(content.bodies[name].shape).astype(np.int64))
    nodes: dict[str, IntArray] = {}
    faces: dict[str, IntArray] = {}
    outside = boundary_faces(mesh)
    for label, numbers in content.sets.items():
        own = label.removeprefix(f"{name}_")
        others = any(label.startswith(f"{b}_") for b in content.bodies if b != name)
        mine = np.searchsorted(used, numbers)
        mine = np.minimum(mine, len(used) - 1)
        mine = mine[used[mine] == numbers]
        if not len(mine) or (own == label and others):
            continue
        nodes[own] = mine.astype(np.int64)
        on = np.zeros(mesh.n_node, dtype=bool)
        on[mine] = True
        whole = outside[on[outside].all(axis=1)]
        if len(whole):
            faces[own] = whole
    return Mesh(mesh.points, mesh.hexes, faces, nodes)


def _msh(path: Path) -> _Content:
    """A gmsh file, by meshio."""
    import meshio

    try:
        read = meshio.read(path, file_format="gmsh")
    except (meshio.ReadError, SystemExit) as problem:
        raise ValueError(f"no gmsh file: {problem}") from None
    names = {(int(tag), int(dim)): str(n).lower() for n, (tag, dim) in read.field_data.items()}
    content = _Content(np.asarray(read.points, dtype=np.float64))
    tags = read.cell_data.get("gmsh:physical", [np.zeros(len(b.data), int) for b in read.cells])
    for block, mine in zip(read.cells, tags, strict=True):
        for tag in np.unique(mine):
            cells = np.asarray(block.data, dtype=np.int64)[mine == tag]
            if block.type in _HEXES and (int(tag), 3) in names:
                _add_body(content, names[int(tag), 3], cells)
            elif block.dim == 3:
                raise OwnMeshError(_OTHER_CELLS.format(path=path, kind=block.type))
            elif (int(tag), block.dim) in names:
                name = names[int(tag), block.dim]
                known = content.sets.get(name, np.zeros(0, np.int64))
                content.sets[name] = np.union1d(known, cells.ravel())
    return content


_OTHER_CELLS = (
    "recipe '{path}': has {kind} elements outside a named body of hexahedra; to fix it: mesh all "
    "bodies with hexahedra of 8, 20 or 27 nodes and name each (ELSET= in .inp, a physical volume "
    "in gmsh)"
)


def _add_body(content: _Content, name: str, cells: IntArray) -> None:
    known = content.bodies.get(name)
    if known is not None and known.shape[1] != cells.shape[1]:
        raise OwnMeshError(
            f"body {name!r} has hexahedra of {known.shape[1]} and {cells.shape[1]} nodes; mesh it "
            "with one kind"
        )
    content.bodies[name] = cells if known is None else np.vstack([known, cells])


#: beginnings of the names of elements without a volume: plane and axisymmetric ones, shells,
#: membranes, bars
_THIN = (
    *("CPS", "CPE", "CAX", "S3", "S4", "S6", "S8", "S9", "STRI"),
    *("M3D", "SFM3D", "R3D", "T2D", "T3D", "B2", "B3"),
)


def _inp(path: Path) -> _Content:
    """A flat Abaqus or CalculiX file: *NODE, *ELEMENT with ELSET, *NSET.

    Elements without a volume, which gmsh writes of physical surfaces, are sets of nodes.
    """
    labels: list[int] = []
    points: list[list[float]] = []
    bodies: dict[str, list[list[int]]] = {}
    sets: dict[str, list[str]] = {}
    thin: set[str] = set()
    for block in _blocks(_text(path)):
        word, options, lines = block.word, block.options, block.lines
        if word in ("INSTANCE", "INCLUDE"):
            raise OwnMeshError(
                f"recipe '{path}': has *{word}; to fix it: write a flat file, without parts and "
                "instances, all in one"
            )
        if word == "NODE":
            for line in lines:
                labels.append(_number(int, line, 0))
                points.append([_number(float, line, k) for k in (1, 2, 3)])
        elif word == "ELEMENT" and lines:
            kind, name = options.get("TYPE", "").upper(), options.get("ELSET", "").lower()
            if kind.startswith(_THIN):
                thin.add(kind)
                if name:
                    nodes = (x for line in lines for x in line.cells[1:] if x)
                    sets.setdefault(name, []).extend(nodes)
                continue
            size = next((n for n in (20, 27, 8) if kind.startswith(f"C3D{n}")), 0)
            if not size or not kind:
                raise OwnMeshError(_OTHER_CELLS.format(path=path, kind=kind))
            if not name:
                raise OwnMeshError(
                    f"recipe '{path}': line {block.line}: the {kind} elements have no name; to fix "
                    f"it: *ELEMENT, TYPE={kind}, ELSET=NAME, the name of their body in the scene "
                    "(*ELSET blocks are not read)"
                )
            numbers = _integers(lines)
            if len(numbers) % (size + 1):
                raise ValueError(
                    f"line {block.line}: {kind} elements have {size} nodes each, these "
                    f"{len(numbers)} numbers are not whole elements"
                )
            table = np.array(numbers).reshape(-1, size + 1)
            bodies.setdefault(name, []).extend(table[:, 1:].tolist())
        elif word == "NSET" and "NSET" in options:
            name = options["NSET"].lower()
            if "GENERATE" in options:
                for line in lines:
                    first, last, *step = _integers([line])
                    every = range(first, last + 1, step[0] if step else 1)
                    sets.setdefault(name, []).extend(map(str, every))
            else:
                sets.setdefault(name, []).extend(x for line in lines for x in line.cells if x)
    if thin and not bodies:
        raise OwnMeshError(
            f"recipe '{path}': has {', '.join(sorted(thin))} elements only, which have no volume; "
            "to fix it: write the mesh of the volumes, hexahedra C3D8, C3D20 or C3D27, each body "
            "with its ELSET"
        )
    order = np.argsort(labels)
    sorted_labels = np.asarray(labels, dtype=np.int64)[order]
    content = _Content(np.array(points, dtype=np.float64).reshape(-1, 3)[order])
    for name, cells in bodies.items():
        _add_body(content, name, _numbered(np.array(cells, np.int64), sorted_labels, name))
    for name, words in sets.items():
        content.sets[name] = _numbered(_members(words, sets), sorted_labels, name)
    return content


def _text(path: Path) -> str:
    """The text of a file: keywords and numbers are ASCII, comments may be in the Latin-1 of older
    programs.
    """
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


@dataclass(frozen=True)
class _Line:
    """A data line: its place in the file, from 1, and what stands between its commas."""

    place: int
    cells: list[str]


_Kind = TypeVar("_Kind", int, float)


def _number(kind: type[_Kind], line: _Line, column: int) -> _Kind:
    """One number of a line. Raises ValueError, which names the line."""
    try:
        return kind(line.cells[column])
    except (ValueError, IndexError):
        found = ", ".join(line.cells)
        raise ValueError(
            f"line {line.place}: {found!r} has no number in column {column + 1}"
        ) from None


def _integers(lines: list[_Line]) -> list[int]:
    return [_number(int, line, k) for line in lines for k, x in enumerate(line.cells) if x]


def _members(words: list[str], sets: Mapping[str, list[str]]) -> IntArray:
    """Node labels of a set, which may name other sets; each once, in the order of the file."""
    found: list[int] = []
    for word in words:
        if word.lstrip("-").isdigit():
            found.append(int(word))
        else:
            found.extend(int(w) for w in sets[word.lower()] if w.isdigit())
    return np.array(list(dict.fromkeys(found)), dtype=np.int64)


def _numbered(labels: IntArray, known: IntArray, name: str) -> IntArray:
    """Places of node labels among the sorted ``known`` ones."""
    places = np.minimum(np.searchsorted(known, labels), max(len(known) - 1, 0))
    if not len(known) or (known[places] != labels).any():
        raise ValueError(f"{name} names a node that is not there")
    return places.astype(np.int64)


@dataclass(frozen=True)
class _Block:
    """A keyword with its place in the file, from 1, its options and data lines."""

    line: int
    word: str
    options: dict[str, str]
    lines: list[_Line]


def _blocks(text: str) -> Iterator[_Block]:
    block = _Block(0, "", {}, [])
    for place, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*"):
            yield block
            first, *rest = (part.strip() for part in line[1:].split(","))
            pairs = (part.partition("=") for part in rest)
            options = {key.strip().upper(): value.strip() for key, _, value in pairs}
            block = _Block(place, first.upper(), options, [])
        else:
            block.lines.append(_Line(place, [cell.strip() for cell in line.split(",")]))
    yield block
