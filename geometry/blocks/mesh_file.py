"""A mesh file of gmsh (.msh), read by gmsh itself: it knows every version of its own format."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np

from geometry.blocks.gmsh_session import session
from geometry.blocks.hexahedron import local_order
from upd.mesh.hexmesh import FloatArray, IntArray, NamedElements

_HEAD = b"$MeshFormat"


def read_msh(path: Path) -> tuple[FloatArray, list[NamedElements]]:
    """Points and physical groups of a file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    points : (n, 3) ndarray
        In the order of the file's node numbers.
    groups : list of NamedElements
        A group may come in several parts; elements may be in several groups.

    Raises
    ------
    ValueError
        When the file is damaged or is not gmsh's.
    MeshError
        When gmsh cannot be loaded.
    """
    with path.open("rb") as file:
        head, version = file.readline(), file.readline()
    if not head.startswith(_HEAD):
        # gmsh would run the text of another file as a script
        raise ValueError(f"no gmsh file: it does not begin with {_HEAD.decode()}")
    with session(path.stem) as gmsh:
        # version 2 has the physical group of each element, gmsh that of each entity: elements of
        # one group become one entity
        old = version.startswith(b"2")
        gmsh.option.setNumber("Mesh.SwitchElementTags", int(old))
        try:
            gmsh.merge(str(path))
        except Exception as problem:  # gmsh raises nothing narrower
            raise ValueError(f"gmsh: {problem}") from None
        labels, coordinates, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(labels)
        points = np.asarray(coordinates, dtype=np.float64).reshape(-1, 3)[order]
        return points, list(_groups(gmsh, np.asarray(labels)[order], old=old))


def _groups(gmsh: ModuleType, labels: IntArray, *, old: bool) -> Iterator[NamedElements]:
    model = gmsh.model
    for dimension, entity in model.getEntities():
        tags = [entity] if old else model.getPhysicalGroupsForEntity(dimension, entity)
        names = [name for tag in tags if (name := model.getPhysicalName(dimension, tag))]
        if dimension == 3 and not names:
            names = [""]
        for number, _, nodes in zip(*model.mesh.getElements(dimension, entity), strict=True):
            kind, _, _, size, local, _ = model.mesh.getElementProperties(number)
            table = np.searchsorted(labels, nodes).astype(np.int64).reshape(-1, size)
            if kind.startswith("Hexahedron") and size in (8, 20, 27):
                table = table[:, local_order(np.asarray(local).reshape(-1, 3))]
            yield from (NamedElements(name, dimension, kind.split()[0], table) for name in names)
