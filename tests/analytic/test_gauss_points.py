"""Contact points by polynomials, and blades reduced to them: against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rigs import LINES
from scipy.linalg import eigh

from upd.analyses import make_plan
from upd.analyses.forced.blade_parts import FacePoints, fewer_rows, gauss_points, lagrange
from upd.analyses.forced.inputs import elastic_stuck, nearer
from upd.analyses.forced.measures import mode_shapes
from upd.analyses.forced.model import Model, make_model, preloaded
from upd.analyses.forced.statics import face_laws
from upd.analyses.seated.bodies import make_bodies
from upd.errors import InputError
from upd.fem import Material, box_mesh, mass, mass_properties, stiffness
from upd.fem.surface import face_mass, face_moments, traction_weights
from upd.linalg import modes
from upd.mesh import Mesh, recipes
from upd.progress import Stages
from upd.reduction import attachment_modes
from upd.scene import load_scene


def _meshes(arrangement: str, nodes: int = 20, **more: Any) -> dict[str, Mesh]:
    chosen = {"arrangement": arrangement, "damper": "free", "element_nodes": nodes, **more}
    return recipes.build_mesh("blade_rig", chosen)[0]


@pytest.fixture(scope="module", params=["symmetric", "asymmetric"])
def meshes(request: pytest.FixtureRequest) -> dict[str, Mesh]:
    return _meshes(request.param)


def _local(mesh: Mesh, points: FacePoints) -> np.ndarray:
    """Along the damper and up the slope of the nodes, about the middle of the face."""
    middle = points.weight @ points.position
    return np.asarray((mesh.points[points.nodes] - middle) @ points.frame[1:].T)


def test_lagrange_polynomials_of_gauss_points_are_orthogonal() -> None:
    (at, weight), (x, w) = map(np.polynomial.legendre.leggauss, (5, 12))
    values = lagrange(at, x)
    assert values @ (w[:, None] * values.T) == pytest.approx(np.diag(weight), abs=1e-13)


def test_points_move_as_a_polynomial_does(meshes: dict[str, Mesh]) -> None:
    """A quadratic is its own projection on three points; its square needs no more weight."""
    for side in ("left", "right"):
        mesh, points = meshes[side], gauss_points(meshes[side], 3, 4, side)
        y, z = _local(mesh, points).T
        middle = points.weight @ points.position
        at = (points.position - middle) @ points.frame[1:].T
        assert points.values @ (1.0 + y + z**2) == pytest.approx(1.0 + at[:, 0] + at[:, 1] ** 2)
        length = float(np.ptp(z))
        # stiffness in tilt of an even face: length^2 / 12
        assert points.weight @ at[:, 1] ** 2 == pytest.approx(length**2 / 12.0)


def test_a_mesh_does_not_change_what_points_are() -> None:
    """On twice as many elements the same positions and shares, and a smooth motion to their
    order; nodes of lines move with the lattice instead.
    """
    found = []
    for n in (1, 2):
        mesh = _meshes("symmetric", 8, patch_along_slope=4 * n, patch_along_y=10 * n)["right"]
        points = gauss_points(mesh, 3, 2, "right")
        _, z = _local(mesh, points).T
        found.append((points, points.values @ np.cos(z / 4.0)))
    (coarse, first), (fine, second) = found
    assert coarse.position == pytest.approx(fine.position)
    assert coarse.weight == pytest.approx(fine.weight)
    x, w = np.polynomial.legendre.leggauss(30)
    at, weight = np.polynomial.legendre.leggauss(3)
    exact = lagrange(at, x) @ (w * np.cos(7.5 * x / 4.0)) / weight
    errors = [np.abs(one.reshape(2, 3)[0] - exact).max() for one in (first, second)]
    assert errors[1] < errors[0] / 3.5


def test_points_of_fewer_rows_are_sums_of_those_of_more(meshes: dict[str, Mesh]) -> None:
    mesh = meshes["right"]
    whole = gauss_points(mesh, 5, 4, "right")
    own, at = gauss_points(mesh, 3, 4, "right"), fewer_rows(whole, 3)
    assert at @ whole.values == pytest.approx(own.values, abs=1e-12)
    assert at @ whole.position == pytest.approx(own.position)


def test_columns_that_the_parts_cannot_share_are_refused(meshes: dict[str, Mesh]) -> None:
    with pytest.raises(InputError, match=r"columns, right face: 3 are not the same number .* 2 pa"):
        gauss_points(meshes["right"], 3, 3, "right")


def test_face_moments_are_those_of_the_face_mass(meshes: dict[str, Mesh]) -> None:
    """Of 1 the tributary areas; of a linear function the face mass times it."""
    mesh = meshes["right"]
    faces = mesh.faces["patch"]
    found = face_moments(
        mesh.points, faces, lambda x: np.stack([np.ones(x.shape[:-1]), x[..., 2]]), 1
    )
    assert found[0] == pytest.approx(traction_weights(mesh.points, faces))
    assert found[1] == pytest.approx(face_mass(mesh.points, faces) @ mesh.points[:, 2])


def test_attachment_modes_keep_modes_and_static_compliance() -> None:
    mesh = box_mesh(np.linspace(0, 40, 5), np.linspace(0, 10, 3), np.linspace(0, 10, 3))
    material = Material(2e5, 0.3, 7.8e-9)
    free = np.flatnonzero(np.repeat(mesh.points[:, 0] > 0.0, 3))
    K, M = (
        A(mesh, material)[free][:, free]  # type: ignore[operator]
        for A in (lambda m, s: stiffness(m, s, "hex8i"), mass)
    )
    B = np.random.default_rng(3).standard_normal((4, len(free)))
    # a load twice over
    B[3] = B[0] + B[1]
    found = attachment_modes(K, M, B, 3)
    exact = modes(K, M, count=3)
    assert found.frequency == pytest.approx(exact.frequency)
    own = np.sqrt(eigh(found.K, found.M)[0][:3]) / (2.0 * np.pi)
    assert own == pytest.approx(exact.frequency)
    full = B @ np.linalg.solve(K.toarray(), B.T)
    assert found.rows @ np.linalg.solve(found.K, found.rows.T) == pytest.approx(full, rel=1e-9)
    assert len(found.K) == 3 + 3


def test_a_mirror_image_makes_the_whole_body() -> None:
    material = Material(2e5, 0.3, 7.8e-9)
    whole = box_mesh([1.0, 4.0], [-5.0, 0.0, 5.0], [0.0, 2.0, 3.0])
    half = box_mesh([1.0, 4.0], [0.0, 5.0], [0.0, 2.0, 3.0])
    # a body that is not even in x and z
    for one in (whole, half):
        one.points[one.points[:, 2] == 3.0, 0] += 1.0
    exact, found = mass_properties(whole, material), mass_properties(half, material)
    found = found.with_mirror_image(1)
    assert found.mass == pytest.approx(exact.mass)
    assert found.centre == pytest.approx(exact.centre)
    assert found.inertia == pytest.approx(exact.inertia, rel=1e-9, abs=1e-12 * exact.mass)


SMALL = {
    **LINES,
    "want": ["response"],
    "mesh.element": "hex8i",
    "geometry.refine": 0.5,
    "contact.stiffness": ["thesis"],
    "contact.static": "frictionless",
    "contact.rule": "gauss",
    "contact.rows": 3,
    "contact.columns": 4,
    "balance.method": "balance",
}


def _model(arrangement: str, **changes: Any) -> tuple[Model, list[float]]:
    scene = load_scene(f"{arrangement}-response", SMALL | changes)
    plan = make_plan(scene)
    laws = face_laws(scene.stiffnesses["thesis"], Stages())
    model = make_model(plan, make_bodies(plan), laws)
    return model, [m.frequency for m in mode_shapes(model, 1500.0).modes]


@pytest.mark.parametrize("arrangement", ["symmetric", "asymmetric"])
def test_half_a_rig_is_the_even_part_of_the_whole(arrangement: str) -> None:
    half, mine = _model(arrangement)
    whole, other = _model(arrangement, **{"mesh.symmetry": "full"})
    assert half.damper.kept == (0, 2, 4) and whole.damper.n_dof == 6
    assert 2 * half.contacts.n_point == whole.contacts.n_point
    assert half.damper.mass == pytest.approx(whole.damper.mass)
    for of in ("k_n", "k_t", "preload"):
        for k in (0, 1):
            one, two = (getattr(m.contacts.law, of)[m.face == k].sum() for m in (half, whole))
            assert one == pytest.approx(two, rel=1e-6, abs=1e-9 * half.damper.force.max())
    for f in mine[:2]:
        assert np.abs(np.array(other) / f - 1.0).min() < 1e-4


def test_an_elastic_damper_is_the_same_on_half_a_rig() -> None:
    """In series with its springs it lowers the stuck frequencies of the half as of the whole."""
    found = []
    for symmetry in ("auto", "full"):
        scene = load_scene("symmetric-response", SMALL | {"mesh.symmetry": symmetry})
        plan = make_plan(scene)
        bodies = make_bodies(plan)
        assert bodies.half == (symmetry == "auto")
        model = make_model(plan, bodies, face_laws(scene.stiffnesses["thesis"], Stages()))
        along_x = (m.frequency for m in elastic_stuck(plan, bodies, model))
        found.append([next(along_x), next(along_x)])
    assert found[0] == pytest.approx(found[1], rel=1e-4)


def test_points_on_half_of_each_face_are_the_model_of_a_smaller_patch() -> None:
    """The same stiffness and forces nearer to the middle: it stays, and what is uneven halves."""
    model, own = _model("symmetric", **{"left_out.solve": "no"})
    same, half = nearer(model, 1.0), nearer(model, 0.5)
    assert same is not None and half is not None and model.state is not None
    assert same.contacts.rows == pytest.approx(model.contacts.rows, abs=1e-12)
    assert half.contacts.law.k_t == pytest.approx(model.contacts.law.k_t)
    for k, side in enumerate(("left", "right")):
        on, up = model.face == k, model.faces[side].frame[2]
        was, now = (m.faces[side].position @ up for m in (model, half))
        middle = model.faces[side].weight @ was
        assert now - middle == pytest.approx(0.5 * (was - middle))
        # a rigid motion of the damper moves each point as its own place moves
        middle = model.faces[side].weight @ model.damper_rows[on].reshape(on.sum(), -1)
        uneven = [m.damper_rows[on].reshape(on.sum(), -1) - middle for m in (model, half)]
        along = model.faces[side].position @ model.faces[side].frame[1]
        pairs = [np.flatnonzero(np.isclose(along, one)) for one in np.unique(np.round(along, 6))]
        for mine in pairs:
            ends = [u[mine] - u[mine].mean(axis=0) for u in uneven]
            assert ends[1] == pytest.approx(0.5 * ends[0], abs=1e-12 * np.abs(ends[0]).max())
    # the static forces still hold the damper
    found = preloaded(half, model.state)
    N, T = found.contacts.law.preload, found.traction[:, -1]
    held = found.damper_rows[:, 0].T @ N + found.damper_rows[:, -1].T @ T
    assert held == pytest.approx(model.damper.force, abs=1e-6 * np.abs(model.damper.force).max())
    # less tilt stiffness: the stuck modes are lower
    lower = [m.frequency for m in mode_shapes(half, 1500.0).modes]
    assert all(a < b for a, b in zip(lower[:2], own[:2], strict=True))
    one_row, _ = _model("symmetric", **{"left_out.solve": "no", "contact.rows": 1})
    assert nearer(one_row, 0.5) is None


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"contact.rows": "all"}, "needs numbers of points"),
        ({"contact.share": "equal"}, "Gauss points have their own shares"),
    ],
)
def test_what_gauss_points_are_not_is_refused(change: dict[str, Any], why: str) -> None:
    with pytest.raises(InputError, match=why):
        load_scene("symmetric-response", SMALL | change)
