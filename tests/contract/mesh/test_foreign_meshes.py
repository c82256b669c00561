"""Meshes as other programs write them: two blocks give F/A, A E/L and F L/(A E), or are refused.

Two blocks 4 x 4 x 4 mm, nu = 0, E = 200 GPa, 400 N: 25 MPa, 1 um, 4e5 N/mm.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upd
from geometry.blocks import session
from upd.errors import InputError, UpdError
from upd.fem import box_mesh
from upd.mesh import Mesh, recipes
from upd.mesh.checks import check_pairs, scaled_jacobian
from upd.mesh.export import write_mesh
from upd.results import Result

SCENE = """
name = "blocks"
want = ["normal", "stiffness"]
accuracy = "unknown"
[geometry]
recipe = "{file}"
[mesh]
element = "{element}"
[materials]
damper = {{ E = "200 GPa", nu = 0.0 }}
platform = {{ E = "200 GPa", nu = 0.0 }}
[loads]
normal = ["{load}"]
[left_out]
solve = "no"
"""


def solved(file: Path, element: str = "hex8", load: str = "400 N") -> Result:
    scene = file.with_suffix(".toml")
    scene.write_text(SCENE.format(file=file.name, element=element, load=load), encoding="utf-8")
    return upd.run(scene, report=False)


def assert_two_bars(result: Result) -> None:
    assert result.value("max_pressure") == pytest.approx(25.0, rel=1e-4)
    assert result.value("mean_pressure") == pytest.approx(25.0, rel=1e-4)
    assert result.value("approach") == pytest.approx(1.0, rel=1e-4)
    assert result.value("K_N_secant_raw") == pytest.approx(4e5, rel=1e-4)
    assert result.value("K_N_tangent_raw") == pytest.approx(4e5, rel=1e-4)


def told_of(file: Path) -> str:
    with pytest.raises(UpdError) as problem:
        recipes.build_mesh(str(file), {})
    assert isinstance(problem.value, InputError)
    return str(problem.value)


# -- gmsh ------------------------------------------------------------------------------------------


def halves(gmsh: Any, bottom: float) -> dict[str, list[int]]:
    """Volumes of a block of two halves, 4 mm upwards from a height, and its horizontal sides."""
    boxes = [(3, gmsh.model.occ.addBox(x, 0.0, bottom, 2.0, 4.0, 4.0)) for x in (0.0, 2.0)]
    volumes, _ = gmsh.model.occ.fragment(boxes[:1], boxes[1:])
    gmsh.model.occ.synchronize()
    sides = gmsh.model.getBoundary(volumes, combined=False, oriented=False)
    at = {side: gmsh.model.occ.getCenterOfMass(*side)[2] for side in sides}
    return {
        "volumes": [tag for _, tag in volumes],
        "low": [tag for (_, tag), z in at.items() if z < bottom + 0.1],
        "high": [tag for (_, tag), z in at.items() if z > bottom + 3.9],
    }


def gmsh_file(path: Path, size: int = 8, **options: float) -> Path:
    """Two blocks; one half of each contact face is in a second physical surface, too."""
    with session("blocks") as gmsh:
        for name, bottom, contact, distant in (
            ("damper", 0.0, "low", "high"),
            ("platform", -4.0, "high", "low"),
        ):
            found = halves(gmsh, bottom)
            gmsh.model.addPhysicalGroup(3, found["volumes"], name=name)
            gmsh.model.addPhysicalGroup(2, found[contact], name=f"{name}_contact")
            gmsh.model.addPhysicalGroup(2, found[contact][:1], name=f"{name}_coated")
            gmsh.model.addPhysicalGroup(2, found[distant], name=f"{name}_distant")
        gmsh.model.mesh.setTransfiniteAutomatic()
        for _, curve in gmsh.model.getEntities(1):
            gmsh.model.mesh.setTransfiniteCurve(curve, 4)
        for key, value in {"SecondOrderIncomplete": int(size == 20), **options}.items():
            gmsh.option.setNumber(f"Mesh.{key}", value)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(1 if size == 8 else 2)
        gmsh.write(str(path))
    return path


WRITTEN = {
    "2.2": {"MshFileVersion": 2.2},
    "2.2, parametric": {"MshFileVersion": 2.2, "SaveParametric": 1},
    "2.2, binary": {"MshFileVersion": 2.2, "Binary": 1},
    "4.0": {"MshFileVersion": 4.0},
    "4.1": {"MshFileVersion": 4.1},
    "4.1, binary": {"MshFileVersion": 4.1, "Binary": 1},
    "4.1, all saved": {"MshFileVersion": 4.1, "SaveAll": 1},
}


@pytest.mark.parametrize("size", [8, 20, 27])
@pytest.mark.parametrize("options", WRITTEN.values(), ids=list(WRITTEN))
def test_every_version_of_gmsh_s_format_is_the_same_mesh(
    options: dict[str, float], size: int, tmp_path: Path
) -> None:
    file = gmsh_file(tmp_path / "blocks.msh", size, **options)
    meshes, _ = recipes.build_mesh(str(file), {"element_nodes": size})
    nodes = {8: 28, 20: 73, 27: 91}[size]
    for mesh in meshes.values():
        assert {name: len(faces) for name, faces in mesh.faces.items()} == {
            "contact": 18,
            "distant": 18,
            "coated": 9,
        }
        assert len(mesh.nodes["contact"]) == nodes
        assert mesh.n_hex == 54
    # the order of the nodes within an element, too
    assert scaled_jacobian(meshes["damper"]).min() == pytest.approx(1.0)


def test_a_surface_in_two_physical_groups_counts_in_both(tmp_path: Path) -> None:
    assert_two_bars(solved(gmsh_file(tmp_path / "blocks.msh", MshFileVersion=4.1)))


def test_groups_of_version_2_are_those_of_its_elements(tmp_path: Path) -> None:
    """Other programs write one elementary entity for all: their groups must not become one."""
    file = gmsh_file(tmp_path / "blocks.msh", MshFileVersion=2.2)
    head, elements = file.read_text(encoding="utf-8").split("$Elements\n")
    one = re.sub(r"^(\d+ [35] 2 \d+) \d+", r"\1 1", elements, flags=re.MULTILINE)
    file.write_text(f"{head}$Elements\n{one}", encoding="utf-8")
    assert one != elements
    assert_two_bars(solved(file))


def test_what_version_2_drops_is_named(tmp_path: Path) -> None:
    file = gmsh_file(tmp_path / "blocks.msh", MshFileVersion=2.2, SaveAll=1)
    assert "written without SaveAll" in told_of(file)


@pytest.mark.parametrize(
    ("was", "now", "told"),
    [
        ("$MeshFormat", "Merge", r"does not begin with \$MeshFormat"),
        ("4.1 0 8", "9.9 0 8", "damaged or of another kind"),
        ("$Nodes", "$Nodes\nx", "damaged or of another kind"),
        ("$Elements\n", "$Elements\n99999999999999999999", "damaged or of another kind"),
        ('"damper"', '""', "54 of 108 hexahedra are in no named body"),
    ],
)
def test_a_damaged_gmsh_file_is_refused(was: str, now: str, told: str, tmp_path: Path) -> None:
    file = gmsh_file(tmp_path / "blocks.msh", MshFileVersion=4.1)
    text = file.read_text(encoding="utf-8")
    assert was in text
    file.write_text(text.replace(was, now), encoding="utf-8")
    assert re.search(told, told_of(file))


def test_half_a_gmsh_file_is_refused(tmp_path: Path) -> None:
    file = gmsh_file(tmp_path / "blocks.msh", MshFileVersion=4.1)
    text = file.read_bytes()
    for share in (0.2, 0.5, 0.8):
        file.write_bytes(text[: int(share * len(text))])
        assert "damaged or of another kind" in told_of(file)


# -- Abaqus, CalculiX ------------------------------------------------------------------------------


def blocks(n_node: int = 8, cuts: int = 3) -> dict[str, Mesh]:
    """The two blocks, nodes in the order of their places."""
    side = np.linspace(0.0, 4.0, cuts + 1)
    out = {}
    for name, z, contact in (("damper", [0, 2, 4], "z0"), ("platform", [-4, -2, 0], "z1")):
        mesh = box_mesh(side, side, z, n_node)
        other = "z1" if contact == "z0" else "z0"
        nodes = {"contact": mesh.nodes[contact], "distant": mesh.nodes[other]}
        out[name] = Mesh(mesh.points, mesh.hexes, nodes=nodes)
    return out


def inp(path: Path, meshes: Mapping[str, Mesh], *changes: tuple[str, str]) -> Path:
    """The meshes as a file, with these patterns replaced."""
    write_mesh(meshes, path)
    text = path.read_text(encoding="utf-8")
    for was, now in changes:
        text, count = re.subn(was, now, text)
        assert count, was
    path.write_text(text, encoding="utf-8")
    return path


#: what a file has instead -> changes of the file
OTHER_WORDS = {
    "bodies are sets of elements": [
        (r"ELSET=\w+", "ELSET=EALL"),
        (r"\Z", "*ELSET, ELSET=Damper, GENERATE\n1, 18\n*ELSET, ELSET=PLATFORM\n"),
        (r"=PLATFORM\n\Z", "=PLATFORM\n19, 20, 21\n" + ", ".join(map(str, range(22, 37))) + "\n"),
    ],
    "elements without a set": [
        (r", ELSET=\w+", ""),
        (r"\Z", "*ELSET, ELSET=DAMPER, GENERATE\n1, 18, 1\n"),
        (r"\Z", "*ELSET, ELSET=PLATFORM, GENERATE\n19, 36\n"),
    ],
    "a set of a set": [
        (r"ELSET=DAMPER", "ELSET=Volume1"),
        (r"\Z", "*ELSET, ELSET=DAMPER\nVolume1\n"),
    ],
    "the last of two nodes counts": [(r"\*NODE\n", "*NODE\n1, 0.3, 0.2, 0.1\n")],
    "the last of two elements counts": [
        (r"(ELSET=DAMPER\n)", r"\g<1>1, 9, 2, 3, 4, 5, 6, 7, 8\n"),
    ],
}


@pytest.mark.parametrize("changes", OTHER_WORDS.values(), ids=list(OTHER_WORDS))
def test_other_words_of_inp_are_the_same_bodies(
    changes: list[tuple[str, str]], tmp_path: Path
) -> None:
    assert_two_bars(solved(inp(tmp_path / "blocks.inp", blocks(), *changes)))


def test_nodes_may_be_named_where_they_are(tmp_path: Path) -> None:
    meshes = blocks()
    first, face = meshes["damper"].n_node + 1, meshes["platform"].nodes["contact"]
    rows = [
        f"{first + n}, {x:.13g}, {y:.13g}, 0\n"
        for n, (x, y, _) in zip(face, meshes["platform"].points[face], strict=True)
    ]
    contact = r"\*NSET, NSET=PLATFORM_CONTACT, UNSORTED\n[^*]*"
    file = inp(tmp_path / "blocks.inp", meshes, (contact, ""))
    with file.open("a", encoding="utf-8") as more:
        more.writelines(["*NODE, NSET=PLATFORM_CONTACT\n", *rows])
    assert_two_bars(solved(file))


def test_27_nodes_in_the_order_of_abaqus(tmp_path: Path) -> None:
    """The centre is its node 21, those of the sides S1 ... S6 follow."""
    meshes = blocks(27)
    rows, number = ["*NODE\n"], 1
    for mesh in meshes.values():
        rows += [
            f"{n}, {x:.13g}, {y:.13g}, {z:.13g}\n"
            for n, (x, y, z) in enumerate(mesh.points, number)
        ]
        number += mesh.n_node
    element, offset = 1, 1
    for name, mesh in meshes.items():
        rows.append(f"*ELEMENT, TYPE=C3D27, ELSET={name}\n")
        for hexahedron in mesh.hexes:
            # VTK's sides are -x +x -y +y -z +z
            minus_x, plus_x, minus_y, plus_y, minus_z, plus_z, centre = hexahedron[20:]
            sides = (minus_z, plus_z, minus_y, plus_x, plus_y, minus_x)
            own = [element, *(offset + np.array([*hexahedron[:20], centre, *sides]))]
            rows += [", ".join(map(str, own[:16])) + ",\n", ", ".join(map(str, own[16:])) + "\n"]
            element += 1
        for key, nodes in mesh.nodes.items():
            rows.append(f"*NSET, NSET={name}_{key}\n")
            rows += [f"{offset + n}\n" for n in nodes]
        offset += mesh.n_node
    file = tmp_path / "blocks.inp"
    file.write_text("".join(rows), encoding="utf-8")
    read, _ = recipes.build_mesh(str(file), {"element_nodes": 27})
    for name, mesh in meshes.items():
        np.testing.assert_array_equal(read[name].hexes, mesh.hexes)
    assert_two_bars(solved(file, "hex27"))


@pytest.mark.parametrize(
    ("was", "now", "told"),
    [
        (r"\n1, ", f"\n{2**64}, ", f"line 4: {2**64} is too large; labels go up to {2**63 - 1}"),
        (r"\*NODE\n", "*NODE, SYSTEM=C\n", "NODE, SYSTEM: is not read"),
        (r"\*NODE\n", "*SYSTEM\n1, 2, 3\n*NODE\n", "SYSTEM: is not read"),
        (r"\Z", "*NGEN\n1, 11, 1\n", "NGEN: is not read"),
        (r"\Z", "*ELSET, ELSET=DAMPER_TOP\n999\n", "names the element 999, which is not there"),
        (r"\Z", "*ELEMENT, TYPE=C3D8\n99, 1, 2, 3, 4, 5, 6, 7, 8\n", "1 of 37 hexahedra are in no"),
        (r"(ELSET=DAMPER\n)1(, [^\n]*)", r"\g<1>1\2\n99\2", "'damper' has 1 hexahedra twice"),
    ],
)
def test_what_an_inp_file_cannot_say_is_refused(
    was: str, now: str, told: str, tmp_path: Path
) -> None:
    assert told in told_of(inp(tmp_path / "blocks.inp", blocks(), (was, now)))


# -- places of the two faces -----------------------------------------------------------------------


@pytest.mark.parametrize("gap", [-1e-3, -5e-4, 1e-3], ids=["overlap", "half of it", "apart"])
def test_stiffness_counts_from_the_first_touch(gap: float, tmp_path: Path) -> None:
    """The approach counts from the file's places; at -1 um the two cancel."""
    meshes = blocks()
    damper = meshes["damper"]
    meshes["damper"] = damper.with_points(damper.points + np.array([0.0, 0.0, gap]))
    result = solved(inp(tmp_path / "blocks.inp", meshes))
    assert result.value("max_pressure") == pytest.approx(25.0, rel=1e-4)
    assert result.value("approach") == pytest.approx(1.0 + 1e3 * gap, abs=1e-4)
    assert result.value("K_N_secant_raw") == pytest.approx(4e5, rel=1e-4)
    assert result.value("K_N_tangent_raw") == pytest.approx(4e5, rel=1e-4)
    assert result.value("K_N_damper_alone") == pytest.approx(8e5, rel=1e-4)


def test_an_overlap_of_curved_faces_makes_no_negative_stiffness(tmp_path: Path) -> None:
    def secant(overlap: float) -> float:
        meshes = blocks(cuts=6)
        damper = meshes["damper"]
        crown = damper.points.copy()
        crown[:, 2] += ((crown[:, 0] - 2.0) ** 2 + (crown[:, 1] - 2.0) ** 2) / 2000.0 - overlap
        meshes["damper"] = damper.with_points(crown)
        return solved(inp(tmp_path / "blocks.inp", meshes), load="10 N").value("K_N_secant_raw")

    assert secant(0.005) == pytest.approx(secant(0.0), rel=1e-3)


@pytest.mark.parametrize("far", [0.0, 800.0])
@pytest.mark.parametrize("digits", [6, 7, 9])
def test_rounded_coordinates_are_paired(digits: int, far: float, tmp_path: Path) -> None:
    """Both faces round the same lattice, one of them after a shift that was taken back."""
    meshes = blocks()
    for name, mesh in meshes.items():
        shift = np.array([far, 0.0, 0.0]) + (np.pi / 7.0 if name == "damper" else 0.0)
        there = np.array([[float(f"{x:.{digits}g}") for x in row] for row in mesh.points + shift])
        back = there + (np.array([far, 0.0, 0.0]) - shift)
        back[:, 2] = mesh.points[:, 2]
        meshes[name] = mesh.with_points(back)
    file = inp(tmp_path / "blocks.inp", meshes)
    number = re.compile(r"-?\d+\.\d+(e-\d+)?")
    text = number.sub(lambda m: f"{float(m[0]):.{digits}g}", file.read_text(encoding="utf-8"))
    file.write_text(text, encoding="utf-8")
    read, _ = recipes.build_mesh(str(file), {})
    (pairs,) = check_pairs(read)
    assert pairs.count == 16
    assert 0.0 < pairs.offset < 2.0 * max(far, 4.0) * 10.0 ** (1 - digits)


def test_rounded_coordinates_meet_exact_ones() -> None:
    meshes = blocks()
    for name, digits in (("damper", 6), ("platform", 12)):
        rounded = [[float(f"{x:.{digits}g}") for x in row] for row in meshes[name].points]
        meshes[name] = meshes[name].with_points(np.array(rounded))
    (pairs,) = check_pairs(meshes)
    assert 1e-6 < pairs.offset < 1e-5


def test_a_shifted_lattice_is_no_rounding(tmp_path: Path) -> None:
    meshes = blocks()
    damper = meshes["damper"]
    meshes["damper"] = damper.with_points(damper.points + np.array([1e-4, 0.0, 0.0]))
    assert "0.0001 mm out of line; order both sets alike" in told_of(
        inp(tmp_path / "blocks.inp", meshes)
    )


def test_unmerged_halves_are_named(tmp_path: Path) -> None:
    meshes = blocks()
    damper = meshes["damper"]
    upper = damper.points[damper.hexes].mean(axis=1)[:, 2] > 2.0
    first, second = damper.hexes[~upper], damper.hexes[upper]
    own = np.unique(second)
    hexes = np.vstack([first, damper.n_node + np.searchsorted(own, second)])
    nodes = {
        "contact": damper.nodes["contact"],
        "distant": damper.n_node + np.searchsorted(own, damper.nodes["distant"]),
    }
    points = np.vstack([damper.points, damper.points[own]])
    meshes["damper"] = Mesh(points, hexes, nodes=nodes)
    told = told_of(inp(tmp_path / "blocks.inp", meshes))
    assert "damper: 16 pairs of nodes lie at one place each" in told
    assert "merge coincident nodes" in told


def test_surfaces_round_each_other_are_named(tmp_path: Path) -> None:
    """Ring on ring with an interference of 2.5 um: there is one pairing direction only."""
    meshes = {}
    for name, radii, contact in (
        ("damper", (10.0, 16.0, 20.0), "x1"),
        ("platform", (19.9975, 24.0, 30.0), "x0"),
    ):
        box = box_mesh(radii, np.linspace(0.0, 0.5 * np.pi, 9), [0.0, 4.0, 8.0])
        r, angle, z = box.points.T
        nodes = {"contact": box.nodes[contact], "distant": box.nodes["z1"]}
        places = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
        meshes[name] = Mesh(places, box.hexes, nodes=nodes)
    assert "there is one pairing direction only" in told_of(inp(tmp_path / "r.inp", meshes))
