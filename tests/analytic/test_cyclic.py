"""Cyclic symmetry against the exact plate, the whole ring, another program and itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.sectors import (
    STEEL,
    bladed_sector,
    lattice_sector,
    model_of,
    whole_ring,
    with_contacts,
)
from upd.errors import ConvergenceError, InputError, MeshError
from upd.fem import mass, stiffness
from upd.linalg import modes
from upd.linalg.hermitian import hermitian_factor, hermitian_modes
from upd.mesh import Mesh
from upd.reduction.cyclic import (
    CyclicModel,
    ModeFamily,
    Sector,
    facing_contacts,
    reduce_sector,
    turn,
)

#: clamped at 100 mm, free at 200 mm, 1 mm thick: the Kirchhoff plate's closed form by Bessel
#: functions (Leissa, Vibration of Plates, NASA SP-160), nodal diameters 0 to 6, Hz
PLATE = (79.40895, 81.02786, 89.64921, 113.17253, 156.05781, 217.84653, 296.75689)
#: CalculiX 2.20, C3D20 with 3 x 3 x 3 points, *CYCLIC SYMMETRY MODEL: the bladed sector at rest, Hz
AT_REST = {
    0: (458.9307, 1270.315),
    1: (460.8814, 1305.231),
    2: (476.1320, 1325.222),
    3: (514.8621, 1325.728),
    6: (595.3743, 1318.280),
}


def annulus_errors(radial: int, around: int, element: str = "hex20") -> np.ndarray:
    """Of the first frequency for nodal diameters 0 to 6, one element thick."""
    mesh = lattice_sector(
        np.linspace(100, 200, radial + 1), np.linspace(0, 30, around + 1), [-0.5, 0.5]
    )
    model = model_of(mesh, 12, element=element)
    found = [model.modes(n, 1).frequency[0] for n in range(len(PLATE))]
    return np.array(found) / PLATE - 1.0


def test_an_annulus_has_the_frequencies_of_the_plate() -> None:
    coarse, middle, fine = (annulus_errors(n, n // 4) for n in (8, 16, 32))
    # 16 x 4 elements have 1 % up to three nodal diameters, 2.6 % at six; 32 x 8 have .53 % there
    assert (middle > 0.0).all() and (middle[:4] < 0.008).all() and (middle < 0.026).all()
    assert (fine < 0.0055).all()
    # full integration locks in thin elements: the error halves along the radius, a wave of six
    # diameters gains a factor of five
    assert (middle < coarse / 2.0).all() and (fine < middle / 2.0).all() and fine[6] < middle[6] / 4


def test_reduced_integration_does_not_lock_in_an_annulus() -> None:
    """16 x 4 elements have .7 % of every nodal diameter; what is left is the plate's own limit.

    Its theory has no shear and no corner at the clamped edge, so the finest mesh ends a little off.
    """
    coarse, middle, fine = (annulus_errors(n, n // 4, "hex20r") for n in (8, 16, 32))
    assert (abs(middle) < 0.007).all()
    assert (abs(fine) < 0.0035).all()
    assert (abs(middle[:4]) < abs(coarse[:4]) / 1.9).all()
    assert (abs(middle[4:]) < abs(annulus_errors(16, 4)[4:]) / 5.0).all()


@pytest.mark.parametrize("n", AT_REST)
def test_a_sector_at_rest_is_that_of_calculix(n: int) -> None:
    found = model_of(bladed_sector(), 12).modes(n, 2).frequency
    np.testing.assert_allclose(found, AT_REST[n], rtol=1e-6)


def test_sectors_have_the_modes_of_the_whole_ring() -> None:
    mesh = lattice_sector(
        [60, 80, 100], [0, 18, 36, 72], [-4, 4], lambda r, a: r < 80 or 18 < a < 36
    )
    model = model_of(mesh, 5)
    ring, _ = whole_ring(mesh, 5)
    K, M = stiffness(ring, STEEL, "hex20"), mass(ring, STEEL)
    held = np.flatnonzero(np.hypot(*ring.points[:, :2].T) < 60.0 + 1e-6)
    free = np.setdiff1d(np.arange(3 * ring.n_node), (3 * held[:, None] + np.arange(3)).ravel())
    expected = modes(K[free][:, free], M[free][:, free], count=15).frequency
    # nodal diameters 1 and 2 of five sectors travel either way: each frequency twice
    found = [np.repeat(model.modes(n, 15).frequency, 2 if n else 1) for n in range(3)]
    np.testing.assert_allclose(np.sort(np.concatenate(found))[:15], expected, rtol=1e-8)


def test_none_is_missed_and_the_real_form_has_each_twice() -> None:
    model = model_of(bladed_sector(), 12)
    K, M = model.stiffness(2), model.M.at(2)
    doubled = [np.block([[A.real, -A.imag], [A.imag, A.real]]) for A in (K.toarray(), M.toarray())]
    twice = modes(*doubled, count=16).frequency
    found = hermitian_modes(K, M, 8, hermitian_factor(K)).frequency
    np.testing.assert_allclose(np.repeat(found, 2), twice, rtol=1e-8)


def test_superlu_gives_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    model = model_of(bladed_sector(), 12)
    expected = model.modes(2, 4).frequency
    monkeypatch.setattr("upd.linalg.hermitian.has_pardiso", lambda: False)
    np.testing.assert_allclose(model.modes(2, 4).frequency, expected, rtol=1e-9)


def test_nodal_diameters_0_and_half_are_real() -> None:
    model = model_of(bladed_sector(), 12)
    real = {n: not np.iscomplexobj(model.stiffness(n)) for n in model.nodal_diameters}
    assert real == {n: n in (0, 6) for n in range(7)}
    assert not np.iscomplexobj(model.modes(6, 1).shapes)


def test_numbering_and_place_of_the_sector_do_not_matter() -> None:
    mesh = bladed_sector()
    order = np.random.default_rng(1).permutation(mesh.n_node)
    number = np.argsort(order)
    moved = Mesh(
        mesh.points[order] @ turn(0.7).T,
        number[mesh.hexes],
        {},
        {name: number[nodes][::-1] for name, nodes in mesh.nodes.items()},
    )
    one, other = (model_of(m, 12).modes(2, 4).frequency for m in (mesh, moved))
    np.testing.assert_allclose(other, one, rtol=1e-9)


def test_a_mode_travels_with_the_numbers() -> None:
    """The high face of the mode's field is the low face, turned and delayed."""
    model = model_of(bladed_sector(), 12)
    sector = model.sector
    mode = model.modes(2, 1)
    u = sector.field(mode.shapes[:, 0], 2).reshape(-1, 3)
    # K_n is that of this field, not of the one that travels the other way
    energy = u.ravel().conj() @ (stiffness(sector.mesh, STEEL, "hex20") @ u.ravel())
    assert energy == pytest.approx((2.0 * np.pi * mode.frequency[0]) ** 2, rel=1e-6)
    expected = u[sector.low] @ turn(np.pi / 6).T * np.exp(2j * np.pi * 2 / 12)
    np.testing.assert_allclose(u[sector.high], expected, atol=1e-12 * np.abs(u).max())
    assert np.abs(u[sector.low]).max() > 1e-6 * np.abs(u).max()


def test_few_nodal_diameters_give_all_the_others() -> None:
    model = model_of(bladed_sector(), 12, rotating=True)
    family = ModeFamily.of(model, (0, 2, 4, 6), 6)
    for n, speed in ((1, 0.0), (3, 500.0), (5, 1000.0), (6, 1000.0)):
        found = family.frequencies(n, 4, speed)
        error = found / model.modes(n, 4, speed).frequency - 1.0
        assert (error > -1e-9).all() and (error < 1e-7).all()


@pytest.mark.parametrize("n", [0, 3, 5, 6])
def test_craig_bampton_sector(n: int) -> None:
    mesh = with_contacts(bladed_sector())
    model = model_of(mesh, 12)
    keep = {"tip": mesh.nodes["tip"]}
    few, many = (
        reduce_sector(model, n, n_modes=m, keep=keep, damping=(1.0, 1e-6)) for m in (5, 20)
    )
    assert (many.frequency_error > -1e-9).all() and (many.frequency_error < 2e-4).all()
    assert (many.frequency_error < few.frequency_error).all()
    for A in (many.K, many.M, many.C):
        assert np.array_equal(A, A.conj().T)
        assert (np.abs(A.imag).max() > 0.0) == (n not in (0, 6))
    np.testing.assert_allclose(many.C, many.M + 1e-6 * many.K)


def test_the_response_of_the_reduced_sector_is_that_of_the_full_one() -> None:
    """Compliance of both contacts and the tip at a frequency below the first resonance."""
    mesh, n, w = with_contacts(bladed_sector()), 2, 2.0 * np.pi * 300.0
    model = model_of(mesh, 12)
    reduced = reduce_sector(model, n, n_modes=20, keep={"tip": mesh.nodes["tip"]})
    rows = np.vstack([reduced.B_high, reduced.B_low * np.exp(2j * np.pi * n / 12)])
    rows = np.vstack([rows, reduced.rows["tip"]])
    found = rows @ np.linalg.solve(reduced.K - w**2 * reduced.M, rows.conj().T)
    right, left = facing_contacts(model.sector)
    D = (model.stiffness(n) - w**2 * model.M.at(n)).toarray()
    x = model.sector.field(np.eye(len(D)), n).reshape(-1, 3, len(D))
    next_low = turn(np.pi / 6) @ x[left] * np.exp(2j * np.pi * n / 12)
    B = np.concatenate([x[right], next_low, x[mesh.nodes["tip"]]]).reshape(-1, len(D))
    np.testing.assert_allclose(found, B @ np.linalg.solve(D, B.conj().T), rtol=2e-3, atol=1e-9)
    np.testing.assert_allclose(np.hypot(*reduced.high[:, :2].T), np.hypot(*reduced.low[:, :2].T))
    angle = np.degrees(np.arctan2(reduced.low[:, 1], reduced.low[:, 0]))
    np.testing.assert_allclose(angle, 35.0)


def test_the_other_way_round_is_the_conjugate() -> None:
    mesh = with_contacts(bladed_sector())
    model = model_of(mesh, 12)
    one = reduce_sector(model, 2, n_modes=6, keep={})
    other = one.conjugate()
    assert other.nodal_diameter == 10
    np.testing.assert_array_equal(other.K, one.K.T)
    K = model.K.at(10)
    np.testing.assert_allclose(K.toarray(), model.K.at(2).conj().toarray(), atol=1e-3)


# -- bad input -------------------------------------------------------------------------------------


def test_faces_that_do_not_match_name_the_right_number() -> None:
    with pytest.raises(MeshError, match=r"2 pi/11.*30 deg apart, 12 sectors"):
        Sector.of(bladed_sector(), 11)


def test_exchanged_faces_are_named() -> None:
    mesh = bladed_sector()
    nodes = {**mesh.nodes, "low": mesh.nodes["high"], "high": mesh.nodes["low"]}
    with pytest.raises(MeshError, match="exchange the names low and high"):
        Sector.of(replace(mesh, nodes=nodes), 12)


def test_a_node_out_of_place_is_an_error_and_a_small_offset_is_reported() -> None:
    mesh = bladed_sector()
    points = mesh.points.copy()
    points[mesh.nodes["high"][3], 2] += 1e-4
    found = Sector.of(mesh.with_points(points), 12)
    assert found.offset == pytest.approx(1e-4, rel=1e-6)
    points[mesh.nodes["high"][3], 2] += 1.0
    with pytest.raises(MeshError, match=r"largest offset is 1 mm"):
        Sector.of(mesh.with_points(points), 12)


def test_a_mesh_that_is_no_sector() -> None:
    mesh = bladed_sector()
    with pytest.raises(MeshError, match="no node set low and no high"):
        Sector.of(replace(mesh, nodes={"clamped": mesh.nodes["clamped"]}), 12)
    with pytest.raises(MeshError, match="of them in both"):
        Sector.of(replace(mesh, nodes={**mesh.nodes, "high": mesh.nodes["low"]}), 12)
    with pytest.raises(InputError, match="two or more"):
        Sector.of(mesh, 1)


def test_contacts_that_do_not_match() -> None:
    mesh = with_contacts(bladed_sector())
    sector = Sector.of(mesh, 12)
    with pytest.raises(MeshError, match="6 and 5 nodes"):
        left = {"contact_left": mesh.nodes["contact_left"][1:]}
        facing_contacts(replace(sector, mesh=replace(mesh, nodes={**mesh.nodes, **left})))
    with pytest.raises(MeshError, match="do not match in radius"):
        left = {"contact_left": mesh.nodes["clamped"][:6]}
        facing_contacts(replace(sector, mesh=replace(mesh, nodes={**mesh.nodes, **left})))


def test_kept_nodes_have_unknowns() -> None:
    mesh = with_contacts(bladed_sector())
    with pytest.raises(InputError, match=r"out: node .* clamped or on the high face"):
        reduce_sector(model_of(mesh, 12), 0, n_modes=2, keep={"out": mesh.nodes["high"][-1:]})


def test_a_sector_that_floats() -> None:
    sector = Sector.of(bladed_sector(), 12)
    sector.mesh.nodes["clamped"] = sector.mesh.nodes["clamped"][:0]  # type: ignore[index]
    model = CyclicModel.of(sector, stiffness(sector.mesh, STEEL, "hex20"), mass(sector.mesh, STEEL))
    with pytest.raises(ConvergenceError, match="not positive definite"):
        model.modes(0, 2)
