"""The potential contact patch, nodes and quadrilaterals, and what is measured on it.

A lattice where the nodes are one, any quadrilaterals elsewhere. The patch is mirrored to the whole;
pressure, area and radius are measured there, and the area of a contact of any shape with its edge
located between the nodes.

At a smooth edge the pressure falls like the root of the distance s to it and the gap opens with
its power 3/2, with one factor B along both (plane strain across the edge):

    p = B sqrt(s)  inside,      g = (4 B / 3 E*) s^(3/2)  outside.

Between a node in contact and an open neighbour, c h apart across the edge (c the cosine between the
line between them and the edge's normal), B follows from both distances together,

    p^2 / B^2 + (3 E* g / 4 B)^(2/3) = c h,

and p^2 / B^2 / (c h) is the share of the line inside the contact. The edge is a chord in each
quadrilateral it crosses, which gives its normal. Where the contact reaches the rim of the patch
the face ends, and the area with it: a face wholly in contact has its own area exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import MeshError

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_NEWTON = 60


@dataclass(frozen=True)
class Patch:
    """Contact nodes of the model, and of the whole patch beyond its mirror planes.

    Attributes
    ----------
    x, y : (nx,) and (ny,) ndarray
        Lattice lines of the model [mm]; without a lattice the coordinates of its n nodes.
    order : (nx * ny,) or (n,) ndarray of int
        Node of the model's contact set at lattice place i * ny + j, or of each node.
    weights : (n,) ndarray
        Tributary areas of the model's nodes [mm2], in the order of the contact set.
    mirrored : tuple of two bool
        Whether the patch continues beyond the mirror planes x = 0, y = 0.
    quads : (m, 4) ndarray of int, optional
        Corners of the quadrilaterals of a patch that is no lattice, places in `order`. Its fields
        on the whole patch are (n_whole,), its X and Y as long.
    """

    x: Array
    y: Array
    order: NDArray[np.int64]
    weights: Array
    mirrored: tuple[bool, bool]
    quads: NDArray[np.int64] | None = None

    @property
    def X(self) -> Array:
        """Lattice lines of the whole patch in x [mm]."""
        return self._lines(0)

    @property
    def Y(self) -> Array:
        """Lattice lines of the whole patch in y [mm]."""
        return self._lines(1)

    def _lines(self, axis: int) -> Array:
        if self.quads is not None:
            return self._images()[1][:, axis]
        own = (self.x, self.y)[axis]
        return np.concatenate([-own[:0:-1], own]) if self.mirrored[axis] else own

    @property
    def spacing(self) -> float:
        """Largest node spacing [mm]: of a patch without a lattice the longest side."""
        if self.quads is not None:
            corners = np.column_stack([self.x, self.y])[self.quads]
            return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
        return float(max(np.diff(self.x).max(), np.diff(self.y).max()))

    def whole(self, field: ArrayLike, *, extensive: bool = False) -> Array:
        """A field of the model's contact nodes on the whole patch.

        Parameters
        ----------
        field : (n,) array_like
            Field in the order of the contact set.
        extensive : bool
            Extensive fields (nodal forces, areas) double on a mirror plane, where the model has
            half of the node.

        Returns
        -------
        (len(X), len(Y)) or, without a lattice, (n_whole,) ndarray
        """
        if self.quads is not None:
            place, _, share, _ = self._images()
            own = np.asarray(field, float)[self.order][place]
            return own * share if extensive else own
        out = np.asarray(field, float)[self.order].reshape(len(self.x), len(self.y))
        for axis, mirror in enumerate(self.mirrored):
            if not mirror:
                continue
            if extensive:
                double = np.ones(out.shape[axis])
                double[0] = 2.0
                out = out * (double[:, None] if axis == 0 else double[None, :])
            inner = np.flip(out, axis)[
                tuple(slice(None, -1) if a == axis else slice(None) for a in range(2))
            ]
            out = np.concatenate([inner, out], axis)
        return out

    def area(self) -> Array:
        """Tributary areas on the whole patch.

        Returns
        -------
        (len(X), len(Y)) ndarray
            Areas [mm2].
        """
        return self.whole(self.weights, extensive=True)

    def image(self) -> Patch:
        """Its mirror image about x = 0."""
        if self.quads is not None:
            return replace(self, x=-self.x)
        order = self.order.reshape(len(self.x), len(self.y))[::-1].ravel()
        return replace(self, x=-self.x[::-1], order=order)

    def slopes(self, field: ArrayLike) -> list[Array]:
        """Derivatives along x and y of a field of the model's nodes, on the whole patch.

        Without a lattice the mean at a node of the planes through each quadrilateral around it.
        """
        whole = self.whole(field)
        if self.quads is None:
            return list(np.gradient(whole, self.X, self.Y))
        points, cells = self.points(), self.cells()
        # The plane with the mean slopes of a quadrilateral goes by its diagonals.
        one, other = (points[cells[:, k + 2]] - points[cells[:, k]] for k in range(2))
        rise = [whole[cells[:, k + 2]] - whole[cells[:, k]] for k in range(2)]
        size = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
        count = np.bincount(cells.ravel(), minlength=len(points))
        return [
            np.bincount(cells.ravel(), np.repeat(slope / size, 4), len(points)) / count
            for slope in (
                rise[0] * other[:, 1] - rise[1] * one[:, 1],
                rise[1] * one[:, 0] - rise[0] * other[:, 0],
            )
        ]

    def points(self) -> Array:
        """(n_whole, 2) nodes of the whole patch [mm], in the order of a raveled field."""
        if self.quads is not None:
            return self._images()[1]
        lines = np.meshgrid(self.X, self.Y, indexing="ij")
        return np.column_stack([v.ravel() for v in lines])

    def cells(self) -> NDArray[np.int64]:
        """(m, 4) corners, places in `points`, of the quadrilaterals of the whole patch."""
        if self.quads is not None:
            return self._images()[3]
        n = len(self.Y)
        first = (np.arange(len(self.X) - 1)[:, None] * n + np.arange(n - 1)).ravel()
        return np.asarray(first[:, None] + np.array([0, n, n + 1, 1]))

    def rim(self) -> NDArray[np.bool_]:
        """(n_whole,) nodes on a side that only one quadrilateral has."""
        cells = self.cells()
        sides = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2))
        found, count = np.unique(sides, axis=0, return_counts=True)
        out = np.zeros(len(self.points()), bool)
        out[found[count == 1]] = True
        return out

    def _images(self) -> tuple[NDArray[np.int64], Array, Array, NDArray[np.int64]]:
        """Of a patch without a lattice: node of the model, point and share (2 on a mirror plane)
        of every node of the whole, and its quadrilaterals.
        """
        assert self.quads is not None
        place, quads = np.arange(len(self.x)), self.quads
        xy, share = np.column_stack([self.x, self.y]), np.ones(len(self.x))
        for axis in np.flatnonzero(self.mirrored):
            off = np.flatnonzero(xy[:, axis] != 0.0)
            share = np.where(xy[:, axis] == 0.0, 2.0 * share, share)
            image = np.arange(len(xy))
            image[off] = len(xy) + np.arange(len(off))
            flip = np.where(np.arange(2) == axis, -1.0, 1.0)
            quads = np.concatenate([quads, image[quads]])
            xy = np.concatenate([xy, xy[off] * flip])
            place, share = np.append(place, place[off]), np.append(share, share[off])
        return place, xy, share, quads


def make_patch(
    points: Array,
    weights: Array,
    mirrored: tuple[bool, bool],
    members: NDArray[np.int64] | None = None,
    quads: NDArray[np.int64] | None = None,
) -> Patch:
    """The patch of contact nodes: the lattice behind them, or their quadrilaterals.

    Parameters
    ----------
    points : (n, 2) or (n, 3) ndarray
        Contact nodes [mm].
    weights : (n,) ndarray
        Tributary areas [mm2].
    mirrored : tuple of two bool
        Whether the patch continues beyond the mirror planes x = 0, y = 0.
    members : (k,) ndarray of int, optional
        The nodes of this patch among `points`; None takes all of them.
    quads : (m, 4) ndarray of int, optional
        Quadrilaterals of `points`, those of this patch among them, for nodes that are no lattice.

    Returns
    -------
    Patch

    Raises
    ------
    MeshError
        When the nodes are no lattice and no quadrilaterals are given, or two are at one place.
    """
    members = np.arange(len(points)) if members is None else members
    mine = points[members]
    scale = float(np.ptp(mine[:, :2], axis=0).max())
    x, y = (_lattice_lines(mine[:, k], scale) for k in range(2))
    if len(x) * len(y) != len(mine) and quads is not None:
        place = np.full(len(points), -1, np.int64)
        place[members] = np.arange(len(members))
        own = place[quads]
        return Patch(
            mine[:, 0], mine[:, 1], members, weights, mirrored, own[(own >= 0).all(axis=1)]
        )
    if len(x) * len(y) != len(mine):
        raise MeshError(
            f"contact nodes are no lattice: {len(mine)} nodes on {len(x)} x {len(y)} "
            "lines; mesh the patch with a regular grid"
        )
    i = np.abs(mine[:, 0, None] - x).argmin(1)
    j = np.abs(mine[:, 1, None] - y).argmin(1)
    order = np.full(len(mine), -1, np.int64)
    order[i * len(y) + j] = members
    if (order < 0).any():
        raise MeshError("contact nodes are no lattice: two nodes are at one place")
    return Patch(x, y, order, weights, mirrored)


def _lattice_lines(values: Array, scale: float) -> Array:
    ordered = np.sort(values)
    starts = np.concatenate([[True], np.diff(ordered) > 1e-6 * scale])
    return np.asarray(
        np.add.reduceat(ordered, np.flatnonzero(starts))
        / np.diff(np.append(np.flatnonzero(starts), len(ordered)))
    )


@dataclass(frozen=True)
class ContactMeasures:
    """Size and pressure of one contact.

    Attributes
    ----------
    radius_moment : float
        From the second moment of the forces [mm], a^2 = 2.5 sum f r^2 / F (exact for Hertz's
        pressure); the smooth one.
    radius_area : float
        Of the circle with the area of the nodes in contact [mm].
    radius_outermost : float
        Distance of the outermost node in contact [mm].
    area : float
        Area [mm2]: with its edge located between the nodes where that was done, otherwise of the
        ellipse with the same second moments, pi a_x a_y with a_x^2 = 5 sum f x^2 / F about the
        centre of force, which is the area of Hertz's pressure and of no other.
    area_nodes : float
        Sum of the tributary areas of the nodes in contact [mm2]: steps of one lattice cell, and
        nodes up to a spacing outside the true edge carry a share of the pressure inside it.
    max_pressure : float
        Largest pressure at a node [MPa].
    mean_pressure : float
        F / area [MPa].
    area_resolution : float or None
        What the lattice leaves open of a located area [mm2].
    """

    radius_moment: float
    radius_area: float
    radius_outermost: float
    area: float
    area_nodes: float
    max_pressure: float
    mean_pressure: float
    area_resolution: float | None = None


def measure(
    patch: Patch,
    force: Array,
    located: tuple[float, float] | None = None,
    pressure: Array | None = None,
) -> ContactMeasures:
    """Measures of one contact from its nodal forces.

    Parameters
    ----------
    patch : Patch
    force : (len(X), len(Y)) or (n_whole,) ndarray
        Nodal forces on the whole patch [N].
    located : (area, resolution), optional
        Area with its edge located, for a contact of any shape; None takes Hertz's ellipse.
    pressure : (len(X), len(Y)) ndarray, optional
        At the nodes [MPa]; None takes force over tributary area.

    Returns
    -------
    ContactMeasures
        All zero without force.
    """
    weights = patch.area()
    contact = force > 0.0
    total = float(force.sum())
    if not total > 0.0:
        return ContactMeasures(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    share, points = (force / total).ravel(), patch.points()
    away = points - share @ points
    mxx, myy = (float(m) for m in share @ away**2)
    area_nodes = float(weights[contact].sum())
    # One node alone has no second moment: its area is its own cell.
    area = located[0] if located else 5.0 * np.pi * np.sqrt(mxx * myy) or area_nodes
    return ContactMeasures(
        radius_moment=float(np.sqrt(2.5 * (mxx + myy))),
        radius_area=float(np.sqrt(area_nodes / np.pi)),
        radius_outermost=float(np.linalg.norm(away[contact.ravel()], axis=1).max()),
        area=float(area),
        area_nodes=area_nodes,
        max_pressure=float((force / weights if pressure is None else pressure).max()),
        mean_pressure=total / float(area),
        area_resolution=located[1] if located else None,
    )


def consistent_average(patch: Patch, field: Callable[[Array], Array], samples: int = 12) -> Array:
    """What the lattice's nodes see of a field of the radius.

    Nodal forces are such averages of the pressure, so a closed form with a kink or an edge inside a
    cell is compared with them this way.

    Parameters
    ----------
    patch : Patch
    field : callable
        Field as a function of the radius [mm], element by element.
    samples : int
        Samples per cell and direction.

    Returns
    -------
    (len(X), len(Y)) ndarray
        int phi_i field dA / int phi_i dA with bilinear phi_i, on the whole patch.
    """
    t = (2.0 * np.arange(samples) + 1.0) / samples - 1.0
    hat = (1.0 - np.abs(t)) / (1.0 - np.abs(t)).sum()
    hx, hy = (float(np.diff(lines).mean()) for lines in (patch.X, patch.Y))
    x = patch.X[:, None, None, None] + hx * t[:, None]
    y = patch.Y[None, :, None, None] + hy * t[None, :]
    return np.asarray(np.einsum("ijab,a,b->ij", field(np.hypot(x, y)), hat, hat))


def located_area(
    points: Array,
    quads: NDArray[np.int64],
    pressure: Array,
    gap: Array,
    contact: BoolArray,
    modulus: float,
) -> tuple[float, float]:
    """Area of the contact on quadrilaterals between nodes.

    Second order in the spacing for smooth edges; where a face ends or steps between two nodes, the
    resolution is all that is known.

    Parameters
    ----------
    points : (n, 2) ndarray
        Nodes [mm].
    quads : (m, 4) ndarray of int
        Corners of the quadrilaterals, around each.
    pressure, gap : (n,) ndarray
        At the nodes, loaded [MPa, mm].
    contact : (n,) ndarray of bool
        Nodes in contact.
    modulus : float
        Contact modulus E* [MPa].

    Returns
    -------
    area : float
        mm2.
    resolution : float
        Half the area of the quadrilaterals that the edge crosses [mm2]: the area lies this far from
        the middle of what the nodes leave possible, at most. Zero for a face wholly in contact.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), section 4.2(c): the cylinder's pressure and gap, taken
    near the edge.
    """
    closed = contact[quads].sum(axis=1)
    px, py = np.moveaxis(points[quads], 2, 0)
    cell = 0.5 * np.abs((px * np.roll(py, -1, 1) - py * np.roll(px, -1, 1)).sum(axis=1))
    cut = (closed > 0) & (closed < 4)
    crossed = quads[cut]
    whole = float(cell[closed == 4].sum())
    if not len(crossed):
        return whole, 0.0
    # both as a length but for B: the squared pressure of closed nodes, and the opening to the power
    # 2/3 of the others
    away = np.where(contact, pressure**2, np.cbrt(0.75 * modulus * np.maximum(gap, 0.0)) ** 2)
    # The first pass takes the lines between nodes for normals, the second has the normals.
    _, normals = _cut(points, away, contact, crossed, {})
    areas, _ = _cut(points, away, contact, crossed, normals)
    return whole + areas, 0.5 * float(cell[cut].sum())


def _share(inside: float, opening: float, length: float) -> float:
    """inside u^3 / length with inside u^3 + opening u = length, u = B^(-2/3): rising, one root."""
    if inside == 0.0:
        return 0.0
    if opening == 0.0:
        return 1.0
    # Both bounds are above the root, from where Newton falls to it on a convex function.
    u = min(float(np.cbrt(length / inside)), length / opening)
    for _ in range(_NEWTON):
        step = (inside * u**3 + opening * u - length) / (3.0 * inside * u**2 + opening)
        u -= step
        if step <= np.finfo(float).eps * u:
            break
    return inside * u**3 / length


def _cut(
    points: Array,
    away: Array,
    contact: BoolArray,
    crossed: NDArray[np.int64],
    cosines: Mapping[tuple[int, int], float],
) -> tuple[float, dict[tuple[int, int], float]]:
    """Area in contact of the quadrilaterals that the edge crosses, and line from a node in contact
    to an open one -> cosine between it and the normal of the chords that end on it.
    """
    area = 0.0
    found: dict[tuple[int, int], list[float]] = {}
    for ring in crossed.tolist():
        corners, ends = [], []
        for k, node in enumerate(ring):
            after = ring[(k + 1) % 4]
            if contact[node]:
                corners.append(points[node])
            if contact[node] != contact[after]:
                a, b = key = (node, after) if contact[node] else (after, node)
                line = points[b] - points[a]
                length = cosines.get(key, 1.0) * float(np.hypot(*line))
                share = _share(float(away[a]), float(away[b]), max(length, np.finfo(float).tiny))
                corners.append(points[a] + line * share)
                ends.append((key, corners[-1]))
        px, py = np.array(corners).T
        area += 0.5 * abs(float(px @ np.roll(py, -1) - py @ np.roll(px, -1)))
        if len(ends) == 2:
            chord = ends[1][1] - ends[0][1]
            size = float(np.hypot(*chord))
            for key, _ in ends if size > 0.0 else ():
                line = points[key[1]] - points[key[0]]
                across = abs(float(line[0] * chord[1] - line[1] * chord[0]))
                found.setdefault(key, []).append(across / (size * float(np.hypot(*line))))
    return area, {key: float(np.mean(c)) for key, c in found.items()}
