"""A mesh of one's own as a recipe: bodies and named sets of a .msh or .inp file.

Bodies are the physical volumes (gmsh) or the element sets (Abaqus, CalculiX); sets are the physical
surfaces or the node sets, named ``contact`` or ``BODY_contact``, whatever the case of the letters.
Boundary faces follow from the node sets; nodes that face each other are put in the same order.
Of a flat Abaqus or CalculiX file *NODE, *ELEMENT, *ELSET and *NSET are read; elements without a
volume, which gmsh writes of physical surfaces, are sets of nodes. Where a node or an element is
given twice the last one counts, as in Abaqus.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import TypeVar

import numpy as np

from upd.errors import InputError, OwnMeshError
from upd.mesh import FloatArray, IntArray, Mesh
from upd.mesh.checks import OUT_OF_LINE, in_pairs
from upd.mesh.fields import field_faults, whole
from upd.mesh.hexmesh import CENTRES, FACE_SIZE, NamedElements, boundary_faces

#: beginnings of the names of elements without a volume: plane and axisymmetric ones, shells,
#: membranes, bars
_THIN = (
    *("CPS", "CPE", "CAX", "S3", "S4", "S6", "S8", "S9", "STRI"),
    *("M3D", "SFM3D", "R3D", "T2D", "T3D", "B2", "B3"),
)
#: keywords and options that make nodes and elements elsewhere or move them
_NOT_READ = frozenset(
    {
        *("INSTANCE", "INCLUDE", "INPUT", "SYSTEM", "NMAP"),
        *("NGEN", "NFILL", "NCOPY", "ELGEN", "ELCOPY"),
    }
)
#: VTK's order of the nodes of a C3D27, which has its centre before those of the sides S1 ... S6
_C3D27 = np.argsort([*range(20), 26, *CENTRES])
#: largest label
_MOST = np.iinfo(np.int64).max


def read_inp(path: Path) -> tuple[FloatArray, list[NamedElements]]:
    """Points, in the order of the node labels, and the named groups of a file.

    Elements that no ELSET= names are in the group "". Raises ValueError, which names the line, for
    a damaged file and OwnMeshError for one that is not flat or has no volume.
    """
    deck = _Deck()
    for place, word, options, lines in _blocks(path.read_bytes()):
        if word in _NOT_READ or not _NOT_READ.isdisjoint(options):
            raise OwnMeshError(
                f"line {place}: {', '.join((f'*{word}', *options))}: is not read; to fix it: "
                "write a flat file, without parts and instances, all in one, in Cartesian "
                "coordinates"
            )
        if word == "NODE":
            found = [_number(int, line, 0) for line in lines]
            for label, line in zip(found, lines, strict=True):
                deck.nodes[label] = [_number(float, line, k) for k in (1, 2, 3)]
            if "NSET" in options:
                deck.nsets.setdefault(options["NSET"], []).extend(found)
        elif word == "ELEMENT":
            deck.add_elements(place, options, lines)
        elif word in ("NSET", "ELSET") and word in options:
            deck.add_set(word, options, lines)
    kinds = {kind for kind, _ in deck.elements.values()}
    if kinds and all(kind.startswith(_THIN) for kind in kinds):
        raise OwnMeshError(
            f"has {', '.join(sorted(kinds))} elements only, which have no volume; to fix it: write "
            "the mesh of the volumes, hexahedra C3D8, C3D20 or C3D27, each body with its ELSET"
        )
    labels = np.array(sorted(deck.nodes), dtype=np.int64)
    points = np.array([deck.nodes[n] for n in labels.tolist()], dtype=np.float64).reshape(-1, 3)
    return points, list(deck.groups(labels, points))


#: a data line: its place in the file, from 1, and what stands between its commas
_Line = tuple[int, list[str]]


#: a keyword: its place in the file, from 1, its word, its options in small letters, data lines
_Block = tuple[int, str, dict[str, str], list[_Line]]


@dataclass
class _Deck:
    """What a file holds, by label: nodes, elements, and the members of sets."""

    nodes: dict[int, list[float]] = field(default_factory=dict)
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    nsets: dict[str, list[int]] = field(default_factory=dict)
    elsets: dict[str, list[int]] = field(default_factory=dict)

    def add_elements(self, place: int, options: Mapping[str, str], lines: list[_Line]) -> None:
        kind = options.get("TYPE", "").upper()
        rows = [_integers(line) for line in lines]
        if size := _size(kind):
            numbers = [number for row in rows for number in row]
            if len(numbers) % (size + 1):
                raise ValueError(
                    f"line {place}: {kind} elements have {size} nodes each, these "
                    f"{len(numbers)} numbers are not whole elements"
                )
            rows = [numbers[k : k + size + 1] for k in range(0, len(numbers), size + 1)]
        self.elements |= {row[0]: (kind, row[1:]) for row in rows if row}
        self.elsets.setdefault(options.get("ELSET", ""), []).extend(row[0] for row in rows if row)

    def add_set(self, word: str, options: Mapping[str, str], lines: list[_Line]) -> None:
        known = self.nsets if word == "NSET" else self.elsets
        found = known.setdefault(options[word], [])
        for line in lines:
            if "GENERATE" in options:
                first, last, *step = _integers(line)
                found.extend(range(first, last + 1, step[0] if step else 1))
                continue
            for k, name in enumerate(line[1]):
                if name.lower() in known:
                    found.extend(known[name.lower()])
                elif name:
                    found.append(_number(int, line, k))

    def groups(self, labels: IntArray, points: FloatArray) -> Iterator[NamedElements]:
        """Sets with the places of their nodes among the sorted ``labels``."""
        for name, nodes in self.nsets.items():
            yield NamedElements(name, 0, "node", _numbered(nodes, labels, name))
        for name, members in self.elsets.items():
            rows: dict[str, list[list[int]]] = {}
            for label in dict.fromkeys(members):
                if label not in self.elements:
                    raise ValueError(f"{name} names the element {label}, which is not there")
                kind, nodes = self.elements[label]
                rows.setdefault(kind, []).append(nodes)
            for kind, table in rows.items():
                places = _numbered([n for row in table for n in row], labels, name)
                if size := _size(kind):
                    hexes = _in_order(places.reshape(-1, size), points)
                    yield NamedElements(name, 3, "Hexahedron", hexes)
                else:
                    yield NamedElements(
                        name, 2 if kind.startswith(_THIN) else 3, kind, places[:, None]
                    )


def _size(kind: str) -> int:
    """Nodes of a hexahedron, 0 for another element."""
    return next((n for n in (20, 27, 8) if kind.startswith(f"C3D{n}")), 0)


def _in_order(hexes: IntArray, points: FloatArray) -> IntArray:
    """Hexahedra in VTK's order.

    Those of 27 nodes may have Abaqus's, with the centre first after the 20.
    """
    if hexes.shape[1] < 27:
        return hexes
    centre = points[hexes[:, :8]].mean(axis=1)
    first, last = (np.linalg.norm(points[hexes[:, k]] - centre, axis=1).sum() for k in (20, 26))
    return hexes[:, _C3D27] if first < last else hexes


_Kind = TypeVar("_Kind", int, float)


def _number(kind: type[_Kind], line: _Line, column: int) -> _Kind:
    """One number of a line. Raises ValueError, which names the line."""
    place, cells = line
    try:
        number = kind(cells[column])
    except (ValueError, IndexError):
        found = ", ".join(cells)
        raise ValueError(f"line {place}: {found!r} has no number in column {column + 1}") from None
    if kind is int and abs(number) > _MOST:
        raise ValueError(f"line {place}: {number} is too large; labels go up to {_MOST}")
    return number


def _integers(line: _Line) -> list[int]:
    return [_number(int, line, k) for k, x in enumerate(line[1]) if x]


def _numbered(wanted: list[int], known: IntArray, name: str) -> IntArray:
    """Places of node labels among the sorted ``known`` ones."""
    labels = np.array(wanted, dtype=np.int64)
    places = np.minimum(np.searchsorted(known, labels), max(len(known) - 1, 0))
    if not len(known) or (known[places] != labels).any():
        raise ValueError(f"{name} names a node that is not there")
    return places.astype(np.int64)


def _blocks(data: bytes) -> Iterator[_Block]:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:  # comments may be in the Latin-1 of older programs
        text = data.decode("latin-1")
    block: _Block = (0, "", {}, [])
    for place, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*"):
            yield block
            first, *rest = (part.strip() for part in line[1:].split(","))
            pairs = (part.partition("=") for part in rest)
            options = {key.strip().upper(): value.strip().lower() for key, _, value in pairs}
            block = (place, first.upper(), options, [])
        else:
            block[3].append((place, [cell.strip() for cell in line.split(",")]))
    yield block


#: bodies of a rig without its damper, and the one of a rig with the damper glued in
_BLADES, _GLUED = ("left", "right"), "rig"
#: node sets of a sector
_FACES = {"low", "high"}
#: what reads a file: points and named groups
Reader = Callable[[Path], tuple[FloatArray, list[NamedElements]]]


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
        if faults := field_faults(self):
            raise InputError("; ".join(faults))


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


@dataclass(frozen=True)
class SectorFile(MeshFile):
    """Parameters of the mesh file of a sector of a bladed disk.

    Attributes
    ----------
    n_sectors
        Number of blades.
    """

    n_sectors: int = whole(0, 2, why="give that of the disk")


def recipe_of(path: Path, read_msh: Reader) -> ModuleType:
    """The file as a recipe: a module with ``build`` and the analysis its sets are for.

    ``read_msh`` reads files of gmsh.

    Raises
    ------
    InputError
        When the file cannot be read or is no mesh.
    OwnMeshError
        When it has no hexahedra or no named bodies.
    """
    meshes = _meshes(path, read_inp if path.suffix.lower() == ".inp" else read_msh)
    module = ModuleType(f"upd_mesh_{path.stem}")
    module.__file__ = str(path.resolve())
    rig = set(_BLADES) <= set(meshes)
    sector = all(set(mesh.nodes) >= _FACES for mesh in meshes.values())

    def build(params: MeshFile) -> dict[str, Mesh]:
        names = list(meshes)
        if isinstance(params, RigFile):
            names = [_GLUED] if params.damper == "glued" else list(_BLADES)
        if not set(names) <= set(meshes):
            raise OwnMeshError(
                f"there is no body {_GLUED!r}, the blades with the damper glued in; leave "
                '"glued" out of want'
            )
        return _scaled({name: meshes[name] for name in names}, params)

    # what a scene may give
    build.__annotations__["params"] = RigFile if rig else SectorFile if sector else MeshFile
    vars(module)["build"] = build
    # flat where all contact nodes lie in one plane, to what pairs of nodes may be out of line
    sets = [mesh.points[mesh.nodes.get("contact", [])] for mesh in meshes.values()]
    extents = [np.ptp(points, axis=0) for points in sets if len(points)]
    flat = bool(extents) and all(x[2] <= OUT_OF_LINE * x.max() for x in extents)
    other = "bladed disk" if sector else "flat contact" if flat else "curved contact"
    vars(module)["ANALYSIS"] = "rig" if rig else other
    return module


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


def _meshes(path: Path, read: Reader) -> dict[str, Mesh]:
    place = f"recipe {str(path)!r}"
    try:
        points, groups = read(path)
        bodies, sets = _by_name(groups)
        return in_pairs(
            {name: _body(name, cells, points, sets, bodies) for name, cells in bodies.items()}
        )
    except OwnMeshError as problem:
        raise OwnMeshError(f"{place}: {problem}") from None
    except OSError as problem:
        raise InputError(
            f"{place}: cannot be read ({problem.strerror}); give the path of a mesh"
        ) from None
    except (ValueError, KeyError, IndexError) as problem:
        raise InputError(
            f"{place}: is damaged or of another kind ({problem}); to fix it: correct it there or "
            "write the file again"
        ) from None


def _by_name(groups: Iterable[NamedElements]) -> tuple[dict[str, IntArray], dict[str, IntArray]]:
    """Hexahedra of the bodies and nodes of the sets, each once in the order of the file."""
    bodies: dict[str, list[IntArray]] = {}
    sets: dict[str, list[int]] = {}
    for name, dimension, kind, nodes in groups:
        if dimension < 3:
            sets.setdefault(name.lower(), []).extend(nodes.ravel().tolist())
        elif kind == "Hexahedron" and nodes.shape[1] in FACE_SIZE:
            bodies.setdefault(name.lower(), []).append(nodes)
        else:
            raise OwnMeshError(
                f"has {kind} elements; to fix it: mesh all bodies with hexahedra of 8, 20 or 27 "
                "nodes"
            )
    for name, parts in bodies.items():
        if len(sizes := sorted({cells.shape[1] for cells in parts})) > 1:
            raise OwnMeshError(
                f"body {name!r} has hexahedra of {' and '.join(map(str, sizes))} nodes; mesh it "
                "with one kind"
            )
        if twice := sum(map(len, parts)) - _different(parts):
            raise OwnMeshError(f"body {name!r} has {twice} hexahedra twice; write each once")
    stacked = {name: np.vstack(parts) for name, parts in bodies.items()}
    return (
        {name: stacked[name] for name in _chosen(stacked, sets)},
        {name: np.array(list(dict.fromkeys(nodes)), np.int64) for name, nodes in sets.items()},
    )


def _chosen(bodies: Mapping[str, IntArray], sets: Iterable[str]) -> list[str]:
    """The bodies: those that begin the name of a set, NAME_contact, when they hold all hexahedra;
    else all that have a name.
    """
    named = [name for name in bodies if name]
    begin = [name for name in named if any(key.startswith(f"{name}_") for key in sets)]
    whole, missing = _different(bodies.values()), 0
    for chosen in (begin, named):
        missing = whole - _different(bodies[name] for name in chosen)
        if chosen and not missing:
            return chosen
    raise OwnMeshError(
        (f"{missing} of {whole} hexahedra are in" if named else "has")
        + " no named body of hexahedra; to fix it: name the volumes (in gmsh a physical volume "
        "each, written without SaveAll; ELSET= or *ELSET in .inp)"
    )


def _different(parts: Iterable[IntArray]) -> int:
    """Number of different hexahedra."""
    corners = [np.sort(cells[:, :8], axis=1) for cells in parts]
    return len(np.unique(np.vstack(corners), axis=0)) if corners else 0


def _body(
    name: str,
    cells: IntArray,
    points: FloatArray,
    sets: Mapping[str, IntArray],
    bodies: Iterable[str],
) -> Mesh:
    """One body with its own node numbers, its sets and the boundary faces on them."""
    used, hexes = np.unique(cells, return_inverse=True)
    mesh = Mesh(points[used], hexes.reshape(cells.shape).astype(np.int64))
    nodes: dict[str, IntArray] = {}
    faces: dict[str, IntArray] = {}
    outside = boundary_faces(mesh)
    for label, numbers in sets.items():
        own = label.removeprefix(f"{name}_")
        others = any(label.startswith(f"{b}_") for b in bodies if b != name)
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
