"""What every mesh of a damper on its platform promises, with two pads or as a wedge.

Counts, volume, shape, symmetry, faces; faults of parameters.
"""

from __future__ import annotations

import itertools
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from geometry import pads_platform, wedge_platform
from geometry.pads_platform import PadsPlatform
from geometry.wedge_platform import WedgePlatform
from upd.errors import InputError
from upd.fem import Material
from upd.fem.inertia import MassProperties, mass_properties
from upd.mesh import Mesh
from upd.mesh.checks import check_pairs, scaled_jacobian

RECIPES: dict[type, ModuleType] = {PadsPlatform: pads_platform, WedgePlatform: wedge_platform}
SMALL: dict[type, dict[str, Any]] = {
    PadsPlatform: {"divisions": 3, "divisions_long": 5, "growth": 1.8},
    WedgePlatform: {"divisions": 3, "divisions_long": 6, "growth": 1.8},
}
#: area of the contact, mm2
CONTACT = {PadsPlatform: 2.0 * 18.0 * 8.0, WedgePlatform: 42.5 * 15.0}
ALL = list(itertools.product(SMALL, ("full", "half"), (8, 20, 27)))
USUAL: list[dict[str, Any]] = [{}, {"symmetry": "half", "element_nodes": 20}]
ODD: dict[type, list[dict[str, Any]]] = {
    PadsPlatform: [
        {
            "angle_a": 30.0,
            "angle_b": 110.0,
            "ab": 40.0,
            "pad_centre": 9.0,
            "divisions": 5,
            "divisions_long": 3,
        },
        {"angle_a": 80.0, "angle_b": 80.0, "ab": 30.0, "divisions": 4, "divisions_long": 4},
        {"pad_gap": 0.1, "divisions": 2, "divisions_long": 3, "wire_position": 9.0},
        {"bottom_layer": 0.4, "divisions": 2, "divisions_long": 5, "growth": 1.6},
        {"bottom_layer": 4.0, "divisions": 4, "divisions_long": 4, "element_nodes": 20},
        {"step": 0.05, "thickness": 0.5, "margin": 0.2, "divisions": 8, "divisions_long": 8},
        {
            "pad_width": 4.0,
            "wire_position": 5.0,
            "divisions": 1,
            "divisions_long": 1,
            "element_nodes": 20,
        },
        {
            "step": 3.0,
            "pad_length": 2.0,
            "first_layer": 0.3,
            "divisions": 3,
            "divisions_long": 7,
            "symmetry": "half",
        },
    ],
    WedgePlatform: [
        {"angle": 30.0, "height": 8.0, "patch_length": 14.0, "divisions": 5, "divisions_long": 8},
        {"angle": 60.0, "height": 20.0, "patch_length": 20.0, "divisions": 7, "divisions_long": 4},
        {"angle": 75.0, "height": 55.0, "patch_length": 9.0, "divisions": 4, "divisions_long": 6},
        {"angle": 30.0, "height": 8.5, "patch_length": 14.0, "divisions": 12},
        {"thickness": 0.5, "margin": 0.3, "divisions": 2, "divisions_long": 2},
        {"divisions": 1, "divisions_long": 2, "element_nodes": 20},
        {
            "patch_length": 6.0,
            "patch_width": 17.0,
            "band": 4.0,
            "divisions": 4,
            "divisions_long": 10,
        },
        {"patch_width": 42.0, "divisions": 3, "divisions_long": 6, "symmetry": "half"},
        {
            "patch_length": 2.0,
            "patch_offset": 9.0,
            "divisions": 2,
            "first_layer": 2.0,
            "growth": 2.0,
            "symmetry": "half",
        },
    ],
}
DENSITY_ONE = Material(E=1.0, nu=0.3, rho=1.0)


def props(mesh: Mesh) -> MassProperties:
    return mass_properties(mesh, DENSITY_ONE)


def volumes(p: Any) -> dict[str, float]:
    """Of the whole bodies, by the schoolbook: the damper's section is a trapezium."""
    if isinstance(p, PadsPlatform):
        # between the vertical face and the cut
        far = p.ab - p.cut * (
            1.0 / np.tan(np.radians(p.angle_a)) - np.tan(np.radians(p.angle_b - 90.0))
        )
        across, along = 2.0 * p.pad_width + p.pad_gap, p.pad_length
        pads = 2.0 * p.pad_width * p.pad_length * p.step
        damper = p.cut * (p.ab + far) / 2.0 * across + pads
    else:
        top = p.base - 2.0 * p.height / np.tan(np.radians(p.angle))
        across, along = p.width, p.patch_length
        damper = p.height * (p.base + top) / 2.0 * p.length
    box = (across + 2.0 * p.margin) * (along + 2.0 * p.margin) * p.thickness
    return {"damper": float(damper), "platform": box}


@pytest.fixture(scope="module")
def made() -> dict[tuple[type, str, int], dict[str, Mesh]]:
    return {
        (recipe, symmetry, size): RECIPES[recipe].build(
            recipe(symmetry=symmetry, element_nodes=size, **SMALL[recipe])
        )
        for recipe, symmetry, size in ALL
    }


def sound(p: Any, meshes: dict[str, Mesh]) -> None:
    """As counted, every node used once, paired, of good shape and of the volume asked for."""
    predicted = RECIPES[type(p)].count(p)
    check_pairs(meshes)
    assert list(meshes) == ["damper", "platform"]
    for name, mesh in meshes.items():
        assert predicted[name] == {
            "nodes": mesh.n_node,
            "hexes": mesh.n_hex,
            "contact": len(mesh.nodes["contact"]),
        }
        assert np.array_equal(np.unique(mesh.hexes), np.arange(mesh.n_node)), (
            "every node belongs to an element"
        )
        assert len(np.unique(mesh.points, axis=0)) == mesh.n_node, "no node twice"
        assert all(len(nodes) for nodes in mesh.nodes.values())
        share = 0.5 if p.symmetry == "half" else 1.0
        assert props(mesh).volume == pytest.approx(share * volumes(p)[name], rel=1e-10)
    worst = scaled_jacobian(meshes["damper"]).min()
    assert worst > 0.3
    wedge = isinstance(p, WedgePlatform)
    if wedge:
        # the trapezoid is sheared by its angle at the corners, never more; gmsh integrates the
        # grading of edges numerically
        assert worst == pytest.approx(np.sin(np.radians(p.angle)), rel=1e-7)
    # the lattice of two pads has lines of its own between them
    assert scaled_jacobian(meshes["platform"]).min() == pytest.approx(
        1.0, rel=1e-9 if wedge else 1e-7
    )


@pytest.mark.parametrize(
    ("recipe", "changes"),
    [(recipe, changes) for recipe, odd in ODD.items() for changes in (*USUAL, *odd)],
)
def test_mesh_is_sound_and_as_counted(recipe: type, changes: dict[str, Any]) -> None:
    p = recipe(**changes)
    sound(p, RECIPES[recipe].build(p))


@pytest.mark.parametrize("key", ALL)
def test_volume_and_centroid(
    made: dict[tuple[type, str, int], dict[str, Mesh]], key: tuple[type, str, int]
) -> None:
    recipe, symmetry, size = key
    sound(recipe(symmetry=symmetry, element_nodes=size, **SMALL[recipe]), made[key])
    p = recipe(**SMALL[recipe])
    found, share = props(made[key]["damper"]), 1.0 if symmetry == "full" else 0.5
    assert found.volume == pytest.approx(share * volumes(p)["damper"], rel=1e-11)
    off = found.centre - RECIPES[recipe].centroid(p)
    if isinstance(p, WedgePlatform):
        assert volumes(p)["damper"] == pytest.approx(216.0 * 42.5, rel=1e-12)
        middle = np.array([0.0 if symmetry == "full" else 42.5 / 4.0, 0.0, 0.0])
        assert np.abs(off - middle).max() < 1e-10
    else:
        assert np.abs(off)[1:].max() < 1e-10
        # reconstructed mass, steel: 44.7 g, with pads 47.0 g
        pads = 2.0 * 18.0 * 8.0 * 1.0
        assert 7.8e-3 * (found.volume / share - pads) == pytest.approx(44.7, abs=0.06)
        assert 7.8e-3 * found.volume / share == pytest.approx(47.0, abs=0.06)


@pytest.mark.parametrize("size", [8, 20, 27])
@pytest.mark.parametrize("recipe", SMALL)
def test_full_model_is_its_own_mirror_image(
    made: dict[tuple[type, str, int], dict[str, Mesh]], recipe: type, size: int
) -> None:
    for name in ("damper", "platform"):
        full, half = made[recipe, "full", size][name], made[recipe, "half", size][name]
        rows = {tuple(p) for p in full.points}
        assert {tuple(p) for p in full.points * [-1.0, 1.0, 1.0] + 0.0} == rows
        assert {p for p in rows if p[0] >= 0.0} == {tuple(p) for p in half.points}
        whole = {frozenset(map(tuple, full.points[h])) for h in full.hexes}
        part = {frozenset(map(tuple, half.points[h])) for h in half.hexes}
        assert part <= whole
        assert len(whole) == 2 * len(part) == full.n_hex
        for key in set(full.nodes) & set(half.nodes):
            right = {tuple(p) for p in full.points[full.nodes[key]] if p[0] >= 0.0}
            assert right == {tuple(p) for p in half.points[half.nodes[key]]}
        # the half has no left pad
        assert set(full.nodes) - set(half.nodes) <= {"contact_left"}
        if "contact_left" in full.nodes:
            left, right = (
                {tuple(p) for p in full.points[full.nodes[f"contact_{pad}"]] * [sign, 1.0, 1.0]}
                for pad, sign in (("left", -1.0), ("right", 1.0))
            )
            assert left == right


@pytest.mark.parametrize("recipe", SMALL)
def test_faces_look_outwards(
    made: dict[tuple[type, str, int], dict[str, Mesh]], recipe: type
) -> None:
    for mesh, sign in zip(made[recipe, "full", 8].values(), (-1.0, 1.0), strict=True):
        a, b, c, d = (mesh.points[mesh.faces["contact"][:, k]] for k in range(4))
        area = 0.5 * np.cross(c - a, d - b)
        assert np.all(sign * area[:, 2] > 0.0)
        assert sign * area[:, 2].sum() == pytest.approx(CONTACT[recipe], rel=1e-12)


@pytest.mark.parametrize(
    ("recipe", "sizes", "long"),
    [(PadsPlatform, ("ab", "pad_offset"), 0), (WedgePlatform, ("base", "height"), 7)],
)
def test_all_faults_come_at_once(recipe: type, sizes: tuple[str, str], long: int) -> None:
    faults = {"divisions": 0, "divisions_long": long, "growth": 3.0, "element_nodes": 9}
    faults |= {"symmetry": "third"}
    with pytest.raises(InputError) as caught:
        recipe(**{sizes[0]: -1.0, sizes[1]: float("nan")}, **faults)
    lines = str(caught.value).splitlines()
    assert [line.split(":")[0] for line in lines] == [*sizes, *faults]


@pytest.mark.parametrize(
    ("recipe", "changes", "word"),
    [
        (PadsPlatform, {"cut": 24.0}, r"cut: .* less than 23\.\d* mm, or a larger ab"),
        (PadsPlatform, {"angle_a": 10.0}, "angle_a: .* outside 20"),
        (PadsPlatform, {"angle_b": 130.0}, "angle_b: .* outside 60"),
        (PadsPlatform, {"pad_centre": 2.0}, r"pad_centre: .* 3\.97\d* \.\.\. 14\.5"),
        (PadsPlatform, {"pad_length": 21.0}, "pad_length: .* does not fit"),
        (
            PadsPlatform,
            {"pad_offset": 0.01, "symmetry": "half"},
            'pad_offset: .* set symmetry to "full"',
        ),
        (PadsPlatform, {"pad_offset": -0.01}, "pad_offset: -0.01 mm is less than 0"),
        (PadsPlatform, {"pad_offset": 0.6}, "pad_offset: .* outside 0"),
        (PadsPlatform, {"wire_position": 21.0}, "wire_position: .* at most 20.25"),
        (PadsPlatform, {"first_layer": 9.0}, "first_layer"),
        (PadsPlatform, {"step": 0}, "step: 0 is not a positive number"),
        (WedgePlatform, {"angle": 30.0}, r"base: .* more than 41\.\d* mm"),
        (WedgePlatform, {"angle": 85.0}, "angle: .* outside 20"),
        (WedgePlatform, {"angle": 10.0}, "angle: .* outside 20"),
        (WedgePlatform, {"patch_length": 16.0}, r"patch_length: .* less than 15\.4"),
        (WedgePlatform, {"patch_offset": 1e-4}, "patch_offset: .* at least"),
        (WedgePlatform, {"band": 30.0}, "band: .* at most 21.25"),
        (WedgePlatform, {"patch_width": 17.0}, "band: .* wider than half the contact; at most 8.5"),
        (
            WedgePlatform,
            {"patch_width": 42.49999},
            r"patch_width: .* less than 42\.4\d* mm, or as long",
        ),
        (WedgePlatform, {"patch_width": 50.0}, "patch_width: .* less than"),
        (WedgePlatform, {"patch_width": -1.0}, "patch_width: -1.0 is not a positive number"),
        (WedgePlatform, {"wire_position": 21.0}, "wire_position: .* at most 20.25"),
        (WedgePlatform, {"first_layer": 9.0}, "first_layer"),
        (WedgePlatform, {"divisions_long": True}, "divisions_long: True is not a whole number"),
        (WedgePlatform, {"margin": "15"}, "margin: '15' is not a positive number"),
    ],
)
def test_faults_name_the_remedy(recipe: type, changes: dict[str, Any], word: str) -> None:
    with pytest.raises(InputError, match=word):
        recipe(**changes)
