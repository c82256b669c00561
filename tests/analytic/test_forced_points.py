"""Contact points of a forced response.

Shares, shape functions, static forces that hold the damper, all against closed forms.
"""

from dataclasses import replace

import numpy as np
import pytest

from upd.analyses.forced.blade_parts import lattice, lattice_points, line_groups
from upd.analyses.forced.measures import path_maxima
from upd.analyses.forced.statics import StaticState, point_preload
from upd.errors import InputError
from upd.fem import Material, mass_properties
from upd.hbm import contact_rows, rigid_damper
from upd.mesh import Mesh, recipes

SIDES = ("left", "right")


@pytest.fixture(scope="module", params=["symmetric", "asymmetric"])
def meshes(request: pytest.FixtureRequest) -> dict[str, Mesh]:
    return recipes.build_mesh(
        "blade_rig", {"arrangement": request.param, "damper": "free", "element_nodes": 20}
    )[0]


def test_groups_share_every_line_once_and_alike_from_both_ends() -> None:
    for count in (2, 5, 11, 14):
        for n in range(1, count + 1):
            share = line_groups(n, count, "rows")
            assert share.sum(axis=0) == pytest.approx(np.ones(count))
            assert np.array_equal(share, share[::-1, ::-1])
    assert np.array_equal(line_groups([1, 2], 5, "rows"), np.eye(5)[[1, 2]])
    for bad in (6, [5]):
        with pytest.raises(InputError, match="5 lattice lines"):
            line_groups(bad, 5, "rows")


def test_points_know_their_face(meshes: dict[str, Mesh]) -> None:
    for side in SIDES:
        found, patch = lattice(meshes[side]), meshes[side].points[meshes[side].nodes["patch"]]
        A = found.frame
        assert pytest.approx(np.eye(3), abs=1e-12) == A @ A.T
        # into the blade: towards its own side, and up the slope is up
        assert A[0, 0] * (1.0 if side == "right" else -1.0) > 0.0
        assert A[2, 2] > 0.0
        assert np.ptp(patch @ A[0]) < 1e-9
        points = lattice_points(meshes[side], "all", "all", side)
        assert points.at_nodes
        assert points.weight.sum() == pytest.approx(1.0)
        assert points.weight @ points.position == pytest.approx(
            found.area @ meshes[side].points[found.nodes] / found.area.sum()
        )


def test_groups_keep_the_centre_and_a_linear_motion(meshes: dict[str, Mesh]) -> None:
    gradient = np.array([[1.0, -2.0, 0.5], [0.3, 0.1, 1.0], [2.0, 0.7, -0.4]])
    for equal in (False, True):
        whole = lattice_points(meshes["right"], "all", "all", "right", equal)
        grouped = lattice_points(meshes["right"], "all", 2, "right", equal)
        assert grouped.n_point == 2 * len(np.unique(whole.line[:, 0]))
        assert grouped.weight @ grouped.position == pytest.approx(whole.weight @ whole.position)
        u = meshes["right"].points[grouped.nodes] @ gradient
        assert grouped.values @ u == pytest.approx(grouped.position @ gradient)


def test_seated_forces_hold_the_damper_without_friction(meshes: dict[str, Mesh]) -> None:
    mass = mass_properties(meshes["damper"], Material(2e5, 0.3, 7.8e-9))
    damper = rigid_damper(
        mass.mass, 0.5 * (mass.inertia + mass.inertia.T), mass.centre, [0.0, 0.0, 350.0]
    )
    faces = [lattice_points(meshes[side], "all", 2, side) for side in SIDES]
    position = np.vstack([f.position for f in faces])
    frames = np.concatenate([np.tile(f.frame, (f.n_point, 1, 1)) for f in faces])
    rows = contact_rows(damper, position, frames)
    normals, slopes = rows[:, 0], rows[:, 2]
    face = np.repeat([0, 1], [f.n_point for f in faces])
    smooth = StaticState("frictionless", np.ones(2), np.zeros(2))
    weight = np.concatenate([f.weight for f in faces])
    N, T = point_preload(normals, slopes, face, weight, smooth, damper.force)
    assert (N > 0.0).all() and not T.any()
    assert pytest.approx(damper.force, abs=1e-6) == normals.T @ N
    # two faces, inclined by their normals' angles: F_C / (n_z (1 - n_x/n_x' ...)) in closed form
    (xl, _, zl), (xr, _, zr) = faces[0].frame[0], faces[1].frame[0]
    left, right = N[: faces[0].n_point].sum(), N[faces[0].n_point :].sum()
    assert (left, right) == pytest.approx(np.linalg.solve([[xl, xr], [zl, zr]], [0.0, 350.0]))
    along = np.array([0.0, 350.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(InputError, match=r"contact\.static.*choose other rows"):
        point_preload(normals, slopes, face, np.ones(len(N)), smooth, along)


def test_weight_of_one_node_faces_stays_whole(meshes: dict[str, Mesh]) -> None:
    one = lattice_points(meshes["left"], [0], 1, "left")
    assert one.n_point == 1
    assert one.weight.tolist() == [1.0]
    assert not replace(one, values=one.values).at_nodes


def test_peaks_of_a_path_whatever_its_direction() -> None:
    f = np.linspace(280.0, 320.0, 81)

    def one_mode(at: float) -> np.ndarray:
        return 1.0 / np.hypot(1.0 - (f / at) ** 2, 2 * 0.005 * f / at)

    H = one_mode(295.13)
    for path, height in (
        (f, H),
        (f[::-1], H[::-1]),
        (np.append(f, f[::-1]), np.append(H, H[::-1])),
    ):
        *_, peak = path_maxima(path, height)
        assert peak.frequency == pytest.approx(295.13, rel=1e-4)
        assert peak.height == pytest.approx(100.0, rel=1e-3)
        assert path[peak.sample] == pytest.approx(295.0)
    two = path_maxima(f, np.maximum(one_mode(290.0), 2.0 * one_mode(310.0)))
    assert [round(p.frequency) for p in two] == [290, 310]
    # where the path stands still or turns round, its own highest point
    still = path_maxima(np.array([300.0, 301.0, 301.0, 302.0]), np.array([1.0, 2.0, 1.5, 1.0]))
    turned = path_maxima(np.array([300.0, 301.0, 300.5]), np.array([1.0, 2.0, 1.0]))
    assert [p[:2] for p in (*still, *turned)] == [(301.0, 2.0), (301.0, 2.0)]
    assert path_maxima(np.zeros(0), np.zeros(0)) == []


def test_points_of_a_half_are_those_of_the_whole_face(meshes: dict[str, Mesh]) -> None:
    # a field that is its own mirror image about y = 0: only the part along y changes its sign
    def moved(points: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        return np.stack([x * np.cos(y), np.sin(y), z + y**2], axis=1)

    arrangement = "symmetric" if lattice(meshes["left"]).n_column == 11 else "asymmetric"
    of = {"arrangement": arrangement, "damper": "free", "element_nodes": 20, "symmetry": "half"}
    for side in SIDES:
        n, half = lattice(meshes[side]).n_column, recipes.build_mesh("blade_rig", of)[0][side]
        for columns in ("all", 1, 2, 3, 4, [0, 1, n - 2, n - 1]):
            for equal in (False, True):
                both = [lattice_points(m, 2, columns, side, equal) for m in (meshes[side], half)]
                whole, found = both
                groups = whole.line[:, 1].max() + 1
                kept = whole.line[:, 1] >= groups // 2
                own = 2 * whole.line[:, 1] == groups - 1
                weight = (whole.weight * np.where(own, 1.0, 2.0))[kept]
                assert found.weight == pytest.approx(weight)
                assert found.position == pytest.approx(whole.position[kept], abs=1e-9)
                u = [
                    f.values @ moved(m.points[f.nodes])
                    for f, m in zip(both, (meshes[side], half), strict=True)
                ]
                # of a mean across the plane the parts along y cancel: the model drops them
                u[1][own[kept], 1] = 0.0
                assert u[1] == pytest.approx(u[0][kept], abs=1e-9)


def test_columns_of_a_half_are_their_own_mirror_image() -> None:
    half = recipes.build_mesh("blade_rig", {"damper": "free", "symmetry": "half"})[0]
    with pytest.raises(InputError, match=r'own mirror image.*mesh\.symmetry = "full"'):
        lattice_points(half["left"], "all", [0, 1], "left")
