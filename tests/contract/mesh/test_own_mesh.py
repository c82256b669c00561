"""A mesh file of another program as a recipe: the numbers are those of the recipe it came from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import upd
from geometry.blocks.gmsh_session import session
from tests.sectors import STEEL, lattice_sector
from upd.errors import InputError, UpdError
from upd.fem import mass, stiffness
from upd.mesh import Mesh, recipes
from upd.mesh.checks import check_pairs
from upd.mesh.export import write_mesh
from upd.mesh.hexmesh import boundary_faces
from upd.reduction.cyclic import CyclicModel, Sector, facing_contacts
from upd.report.tables import warnings

EXAMPLES = Path(upd.__file__).parent / "scenes" / "examples"
PARAMS = {"crown": 300.0, "divisions": 6}
SCENE = """
name = "mine"
want = ["normal", "stiffness"]
[geometry]
recipe = "{file}"
[mesh]
element = "{element}"
[materials]
damper = {{ E = "200 GPa", nu = 0.3 }}
platform = {{ E = "200 GPa", nu = 0.3 }}
[loads]
normal = ["400 N"]
[left_out]
solve = "no"
"""


def original(**params: object) -> dict[str, Mesh]:
    return recipes.build_mesh(str(EXAMPLES / "own_damper.py"), {**PARAMS, **params})[0]


def shuffled(meshes: Mapping[str, Mesh]) -> dict[str, Mesh]:
    """The same bodies with other node numbers and sets in another order."""
    out, random = {}, np.random.default_rng(1)
    for name, mesh in meshes.items():
        new = random.permutation(mesh.n_node)
        points = np.empty_like(mesh.points)
        points[new] = mesh.points
        out[name] = Mesh(
            points,
            new[mesh.hexes],
            {key: new[faces] for key, faces in mesh.faces.items()},
            {key: random.permutation(new[nodes]) for key, nodes in mesh.nodes.items()},
        )
    return out


def scene(file: str, element: str = "hex8i") -> str:
    return SCENE.format(file=file, element=element)


@pytest.mark.parametrize("nodes", [8, 20])
def test_inp_gives_the_numbers_of_the_recipe(
    nodes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    element = "hex8i" if nodes == 8 else "hex20"
    meshes = shuffled(original(element_nodes=nodes))
    write_mesh(meshes, tmp_path / "mine.inp")
    (tmp_path / "mine.toml").write_text(scene("mine.inp", element), encoding="utf-8")
    ours = upd.run(tmp_path / "mine.toml")
    own = scene(str(EXAMPLES / "own_damper.py"), element)
    own = own.replace("[mesh]", 'crown = "300 mm"\ndivisions = 6\n[mesh]')
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")
    theirs = upd.run(tmp_path / "own.toml")
    names = [(r.name, r.case.label) for r in theirs.results]
    assert [(r.name, r.case.label) for r in ours.results] == names
    for a, b in zip(ours.results, theirs.results, strict=True):
        # 13 digits of the coordinates in the file
        assert a.value == pytest.approx(b.value, rel=1e-8, abs=1e-9), a.name
    assert upd.load_scene(tmp_path / "mine.toml").analysis == "curved contact"


def test_pairs_are_put_in_order_and_checked(tmp_path: Path) -> None:
    write_mesh(shuffled(original()), tmp_path / "mine.inp")
    meshes, _ = recipes.build_mesh(str(tmp_path / "mine.inp"), {}, cache_dir=tmp_path / "cache")
    (pairs,) = [p for p in check_pairs(meshes) if p.sets == ("contact", "contact")]
    assert pairs.count == 49
    assert pairs.offset < 1e-12
    assert {name: sorted(mesh.nodes) for name, mesh in meshes.items()} == {
        "damper": ["contact", "distant", "nodes"],
        "platform": ["contact", "distant", "nodes"],
    }
    assert len(meshes["damper"].faces["contact"]) == 36


def test_surfaces_that_do_not_fit_are_told(tmp_path: Path) -> None:
    meshes = original()
    meshes["platform"] = original(divisions=4)["platform"]
    write_mesh(meshes, tmp_path / "mine.inp")
    with pytest.raises(UpdError, match="49 nodes face 25"):
        recipes.build_mesh(str(tmp_path / "mine.inp"), {})


def test_gmsh_file_with_physical_surfaces(tmp_path: Path) -> None:
    meshes = {
        name: Mesh(
            m.points,
            m.hexes,
            {
                key: f[np.isin(f, m.nodes[key]).all(axis=1)]
                for key, f in dict.fromkeys(
                    ("contact", "distant"), boundary_faces(m)[:, :4]
                ).items()
            },
        )
        for name, m in original().items()
    }
    write_mesh(meshes, tmp_path / "mine.msh")
    read, _ = recipes.build_mesh(str(tmp_path / "mine.msh"), {}, cache_dir=tmp_path / "cache")
    assert list(read) == ["damper", "platform"]
    for name, mesh in read.items():
        assert mesh.n_hex == meshes[name].n_hex
        assert len(mesh.nodes["distant"]) == len(mesh.nodes["contact"]) == 49
    np.testing.assert_allclose(read["damper"].points.min(0), meshes["damper"].points.min(0))


def test_scale_and_element_of_the_file(tmp_path: Path) -> None:
    write_mesh(original(), tmp_path / "mine.inp")
    file = str(tmp_path / "mine.inp")
    metres, _ = recipes.build_mesh(file, {"scale": 1000.0})
    alone, _ = recipes.build_mesh(file, {})
    np.testing.assert_allclose(metres["damper"].points, 1000.0 * alone["damper"].points)
    with pytest.raises(UpdError, match=r'8 nodes; set mesh\.element = "hex8"'):
        recipes.build_mesh(file, {"element_nodes": 20})
    with pytest.raises(InputError, match="scale"):
        recipes.build_mesh(file, {"scale": 0.0})


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "mine.inp"
    write_mesh(original(), file)
    first, _ = recipes.build_mesh(str(file), {}, cache_dir=tmp_path / "cache")
    write_mesh(original(divisions=4), file)
    second, _ = recipes.build_mesh(str(file), {}, cache_dir=tmp_path / "cache")
    assert first["damper"].n_hex > second["damper"].n_hex


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("*NODE\n1, 0, 0, 0\n", "no named body"),
        ("*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4, ELSET=A\n1, 1, 1, 1, 1\n", "C3D4"),
        ("*NODE\n1, 0, 0\n*ELEMENT, TYPE=C3D8, ELSET=A\n1, 1, 1\n", "damaged"),
        (
            "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=CPS4, ELSET=A\n1, 1, 1, 1, 1\n",
            "CPS4 elements only, which have no volume; to fix it: write the mesh of the volumes",
        ),
        (
            "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D8\n1, 1, 1, 1, 1, 1, 1, 1, 1\n",
            r"has no named body of hexahedra; to fix it: name the volumes .*ELSET= or \*ELSET",
        ),
        ("*NODE\n1, 0, 0, 0\n2, 0, x, 0\n", "line 3: '2, 0, x, 0' has no number in column 3"),
        (
            "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D8, ELSET=A\n1, 1, 1\n",
            "line 3: C3D8 elements have 8 nodes each",
        ),
        ("*PART, NAME=A\n*INSTANCE, NAME=B\n*END INSTANCE\n", "flat file"),
        (
            "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D8, ELSET=A\n1, 1, 1, 1, 1, 1, 1, 1, 9\n",
            "not there",
        ),
        ("nothing\n", "no named body"),
    ],
)
def test_bad_files_are_told(text: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "bad.inp").write_text(text, encoding="utf-8")
    with pytest.raises(UpdError, match=told):
        recipes.parameters(str(tmp_path / "bad.inp"))


def test_comments_may_be_in_latin_1(tmp_path: Path) -> None:
    file = tmp_path / "mine.inp"
    write_mesh(original(divisions=2), file)
    plain, _ = recipes.build_mesh(str(file), {})
    file.write_bytes("** Stück für Größe\n".encode("latin-1") + file.read_bytes())
    meshes, _ = recipes.build_mesh(str(file), {})
    assert meshes["damper"].n_hex == plain["damper"].n_hex


def test_elements_without_volume_are_sets_of_nodes(tmp_path: Path) -> None:
    """As gmsh writes physical surfaces."""
    file = tmp_path / "mine.inp"
    write_mesh(original(divisions=2), file)
    text = file.read_text(encoding="utf-8")
    text += (
        "*ELEMENT, TYPE=CPS4, ELSET=DAMPER_TOP\n901, 1, 2, 3, 4\n*ELEMENT, TYPE=T3D2\n902, 1, 2\n"
    )
    file.write_text(text, encoding="utf-8")
    meshes, _ = recipes.build_mesh(str(file), {})
    assert sorted(meshes) == ["damper", "platform"]
    assert meshes["damper"].nodes["top"].tolist() == [0, 1, 2, 3]


def told_of(folder: Path, meshes: Mapping[str, Mesh], load: str = "400 N") -> str:
    """What a run of these bodies as a file is refused or warned with."""
    write_mesh(meshes, folder / "mine.inp")
    (folder / "mine.toml").write_text(scene("mine.inp").replace("400 N", load), encoding="utf-8")
    try:
        result = upd.run(folder / "mine.toml", report=False)
    except UpdError as error:
        return str(error)
    entries = [row.as_dict() for row in result.results]
    return "; ".join(warnings([check.as_dict() for check in result.checks], entries))


def test_advice_is_for_a_file(tmp_path: Path) -> None:
    bodies = original()
    bare = {name: replace(m, nodes={}, faces={}) for name, m in bodies.items()}
    aside = {name: m.with_points(m.points[:, [2, 0, 1]]) for name, m in bodies.items()}
    sparse = original(divisions=2)
    told = {
        "sets": told_of(tmp_path, bare),
        "side": told_of(tmp_path, aside),
        "rim": told_of(tmp_path, bodies, "40000 N"),
        "rough": told_of(tmp_path, bodies, "1 N"),
        "sparse": told_of(tmp_path, sparse, "1 N"),
    }
    assert "*NSET, NSET=BODY_SET" in told["sets"]
    assert "in the program that writes it, until the contact plane is z = 0" in told["side"]
    assert "mesh a contact surface of" in told["rim"]
    assert "mesh the contact surface with elements of" in told["rough"]
    for text in told.values():
        assert "build()" not in text
        assert "geometry." not in text


def test_missing_and_strange_gmsh_files_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        recipes.parameters(str(tmp_path / "none.msh"))
    (tmp_path / "bad.msh").write_text("no mesh", encoding="utf-8")
    with pytest.raises(InputError, match="another kind"):
        recipes.parameters(str(tmp_path / "bad.msh"))


def test_generated_sets_and_sets_of_sets(tmp_path: Path) -> None:
    file = tmp_path / "mine.inp"
    write_mesh(original(divisions=2), file)
    text = file.read_text(encoding="utf-8")
    text += (
        "*NSET, NSET=DAMPER_FIRST, GENERATE\n1, 5, 2\n*NSET, NSET=DAMPER_BOTH\nDAMPER_FIRST, 2\n"
    )
    file.write_text(text, encoding="utf-8")
    meshes, _ = recipes.build_mesh(str(file), {})
    assert meshes["damper"].nodes["both"].tolist() == [0, 2, 4, 1]


def test_faces_of_quadratic_hexahedra_have_their_mid_nodes() -> None:
    mesh = original(element_nodes=20)["platform"]
    faces = boundary_faces(mesh)
    assert faces.shape[1] == 8
    ring, middle = mesh.points[faces[:, :4]], mesh.points[faces[:, 4:8]]
    np.testing.assert_allclose(middle, (ring + np.roll(ring, -1, axis=1)) / 2.0, atol=1e-12)


def test_rig_of_one_s_own(tmp_path: Path) -> None:
    params = {"element_nodes": 8, "damper": "none", "symmetry": "full"}
    meshes, _ = recipes.build_mesh("blade_rig", params)
    write_mesh(meshes, tmp_path / "rig.inp")
    given = {
        "geometry": {"recipe": str(tmp_path / "rig.inp")},
        "mesh.element": "hex8",
        "mesh.symmetry": "full",
        "want": ["free"],
        "modes.arrangements": ["symmetric"],
        "left_out.solve": "no",
    }
    ours = upd.run("rig", overrides=given)
    theirs = upd.run("rig", overrides={k: v for k, v in given.items() if k != "geometry"})
    for k in range(1, 5):
        assert ours.value(f"f{k}_free") == pytest.approx(theirs.value(f"f{k}_free"), rel=1e-8)


def written_by_gmsh(file: Path) -> None:
    """A sector of 30 deg, its middle third higher than the rest, revolved by gmsh."""
    with session("sector") as gmsh:
        geo, axis = gmsh.model.geo, (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        a = np.radians(10.0)
        corner = {
            (r, z): geo.addPoint(r * np.cos(a), r * np.sin(a), z)
            for r in (60.0, 100.0, 120.0)
            for z in (-4.0, 4.0)
        }
        around = [(60, -4), (100, -4), (120, -4), (120, 4), (100, 4), (60, 4), (60, -4)]
        b = [geo.addLine(corner[i], corner[j]) for i, j in pairwise(around)]
        middle = geo.addLine(corner[100.0, -4.0], corner[100.0, 4.0])
        disk = geo.addPlaneSurface([geo.addCurveLoop([b[0], middle, b[4], b[5]])])
        blade = geo.addPlaneSurface([geo.addCurveLoop([b[1], b[2], b[3], -middle])])
        for one in (*b, middle):
            geo.mesh.setTransfiniteCurve(one, 2 if one in (b[1], b[3]) else 3)
        for one in (disk, blade):
            geo.mesh.setTransfiniteSurface(one)
            geo.mesh.setRecombine(2, one)
        parts = [
            geo.revolve([(2, disk)], *axis, -a, numElements=[2], recombine=True),
            geo.revolve([(2, disk), (2, blade)], *axis, a, numElements=[2], recombine=True),
        ]
        parts.append(geo.revolve(parts[1][:1], *axis, a, numElements=[2], recombine=True))
        geo.synchronize()
        volumes = [tag for part in parts for dim, tag in part if dim == 3]
        gmsh.model.addPhysicalGroup(3, volumes, name="sector")
        gmsh.model.mesh.generate(3)
        groups: dict[str, list[int]] = {}
        for _, tag in gmsh.model.getEntities(2):
            nodes = gmsh.model.mesh.getNodes(2, tag, includeBoundary=True)[1].reshape(-1, 3)
            r, angle = np.hypot(nodes[:, 0], nodes[:, 1]), np.degrees(np.arctan2(*nodes.T[1::-1]))
            for name, where in {
                "low": np.isclose(angle, 0.0),
                "high": np.isclose(angle, 30.0),
                "clamped": np.isclose(r, 60.0),
                "contact_left": np.isclose(angle, 10.0) & (r > 99.0),
                "contact_right": np.isclose(angle, 20.0) & (r > 99.0),
            }.items():
                groups.setdefault(name, []).extend([tag] * bool(where.all()))
        for name, tags in groups.items():
            gmsh.model.addPhysicalGroup(2, tags, name=name)
        gmsh.write(str(file))


def test_a_sector_written_by_gmsh(tmp_path: Path) -> None:
    written_by_gmsh(tmp_path / "sector.msh")
    given = {
        "name": "mine",
        "want": ["modes"],
        "geometry": {"recipe": str(tmp_path / "sector.msh"), "n_sectors": 12},
        "mesh": {"element": "hex8"},
        "material": {"E": "200 GPa", "nu": 0.3, "density": "7800 kg/m3"},
        "modes": {"count": 2},
        "rotation": {"speed": "6000 rpm"},
    }
    theirs = upd.run(given, report=False)
    mesh = lattice_sector(
        [60, 80, 100, 120],
        np.arange(0, 31, 5),
        [-4, 0, 4],
        lambda r, angle: r < 100 or 10 < angle < 20,
        8,
    )
    K, M = stiffness(mesh, STEEL, "hex8"), mass(mesh, STEEL)
    model = CyclicModel.of(Sector.of(mesh, 12), K, M)
    read = recipes.build_mesh(given["geometry"]["recipe"], {"n_sectors": 12})[0]["sector"]
    right, left = facing_contacts(Sector.of(read, 12))
    assert len(right) == len(left) == 6
    for n in (0, 1, 6):
        found = [one.value for one in theirs.results if one.case.nodal_diameter == n]
        np.testing.assert_allclose(found, model.modes(n, 2).frequency, rtol=1e-6)
