"""Contact points from nodal fields.

Totals kept, cells by hand, symmetry, what few points lose, and the way through result.nc.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.contact.law import ContactLaw, Weight, contact_points
from upd.errors import InputError
from upd.results import Group, read_netcdf, write_netcdf

FloatArray = NDArray[np.float64]

EPS = float(np.finfo(float).eps)


def grid(
    nx: int, ny: int, width: float = 12.0, height: float = 4.0
) -> tuple[FloatArray, FloatArray]:
    """Places (n, 2) and tributary areas of a lattice of nodes with half cells at the rim.

    x runs fastest.
    """
    x, y = np.linspace(0, width, nx), np.linspace(0, height, ny)
    share = [np.r_[0.5, np.ones(k - 2), 0.5] / (k - 1) for k in (nx, ny)]
    return np.column_stack([np.tile(x, ny), np.repeat(y, nx)]), width * height * np.outer(
        share[1], share[0]
    ).ravel()


def random_fields(n: int, seed: int = 0) -> tuple[FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    return rng.random(n), 1e3 * rng.random(n), 1e3 * rng.random((n, 2))


def close(a: FloatArray | float, b: FloatArray | float) -> bool:
    return bool(np.allclose(a, b, rtol=1e3 * EPS, atol=0))


@pytest.mark.parametrize("weight", ["stiffness", "area"])
@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (2, 3), (4, 5), (7, 11), (30, 30)])
def test_totals_are_kept(weight: Weight, rows: int, columns: int) -> None:
    X, area = grid(13, 9)
    force, k_n, k_t = random_fields(117)
    law = contact_points(X, area, force, k_n, k_t, (rows, columns), weight)
    assert close(law.preload.sum(), force.sum())
    assert close(law.area.sum(), area.sum())
    assert close(law.k_n.sum(), k_n.sum())
    assert close(law.k_t.sum(axis=0), k_t.sum(axis=0))
    # So are the first moments of what weights the positions.
    own, nodal = (law.k_n, k_n) if weight == "stiffness" else (law.area, area)
    assert close(own @ law.position[:, :2], nodal @ X)
    assert not law.position[:, 2].any()


def test_one_point_is_the_whole_patch() -> None:
    X, area = grid(5, 4)
    force, k_n, k_t = random_fields(20)
    law = contact_points(np.column_stack([X, np.full(20, 7.0)]), area, force, k_n, k_t, (1, 1))
    assert (
        law.n_point == 1
        and close(law.position[0, :2], k_n @ X / k_n.sum())
        and close(law.position[0, 2], 7.0)
    )


def test_a_node_on_a_border_is_shared_by_hand() -> None:
    """3 by 3 nodes in 2 by 2 cells.

    The middle node gives a quarter to each, edge nodes a half to two, corners all to one.
    """
    X, area = grid(3, 3, 2.0, 2.0)
    k_n = np.arange(1.0, 10.0)
    law = contact_points(X, area, k_n, k_n, np.column_stack([2 * k_n, 3 * k_n]), (2, 2))
    expected = np.array(
        [
            1 + 2 / 2 + 4 / 2 + 5 / 4,
            3 + 2 / 2 + 6 / 2 + 5 / 4,
            7 + 4 / 2 + 8 / 2 + 5 / 4,
            9 + 8 / 2 + 6 / 2 + 5 / 4,
        ]
    )
    assert close(law.k_n, expected) and close(law.preload, expected)
    assert close(law.k_t, np.outer(expected, [2.0, 3.0]))
    assert close(law.area, np.ones(4))
    assert close(law.position[0, 0], (2 / 2 + 5 / 4) / expected[0])


def test_area_weight_by_hand() -> None:
    """Every point has the stiffness of its share of the area of its own patch, at the centroid of
    that area; preload stays where it is.
    """
    X, area = grid(3, 3, 2.0, 2.0)
    X, area = np.vstack([X, X + np.array([10.0, 0.0])]), np.tile(area, 2)
    k_n = np.r_[np.arange(1.0, 10.0), np.arange(11.0, 20.0)]
    force = np.r_[np.zeros(9), np.ones(9)]
    law = contact_points(
        X,
        area,
        force,
        k_n,
        np.column_stack([k_n, k_n]),
        (2, 2),
        "area",
        [np.arange(9), np.arange(9, 18)],
    )
    assert close(law.k_n, np.r_[np.full(4, 45 / 4), np.full(4, 135 / 4)])
    assert close(law.position[:4, :2], np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5], [1.5, 1.5]]))
    assert close(law.preload, np.r_[np.zeros(4), np.full(4, 9 / 4)])


@pytest.mark.parametrize("weight", ["stiffness", "area"])
@pytest.mark.parametrize(("rows", "columns"), [(2, 4), (3, 3), (5, 2)])
def test_a_symmetric_patch_gives_symmetric_points(weight: Weight, rows: int, columns: int) -> None:
    """Two mirrored pads with cells that do and do not fit the nodes.

    Points and values mirror to rounding.
    """
    X, area = grid(10, 7)
    X = X - [30.0, 2.0]
    force, k_n, k_t = random_fields(70, 4)
    both = np.vstack([X, X * [-1.0, 1.0]])
    law = contact_points(
        both,
        *(np.tile(v, 2) for v in (area, force, k_n)),
        np.tile(k_t, (2, 1)),
        (rows, columns),
        weight,
        [np.arange(70), np.arange(70, 140)],
    )
    m = rows * columns
    # The columns of the second pad run the other way.
    mirror = np.arange(m).reshape(rows, columns)[:, ::-1].ravel() + m
    assert np.allclose(
        law.position[:m], law.position[mirror] * [-1.0, 1.0, 1.0], rtol=0, atol=1e-13 * 42
    )
    for values in (law.k_n, law.preload, law.area):
        assert close(values[:m], values[mirror])


def test_empty_cells_make_no_point_and_open_cells_stay() -> None:
    """More cells than nodes: one point per node.

    A cell with area but no stiffness keeps its area, at its centroid.
    """
    X, area = grid(4, 3)
    k_n = np.ones(12)
    k_n[0] = 0.0
    law = contact_points(X, area, k_n, k_n, np.column_stack([k_n, k_n]), (29, 31))
    assert law.n_point == 12 and close(law.k_n, k_n) and close(law.area, area)
    assert close(law.position[:, :2], X)
    bare = contact_points(X, np.r_[0.0, area[1:]], k_n, k_n, np.column_stack([k_n, k_n]), (29, 31))
    assert bare.n_point == 11


def test_one_line_of_nodes() -> None:
    X = np.column_stack([np.arange(5.0), np.full(5, 3.0)])
    law = contact_points(X, np.ones(5), np.ones(5), np.ones(5), np.ones((5, 2)), (2, 5))
    assert close(law.k_n, np.full(10, 0.5)) and close(law.position[:, 1], np.full(10, 3.0))


def second_moments(x: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(2,) of the weight about its centroid along the columns of x (n, 2): tilt stiffnesses."""
    return np.asarray(weight @ (x - weight @ x / weight.sum()) ** 2)


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 6])
@pytest.mark.parametrize("columns", [1, 2, 4, 8])
def test_tilt_stiffness_lost_by_few_points(rows: int, columns: int) -> None:
    """Uniform field: equal cells lose their own second moment, 1 / r^2 of the whole (lattice of
    cell centres, so that it is exact).
    """
    n, width = 48, 12.0
    c = (np.arange(n) + 0.5) / n * width
    # Corner nodes without stiffness make the bounding box that of the cells.
    X = np.vstack([np.column_stack([np.tile(c, n), np.repeat(c, n)]), [[0.0, 0.0], [width, width]]])
    k = np.r_[np.ones(n * n), 0.0, 0.0]
    law = contact_points(X, k, k, k, np.column_stack([k, k]), (rows, columns))
    # Within a cell the lattice of m lines has (1 - 1/m^2) of the moment of the continuum.
    lost = [(1 / r**2 - 1 / n**2) / (1 - 1 / n**2) for r in (columns, rows)]
    own = second_moments(law.position[:, :2], law.k_n)
    assert np.allclose(own / second_moments(X, k) - 1.0, -np.array(lost), rtol=1e-12, atol=1e-13)


def test_as_many_points_as_nodes_lose_nothing() -> None:
    X, area = grid(6, 5)
    force, k_n, k_t = random_fields(30, 2)
    law = contact_points(X, area, force, k_n, k_t, (40, 40))
    own = second_moments(law.position[:, :2], law.k_n)
    assert np.abs(own / second_moments(X, k_n) - 1.0).max() <= 1e3 * EPS


def test_placed_in_other_axes_and_back() -> None:
    X, area = grid(9, 7)
    law = contact_points(X, area, *random_fields(63), (2, 3))
    s = np.sqrt(0.5)
    axes = np.array([[0.0, 1.0, 0.0], [-s, 0.0, s], [s, 0.0, s]])
    origin = np.array([10.0, -4.0, 2.5])
    there = law.placed(origin, axes)
    assert np.allclose(there.normal, axes[2]) and np.allclose(there.tangents, axes[:2])
    # The way back is that of the transpose.
    assert np.allclose((there.position - origin) @ axes.T, law.position, atol=1e-14)
    back = there.placed(-axes @ origin, axes.T)
    assert np.allclose(back.position, law.position, atol=1e-13) and np.allclose(
        back.tangents, law.tangents, atol=1e-15
    )
    with pytest.raises(InputError, match="left-handed"):
        law.placed(origin, axes[[1, 0, 2]])
    with pytest.raises(InputError, match=r"origin has shape \(2,\).*not orthonormal"):
        law.placed([0.0, 0.0], 2 * axes)


def test_through_result_nc(tmp_path: Path) -> None:
    X, area = grid(9, 7)
    law = contact_points(X, area, *random_fields(63), (2, 3)).placed([1.0, 2.0, 3.0], np.eye(3))
    lattice = {"x": (("x",), np.arange(3.0), {"units": "mm"})}
    write_netcdf(tmp_path / "result.nc", {"F_N 150 N": Group(lattice | law.to_arrays())})
    read = ContactLaw.from_arrays(read_netcdf(tmp_path / "result.nc")["F_N 150 N"])
    for name in law.__dataclass_fields__:
        assert np.array_equal(getattr(read, name), getattr(law, name)), name
    assert all(value[2]["units"] for value in law.to_arrays().values())
    same = ContactLaw.from_arrays(law.to_arrays())
    assert np.array_equal(same.k_t, law.k_t)


def test_arrays_that_are_no_law() -> None:
    X, area = grid(3, 3)
    arrays: dict[str, Any] = contact_points(X, area, *random_fields(9), (2, 2)).to_arrays()
    del arrays["law_k_n"]
    arrays["law_preload"] = np.ones(3)
    with pytest.raises(InputError, match=r"law_k_n is missing.*law_preload has shape \(3,\)"):
        ContactLaw.from_arrays(arrays)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"grid": (0, 2)}, "rows is 0"),
        ({"grid": (2, 1.5)}, "columns is 1.5"),
        ({"weight": "pressure"}, "weight is 'pressure'"),
        ({"positions": np.zeros(9)}, r"positions has shape \(9,\)"),
        ({"areas": np.ones(8)}, r"areas has shape \(8,\)"),
        ({"areas": -np.ones(9)}, "areas is negative at 9 places"),
        ({"tangential_stiffness": np.ones(9)}, r"tangential_stiffness has shape \(9,\)"),
        ({"normal_force": np.full(9, np.inf)}, "normal_force holds 9 values"),
        ({"patches": [np.arange(5), np.arange(4, 9)]}, "name 1 nodes more than once"),
        ({"patches": [np.arange(5)]}, "leave out 4 of 9 nodes"),
        ({"patches": [np.arange(9), np.zeros(0, int)]}, "none of them empty"),
        ({"areas": np.zeros(9), "weight": "area"}, "no area to share"),
        (
            {name: np.zeros(9) for name in ("areas", "normal_force", "normal_stiffness")}
            | {"tangential_stiffness": np.zeros((9, 2))},
            "all fields",
        ),
    ],
)
def test_input_faults(change: dict[str, Any], message: str) -> None:
    X, area = grid(3, 3)
    force, k_n, k_t = random_fields(9)
    arguments: dict[str, Any] = {
        "positions": X,
        "areas": area,
        "normal_force": force,
        "normal_stiffness": k_n,
        "tangential_stiffness": k_t,
        "grid": (2, 2),
    }
    with pytest.raises(InputError, match=message):
        contact_points(**(arguments | change))
