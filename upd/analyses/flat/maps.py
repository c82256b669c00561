"""Fields of the contact nodes on the lattices of the whole contact, mirror images included, and in
the axes they are reported in.

Report axes: origin at the bottom left corner of all patches together, x along the damper, y up the
slope, as in the source thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.analyses.contact.loading import contact_points_of
from upd.analyses.contact.plan import NORMAL
from upd.analyses.contact.solution import FlatNormalCase, FlatSolution
from upd.contact.edge import LocatedArea, located_area
from upd.contact.law import ContactLaw, contact_points
from upd.contact.normal import NormalContact
from upd.contact.patch import Patch
from upd.reference import contact_modulus

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FaceLattice:
    """One patch of the whole contact: lattice lines in contact axes, mm.

    Attributes
    ----------
    flipped
        It is the mirror image of the model's.
    """

    name: str
    patch: Patch
    flipped: bool

    @property
    def X(self) -> Array:
        """Lattice lines along the damper."""
        return -self.patch.X[::-1] if self.flipped else self.patch.X

    @property
    def Y(self) -> Array:
        """Lattice lines up the slope."""
        return self.patch.Y

    def field(self, values: ArrayLike, *, extensive: bool = False) -> Array:
        """(len(X), len(Y)) of a field of the model's contact nodes (n,) that is even about the
        mirror plane.
        """
        out = self.patch.whole(values, extensive=extensive)
        return out[::-1] if self.flipped else out

    def area(self) -> Array:
        """Tributary areas in mm2."""
        return self.field(self.patch.weights, extensive=True)


def lattices(solution: FlatSolution) -> list[FaceLattice]:
    """The patches of the whole contact, from left to right."""
    found = [FaceLattice(name, patch, False) for name, patch in solution.model.patches.items()]
    if 0 in solution.plan.mirrors:
        found += [
            FaceLattice({"right": "left"}.get(k.name, f"{k.name} mirrored"), k.patch, True)
            for k in found
            if not k.patch.mirrored[0]
        ]
    return sorted(found, key=lambda k: float(k.X[0]))


def whole_area(solution: FlatSolution, answer: NormalContact) -> LocatedArea:
    """Area of the whole contact under one normal load, its edge located between the nodes."""
    upper, lower = (
        solution.plan.scene.materials[body.name]
        for body in (solution.model.upper, solution.model.lower)
    )
    modulus = contact_modulus(upper.E, upper.nu, lower.E, lower.nu)
    pressure = answer.force / solution.model.multipliers.weights
    found = [
        located_area(
            k.X, k.Y, k.field(pressure), k.field(answer.gap), k.field(answer.force) > 0.0, modulus
        )
        for k in lattices(solution)
    ]
    return LocatedArea(sum(a.area for a in found), sum(a.resolution for a in found))


def corner(solution: FlatSolution) -> Array:
    """(2,) origin of the report axes in contact axes, mm."""
    found = lattices(solution)
    return np.array([min(k.X[0] for k in found), min(k.Y[0] for k in found)])


def line_pressure(lattice: FaceLattice, force: Array) -> Array:
    """(len(X),) normal force per length along x in N/mm.

    Nodal forces summed over y, over the length each column stands for.
    """
    return np.asarray(
        lattice.field(force, extensive=True).sum(axis=1)
        * np.ptp(lattice.Y)
        / lattice.area().sum(axis=1)
    )


def pressure_peaks(solution: FlatSolution, case: FlatNormalCase) -> list[tuple[float, float]]:
    """Where the pressure peaks, report axes in mm.

    Middle at half height of each peak of the force per length, centre of force across it.

    The outermost columns are left out: the edge of a flat punch has a peak of its own on any mesh.
    A peak stands out by a tenth of the largest value.
    """
    # slow to import: only where it is called
    from scipy.signal import find_peaks, peak_widths

    found, origin = [], corner(solution)
    for lattice in lattices(solution):
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


def contact_law(solution: FlatSolution, case: FlatNormalCase) -> ContactLaw | None:
    """Contact points of a dynamic model, contact axes, from the fields after one normal load.

    None under no load.
    """
    choice, model = solution.plan.scene.law, solution.model
    force = case.solution.force
    if case.force == 0.0 or not force.any():
        return None
    # Shared out like the pressure, which pushes everywhere; stiffness fields may pull at single
    # nodes, which no spring can. The total is that with the tilt held: the tilt is the dynamic
    # body's own.
    share = force / force.sum()
    answer = case.solution if choice.bodies == "both" else case.alone[model.upper.name]
    normal, shear = share * answer.stiffness, []
    for direction in (0.0, 90.0):
        stuck = next(
            (
                s
                for s in solution.stuck
                if s.normal == case.case and s.direction % 180.0 == direction
            ),
            None,
        )
        total = (
            0.0
            if stuck is None
            else stuck.total
            if choice.bodies == "both"
            else stuck.of[model.upper.name]
        )
        shear.append(share * total / solution.plan.copies)
    points, areas, preload, k_n, k_x, k_y, patches = _whole(solution, [force, normal, *shear])
    return contact_points(
        points,
        areas,
        preload,
        k_n,
        np.column_stack([k_x, k_y]),
        choice.rows,
        choice.columns,
        choice.weight,
        patches,
    )


def tilt_stiffness(solution: FlatSolution, case: FlatNormalCase) -> dict[str, float]:
    """Resistance of the contact to a tilt of the damper, N mm per rad, by the axis its arms run
    along.

    About the centre of stiffness, contact set held. A tilt along x is odd about the mirror plane:
    known on the full model only.
    """
    model = solution.model
    on = np.flatnonzero(case.solution.contact)
    if len(on) < 3:
        return {}
    points = contact_points_of(model)[on]
    B = np.linalg.inv(model.compliance(NORMAL)[np.ix_(on, on)])
    e, out = B.sum(axis=1), {}
    for k, axis in enumerate("xy"):
        if axis == "y" or 0 not in solution.plan.mirrors:
            arm = points[:, k] - float(e @ points[:, k]) / float(e.sum())
            out[axis] = solution.plan.copies * float(arm @ B @ arm)
    return out


def _whole(
    solution: FlatSolution, fields: list[Array]
) -> tuple[Array, Array, Array, Array, Array, Array, list[NDArray[np.int64]]]:
    """Points, areas and extensive fields of the whole contact, and the nodes of each patch in
    them.
    """
    points, areas, values, patches, n = [], [], [], [], 0
    for lattice in lattices(solution):
        X, Y = np.meshgrid(lattice.X, lattice.Y, indexing="ij")
        points.append(np.column_stack([X.ravel(), Y.ravel()]))
        areas.append(lattice.area().ravel())
        values.append([lattice.field(f, extensive=True).ravel() for f in fields])
        patches.append(np.arange(n, n + X.size))
        n += X.size
    f, k_n, k_x, k_y = (np.concatenate([v[i] for v in values]) for i in range(4))
    return np.vstack(points), np.concatenate(areas), f, k_n, k_x, k_y, patches
