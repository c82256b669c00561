"""What a mesh of the wedge on its platform promises beside `test_geometry_platforms`.

Pairing, sets, bands, patches, place in the rig.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry.blocks.hexahedron import flipped, mirrored
from geometry.wedge_platform import WedgePlatform, build, centroid, count, inclination, placement
from upd.fem import Material
from upd.fem.inertia import MassProperties, mass_properties
from upd.mesh import FloatArray, Mesh
from upd.mesh.checks import check_pairs
from upd.mesh.recipes import load_meshes, save_meshes

EPS = np.finfo(float).eps
SMALL: dict[str, Any] = {"divisions": 3, "divisions_long": 6, "growth": 1.8}
ALL = list(itertools.product(("full", "half"), (8, 20, 27)))
DENSITY_ONE = Material(E=1.0, nu=0.3, rho=1.0)


def props(mesh: Mesh) -> MassProperties:
    return mass_properties(mesh, DENSITY_ONE)


def section(p: WedgePlatform) -> tuple[float, float]:
    """Area of the trapezoid and height of its centroid over the base, by the schoolbook."""
    b, t, h = p.base, p.base - 2.0 * p.height / np.tan(np.radians(p.angle)), p.height
    return h * (b + t) / 2.0, h / 3.0 * (b + 2.0 * t) / (b + t)


@pytest.fixture(scope="module")
def made() -> dict[tuple[str, int], dict[str, Mesh]]:
    return {
        (symmetry, size): build(WedgePlatform(symmetry=symmetry, element_nodes=size, **SMALL))
        for symmetry, size in ALL
    }  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def default() -> dict[str, Mesh]:
    return build(WedgePlatform())


def test_default_lattice_has_455_nodes(default: dict[str, Mesh]) -> None:
    size = count(WedgePlatform())
    for name, mesh in default.items():
        assert len(mesh.nodes["contact"]) == size[name]["contact"] == 455
        assert len(mesh.faces["contact"]) == 34 * 12
        P = mesh.points[mesh.nodes["contact"]]
        assert np.array_equal(P[:, 2], np.zeros(455))
        x, y = np.meshgrid(1.25 * np.arange(-17, 18), 1.25 * np.arange(-6, 7), indexing="ij")
        # 1.25 = 42.5 / 34 and its multiples are binary fractions; the half length is divided by 17,
        # which is not
        assert np.array_equal(P[:, 1], y.ravel())
        assert np.abs(P[:, 0] - x.ravel()).max() < 4 * EPS * 21.25
    assert 2e4 < 3 * size["damper"]["nodes"] < 6e4
    assert 3e4 < 3 * size["platform"]["nodes"] < 7e4


@pytest.mark.parametrize("key", ALL)
def test_contact_nodes_are_the_same_lattice_in_both_bodies(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    check_pairs(made[key])
    upper, lower = (mesh.points[mesh.nodes["contact"]] for mesh in made[key].values())
    assert list(made[key]) == ["damper", "platform"]
    assert np.array_equal(upper, lower)
    assert np.array_equal(upper[:, 2], np.zeros(len(upper)))
    assert np.array_equal(np.lexsort((upper[:, 1], upper[:, 0])), np.arange(len(upper)))
    assert np.array_equal(np.unique(upper[:, 1]), -np.unique(upper[:, 1])[::-1]), (
        "y is exactly opposite"
    )
    assert (upper[:, 1].min(), upper[:, 1].max(), upper[:, 0].max()) == (-7.5, 7.5, 21.25)
    assert upper[:, 0].min() == (0.0 if key[0] == "half" else -21.25)
    for mesh in made[key].values():
        assert np.array_equal(np.unique(mesh.faces["contact"]), np.sort(mesh.nodes["contact"]))


def on_base(p: WedgePlatform, points: FloatArray) -> Any:
    """Points of the plane that leaves the leg's lower end at the base angle."""
    a = np.radians(p.angle)
    low = p.patch_length / 2 + p.patch_offset - p.height / np.sin(a)
    return np.abs(points[:, 2] * np.cos(a) - (points[:, 1] - low) * np.sin(a)) < 1e-9 * p.base


@pytest.mark.parametrize("key", ALL)
def test_sets_lie_where_their_names_say(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    p = WedgePlatform(**SMALL)
    damper, platform = made[key].values()
    X = np.abs(damper.points[:, 0])
    base = on_base(p, damper.points)
    assert set(np.flatnonzero(base)) == set(damper.nodes["distant_base"])
    # lattice lines stand 7.083 mm apart: the bands from 5.625 to 15.625 mm reach into all elements,
    # those under the wires from 16 to 18 mm into the outer ones
    assert np.array_equal(damper.nodes["distant_bands"], np.flatnonzero(base))
    outer = base & (X > 14.1)
    assert np.array_equal(damper.nodes["distant_wires"], np.flatnonzero(outer))
    assert np.array_equal(damper.nodes["distant"], damper.nodes["distant_bands"])
    # the other leg, upright at 45 degrees
    right = damper.points[:, 1].max()
    assert set(np.flatnonzero(damper.points[:, 1] > right - 1e-9)) == set(
        damper.nodes["distant_opposite_leg"]
    )
    assert set(np.flatnonzero(platform.points[:, 2] == -40.0)) == set(
        platform.nodes["distant_opposite"]
    )
    assert np.array_equal(platform.nodes["distant"], platform.nodes["distant_opposite"])
    outside = (np.abs(platform.points[:, 0]) > 36.25 - 1e-9) | (
        np.abs(platform.points[:, 1]) > 22.5 - 1e-9
    )
    assert set(np.flatnonzero(outside)) == set(platform.nodes["distant_sides"])
    for mesh in made[key].values():
        assert ("plane_x" in mesh.nodes) == (key[0] == "half")
        if key[0] == "half":
            assert mesh.points[:, 0].min() == 0.0
            assert np.array_equal(mesh.nodes["plane_x"], np.flatnonzero(mesh.points[:, 0] == 0.0))
            assert np.abs(mesh.points[:, 0]).min() == 0.0


def test_a_band_between_two_lattice_lines_takes_both() -> None:
    # lines at 0, 7.083, 14.17, 21.25
    p = WedgePlatform(divisions=3, divisions_long=6, wire_position=12.0, wire_width=1.0, band=1.0)
    damper = build(p)["damper"]
    for name, expected in (
        ("distant_wires", [2 / 6 * 21.25, 4 / 6 * 21.25]),
        ("distant_bands", [2 / 6 * 21.25, 4 / 6 * 21.25]),
    ):
        x = damper.points[damper.nodes[name], 0]
        assert np.unique(np.abs(x)) == pytest.approx(expected, rel=1e-12)
        assert np.count_nonzero(x > 0.0) == np.count_nonzero(x < 0.0)
        # the lever: what the outer line takes of a band 1 mm wide on the base of 30 mm
        centre = {"distant_wires": 12.0, "distant_bands": 10.625}[name]
        outer = damper.weights[name][np.isclose(np.abs(x), expected[1])].sum()
        share = (centre - expected[0]) / (expected[1] - expected[0])
        assert outer == pytest.approx(2 * 30.0 * 1.0 * share, rel=1e-12)


@pytest.mark.parametrize("symmetry", ["full", "half"])
@pytest.mark.parametrize("size", [8, 20, 27])
@pytest.mark.parametrize("long", [2, 4, 6, 10, 14])
def test_bands_are_as_wide_as_they_are_told(long: int, size: int, symmetry: Any) -> None:
    """Area 2 b w, middles and (of quadratic elements) second moments of the strips, closed form."""
    p = WedgePlatform(
        divisions=2,
        divisions_long=long,
        growth=1.8,
        element_nodes=size,
        symmetry=symmetry,
        wire_position=0.75,  # the bands of 2 mm under them overlap in the middle, and count twice
    )
    damper, copies = build(p)["damper"], 2.0 if symmetry == "half" else 1.0
    for name, centre, width in (("bands", 10.625, 10.0), ("wires", 0.75, 2.0)):
        nodes, weights = damper.nodes[f"distant_{name}"], damper.weights[f"distant_{name}"]
        x, y, _ = damper.points[nodes].T
        area = 2.0 * p.base * width
        assert copies * weights.sum() == pytest.approx(area, rel=1e-13)
        low = p.patch_length / 2.0 + p.patch_offset - p.leg
        along = (y - low) / np.cos(np.radians(p.angle))
        assert copies * weights @ along == pytest.approx(area * p.base / 2.0, rel=1e-9)
        if centre > width / 2.0:
            assert copies * weights @ np.abs(x) == pytest.approx(area * centre, rel=1e-12)
        if size > 8:
            second = area * (centre**2 + width**2 / 12.0)
            assert copies * weights @ x**2 == pytest.approx(second, rel=1e-12)
    assert np.array_equal(damper.weights["distant"], damper.weights["distant_bands"])


@pytest.mark.parametrize("size", [8, 20, 27])
def test_weights_of_the_half_are_those_of_the_whole(
    made: dict[tuple[str, int], dict[str, Mesh]], size: int
) -> None:
    full, half = made["full", size]["damper"], made["half", size]["damper"]
    assert set(full.weights) == {"distant", "distant_bands", "distant_wires"} == set(half.weights)
    for name, weights in half.weights.items():
        whole = dict(
            zip(map(tuple, full.points[full.nodes[name]]), full.weights[name], strict=True)
        )
        for point, weight in zip(half.points[half.nodes[name]], weights, strict=True):
            # a node on the plane stands for both sides
            copies = 2.0 if point[0] == 0.0 else 1.0
            assert whole[tuple(point)] == pytest.approx(copies * weight, rel=1e-12)
            assert whole[tuple(point * [-1.0, 1.0, 1.0] + 0.0)] == whole[tuple(point)]


def test_a_mesh_mirrored_or_kept_takes_its_weights_along(
    made: dict[tuple[str, int], dict[str, Mesh]], tmp_path: Path
) -> None:
    half, full = made["half", 8]["damper"], made["full", 8]["damper"]
    image = flipped(half, 0)
    assert np.array_equal(image.weights["distant"], half.weights["distant"])
    whole = mirrored(half, 0)
    for mesh in (whole, full):
        assert mesh.weights["distant"].sum() == pytest.approx(600.0, rel=1e-13)
        for name in mesh.weights:
            assert len(mesh.weights[name]) == len(mesh.nodes[name])
    x = np.abs(whole.points[whole.nodes["distant"], 0])
    assert whole.weights["distant"] @ x == pytest.approx(600.0 * 10.625, rel=1e-13)
    save_meshes(tmp_path, "wedge", {"damper": full})
    found = load_meshes(tmp_path, "wedge")
    assert found is not None
    for name, weights in full.weights.items():
        assert np.array_equal(found["damper"].weights[name], weights)


def test_default_bands_and_point(default: dict[str, Mesh]) -> None:
    damper = default["damper"]
    x = damper.points[damper.nodes["distant_bands"], 0]
    # of the elements that the bands from 5.625 to 15.625 and from 16 to 18 mm reach into
    assert np.unique(np.abs(x)) == pytest.approx(np.arange(5.0, 16.3, 1.25))
    assert np.unique(np.abs(damper.points[damper.nodes["distant_wires"], 0])) == pytest.approx(
        [15.0, 16.25, 17.5, 18.75]
    )
    (point,) = damper.nodes["distant_point"]
    base = damper.points[damper.nodes["distant_base"]]
    middle = (base[base[:, 2].argmin()] + base[base[:, 2].argmax()]) / 2.0 * [0.0, 1.0, 1.0]
    distance = np.linalg.norm(base - middle, axis=1)
    assert np.linalg.norm(damper.points[point] - middle) == distance.min()
    assert damper.points[point, 0] == 0.0


@pytest.mark.parametrize("symmetry", ["full", "half"])
def test_a_patch_of_its_own_size_leaves_the_damper_as_it_is(symmetry: Any) -> None:
    """34 x 12 squares of 0.5 mm in the middle of the face; section, length and place stay."""
    own = WedgePlatform(patch_length=6.0, patch_width=17.0, band=4.0, growth=1.8, symmetry=symmetry)
    meshes = build(own)
    check_pairs(meshes)
    share = 0.5 if symmetry == "half" else 1.0
    assert props(meshes["damper"]).volume == pytest.approx(share * 216.0 * 42.5, rel=1e-10)
    for mesh in meshes.values():
        x, y, _ = mesh.points[mesh.nodes["contact"]].T
        assert np.unique(np.abs(x)) == pytest.approx(0.5 * np.arange(18), abs=1e-12)
        assert np.array_equal(np.unique(y), 0.5 * np.arange(-6, 7))
    damper = meshes["damper"]
    assert np.abs(damper.points[:, 0]).max() == 21.25
    # in line with the middles of the two halves of the contact
    bands = np.abs(damper.points[damper.nodes["distant_bands"], 0])
    assert (bands.min(), bands.max()) == pytest.approx((2.0, 6.5))
    weights = damper.weights["distant_bands"]
    assert weights @ bands / weights.sum() == pytest.approx(4.25)
    # the upper end of the patch stays where it was
    for p in (own, WedgePlatform()):
        origin, axes = placement(p)
        assert origin + p.patch_length / 2.0 * axes[1] == pytest.approx(
            [3.0 + 1.5 / np.sqrt(2.0), 0.0, 77.75 - 1.5 / np.sqrt(2.0)]
        )


def test_place_in_the_rig() -> None:
    params = WedgePlatform()
    origin, axes = placement(params)
    assert inclination(params) == (45.0, 45.0)
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 4 * EPS
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[0] == pytest.approx([0.0, -1.0, 0.0])
    # reconstructed centre of gravity: base 12 mm below the tips, centroid at h/3 (b + 2 t)/(b + t)
    height = section(params)[1]
    assert origin + centroid(params) @ axes == pytest.approx(
        [0.0, 0.0, 77.75 - 12.0 + height], abs=1e-12
    )
    assert height + 65.75 == pytest.approx(70.417, abs=5e-4)
    # the patch ends 1.5 mm below the tip on the slope x + z = const
    upper_end = origin + 7.5 * axes[1]
    assert upper_end == pytest.approx([3.0 + 1.5 / np.sqrt(2.0), 0.0, 77.75 - 1.5 / np.sqrt(2.0)])
