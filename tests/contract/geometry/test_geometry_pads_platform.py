"""What a mesh of the damper with two pads promises beside `test_geometry_platforms`.

Pairing, sets, wires, place in the rig.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from geometry.blocks.strips import band_weights
from geometry.pads_platform import (
    PadsPlatform,
    build,
    centroid,
    count,
    inclination,
    placement,
    section_corners,
)
from upd.fem import Material
from upd.fem.inertia import MassProperties, mass_properties
from upd.mesh import Mesh
from upd.mesh.checks import check_pairs, scaled_jacobian

EPS = np.finfo(float).eps
SMALL: dict[str, Any] = {"divisions": 3, "divisions_long": 5, "growth": 1.8}
ALL = list(itertools.product(("full", "half"), (8, 20, 27)))
DENSITY_ONE = Material(E=1.0, nu=0.3, rho=1.0)


def props(mesh: Mesh) -> MassProperties:
    return mass_properties(mesh, DENSITY_ONE)


def section_area(p: PadsPlatform) -> float:
    """Trapezium between the vertical face and the cut."""
    far = p.ab - p.cut * (
        1.0 / np.tan(np.radians(p.angle_a)) - np.tan(np.radians(p.angle_b - 90.0))
    )
    return float(p.cut * (p.ab + far) / 2.0)


@pytest.fixture(scope="module")
def made() -> dict[tuple[str, int], dict[str, Mesh]]:
    return {
        (symmetry, size): build(PadsPlatform(symmetry=symmetry, element_nodes=size, **SMALL))
        for symmetry, size in ALL
    }  # type: ignore[arg-type]


def test_default_pads_have_629_nodes_each() -> None:
    size = count(PadsPlatform())
    for name, mesh in build(PadsPlatform()).items():
        assert len(mesh.nodes["contact"]) == size[name]["contact"] == 1258
        assert len(mesh.nodes["contact_left"]) == len(mesh.nodes["contact_right"]) == 629
        assert len(mesh.faces["contact"]) == 2 * 36 * 16
        x, y = np.meshgrid(3.25 + 0.5 * np.arange(37), 0.5 * np.arange(-8, 9), indexing="ij")
        right = mesh.points[mesh.nodes["contact_right"]]
        assert np.array_equal(right[:, 1], y.ravel())
        assert np.abs(right[:, 0] - x.ravel()).max() < 4 * EPS * 21.25
        assert 3 * mesh.n_node < 1.5e5
    damper = build(PadsPlatform())["damper"]
    wires = damper.points[damper.nodes["distant_wires"], 0]
    assert np.unique(np.abs(wires)) == pytest.approx([11.25, 11.75, 12.25, 12.75, 13.25])


def test_elements_at_the_bottom_are_as_thin_as_asked() -> None:
    """At the pads' centre; elsewhere with the height there."""
    p = PadsPlatform(
        first_layer=0.7,
        bottom_layer=0.5,
        divisions=4,
        divisions_long=9,
        growth=1.4,
        symmetry="half",
    )
    damper = build(p)["damper"]
    at = {name: np.array(place) for name, place in section_corners(p).items()}
    down = np.array([0.0, *(at["bottom"] - at["top"])]) / p.ab
    ends = damper.hexes[:, list(itertools.combinations(range(8), 2))].reshape(-1, 2)
    ends = ends[np.isin(ends, damper.nodes["distant_bottom"]).sum(axis=1) == 1]
    edges = np.diff(damper.points[ends], axis=1)[:, 0]
    lengths = np.linalg.norm(edges, axis=1)
    sizes = lengths[np.abs(edges @ down) > (1.0 - 1e-9) * lengths]
    assert len(sizes) >= len(damper.nodes["distant_bottom"])
    lowest = p.ab - p.cut * p.taper
    centre = p.ab - p.taper * p.along * np.cos(np.radians(p.slope))
    wanted = 0.5 * min(p.pad_length / 4, p.pad_width / 9) / centre
    assert sizes.min() == pytest.approx(wanted * lowest, rel=1e-9)
    assert sizes.max() == pytest.approx(wanted * p.ab, rel=1e-9)


@pytest.mark.parametrize("key", ALL)
def test_contact_nodes_are_the_same_lattice_in_both_bodies(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    check_pairs(made[key])
    assert list(made[key]) == ["damper", "platform"]
    names = ["contact", "contact_right"] + ["contact_left"] * (key[0] == "full")
    for name in names:
        upper, lower = (mesh.points[mesh.nodes[name]] for mesh in made[key].values())
        assert np.array_equal(upper, lower)
        assert np.array_equal(upper[:, 2], np.zeros(len(upper)))
        assert np.array_equal(np.lexsort((upper[:, 1], upper[:, 0])), np.arange(len(upper)))
        assert np.array_equal(np.unique(upper[:, 1]), -np.unique(upper[:, 1])[::-1]), (
            "y is exactly opposite"
        )
        assert (upper[:, 1].min(), upper[:, 1].max()) == (-4.0, 4.0)
    for mesh in made[key].values():
        assert sorted(name for name in mesh.nodes if name.startswith("contact")) == sorted(names)
        right = mesh.points[mesh.nodes["contact_right"], 0]
        assert (right.min(), right.max()) == (3.25, 21.25)
        pads = [
            mesh.nodes[name] for name in ("contact_left", "contact_right") if name in mesh.nodes
        ]
        assert np.array_equal(mesh.nodes["contact"], np.concatenate(pads))
        assert np.array_equal(np.unique(mesh.faces["contact"]), np.sort(mesh.nodes["contact"]))


@pytest.mark.parametrize("key", ALL)
def test_sets_lie_where_their_names_say(
    made: dict[tuple[str, int], dict[str, Mesh]], key: tuple[str, int]
) -> None:
    damper, platform = made[key].values()
    origin, axes = placement(PadsPlatform(**SMALL))
    rig = origin + damper.points @ axes
    # the bottom falls by 5 degrees from the lower end of the vertical face
    bottom = np.abs(rig[:, 2] - (61.171 - (rig[:, 0] + 1.5) * np.tan(np.radians(5.0)))) < 1e-9
    assert set(np.flatnonzero(bottom)) == set(damper.nodes["distant_bottom"])
    X = np.abs(damper.points[:, 0])
    assert set(damper.nodes["distant_wires"]) <= set(np.flatnonzero(bottom))
    assert np.array_equal(damper.nodes["distant"], damper.nodes["distant_wires"])
    # all of the elements that the wires' bands reach into, 3.6 mm long: lines at 10.45 and 14.05
    reached = bottom & (X > 10.45 - 1e-9) & (X < 14.05 + 1e-9)
    assert set(np.flatnonzero(reached)) == set(damper.nodes["distant_wires"])
    assert set(np.flatnonzero(platform.points[:, 2] == -20.0)) == set(
        platform.nodes["distant_opposite"]
    )
    assert np.array_equal(platform.nodes["distant"], platform.nodes["distant_opposite"])
    outside = (np.abs(platform.points[:, 0]) > 31.25 - 1e-9) | (
        np.abs(platform.points[:, 1]) > 14.0 - 1e-9
    )
    assert set(np.flatnonzero(outside)) == set(platform.nodes["distant_sides"])
    # nothing but the pads comes below the padded face
    low = np.flatnonzero(damper.points[:, 2] < 1.0)
    assert np.abs(damper.points[low, 1]).max() <= 4.0 + 1e-9
    assert X[low].min() >= 3.25
    for mesh in made[key].values():
        assert ("plane_x" in mesh.nodes) == (key[0] == "half")
        if key[0] == "half":
            assert mesh.points[:, 0].min() == 0.0
            assert np.array_equal(mesh.nodes["plane_x"], np.flatnonzero(mesh.points[:, 0] == 0.0))


@pytest.mark.parametrize("symmetry", ["full", "half"])
@pytest.mark.parametrize("size", [8, 20, 27])
@pytest.mark.parametrize("long", [1, 3, 5, 8])
def test_wires_are_as_wide_as_they_are_told(long: int, size: int, symmetry: Any) -> None:
    """Area 2 b w, middles and (of quadratic elements) second moments of the strips, closed form;
    the bottom is cut / cos(5 degrees) wide.
    """
    p = PadsPlatform(
        divisions=2, divisions_long=long, growth=1.8, element_nodes=size, symmetry=symmetry
    )
    damper, copies = build(p)["damper"], 2.0 if symmetry == "half" else 1.0
    nodes, weights = damper.nodes["distant_wires"], damper.weights["distant_wires"]
    x = damper.points[nodes, 0]
    across = p.cut / np.cos(np.radians(p.angle_b - 90.0))
    area = 2.0 * p.wire_width * across
    assert copies * weights.sum() == pytest.approx(area, rel=1e-10)
    assert copies * weights @ np.abs(x) == pytest.approx(area * p.wire_position, rel=1e-10)
    if size > 8:
        second = area * (p.wire_position**2 + p.wire_width**2 / 12.0)
        assert copies * weights @ x**2 == pytest.approx(second, rel=1e-10)
    # the load line lies in the middle of the bottom
    corners = section_corners(p)
    middle = np.add(corners["bottom"], corners["cut_bottom"]) / 2.0
    assert weights @ damper.points[nodes, 1:] / weights.sum() == pytest.approx(middle, abs=1e-8)
    assert np.array_equal(damper.weights["distant"], weights)
    assert set(damper.weights) == {"distant", "distant_wires"}


@pytest.mark.parametrize("long", [36, 30, 20, 12, 10])
def test_wires_that_end_on_lattice_lines_end_there(long: int) -> None:
    """Whatever the rounding of the lines: no sliver of a further element belongs to the band."""
    size = 18.0 / long
    damper = build(PadsPlatform(divisions=1, divisions_long=long, growth=1.9))["damper"]
    for line in range(1, long):
        nodes, _ = band_weights(damper, damper.faces["bottom"], 3.25 + size * line, 2.0 * size)
        x = np.unique(np.abs(damper.points[nodes, 0]).round(9))
        assert x == pytest.approx(3.25 + size * np.arange(line - 1, line + 2))


@pytest.mark.parametrize("size", [8, 20, 27])
@pytest.mark.parametrize("offset", [1e-3, 0.5])
def test_left_pad_lower(
    made: dict[tuple[str, int], dict[str, Mesh]], size: int, offset: float
) -> None:
    p = PadsPlatform(pad_offset=offset, element_nodes=size, **SMALL)
    meshes = build(p)
    check_pairs(meshes)
    damper, level = meshes["damper"], made["full", size]["damper"]
    assert np.array_equal(
        damper.points[damper.nodes["contact_left"], 2],
        np.full(len(damper.nodes["contact_left"]), offset),
    )
    assert np.array_equal(
        damper.points[damper.nodes["contact_right"]], level.points[level.nodes["contact_right"]]
    )
    body = level.points[:, 2] >= 1.0
    assert np.array_equal(damper.points[body], level.points[body])
    assert scaled_jacobian(damper).min() > 0.3
    assert props(damper).volume == pytest.approx(
        props(level).volume - 18.0 * 8.0 * offset, rel=1e-11
    )
    assert np.abs(props(damper).centre - centroid(p)).max() < 1e-10


def test_place_in_the_rig() -> None:
    p = PadsPlatform()
    origin, axes = placement(p)
    assert inclination(p) == pytest.approx((90.0, 30.0))
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 4 * EPS
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[0] == pytest.approx([0.0, -1.0, 0.0])
    assert origin[0] == pytest.approx(-1.5 + 7.129, abs=1e-12)
    # the platform's underside falls by 30 degrees from its tip, 3 mm right of the vertical face:
    # (1.5, 72.593), rounded to 1e-3
    assert origin[2] == pytest.approx(
        72.593 - (origin[0] - 1.5) * np.tan(np.radians(30.0)), abs=2e-3
    )
    # reconstructed centre of gravity without the pads: (5.629, 64.801), hence below the pads'
    # centre; they shift it by their share
    share = 288.0 / (section_area(p) * 42.5 + 288.0)
    pads = origin + np.array([0.0, 0.0, 0.5]) @ axes
    whole = origin + centroid(p) @ axes
    assert (whole - share * pads) / (1.0 - share) == pytest.approx([5.629, 0.0, 64.801], abs=1e-3)
