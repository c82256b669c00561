"""From nodal contact fields to the few contact points of a dynamic model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.contact.checks import EPS, Faults, numbers
from upd.errors import InputError

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
    "source_tilt": (("tangent",), "N mm"),
}
_PREFIX = "law_"


@dataclass(frozen=True)
class ContactLaw:
    """Contact points of a dynamic model.

    position (m, 3) mm; normal (m, 3) unit, out of the lower body; tangents (m, 2, 3) unit; k_n (m,), k_t (m, 2) N/mm; preload (m,) N;
    area (m,) mm2; source_tilt (2,) N mm: tilt stiffness of the nodal field the points came from, see `tilt_stiffness`.
    """

    position: FloatArray
    normal: FloatArray
    tangents: FloatArray
    k_n: FloatArray
    k_t: FloatArray
    preload: FloatArray
    area: FloatArray
    source_tilt: FloatArray

    @property
    def n_point(self) -> int:
        """m."""
        return len(self.k_n)

    def tilt_stiffness(self) -> FloatArray:
        """(2,) N mm per rad: sum k_n x_i^2 of the distances x along each tangent from the centre of k_n.

        Points of one plane with common tangents; 0 without normal stiffness.
        """
        along = np.einsum("mj,ij->mi", self.position, self.tangents[0])
        return _second_moments(along, self.k_n)

    def tilt_error(self) -> FloatArray:
        """(2,) tilt stiffness of the points relative to that of the nodal field, minus one; <= 0 with weight "stiffness".

        One row or column has no tilt stiffness of its own (-1), r equal cells on a uniform field lose 1 / r^2. 0 where the field has none.
        """
        own = self.tilt_stiffness()
        return np.where(self.source_tilt > 0.0, own / np.where(self.source_tilt > 0.0, self.source_tilt, 1.0) - 1.0, 0.0)

    def placed(self, origin: ArrayLike, axes: ArrayLike) -> ContactLaw:
        """The same points in other axes: origin (3,) mm of the contact axes and axes (3, 3), their unit vectors as rows, seen from there.

        InputError when the axes are not orthonormal and right-handed.
        """
        faults = Faults("contact law placed")
        o, A = numbers(faults, "origin", origin), numbers(faults, "axes", axes)
        faults.add(o is not None and o.shape != (3,), f"origin has shape {None if o is None else o.shape}: it must be (3,).")
        if A is not None and not faults.add(A.shape != (3, 3), f"axes has shape {A.shape}: it must be (3, 3), one unit vector per row."):
            skew = float(np.abs(A @ A.T - np.eye(3)).max())
            faults.add(
                skew > np.sqrt(EPS), f"axes are not orthonormal (A A' differs from I by {skew:.1e}): give unit vectors at right angles."
            )
            faults.add(bool(np.linalg.det(A) < 0), "axes are left-handed: swap two of them or turn one round.")
        faults.raise_any()
        assert o is not None and A is not None
        kept = {"k_n": self.k_n, "k_t": self.k_t, "preload": self.preload, "area": self.area, "source_tilt": self.source_tilt}
        return ContactLaw(position=o + self.position @ A, normal=self.normal @ A, tangents=self.tangents @ A, **kept)

    def to_arrays(self) -> dict[str, tuple[tuple[str, ...], FloatArray, dict[str, str]]]:
        """Name -> (dimensions, array, attributes), for result.nc."""
        return {_PREFIX + name: (dims, getattr(self, name), {"units": units}) for name, (dims, units) in _FORMAT.items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> ContactLaw:
        """The law from `to_arrays`, or from a group of result.nc read back (name -> array). InputError names every fault."""
        faults = Faults("contact law from arrays")
        found: dict[str, FloatArray] = {}
        sizes = {"tangent": 2, "component": 3}
        for name, (dims, _) in _FORMAT.items():
            given = arrays.get(_PREFIX + name)
            if given is None:
                faults.add(True, f"{_PREFIX}{name} is missing: give the group of result.nc that a contact law was written to.")
                continue
            array = numbers(faults, _PREFIX + name, given[1] if isinstance(given, tuple) else given)
            if array is None:
                continue
            if array.ndim and "contact_point" in dims:
                sizes.setdefault("contact_point", array.shape[0])
            wanted = tuple(sizes.get(dim, 0) for dim in dims)
            faults.add(
                array.shape != wanted, f"{_PREFIX}{name} has shape {array.shape}: it must be {wanted}, dimensions {', '.join(dims)}."
            )
            found[name] = array
        faults.raise_any()
        return cls(**found)


def contact_points(
    positions: ArrayLike,
    areas: ArrayLike,
    normal_force: ArrayLike,
    normal_stiffness: ArrayLike,
    tangential_stiffness: ArrayLike,
    rows: int,
    columns: int,
    weight: Weight = "stiffness",
    patches: Sequence[ArrayLike] | None = None,
) -> ContactLaw:
    """Contact points from nodal fields: each patch is cut into rows (along y) by columns (along x) equal cells of its bounding box.

    positions (n, 2 or 3) mm in contact axes, z along the normal; areas (n,) mm2; normal_force (n,) N; normal_stiffness (n,) and
    tangential_stiffness (n, 2) N/mm; patches, index arrays that name every node once (None: one patch).
    A node on a border of cells is shared equally between them. The preload and the area of a point are the sums over its cell.
    weight "stiffness": so are the stiffnesses, and the point is the centroid of the normal stiffness (of the area where there is none).
    weight "area": the point is the centroid of the area, and has that share of its patch's stiffness.
    Sums over the points are the sums of the fields. Cells in which everything is zero make no point. InputError names every fault.
    """
    faults = Faults("contact points")
    X, K = numbers(faults, "positions", positions), numbers(faults, "tangential_stiffness", tangential_stiffness)
    named = {"areas": areas, "normal_force": normal_force, "normal_stiffness": normal_stiffness}
    given = {name: numbers(faults, name, values) for name, values in named.items()}
    for name, count in (("rows", rows), ("columns", columns)):
        whole = isinstance(count, (int, np.integer)) and not isinstance(count, bool)
        faults.add(not whole or count < 1, f"{name} is {count!r}: give a whole number >= 1.")
    faults.add(weight not in get_args(Weight), f'weight is {weight!r}: take "stiffness" or "area".')
    groups: list[NDArray[np.int64]] = []
    if X is not None and not faults.add(
        X.ndim != 2 or X.shape[-1] not in (2, 3) or len(X) == 0, f"positions has shape {X.shape}: it must be (n, 2) or (n, 3), n >= 1."
    ):
        given["tangential_stiffness"] = K
        _check_fields(faults, len(X), given)
        groups = _check_patches(faults, len(X), patches)
    faults.raise_any()
    assert X is not None and K is not None
    place = np.column_stack([X, np.zeros(len(X))]) if X.shape[1] == 2 else X
    area, force, k_n = (np.asarray(given[name]) for name in named)
    nodal = _Nodal(place, area, force, k_n, K)
    cells = [nodal.cells(group, rows, columns, weight) for group in groups]
    law = {name: np.concatenate([cell[name] for cell in cells]) for name in cells[0]}
    m = len(law["k_n"])
    if m == 0:
        raise InputError("contact points: all fields are zero, there is nothing to make a point of. Give the fields of a loaded contact.")
    normal, tangents = np.tile([0.0, 0.0, 1.0], (m, 1)), np.tile(np.eye(3)[:2], (m, 1, 1))
    return ContactLaw(normal=normal, tangents=tangents, source_tilt=_second_moments(place[:, :2], nodal.k_n), **law)


def _check_fields(faults: Faults, n: int, given: Mapping[str, FloatArray | None]) -> None:
    for name, array in given.items():
        wanted = (n, 2) if name == "tangential_stiffness" else (n,)
        if array is None or faults.add(array.shape != wanted, f"{name} has shape {array.shape}: {n} positions need {wanted}."):
            continue
        negative = int(np.count_nonzero(array < 0))
        faults.add(negative > 0, f"{name} is negative at {negative} places: forces press, areas and stiffnesses are >= 0.")


def _check_patches(faults: Faults, n: int, patches: Sequence[ArrayLike] | None) -> list[NDArray[np.int64]]:
    """Index arrays of the patches; a fault unless they name every node once."""
    if patches is None:
        return [np.arange(n)]
    groups = [np.asarray(patch).ravel() for patch in patches]
    if faults.add(
        not groups or any(g.size == 0 or g.dtype.kind not in "iu" or g.min() < 0 or g.max() >= n for g in groups),
        f"patches must be arrays of node numbers from 0 to {n - 1}, none of them empty.",
    ):
        return []
    count = np.bincount(np.concatenate(groups), minlength=n)
    faults.add(bool((count > 1).any()), f"patches name {int((count > 1).sum())} nodes more than once: give each node to one patch.")
    faults.add(
        bool((count < 1).any()), f"patches leave out {int((count < 1).sum())} of {n} nodes, whose forces would be lost: name every node."
    )
    return [g.astype(np.int64) for g in groups]


@dataclass(frozen=True)
class _Nodal:
    """Checked nodal fields; x (n, 3)."""

    x: FloatArray
    area: FloatArray
    force: FloatArray
    k_n: FloatArray
    k_t: FloatArray

    def cells(self, nodes: NDArray[np.int64], rows: int, columns: int, weight: Weight) -> dict[str, FloatArray]:
        """Fields of the contact points of one patch, row by row."""
        part = _Nodal(*(getattr(self, field.name)[nodes] for field in fields(self)))
        across, along = _shares(part.x[:, 1], rows), _shares(part.x[:, 0], columns)
        share = (across[:, None, :] * along[None, :, :]).reshape(rows * columns, -1)
        area, preload, k_n, k_t = share @ part.area, share @ part.force, share @ part.k_n, share @ part.k_t
        kept = (area > 0) | (preload > 0) | (k_n > 0) | (k_t > 0).any(axis=1)
        position = _centroids(share, part.x, [part.k_n, part.area] if weight == "stiffness" else [part.area])
        if weight == "area":
            total = part.area.sum()
            if not total > 0:
                raise InputError(
                    f'contact points: a patch of {len(nodes)} nodes has no area to share its stiffness by: use weight="stiffness".'
                )
            k_n, k_t = area / total * part.k_n.sum(), np.outer(area / total, part.k_t.sum(axis=0))
        found = {"position": position, "k_n": k_n, "k_t": k_t, "preload": preload, "area": area}
        return {name: values[kept] for name, values in found.items()}


def _shares(x: FloatArray, count: int) -> FloatArray:
    """(count, n) share of each node in each of `count` equal intervals; half and half on a border between two of them."""
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
    """(m, 3) centroid of each cell by the first weight that is not zero in it, by the nodes alone if all are."""
    position = np.zeros((len(share), x.shape[1]))
    todo = np.ones(len(share), dtype=bool)
    for weight in (*weights, np.ones(len(x))):
        part = share * weight
        total = part.sum(axis=1)
        now = todo & (total > 0)
        position[now] = (part[now] / total[now, None]) @ x
        todo &= ~now
    return position


def _second_moments(x: FloatArray, weight: FloatArray) -> FloatArray:
    """(2,) second moments of the weight about its centroid along the columns of x (n, 2)."""
    total = float(weight.sum())
    if not total > 0:
        return np.zeros(2)
    return np.asarray(weight @ (x - weight @ x / total) ** 2)
