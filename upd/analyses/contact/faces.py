"""Fields of the contact nodes on the lattices of the whole contact, mirror images included, and in
the axes they are reported in.

Report axes: of a curved contact those of the model, of a flat one with the origin at the bottom
left corner of all patches together, x along the damper, y up the slope, as in the source thesis.

Of flat faces the contact points of a dynamic model, and where the pressure peaks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.solution import ContactSolution, NormalCase, TangentialCase
from upd.contact.law import ContactLaw, contact_points
from upd.contact.normal import NormalContact
from upd.contact.patch import ContactMeasures, LocatedArea, Patch, located_area, measure

Array = NDArray[np.float64]


def lattices(solution: ContactSolution) -> dict[str, Patch]:
    """The patches of the whole contact by name, from left to right."""
    found = dict(solution.model.patches)
    if 0 in solution.plan.mirrors:
        found |= {
            {"right": "left"}.get(name, f"{name} mirrored"): patch.image()
            for name, patch in solution.model.patches.items()
            if not patch.mirrored[0]
        }
    return dict(sorted(found.items(), key=lambda item: float(item[1].X.min())))


def on_lines(patch: Patch, fields: Sequence[Array]) -> tuple[Array, Array, list[Array]]:
    """Lattice lines and fields of the model's nodes on them; without lines on as many even ones as
    there are nodes, linear between the nodes and zero off the patch.
    """
    whole = [patch.whole(one) for one in fields]
    if patch.quads is None:
        return patch.X, patch.Y, whole
    # slow to import: only where it is called
    from scipy.interpolate import LinearNDInterpolator

    points = patch.points()
    n = int(np.ceil(np.sqrt(len(points))))
    x, y = (np.linspace(v.min(), v.max(), n) for v in points.T)
    between = LinearNDInterpolator(points, np.column_stack(whole), 0.0)
    found = between(*np.meshgrid(x, y, indexing="ij"))
    return x, y, list(np.moveaxis(found, -1, 0))


def measured(solution: ContactSolution, answer: NormalContact, load: float) -> ContactMeasures:
    """Size and pressure of the whole contact under one normal load in N; flat faces have no radius.

    The edge is located between the nodes, but of a sphere, whose area is that of Hertz's pressure.
    """
    faces = list(lattices(solution).values())
    forces = [k.whole(answer.force, extensive=True) for k in faces]
    pressure = solution.model.multipliers.pressure(answer.force)
    located = None
    if solution.plan.scene.sphere_radius is None:
        found = [
            located_area(
                k.points(),
                k.cells(),
                (f / k.area()).ravel(),
                k.whole(answer.gap).ravel(),
                (f > 0.0).ravel(),
                solution.modulus,
            )
            for k, f in zip(faces, forces, strict=True)
        ]
        located = LocatedArea(sum(a.area for a in found), sum(a.resolution for a in found))
    if solution.curved:
        return measure(solution.model.patch, forces[0], located, faces[0].whole(pressure))
    assert located is not None
    none = float("nan")
    return ContactMeasures(
        none,
        none,
        none,
        located.area,
        sum(float(k.area()[f > 0.0].sum()) for k, f in zip(faces, forces, strict=True)),
        float(pressure.max()),
        load / located.area if located.area else 0.0,
        located.resolution,
    )


def area_of(solution: ContactSolution, nodes: NDArray[np.bool_]) -> float:
    """Tributary area of nodes (n,) on the whole contact, mm2."""
    return sum(float(k.area()[k.whole(nodes) > 0.0].sum()) for k in lattices(solution).values())


def tractions(solution: ContactSolution, t: TangentialCase) -> list[Array]:
    """(n,) traction at the nodes in MPa, direction by direction."""
    loaded = t.pressed > 0.0
    return [solution.model.multipliers.pressure(force, loaded) for force in t.force.T]


def rim_nodes(solution: ContactSolution, case: NormalCase) -> int:
    """How many nodes of the rim of a curved contact's patch carry force."""
    patch = solution.model.patch
    return int((patch.whole(case.solution.force).ravel()[patch.rim()] > 0.0).sum())


def corner(solution: ContactSolution) -> Array:
    """(2,) origin of the report axes in contact axes, mm."""
    if solution.curved:
        return np.zeros(2)
    found = lattices(solution).values()
    return np.array([min(k.X.min() for k in found), min(k.Y.min() for k in found)])


# -- contact points of a dynamic model -------------------------------------------------------------


def contact_law(solution: ContactSolution, case: NormalCase) -> ContactLaw | None:
    """Contact points of a dynamic model, contact axes, from the fields after one normal load.

    None under no load.
    """
    choice, upper = solution.plan.scene.law, solution.model.upper.name
    force, both = case.solution.force, solution.plan.scene.law.bodies == "both"
    if case.force == 0.0 or not force.any():
        return None

    def sheared(direction: float) -> float:
        """Of the model, N/mm."""
        ways = [stuck for d, stuck in case.stuck.items() if d % 180.0 == direction]
        totals = [total if both else of[upper] for total, of in ways]
        return totals[0] / solution.plan.copies if totals else 0.0

    # Shared out like the pressure, which pushes everywhere; stiffness fields may pull at single
    # nodes, which no spring can. The total is that with the tilt held: the tilt is the dynamic
    # body's own.
    share = force / force.sum()
    answer = case if both else case.alone[upper]
    totals = [share * answer.solution.stiffness, share * sheared(0.0), share * sheared(90.0)]
    points, areas, fields, patches = _whole(solution, [force, *totals])
    preload, k_n, k_x, k_y = fields
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


def _whole(
    solution: ContactSolution, fields: list[Array]
) -> tuple[Array, Array, list[Array], list[NDArray[np.int64]]]:
    """Points, areas and extensive fields of the whole contact, and the nodes of each patch in
    them.
    """
    faces = list(lattices(solution).values())
    points = [k.points() for k in faces]
    ends = np.cumsum([len(one) for one in points])
    whole = [np.concatenate([k.whole(f, extensive=True).ravel() for k in faces]) for f in fields]
    areas = np.concatenate([k.area().ravel() for k in faces])
    return np.vstack(points), areas, whole, np.split(np.arange(ends[-1]), ends[:-1])


# -- peaks of the pressure of flat faces ----------------------------------------------------------


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
    for lattice in (k for k in lattices(solution).values() if k.quads is None):
        force = lattice.whole(case.solution.force, extensive=True)[1:-1]
        # normal force per length along x, N/mm: over the length each column stands for
        X, lengths = lattice.X[1:-1], lattice.area().sum(axis=1)[1:-1] / np.ptp(lattice.Y)
        p = force.sum(axis=1) / lengths
        tops, _ = find_peaks(p, prominence=0.1 * float(p.max(initial=0.0)), plateau_size=1)
        _, _, left, right = peak_widths(p, tops, rel_height=0.5)
        places = np.arange(len(X))
        for begin, end in zip(left, right, strict=True):
            inside = (places >= begin) & (places <= end)
            middle, across = np.interp([begin, end], places, X).mean(), force[inside].sum(axis=0)
            found.append((middle - origin[0], float(across @ lattice.Y / across.sum()) - origin[1]))
    return [(float(x), float(y)) for x, y in found]
