"""Supports as a change of unknowns, and rigid-body modes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from upd.errors import InputError
from upd.fem import (
    ELEMENTS,
    Material,
    RigidSet,
    Supports,
    box_mesh,
    rigid_body_modes,
    stiffness,
    traction_weights,
)

STEEL = Material(200e3, 0.3)
BAR = box_mesh([0, 1, 2, 3], [0, 0.6, 1], [0, 1])


def test_fixed_dofs_leave_and_free_dofs_keep_their_order() -> None:
    reduction = Supports(np.array([5, 0, 5])).reduction(BAR.points)
    kept = np.setdiff1d(np.arange(3 * BAR.n_node), [0, 5])
    expected = np.eye(3 * BAR.n_node)[:, kept]
    np.testing.assert_array_equal(reduction.T.toarray(), expected)
    np.testing.assert_array_equal(reduction.place[kept], np.arange(len(kept)))
    assert reduction.place[0] == reduction.place[5] == -1


@pytest.mark.parametrize("components", [(2,), (0, 2), (0, 1, 2)])
def test_translations_of_a_rigid_set(components: tuple[int, ...]) -> None:
    end = BAR.nodes["x1"]
    reduction = Supports(rigid={"end": RigidSet(end, components)}).reduction(BAR.points)
    assert reduction.T.shape[1] == 3 * BAR.n_node - len(components) * (len(end) - 1)
    q = np.zeros(reduction.T.shape[1])
    q[reduction.rigid["end"]] = 1.0 + np.arange(len(components))
    expected = np.zeros((BAR.n_node, 3))
    expected[np.ix_(end, components)] = 1.0 + np.arange(len(components))
    np.testing.assert_array_equal((reduction.T @ q).reshape(-1, 3), expected)


def test_six_dofs_of_a_rigid_set_are_a_rigid_motion_about_its_centroid() -> None:
    end = BAR.nodes["x1"]
    reduction = Supports(rigid={"end": RigidSet(end, rotations=True)}).reduction(BAR.points)
    motion = np.array([0.3, -0.2, 0.5, 0.01, -0.04, 0.02])
    q = np.zeros(reduction.T.shape[1])
    q[reduction.rigid["end"]] = motion
    arms = BAR.points[end] - BAR.points[end].mean(axis=0)
    np.testing.assert_allclose(
        (reduction.T @ q).reshape(-1, 3)[end], motion[:3] + np.cross(motion[3:], arms), atol=1e-16
    )


def test_a_floating_body_with_a_rigid_end_still_has_six_rigid_modes() -> None:
    reduction = Supports(rigid={"end": RigidSet(BAR.nodes["x1"], rotations=True)}).reduction(
        BAR.points
    )
    K = (reduction.T.T @ stiffness(BAR, STEEL) @ reduction.T).toarray()
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() < 1e-10 * values[-1] < 1e-4 * values[6]


def test_rigid_end_pulls_like_a_uniform_displacement() -> None:
    fixed = np.concatenate(
        [3 * BAR.nodes[name] + axis for axis, name in enumerate(("x0", "y0", "z0"))]
    )
    reduction = Supports(fixed, {"end": RigidSet(BAR.nodes["x1"], (0,))}).reduction(BAR.points)
    T = reduction.T
    force = np.zeros(3 * BAR.n_node)
    force[0::3] = traction_weights(BAR.points, BAR.faces["x1"])
    q = spsolve((T.T @ stiffness(BAR, STEEL) @ T).tocsc(), T.T @ force)
    assert q[reduction.rigid["end"]] == pytest.approx(3.0 / STEEL.E, rel=1e-12)


def test_every_fault_is_reported_at_once() -> None:
    end = BAR.nodes["x1"]
    supports = Supports(
        np.array([3 * end[1] + 2, 10_000]),
        {
            "clash": RigidSet(end, (1, 2)),
            "overlap": RigidSet(end[:2], (1,)),
            "empty": RigidSet(np.empty(0, np.int64)),
            "tilt": RigidSet(BAR.nodes["x0"], (0,), rotations=True),
            "twice": RigidSet(np.array([0, 0])),
            "axes": RigidSet(BAR.nodes["x0"], (3,)),
            "far": RigidSet(np.array([999])),
        },
    )
    with pytest.raises(InputError) as caught:
        supports.reduction(BAR.points)
    message = str(caught.value)
    assert (
        f"rigid set 'clash' holds fixed dofs in component z (1 nodes), first node {end[1]}"
        in message
    )
    assert f"'clash' and 'overlap' share component y of node {end[0]}" in message
    for part in (
        "fixed dof 10000",
        "'empty' has no nodes",
        "'tilt' has rotations",
        "'twice' has a duplicated node",
        "'axes'",
        "'far' names node 999",
    ):
        assert part in message


@pytest.mark.parametrize("element", ELEMENTS)
def test_rigid_body_modes_are_orthonormal_and_free_of_energy(element: str) -> None:
    mesh = box_mesh([5, 6, 7.5], [-2, 0], [100, 103], int(element[3:].rstrip("i")))
    modes = rigid_body_modes(mesh.points)
    assert modes.shape == (3 * mesh.n_node, 6)
    np.testing.assert_allclose(modes.T @ modes, np.eye(6), atol=1e-14)
    K = stiffness(mesh, STEEL, element)
    assert np.abs(K @ modes).max() <= 1e-12 * abs(K).max()


@pytest.mark.parametrize(
    "points", [np.zeros((4, 3)), np.outer(np.arange(5.0), [1.0, 2.0, 3.0]), np.eye(3)[:2]]
)
def test_points_on_a_line_have_no_six_modes(points: np.ndarray) -> None:
    with pytest.raises(InputError, match="on one line"):
        rigid_body_modes(points)
