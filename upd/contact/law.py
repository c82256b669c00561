"""From nodal contact fields to the few contact points of a dynamic model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.contact.checks import EPS, Problems, numbers
from upd.errors import InputError
from upd.labels import Shown

FloatArray = NDArray[np.float64]
Weight = Literal["stiffness", "area"]

#: name -> (dimensions, units) of the arrays in result.nc; read back without them
_FORMAT: dict[str, tuple[tuple[str, ...], str]] = {
    "position": (("contact_point", "component"), "mm"),
    "normal": (("contact_point", "component"), "1"),
    "tangents": (("contact_point", "tangent", "component"), "1"),
    "k_n": (("contact_point",), "N/mm"),
    "k_t": (("contact_point", "tangent"), "N/mm"),
    "preload": (("contact_point",), "N"),
    "area": (("contact_point",), "mm2"),
}
_PREFIX = "law_"


@dataclass(frozen=True, repr=False)
class ContactLaw(Shown):
    """Contact points of a dynamic model, m of them.

    Attributes
    ----------
    position : (m, 3) ndarray
        Places [mm].
    normal : (m, 3) ndarray
        Unit normals, out of the lower body.
    tangents : (m, 2, 3) ndarray
        Two unit tangents per point.
    k_n : (m,) ndarray
        Normal stiffnesses [N/mm].
    k_t : (m, 2) ndarray
        Stiffnesses along both tangents [N/mm].
    preload : (m,) ndarray
        Normal forces [N].
    area : (m,) ndarray
        Areas [mm2].

    Examples
    --------
    Two equal points 2 mm apart, carried over to a face that lies in the plane x = 10 mm:

    >>> import numpy as np
    >>> from upd.contact import contact_points
    >>> law = contact_points(
    ...     positions=[[-1.0, 0.0], [1.0, 0.0]], areas=[1.0, 1.0], normal_force=[5.0, 5.0],
    ...     normal_stiffness=[100.0, 100.0], tangential_stiffness=np.full((2, 2), 80.0),
    ...     grid=(1, 2),
    ... )
    >>> law.n_point
    2
    >>> placed = law.placed(origin=[10.0, 0.0, 0.0], axes=[[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    >>> placed.position.tolist()
    [[10.0, -1.0, 0.0], [10.0, 1.0, 0.0]]
    >>> placed.normal[0].tolist()
    [1.0, 0.0, 0.0]
    """

    position: FloatArray
    normal: FloatArray
    tangents: FloatArray
    k_n: FloatArray
    k_t: FloatArray
    preload: FloatArray
    area: FloatArray

    @property
    def n_point(self) -> int:
        """Number of contact points, m."""
        return len(self.k_n)

    def placed(self, origin: ArrayLike, axes: ArrayLike) -> ContactLaw:
        """The same points in other axes.

        Parameters
        ----------
        origin : (3,) array_like
            Origin of the contact axes, seen from the other axes [mm].
        axes : (3, 3) array_like
            Unit vectors of the contact axes as rows, seen from the other axes.

        Returns
        -------
        ContactLaw

        Raises
        ------
        InputError
            When the axes are not orthonormal and right-handed, or the shapes differ.
        """
        problems = Problems("contact points placed")
        o, A = numbers(problems, "origin", origin, (3,)), numbers(problems, "axes", axes, (3, 3))
        if A is not None:
            skew = float(np.abs(A @ A.T - np.eye(3)).max())
            problems.add(
                skew > np.sqrt(EPS),
                f"axes are not orthonormal (A A' differs from I by {skew:.1e}): give unit "
                "vectors at right angles.",
            )
            problems.add(
                bool(np.linalg.det(A) < 0), "axes are left-handed: swap two of them or reverse one."
            )
        problems.raise_any()
        assert o is not None and A is not None
        position, normal, tangents = o + self.position @ A, self.normal @ A, self.tangents @ A
        return replace(self, position=position, normal=normal, tangents=tangents)

    def to_arrays(self) -> dict[str, tuple[tuple[str, ...], FloatArray, dict[str, str]]]:
        """The points as arrays for result.nc.

        Returns
        -------
        dict
            Name -> (dimensions, array, attributes); the attributes hold the units.
        """
        return {
            _PREFIX + name: (dims, getattr(self, name), {"units": units})
            for name, (dims, units) in _FORMAT.items()
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> ContactLaw:
        """The points from arrays.

        Parameters
        ----------
        arrays : mapping
            What `to_arrays` returned, or a group of result.nc read back (name -> array).

        Returns
        -------
        ContactLaw

        Raises
        ------
        InputError
            For arrays that are missing, of another shape or not finite; all of them are named.
        """
        problems = Problems("contact points from arrays")
        found: dict[str, FloatArray] = {}
        sizes: dict[str, int | str] = {"tangent": 2, "component": 3}
        for name, (dims, _) in _FORMAT.items():
            given = arrays.get(_PREFIX + name)
            if given is None:
                problems.add(
                    True,
                    f"{_PREFIX}{name} is missing: give the group of result.nc that contact "
                    "points were written to.",
                )
                continue
            wanted = tuple(sizes.get(dim, dim) for dim in dims)
            given = given[1] if isinstance(given, tuple) else given
            array = numbers(problems, _PREFIX + name, given, wanted)
            if array is not None:
                sizes.update(zip(dims, array.shape, strict=True))
                found[name] = array
        problems.raise_any()
        return cls(**found)


def contact_points(
    positions: ArrayLike,
    areas: ArrayLike,
    normal_force: ArrayLike,
    normal_stiffness: ArrayLike,
    tangential_stiffness: ArrayLike,
    grid: tuple[int, int],
    weight: Weight = "stiffness",
    patches: Sequence[ArrayLike] | None = None,
) -> ContactLaw:
    """Contact points of a dynamic model from nodal fields of a contact solution.

    Each patch is cut into rows (along y) by columns (along x) of equal cells of its bounding box;
    a node on a border of cells is shared equally between them. Sums over the points are the sums of
    the fields. Cells in which everything is zero make no point.

    Parameters
    ----------
    positions : (n, 2) or (n, 3) array_like
        Nodes in contact axes [mm], z along the normal.
    areas : (n,) array_like
        Tributary areas [mm2].
    normal_force : (n,) array_like
        Normal forces [N].
    normal_stiffness : (n,) array_like
        Normal stiffnesses [N/mm].
    tangential_stiffness : (n, 2) array_like
        Stiffnesses along x and y [N/mm].
    grid : (rows, columns)
        Number of cells along y and along x.
    weight : {"stiffness", "area"}
        The preload and the area of a point are the sums over its cell. With "stiffness" so are the
        stiffnesses, and the point is the centroid of the normal stiffness (of the area where there
        is none). With "area" the point is the centroid of the area, and has that share of its
        patch's stiffness.
    patches : sequence of array_like of int, optional
        Node numbers of each patch, every node named once; None makes one patch of all nodes.

    Returns
    -------
    ContactLaw

    Raises
    ------
    InputError
        For bad shapes, negative fields, patches that do not name every node once, or fields that
        are all zero; all problems are named.

    Examples
    --------
    Four nodes of a strip, condensed to two points:

    >>> import numpy as np
    >>> from upd.contact import contact_points
    >>> law = contact_points(
    ...     positions=[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]],
    ...     areas=np.ones(4),
    ...     normal_force=[1.0, 2.0, 2.0, 1.0],
    ...     normal_stiffness=np.full(4, 100.0),
    ...     tangential_stiffness=np.full((4, 2), 80.0),
    ...     grid=(1, 2),
    ... )
    >>> law.position.tolist()
    [[0.5, 0.0, 0.0], [2.5, 0.0, 0.0]]
    >>> law.preload.tolist(), law.k_n.tolist()
    ([3.0, 3.0], [200.0, 200.0])
    """
    problems = Problems("contact points")
    X = numbers(problems, "positions", positions, ("n", 2), ("n", 3))
    n = "n" if X is None else len(X)
    K = _not_negative(problems, "tangential_stiffness", tangential_stiffness, (n, 2))
    named = {"areas": areas, "normal_force": normal_force, "normal_stiffness": normal_stiffness}
    given = [_not_negative(problems, name, values, (n,)) for name, values in named.items()]
    for name, count in zip(("rows", "columns"), grid, strict=True):
        whole = isinstance(count, (int, np.integer)) and not isinstance(count, bool)
        problems.add(not whole or count < 1, f"{name} is {count!r}: give a whole number >= 1.")
    problems.add(
        weight not in get_args(Weight), f'weight is {weight!r}: take "stiffness" or "area".'
    )
    groups = [] if X is None else _check_patches(problems, len(X), patches)
    problems.raise_any()
    assert X is not None and K is not None
    place = np.column_stack([X, np.zeros(len(X))]) if X.shape[1] == 2 else X
    fields = (place, *(np.asarray(one) for one in given), K)
    cells = [_cells([f[group] for f in fields], *grid, weight) for group in groups]
    law = {name: np.concatenate([cell[name] for cell in cells]) for name in cells[0]}
    m = len(law["k_n"])
    if m == 0:
        raise InputError(
            "contact points: all fields are zero, there is nothing to make a point of. "
            "Give the fields of a loaded contact."
        )
    normal, tangents = np.tile([0.0, 0.0, 1.0], (m, 1)), np.tile(np.eye(3)[:2], (m, 1, 1))
    return ContactLaw(
        normal=normal,
        tangents=tangents,
        **law,
    )


def _not_negative(
    problems: Problems, name: str, values: ArrayLike, shape: tuple[int | str, ...]
) -> FloatArray | None:
    array = numbers(problems, name, values, shape)
    negative = 0 if array is None else int(np.count_nonzero(array < 0))
    problems.add(
        negative > 0,
        f"{name} is negative at {negative} places: forces press, areas and stiffnesses are >= 0.",
    )
    return array


def _check_patches(
    problems: Problems, n: int, patches: Sequence[ArrayLike] | None
) -> list[NDArray[np.int64]]:
    """Index arrays of the patches; a problem unless they name every node once."""
    if patches is None:
        return [np.arange(n)]
    groups = [np.asarray(patch).ravel() for patch in patches]
    if problems.add(
        not groups
        or any(
            g.size == 0 or g.dtype.kind not in "iu" or g.min() < 0 or g.max() >= n for g in groups
        ),
        f"patches must be arrays of node numbers from 0 to {n - 1}, none of them empty.",
    ):
        return []
    count = np.bincount(np.concatenate(groups), minlength=n)
    problems.add(
        bool((count > 1).any()),
        f"patches name {int((count > 1).sum())} nodes more than once: give each node to one patch.",
    )
    problems.add(
        bool((count < 1).any()),
        f"patches leave out {int((count < 1).sum())} of {n} nodes, whose forces would be "
        "lost: name every node.",
    )
    return [g.astype(np.int64) for g in groups]


def _cells(
    nodal: Sequence[FloatArray], rows: int, columns: int, weight: Weight
) -> dict[str, FloatArray]:
    """Fields of the contact points of one patch, row by row, from those of its nodes: places
    (n, 3), areas, normal forces, stiffnesses (n,) and (n, 2).
    """
    x, area, _, k_n, k_t = nodal
    across, along = _shares(x[:, 1], rows), _shares(x[:, 0], columns)
    share = (across[:, None, :] * along[None, :, :]).reshape(rows * columns, -1)
    position = _centroids(share, x, [k_n, area] if weight == "stiffness" else [area])
    names = ("area", "preload", "k_n", "k_t")
    found = {name: share @ field for name, field in zip(names, nodal[1:], strict=True)}
    kept = (np.column_stack(list(found.values())) > 0).any(axis=1)
    if weight == "area":
        if not area.sum() > 0:
            raise InputError(
                f"contact points: a patch of {len(x)} nodes has no area to share "
                'its stiffness by: use weight="stiffness".'
            )
        part = found["area"] / area.sum()
        found |= {"k_n": part * k_n.sum(), "k_t": np.outer(part, k_t.sum(axis=0))}
    return {name: values[kept] for name, values in {"position": position, **found}.items()}


def _shares(x: FloatArray, count: int) -> FloatArray:
    """(count, n) share of each node in each of `count` equal intervals.

    Half and half on a border between two of them.
    """
    width = float(np.ptp(x))
    share = np.zeros((count, len(x)))
    # A line of nodes: all in the middle, shared between two when the middle is a border.
    s = (x - x.min()) / width * count if width > 0 else np.full(len(x), count / 2)
    border = np.rint(s)
    # Half of the digits: coordinates of a mesh that was turned carry rounding.
    on = (np.abs(s - border) <= count * np.sqrt(EPS)) & (border > 0) & (border < count)
    cell = np.clip(np.floor(s), 0, count - 1).astype(np.int64)
    node = np.arange(len(x))
    share[cell[~on], node[~on]] = 1.0
    for side in (-1, 0):
        share[(border[on] + side).astype(np.int64), node[on]] = 0.5
    return share


def _centroids(share: FloatArray, x: FloatArray, weights: Sequence[FloatArray]) -> FloatArray:
    """(m, 3) centroid of each cell by the first weight that is not zero in it.

    By the nodes alone if all are zero.
    """
    position = np.zeros((len(share), x.shape[1]))
    todo = np.ones(len(share), dtype=bool)
    for weight in (*weights, np.ones(len(x))):
        part = share * weight
        total = part.sum(axis=1)
        now = todo & (total > 0)
        position[now] = (part[now] / total[now, None]) @ x
        todo &= ~now
    return position
