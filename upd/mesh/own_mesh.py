"""A mesh of one's own as a recipe: bodies and named sets of a .msh or .inp file.

Bodies are the physical volumes (gmsh) or the element sets (Abaqus, CalculiX); sets are the physical
surfaces or the node sets, named ``contact`` or ``BODY_contact``, whatever the case of the letters.
Boundary faces follow from the node sets; nodes that face each other are put in the same order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from upd.errors import InputError, OwnMeshError
from upd.mesh.boundary import boundary_faces
from upd.mesh.hexmesh import FACE_SIZE, FloatArray, IntArray, Mesh, NamedElements
from upd.mesh.inp import read_inp
from upd.mesh.pairing import OUT_OF_LINE, in_pairs

#: endings of the files
ENDINGS = (".msh", ".inp")
#: bodies of a rig without its damper, and the one of a rig with the damper glued in
_BLADES, _GLUED = ("left", "right"), "rig"
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
