"""Files read back by their own readers: gmsh for .msh, meshio for .vtu, a small parser for .inp."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from geometry.blocks import import_gmsh, read_msh
from geometry.sphere_block import SphereBlock, build
from upd.errors import InputError, MeshError
from upd.fem import box_mesh
from upd.mesh import Mesh
from upd.mesh.export import write_fields, write_mesh
from upd.mesh.own_mesh import MeshFile, recipe_of

SIZES = (8, 20, 27)


@pytest.fixture(scope="module")
def made() -> dict[int, dict[str, Mesh]]:
    return {
        size: build(SphereBlock(divisions=4, growth=2.0, symmetry="quarter", element_nodes=size))
        for size in SIZES
    }


def n_nodes(meshes: dict[str, Mesh]) -> int:
    return sum(mesh.n_node for mesh in meshes.values())


@pytest.mark.parametrize("size", SIZES)
def test_msh_read_by_gmsh(made: dict[int, dict[str, Mesh]], size: int, tmp_path: Path) -> None:
    path = tmp_path / "model.msh"
    write_mesh(made[size], path)
    gmsh = import_gmsh()
    gmsh.initialize(argv=["test"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        groups = {
            gmsh.model.getPhysicalName(d, t): (d, t) for d, t in gmsh.model.getPhysicalGroups()
        }
        assert set(groups) == {
            "sphere",
            "block",
            "sphere_contact",
            "sphere_distant",
            "block_contact",
            "block_distant",
        }
        points = gmsh.model.mesh.getNodes()[1].reshape(-1, 3)
        assert len(points) == n_nodes(made[size])
        for name, mesh in made[size].items():
            dimension, tag = groups[name]
            (entity,) = gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)
            (kind,), (tags,), _ = gmsh.model.mesh.getElements(dimension, entity)
            assert len(tags) == mesh.n_hex
            # gmsh's own node order makes gmsh's own Jacobian positive and its volume right
            at, weight = gmsh.model.mesh.getIntegrationPoints(kind, "Gauss4")
            _, det, _ = gmsh.model.mesh.getJacobians(kind, at, entity)
            det = np.asarray(det).reshape(-1, len(weight))
            assert det.min() > 0.0
            if name == "block":
                assert np.sum(det * weight) == pytest.approx(250.0, rel=1e-12)
            nodes, _ = gmsh.model.mesh.getNodesForPhysicalGroup(*groups[f"{name}_contact"])
            assert len(nodes) == len(mesh.nodes["contact"])
    finally:
        gmsh.finalize()


@pytest.mark.parametrize("size", SIZES)
def test_vtu_holds_points_cells_and_bodies(
    made: dict[int, dict[str, Mesh]], size: int, tmp_path: Path
) -> None:
    path = tmp_path / "model.vtu"
    write_mesh(made[size], path)
    back = meshio.read(path)
    assert np.array_equal(back.points, np.vstack([mesh.points for mesh in made[size].values()]))
    kind = {8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}[size]
    cells = np.vstack([block.data for block in back.cells])
    assert {block.type for block in back.cells} == {kind}
    first = made[size]["sphere"].n_node
    assert np.array_equal(
        cells, np.vstack([made[size]["sphere"].hexes, made[size]["block"].hexes + first])
    )
    assert np.array_equal(
        np.unique(cells[np.concatenate(back.cell_data["body"]) == 1]),
        first + np.arange(made[size]["block"].n_node),
    )
    assert np.array_equal(
        back.point_data["body"], np.repeat([0, 1], [m.n_node for m in made[size].values()])
    )


def test_fields_go_to_their_bodies(made: dict[int, dict[str, Mesh]], tmp_path: Path) -> None:
    meshes, path = made[8], tmp_path / "fields.VTU"
    sphere, block = meshes["sphere"], meshes["block"]
    write_fields(
        path,
        meshes,
        {
            "sphere": {"displacement": sphere.points, "pressure": np.arange(sphere.n_node)},
            "block": {"displacement": -block.points},
        },
    )
    back = meshio.read(path, file_format="vtu")
    assert np.array_equal(
        back.point_data["displacement"], np.vstack([sphere.points, -block.points])
    )
    assert np.array_equal(back.point_data["pressure"][: sphere.n_node], np.arange(sphere.n_node))
    assert np.all(np.isnan(back.point_data["pressure"][sphere.n_node :]))


def parsed(path: Path) -> dict[str, list[list[str]]]:
    """Keyword line (upper case, without blanks) -> data lines, those that end in a comma joined
    with the next.
    """
    out: dict[str, list[list[str]]] = {}
    data: list[list[str]] = []
    going_on = False
    for line in path.read_text().splitlines():
        assert len(line.split(",")) <= 17
        if line.startswith("*"):
            assert line not in out
            data = out[line.replace(" ", "")] = []
            continue
        items = [item.strip() for item in line.split(",")]
        if going_on:
            data[-1] += items
        else:
            data.append(items)
        going_on = items[-1] == ""
        if going_on:
            data[-1].pop()
    return out


@pytest.mark.parametrize(
    ("size", "kind"), [(8, "C3D8I"), (8, "C3D8"), (20, "C3D20"), (20, "C3D20R")]
)
def test_inp_sets_and_surfaces(
    made: dict[int, dict[str, Mesh]], size: int, kind: str, tmp_path: Path
) -> None:
    path = tmp_path / "model.inp"
    meshes = made[size]
    write_mesh(meshes, path, element=kind)
    deck = parsed(path)
    points = {int(row[0]): np.array(row[1:], dtype=float) for row in deck["*NODE"]}
    assert list(points) == list(range(1, n_nodes(meshes) + 1))
    assert max(len(x) for row in deck["*NODE"] for x in row) <= 20, (
        "CalculiX reads no more of a number"
    )
    # 13 digits
    assert np.array(list(points.values())) == pytest.approx(
        np.vstack([m.points for m in meshes.values()]), rel=5e-13, abs=0.0
    )
    numbers: list[int] = []
    for body, mesh in meshes.items():
        name = body.upper()
        rows = np.array(deck[f"*ELEMENT,TYPE={kind},ELSET={name}"], dtype=int)
        assert rows.shape == (mesh.n_hex, size + 1)
        numbers += rows[:, 0].tolist()
        elements = {row[0]: row[1:] for row in rows}
        for key, nodes in mesh.nodes.items():
            listed = [
                int(n) for row in deck[f"*NSET,NSET={name}_{key.upper()},UNSORTED"] for n in row
            ]
            assert np.array([points[n] for n in listed]) == pytest.approx(
                mesh.points[nodes], rel=5e-13, abs=0.0
            )
        listed = [int(n) for row in deck[f"*NSET,NSET={name}_NODES"] for n in row]
        assert set(listed) == {int(n) for row in rows for n in row[1:]}
        # faces by the manual's corner numbers, written out here
        sides = {
            "S1": (1, 2, 3, 4),
            "S2": (5, 8, 7, 6),
            "S3": (1, 5, 6, 2),
            "S4": (2, 6, 7, 3),
            "S5": (3, 7, 8, 4),
            "S6": (4, 8, 5, 1),
        }
        for key, faces in mesh.faces.items():
            surface = deck[f"*SURFACE,NAME={name}_{key.upper()}_FACES,TYPE=ELEMENT"]
            found = [frozenset(elements[int(e)][k - 1] for k in sides[s]) for e, s in surface]
            first = rows[:, 1:].min()
            assert found == [frozenset(face[:4] + first) for face in faces]
    assert numbers == list(range(1, sum(m.n_hex for m in meshes.values()) + 1))


def test_weights_of_a_set_are_comments_in_inp(tmp_path: Path) -> None:
    mesh = box_mesh([0, 1, 2], [0, 1], [0, 1])
    own = np.array([0.25, 0.5, 0.125, 1.0 / 3.0])
    weighted = replace(mesh, nodes={"distant": mesh.nodes["x1"]}, weights={"distant": own})
    path = tmp_path / "box.inp"
    write_mesh({"box": weighted}, path)
    lines = path.read_text().splitlines()
    first = lines.index("** weights of BOX_DISTANT, mm2, by node: held in their mean") + 1
    rows = [line.removeprefix("** ").split(", ") for line in lines[first : first + 4]]
    assert [int(node) - 1 for node, _ in rows] == mesh.nodes["x1"].tolist()
    assert [float(weight) for _, weight in rows] == pytest.approx(own, rel=1e-12)
    read = recipe_of(path, read_msh).build(MeshFile())["box"]
    assert np.array_equal(read.nodes["distant"], mesh.nodes["x1"])
    assert not read.weights


def test_contact_sets_keep_their_order_in_inp(
    made: dict[int, dict[str, Mesh]], tmp_path: Path
) -> None:
    path = tmp_path / "model.inp"
    write_mesh(made[8], path)
    deck = parsed(path)
    sets = [
        list(itertools.chain(*deck[f"*NSET,NSET={name}_CONTACT,UNSORTED"]))
        for name in ("SPHERE", "BLOCK")
    ]
    points = {row[0]: row[1:3] for row in deck["*NODE"]}
    assert [points[n] for n in sets[0]] == [points[n] for n in sets[1]]


@pytest.mark.parametrize("name", ["a.stl", "a", "a.vtk"])
def test_unknown_ending_lists_the_known_ones(
    made: dict[int, dict[str, Mesh]], name: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"\.msh, \.vtu or \.inp"):
        write_mesh(made[8], tmp_path / name)
    with pytest.raises(InputError, match=r"\.vtu"):
        write_fields(tmp_path / name, made[8], {})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("size", "name", "element", "word"),
    [
        (27, "a.inp", None, "27 nodes"),
        (8, "a.inp", "C3D20", "C3D8I"),
        (8, "a.vtu", "C3D8", "inp files only"),
        (8, "no/where.vtu", None, "cannot be written"),
    ],
)
def test_refusals_leave_no_file(
    made: dict[int, dict[str, Mesh]], size: int, name: str, element: Any, word: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=word):
        write_mesh(made[size], tmp_path / name, element=element)
    assert list(tmp_path.iterdir()) == []


def test_failed_write_keeps_the_old_file(made: dict[int, dict[str, Mesh]], tmp_path: Path) -> None:
    path = tmp_path / "model.inp"
    path.write_text("old")
    block = made[8]["block"]
    inside = np.array([[0, 1, 2, 10**4 % block.n_node]])
    with pytest.raises(MeshError, match="BLOCK bad: face 0 is no side"):
        write_mesh({"block": Mesh(block.points, block.hexes, {"bad": inside})}, path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"wedge": {"u": [0.0]}}, "no body wedge; the bodies are sphere, block"),
        ({"block": {"u": [0.0]}}, "field 'u' of block"),
        ({"block": {"u": "all"}, "sphere": {"u": "three"}}, "unlike that of another body"),
    ],
)
def test_wrong_fields_are_named(
    made: dict[int, dict[str, Mesh]], fields: Any, word: str, tmp_path: Path
) -> None:
    fill: dict[str, Any] = {
        "all": lambda mesh: np.zeros(mesh.n_node),
        "three": lambda mesh: mesh.points,
    }
    data = {
        b: {k: fill[v](made[8][b]) if isinstance(v, str) else v for k, v in values.items()}
        for b, values in fields.items()
    }
    with pytest.raises(InputError, match=word):
        write_fields(tmp_path / "f.vtu", made[8], data)
    assert list(tmp_path.iterdir()) == []


def test_nothing_to_write_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no mesh"):
        write_mesh({}, tmp_path / "a.vtu")
