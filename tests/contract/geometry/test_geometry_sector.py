"""The sector of a bladed disk: faces, contact patches, dimensions, bounds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from geometry.sector import BladedSector, build, count
from upd.errors import InputError
from upd.fem import Material, mass_properties
from upd.mesh.checks import scaled_jacobian
from upd.reduction.cyclic import Sector, facing_contacts, turn


@pytest.mark.parametrize("nodes", [8, 20, 27])
@pytest.mark.parametrize("stagger", [0.0, 30.0])
def test_faces_and_patches_match(nodes: int, stagger: float) -> None:
    params = BladedSector(element_nodes=nodes, stagger=stagger, axial=4)
    mesh = build(params)["sector"]
    assert scaled_jacobian(mesh).min() > 0.5
    sector = Sector.of(mesh, params.n_sectors)
    assert sector.offset < 1e-10
    right, left = facing_contacts(sector)
    np.testing.assert_array_equal(right, mesh.nodes["contact_right"])
    np.testing.assert_array_equal(left, mesh.nodes["contact_left"])
    assert len(right) == params.overhang_columns * (params.axial + 1)
    assert count(params)["sector"] == {
        "nodes": mesh.n_node,
        "hexes": mesh.n_hex,
        "contact": len(right),
    }


def test_patches_are_as_far_from_the_gap_on_both_sides() -> None:
    params = BladedSector(stagger=20.0)
    mesh = build(params)["sector"]
    right = mesh.points[mesh.nodes["contact_right"]]
    left = mesh.points[mesh.nodes["contact_left"]] @ turn(params.pitch).T
    apart = np.linalg.norm(left - right, axis=1)
    # the last row is at the platform's end
    end = params.radii[2] + params.rise
    assert apart.min() == pytest.approx(2.0 * end * math.sin(params.half_gap / end), rel=1e-9)
    radius = np.hypot(*right[:, :2].T)
    assert radius.max() == pytest.approx(end)
    assert radius.min() == pytest.approx(params.radii[2] + params.rise / params.overhang_columns)
    assert (np.diff(np.hypot(*left[:, :2].T)) > -1e-9).all()


def test_the_disk_is_a_ring() -> None:
    """Without taper and stagger: the volume of its parts, chords of the arcs but for 1e-4."""
    p = BladedSector(bore_width=30.0, taper=1.0, stagger=0.0, face_angle=0.0)
    bore, rim, under, top, tip = p.radii
    arcs = {
        "disk": 0.5 * p.pitch * (rim**2 - bore**2),
        "shank and blade": p.blade_thickness * (under - rim + tip - top),
        "platform": 0.5 * p.pitch * (top**2 - under**2) - 2.0 * p.half_gap * (top - under),
    }
    found = mass_properties(build(p)["sector"], Material(1.0, 0.3, 1.0)).volume
    assert found == pytest.approx(p.chord * sum(arcs.values()), rel=1e-4)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"bore": 150.0}, "bore: 150 mm is no less than the rim's 140 mm"),
        ({"blade_thickness": 40.0}, "blade_thickness: 40 mm leaves no platform"),
        ({"n_sectors": 2}, "n_sectors"),
        ({"face_angle": 45.0}, "face_angle: 45 deg rises through the platform; at most"),
        ({"overhang_columns": 1}, "overhang_columns"),
    ],
)
def test_bounds(given: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        BladedSector(**given)  # type: ignore[arg-type]
