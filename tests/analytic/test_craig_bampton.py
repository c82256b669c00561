"""Craig-Bampton: exact in its limits, an upper bound between them, six rigid motions of a floating
body; kept on disk.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from upd.errors import ConvergenceError, InputError
from upd.fem import Material, box_mesh, mass, rigid_body_modes, stiffness
from upd.linalg import factorise, modes, schur_complement
from upd.reduction import ErrorTarget, ReducedModel, craig_bampton, frequency_error

EPS = np.finfo(float).eps
STEEL = Material(200e3, 0.3)


def beam(clamped=True, shape=(10, 3, 3)):
    """K, M of a steel beam of 100 x 15 x 10 mm, the numbers of its free dofs, its mesh.

    Boundary: dofs of four corners of its far end.
    """
    mesh = box_mesh(
        *(
            np.linspace(0.0, length, n + 1)
            for length, n in zip((100.0, 15.0, 10.0), shape, strict=True)
        )
    )
    free = np.arange(3 * mesh.n_node)
    if clamped:
        free = np.setdiff1d(free, (3 * mesh.nodes["x0"][:, None] + np.arange(3)).ravel())
    K, M = (csr_array(A[free][:, free]) for A in (stiffness(mesh, STEEL), mass(mesh, STEEL)))
    end = mesh.nodes["x1"]
    corners = end[
        np.isin(mesh.points[end, 1], (0.0, 15.0)) & np.isin(mesh.points[end, 2], (0.0, 10.0))
    ]
    assert len(corners) == 4
    return K, M, np.searchsorted(free, (3 * corners[:, None] + np.arange(3)).ravel()), mesh, free


def test_without_modes_it_is_guyan():
    K, M, boundary, _, _ = beam()
    model = craig_bampton(K, M, boundary, n_modes=0)
    T = schur_complement(K, boundary).recover(np.eye(12))
    np.testing.assert_allclose(model.M, T.T @ (M @ T), rtol=0, atol=1e-12 * model.M.max())
    assert (model.n, len(model.boundary), model.n_modes) == (12, 12, 0)
    # Loads on the boundary give exact displacements everywhere.
    force = np.zeros(K.shape[0])
    force[boundary] = np.random.default_rng(0).standard_normal(12)
    exact = factorise(K)(force)
    np.testing.assert_allclose(
        model.basis @ np.linalg.solve(model.K, model.basis.T @ force),
        exact,
        rtol=0,
        atol=1e-9 * abs(exact).max(),
    )


def test_all_modes_give_the_full_model():
    K, M, boundary, _, _ = beam(shape=(4, 1, 1))
    n = K.shape[0]
    model = craig_bampton(K, M, boundary, n_modes=n - 12)
    full = modes(K, M, count=n)
    # Cond(K) is 1e6 here.
    np.testing.assert_allclose(model.modes(count=n).frequency, full.frequency, rtol=1e-8)


def test_frequencies_fall_towards_the_full_model_as_modes_are_added():
    K, M, boundary, _, _ = beam()
    full = modes(K, M, count=6)
    model = craig_bampton(K, M, boundary, n_modes=30)
    errors = np.array([frequency_error(model.truncated(m), full, 6) for m in (0, 5, 10, 20, 30)])
    # A Ritz method: from above, and nested spaces never rise (Courant, Fischer).
    assert (errors > -1e-9).all()
    assert (np.diff(errors, axis=0) < 1e-9).all()
    assert errors[0].max() > 1e-2
    assert errors[-1, :4].max() < 3e-4
    assert np.allclose(model.K[12:, :12], 0.0, atol=0)
    np.testing.assert_allclose(model.M[12:, 12:], np.eye(30), atol=0)


def test_shapes_of_the_full_model_come_back():
    K, M, boundary, _, _ = beam()
    full = modes(K, M, count=3)
    model = craig_bampton(K, M, boundary, n_modes=30)
    shapes = model.basis @ model.modes(count=3).shapes
    mac = np.abs(np.einsum("ij,ij->j", full.shapes, M @ shapes))
    # 1 - MAC goes with the error of the eigenvalue over the gap.
    np.testing.assert_allclose(mac, 1.0, atol=1e-4)
    np.testing.assert_array_equal(model.boundary, boundary)
    np.testing.assert_allclose(model.at(boundary[[3]])[0], np.eye(model.n)[3], atol=1e-14)


def test_modes_up_to_a_frequency():
    K, M, boundary, _, _ = beam()
    model = craig_bampton(K, M, boundary, below_hz=2e4)
    inner = np.setdiff1d(np.arange(K.shape[0]), boundary)
    held = modes(
        csr_array(K[inner][:, inner]), csr_array(M[inner][:, inner]), count=model.n_modes + 1
    )
    np.testing.assert_allclose(model.fixed_frequency, held.frequency[:-1], rtol=1e-8)
    assert model.fixed_frequency[-1] <= 2e4 < held.frequency[-1]


def test_as_few_modes_as_a_target_needs():
    K, M, boundary, _, _ = beam()
    full = modes(K, M, count=4)
    model = craig_bampton(K, M, boundary, target=ErrorTarget(3e-4, of=4))
    assert frequency_error(model, full, 4).max() <= 3e-4
    assert frequency_error(model.truncated(model.n_modes - 1), full, 4).max() > 3e-4
    with pytest.raises(ConvergenceError, match="allow more modes"):
        craig_bampton(K, M, boundary, target=ErrorTarget(1e-9, of=4, most=5))


def test_target_of_a_floating_body_counts_elastic_modes():
    K, M, boundary, _, _ = beam(clamped=False)
    model = craig_bampton(K, M, boundary, target=ErrorTarget(1e-3, of=3))
    full = modes(K, M, count=9)
    assert frequency_error(model, full, 3).max() <= 1e-3
    with pytest.raises(InputError, match="ask for fewer"):
        craig_bampton(*beam(shape=(1, 1, 1))[:3], target=ErrorTarget(1e-3, of=13))


def test_floating_body_keeps_six_rigid_motions():
    K, M, boundary, mesh, _ = beam(clamped=False)
    rigid = rigid_body_modes(mesh.points)
    model = craig_bampton(K, M, boundary, n_modes=20)
    found = model.modes(count=10)
    assert found.n_rigid == 6
    assert found.frequency[5] <= 1e-6 * found.frequency[6]
    full = modes(K, M, count=10)
    np.testing.assert_allclose(found.frequency[6:9], full.frequency[6:9], rtol=1e-3)
    # Their displacement is rigid: nothing is left of it off the span of the six.
    shapes = model.basis @ found.shapes[:, :6]
    rest = shapes - rigid @ (rigid.T @ shapes)
    assert np.linalg.norm(rest) < 1e-6 * np.linalg.norm(shapes)
    # The mass of a unit translation is the body's own.
    translation = np.concatenate([np.tile([1.0, 0.0, 0.0], 4), np.zeros(model.n_modes)])
    total = 100 * 15 * 10 * STEEL.rho
    q = np.linalg.lstsq(model.basis, np.tile([1.0, 0.0, 0.0], mesh.n_node), rcond=None)[0]
    np.testing.assert_allclose(q[:12], translation[:12], atol=1e-9)
    np.testing.assert_allclose(q @ model.M @ q, total, rtol=1e-9)


def test_saved_and_loaded(tmp_path):
    K, M, boundary, _, _ = beam(shape=(4, 2, 1))
    model = craig_bampton(K, M, boundary, n_modes=5, rows=boundary)
    again = ReducedModel.load(model.save(tmp_path / "blade.nc"))
    for name in ("K", "M", "boundary", "fixed_frequency", "rows", "basis"):
        a, b = getattr(model, name), getattr(again, name)
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    assert again.n_dof == model.n_dof
    empty = model.truncated(0)
    assert ReducedModel.load(empty.save(tmp_path / "static.nc")).n_modes == 0
    assert len(list(tmp_path.iterdir())) == 2


def test_only_the_rows_asked_for_are_kept():
    K, M, boundary, _, _ = beam()
    rows = np.concatenate([boundary[:3], [7, 5]])
    model, whole = (craig_bampton(K, M, boundary, n_modes=4, rows=r) for r in (rows, None))
    assert model.basis.shape == (5, 16)
    np.testing.assert_array_equal(model.basis, whole.basis[rows])
    np.testing.assert_array_equal(model.at([5, 7]), whole.basis[[5, 7]])
    with pytest.raises(InputError, match="not kept"):
        model.at([11])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "exactly one"),
        ({"n_modes": 3, "below_hz": 1.0}, "exactly one"),
        ({"n_modes": -1}, "n_modes = -1"),
        ({"n_modes": 10_000}, "dofs are left"),
        ({"below_hz": 0.0}, "positive frequency"),
        ({"target": ErrorTarget(error=0.0)}, "positive error"),
    ],
)
def test_bad_arguments(arguments, message):
    K, M, boundary, _, _ = beam(shape=(3, 1, 1))
    with pytest.raises(InputError, match=message):
        craig_bampton(K, M, boundary, **arguments)


def test_bad_files_and_a_body_that_floats_inside(tmp_path):
    K, M, boundary, _, _ = beam(clamped=False, shape=(3, 1, 1))
    with pytest.raises(ConvergenceError, match="floats"):
        craig_bampton(K, M, boundary[:3], n_modes=2)
    model = craig_bampton(K, M, boundary, n_modes=2)
    with pytest.raises(InputError, match="give the ending"):
        model.save(tmp_path / "model.txt")
    with pytest.raises(InputError, match="cannot be written"):
        model.save(tmp_path / "nowhere" / "model.nc")
    with pytest.raises(InputError, match="cannot be read"):
        ReducedModel.load(tmp_path / "absent.nc")
    (tmp_path / "text.nc").write_text("no netCDF")
    with pytest.raises(InputError, match="cannot be read"):
        ReducedModel.load(tmp_path / "text.nc")
    with pytest.raises(InputError, match="0 to 2"):
        model.truncated(3)
