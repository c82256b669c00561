"""Fields of the contact nodes on the lattices of the whole contact, mirror images included, and in
the axes they are reported in.

Report axes: of a curved contact those of the model, of a flat one with the origin at the bottom
left corner of all patches together, x along the damper, y up the slope, as in the source thesis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.analyses.contact.solution import ContactSolution, NormalCase, TangentialCase
from upd.contact.edge import LocatedArea, located_area
from upd.contact.normal import NormalContact
from upd.contact.patch import ContactMeasures, Patch, measure

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
        return self._turned(-self.patch.X) if self.flipped else self.patch.X

    @property
    def Y(self) -> Array:
        """Lattice lines up the slope."""
        return self.patch.Y

    def field(self, values: ArrayLike, *, extensive: bool = False) -> Array:
        """(len(X), len(Y)) of a field of the model's contact nodes (n,) that is even about the
        mirror plane.
        """
        out = self.patch.whole(values, extensive=extensive)
        return self._turned(out) if self.flipped else out

    def _turned(self, field: Array) -> Array:
        """Lines from left to right; nodes without lines keep their order."""
        return field[::-1] if self.lattice else field

    def even(self, fields: Sequence[Array]) -> tuple[Array, Array, list[Array]]:
        """Lattice lines and fields of the model's nodes on them; without lines on as many even
        ones as there are nodes, linear between the nodes and zero off the patch.
        """
        whole = [self.field(one) for one in fields]
        if self.lattice:
            return self.X, self.Y, whole
        # slow to import: only where it is called
        from scipy.interpolate import LinearNDInterpolator

        n = int(np.ceil(np.sqrt(self.X.size)))
        x, y = (np.linspace(v.min(), v.max(), n) for v in self.nodes())
        between = LinearNDInterpolator(np.column_stack(self.nodes()), np.column_stack(whole), 0.0)
        found = between(*np.meshgrid(x, y, indexing="ij"))
        return x, y, list(np.moveaxis(found, -1, 0))

    @property
    def lattice(self) -> bool:
        """Whether the nodes lie on lines."""
        return self.patch.quads is None

    def nodes(self) -> tuple[Array, Array]:
        """x and y of every node, mm, each of the shape of a field."""
        if not self.lattice:
            return self.X, self.Y
        X, Y = np.meshgrid(self.X, self.Y, indexing="ij")
        return X, Y

    def area(self) -> Array:
        """Tributary areas in mm2."""
        return self.field(self.patch.weights, extensive=True)


def lattices(solution: ContactSolution) -> list[FaceLattice]:
    """The patches of the whole contact, from left to right."""
    found = [FaceLattice(name, patch, False) for name, patch in solution.model.patches.items()]
    if 0 in solution.plan.mirrors:
        found += [
            FaceLattice({"right": "left"}.get(k.name, f"{k.name} mirrored"), k.patch, True)
            for k in found
            if not k.patch.mirrored[0]
        ]
    return sorted(found, key=lambda k: float(k.X.min()))


def measured(solution: ContactSolution, answer: NormalContact, load: float) -> ContactMeasures:
    """Size and pressure of the whole contact under one normal load in N; flat faces have no radius.

    The edge is located between the nodes, but of a sphere, whose area is that of Hertz's pressure.
    """
    faces = lattices(solution)
    forces = [k.field(answer.force, extensive=True) for k in faces]
    pressure = solution.model.multipliers.pressure(answer.force)
    located = None
    if solution.plan.scene.sphere_radius is None:
        found = [
            located_area(
                np.column_stack([v.ravel() for v in k.nodes()]),
                k.patch.cells(),
                (f / k.area()).ravel(),
                k.field(answer.gap).ravel(),
                (f > 0.0).ravel(),
                solution.modulus,
            )
            for k, f in zip(faces, forces, strict=True)
        ]
        located = LocatedArea(sum(a.area for a in found), sum(a.resolution for a in found))
    if solution.curved:
        return measure(solution.model.patch, forces[0], located, faces[0].field(pressure))
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
        sum(int((f > 0.0).sum()) for f in forces),
        located.resolution,
    )


def area_of(solution: ContactSolution, nodes: NDArray[np.bool_]) -> float:
    """Tributary area of nodes (n,) on the whole contact, mm2."""
    return sum(
        float(k.area()[k.field(nodes.astype(float)) > 0.0].sum()) for k in lattices(solution)
    )


def tractions(solution: ContactSolution, t: TangentialCase) -> list[Array]:
    """(n,) traction at the nodes in MPa, direction by direction."""
    loaded = t.pressed > 0.0
    return [solution.model.multipliers.pressure(force, loaded) for force in t.force.T]


def rim_nodes(solution: ContactSolution, case: NormalCase) -> int:
    """How many nodes of the rim of a curved contact's patch carry force."""
    force = solution.model.patch.whole(case.solution.force)
    if solution.model.patch.quads is not None:
        return int((force[solution.model.patch.rim()] > 0.0).sum())
    rim = np.concatenate([force[0], force[-1], force[:, 0], force[:, -1]])
    return int((rim > 0.0).sum())


def corner(solution: ContactSolution) -> Array:
    """(2,) origin of the report axes in contact axes, mm."""
    if solution.curved:
        return np.zeros(2)
    found = lattices(solution)
    return np.array([min(k.X.min() for k in found), min(k.Y.min() for k in found)])
