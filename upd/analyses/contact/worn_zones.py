"""Where the pressure of flat faces peaks, and the bands of the damper that the load comes from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from upd.analyses.contact.faces import FaceLattice, corner, lattices
from upd.analyses.contact.solution import ContactSolution, NormalCase
from upd.mesh import IntArray, Mesh

Array = NDArray[np.float64]


def band_centres(solution: ContactSolution) -> list[float]:
    """Middles along x (contact axes, mm) of the parts of the damper's distant set, which the loads
    come from, both sides of a mirror.
    """
    upper = solution.model.upper.mesh
    nodes = upper.nodes["distant"]
    x, weights = upper.points[nodes, 0], upper.weights.get("distant")
    found = []  # lower and upper end, middle
    for part in _joined(upper, nodes):
        # A set without weights is as wide as its nodes lie apart.
        low, high = float(x[part].min()), float(x[part].max())
        middle = 0.5 * (low + high)
        if weights is not None:
            middle = float(weights[part] @ x[part] / weights[part].sum())
        if 0 not in solution.plan.mirrors:
            found.append((low, high, middle))
        elif low > 0.0:
            found += [(low, high, middle), (-high, -low, -middle)]
        else:
            found.append((-high, high, 0.0))
    return [middle for _, _, middle in sorted(found)]


def _joined(mesh: Mesh, nodes: IntArray) -> list[IntArray]:
    """Positions in ``nodes`` of those that elements join, part by part."""
    number = np.full(mesh.n_node, -1)
    number[nodes] = np.arange(len(nodes))
    at = number[mesh.hexes]
    first = np.broadcast_to(at.max(axis=1, keepdims=True), at.shape)
    both = at >= 0
    links = coo_array((np.ones(both.sum()), (first[both], at[both])), shape=(len(nodes),) * 2)
    count, part = connected_components(links, directed=False)
    return [np.flatnonzero(part == k) for k in range(count)]


def band_middles(solution: ContactSolution) -> list[float]:
    """The same in report axes, mm."""
    return [float(c - corner(solution)[0]) for c in band_centres(solution)]


def line_pressure(lattice: FaceLattice, force: Array) -> Array:
    """(len(X),) normal force per length along x in N/mm.

    Nodal forces summed over y, over the length each column stands for.
    """
    return np.asarray(
        lattice.field(force, extensive=True).sum(axis=1)
        * np.ptp(lattice.Y)
        / lattice.area().sum(axis=1)
    )


def pressure_peaks(solution: ContactSolution, case: NormalCase) -> list[tuple[float, float]]:
    """Where the pressure peaks, report axes in mm.

    Middle at half height of each peak of the force per length, centre of force across it.

    The outermost columns are left out: the edge of a flat punch has a peak of its own on any mesh.
    A peak stands out by a tenth of the largest value. Without lattice lines there is no force per
    length, and no peak is sought.
    """
    # slow to import: only where it is called
    from scipy.signal import find_peaks, peak_widths

    found, origin = [], corner(solution)
    for lattice in (k for k in lattices(solution) if k.lattice):
        force = lattice.field(case.solution.force, extensive=True)[1:-1]
        X, p = lattice.X[1:-1], line_pressure(lattice, case.solution.force)[1:-1]
        tops, _ = find_peaks(p, prominence=0.1 * float(p.max(initial=0.0)), plateau_size=1)
        _, _, left, right = peak_widths(p, tops, rel_height=0.5)
        places = np.arange(len(X))
        for begin, end in zip(left, right, strict=True):
            inside = (places >= begin) & (places <= end)
            middle = float(np.interp([begin, end], places, X).mean())
            found.append(
                (middle - origin[0], _centre(force[inside].sum(axis=0), lattice.Y) - origin[1])
            )
    return [(float(x), float(y)) for x, y in found]


def _centre(force: Array, Y: Array) -> float:
    return float(force @ Y / force.sum())
